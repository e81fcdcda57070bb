# SPDX-License-Identifier: GPL-3.0-or-later
"""Who sees what: sets of primitives that a kind of ray can hit, and the two questions asked of them.

A set puts an Embree scene and the analytic shapes together. Tie rule: at equal t triangles win over spheres, spheres
over planes, and the lower primitive number wins (among triangles Embree decides).
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated
from ...scene import Float32, Float64, Int32
from ..core.cache import SceneCache
from ..core.constants import (
    BARYCENTRIC_SLACK,
    FLOAT32_ULP,
    GRAZING_COSINE,
    MAX_HIDDEN_FACES,
    MAX_RETRACES,
    MISS,
    RETRACE_GROWTH,
    RETRACE_STEP,
)
from ..core.rays import offset_origin, origin_offset
from ..core.stats import Stats
from ..core.vectors import Array, dot, flatnonzero, largest_component
from .embree import TriangleScene
from .flatten import Geometry
from .hits import Hits
from .instanced import Faces
from .shapes import onto_sphere, plane_distance, sphere_distance
from .trees import TwoTrees, trees_over

Bools = NDArray[np.bool_]

SPARSE = 0.5
"""Below this share of hits, compacting them first is faster than working on all rays; it changes no bit."""


class PrimitiveSet:
    """The primitives `members` (np,) bool of a geometry, ready for queries."""

    def __init__(
        self, geometry: Geometry, members: Bools, cache: SceneCache | None = None, divided: bool = False
    ) -> None:
        """cache: where trees of earlier frames may be found. divided: what is likely to move has a tree of its own."""
        self.geometry = geometry
        nt, ns = geometry.triangle_count, geometry.sphere_count
        flattened = geometry.flattened_count
        self.triangle_count = int(np.count_nonzero(members[:nt]) + np.count_nonzero(members[flattened:]))
        self._triangles = trees_over(geometry, members, SceneCache(0) if cache is None else cache, divided)
        self._spheres = flatnonzero(members[nt : nt + ns])
        self._planes = flatnonzero(members[nt + ns : flattened]) + nt + ns
        self._members = members
        self._hidden: Bools | None = None
        self._side = 1.0

    def without_backs(self, culled: Bools) -> PrimitiveSet:
        """The same, but the back faces of the primitives `culled` (np,) are not there."""
        hidden = self._members & culled
        if not hidden.any():
            return self
        other = copy.copy(self)
        other._hidden = hidden
        return other

    def backwards(self) -> PrimitiveSet:
        """The same for rays that go against the way from which it is seen: their fronts are what is seen as back."""
        if self._hidden is None:
            return self
        other = copy.copy(self)
        other._side = -self._side
        return other

    @property
    def trees(self) -> tuple[TriangleScene, ...]:
        """The trees that alone tell what is seen: one, or of what stands still and of what moves; none: there are
        instances, shapes, or faces that are not there."""
        if self._hidden is not None or len(self._spheres) or len(self._planes):
            return ()
        trees = self._triangles.parts if isinstance(self._triangles, TwoTrees) else (self._triangles,)
        own = tuple(tree for tree in trees if isinstance(tree, TriangleScene))
        return own if len(own) == len(trees) else ()

    def __len__(self) -> int:
        return self.triangle_count + len(self._spheres) + len(self._planes)

    # -------------------------------------------------------------------------------------------- nearest hit

    def nearest(self, origin: Float32, direction: Array, stats: Stats) -> Hits:
        """Nearest hit of rays (3, n), all of them traceable. Embree sees float64 directions rounded."""
        hits = self._nearest(origin, direction, stats)
        if self._hidden is not None:
            self._look_through(hits, origin, direction, stats)
        return hits

    def _look_through(self, hits: Hits, origin: Float32, direction: Array, stats: Stats) -> None:
        """Replace hits on faces that are not there by those behind, at their distances along the same rays."""
        for _ in range(MAX_HIDDEN_FACES):
            hidden = flatnonzero(self._is_hidden(hits))
            if len(hidden) == 0:
                return
            face, start, d = hits.take(hidden), origin.take(hidden, axis=1), direction.take(hidden, axis=1)
            point = start + d * face.t
            offset = origin_offset(point.astype(np.float32), face.extent(self.geometry))
            behind = offset_origin(point, face.normal, offset * np.sign(face.toward).astype(np.float32))
            found = self._nearest(behind, d, stats)
            found.t += dot(behind - start.astype(np.float64), d)
            self._sharpen_along(found, start, d)
            hits.store(hidden, found)

    def _is_hidden(self, hits: Hits) -> Bools:
        assert self._hidden is not None
        there: Bools = self._hidden.take(hits.prim, mode="wrap") & (hits.prim >= 0)
        return there & (hits.toward * self._side > 0)

    def _sharpen_along(self, hits: Hits, origin: Float32, direction: Array) -> None:
        """Distances of hits along rays that run within an offset of those which found them, from the exact geometry."""
        g = self.geometry
        met = flatnonzero(hits.prim >= 0)
        ball = (hits.prim[met] >= g.triangle_count) & (hits.prim[met] < g.triangle_count + g.sphere_count)
        flat, round_ = met[~ball], met[ball]
        table, place = g.faces_of(hits.face[flat])
        facets = np.ascontiguousarray(table.facets.take(place, axis=0).T)
        hits.t[flat], hits.toward[flat] = plane_distance(facets, origin[:, flat], direction[:, flat])
        sphere = hits.prim[round_] - g.triangle_count
        center, radius = g.sphere_center[sphere].T, g.sphere_radius[sphere]
        hits.t[round_] = onto_sphere(center, radius, origin[:, round_], direction[:, round_], hits.t[round_])

    def _nearest(self, origin: Float32, direction: Array, stats: Stats) -> Hits:
        rounded: Float32 = direction.astype(np.float32, copy=False)
        with stats.phase("intersect"):
            face = self._triangles.intersect(origin, rounded)
        hits = self._refine(face, origin, rounded)
        if self.triangle_count:
            self._retrace(hits, origin, rounded, stats)
            self._check_grazing(hits, origin, rounded, stats)
            if rounded is not direction:
                self._sharpen(hits, origin, direction)
        if len(self._spheres) or len(self._planes):
            self._add_shapes(hits, origin, direction)
        return hits

    def _refine(self, face: NDArray[Any], origin: Float32, direction: Float32) -> Hits:
        """Distances in float64 from the plane equations of the triangles that Embree names."""
        g = self.geometry
        if g.instanced is not None:
            face = face.astype(np.int64, copy=False)
        prim = face if g.instanced is None else g.rows_of(face).astype(np.int32)
        if not self.triangle_count:
            n = len(prim)
            return Hits(prim, np.full(n, np.inf), np.zeros((3, n), np.float32), np.zeros(n), face)
        table, place = g.faces_of(face)
        return Hits(prim, *refine(table.facets, place, origin, direction), face)

    def _retrace(self, hits: Hits, origin: Float32, direction: Float32, stats: Stats) -> None:
        """Advance rays whose hit lies behind them (a rounding error of Embree) and trace them again.

        Closest hit makes this safe: whatever is nearer than a spurious hit would have been returned. Hits at distance 0
        are sound: in a corner an origin, off its own surface, was rounded onto another, and may not leave through it.
        """
        spurious = flatnonzero(~(hits.t >= 0))
        if len(spurious) == 0:
            return
        stats.add("self_hits", len(spurious))
        start, d = origin[:, spurious], direction[:, spurious]
        step = (RETRACE_STEP * largest_component(start)).astype(np.float64)
        for _ in range(MAX_RETRACES):
            moved = (start + d * step).astype(np.float32)
            with stats.phase("intersect"):
                again = self._triangles.intersect(moved, d)
            found = self._refine(again, start, d)
            good = (found.t >= 0) | (again == MISS)
            hits.store(spurious[good], found.take(flatnonzero(good)))
            spurious, start, d, step = spurious[~good], start[:, ~good], d[:, ~good], step[~good] * RETRACE_GROWTH
            if len(spurious) == 0:
                return
        hits.drop(spurious)
        hits.t[spurious] = np.inf

    def _check_grazing(self, hits: Hits, origin: Float32, direction: Float32, stats: Stats) -> None:
        """Count grazing hits that float64 finds clearly outside their triangle (they are clamped, not dropped)."""
        grazing = flatnonzero((np.abs(hits.toward) < GRAZING_COSINE) & (hits.prim >= 0))
        if len(grazing) == 0:
            return
        point = origin.take(grazing, axis=1) + hits.t[grazing] * direction.take(grazing, axis=1)
        u, v = barycentrics(self.geometry, hits.face[grazing], point, clamp=False)
        # In the plane, the float32 ray itself is uncertain by an ulp over the cosine, and so is the hit.
        slack = BARYCENTRIC_SLACK + FLOAT32_ULP / np.abs(hits.toward[grazing])
        stats.add("barycentrics_out_of_range", np.count_nonzero((u < -slack) | (v < -slack) | (u + v > 1 + slack)))

    def _sharpen(self, hits: Hits, origin: Float32, direction: Float64) -> None:
        """Distances along float64 directions to the triangles that the rounded ones found, if they meet these too."""
        found = flatnonzero(hits.prim >= 0)
        face, o, d = hits.face[found], origin[:, found], direction[:, found]
        table, place = self.geometry.faces_of(face)
        t, toward = plane_distance(table.facets[place].T, o, d)
        u, v = barycentrics(self.geometry, face, o + t * d, clamp=False)
        inside = (t > 0) & (u >= 0) & (v >= 0) & (u + v <= 1)
        hits.t[found[inside]], hits.toward[found[inside]] = t[inside], toward[inside]

    def _add_shapes(self, hits: Hits, origin: Float32, direction: Array) -> None:
        """Let analytic shapes that are strictly nearer replace the triangles' hits."""
        g = self.geometry
        for sphere in self._spheres:
            center, radius = g.sphere_center[sphere], g.sphere_radius[sphere]
            t = sphere_distance(center, radius, origin, direction)
            nearer = flatnonzero(t < hits.t)
            if len(nearer):
                d = direction[:, nearer]
                normal = (origin[:, nearer] + t[nearer] * d - center[:, None]) / radius
                normal /= np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
                toward = normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2]
                self._replace(hits, nearer, int(g.triangle_count + sphere), t[nearer], normal, toward)
        for plane in self._planes:
            facet = g.facets[plane][:, None]
            t, toward = plane_distance(facet, origin, direction)
            nearer = flatnonzero((t > 0) & (t < hits.t))
            self._replace(hits, nearer, int(plane), t[nearer], facet[:3], toward[nearer])

    @staticmethod
    def _replace(hits: Hits, where: NDArray[np.intp], prim: int, t: Float64, normal: Float64, toward: Float64) -> None:
        hits.prim[where] = hits.face[where] = prim
        hits.t[where] = t
        hits.normal[:, where] = normal
        hits.toward[where] = toward

    # -------------------------------------------------------------------------------------------- any hit

    def occluded(self, origin: Float32, direction: Float32, t_max: Float32, stats: Stats) -> Bools:
        """Whether anything lies on each ray (3, n) before t_max (n,)."""
        with stats.phase("occluded"):
            blocked = self._triangles.occluded(origin, direction, t_max)
        g = self.geometry
        for sphere in self._spheres:
            # Strictly: a miss is at infinity, where a sun is too.
            blocked |= sphere_distance(g.sphere_center[sphere], g.sphere_radius[sphere], origin, direction) < t_max
        for plane in self._planes:
            t, _ = plane_distance(g.facets[plane][:, None], origin, direction)
            blocked |= (t > 0) & (t < t_max)
        if self._hidden is not None:
            asked = flatnonzero(blocked)
            hits = self.nearest(origin.take(asked, axis=1), direction.take(asked, axis=1), stats)
            blocked[asked] = hits.t < t_max[asked]
        return blocked


@accelerated
def refine(facets: Float64, prim: Int32, origin: Float32, direction: Float32) -> tuple[Float64, Float32, Float64]:
    """Where rays (3, n) meet the planes of triangles prim (n,): t, normal and toward, as in `Hits`.

    facets : (np, 4) of all primitives.
    """
    found = flatnonzero(prim >= 0)
    if len(found) < SPARSE * len(prim):
        return _refine_some(facets, prim, origin, direction, found)
    of_each = np.ascontiguousarray(facets.take(prim, axis=0, mode="wrap").T)
    t, toward = plane_distance(of_each, origin, direction)
    t[prim < 0] = np.inf
    return t, of_each[:3].astype(np.float32), toward


def _refine_some(
    facets: Float64, prim: Int32, origin: Float32, direction: Float32, found: NDArray[np.intp]
) -> tuple[Float64, Float32, Float64]:
    """The same where few rays hit anything: only these are worked on."""
    n = len(prim)
    t, normal, toward = np.full(n, np.inf), np.zeros((3, n), np.float32), np.zeros(n)
    if len(found):
        of_each = np.ascontiguousarray(facets.take(prim[found], axis=0).T)
        t[found], toward[found] = plane_distance(of_each, origin.take(found, axis=1), direction.take(found, axis=1))
        for i in range(3):
            normal[i, found] = of_each[i]
    return t, normal, toward


def barycentrics(geometry: Geometry | Faces, face: NDArray[Any], point: Float64, clamp: bool = True) -> Float64:
    """Weights (2, n) of the second and third corner of triangles `face` at points (3, n), in float64.

    Of what is no triangle they mean nothing.
    """
    table, place = geometry.faces_of(face)
    result = barycentric_weights(table.weights.reshape(-1, 4), place, point)
    return clamped(result) if clamp else result


def clamped(weights: Float64) -> Float64:
    """Barycentrics (2, n), which it changes, as those of points within their triangles."""
    u, v = weights
    np.clip(u, 0, 1, out=u)
    np.clip(v, 0, 1 - u, out=v)
    return weights


@accelerated
def barycentric_weights(planes: Float64, prim: NDArray[np.integer], point: Float64) -> Float64:
    """The same, not clamped. planes: (2 nt, 4), those of the second and third corner of each triangle."""
    place = prim * 2
    result = np.empty((2, len(prim)))
    for weight in result:
        # Four numbers at a time: turning eight around takes three times as long.
        a, b, c, d = np.ascontiguousarray(planes.take(place, axis=0, mode="clip").T)
        np.multiply(a, point[0], out=weight)
        weight += b * point[1]
        weight += c * point[2]
        weight += d
        place = place + 1
    return result
