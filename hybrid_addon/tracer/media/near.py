# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of triangles that come near one another, and what is known of the media where a ray hits one of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64
from ..core.constants import MOST_ASKED, MOST_NEAR, NEAR, TOUCH_PAIRS
from ..core.vectors import Index, flatnonzero, take
from ..geometry.flatten import Geometry
from ..geometry.triangles import corner_bounds

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]
Stack = NDArray[np.int32]

WIDE = 4.0
"""Boxes so many times wider than the median are looked at apart."""


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
    if len(size) < 2:
        return None
    low, high = corner_bounds(g.vertices, g.triangles[prims])
    room = (NEAR * g.extent[prims])[:, None]
    low, high = low - room, high + room
    starts = np.cumsum(size) - size
    bottom, top = np.minimum.reduceat(low, starts, axis=0), np.maximum.reduceat(high, starts, axis=0)
    order = np.argsort(bottom[:, 0], kind="stable")
    left, right = [np.zeros(0, np.intp)], [np.zeros(0, np.intp)]
    found = asked = 0
    for k, i in enumerate(order.tolist()):
        others = order[k + 1 :]
        others = others[: np.searchsorted(bottom[others, 0], top[i, 0], side="right")]
        for j in others[((bottom[others] <= top[i]) & (top[others] >= bottom[i])).all(axis=1)].tolist():
            common = np.maximum(bottom[i], bottom[j]), np.minimum(top[i], top[j])
            one, two = (_within(low, high, starts[part], size[part], *common) for part in (i, j))
            for a, b, pairs in _meeting(low, high, one, two):
                near = _come_near(g, prims[a], prims[b])
                left.append(prims[a[near]])
                right.append(prims[b[near]])
                found, asked = found + len(left[-1]), asked + pairs
                if found > MOST_NEAR or asked > MOST_ASKED:
                    return None
    if found == 0:
        return None
    one, two = np.concatenate([*left, *right]), np.concatenate([*right, *left])
    order = np.lexsort((two, one))
    start = np.concatenate([[0], np.cumsum(np.bincount(one, minlength=g.triangle_count))])
    return Near(start, two[order])


def _within(low: Float32, high: Float32, start: int, size: int, bottom: Float32, top: Float32) -> Numbers:
    """Numbers (k,) of boxes of a run that meet the box from `bottom` to `top`."""
    run = slice(int(start), int(start + size))
    return run.start + flatnonzero(((low[run] <= top) & (high[run] >= bottom)).all(axis=1))


def _meeting(low: Float32, high: Float32, one: Numbers, two: Numbers) -> Iterator[tuple[Numbers, Numbers, int]]:
    """Numbers (k,), (k,) of boxes `one` (a,) and `two` (b,) that meet, some after the others; and how many were asked.

    The others are sorted along one axis; those much wider than most apart from the rest, for the widest of them tells
    how far back one has to look.
    """
    if len(one) == 0 or len(two) == 0:
        return
    width = high[two] - low[two]
    axis = int(np.argmax(np.ptp(low[two], axis=0) / (width.mean(axis=0) + np.finfo(np.float32).tiny)))
    width = width[:, axis]
    wide = width > WIDE * np.median(width)
    for group in (two[~wide], two[wide]):
        if len(group) == 0:
            continue
        group = group[np.argsort(low[group, axis], kind="stable")]
        begins = low[group, axis]
        first = np.searchsorted(begins, low[one, axis] - np.max(high[group, axis] - begins))
        count = np.searchsorted(begins, high[one, axis], side="right") - first
        chunk = np.cumsum(count) // TOUCH_PAIRS
        for number in np.unique(chunk).tolist():
            some = flatnonzero(chunk == number)
            times = count[some]
            a = np.repeat(one[some], times)
            within = np.arange(len(a)) - np.repeat(np.cumsum(times) - times, times)
            b = group[np.repeat(first[some], times) + within]
            for k in range(3):
                there = (low[a, k] <= high[b, k]) & (high[a, k] >= low[b, k])
                a, b = a[there], b[there]
            yield a, b, len(within)


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
