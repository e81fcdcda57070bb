"""Surfaces compiled to a structure of arrays, one column a surface, with the weights of the surface model worked out.

L = r Lr + (1 - r) [ o Llocal + (1 - o) (F Lr + (1 - F) Lt) ] + Le      (see scene.Surface)

The weights are products of float64 scalars, rounded once; hits gather them with `take`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32, Float64, Int32, Surface, Texture
from .constants import FAINT, MIN_ROUGHNESS

Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SurfaceTable:
    """One column for each of the s surfaces of a scene (one default surface if it has none)."""

    base_color: Float32  # (3, s) albedo
    texture: Int32  # (s,) index into `textures`, -1 for none
    ambient: Float32  # (s,) weight of the world's diffuse light
    diffuse: Float32  # (s,) weight of the lights' diffuse light
    specular: Float32  # (3, s) F0 of the Phong highlight
    exponent: Float32  # (s,) of the Phong highlight
    emission: Float32  # (3, s) Le
    local: Float32  # (s,) (1 - r) o
    mirror: Float32  # (3, s) r reflection_tint
    interface: Float32  # (s,) (1 - r) (1 - o): what Fresnel shares out
    tint: Float32  # (3, s) transmission_tint
    ior: Float64  # (s,) inside over outside

    emits: Bools  # (s,) Le is not 0
    shades_ambient: Bools  # (s,) (1 - r) o ambient base_color can differ from 0
    shades_diffuse: Bools  # (s,) the same for the lights' diffuse part
    shades_specular: Bools  # (s,) and for the highlight
    straight: Bools  # (s,) IOR exactly 1: F = 0, rays pass unbent
    reflects: Bools  # (s,) a hit can spawn a reflected ray
    transmits: Bools  # (s,) a hit can spawn a refracted or straight ray
    clear: Bools  # (s,) and it brings more than FAINT
    shadow_opaque: Bools  # (s,) blocks every shadow ray
    shadow_clear: Bools  # (s,) lets every shadow ray pass unchanged

    textures: tuple[Texture, ...]

    @property
    def shades_locally(self) -> Bools:
        """(s,) whether Llocal needs working out."""
        return self.shades_ambient | self.shades_diffuse | self.shades_specular

    @property
    def refracts(self) -> Bools:
        """(s,) whether transmitted rays bend, hence spend a bounce."""
        return self.transmits & ~self.straight


def phong_exponent(roughness: Float64) -> Float64:
    """Blinn-Phong exponent 2 / alpha^2 - 2 of the same width as a microfacet lobe of alpha = roughness^2."""
    alpha = np.maximum(roughness, MIN_ROUGHNESS) ** 2
    return np.maximum(2 / alpha**2 - 2, 0.0)


def compile_surfaces(surfaces: Sequence[Surface]) -> SurfaceTable:
    """The table of all surfaces of a scene."""
    surfaces = surfaces or (Surface(),)
    textures = tuple(dict.fromkeys(s.base_color_texture for s in surfaces if s.base_color_texture is not None))

    def scalars(name: str) -> Float64:
        return np.array([getattr(s, name) for s in surfaces], np.float64)

    def colors(name: str) -> Float64:
        return np.ascontiguousarray(np.array([getattr(s, name) for s in surfaces], np.float64).T)

    r, o, ior = scalars("reflectivity"), scalars("opacity"), scalars("ior")
    local, interface = (1 - r) * o, (1 - r) * (1 - o)
    mirror, tint, specular = r * colors("reflection_tint"), colors("transmission_tint"), colors("specular")
    texture = np.array([-1 if s.base_color_texture is None else textures.index(s.base_color_texture) for s in surfaces])
    colored = (colors("base_color") != 0).any(0) | (texture >= 0)
    straight, passes = ior == 1, interface * tint
    return SurfaceTable(
        base_color=colors("base_color").astype(np.float32),
        texture=texture.astype(np.int32),
        ambient=scalars("ambient").astype(np.float32),
        diffuse=scalars("diffuse").astype(np.float32),
        specular=specular.astype(np.float32),
        exponent=phong_exponent(scalars("roughness")).astype(np.float32),
        emission=colors("emission").astype(np.float32),
        local=local.astype(np.float32),
        mirror=mirror.astype(np.float32),
        interface=interface.astype(np.float32),
        tint=tint.astype(np.float32),
        ior=ior,
        emits=(colors("emission") != 0).any(0),
        shades_ambient=(local != 0) & (scalars("ambient") != 0) & colored,
        shades_diffuse=(local != 0) & (scalars("diffuse") != 0) & colored,
        shades_specular=(local != 0) & (specular != 0).any(0),
        straight=straight,
        reflects=(mirror != 0).any(0) | ((interface != 0) & ~straight),
        transmits=(passes != 0).any(0),
        clear=(passes > FAINT).any(0),
        shadow_opaque=(passes == 0).all(0),
        shadow_clear=straight & (passes == 1).all(0),
        textures=textures,
    )
