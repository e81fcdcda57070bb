# SPDX-License-Identifier: GPL-3.0-or-later
"""Spot lights: point lights within a cone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...scene import Float32, Float64, SpotLight
from ..core.constants import SPOT_BLEND_FLOOR
from ..core.vectors import Array, matrix_times
from .light import register
from .point_light import CompiledPointLight


@register(SpotLight)
@dataclass(frozen=True, eq=False)
class CompiledSpotLight(CompiledPointLight):
    """What its cone leaves of a point light."""

    light: SpotLight

    @property
    def axis(self) -> Float64:
        """Of its cone, which is no wider than a half space."""
        axis = -np.asarray(self.light.world_to_light, np.float64)[2]
        return np.asarray(axis / np.sqrt((axis * axis).sum()))

    def validate(self) -> None:
        """Its cone must be finite."""
        super().validate()
        self.require_finite("cos_cone", "blend")
        self.require(bool(np.isfinite(self.light.world_to_light).all()), "world_to_light must be finite")

    def fade(self, value: Array, point: Float32, d2: Array | None = None) -> Array:
        """Its range and its cone."""
        return super().fade(value, point, d2) * spot_factor(self.light, point - self.position)

    def as_numbers(self) -> dict[str, Any] | None:
        """Its radius and its cone."""
        light = self.light
        rows = np.asarray(light.world_to_light, np.float64)[:3, :3].reshape(-1)
        cone = {"rows": rows, "cos_cone": light.cos_cone, "rim": _rim(light)}
        return {"kind": "spot", "radius": light.radius, **cone}

    def emission_toward(self, direction: Float64) -> Array:
        """Its cone."""
        return spot_factor(self.light, direction.astype(np.float32))


def spot_factor(light: SpotLight, offset: Float32) -> Float32:
    """The spot's smoothstep (n,) for points at `offset` (3, n) from it: EEVEE and Cycles agree on it."""
    local = matrix_times(np.asarray(light.world_to_light), offset)
    z = -local[2]
    ahead = z > 0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        cosine = 1 / np.sqrt(1 + (local[0] * local[0] + local[1] * local[1]) / (z * z))
    x = np.clip((cosine - np.float32(light.cos_cone)) / np.float32(_rim(light)), 0, 1)
    return np.where(ahead, x * x * (3 - 2 * x), np.float32(0)).astype(np.float32)


def _rim(light: SpotLight) -> float:
    """How far within the cone's edge, by the cosine, it shines with all its light."""
    return max(SPOT_BLEND_FLOOR, (1 - light.cos_cone) * light.blend)
