# SPDX-License-Identifier: GPL-3.0-or-later
"""A triangle soup with all that a hit needs to know about each triangle, before it becomes a `Geometry`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64, Int32
from ..core.constants import EMBREE_LIMIT
from ..core.vectors import cross, dot, flatnonzero

Bools = NDArray[np.bool_]

CHUNK = 1 << 15
"""Triangles that are worked on at once: of a million each number would need new memory, which takes longer than it."""


@dataclass(eq=False)
class TriangleSoup:
    """The triangles of one batch (then of all), with what a hit needs to know about each."""

    vertices: Float32
    triangles: Int32
    facets: Float64
    weights: Float64
    extent: Float32
    normals: Float32 | None
    smooth: Bools
    corner_data: Float32 | None  # (nt, 3 k)
    object: Int32
    source: Int32  # number of the triangle in its mesh
    surface: Int32
    flags: Bools  # (5, nt) ray_traced, camera, shadow, secondary, moves
    dropped: int
    split: int = 0  # triangles made by `subdivide`


def facets_of(points: Float32) -> tuple[Float64, Float64, Float32, Bools]:
    """Plane equations, barycentrics, extents and soundness of (n, 3 corners, 3) float32 triangles, in float64.

    The barycentrics (n, 8) are planes, too: rows a, d, b, e of a.p + d and b.p + e, the weights of the second and third
    corner at p. With edges e1 and e2 and n = e1 x e2, a = e2 x n / n.n and b = n x e1 / n.n.
    """
    n = len(points)
    facets, weights, extent, sound = np.empty((n, 4)), np.empty((n, 8)), np.empty(n, np.float32), np.empty(n, bool)
    for start in range(0, n, CHUNK):
        chunk = slice(start, start + CHUNK)
        _facets_of(points[chunk], facets[chunk], weights[chunk], extent[chunk], sound[chunk])
    return facets, weights, extent, sound


def _facets_of(points: Float32, facets: Float64, weights: Float64, extent: Float32, sound: Bools) -> None:
    """The same of some triangles, into arrays."""
    rows = np.ascontiguousarray(points.reshape(-1, 9).T)  # reductions along the first axis are the fast ones
    p = rows.astype(np.float64)
    with np.errstate(all="ignore"):
        np.abs(rows).max(axis=0, out=extent)
        first, second = p[3:6] - p[0:3], p[6:9] - p[0:3]
        normal = cross(first, second)
        squared = dot(normal, normal)
        for start, across in ((0, cross(second, normal)), (4, cross(normal, first))):
            across /= squared
            weights[:, start : start + 3] = across.T
            weights[:, start + 3] = -dot(across, p[0:3])
        length = np.sqrt(squared)
        np.logical_and(extent < EMBREE_LIMIT, length > 0, out=sound)  # False for NaN
        normal /= length
        facets[:, :3] = normal.T
        facets[:, 3] = dot(normal, p[0:3])


def used_of(triangles: NDArray[np.integer]) -> NDArray[np.intp]:
    """The numbers of the vertices of triangles (n, 3), ascending: without sorting, of vertices that lie together."""
    if triangles.size == 0:
        return np.zeros(0, np.intp)
    first = int(np.min(triangles))
    used = np.zeros(int(np.max(triangles)) - first + 1, bool)
    used[triangles.ravel() - first] = True
    return flatnonzero(used) + first


def corner_bounds(vertices: Float32, triangles: NDArray[np.integer]) -> tuple[Float32, Float32]:
    """Lowest and highest coordinates (n, 3) of triangles (n, 3): not by reductions over three, which are slow."""
    a, b, c = (vertices.take(triangles[:, i], axis=0) for i in range(3))
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def no_triangles() -> TriangleSoup:
    """The empty soup."""
    none = np.zeros(0, np.int32)
    return TriangleSoup(
        np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32), np.zeros((0, 4)), np.zeros((0, 8)),
        np.zeros(0, np.float32), None, np.zeros(0, bool), None, none, none, none, np.zeros((5, 0), bool), 0,
    )  # fmt: skip


def join(parts: list[TriangleSoup]) -> TriangleSoup:
    """One soup out of all batches."""
    starts = np.cumsum([0] + [len(p.vertices) for p in parts[:-1]]).astype(np.int32)

    def either(name: str) -> Float32 | None:
        """Rows (nt, 3, k) of an optional table; zeros for the batches that have none, or less."""
        tables = [getattr(p, name) for p in parts]
        k = max((t.shape[1] // 3 for t in tables if t is not None), default=0)
        if k == 0:
            return None
        rows = [np.zeros((len(p.triangles), 3, k), np.float32) for p in parts]
        for row, table in zip(rows, tables, strict=True):
            if table is not None:
                row[:, :, : table.shape[1] // 3] = table.reshape(len(table), 3, table.shape[1] // 3)
        return np.concatenate(rows).reshape(-1, 3 * k)

    return TriangleSoup(
        vertices=np.concatenate([p.vertices for p in parts]),
        triangles=np.concatenate([p.triangles + s for p, s in zip(parts, starts, strict=True)]),
        facets=np.concatenate([p.facets for p in parts]),
        weights=np.concatenate([p.weights for p in parts]),
        extent=np.concatenate([p.extent for p in parts]),
        normals=either("normals"),
        smooth=np.concatenate([p.smooth for p in parts]),
        corner_data=either("corner_data"),
        object=np.concatenate([p.object for p in parts]),
        source=np.concatenate([p.source for p in parts]),
        surface=np.concatenate([p.surface for p in parts]),
        flags=np.concatenate([p.flags for p in parts], axis=1),
        dropped=sum(p.dropped for p in parts),
    )
