# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces, their closures, and the textures that vary over them. Conventions: see the package."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from .media import Medium
from .numbers import BLACK, RGB, WHITE, Float32, Float64
from .programs import SurfaceProgram
from .texels import Texels, texels_of
from .values import Color, Expression, Number

MIN_IOR = 1e-5
"""Blender's own least, of solids and of films."""


@dataclass(frozen=True, eq=False)
class Texture:
    """An image, placed: scene-linear, straight alpha, row 0 at the bottom.

    pixels       : `Texels` in the width that they are stored in, or (height, width, 4) float32.
    uv_transform : (2, 3) float64, applied to (u, v, 1) first (Blender's Mapping node).
    uv_map       : name of the mesh's UV map, "" for the one that is active for rendering.
    extension    : "SPHERE" goes around in u and ends in v, as an equirectangular image does.
    tiles        : of a tiled image (UDIM), (column, row) -> pixels of the unit square of texture coordinates that
                   begins there; `pixels` is what is seen everywhere else.
    """

    name: str
    pixels: Float32 | Texels
    extension: Literal["REPEAT", "EXTEND", "CLIP", "MIRROR", "SPHERE"] = "REPEAT"
    interpolation: Literal["LINEAR", "CLOSEST"] = "LINEAR"
    uv_map: str = ""
    uv_transform: Float64 = field(default_factory=lambda: np.eye(2, 3))
    tiles: Mapping[tuple[int, int], Float32 | Texels] = field(default_factory=dict)

    @property
    def parts(self) -> list[Texels]:
        """The texels of `pixels`, then of the tiles."""
        return [texels_of(part) for part in (self.pixels, *self.tiles.values())]


@dataclass(frozen=True, eq=False)
class Surface:
    """How a surface answers light (Whitted, energy conserving; docs/reference/surface-model.md).

    L = r Lr + (1 - r) [ o Llocal + (1 - o) (F Lr + (1 - F) Lt) ] + Le

    with r `reflectivity` (Lr tinted by `reflection_tint`), o `opacity`, F the exact unpolarised Fresnel reflectance for
    `ior`, Lt the refracted radiance tinted by `transmission_tint` at each crossing, and
    Llocal = ambient base_color E_world / pi + sum over lights (diffuse base_color / pi + Phong specular) E_light.

    Numbers and colours may be constants or an `Expression`. With `layered` the surface answers as EEVEE's
    Principled does, and r, o, F above are the shares of what lies under its layers (tracer/materials/principled.py):
    sheen, then coat, then the metal's or the dielectric's own reflection, whose Fresnel weight is taken from what is
    below it.

    base_color         : linear RGB albedo; of an image, Expression("image", (), Texture(...)).
    ambient, diffuse   : weights of the world's diffuse light and of the lights' diffuse light, 0..1.
    specular           : RGB reflectance at normal incidence of the Phong highlight (0 switches it off).
    roughness          : 0..1 as in Principled (alpha = roughness^2); it sets the Phong exponent.
    emission           : RGB radiance, added whatever the other weights are.
    ior                : refractive index inside, against vacuum, > 0. Closed bodies that transmit nest: where some
                         overlap the smallest displaces the others (an air bubble in water has IOR 1). An open
                         sheet bends light once, by ior, whatever it lies in.
    dispersion         : 20 / Abbe number, as in glTF: how much more blue is refracted than red; 0: all the same.
    interface_tint     : tint of F Lr. Black: nothing is reflected, and all of the light is transmitted (Refraction).
    normal             : shading normal by a normal map or bump, or None: the mesh's.
    edge_tint          : of a metal, at 82 degrees (F82), where `reflection_tint` holds at normal incidence; None: it
                         reflects the same at all angles.
    thin               : it transmits as a thin pane: straight on, both of its faces at once.
    film, film_ior     : thickness in nm and index of a thin film on what is below the coat: its interference colours
                         what the metal, the dielectric and the interface reflect. 0: there is none.
    metal_ior          : RGB, the index n of a metal below a film, from which and `reflection_tint` its k follows; None:
                         by the edge tint.
    stretch, tangent   : of rough reflections: GGX's alpha along the tangent is roughness^2 / stretch, across it
                         roughness^2 x stretch (a groove along the tangent has a stretch above 1). tangent: a vector of
                         any length, brought into the plane of the shading normal; None, or a stretch of 1: round.
    translucent        : its diffuse light is what falls on its other side; of closed bodies, what their other walls
                         let in.
    scatter, scatter_* : share 0..1 of its diffuse light that is scattered below the surface, and how far each channel
                         is, in metres (Blender's Radius x Scale).
    multiscatter       : light that one microfacet sends to the next is not lost.
    coat_shows         : the coat's own reflection is there, not only what it takes from what is below. (A coat with a
                         normal of its own is a closure of its own.)
    coat, coat_*       : weight 0..1, roughness, IOR of a clear coat, and the tint it gives to what is below.
    sheen, sheen_*     : weight, roughness and colour of the fuzz on top.
    absorption         : RGB, 1/m, >= 0: light that goes d metres through the solid keeps exp(-absorption d) of itself
                         (Beer-Lambert). Only closed bodies that transmit have an inside; where some overlap, the
                         smallest one's counts, as with ior.
    culled             : its back faces are not there: rays pass as through nothing. Those of closed bodies that bend or
                         absorb light are there: by them rays leave.
    shadow_culled      : the same for shadow rays: what a light sees the back of is not in its way.
    ray_traced         : ray traced by the artist, whichever object wears it: as all of an object that is.
    approximate        : the translator could not follow all that it is made of: what the raster shows of it is nearer.
    fog                : of a material that has only a volume: what the closed bodies that wear it are full of, where
                         they are `FogBody`s. As a surface it does nothing.
    program            : answers for it, beside or instead of all else; None: there is none.
    closures           : what it is the weighted sum of; then of its own fields only `name`, `absorption`, `culled`,
                         `shadow_culled`, `ray_traced`, `approximate` and `program` count. None: it is a single closure,
                         which the fields tell.
    """

    name: str = ""
    base_color: Color = (0.8, 0.8, 0.8)
    ambient: float = 1.0
    diffuse: float = 1.0
    specular: Color = BLACK
    roughness: Number = 0.5
    emission: Color = BLACK
    reflectivity: Number = 0.0
    reflection_tint: Color = WHITE
    opacity: Number = 1.0
    transmission_tint: Color = WHITE
    ior: Number = 1.45
    dispersion: float = 0.0
    interface_tint: Color = WHITE
    normal: Expression | None = None
    layered: bool = False
    edge_tint: Color | None = None
    thin: bool = False
    film: Number = 0.0
    film_ior: Number = 1.33
    metal_ior: Color | None = None
    stretch: Number = 1.0
    tangent: Expression | None = None
    translucent: bool = False
    scatter: Number = 0.0
    scatter_radius: Color = BLACK
    multiscatter: bool = True
    coat_shows: bool = True
    coat: Number = 0.0
    coat_roughness: Number = 0.03
    coat_ior: float = 1.5
    coat_tint: Color = WHITE
    sheen: Number = 0.0
    sheen_roughness: Number = 0.5
    sheen_tint: Color = WHITE
    absorption: RGB = BLACK
    culled: bool = False
    shadow_culled: bool = False
    ray_traced: bool = False
    approximate: bool = False
    closures: tuple[Closure, ...] = ()
    fog: Medium | None = None
    program: SurfaceProgram | None = None

    @property
    def parts(self) -> tuple[Surface, ...]:
        """Itself, then those of its closures."""
        return (self, *(closure.surface for closure in self.closures))


@dataclass(frozen=True, eq=False)
class Closure:
    """One of the closures that a surface is the sum of.

    weight  : what all of its light is multiplied by, >= 0; Mix Shader shares 1 out, Add Shader gives 1 to each.
    surface : what it does; no sum itself.
    """

    weight: Number | RGB
    surface: Surface
