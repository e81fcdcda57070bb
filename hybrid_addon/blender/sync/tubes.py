# SPDX-License-Identifier: GPL-3.0-or-later
"""Thin round things as triangles: strands of hair as tubes, points as balls. Arrays only, all strands at once.

EEVEE draws a strand as a ribbon that faces the camera and shades it as a cylinder. A tube looks so from every side, in
mirrors, too. It has as few sides as a budget of triangles asks for; a prism is seen as wide, in the mean over its
turns, as the cylinder that it stands for (Cauchy: perimeter over pi), and has the cylinder's normals.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Int32

Numbers = NDArray[np.intp]

TRIANGLES = 800_000
"""Of the strands or points of an object, about: half a gigabyte in the tracer. Many have fewer sides, then."""

FEWEST_SIDES, MOST_SIDES = 4, 12
SEGMENTS = 100_000
"""Curves are cut finer, up to their own resolution, as long as all together have no more pieces than this."""


@dataclass(frozen=True, eq=False)
class Strands:
    """m polylines, one after the other.

    points : (n, 3) float32.   radius : (n,) float32.
    first  : (m + 1,) intp, where each begins in `points`, and the end of the last.
    source : (n,) float64, place of each point among those that it was cut from: data at 2.25 lie between those of point
             2 and point 3.
    """

    points: Float32
    radius: Float32
    first: Numbers
    source: NDArray[np.float64]

    @property
    def strand(self) -> Numbers:
        """(n,) which polyline each point is of."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))


@dataclass(frozen=True, eq=False)
class Triangles:
    """What scene.TriangleMesh wants, and `point`: (nc,) intp, of which given point each corner has its data."""

    vertices: Float32
    triangles: Int32
    corners: Int32
    normals: Float32
    point: Numbers


def tubes(strands: Strands) -> Triangles:
    """Closed tubes around polylines of two points or more (strands of one are left out)."""
    points, first = strands.points, strands.first
    sizes = np.diff(first)
    n = len(points)
    is_last = np.zeros(n, bool)
    is_last[first[1:][sizes > 0] - 1] = True
    lone = np.repeat(sizes < 2, sizes)
    begin = np.flatnonzero(~is_last & ~lone)  # of each segment
    sides = int(np.clip(TRIANGLES // max(2 * len(begin), 1), FEWEST_SIDES, MOST_SIDES))

    # Rings of vertices around the points.
    tangent = _tangents(points, is_last, first[:-1][sizes > 0])
    across = _transported(tangent, first)
    beside = np.cross(tangent, across)
    angle = np.arange(sides) * (2 * np.pi / sides)
    normals = np.cos(angle)[:, None] * across[:, None] + np.sin(angle)[:, None] * beside[:, None]  # (n, sides, 3)
    wide = strands.radius * np.float32(np.pi / (sides * np.sin(np.pi / sides)))
    vertices = points[:, None] + wide[:, None, None] * normals

    # Walls between rings, and a lid at each end.
    here = np.arange(sides)
    there = (here + 1) % sides
    a, b = begin[:, None] * sides + here, begin[:, None] * sides + there
    walls = np.stack([a, b, b + sides, a, b + sides, a + sides], axis=-1).reshape(-1, 3)
    fan = np.stack([np.zeros(sides - 2, np.intp), here[1:-1], here[2:]], axis=1)
    long = sizes >= 2
    ends = np.concatenate([first[:-1][long], first[1:][long] - 1])
    lids = ends[:, None, None] * sides + fan
    lids[: len(ends) // 2] = lids[: len(ends) // 2, :, ::-1]  # the roots look backwards
    lid_corner = n * sides + np.arange(len(ends))
    outward = tangent[ends] * np.repeat([-1.0, 1.0], len(ends) // 2)[:, None]
    return Triangles(
        vertices=vertices.reshape(-1, 3).astype(np.float32),
        triangles=np.concatenate([walls, lids.reshape(-1, 3)]).astype(np.int32),
        corners=np.concatenate([walls, np.repeat(lid_corner, 3 * (sides - 2)).reshape(-1, 3)]).astype(np.int32),
        normals=np.concatenate([normals.reshape(-1, 3), outward]).astype(np.float32),
        point=np.concatenate([np.repeat(np.arange(n), sides), ends]),
    )


def _tangents(points: Float32, is_last: NDArray[np.bool_], roots: Numbers) -> NDArray[np.float64]:
    """(n, 3) unit directions along polylines: the mean of those before and after a point."""
    steps = np.zeros((len(points), 3))
    steps[:-1] = np.diff(points.astype(np.float64), axis=0)
    steps[is_last] = 0
    steps = _unit(steps)
    before = np.roll(steps, 1, axis=0)
    before[roots] = 0
    both = _unit(steps + before)
    stuck = ~both.any(axis=1)
    both[stuck] = steps[stuck]
    both[~both.any(axis=1)] = (0, 0, 1)
    return both


def _transported(tangent: NDArray[np.float64], first: Numbers) -> NDArray[np.float64]:
    """(n, 3) unit vectors across the tangents that turn as little as may be along each polyline."""
    axis = np.eye(3)[np.abs(tangent).argmin(axis=1)]
    result = _unit(axis - (axis * tangent).sum(axis=1, keepdims=True) * tangent)
    sizes = np.diff(first)
    for step in range(1, int(np.max(sizes, initial=0))):  # all strands at once, point by point along them
        now = first[:-1][sizes > step] + step
        carried = result[now - 1]
        carried = carried - (carried * tangent[now]).sum(axis=1, keepdims=True) * tangent[now]
        length = np.linalg.norm(carried, axis=1, keepdims=True)
        result[now] = np.where(length > 0, carried / np.where(length > 0, length, 1), result[now])
    return result


def _unit(v: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return np.asarray(v / np.where(length > 0, length, 1))


# ------------------------------------------------------------------------------------------------ curves to strands


def smoothed(
    strands: Strands,
    resolution: Numbers,
    is_cyclic: NDArray[np.bool_],
    handles: tuple[Float32, Float32] | None = None,
    is_bezier: NDArray[np.bool_] | None = None,
) -> Strands:
    """Curves through their points, cut into polylines.

    resolution : (m,) pieces that each segment is cut into at most; 1: straight.   is_cyclic : (m,).
    handles    : (n, 3) float32, left and right of each point, of those curves (m,) that are `is_bezier`; the others are
                 uniform Catmull-Rom splines, whose ends are held twice (blenkernel/intern/curve_catmull_rom.cc).
    """
    sizes = np.diff(strands.first)
    closed = is_cyclic & (sizes > 2)
    spans = np.maximum(sizes - 1 + closed, 0)  # segments of each curve
    most = max(SEGMENTS // max(int(spans.sum()), 1), 1)
    pieces = np.clip(resolution, 1, most)
    counts = spans * pieces + (sizes > 0)
    first = np.concatenate([[0], np.cumsum(counts)])
    strand = np.repeat(np.arange(len(sizes)), counts)
    place = np.arange(first[-1]) - first[strand]
    segment = np.minimum(place // pieces[strand], np.maximum(spans[strand] - 1, 0))
    t = (place - segment * pieces[strand]) / pieces[strand]

    def number(offset: int) -> Numbers:
        """Points that many steps from the start of the segment: around where the curve is closed, else held."""
        n, index = sizes[strand], segment + offset
        return strands.first[strand] + np.where(closed[strand], index % np.maximum(n, 1), np.clip(index, 0, n - 1))

    around = [number(offset) for offset in (-1, 0, 1, 2)]
    values = np.concatenate([strands.points, strands.radius[:, None]], axis=1).astype(np.float64)
    s = t[:, None]
    basis = (
        -0.5 * s * (1 - s) ** 2, 1 + s * s * (1.5 * s - 2.5), s * (0.5 + s * (2 - 1.5 * s)), -0.5 * s * s * (1 - s)
    )  # fmt: skip
    found = sum(weight * values[index] for weight, index in zip(basis, around, strict=True))
    straight = (pieces == 1)[strand] | ((sizes < 3) & ~closed)[strand]
    linear = (1 - s) * values[around[1]] + s * values[around[2]]
    found = np.where(straight[:, None], linear, found)
    if handles is not None and is_bezier is not None:
        left, right = handles
        a, b = values[around[1], :3], values[around[2], :3]
        bent = (1 - s) ** 3 * a + 3 * s * (1 - s) ** 2 * right[around[1]] + 3 * s * s * (1 - s) * left[around[2]]
        bent = np.concatenate([bent + s**3 * b, linear[:, 3:]], axis=1)
        found = np.where(is_bezier[strand, None], bent, found)
    step = np.where(around[2] > around[1], t, 0.0)
    return Strands(
        points=found[:, :3].astype(np.float32),
        radius=np.maximum(found[:, 3], 0).astype(np.float32),
        first=first.astype(np.intp),
        source=around[1].astype(np.float64) + step,
    )


# ------------------------------------------------------------------------------------------------ points

BALLS = ((0, 20), (1, 80), (2, 320), (3, 1280))
"""Icospheres: how often they are divided, and their triangles."""


def balls(center: Float32, radius: Float32) -> Triangles:
    """Balls (n,), as round as the budget allows, each as large in the mean as the sphere that it stands for."""
    n = len(center)
    affordable = [level for level, triangles in BALLS if n * triangles <= TRIANGLES]
    corner, faces = _icosphere(affordable[-1] if affordable else 0)
    a, b, c = (corner[faces[:, i]] for i in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    wide = radius * np.float32(np.sqrt(4 * np.pi / area))  # of a convex body a quarter of its surface is seen
    vertices = center[:, None] + wide[:, None, None] * corner
    triangles = np.arange(n)[:, None, None] * len(corner) + faces
    triangles = triangles.reshape(-1, 3).astype(np.int32)
    return Triangles(
        vertices=vertices.reshape(-1, 3).astype(np.float32),
        triangles=triangles,
        corners=triangles,
        normals=np.tile(corner, (n, 1)).astype(np.float32),
        point=np.repeat(np.arange(n), len(corner)),
    )


def _icosphere(level: int) -> tuple[NDArray[np.float64], Numbers]:
    """Unit vertices (k, 3) and triangles (f, 3) of an icosahedron whose triangles are cut in four so many times."""
    g = (1 + np.sqrt(5)) / 2
    vertices = _unit(np.array([
        (-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g), (g, 0, -1),
        (g, 0, 1), (-g, 0, -1), (-g, 0, 1),
    ]))  # fmt: skip
    faces = np.array([
        (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
        (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7),
        (9, 8, 1),
    ])  # fmt: skip
    for _ in range(level):
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = (inverse.reshape(-1) + len(vertices)).reshape(3, -1)
        vertices = np.concatenate([vertices, _unit(vertices[unique].sum(axis=1))])
        (a, b, c), (ab, bc, ca) = faces.T, middle
        faces = np.concatenate([np.stack(f, axis=1) for f in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    return vertices, faces
