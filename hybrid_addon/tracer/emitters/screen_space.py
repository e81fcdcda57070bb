# SPDX-License-Identifier: GPL-3.0-or-later
"""Raster-backed hits: where a secondary ray meets what the raster shows, its light is the raster's own pixel.

So reflections show procedural textures, EEVEE's own light, everything that it draws and the tracer does not. A hit is
backed if

* its surface is not ray traced, and looks the same from all sides: nothing mirrored or transmitted, no coat, no sheen,
  no highlight beyond MATTE_HIGHLIGHT, no colour by Fresnel or Layer Weight; or the translator could not follow its
  material: then the raster is always nearer. What asks Light Path is not the camera's for other rays;
* its point lies inside the picture, on the side of the surface that the camera sees;
* all four pixels around it show one surface (no step in depth near, not mostly what is held out, see
  `ScreenSpaceLookup`), and have the depth of the hit's own plane there: so that grazing floors work, and edges never
  mix. Where the material could not be followed, those of the four that do are enough;
* nothing that the depth pass leaves out (blended materials) is before it.
"""

from __future__ import annotations

import copy
import math

import numpy as np
from numpy.typing import NDArray

from ...expressions import depends_on_eye, reads_ray
from ...scene import Camera, Expression, Float32, Float64, Raster, Surface
from ..core.constants import (
    BACKED_ALPHA,
    BACKED_DEPTH,
    BACKED_OFFSET,
    BACKED_SLOPE,
    FILTER_SPILL,
    MATTE_HIGHLIGHT,
    MIN_ROUGHNESS,
    NO_DEPTH,
)
from ..core.rays import Rays, offset_origin, origin_offset
from ..core.stats import Stats
from ..core.vectors import dot, flatnonzero, normalize, take
from ..geometry.aggregate import PrimitiveSet
from ..geometry.flatten import Geometry
from ..geometry.hits import Hits
from ..materials.surfaces import SurfaceTable

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]


def is_matte(surface: Surface) -> bool:
    """Whether nothing of it moves with the eye: highlights are too weak, and its colours ask for no direction.

    What varies is taken at its most glossy.
    """
    if depends_on_eye(surface):
        return False
    if surface.closures:
        return all(is_matte(closure.surface) for closure in surface.closures)
    layers = (surface.coat, surface.sheen)
    if any(isinstance(layer, Expression) or layer > 0 for layer in layers):
        return False
    f0 = 1.0 if isinstance(surface.specular, Expression) else max(surface.specular)
    roughness = 0.0 if isinstance(surface.roughness, Expression) else surface.roughness
    alpha = max(roughness, MIN_ROUGHNESS) ** 2
    return f0 / (4 * alpha * alpha) <= MATTE_HIGHLIGHT


def backable(geometry: Geometry, table: SurfaceTable) -> Bools:
    """(np,) bool: primitives that secondary rays meet and whose light the raster may know."""
    matte = np.array([is_matte(s) for s in table.surfaces]) & ~table.reflects & ~table.transmits
    known = (matte | approximate(table)) & ~np.array([reads_ray(s) for s in table.surfaces])
    return np.asarray(known[geometry.surface] & geometry.camera & geometry.secondary & ~geometry.ray_traced)


def approximate(table: SurfaceTable) -> Bools:
    """(s,) surfaces whose materials could not be followed."""
    return np.array([s.approximate for s in table.surfaces])


class ScreenSpaceLookup:
    """The raster prepared; read only.

    place : (h w,) float64, 1 / depth (perspective) or depth (orthographic): over a plane it is linear in the picture.
    whole : (h w,) bool, pixels whose colour is that of one surface, the one that `place` is of.
    drawn : (3, h w) float32, the radiance of what is not held out: held out it is black, and so divided out again.
    color : the same with shadows and caustics that are not drawn.
    albedo : (h, w, 3) float32 or None, its diffuse colour.
    size  : of a pixel on the view plane.
    """

    def __init__(
        self,
        camera: Camera,
        raster: Raster,
        filter_radius: float,
        geometry: Geometry,
        table: SurfaceTable,
        veils: PrimitiveSet,
    ) -> None:
        self.camera, self.geometry, self.veils = camera, geometry, veils
        self.primitives = backable(geometry, table)
        self.height, self.width = raster.depth.shape
        alpha = raster.pixels[..., 3]
        shown = (alpha >= BACKED_ALPHA) & (raster.depth > 0) & np.isfinite(raster.pixels).all(axis=-1)
        if raster.albedo is not None:
            shown &= np.isfinite(raster.albedo).all(axis=-1)
        place = np.where(shown, raster.depth, np.nan).astype(np.float64)
        if camera.projection == "PERSP":
            place = 1 / place
        reach = max(1, math.ceil(filter_radius - FILTER_SPILL))
        self.place = place.ravel()
        self.whole = (shown & (raster.depth < NO_DEPTH) & ~_near_steps(place, reach)).ravel()
        drawn = raster.pixels[..., :3] / np.where(shown, alpha, np.float32(1))[..., None]
        self.drawn = self.color = np.ascontiguousarray(drawn.reshape(-1, 3).T)
        self.albedo = (
            None if raster.albedo is None else raster.albedo / np.where(shown, alpha, np.float32(1))[..., None]
        )
        self.partly = approximate(table)[geometry.surface]
        matrix = np.asarray(camera.matrix_world, np.float64)
        self.eye, self.axes = matrix[:3, 3] - geometry.center, matrix[:3, :3]
        left, right, bottom, top = camera.view_plane
        self.size = (right - left) / camera.resolution[0], (top - bottom) / camera.resolution[1]

    def shaded(self, shadow: Float32, caustic: Float32 | None) -> ScreenSpaceLookup:
        """The same with shadows and light (h, w, 3) that are not drawn in the raster but will be in the picture."""
        other = copy.copy(self)
        other.color = self.drawn * shadow.reshape(-1, 3).T
        if caustic is not None and self.albedo is not None:
            other.color += (caustic * self.albedo).reshape(-1, 3).T * np.float32(1 / np.pi)
        return other

    def look_up(self, rays: Rays, hits: Hits, hit: Bools, stats: Stats) -> tuple[Numbers, Float32]:
        """Which of n rays, of those that `hit`, meet what the raster shows, and its radiance there: (m,), (3, m)."""
        secondary = hit & ~rays.camera
        index = flatnonzero(secondary & self.primitives.take(hits.prim, mode="wrap"))
        index, color = self._shown(rays, hits, index)
        if len(self.veils) and len(index):
            clear = self._unveiled(rays, hits, index, stats)
            index, color = index[clear], color[:, clear]
        stats.add("backed", len(index))
        stats.add("not_backed", np.count_nonzero(secondary) - len(index))
        return index, color

    def _shown(self, rays: Rays, hits: Hits, index: Numbers) -> tuple[Numbers, Float32]:
        """Those of the hits `index` that the raster shows, from the side that was met, and its colours there."""
        from_eye = self._from_eye(rays, hits, index)
        x, y, depth = self._film(from_eye)
        inside = (x >= 0) & (x < self.width - 1) & (y >= 0) & (y < self.height - 1) & (depth > 0)
        kept = flatnonzero(inside)
        normal = take(hits.normal, index[kept])
        normal *= -np.sign(hits.toward[index[kept]])
        place, slope_x, slope_y, facing = self._plane(take(from_eye, kept), normal, depth[kept])
        if not facing.all():
            kept = kept[facing]
            place, slope_x, slope_y = place[facing], slope_x[facing], slope_y[facing]
        index, u, v = index[kept], x[kept], y[kept]
        column, row = u.astype(np.intp), v.astype(np.intp)
        u -= column
        v -= row
        oblique = BACKED_OFFSET * (np.abs(slope_x) + np.abs(slope_y))
        tolerance = BACKED_DEPTH * place + oblique
        corner = row * self.width + column
        color, total = np.zeros((3, len(index)), np.float32), np.zeros(len(index), np.float32)
        all_four = oblique <= BACKED_SLOPE * place
        for j, i in ((0, 0), (0, 1), (1, 0), (1, 1)):
            pixel = corner + (j * self.width + i)
            expected = place + (i - u) * slope_x + (j - v) * slope_y
            agrees = self.whole.take(pixel) & (np.abs(self.place.take(pixel) - expected) <= tolerance)
            weight = (agrees * (u if i else 1 - u) * (v if j else 1 - v)).astype(np.float32)
            color += np.where(agrees, self.color.take(pixel, axis=1), np.float32(0)) * weight
            total += weight
            all_four &= agrees
        one = self.partly.take(hits.prim[index]) & (total > 0)
        found = flatnonzero(all_four | one)
        color = color.take(found, axis=1)
        color /= np.where(all_four[found], np.float32(1), total[found])
        return index[found], color

    def _from_eye(self, rays: Rays, hits: Hits, index: Numbers) -> Float64:
        """(3, m) from the camera to the hits `index`."""
        result = take(rays.direction, index) * hits.t[index]
        result += take(rays.origin, index)
        result -= self.eye[:, None]
        return result

    def _film(self, from_eye: Float64) -> tuple[Float64, Float64, Float64]:
        """Where points (3, n) lie in the raster, whole numbers at the centres of pixels, and their depth."""
        x, y, depth = dot(self.axes[:, 0], from_eye), dot(self.axes[:, 1], from_eye), -dot(self.axes[:, 2], from_eye)
        if self.camera.projection == "PERSP":
            x /= depth
            y /= depth
        left, _, bottom, _ = self.camera.view_plane
        for values, low, size, first in ((x, left, self.size[0], 0), (y, bottom, self.size[1], 1)):
            values -= low
            values /= size
            values -= self.camera.window[first] + 0.5
        return x, y, depth

    def _plane(self, from_eye: Float64, normal: Float64, depth: Float64) -> tuple[Float64, Float64, Float64, Bools]:
        """`place` of hits (n,), how it grows for each pixel across and up on their planes, and if these face us."""
        a, b, c = (dot(self.axes[:, i], normal) for i in range(3))
        across, up = self.size
        if self.camera.projection == "PERSP":
            # n.P = k on the plane and P = depth q, with q = (x, y, -1) on the view plane: 1 / depth = n.q / k.
            k = dot(normal, from_eye)
            return 1 / depth, a * across / k, b * up / k, k < 0
        return depth, a * across / c, b * up / c, c > 0

    def _unveiled(self, rays: Rays, hits: Hits, index: Numbers, stats: Stats) -> Numbers:
        """Which of the hits `index` the camera sees past all veils."""
        from_eye = self._from_eye(rays, hits, index)
        point, normal = from_eye + self.eye[:, None], hits.normal[:, index] * -np.sign(hits.toward[index])
        if self.camera.projection == "PERSP":
            distance = np.sqrt(dot(from_eye, from_eye))
            direction = normalize(-from_eye)
        else:
            distance = -dot(self.axes[:, 2], from_eye)
            direction = np.broadcast_to(self.axes[:, 2:], point.shape)
        offset = origin_offset(point.astype(np.float32), hits.take(index).extent(self.geometry))
        origin, wi = offset_origin(point, normal, offset), np.ascontiguousarray(direction, np.float32)
        return flatnonzero(~self.veils.occluded(origin, wi, distance.astype(np.float32), stats))


def _near_steps(place: Float64, reach: int) -> Bools:
    """Pixels (h, w) that lie at a step in depth, or within `reach` pixels of one, across or up.

    Between two pixels there is a step where depth changes otherwise than on either side: on a plane it never does.
    NaN, at what is held out, is no step.
    """
    near = np.zeros(place.shape, bool)
    for values, marks in ((place, near), (place.T, near.T)):
        change = np.diff(values, axis=1)
        bend = np.full((len(values), change.shape[1] + 1), np.nan)
        bend[:, 1:-1] = np.abs(np.diff(change, axis=1))
        larger = np.maximum(values[:, :-1], values[:, 1:])
        step = np.fmin(bend[:, :-1], bend[:, 1:]) > BACKED_DEPTH * larger
        for distance in range(reach):
            last = max(0, step.shape[1] - distance)
            for moved, to in ((step[:, distance:], 0), (step[:, :last], distance)):
                marks[:, to : to + moved.shape[1]] |= moved
                marks[:, to + 1 : to + 1 + moved.shape[1]] |= moved
    return near
