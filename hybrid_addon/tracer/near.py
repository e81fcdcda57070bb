"""Pairs of triangles that come near one another, and what is known of the media where a ray hits one of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32, Float64
from .constants import MOST_NEAR, NEAR
from .geometry import Geometry
from .soup import corner_bounds
from .touching import Boxes
from .vectors import Index, flatnonzero, take

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]
Stack = NDArray[np.int32]

TOGETHER = 256
"""Triangles that are compared at once: those of a mesh that follow one another are mostly neighbours."""


@dataclass(frozen=True, eq=False)
class Near:
    """Pairs of triangles of different parts that come near one another.

    start : (nt + 1,) where the others of each triangle begin.   other : (k,) these, triangle by triangle.
    """

    start: Numbers
    other: Numbers

    def of(self, prim: Numbers) -> tuple[Numbers, Numbers]:
        """For triangles (n,): numbers (k,) of those that have others, as often as they have, and the others (k,)."""
        first = self.start.take(prim, mode="clip")
        count = self.start.take(prim + 1, mode="clip") - first
        which = np.repeat(np.arange(len(prim)), count)
        within = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        return which, self.other[first[which] + within]


def find_near(g: Geometry, prims: Numbers, size: Numbers) -> Near | None:
    """Pairs among the parts with triangles `prims` (p,), `size` (b,) of each; None: there are none, or too many."""
    starts = np.cumsum(size) - size
    low, high = corner_bounds(g.vertices, g.triangles[prims])
    room = (NEAR * g.extent[prims]).astype(np.float64)
    runs = starts[size > 0]
    if len(runs) < 2:
        return None
    most = np.maximum.reduceat(room, runs)[:, None]
    bottom, top = np.minimum.reduceat(low, runs, axis=0) - most, np.maximum.reduceat(high, runs, axis=0) + most
    order = np.argsort(bottom[:, 0], kind="stable")
    left: list[Numbers] = []
    right: list[Numbers] = []
    found, asked = 0, 0
    for k, i in enumerate(order.tolist()):
        others = order[k + 1 :]
        others = others[: np.searchsorted(bottom[others, 0], top[i, 0], side="right")]
        others = others[((bottom[others] <= top[i]) & (top[others] >= bottom[i])).all(axis=1)]
        mine = slice(int(runs[i]), int(runs[i] + size[size > 0][i]))
        for j in others.tolist():
            theirs = slice(int(runs[j]), int(runs[j] + size[size > 0][j]))
            a, b = _pairs(low, high, room, mine, theirs, np.maximum(bottom[i], bottom[j]), np.minimum(top[i], top[j]))
            near = _come_near(g, prims[a], prims[b])
            left.append(prims[a[near]])
            right.append(prims[b[near]])
            found, asked = found + len(left[-1]), asked + 1
            if found > MOST_NEAR or asked > MOST_NEAR:
                return None
    if found == 0:
        return None
    one, two = np.concatenate([*left, *right]), np.concatenate([*right, *left])
    order = np.lexsort((two, one))
    start = np.concatenate([[0], np.cumsum(np.bincount(one, minlength=g.triangle_count))])
    return Near(start, two[order])


def _pairs(
    low: Float32, high: Float32, room: Float64, mine: slice, theirs: slice, bottom: Float64, top: Float64
) -> tuple[Numbers, Numbers]:
    """Numbers (k,), (k,) of boxes of two runs that meet, where these do: in the box from `bottom` to `top`."""
    both = []
    for run in (mine, theirs):
        there = ((low[run] - room[run, None] <= top) & (high[run] + room[run, None] >= bottom)).all(axis=1)
        both.append(run.start + flatnonzero(there))
    one, two = both
    boxes = Boxes(low[two], high[two], room[two])
    left, right = [np.zeros(0, np.intp)], [np.zeros(0, np.intp)]
    for start in range(0, len(one), TOGETHER):
        part = one[start : start + TOGETHER]
        lowest, highest = (low[part] - room[part, None]), (high[part] + room[part, None])
        for near in boxes.near(lowest.min(axis=0), highest.max(axis=0)):
            touch = (lowest[:, None] <= boxes.high[near]) & (highest[:, None] >= boxes.low[near])
            a, b = np.nonzero(touch.all(axis=2))
            left.append(part[a])
            right.append(two[near[b]])
    return np.concatenate(left), np.concatenate(right)


def _come_near(g: Geometry, a: Numbers, b: Numbers) -> Bools:
    """(k,) whether neither of two triangles lies wholly on one side of the other, further off than NEAR."""
    result = np.ones(len(a), bool)
    room = NEAR * np.maximum(g.extent[a], g.extent[b]).astype(np.float64)
    for one, two in ((a, b), (b, a)):
        corners = g.vertices[g.triangles[two]].astype(np.float64)
        height = (corners * g.facets[one, None, :3]).sum(axis=2) - g.facets[one, 3:]
        result &= (height.min(axis=1) <= room) & (height.max(axis=1) >= -room)
    return result


@dataclass(eq=False)
class Sides:
    """Media around hits where more than one surface is passed.

    column : (n,) which of the m columns is a hit's; -1: at none of them.
    outer, inner : (rows, m), of new rays on the side of wo and beyond.   eta : (m,) of the light that is transmitted.
    """

    column: Numbers
    outer: Stack
    inner: Stack
    eta: Float64

    def take(self, index: Index) -> Sides:
        """Those of the hits `index`, in that order."""
        return replace(self, column=take(self.column, index))

    def amend_eta(self, eta: Float64, index: Index) -> None:
        """Put what is known into eta (k,) of the hits `index`."""
        column = take(self.column, index)
        there = flatnonzero(column >= 0)
        eta[there] = self.eta[column[there]]

    def amend(self, media: Stack, index: Index, beyond: bool) -> Stack:
        """Stacks (rows, k) of new rays from the hits `index`, with what is known."""
        column = take(self.column, index)
        there = flatnonzero(column >= 0)
        if len(there) == 0:
            return media
        media = media.copy()
        media[:, there] = (self.inner if beyond else self.outer)[:, column[there]]
        return media
