"""Photons as they leave a light: spread evenly over the cones in which it sees a ball."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...scene import AreaLight, Float32, Float64, SpotLight, SunLight
from ..core.sampler import UInt32, disk, hash32, permute, r2
from ..core.vectors import Array, dot, normalize, orthonormal_basis
from ..emitters.lights import CompiledLight, offset_on_light, range_window, spot_factor
from .caster_bounds import BoundingBalls

FAR = 1024.0
"""Seen from so many of its radii away, a ball is a disk to 5e-7."""


@dataclass(frozen=True, eq=False)
class Emitted:
    """n photons. power : (3, n) W, of each if it were the only one."""

    origin: Float64
    direction: Float64
    power: Float64


def emit(light: CompiledLight, group: BoundingBalls, number: UInt32, key: UInt32) -> Emitted:
    """Photons `number` (n,) of a light towards a group's ball; key (1,) makes their random numbers.

    Each stands for all light of its light that goes to the ball. A sun lights no unbounded group.
    """
    aim = r2(key, number)
    other = hash32(key ^ np.uint32(0x85EBCA6B))
    spread = r2(other, permute(number, hash32(other)))
    if isinstance(light.light, SunLight):
        return _emit_sun(light, group, aim, spread)
    position = light.position.astype(np.float64)
    if np.isfinite(group.radius):
        center = group.center[:, None]
    else:  # a plane lies all around: up, and far enough that a ball looks like a disk
        center = position + _UP * (FAR * getattr(light.light, "radius", 0.0) or 1.0)
    axis = np.broadcast_to(center - position, (3, len(number)))
    # A light with a size shines from all of it, turned towards the ball as towards a receiver.
    has_size = isinstance(light.light, AreaLight) or light.light.radius > 0
    origin = position + offset_on_light(light.light, axis.astype(np.float32), spread) if has_size else position
    origin = np.broadcast_to(origin, axis.shape)
    direction, solid_angle = _cone(center - origin, group.radius, aim)
    power = light.color * solid_angle
    if isinstance(light.light, AreaLight):
        area = 4 * float(np.linalg.norm(np.cross(light.light.axis_u, light.light.axis_v)))
        area *= np.pi / 4 if light.light.shape == "ELLIPSE" else 1
        power = power * (area * np.maximum(dot(np.asarray(light.light.direction, np.float64), direction), 0))
    if isinstance(light.light, SpotLight):
        power = power * spot_factor(light.light, direction.astype(np.float32))
    return Emitted(origin, direction, power * light.light.diffuse)


def _emit_sun(
    light: CompiledLight, group: BoundingBalls, aim: tuple[Float32, Float32], spread: tuple[Float32, Float32]
) -> Emitted:
    """From the ball's own shadow disk, just before it."""
    assert isinstance(light.light, SunLight)
    n = len(aim[0])
    sun = np.broadcast_to(light.position.astype(np.float64), (3, n))
    if light.light.angle > 0:
        sun = normalize(sun + offset_on_light(light.light, sun.astype(np.float32), spread))
    tangent, bitangent = orthonormal_basis(sun)
    x, y = disk(*aim)
    radius = group.radius if np.isfinite(group.radius) else 0.0
    origin = group.center[:, None] + radius * (sun + tangent * x + bitangent * y)
    power = np.broadcast_to(light.color.astype(np.float64) * (np.pi * radius * radius), (3, n))
    return Emitted(origin, -sun, power * light.light.diffuse)


def _cone(axis: Float64, radius: float, aim: tuple[Float32, Float32]) -> tuple[Float64, Float64]:
    """Unit directions (3, n) even over the cones that a ball fills, axis (3, n) away, and their solid angles (n,).

    The whole sphere from within the ball. Written with 1 - cos: cones may be narrow.
    """
    d2 = dot(axis, axis)
    sine2 = np.minimum(radius * radius / np.maximum(d2, 1e-300), 1.0)
    height = np.where(sine2 < 1, sine2 / (1 + np.sqrt(1 - sine2)), 2.0)
    x, y = disk(*aim)
    down = (x * x + y * y) * height
    forward = np.where(d2 > 0, axis / np.sqrt(np.where(d2 > 0, d2, 1.0)), _UP)
    tangent, bitangent = orthonormal_basis(forward)
    sideways = np.sqrt(height * (2 - down))
    return forward * (1 - down) + (tangent * x + bitangent * y) * sideways, 2 * np.pi * height


_UP = np.array([[0.0], [0.0], [1.0]])


def fading(light: CompiledLight, distance: Float64) -> Array:
    """What of a photon's power (n,) is left after `distance` (n,): EEVEE's range, and its soft falloff."""
    if isinstance(light.light, SunLight):
        return np.ones_like(distance)
    d2 = distance * distance
    left = range_window(d2, light.light.range) if np.isfinite(light.light.range) else np.ones_like(d2)
    if isinstance(light.light, AreaLight) or not light.light.soft_falloff:
        return left
    return np.asarray(left * d2 / (d2 + light.light.radius**2))
