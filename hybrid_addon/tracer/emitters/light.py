# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light is: the interface that every kind of light fulfils, and the table of all kinds.

A kind of light is one file `emitters/*_light.py` with a subclass of `CompiledLight` (or of `LocatedLight`, which has a
place and a range) that is registered for its dataclass of `scene`. Nothing else in the tracer asks what kind a light
is. Formulas are EEVEE's (eevee_light_lib.glsl).

Shapes: n points or rays are (3, n); positions are relative to the scene's centre unless said otherwise.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated
from ...scene import Float32, Float64, Light
from ..core.constants import LTC_FADE
from ..core.vectors import Array, dot, flatnonzero, normalize, take

Bools = NDArray[np.bool_]
Bounds = tuple[Float64, Float64]
"""Lowest and highest corner (3,), (3,) of a box."""
UnitSquare = tuple[Float32, Float32]
"""n points of the unit square: two (n,), each in 0 .. 1."""


class Lobe(Protocol):
    """A lobe of n hits as a transformed cosine (`shading.ltc`)."""

    def untransformed(self, a: Float64) -> Float64:
        """Vectors (3, n) as they lie where the lobe is a cosine around +Z."""

    def reaches(self, toward: Float64, size: Array | float) -> Bools:
        """(n,) whether anything within `size`, (n,) or a number, of points toward (3, n) may lie above its horizon: yes
        where the size is not known (NaN)."""

    def take(self, index: NDArray[np.intp]) -> Lobe:
        """Those of the hits `index`."""


@dataclass(eq=False)
class Illumination:
    """Unshadowed light on n points; the colour of the light is left out.

    wi         : (3, n) float32 unit directions to the light.
    cosine     : (n,) float32, of the angle between wi and the shading normal, 0 behind.
    diffuse    : (n,) float32, irradiance on the shading normal (cosine included), >= 0.
    specular   : (n,) float32, irradiance on a plane facing the light, for Phong's highlight, >= 0.
    d2         : (n,) float32, squared distances; None: it is infinitely far.
    """

    wi: Array
    cosine: Array
    diffuse: Array
    specular: Array
    d2: Array | None = None


@dataclass(frozen=True, eq=False)
class Photons:
    """n photons as they leave a light.

    origin, direction : (3, n) float64, the directions of length 1.
    power             : (3, n) float64 W, of each if it were the only one.
    """

    origin: Float64
    direction: Float64
    power: Float64


@dataclass(frozen=True, eq=False)
class CompiledLight(ABC):
    """A light of the scene as the tracer asks it. Methods that are abstract are what a new kind has to answer.

    light  : the scene's own dataclass; a subclass names its type.
    center : (3,) float64, the scene's centre in the world.
    key    : what it adds to the path signature of a point that it reaches, and its dimension of the sampler.
    receives, blocks : (np,) bool, the primitives that it lights and those that cast shadows in its light; None: all.
    """

    light: Light
    center: Float64 = field(default_factory=lambda: np.zeros(3))
    key: np.uint32 = np.uint32(0)  # noqa: RUF009 (numbers of numpy are immutable)
    receives: Bools | None = None
    blocks: Bools | None = None

    is_infinite: ClassVar[bool] = False
    """It is infinitely far: all its light comes from one direction, spread by its size; `position` is a direction."""

    # -------------------------------------------------------------------------------------------- what it is

    @abstractmethod
    def place(self) -> Float64:
        """(3,) float64 its middle, relative to the scene's centre; of an infinite light the unit direction to it."""

    @property
    @abstractmethod
    def is_delta(self) -> bool:
        """All its light comes from a single point or direction: it has hard shadows, and `offset` is not asked."""

    @property
    def has_area(self) -> bool:
        """Rays can meet it: its shape is more than a point or a line."""
        return not self.is_delta

    @property
    @abstractmethod
    def color_over_radiance(self) -> float:
        """By what its colour is more than its radiance, as rays that meet it see it: 1 if its colour is a radiance, m^2
        if it is an intensity, sr if an irradiance."""

    @abstractmethod
    def half_size(self, toward: Float64) -> Float64 | float:
        """How far from its middle points of its shape lie at most, (n,), where that is seen along toward (3, n)
        float64; of an infinite light at distance 1."""

    def validate(self) -> None:
        """Raise ValueError, with one line that names the light, for values that it has no answer to.

        It is asked first, before anything is worked out; subclasses check their own fields, too.
        """
        color = getattr(self.light, self.light.color_field)
        self.require(all(map(math.isfinite, color)), f"its colour must be finite, got {color}")
        self.require_finite("diffuse", "specular", "transmission", "volume")

    # -------------------------------------------------------------------------------------------- what it lights

    @abstractmethod
    def illuminate(self, point: Float32, normal: Float32, least_distance: Float32) -> Illumination:
        """Its light on points (3, n) with shading normals (3, n) if nothing is in between.

        least_distance : (n,) float32, the points' own uncertainty: a light that is nearer counts as this far.
        """

    @abstractmethod
    def offset(self, toward: Float32, square: UnitSquare) -> Float32:
        """From its middle, seen along toward (3, n), to points of its shape that the square chooses evenly: (3, n)."""

    @abstractmethod
    def lobe_share(self, lobe: Lobe, toward: Float64, d2: Float64) -> tuple[Float64, Array]:
        """What lobes of albedo 1 reflect of it (n,), with colour 1 and without range and cone; and its radius (n,) or
        (1,), as it sinks below horizons.

        toward : (3, n) float64 to its middle, d2 (n,) float64 its squared length, at least the points' uncertainty.
        """

    def fade(self, value: Array, point: Float32, d2: Array | None = None) -> Array:
        """Values (n,) times what its range and its cone leave at points (3, n); d2 (n,): their squared distances from
        it, where they are known."""
        return value

    def into_fog(self, point: Float32) -> Array:
        """What fog scatters of it at points (3, n): its irradiance (n,) on planes that face it, with colour 1."""
        facing = normalize(self.toward(point))
        return self.illuminate(point, facing, np.zeros(point.shape[1], np.float32)).specular

    # -------------------------------------------------------------------------------------------- what meets it

    @abstractmethod
    def met_by(self, origin: Float32, direction: Float64) -> tuple[Bools, Float64]:
        """Whether rays (3, n) meet its shape, (n,) bool, and how far along them it is then, (n,) float64.

        Numbers that are none may come out where a ray does not meet it: floating point errors are not reported.
        """

    # -------------------------------------------------------------------------------------------- for compiled loops

    def as_numbers(self) -> dict[str, Any] | None:
        """What compiled loops are to know of this very kind of light (`records.LAMP`): its `kind` there, and besides
        what all lights have a number or several by name. None: they know no such light.

        half_size, lobe_radius : of `half_size` and `lobe_share`, where these are the same from everywhere.
        """
        return None

    # -------------------------------------------------------------------------------------------- what it cannot do

    def can_reach(self, bounds: Bounds) -> bool:
        """Whether it can bring anything to points within finite bounds; in doubt it can.

        Exact: where this says no, `illuminate` gives exactly 0 at every such point, rounded as it may be.
        """
        return True

    # -------------------------------------------------------------------------------------------- photons

    @abstractmethod
    def emit_photons(self, center: Float64, radius: float, aim: UnitSquare, spread: UnitSquare) -> Photons:
        """n photons, evenly over the cones in which it sees a ball: center (3,), radius; an infinite radius is a plane,
        to all directions.

        Each stands for all light of it that goes to the ball, without `photon_fading`. aim chooses the direction,
        spread the point of its shape.
        """

    def photon_fading(self, distance: Float64) -> Array:
        """What is left of a photon's power (n,) after `distance` (n,) float64."""
        return np.ones_like(distance)

    # -------------------------------------------------------------------------------------------- what all share

    @cached_property
    def color(self) -> Float32:
        """(3, 1) float32, its intensity, irradiance or radiance."""
        return np.array(getattr(self.light, self.light.color_field), np.float32)[:, None]

    @cached_property
    def position(self) -> Float32:
        """`place` as (3, 1) float32."""
        return np.asarray(self.place(), np.float32)[:, None]

    @property
    def is_black(self) -> bool:
        """Cannot light anything."""
        light = self.light
        return not self.color.any() or light.diffuse == light.specular == light.transmission == 0

    @property
    def is_unseen(self) -> bool:
        """No ray can meet it, or sees anything of it."""
        return not (self.has_area and self.color.any()) or (self.light.specular == 0 and self.light.transmission == 0)

    @property
    def is_soft(self) -> bool:
        """Casts soft shadows."""
        return self.light.cast_shadow and not self.is_delta

    def toward(self, point: Array) -> Array:
        """To its middle from points (3, n), in their dtype; to an infinite light unit directions."""
        place = self.position.astype(point.dtype, copy=False)
        return np.broadcast_to(place, point.shape) if self.is_infinite else place - point

    def radiance(self) -> Float64:
        """(3, 1) float64 of its shape, as rays that meet it see it; 0 where that is beyond float32."""
        with np.errstate(all="ignore"):
            color = self.color.astype(np.float64) / self.color_over_radiance
        return np.where(np.abs(color) < np.finfo(np.float32).max, color, 0.0)

    def shadow_rays(self, origin: Float32, normal: Float32, square: UnitSquare | None) -> tuple[Float32, Float32]:
        """Unit directions (3, n) from origins (3, n) to the light and distances (n,).

        square : points (n,) of the unit square, which choose points on the light, all of its shape alike; those that
                 lie below the horizon of the normals (3, n) change sides, as `illuminate` has no light from there.
                 None: hard shadows, towards the middle.
        """
        wi = self.toward(origin)
        endless = np.full(origin.shape[1], np.inf, np.float32)
        if square is not None:
            offset = self.offset(wi, square)
            wi = wi + offset * np.copysign(np.float32(1), dot(wi + offset, normal))
        elif self.is_infinite:
            return wi, endless
        distance: Float32 = np.sqrt(dot(wi, wi))
        wi *= 1 / distance
        return wi, endless if self.is_infinite else distance

    def highlight(self, point: Float32, n_geometric: Float32, lobe: Lobe, least_distance: Float32) -> Float32:
        """What lobes of albedo 1 reflect of a light of colour 1: (n,) float32, >= 0; without its weight for highlights.

        point, n_geometric : (3, n), the normals on the side of the eye.
        least_distance     : (n,), the points' own uncertainty: a light that is nearer counts as this far.
        """
        toward = self.toward(point.astype(np.float64))
        d2 = dot(toward, toward)
        if not self.is_infinite:
            d2 = np.maximum(d2, least_distance.astype(np.float64) ** 2)
        # Half of the lobes look elsewhere.
        with np.errstate(invalid="ignore"):  # a point in the middle of a ball
            some = flatnonzero(lobe.reaches(toward, self.half_size(toward)))
        if len(some) < len(d2):
            lobe, toward, d2 = lobe.take(some), take(toward, some), take(d2, some)
            point, n_geometric = take(point, some), take(n_geometric, some)
        seen, radius = self.lobe_share(lobe, toward, d2)
        seen = seen * above_horizon(toward, d2, np.broadcast_to(radius, d2.shape), n_geometric)
        result = np.zeros(len(least_distance), np.float32)
        result[some] = self.fade(seen, point, d2)
        return result

    def require(self, condition: bool, message: str) -> None:
        """Raise ValueError, with the light's name before the message, unless the condition holds."""
        if not condition:
            raise ValueError(f"light {self.light.name!r}: {message}")

    def require_finite(self, *names: str) -> None:
        """Raise ValueError unless these fields of the light, numbers, are finite."""
        for name in names:
            value = getattr(self.light, name)
            self.require(math.isfinite(value), f"{name} must be finite, got {value}")

    def require_not_negative(self, *names: str) -> None:
        """Raise ValueError unless these fields of the light are 0 or more; they may be infinite."""
        for name in names:
            value = getattr(self.light, name)
            self.require(value >= 0, f"{name} must not be negative, got {value}")


@accelerated
def above_horizon(toward: Float64, d2: Float64, radius: Array, n: Float32) -> Float64:
    """EEVEE's fading (n,) of lights that are below the horizon of a surface, where lobes leak: 1 until their upper end
    is there, 0 from LTC_FADE further (light_attenuation_facing in eevee_light_lib)."""
    d = np.sqrt(d2)
    return np.clip((radius / d + dot(n, toward) / d) / LTC_FADE + 1, 0, 1)


# ------------------------------------------------------------------------------------------------ all kinds

KINDS: dict[type, type[CompiledLight]] = {}
"""Dataclass of the scene -> the light that answers for it."""

K = TypeVar("K", bound=type[CompiledLight])


def register(scene_light: type) -> Callable[[K], K]:
    """Decorates the `CompiledLight` that answers for a dataclass of the scene."""

    def enter(kind: K) -> K:
        KINDS[scene_light] = kind
        return kind

    return enter
