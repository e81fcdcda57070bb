# SPDX-License-Identifier: GPL-3.0-or-later
"""What expressions read at hits: images, and the interpolated data of a mesh's corners."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import expressions as ex
from ...procedural import elementary
from ...scene import Float32, Float64, Texture
from ..core.constants import BUMP_STEP, MAX_HIDDEN_FACES, STEEPEST_FACET
from ..core.rays import (
    CAMERA_RAY,
    DIFFUSE,
    REFLECTED_RAY,
    SHADOW_RAY,
    SHARP,
    TRANSMISSIONS,
    TRANSMITTED_RAY,
    TRAVELLED,
    RayState,
    offset_origin,
    origin_offset,
    traceable,
)
from ..core.vectors import (
    ALL,
    Array,
    Index,
    count,
    cross,
    dot,
    flatnonzero,
    orthonormal_basis,
    select,
    signs,
    take,
    write,
)
from ..geometry.aggregate import barycentrics
from ..geometry.flatten import Geometry
from ..geometry.hits import Hits
from ..materials.textures import sample_texture
from .interaction import smooth_normals

Numbers = NDArray[np.intp]


class HitData:
    """n hits, all on surface `surface` of the scene (expressions.Hits). What nobody reads of them is not gathered.

    face, point : (n,) and (3, n).   entering : (n,) bool, seen from the primitive's outer side.
    normal, wo  : (3, n) shading normal on the side of wo, and the direction to the eye.
    distance    : (n,) metres that the ray came.
    came        : of those rays; None: camera rays, or nobody asks.
    """

    def __init__(
        self, geometry: Geometry, surface: int, face: Numbers, point: Float64, entering: NDArray[np.bool_],
        normal: Float32, wo: Float32, distance: Float64, came: RayState | None = None, index: Index = ALL,
    ) -> None:  # fmt: skip
        """The hits `index` of those that the arrays are of."""
        self.geometry, self.surface, self.face = geometry, surface, take(face, index)
        self._of_all = {"point": point, "entering": entering, "normal": normal, "wo": wo, "distance": distance}
        self._came, self._index = came, index
        self._layout = geometry.layouts[surface] if geometry.layouts else {}

    @cached_property
    def point(self) -> Float64:  # noqa: D102 (see the class)
        return take(self._of_all["point"], self._index)

    @cached_property
    def entering(self) -> NDArray[np.bool_]:  # noqa: D102
        return take(self._of_all["entering"], self._index)

    @cached_property
    def normal(self) -> Float32:  # noqa: D102
        return take(self._of_all["normal"], self._index)

    @cached_property
    def wo(self) -> Float32:  # noqa: D102
        return take(self._of_all["wo"], self._index)

    @cached_property
    def distance(self) -> Float64:  # noqa: D102
        return take(self._of_all["distance"], self._index)

    @cached_property
    def came(self) -> RayState:  # noqa: D102
        if self._came is not None:
            return self._came.take(self._index)
        n = len(self.face)
        none = np.zeros(n, np.int16)
        return RayState(np.full(n, CAMERA_RAY), none, none, np.zeros((4, n), np.float32))

    def image(self, texture: Texture, uv: Array | None) -> Float32:
        """RGBA (4, n)."""
        u, v = self._coordinates("uv:" + texture.uv_map) if uv is None else uv[:2]
        return sample_texture(texture, u, v)

    def attribute(self, key: str) -> Float32:
        """(width, n) float32: what the hit itself knows, or data of the mesh's corners, interpolated; else 0.

        Of a tangent all four rows, and those of a normal, change sign on the inner side: with the normal, which is on
        the side of wo, they make the frame of the outer side turned around, as in EEVEE.
        """
        own = self._OWN.get(key)
        if own is not None:
            return np.asarray(own(self), np.float32)
        if key.startswith(ex.RAY):
            return np.asarray(RAY[key.removeprefix(ex.RAY)](self), np.float32)[None]
        if key.startswith(ex.INSTANCE):
            return self._of_instance(key.removeprefix(ex.INSTANCE)).astype(np.float32)
        if key.startswith("uv:"):
            return np.stack([*self._coordinates(key), np.zeros(len(self.face))]).astype(np.float32)
        found = self._interpolated(key).astype(np.float32)
        return found * signs(self.entering) if key.startswith(("tangent:", "object_normal")) else found

    _OWN: ClassVar[dict[str, Callable[[HitData], Array]]] = {
        "position": lambda hits: hits.point + hits.geometry.center[:, None],
        "normal": lambda hits: hits.normal,
        "true_normal": lambda hits: hits._true_normal,
        "interpolated_normal": lambda hits: hits.normal * hits._shortened,
        "incoming": lambda hits: hits.wo,
        "backfacing": lambda hits: ~hits.entering[None],
        "cosine": lambda hits: dot(hits.normal, hits.wo)[None],
    }

    def _of_instance(self, key: str) -> Float64:
        """(width, n) of the instances that are hit; 0 where they have none, or nothing reads it."""
        values = self.geometry.object_values.get(key)
        if values is None:
            return np.zeros((4, len(self.face)))
        return np.asarray(values.take(self.geometry.object.take(self.geometry.rows_of(self.face)), axis=0).T)

    @property
    def _true_normal(self) -> Float32:
        """(3, n) unit normals of the faces, whatever the corners' normals are; of spheres those that they have."""
        table, place = self.geometry.faces_of(self.face)
        flat = table.facets[:, :3].take(place, axis=0).T.astype(np.float32) * signs(self.entering)
        return np.where(flat.any(axis=0), flat, self.normal)

    @property
    def _shortened(self) -> Float32:
        """(n,) length of the shading normal that is interpolated: 1 at the corners, less between those that differ."""
        table, place = self.geometry.faces_of(self.face)
        of_corners = table.normals
        result = np.ones(len(self.face), np.float32)
        smooth = flatnonzero(table.smooth.take(place))
        if of_corners is None or len(smooth) == 0:
            return result
        u, v = barycentrics(table, place[smooth], self.point[:, smooth])
        corner = of_corners.take(place[smooth], axis=0).T
        n = corner[0:3] * (1 - u - v) + corner[3:6] * u + corner[6:9] * v
        result[smooth] = np.sqrt(dot(n, n))
        return result

    def gradient(self, value: Callable[[HitData], Array], on_facet: bool = False) -> Float64:
        """(3, n): how a number (1, n) grows along the surface, for each metre; over a step of about a pixel.

        Seen from the inner side it is turned around, with the normal: what rises outwards is a hollow from within.
        """
        normal = self.normal.astype(np.float64)
        axis = np.where(np.abs(normal[0]) < 0.5, 1.0, 0.0)
        first = cross(normal, np.stack([axis, 1 - axis, np.zeros_like(axis)]))
        first /= np.sqrt(dot(first, first))
        step, here = np.maximum(self.distance * BUMP_STEP, np.finfo(float).tiny), value(self)
        result = np.zeros((3, len(self.face)))
        for direction in (first, cross(normal, first)):
            way = direction
            if on_facet:  # along the normal back to the facet, which is steep where it is displaced
                facet = self._true_normal.astype(np.float64)
                way = direction - normal * (dot(facet, direction) / np.maximum(dot(facet, normal), STEEPEST_FACET))
            there = HitData(
                self.geometry, self.surface, self.face, self.point + way * step, self.entering, self.normal,
                self.wo, self.distance, self.came,
            )  # fmt: skip
            result += direction * ((value(there)[0].astype(np.float64) - here[0]) / step)
        return result * signs(self.entering)

    def raycast(self, position: Array, direction: Array, length: Array, only_local: bool) -> Float32:
        """(9, n), see `expressions.Hits`. The nearest hit whatever it is of, transparent or not (svm/raycast.h)."""
        n, g = len(self.face), self.geometry
        own = g.object.take(g.rows_of(self.face))
        length = np.broadcast_to(length[0], n).astype(np.float64)
        result = np.zeros((9, n), np.float32)
        result[2] = length
        place = np.broadcast_to(position, (3, n)).astype(np.float64)
        way = np.broadcast_to(direction, (3, n)).astype(np.float64)
        size = np.sqrt(dot(way, way))
        way = way / np.where(size > 0, size, 1)
        start = place - g.center[:, None]
        # From its own place a ray leaves the surface on the side to which it goes.
        here = np.abs(start - self.point).max(axis=0) <= origin_offset(self.point.astype(np.float32), self._extent)
        outward = self._true_normal * np.where(dot(self._true_normal, way) < 0, np.float32(-1), np.float32(1))
        offset = np.where(here, origin_offset(self.point.astype(np.float32), self._extent), np.float32(0))
        origin, sent = offset_origin(start, outward, offset), np.asarray(way, np.float32)
        left = flatnonzero(traceable(origin, sent) & (length > 0) & (size > 0))
        gone = np.zeros(n)
        for _ in range(MAX_HIDDEN_FACES):
            if len(left) == 0 or g.cast is None:
                break
            hits = g.cast(origin[:, left], sent[:, left])
            far = gone[left] + hits.t
            met = (hits.prim >= 0) & (far <= length[left])
            mine = met & (g.object.take(hits.prim, mode="wrap") == own[left])
            there = flatnonzero(mine if only_local else met)
            found, index = hits.take(there), left[there]
            result[0, index], result[1, index], result[2, index] = 1, mine[there], far[there]
            result[3:6, index] = place[:, index] + sent[:, index] * far[there]
            result[6:9, index] = self._facing(found, origin[:, index], sent[:, index])
            if not only_local:
                break
            beside = flatnonzero(met & ~mine)  # another object, which is not there
            found, left = hits.take(beside), left[beside]
            point = origin[:, left] + sent[:, left] * found.t
            behind = found.normal * np.sign(found.toward).astype(np.float32)
            gone[left] += found.t
            origin[:, left] = offset_origin(point, behind, origin_offset(point.astype(np.float32), found.extent(g)))
        return result

    @cached_property
    def _extent(self) -> Float32:
        """(n,) of what is hit (`Hits.extent`)."""
        table, place = self.geometry.faces_of(self.face)
        return table.extent.take(place)

    def _facing(self, hits: Hits, origin: Float32, direction: Float32) -> Float32:
        """(3, m) smooth normals of hits on the side that their rays come from."""
        table, place = self.geometry.faces_of(hits.face)
        entering = hits.toward < 0
        facing = hits.normal * np.where(entering, np.float32(1), np.float32(-1))
        if table.normals is None or len(place) == 0:
            return facing
        point = origin + direction * hits.t
        return smooth_normals(
            table.smooth, table.normals, table.weights, place.astype(np.intp), point, facing, entering
        )[1]

    def unit_normal(self, n: Array) -> Float32:
        """Vectors (3, n) as unit normals, whichever way they look; where there is none the shading normal stays."""
        length = np.sqrt(dot(n, n))
        usable = (length > 0) & np.isfinite(length)
        return np.where(usable, n / np.where(usable, length, 1), self.normal).astype(np.float32)

    @cached_property
    def _weights(self) -> tuple[Index, Float64]:
        """The hits on triangles and their barycentrics (3, m)."""
        on_mesh = select(self.geometry.is_triangle(self.face))
        weights = np.empty((3, count(on_mesh, len(self.face))))
        weights[1:] = barycentrics(self.geometry, take(self.face, on_mesh), take(self.point, on_mesh))
        np.subtract(1 - weights[1], weights[2], out=weights[0])
        return on_mesh, weights

    def _interpolated(self, key: str) -> Float64:
        start, width = self._layout.get(key, (0, 0))
        result = np.zeros((width or 3, len(self.face)))
        on_mesh, weights = self._weights if width else (ALL, result)
        corner = self.geometry.corners_of(take(self.face, on_mesh), key, start, width) if width else None
        if corner is None:
            return result
        found, second, third = corner
        found = found * weights[0]
        found += second * weights[1]
        found += third * weights[2]
        write(result, on_mesh, found)
        return result

    def _coordinates(self, key: str) -> tuple[Float64, Float64]:
        """u, v (n,) from the UV map of triangles, longitude and latitude on spheres, metres on planes."""
        geometry, face, point = self.geometry, self.face, self.point
        nt, ns = geometry.triangle_count, geometry.sphere_count
        u, v = self._interpolated(key)[:2]
        on_sphere = flatnonzero((face >= nt) & (face < nt + ns))
        if len(on_sphere):
            x, y, z = point[:, on_sphere] - geometry.sphere_center[face[on_sphere] - nt].T
            u[on_sphere] = 0.5 + elementary.arctan2(y, x) / (2 * np.pi)
            v[on_sphere] = 0.5 + elementary.arctan2(z, np.sqrt(x * x + y * y)) / np.pi
        on_plane = flatnonzero((face >= nt + ns) & (face < geometry.flattened_count))
        if len(on_plane):
            u[on_plane], v[on_plane] = _plane_coordinates(geometry.facets[face[on_plane], :3].T, point[:, on_plane])
        return u, v


def _kind(*kinds: np.uint8) -> Callable[[HitData], Array]:
    """Whether rays are of these kinds. What a diffuse surface sees is no camera's."""
    return lambda hits: np.isin(hits.came.kind, kinds) & (hits.came.history[DIFFUSE] == 0)


def _depth(hits: HitData) -> Array:
    """All bounces; a shadow ray is one further, as it is in Cycles."""
    return np.asarray(hits.came.depth + hits.came.history[DIFFUSE] + (hits.came.kind == SHADOW_RAY))


def _glossy_depth(hits: HitData) -> Array:
    return np.asarray(hits.came.depth - hits.came.history[TRANSMISSIONS])


RAY: dict[str, Callable[[HitData], Array]] = {
    "Is Camera Ray": _kind(CAMERA_RAY),
    "Is Shadow Ray": lambda hits: hits.came.kind == SHADOW_RAY,
    "Is Diffuse Ray": lambda hits: (hits.came.kind == CAMERA_RAY) & (hits.came.history[DIFFUSE] > 0),
    "Is Glossy Ray": lambda hits: np.isin(hits.came.kind, (REFLECTED_RAY, TRANSMITTED_RAY)),
    "Is Singular Ray": lambda hits: hits.came.history[SHARP],
    "Is Reflection Ray": lambda hits: (hits.came.kind == REFLECTED_RAY) | RAY["Is Diffuse Ray"](hits),
    "Is Transmission Ray": lambda hits: hits.came.kind == TRANSMITTED_RAY,
    "Ray Length": lambda hits: hits.came.history[TRAVELLED] + hits.distance,
    "Ray Depth": _depth,
    "Diffuse Depth": lambda hits: hits.came.history[DIFFUSE],
    "Glossy Depth": _glossy_depth,
    "Transparent Depth": lambda hits: hits.came.straight,
    "Transmission Depth": lambda hits: hits.came.history[TRANSMISSIONS],
}
"""(n,) what surfaces may ask of the rays that see them, by Light Path's outputs, as Cycles answers (svm/light_path.h
and path_state_next in integrator/path_state.h): a refracted ray is glossy, too, one that went straight on is what it
was. Rays know no diffuse bounce but that of photons, no volumes and no portals."""


def _plane_coordinates(normal: Float64, point: Float64) -> tuple[Float64, Float64]:
    """Coordinates along two axes of a plane; for a floor along x and y."""
    tangent, bitangent = orthonormal_basis(normal)
    return dot(tangent, point), dot(bitangent, point)
