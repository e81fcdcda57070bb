# SPDX-License-Identifier: GPL-3.0-or-later
"""Area lights: parallelograms, and the ellipses in them, that shine to one side."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...scene import AreaLight, Float32, Float64
from ..core.constants import FAR_AREA_RATIO
from ..core.sampler import disk
from ..core.vectors import Array, count, dot, orthonormal_basis, select, take
from .form_factors import ellipse_form_factor, form_factor_above, form_factor_float32
from .light import Bools, Illumination, Lobe, UnitSquare, register
from .located import LocatedLight, range_window


@register(AreaLight)
@dataclass(frozen=True, eq=False)
class CompiledAreaLight(LocatedLight):
    """An area light."""

    light: AreaLight

    is_delta = False
    color_over_radiance = 1.0

    @property
    def has_area(self) -> bool:
        """Its half axes lie along different lines."""
        return bool(np.cross(self.light.axis_u, self.light.axis_v).any())

    @property
    def axis(self) -> Float64:
        """The way it shines."""
        axis = np.asarray(self.light.direction, np.float64)
        return np.asarray(axis / np.sqrt((axis * axis).sum()))

    @property
    def is_round(self) -> bool:
        """It is an ellipse."""
        return self.light.shape == "ELLIPSE"

    @cached_property
    def area(self) -> float:
        """m^2."""
        normal = np.cross(np.array(self.light.axis_u, np.float64), np.array(self.light.axis_v, np.float64))
        return (np.pi if self.is_round else 4) * float(np.sqrt((normal**2).sum()))

    @property
    def fog_radius(self) -> float:
        """Half a side."""
        u, v = (float(np.linalg.norm(axis)) for axis in (self.light.axis_u, self.light.axis_v))
        return float(np.sqrt(u * v))

    @property
    def fog_share(self) -> float:
        """Less of large ones: measured of EEVEE, squares of 0.01 to 4 m, to 1 %."""
        near = np.pi / 2 / (np.pi / 2 + np.sqrt(self.area))
        return float(near + (1 - near) / np.sqrt(np.pi))

    def half_size(self, toward: Float64) -> float:
        """From whichever side."""
        return float(np.linalg.norm(self.light.axis_u) + np.linalg.norm(self.light.axis_v))

    def validate(self) -> None:
        """Its axes must be finite."""
        super().validate()
        vectors = (*self.light.direction, *self.light.axis_u, *self.light.axis_v)
        self.require(bool(np.isfinite(vectors).all()), f"its place must be finite, got {vectors}")

    def illuminate(self, point: Float32, normal: Float32, least_distance: Float32) -> Illumination:
        """Its form factor for the diffuse part; for Phong's highlight a point at the centre of the same solid angle.

        That solid angle, A cos / (d^2 + A / 2 pi), is right from afar and never more than a half space.
        """
        u, v = (np.array(a, np.float64) for a in (self.light.axis_u, self.light.axis_v))
        wi, d2 = self.nearness(point, least_distance)
        shines = np.array(self.light.direction, np.float32)[:, None]
        front = np.maximum(-dot(shines, wi), np.float32(0))
        specular = np.float32(self.area) * front / (d2 + np.float32(self.area / (2 * np.pi)))
        cosine = np.maximum(dot(wi, normal), np.float32(0))
        diffuse = np.float32(self.area) * front * cosine / d2
        reach2 = FAR_AREA_RATIO**2 * float((u * u).sum() + (v * v).sum())
        near = select((d2 < reach2) & (front > 0))
        if count(near, len(d2)):
            toward, facing = self.position - take(point, near), take(normal, near)
            diffuse[near] = np.float32(np.pi) * self._form_factor(toward, u, v, facing)
        if np.isfinite(self.light.range):
            window = range_window(d2, self.light.range)
            specular *= window
            diffuse *= window
        return Illumination(wi, cosine, diffuse, specular, d2)

    def _form_factor(self, toward: Float32, u: Float64, v: Float64, normal: Float32) -> Array:
        """(n,) of half edges or half axes u, v (3,), seen from points `toward` (3, n) before them."""
        if not self.is_round:
            corners = [(su * u + sv * v).astype(np.float32)[:, None] for su, sv in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            a, b, c, d = (toward + corner for corner in corners)
            return form_factor_float32(a, b, c, d, normal)
        frame = (*orthonormal_basis(normal), normal)
        center, *axes = (
            np.stack([dot(axis, a.astype(axis.dtype)) for axis in frame]).astype(np.float64)
            for a in (toward, u[:, None], v[:, None])
        )
        return ellipse_form_factor(center, axes[0], axes[1])

    def offset(self, toward: Float32, square: UnitSquare) -> Float32:
        """On its shape, which does not turn."""
        x, y = disk(*square) if self.is_round else (2 * square[0] - 1, 2 * square[1] - 1)
        axes = zip(self.light.axis_u, self.light.axis_v, strict=True)
        return np.stack([np.float32(u) * x + np.float32(v) * y for u, v in axes])

    def lobe_share(self, lobe: Lobe, toward: Float64, d2: Float64) -> tuple[Float64, Array]:
        """Of lobes before it."""
        u, v = (np.array(a, np.float64)[:, None] for a in (self.light.axis_u, self.light.axis_v))
        radius = np.sqrt(dot(u, u) + dot(v, v))
        behind = dot(np.array(self.light.direction, np.float64), toward) >= 0
        center = lobe.untransformed(toward)
        u, v = (lobe.untransformed(np.broadcast_to(a, toward.shape)) for a in (u, v))
        if self.is_round:
            return ellipse_form_factor(center, u, v) * ~behind, radius
        return form_factor_above(center, u, v) * ~behind, radius

    def as_numbers(self) -> dict[str, Any] | None:
        """Its shape."""
        light = self.light
        u, v = (np.array(a, np.float64) for a in (light.axis_u, light.axis_v))
        with np.errstate(all="ignore"):
            over_u, over_v = u / (u @ u), v / (v @ v)
        return {
            "kind": "disk" if self.is_round else "area", "axis": light.direction, "u": u, "v": v, "over_u": over_u,
            "over_v": over_v, "area": self.area, "far2": FAR_AREA_RATIO**2 * float((u * u).sum() + (v * v).sum()),
            "half_size": self.half_size(np.zeros((3, 0))), "lobe_radius": np.sqrt(dot(u, u) + dot(v, v)),
        }  # fmt: skip

    def met_by(self, origin: Float32, direction: Float64) -> tuple[Bools, Float64]:
        """Rays against the way it shines."""
        shines = np.array(self.light.direction, np.float64)
        toward = self.position.astype(np.float64) - origin
        against = -dot(shines, direction)
        t = -dot(shines, toward) / against
        place = direction * t - toward
        u, v = np.array(self.light.axis_u, np.float64), np.array(self.light.axis_v, np.float64)
        x, y = dot(u / (u @ u), place), dot(v / (v @ v), place)
        inside = x * x + y * y <= 1 if self.is_round else (np.abs(x) <= 1) & (np.abs(y) <= 1)
        return (against > 0) & (t > 0) & inside, t

    def emission_toward(self, direction: Float64) -> Array:
        """Its projected area."""
        return self.area * np.maximum(dot(np.asarray(self.light.direction, np.float64), direction), 0)
