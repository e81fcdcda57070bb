# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of shaders, volume shaders and outputs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .status import Named, Table, followed, irrelevant

WEIGHT = irrelevant("Blender's own, hidden, and read by no renderer of nodes", "Weight")
STRINGS = "names of grids, which are read where an object has them"


def above(node: Any, *names: str) -> bool:
    """Whether one of the inputs that a node has is more than 0 anywhere."""
    sockets = [node.input(name) for name in names if node.has_input(name)]
    return any(not socket.is_constant() or socket.value() > 0.0 for socket in sockets)


def with_(*names: str) -> Callable[[Any], bool]:
    """Where one of these inputs is more than 0."""
    return lambda node: above(node, *names)


LAMBERT = "EEVEE draws rough diffuse surfaces as smooth ones, and so does the traced half"
COMMON = {**followed("Color, Roughness, Normal"), **WEIGHT}
ANISOTROPY = followed("Anisotropy, Rotation, Tangent")
FILM = followed("Thin Film Thickness, Thin Film IOR")
PROFILE = "EEVEE scatters by Burley's profile, which has none of it, and so does the traced half"
DIFFUSE = "EEVEE draws it as Diffuse BSDF, and so does the traced half"

PRINCIPLED: Table = {
    **followed(
        "Base Color, Metallic, Roughness, IOR, Alpha, Thin Wall, Normal, Specular IOR Level, Specular Tint,"
        "Transmission Weight, Coat Weight, Coat Roughness, Coat IOR, Coat Tint, Sheen Weight, Sheen Roughness,"
        "Sheen Tint, Emission Color, Emission Strength, Coat Normal"
    ),
    **followed("Subsurface Weight, Subsurface Radius, Subsurface Scale"),
    **irrelevant(PROFILE, "Subsurface IOR, Subsurface Anisotropy"),
    **followed("Anisotropic, Anisotropic Rotation, Tangent, Thin Film Thickness, Thin Film IOR"),
    **irrelevant(LAMBERT, "Diffuse Roughness"),
    **WEIGHT,
}

HEAT = "followed; it counts where an object has a grid of its temperature, or none is named"
PHASE = "EEVEE scatters by Henyey and Greenstein, whatever the phase function"
VOLUMES: dict[str, Table] = {
    "ShaderNodeVolumeAbsorption": {**followed("Color, Density"), **WEIGHT},
    "ShaderNodeVolumePrincipled": {
        **followed("Color, Density, Absorption Color, Anisotropy, Emission Color, Emission Strength"),
        **irrelevant(HEAT, "Blackbody Intensity, Blackbody Tint, Temperature"),
        **irrelevant(STRINGS, "Color Attribute, Density Attribute, Temperature Attribute"),
        **WEIGHT,
    },
    "ShaderNodeVolumeScatter": {
        **followed("Color, Density, Anisotropy"),
        **irrelevant(PHASE, "IOR, Backscatter, Alpha, Diameter"),
        **WEIGHT,
    },
    "ShaderNodeVolumeCoefficients": {
        **followed("Absorption Coefficients, Scatter Coefficients, Emission Coefficients, Anisotropy"),
        **irrelevant(PHASE, "IOR, Backscatter, Alpha, Diameter"),
        **WEIGHT,
    },
}

UNKNOWN: Table = {"": Named("is not followed; the surface is grey")}

SHADERS: dict[str, Table] = {
    "ShaderNodeBsdfPrincipled": PRINCIPLED,
    "ShaderNodeBsdfGlass": {**COMMON, **followed("IOR"), **FILM},
    "ShaderNodeBsdfRefraction": {**COMMON, **followed("IOR")},
    "ShaderNodeBsdfTransparent": {**followed("Color"), **WEIGHT},
    "ShaderNodeBsdfAnisotropic": {**COMMON, **ANISOTROPY},
    "ShaderNodeBsdfMetallic": {**COMMON, **followed("Base Color, Edge Tint, IOR, Extinction"), **ANISOTROPY, **FILM},
    "ShaderNodeBsdfDiffuse": {
        **followed("Color, Normal"),
        **irrelevant(LAMBERT, "Roughness"),
        **WEIGHT,
    },
    "ShaderNodeBsdfTranslucent": {**followed("Color, Normal"), **WEIGHT},
    "ShaderNodeBsdfSheen": {**followed("Color, Roughness, Normal"), **WEIGHT},
    "ShaderNodeBsdfToon": {**followed("Color, Normal"), **irrelevant(DIFFUSE, "Size, Smooth"), **WEIGHT},
    "ShaderNodeBsdfHair": {
        **followed("Color"),
        **irrelevant(DIFFUSE, "Offset, RoughnessU, RoughnessV, Tangent"),
        **WEIGHT,
    },
    "ShaderNodeBsdfHairPrincipled": {
        **followed("Color"),
        **irrelevant(
            DIFFUSE,
            "Melanin, Melanin Redness, Tint, Absorption Coefficient, Aspect Ratio, Roughness, Radial Roughness, Coat,"
            "IOR, Offset, Random Color, Random Roughness, Random, Reflection, Transmission, Secondary Reflection",
        ),
        **WEIGHT,
    },
    "ShaderNodeSubsurfaceScattering": {
        **followed("Color, Normal, Scale, Radius"),
        **irrelevant(PROFILE, "IOR, Roughness, Anisotropy"),
        **WEIGHT,
    },
    "ShaderNodeBsdfRayPortal": {
        **followed("Color"),
        "Position": Named("is not traced; rays go straight on, as EEVEE draws it", None),
        "Direction": Named("is not traced; rays go straight on, as EEVEE draws it", (0.0, 0.0, 0.0)),
        **WEIGHT,
    },
    "ShaderNodeEeveeSpecular": {
        **followed(
            "Base Color, Specular, Roughness, Emissive Color, Transparency, Normal, Clear Coat, Clear Coat Roughness,"
            "Clear Coat Normal"
        ),
        **WEIGHT,
    },
    "ShaderNodeEmission": {**followed("Color, Strength"), **WEIGHT},
    "ShaderNodeBackground": {**followed("Color, Strength"), **WEIGHT},
    "ShaderNodeHoldout": {"": Named("is not traced; the surface is black")},
    "ShaderNodeMixShader": followed("Fac, Factor, Shader"),
    "ShaderNodeAddShader": followed("Shader"),
    **VOLUMES,
    "ShaderNodeOutputMaterial": {
        **followed("Surface, Volume, Displacement"),
        **irrelevant("how EEVEE guesses the thickness of glass, which rays measure", "Thickness"),
    },
    "ShaderNodeOutputWorld": followed("Surface, Volume"),
    "ShaderNodeOutputLight": irrelevant("EEVEE has no nodes of lights; they are named", "Surface"),
    "ShaderNodeOutputAOV": irrelevant("of passes beside the picture", "Color, Value"),
    "ShaderNodeOutputLineStyle": irrelevant("of Freestyle", "Color, Color Fac*, Alpha, Alpha Fac*"),
}
"""By the node's identifier."""
