# SPDX-License-Identifier: GPL-3.0-or-later
"""Bodies that may be solids, and which other things they touch: a glass and the table that it stands on.

Only what is near is compared: boxes of triangles in a row are asked first, then single ones, then points and planes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64
from ..core.constants import NEIGHBOUR_SWELLING, SWELLING, TOUCH_PAIRS
from ..geometry.flatten import Geometry
from ..geometry.triangles import corner_bounds, used_of

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]

BLOCK = 256
"""Triangles in a row that are looked at together: mostly neighbours."""


COLUMNS = "size", "low", "high", "extent", "thickness", "surface"


@dataclass(eq=False)
class Bodies:
    """Closed bodies that transmit, b of them: parts of meshes, then spheres; or groups of such parts.

    prims     : (p,) their primitives, body by body; each body's ascending.
    size      : (b,) how many each has.
    low, high : (b, 3) bounds.   extent : (b,) largest |coordinate|.   thickness : (b,) signed, 2 volume / area.
    surface   : (b,) what it is made of: the surface of its first primitive that transmits.
    """

    prims: Numbers
    size: Numbers
    low: Float64
    high: Float64
    extent: Float64
    thickness: Float64
    surface: Numbers

    def __len__(self) -> int:
        return len(self.size)

    @cached_property
    def starts(self) -> Numbers:
        """(b,) where each begins among `prims`."""
        return np.cumsum(self.size) - self.size

    def of(self, body: int) -> Numbers:
        """The primitives of one body."""
        start = int(self.starts[body])
        return self.prims[start : start + int(self.size[body])]

    def take(self, index: Numbers) -> Bodies:
        """The bodies `index`, in that order."""
        size = self.size[index]
        within = np.arange(int(size.sum())) - np.repeat(np.cumsum(size) - size, size)
        prims = self.prims[np.repeat(self.starts[index], size) + within]
        return Bodies(prims, *(getattr(self, name)[index] for name in COLUMNS))


@dataclass(eq=False)
class _Boxes:
    """Boxes low, high (p, 3) of primitives, with room for what touches them, margin (p,), and of each BLOCK of them in
    a row."""

    low: Float32
    high: Float32
    margin: Float64

    def __post_init__(self) -> None:
        self.starts = np.arange(0, len(self.low), BLOCK)
        if len(self.low):
            most = np.maximum.reduceat(self.margin, self.starts)[:, None]
            self.lowest = np.minimum.reduceat(self.low, self.starts, axis=0) - most
            self.highest = np.maximum.reduceat(self.high, self.starts, axis=0) + most

    def near(self, bottom: Float64, top: Float64) -> list[Numbers]:
        """The primitives whose boxes meet the box (bottom, top), block by block."""
        if len(self.low) == 0:
            return []
        blocks = np.flatnonzero(((self.lowest <= top) & (self.highest >= bottom)).all(axis=1))
        found = []
        for start in self.starts[blocks].tolist():
            part = slice(start, start + BLOCK)
            low, high, margin = self.low[part], self.high[part], self.margin[part, None]
            found.append(start + np.flatnonzero(((low - margin <= top) & (high + margin >= bottom)).all(axis=1)))
        return [some for some in found if len(some)]


def neighbour_extent(g: Geometry, solids: Bodies) -> Float64:
    """(b,) the largest extent of triangles and planes, of no solid, that each solid touches; 0: it touches none."""
    flat = np.ones(g.flattened_count, bool)
    flat[solids.prims] = False
    flat[g.triangle_count : g.triangle_count + g.sphere_count] = False
    others = np.flatnonzero(flat)
    triangles = others[others < g.triangle_count]
    extent = g.extent[others].astype(np.float64)
    margin = NEIGHBOUR_SWELLING * extent
    low, high = corner_bounds(g.vertices, g.triangles[triangles])
    everywhere = np.full((len(others) - len(triangles), 3), np.inf, np.float32)  # where planes are
    low, high = np.concatenate([low, -everywhere]), np.concatenate([high, everywhere])
    boxes, result = _Boxes(low, high, margin), np.zeros(len(solids))
    for i in range(len(result)):
        own = SWELLING * float(solids.extent[i])
        points = _points(g, solids, i)
        for near in boxes.near(solids.low[i] - own, solids.high[i] + own):
            reach = own + margin[near]
            if points is None:
                touched = near[_ball_touches(g, int(solids.of(i)[0]), others[near], reach)]
            else:
                around = (points >= low[near].min(axis=0) - own) & (points <= high[near].max(axis=0) + own)
                touched = near[_touches(g, points[around.all(axis=1)], others[near], reach)]
            result[i] = max(result[i], np.max(extent[touched], initial=0.0))
        if g.instanced is not None:  # what is kept as instances is not looked at closely: its bounds will do
            of_instances = g.instanced.extent_within(solids.low[i] - own, solids.high[i] + own)
            result[i] = max(result[i], of_instances)
    return result


def _points(g: Geometry, solids: Bodies, body: int) -> Float64 | None:
    """The vertices (n, 3) of a body; None: it is a sphere."""
    prims = solids.of(body)
    if prims[0] >= g.triangle_count:
        return None
    return g.vertices[used_of(g.triangles[prims])].astype(np.float64)


def _ball_touches(g: Geometry, first: int, prims: Numbers, reach: Float64) -> Bools:
    """Which of the triangles and planes `prims` (p,) have the nearest point of the sphere `first` within `reach`."""
    ball, facets = first - g.triangle_count, g.facets[prims]
    center, radius = g.sphere_center[ball].astype(np.float64), float(g.sphere_radius[ball])
    side = facets[:, :3] @ center - facets[:, 3]
    points = center - np.sign(side)[:, None] * radius * facets[:, :3]
    result: Bools = (np.abs(np.abs(side) - radius) <= reach) & _inside(g, prims, points, reach)
    return result


def _touches(g: Geometry, points: Float64, prims: Numbers, reach: Float64) -> Bools:
    """Which of the triangles and planes `prims` (p,) have one of the points (n, 3) within `reach` (p,) of them."""
    found = np.zeros(len(prims), bool)
    if len(points) == 0:
        return found
    facets, step = g.facets[prims], max(1, TOUCH_PAIRS // len(points))
    for start in range(0, len(prims), step):
        part = slice(start, start + step)
        close = np.abs(facets[part, :3] @ points.T - facets[part, 3:]) <= reach[part, None]
        which, point = np.nonzero(close)
        inside = _inside(g, prims[part][which], points[point], reach[part][which])
        found[start + which[inside]] = True
    return found


def _inside(g: Geometry, prims: Numbers, points: Float64, reach: Float64) -> Bools:
    """(n,) whether points (n, 3) near the planes of `prims` (n,) lie over the triangle, or `reach` (n,) beside it."""
    inside = np.ones(len(prims), bool)
    is_triangle = prims < g.triangle_count
    chosen = prims[is_triangle]
    corners = g.vertices[g.triangles[chosen]].astype(np.float64)
    normal = g.facets[chosen, :3]
    for k in range(3):
        edge = corners[:, (k + 1) % 3] - corners[:, k]
        inward = np.cross(normal, edge)
        length = np.sqrt((inward**2).sum(axis=1))
        depth = ((points[is_triangle] - corners[:, k]) * inward).sum(axis=1)
        inside[is_triangle] &= depth >= -reach[is_triangle] * length
    return inside
