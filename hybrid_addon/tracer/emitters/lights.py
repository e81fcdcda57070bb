"""Lights: how much of each reaches a point if nothing is in between. Formulas as EEVEE's (eevee_light_lib.glsl).

Each `illuminate_*` answers, for points (3, n) and shading normals (3, n), with `Illumination`; one function a kind of
light. All light positions are relative to the scene's centre.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from ...scene import AreaLight, Float32, Float64, Light, PointLight, SpotLight, SunLight
from ..core.constants import FAR_AREA_RATIO, NEAR_BALL, SPOT_BLEND_FLOOR
from ..core.sampler import UInt32, disk, hash32
from ..core.vectors import Array, count, dot, matrix_times, orthonormal_basis, select, take
from .form_factors import ellipse_form_factor, form_factor

Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CompiledLight:
    """A light of the scene with its place relative to the scene's centre.

    color    : (3, 1) float32, its intensity, irradiance or radiance.
    position : (3, 1) float32; for a sun its direction.
    key      : what it adds to the path signature of a point that it reaches, and its dimension of the sampler.
    receives, blocks : (np,) bool, the primitives that it lights and those that cast shadows in its light; None: all.
    """

    light: Light
    color: Float32
    position: Float32
    key: np.uint32
    receives: Bools | None = None
    blocks: Bools | None = None

    @property
    def is_black(self) -> bool:
        """Cannot light anything."""
        light = self.light
        return not self.color.any() or light.diffuse == light.specular == light.transmission == 0

    @property
    def is_unseen(self) -> bool:
        """No ray can meet it, or sees anything of it."""
        light = self.light
        if isinstance(light, SunLight):
            has_size = light.angle > 0
        elif isinstance(light, AreaLight):
            has_size = bool(np.cross(light.axis_u, light.axis_v).any())
        else:
            has_size = light.radius > 0
        return not (has_size and self.color.any()) or (light.specular == 0 and light.transmission == 0)

    @property
    def has_place(self) -> bool:
        """Is not infinitely far."""
        return not isinstance(self.light, SunLight)

    @property
    def is_soft(self) -> bool:
        """Has a size, and so casts soft shadows."""
        light = self.light
        if isinstance(light, SunLight):
            return light.cast_shadow and light.angle > 0
        return light.cast_shadow and (isinstance(light, AreaLight) or light.radius > 0)


@dataclass(eq=False)
class Illumination:
    """Unshadowed light on n points; the colour of the light is left out.

    wi         : (3, n) float32 unit directions to the light.
    cosine     : (n,) float32, of the angle between wi and the shading normal, 0 behind.
    diffuse    : (n,) float32, irradiance on the shading normal (cosine included), >= 0.
    specular   : (n,) float32, irradiance on a plane facing the light, for the highlight, >= 0.
    d2         : (n,) float32, squared distances; None: it is infinitely far.
    """

    wi: Array
    cosine: Array
    diffuse: Array
    specular: Array
    d2: Array | None = None


def compile_lights(lights: Sequence[Light], center: Float64, objects: NDArray[np.intp]) -> list[CompiledLight]:
    """Place all lights relative to the scene's centre. objects: (np,) number of each primitive's object."""
    compiled = []

    def members(numbers: frozenset[int] | None) -> Bools | None:
        return None if numbers is None else np.isin(objects, sorted(numbers))

    for light, key in zip(lights, _keys(lights), strict=True):
        if isinstance(light, SunLight):
            direction = np.array(light.direction, np.float64)
            color, place = light.irradiance, direction / np.sqrt((direction * direction).sum())
        elif isinstance(light, AreaLight):
            color, place = light.radiance, np.array(light.position, np.float64) - center
        else:
            color, place = light.intensity, np.array(light.position, np.float64) - center
        column, row = np.array(color, np.float32)[:, None], np.asarray(place, np.float32)[:, None]
        compiled.append(CompiledLight(light, column, row, key, members(light.receivers), members(light.blockers)))
    return compiled


def _keys(lights: Sequence[Light]) -> UInt32:
    """One for each light, by its name: what other lights there are does not move its samples."""
    names = [light.name for light in lights]
    twins = [names[:number].count(name) for number, name in enumerate(names)]
    numbers = [crc32(f"{name}\0{twin}".encode()) for name, twin in zip(names, twins, strict=True)]
    return hash32(np.array(numbers, np.uint32))


def illuminate(compiled: CompiledLight, point: Float32, normal: Float32, least_distance: Float32) -> Illumination:
    """Light of one lamp on points (3, n) with shading normals (3, n).

    least_distance : (n,) float32, the points' own uncertainty: a light that is nearer counts as this far.
    """
    light = compiled.light
    if isinstance(light, SunLight):
        return _illuminate_sun(compiled, normal)
    if isinstance(light, AreaLight):
        return _illuminate_area(light, compiled, point, normal, least_distance)
    return _illuminate_point(light, compiled, point, normal, least_distance)


def shadow_rays(
    compiled: CompiledLight, origin: Float32, normal: Float32, square: tuple[Float32, Float32] | None
) -> tuple[Float32, Float32]:
    """Unit directions (3, n) from origins (3, n) to the light and distances (n,).

    square : points (n,) of the unit square, which choose points on the light, all of its shape alike; those that lie
             below the horizon of the normals (3, n) change sides, as `illuminate` has no light from there. None: hard
             shadows, towards the centre.
    """
    n = origin.shape[1]
    is_sun = isinstance(compiled.light, SunLight)
    wi: Float32 = np.broadcast_to(compiled.position, (3, n)) if is_sun else compiled.position - origin
    if square is not None:
        offset = offset_on_light(compiled.light, wi, square)
        wi = wi + offset * np.copysign(np.float32(1), dot(wi + offset, normal))
    elif is_sun:
        return wi, np.full(n, np.inf, np.float32)
    distance: Float32 = np.sqrt(dot(wi, wi))
    wi *= 1 / distance
    if is_sun:
        distance = np.full(n, np.inf, np.float32)
    return wi, distance


def offset_on_light(light: Light, wi: Float32, square: tuple[Float32, Float32]) -> Float32:
    """From the centre of a light, seen along wi (3, n), to points of its shape: (3, n).

    A sun is a disk of radius tan(angle / 2) at distance 1. A point light is a disk that faces the receiver; as a ball
    (no soft falloff) it is the larger disk that fills the same cone, r d / sqrt(d^2 - r^2).
    """
    if isinstance(light, AreaLight):
        x, y = disk(*square) if light.shape == "ELLIPSE" else (2 * square[0] - 1, 2 * square[1] - 1)
        axes = zip(light.axis_u, light.axis_v, strict=True)
        return np.stack([np.float32(u) * x + np.float32(v) * y for u, v in axes])
    x, y = disk(*square)
    d2 = dot(wi, wi)
    if isinstance(light, SunLight):
        radius = np.full(len(d2), np.tan(light.angle / 2), np.float32)
    elif light.soft_falloff:
        radius = np.full(len(d2), light.radius, np.float32)
    else:
        radius = disk_of_ball(light.radius, d2)
    tangent, bitangent = orthonormal_basis(wi * (1 / np.sqrt(d2)))
    return tangent * (x * radius) + bitangent * (y * radius)


def disk_of_ball(radius: float, d2: Array) -> Array:
    """Radius (n,) of the disk at the centre of a ball that fills the ball's cone, at squared distances (n,) from it."""
    r2 = d2.dtype.type(radius**2)
    return np.asarray(np.sqrt(r2 * d2 / np.maximum(d2 - r2, d2.dtype.type(NEAR_BALL) * d2)))


def _illuminate_sun(compiled: CompiledLight, normal: Float32) -> Illumination:
    n = normal.shape[1]
    wi = np.broadcast_to(compiled.position, (3, n))
    cosine = np.maximum(dot(compiled.position, normal), np.float32(0))
    facing = (cosine > 0).astype(np.float32)
    return Illumination(wi, cosine, cosine, facing)


def _towards(compiled: CompiledLight, point: Float32, least_distance: Float32) -> tuple[Float32, Float32]:
    """Unit directions to the light and squared distances, none of them 0."""
    wi = compiled.position - point
    d2 = np.maximum(dot(wi, wi), least_distance * least_distance)
    wi *= 1 / np.sqrt(d2)
    return wi, d2


def range_window(d2: Array, reach: float) -> Array:
    """EEVEE's finite range: (1 - (d^2 / R^2)^2)^2 for d < R, else 0."""
    x = d2 * np.float32(1 / (reach * reach))
    w = np.maximum(1 - x * x, np.float32(0))
    return np.asarray(w * w)


def _illuminate_point(
    light: PointLight, compiled: CompiledLight, point: Float32, normal: Float32, least_distance: Float32
) -> Illumination:
    """Inverse square law; soft falloff multiplies by d^2 / (d^2 + r^2) (a disk that faces the point).

    Without soft falloff the light is a ball: inside it d counts as r.
    """
    wi, d2 = _towards(compiled, point, least_distance)
    r2 = np.float32(light.radius * light.radius)
    received = 1 / (d2 + r2) if light.soft_falloff else 1 / np.maximum(d2, r2)
    if np.isfinite(light.range):
        received *= range_window(d2, light.range)
    if isinstance(light, SpotLight):
        received *= spot_factor(light, point - compiled.position)
    cosine = np.maximum(dot(wi, normal), np.float32(0))
    received = received * (cosine > 0)
    return Illumination(wi, cosine, received * cosine, received, d2)


def spot_factor(light: SpotLight, offset: Float32) -> Float32:
    """The spot's smoothstep (n,) for points at `offset` (3, n) from it: EEVEE and Cycles agree on it."""
    local = matrix_times(np.asarray(light.world_to_light), offset)
    z = -local[2]
    ahead = z > 0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        cosine = 1 / np.sqrt(1 + (local[0] * local[0] + local[1] * local[1]) / (z * z))
    rim = np.float32(max(SPOT_BLEND_FLOOR, (1 - light.cos_cone) * light.blend))
    x = np.clip((cosine - np.float32(light.cos_cone)) / rim, 0, 1)
    return np.where(ahead, x * x * (3 - 2 * x), np.float32(0)).astype(np.float32)


def _illuminate_area(
    light: AreaLight, compiled: CompiledLight, point: Float32, normal: Float32, least_distance: Float32
) -> Illumination:
    """Its form factor for the diffuse part; for Phong's highlight a point at the centre of the same solid angle.

    That solid angle, A cos / (d^2 + A / 2 pi), is right from afar and never more than a half space.
    """
    u, v = (np.array(a, np.float64) for a in (light.axis_u, light.axis_v))
    is_round = light.shape == "ELLIPSE"
    area = (np.pi if is_round else 4) * float(np.sqrt((np.cross(u, v) ** 2).sum()))
    wi, d2 = _towards(compiled, point, least_distance)
    shines = np.array(light.direction, np.float32)[:, None]
    front = np.maximum(-dot(shines, wi), np.float32(0))
    specular = np.float32(area) * front / (d2 + np.float32(area / (2 * np.pi)))
    cosine = np.maximum(dot(wi, normal), np.float32(0))
    diffuse = np.float32(area) * front * cosine / d2
    reach2 = FAR_AREA_RATIO**2 * float((u * u).sum() + (v * v).sum())
    near = select((d2 < reach2) & (front > 0))
    if count(near, len(d2)):
        toward, facing = compiled.position - take(point, near), take(normal, near)
        diffuse[near] = np.float32(np.pi) * _form_factor(toward, u, v, is_round, facing)
    if np.isfinite(light.range):
        window = range_window(d2, light.range)
        specular *= window
        diffuse *= window
    return Illumination(wi, cosine, diffuse, specular, d2)


def _form_factor(toward: Float32, u: Float64, v: Float64, is_round: bool, normal: Float32) -> Array:
    """(n,) of area lights with half edges or half axes u, v (3,), seen from points `toward` (3, n) before them."""
    if not is_round:
        corners = [(su * u + sv * v).astype(np.float32)[:, None] for su, sv in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        return form_factor([toward + corner for corner in corners], normal)
    frame = (*orthonormal_basis(normal), normal)
    center, *axes = (
        np.stack([dot(axis, a.astype(axis.dtype)) for axis in frame]).astype(np.float64)
        for a in (toward, u[:, None], v[:, None])
    )
    return ellipse_form_factor(center, axes[0], axes[1])
