# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights, the world, and what becomes of their light where it arrives. Conventions: see the package."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import ClassVar, Literal

import numpy as np

from .numbers import BLACK, RGB, Float64
from .surfaces import Texture
from .values import Color


@dataclass(frozen=True, eq=False)
class Light:
    """What all lights have. `color_field` names the field of a kind that says how strong it is.

    diffuse, specular, transmission, volume : weights of this light where it is scattered, mirrored, seen through glass,
                          and scattered by fog.
    receivers, blockers : the objects that it lights, and those that cast shadows in its light, by numbers that count
                          the scene's instances, then its spheres, then its planes; None: all.
    """

    color_field: ClassVar[str]

    name: str
    _: KW_ONLY
    cast_shadow: bool = True
    diffuse: float = 1.0
    specular: float = 1.0
    transmission: float = 1.0
    volume: float = 1.0
    receivers: frozenset[int] | None = None
    blockers: frozenset[int] | None = None


@dataclass(frozen=True, eq=False)
class PlacedLight(Light):
    """A light that is somewhere.

    position : its middle, in the world.
    range    : metres; EEVEE's window (1 - (d^2/range^2)^2)^2 fades the light, which ends there. inf = physical.
    """

    position: tuple[float, float, float]
    _: KW_ONLY
    range: float = float("inf")


@dataclass(frozen=True, eq=False)
class PointLight(PlacedLight):
    """Radiates `intensity` (W/sr, RGB) in all directions.

    radius       : metres, of the emitting ball; 0 = a point, with hard shadows.
    soft_falloff : a disk that faces the receiver, not a ball: EEVEE's factor d^2 / (d^2 + radius^2).
    """

    color_field: ClassVar[str] = "intensity"

    intensity: RGB
    radius: float = 0.0
    soft_falloff: bool = True


@dataclass(frozen=True, eq=False)
class SpotLight(PointLight):
    """A point light within a cone.

    world_to_light : (3, 3) float64; takes (P - position) to light space, scale included; the cone opens along -Z.
    cos_cone       : cosine of half the cone's angle.
    blend          : 0 (hard rim) .. 1; EEVEE's smoothstep over (1 - cos_cone) blend.
    """

    world_to_light: Float64 = field(default_factory=lambda: np.eye(3))
    cos_cone: float = 0.7071067811865476
    blend: float = 0.15


@dataclass(frozen=True, eq=False)
class SunLight(Light):
    """Parallel light: `irradiance` (W/m^2, RGB) on a plane facing it; `direction` (unit) points *to* the sun.

    angle : radians, the diameter of its disk in the sky; 0 = hard shadows.
    """

    color_field: ClassVar[str] = "irradiance"

    direction: tuple[float, float, float]
    irradiance: RGB
    angle: float = 0.0


@dataclass(frozen=True, eq=False)
class AreaLight(PlacedLight):
    """A one-sided flat emitter of uniform `radiance` (RGB).

    axis_u, axis_v : half edges (RECTANGLE) or half axes (ELLIPSE), in metres.
    direction      : unit, the way it shines (its local -Z).
    """

    color_field: ClassVar[str] = "radiance"

    direction: tuple[float, float, float]
    axis_u: tuple[float, float, float]
    axis_v: tuple[float, float, float]
    radiance: RGB
    shape: Literal["RECTANGLE", "ELLIPSE"] = "RECTANGLE"


@dataclass(frozen=True, eq=False)
class WorldSun:
    """What of the world is brighter than `threshold` (its largest channel) lights as one sun does, as in EEVEE.

    angle    : radians, the diameter that this sun is given, for soft shadows and highlights.
    strength : what its light is multiplied by.
    """

    threshold: float
    angle: float = 0.0
    cast_shadow: bool = True
    strength: float = 1.0


@dataclass(frozen=True, eq=False)
class World:
    """What a ray that leaves the scene sees: `radiance`, times the environment image if there is one.

    radiance    : or an `Expression` of the direction (attribute "generated"), without an environment image.
    environment : equirectangular, as Blender lays it out (centre +X, u = 0.25 is +Y, v up).
    rotation    : (3, 3) float64, world direction -> direction for the look-up.
    backdrop    : what camera rays see instead, and rays that passed straight through all; it gives no light.
    sun         : what is too bright becomes a light, and all but the backdrop is without it; None: nothing does.
    limit       : all but the backdrop is no brighter (largest channel), nor is its diffuse light. EEVEE's *Clamping*.
    dering      : how its diffuse light is kept from going below 0, as EEVEE of Blender 4.5 does, by the "AXES", or as
                  5's, by the "LENGTH".
    """

    radiance: Color = BLACK
    environment: Texture | None = None
    rotation: Float64 = field(default_factory=lambda: np.eye(3))
    backdrop: World | None = None
    sun: WorldSun | None = None
    limit: float = float("inf")
    dering: Literal["AXES", "LENGTH"] = "LENGTH"


@dataclass(frozen=True)
class Arriving:
    """What becomes of light where it arrives at a surface; what is no radiance is left alone: emission, the backdrop.

    indirect       : what comes from the world, and by reflected and refracted rays, is multiplied by this, each time.
    direct_limit   : what a surface sends on of all lights together is no brighter (largest channel), the hue kept; nor
                     is the image of one in a mirror.
    indirect_limit : nor is what one surface sends into a reflected or refracted ray (for the world: `World.limit`).

    EEVEE's *Light Strength > Indirect* and *Clamping > Surface Direct, Surface Indirect*.
    """

    indirect: float = 1.0
    direct_limit: float = float("inf")
    indirect_limit: float = float("inf")
