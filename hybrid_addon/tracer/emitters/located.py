# SPDX-License-Identifier: GPL-3.0-or-later
"""What lights share that are somewhere: EEVEE's range, the culling by it, and photons from their shape to a ball."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...scene import Float32, Float64, PlacedLight
from ..core.constants import REACH_MARGIN
from ..core.sampler import disk
from ..core.vectors import Array, dot, orthonormal_basis
from .light import Bounds, CompiledLight, Photons, UnitSquare

FAR = 1024.0
"""Seen from so many of its radii away, a ball is a disk to 5e-7."""

LEAST_SQUARE = 1.0e-30
"""m^2: nearer than 1e-15 m to a point fog is as bright as there. The coordinates have no finer places around 1 m."""

UP = np.array([[0.0], [0.0], [1.0]])


@dataclass(frozen=True, eq=False)
class LocatedLight(CompiledLight):
    """A light whose dataclass has a `position` and a `range`. What it leaves to a kind of light is in `CompiledLight`,
    and three questions more, each with an answer that suits a light that shines the same to all sides."""

    light: PlacedLight

    @property
    def turning_radius(self) -> float:
        """Of the disk that turns to whatever it lights; 0 if its shape does not turn."""
        return 0.0

    @property
    def axis(self) -> Float64 | None:
        """Unit direction (3,) of the half space that it shines into; None: all directions."""
        return None

    def emission_toward(self, direction: Float64) -> Array | float:
        """By what its intensity in unit directions (3, n) is more than its colour: (n,)."""
        return 1.0

    def place(self) -> Float64:
        """Its position."""
        return np.array(self.light.position, np.float64) - self.center

    def validate(self) -> None:
        """Its range must not be negative; it may be infinite."""
        super().validate()
        place = self.light.position
        self.require(bool(np.isfinite(place).all()), f"its place must be finite, got {place}")
        self.require_not_negative("range")

    def nearness(self, point: Float32, least_distance: Float32) -> tuple[Float32, Float32]:
        """Unit directions (3, n) to the light from points (3, n) and squared distances (n,), none of them 0."""
        wi = self.position - point
        d2 = np.maximum(dot(wi, wi), least_distance * least_distance)
        wi *= 1 / np.sqrt(d2)
        return wi, d2

    def fade(self, value: Array, point: Float32, d2: Array | None = None) -> Array:
        """Its range."""
        if not np.isfinite(self.light.range):
            return value
        if d2 is None:
            away = point - self.position
            d2 = dot(away, away)
        return value * range_window(d2, self.light.range)

    @property
    def fog_radius(self) -> float:
        """Its size, metres, as fog sees it: within it its light hardly grows."""
        return 0.0

    @property
    def fog_share(self) -> float:
        """What fog gets of its light, as EEVEE has it."""
        return 1.0

    def into_fog(self, point: Float32) -> Array:
        """A point's that has a size: 2 / (d^2 + r^2 + d sqrt(d^2 + r^2)) instead of 1 / d^2 (Yuksel 2020, as in EEVEE's
        volume_light)."""
        away = point.astype(np.float64) - self.position
        d2, r2 = dot(away, away), self.fog_radius**2
        distance, hull = np.sqrt(d2), np.sqrt(d2 + r2)
        power = 2 / np.maximum(d2 + r2 + distance * hull, LEAST_SQUARE)
        shown = self.emission_toward(away / np.maximum(distance, math.sqrt(LEAST_SQUARE)))
        return self.fade(power * shown * self.fog_share, point, d2.astype(np.float32))

    def can_reach(self, bounds: Bounds) -> bool:
        """Not what is out of its range, or behind it."""
        low, high = bounds
        place = self.position[:, 0].astype(np.float64)
        margin = REACH_MARGIN * float(np.max(np.abs([place, low, high])))
        gap = np.maximum(np.maximum(low - place, place - high), 0.0)
        if float(np.sqrt((gap * gap).sum())) > self.light.range * (1 + REACH_MARGIN) + margin:
            return False
        ahead = self.axis
        if ahead is None:
            return True
        furthest = np.where(ahead > 0, high, low) - place  # of all corners, in the direction in which it shines
        return float(ahead @ furthest) > -margin

    def emit_photons(self, center: Float64, radius: float, aim: UnitSquare, spread: UnitSquare) -> Photons:
        """From all of its shape, turned towards the ball as towards a receiver."""
        position = self.position.astype(np.float64)
        if np.isfinite(radius):
            middle = center[:, None]
        else:  # a plane lies all around: up, and far enough that a ball looks like a disk
            middle = position + UP * (FAR * self.turning_radius or 1.0)
        axis = np.broadcast_to(middle - position, (3, len(aim[0])))
        origin = position if self.is_delta else position + self.offset(axis.astype(np.float32), spread)
        origin = np.broadcast_to(origin, axis.shape)
        direction, solid_angle = cone_over_ball(middle - origin, radius, aim)
        power = self.color * solid_angle * self.emission_toward(direction)
        return Photons(origin, direction, power * self.light.diffuse)

    def photon_fading(self, distance: Float64) -> Array:
        """Its range."""
        d2 = distance * distance
        return range_window(d2, self.light.range) if np.isfinite(self.light.range) else np.ones_like(d2)


def range_window(d2: Array, reach: float) -> Array:
    """EEVEE's finite range: (1 - (d^2 / R^2)^2)^2 for d < R, else 0."""
    x = d2 * np.float32(1 / (reach * reach))
    w = np.maximum(1 - x * x, np.float32(0))
    return np.asarray(w * w)


def cone_over_ball(axis: Float64, radius: float, aim: UnitSquare) -> tuple[Float64, Float64]:
    """Unit directions (3, n) even over the cones that a ball fills, axis (3, n) away, and their solid angles (n,).

    The whole sphere from within the ball. Written with 1 - cos: cones may be narrow.
    """
    d2 = dot(axis, axis)
    sine2 = np.minimum(radius * radius / np.maximum(d2, 1e-300), 1.0)
    height = np.where(sine2 < 1, sine2 / (1 + np.sqrt(1 - sine2)), 2.0)
    x, y = disk(*aim)
    down = (x * x + y * y) * height
    forward = np.where(d2 > 0, axis / np.sqrt(np.where(d2 > 0, d2, 1.0)), UP)
    tangent, bitangent = orthonormal_basis(forward)
    sideways = np.sqrt(height * (2 - down))
    return forward * (1 - down) + (tangent * x + bitangent * y) * sideways, 2 * np.pi * height
