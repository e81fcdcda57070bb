# SPDX-License-Identifier: GPL-3.0-or-later
"""Large triangles near small ray traced objects, split and graded towards them.

Embree finds a plane to an ulp of the distance to the triangle's corners: next to a far larger triangle a small object's
shadow and contact are lost. An edge is split, or not, by its end points alone, so both its sides agree and no crack
opens. What is interpolated over a triangle (texture coordinates, normals) is linear: its parts give the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64
from ..core.constants import GRADING, LARGE_TRIANGLE, MAX_SMALL_OBJECTS, MAX_SPLITS, SMALLEST_EDGE
from ..core.vectors import Array
from .triangles import TriangleSoup, corner_bounds, facets_of

Numbers = NDArray[np.intp]


def split_large_triangles(mesh: TriangleSoup, ray_traced_balls: Float64) -> TriangleSoup:
    """The soup with its large triangles split where small ray traced objects are near; itself where there are none.

    flagged_balls : (b, 4) centres and radii of ray traced analytic spheres.
    """
    objects = np.concatenate([_flagged_objects(mesh), ray_traced_balls * (1, 1, 1, 2)])
    objects = objects[objects[:, 3] > 0]
    largest_edge = 2 * np.sqrt(3) * np.max(mesh.extent, initial=0.0)
    objects = objects[LARGE_TRIANGLE * objects[:, 3] < largest_edge]
    if len(objects) == 0:
        return mesh
    objects = objects[np.argsort(objects[:, 3], kind="stable")[:MAX_SMALL_OBJECTS]]
    longest = np.sqrt(_squared_edges(mesh.vertices[mesh.triangles].astype(np.float64)).max(axis=1))
    large = np.flatnonzero(longest > LARGE_TRIANGLE * objects[0, 3])
    return _Splitter(mesh, large, objects).split() if len(large) else mesh


def _squared_edges(corners: Float64) -> Float64:
    """(n, 3) squared lengths of the edges from corner i to corner i + 1."""
    edges = corners[:, [1, 2, 0]] - corners
    return np.asarray((edges * edges).sum(axis=2))


def _flagged_objects(mesh: TriangleSoup) -> Float64:
    """(k, 4) centres and diameters of the bounds of ray traced instances."""
    ray_traced = np.flatnonzero(mesh.flags[0])
    if len(ray_traced) == 0:
        return np.zeros((0, 4))
    start = np.flatnonzero(np.diff(mesh.object[ray_traced], prepend=-1))
    low, high = corner_bounds(mesh.vertices, mesh.triangles[ray_traced])
    low = np.minimum.reduceat(low, start, axis=0).astype(np.float64)
    high = np.maximum.reduceat(high, start, axis=0).astype(np.float64)
    diameter = np.sqrt(((high - low) ** 2).sum(axis=1))
    return np.concatenate([(low + high) / 2, diameter[:, None]], axis=1)


class _Splitter:
    """The work on some triangles: rows of corner points, with what is interpolated beside them."""

    def __init__(self, mesh: TriangleSoup, large: Numbers, objects: Float64) -> None:
        self.mesh, self.objects = mesh, objects
        self.parent = large
        self.points = mesh.vertices[mesh.triangles[large]]  # (n, 3 corners, 3)
        tables = [t[large].reshape(len(large), 3, -1) for t in (mesh.normals, mesh.corner_data) if t is not None]
        self.values = np.concatenate([self.points, *tables], axis=2)  # (n, 3 corners, k) float32

    def split(self) -> TriangleSoup:
        """Halve triangles at their longest edge that is too long until none is."""
        done: list[tuple[Numbers, Float32]] = []
        parent, values = self.parent, self.values
        total = 0
        while len(parent) and total < MAX_SPLITS:
            edge = self._edge_to_split(values)
            whole = edge < 0
            done.append((parent[whole], values[whole]))
            parent, values, edge = parent[~whole], values[~whole], edge[~whole]
            total += len(parent)
            parent, values = np.concatenate([parent, parent]), _halve(values, edge)
        done.append((parent, values))
        parent = np.concatenate([p for p, _ in done])
        values = np.concatenate([v for _, v in done])
        order = np.argsort(parent, kind="stable")
        return self._assemble(parent[order], values[order])

    def _edge_to_split(self, values: Float32) -> Numbers:
        """(n,) the longest edge that is too long, from corner i to i + 1; -1: none is."""
        corners = values[:, :, :3].astype(np.float64)
        squared = _squared_edges(corners)
        too_long = np.zeros(squared.shape, bool)
        a, b = _ordered(corners, corners[:, [1, 2, 0]])
        for x, y, z, diameter in self.objects:
            limit = np.maximum((LARGE_TRIANGLE * diameter) ** 2, GRADING**2 * _squared_distance(a, b, (x, y, z)))
            too_long |= squared > limit
        too_long &= squared > (SMALLEST_EDGE * np.maximum(np.abs(a), np.abs(b)).max(axis=2)) ** 2
        return np.where(too_long.any(axis=1), np.argmax(np.where(too_long, squared, 0), axis=1), -1)

    def _assemble(self, parent: Numbers, values: Float32) -> TriangleSoup:
        """Put the parts in the places of their parents: an object's triangles stay together."""
        mesh, count = self.mesh, len(parent)
        if count == len(self.parent):
            return mesh
        kept = np.setdiff1d(np.arange(len(mesh.triangles)), self.parent, assume_unique=True)
        source = np.concatenate([kept, parent])
        order = np.argsort(source, kind="stable")
        source = source[order]
        new = len(mesh.vertices) + np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
        points = np.ascontiguousarray(values[:, :, :3])
        facets, weights, extent, sound = facets_of(points)
        facets = np.where(sound[:, None], facets, mesh.facets[parent])
        weights = np.where(sound[:, None], weights, 0.0)

        def merged(old: Array, part: Array) -> Array:
            return np.concatenate([old[kept], part])[order]

        extra, normals, data = values[:, :, 3:], mesh.normals, mesh.corner_data
        if normals is not None:
            normals, extra = merged(normals, extra[:, :, :3].reshape(count, 9)), extra[:, :, 3:]
        if data is not None:
            data = merged(data, extra.reshape(count, -1))
        return replace(
            mesh,
            vertices=np.concatenate([mesh.vertices, points.reshape(-1, 3)]),
            triangles=merged(mesh.triangles, new),
            facets=merged(mesh.facets, facets),
            weights=merged(mesh.weights, weights),
            extent=merged(mesh.extent, extent),
            normals=normals,
            smooth=mesh.smooth[source],
            corner_data=data,
            object=mesh.object[source],
            source=mesh.source[source],
            surface=mesh.surface[source],
            flags=mesh.flags[:, source],
            split=count - len(self.parent),
        )


def _halve(values: Float32, edge: Numbers) -> Float32:
    """Both halves (2 n, 3, k) of triangles cut from the middle of `edge` to the corner opposite."""
    rows = np.arange(len(values))
    a, b = values[rows, edge], values[rows, (edge + 1) % 3]
    middle = ((a.astype(np.float64) + b) / 2).astype(np.float32)
    first, second = values.copy(), values.copy()
    first[rows, (edge + 1) % 3] = middle
    second[rows, edge] = middle
    return np.concatenate([first, second])


def _ordered(a: Float64, b: Float64) -> tuple[Float64, Float64]:
    """End points of edges in an order that depends on the points alone, so that neighbours round alike."""
    swap = np.zeros(a.shape[:-1], bool)
    decided = swap.copy()
    for i in range(3):
        swap |= ~decided & (a[..., i] > b[..., i])
        decided |= a[..., i] != b[..., i]
    return np.where(swap[..., None], b, a), np.where(swap[..., None], a, b)


def _squared_distance(a: Float64, b: Float64, point: tuple[float, float, float]) -> Float64:
    """Squared distances of a point from segments a b (..., 3)."""
    along, to = b - a, np.asarray(point) - a
    length2 = (along * along).sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        t = np.clip(np.nan_to_num((to * along).sum(axis=-1) / length2), 0, 1)
    off = to - t[..., None] * along
    return np.asarray((off * off).sum(axis=-1))
