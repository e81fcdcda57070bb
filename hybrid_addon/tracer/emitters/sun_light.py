# SPDX-License-Identifier: GPL-3.0-or-later
"""Suns: parallel light, from a disk of radius tan(angle / 2) at distance 1."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...procedural import elementary
from ...scene import Float32, Float64, SunLight
from ..core.constants import LEAST_LAMP
from ..core.sampler import disk
from ..core.vectors import Array, dot, normalize, orthonormal_basis
from .facing_disk import lobe_over_facing_disk, point_on_facing_disk
from .light import Bools, CompiledLight, Illumination, Lobe, Photons, UnitSquare, register


@register(SunLight)
@dataclass(frozen=True, eq=False)
class CompiledSunLight(CompiledLight):
    """A sun; it reaches everything, alike."""

    light: SunLight

    is_infinite: ClassVar[bool] = True

    @property
    def is_delta(self) -> bool:
        """Without an angle."""
        return not self.light.angle > 0

    @property
    def color_over_radiance(self) -> float:
        """Its colour is an irradiance: sr of the disk, weighted by the cosine."""
        return float(np.pi * elementary.sin(min(self.light.angle, np.pi) / 2) ** 2)

    def place(self) -> Float64:
        """Its direction, made a unit vector."""
        direction = np.array(self.light.direction, np.float64)
        return np.asarray(direction / np.sqrt((direction * direction).sum()))

    def half_size(self, toward: Float64) -> float:
        """The disk's radius."""
        return float(elementary.tan(self.light.angle / 2))

    def validate(self) -> None:
        """Its direction must not be 0, its angle finite and not negative."""
        super().validate()
        direction = self.light.direction
        self.require(any(direction), "direction must not be 0")
        self.require(bool(np.isfinite(direction).all()), f"its place must be finite, got {direction}")
        self.require_finite("angle")
        self.require_not_negative("angle")

    def illuminate(self, point: Float32, normal: Float32, least_distance: Float32) -> Illumination:
        """Its irradiance by the cosine."""
        cosine = np.maximum(dot(self.position, normal), np.float32(0))
        facing = (cosine > 0).astype(np.float32)
        return Illumination(np.broadcast_to(self.position, normal.shape), cosine, cosine, facing)

    def offset(self, toward: Float32, square: UnitSquare) -> Float32:
        """On the disk."""
        d2 = dot(toward, toward)
        radius = np.full(len(d2), elementary.tan(self.light.angle / 2), np.float32)
        return point_on_facing_disk(toward, d2, radius, square)

    def lobe_share(self, lobe: Lobe, toward: Float64, d2: Float64) -> tuple[Float64, Array]:
        """Over its solid angle weighted by the cosine, as its colour is an irradiance."""
        radius = np.full(len(d2), self.lobe_radius)
        seen = lobe_over_facing_disk(lobe, toward, np.sqrt(d2), radius)
        return seen / (np.pi * radius**2 / (1 + radius**2)), radius

    def as_numbers(self) -> dict[str, Any] | None:
        """The disk's radius, as points of it and as highlights have it."""
        radius = self.half_size(np.zeros((3, 0)))
        return {"kind": "sun", "radius": np.float32(radius), "half_size": radius, "lobe_radius": self.lobe_radius}

    @property
    def lobe_radius(self) -> float:
        """Of the disk as highlights show it: a radius too small to tell counts as LEAST_LAMP."""
        radius: float = max(float(elementary.tan(min(self.light.angle, np.pi) / 2)), LEAST_LAMP)
        return radius

    def met_by(self, origin: Float32, direction: Float64) -> tuple[Bools, Float64]:
        """A disk in the sky, infinitely far."""
        axis = self.position.astype(np.float64)
        along = dot(axis, direction)
        off = direction - axis * along
        radius = elementary.tan(min(self.light.angle, np.pi) / 2)
        return (along > 0) & (dot(off, off) <= (radius * along) ** 2), np.full(along.shape, np.inf)

    def emit_photons(self, center: Float64, radius: float, aim: UnitSquare, spread: UnitSquare) -> Photons:
        """From the ball's own shadow disk, just before it; none to a plane."""
        n = len(aim[0])
        sun = np.broadcast_to(self.position.astype(np.float64), (3, n))
        if not self.is_delta:
            sun = normalize(sun + self.offset(sun.astype(np.float32), spread))
        tangent, bitangent = orthonormal_basis(sun)
        x, y = disk(*aim)
        radius = radius if np.isfinite(radius) else 0.0
        origin = center[:, None] + radius * (sun + tangent * x + bitangent * y)
        power = np.broadcast_to(self.color.astype(np.float64) * (np.pi * radius * radius), (3, n))
        return Photons(origin, -sun, power * self.light.diffuse)
