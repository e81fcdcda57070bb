# SPDX-License-Identifier: GPL-3.0-or-later
"""Point lights: with a radius a ball, or with soft falloff a disk that faces the receiver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...scene import Float32, Float64, PointLight
from ..core.constants import LEAST_LAMP, NEAR_BALL
from ..core.vectors import Array, dot
from .facing_disk import lobe_over_facing_disk, point_on_facing_disk
from .light import Bools, Illumination, Lobe, UnitSquare, register
from .located import LocatedLight


@register(PointLight)
@dataclass(frozen=True, eq=False)
class CompiledPointLight(LocatedLight):
    """A point light; `SpotLight` adds a cone to it."""

    light: PointLight

    @property
    def turning_radius(self) -> float:
        """It faces what it lights."""
        return self.light.radius

    @property
    def fog_radius(self) -> float:
        """Its radius."""
        return self.light.radius

    @property
    def is_delta(self) -> bool:
        """Without a radius."""
        return self.light.radius == 0

    @property
    def color_over_radiance(self) -> float:
        """Its colour is an intensity: m^2 of the disk."""
        return np.pi * self.light.radius**2

    def half_size(self, toward: Float64) -> Float64 | float:
        """Of a ball the disk's that fills the same cone."""
        radius = self.light.radius
        if self.light.soft_falloff or radius == 0:
            return radius
        return disk_of_ball(radius, dot(toward, toward))

    def validate(self) -> None:
        """Its radius must be finite and not negative."""
        super().validate()
        self.require_finite("radius")
        self.require_not_negative("radius")

    def illuminate(self, point: Float32, normal: Float32, least_distance: Float32) -> Illumination:
        """Inverse square law; soft falloff multiplies by d^2 / (d^2 + r^2) (a disk that faces the point).

        Without soft falloff the light is a ball: inside it d counts as r.
        """
        wi, d2 = self.nearness(point, least_distance)
        r2 = np.float32(self.light.radius * self.light.radius)
        received = self.fade(1 / (d2 + r2) if self.light.soft_falloff else 1 / np.maximum(d2, r2), point, d2)
        cosine = np.maximum(dot(wi, normal), np.float32(0))
        received = received * (cosine > 0)
        return Illumination(wi, cosine, received * cosine, received, d2)

    def offset(self, toward: Float32, square: UnitSquare) -> Float32:
        """On a disk that faces the receiver; of a ball the larger one that fills the same cone."""
        d2, radius = dot(toward, toward), self.light.radius
        radii = np.full(len(d2), radius, np.float32) if self.light.soft_falloff else disk_of_ball(radius, d2)
        return point_on_facing_disk(toward, d2, radii, square)

    def lobe_share(self, lobe: Lobe, toward: Float64, d2: Float64) -> tuple[Float64, Array]:
        """Over pi radius^2, as its colour is an intensity. A radius too small to tell counts as LEAST_LAMP of its
        distance."""
        distance = np.sqrt(d2)
        own = np.maximum(self.light.radius, LEAST_LAMP * distance)
        if self.light.soft_falloff:
            return lobe_over_facing_disk(lobe, toward, distance, own) / (np.pi * own**2), own
        radius = np.where(own < distance, disk_of_ball(1.0, d2 / own**2) * own, own)
        seen = lobe_over_facing_disk(lobe, toward, distance, radius)
        seen = np.where(own < distance, seen, 1.0)  # within a ball all is light
        return seen / (np.pi * own**2), radius

    def as_numbers(self) -> dict[str, Any] | None:
        """Its radius."""
        return {"kind": "point", "radius": self.light.radius}

    def met_by(self, origin: Float32, direction: Float64) -> tuple[Bools, Float64]:
        """A disk that faces the origin of each ray, or a ball: from within it all is light."""
        toward, r2 = self.position.astype(np.float64) - origin, self.light.radius**2
        along = dot(toward, direction)
        if self.light.soft_falloff:
            t = dot(toward, toward) / along
            place = direction * t - toward
            return (along > 0) & (dot(place, place) <= r2), t
        nearest = toward - direction * along
        half = r2 - dot(nearest, nearest)
        inside = dot(toward, toward) < r2
        t = along - np.sqrt(half)
        return inside | ((half >= 0) & (t > 0)), np.where(inside, 0.0, t)

    def photon_fading(self, distance: Float64) -> Array:
        """Its range, and its soft falloff."""
        left = super().photon_fading(distance)
        if not self.light.soft_falloff:
            return left
        d2 = distance * distance
        return np.asarray(left * d2 / (d2 + self.light.radius**2))


def disk_of_ball(radius: float, d2: Array) -> Array:
    """Radius (n,) of the disk at the centre of a ball that fills the ball's cone, at squared distances (n,) from it."""
    r2 = d2.dtype.type(radius**2)
    return np.asarray(np.sqrt(r2 * d2 / np.maximum(d2 - r2, d2.dtype.type(NEAR_BALL) * d2)))
