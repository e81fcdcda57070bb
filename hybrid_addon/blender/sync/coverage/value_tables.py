# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of nodes of numbers, colours and textures, and settings of all nodes."""

from __future__ import annotations

from typing import Any

from .scene_tables import CYCLES
from .shader_tables import PHASE
from .status import Irrelevant, Named, Table, followed, irrelevant, nodes, within

NOT_FOLLOWED: Table = {"": Named("is not followed; its socket's own value is used: bake it to an image")}

VALUES: dict[str, Table] = {
    "ShaderNodeTexImage": followed("Vector"),
    "ShaderNodeTexEnvironment": followed("Vector"),
    "ShaderNodeMapping": followed("Vector, Location, Rotation, Scale"),
    "ShaderNodeVectorRotate": followed("Vector, Center, Axis, Angle, Rotation"),
    "ShaderNodeNormalMap": followed("Strength, Color"),
    "ShaderNodeBump": {
        **followed("Strength, Distance, Height, Normal"),
        **irrelevant("how many pixels apart EEVEE compares heights; rays compare them over one", "Filter Width"),
    },
    "ShaderNodeFresnel": followed("IOR, Normal"),
    "ShaderNodeLayerWeight": followed("Blend, Normal"),
    "ShaderNodeVectorTransform": followed("Vector"),
    "ShaderNodeVectorCurve": followed("Vector, Fac, Factor"),
    "ShaderNodeNormal": followed("Normal"),
    "ShaderNodeBlackbody": followed("Temperature"),
    "ShaderNodeWavelength": followed("Wavelength"),
    "ShaderNodeLightFalloff": {**followed("Strength"), **irrelevant("EEVEE's light falls off as it does", "Smooth")},
    "ShaderNodeBevel": {**followed("Normal"), **irrelevant("EEVEE rounds nothing", "Radius")},
    "ShaderNodeMath": followed("Value"),
    "ShaderNodeVectorMath": followed("Vector, Scale"),
    "ShaderNodeMixRGB": followed("Fac, Factor, Color1, Color2"),
    "ShaderNodeMix": followed("Factor, A, B"),
    "ShaderNodeInvert": followed("Fac, Factor, Color"),
    "ShaderNodeHueSaturation": followed("Hue, Saturation, Value, Fac, Factor, Color"),
    "ShaderNodeGamma": followed("Color, Gamma"),
    "ShaderNodeBrightContrast": followed("Color, Bright, Brightness, Contrast"),
    "ShaderNodeClamp": followed("Value, Min, Max"),
    "ShaderNodeMapRange": {
        **followed("Value, From Min, From Max, To Min, To Max"),
        **within("", "Steps, Vector"),
        "": Named("is not followed where it is stepped, or of vectors"),
    },
    "ShaderNodeValToRGB": followed("Fac, Factor"),
    "ShaderNodeRGBCurve": followed("Fac, Factor, Color"),
    "ShaderNodeFloatCurve": followed("Factor, Value"),
    "ShaderNodeRGBToBW": followed("Color"),
    "ShaderNodeSeparateColor": followed("Color"),
    "ShaderNodeSeparateRGB": followed("Image"),
    "ShaderNodeSeparateHSV": followed("Color"),
    "ShaderNodeSeparateXYZ": followed("Vector"),
    "ShaderNodeCombineColor": followed("Red, Green, Blue, Hue, Saturation, Value, Lightness"),
    "ShaderNodeCombineRGB": followed("R, G, B"),
    "ShaderNodeCombineHSV": followed("H, S, V"),
    "ShaderNodeCombineXYZ": followed("X, Y, Z"),
    "ShaderNodeAmbientOcclusion": {
        **followed("Color"),
        "": Named("is not traced; it is 1"),
        **within("", "Distance, Normal"),
    },
    "ShaderNodeTexChecker": followed("Vector, Color1, Color2, Scale"),
    "ShaderNodeTexGradient": followed("Vector"),
    "ShaderNodeTexNoise": followed("Vector, W, Scale, Detail, Roughness, Lacunarity, Offset, Gain, Distortion"),
    "ShaderNodeTexVoronoi": followed(
        "Vector, W, Scale, Detail, Roughness, Lacunarity, Smoothness, Exponent, Randomness"
    ),
    "ShaderNodeTexGabor": followed("Vector, Scale, Frequency, Anisotropy, Orientation"),
    "ShaderNodeTexWave": followed("Vector, Scale, Distortion, Detail, Detail Scale, Detail Roughness, Phase Offset"),
    "ShaderNodeTexMagic": followed("Vector, Scale, Distortion"),
    "ShaderNodeTexBrick": followed(
        "Vector, Color1, Color2, Mortar, Scale, Mortar Size, Mortar Smooth, Bias, Brick Width, Row Height"
    ),
    "ShaderNodeTexWhiteNoise": followed("Vector, W"),
    "ShaderNodeTexSky": followed("Vector"),
    "ShaderNodeDisplacement": followed("Height, Midlevel, Scale, Normal"),
    "ShaderNodeRaycast": followed("Position, Direction, Length"),
    "ShaderNodeVectorDisplacement": followed("Vector, Midlevel, Scale"),
    **nodes(
        "TexCoord, UVMap, Attribute, VertexColor, NewGeometry, HairInfo, LightPath, Value, RGB, Group, ObjectInfo,"
        "CameraData, Tangent, VolumeInfo",
        {},
    ),
    **nodes(
        "ParticleInfo, PointInfo, RadialTiling, Script, ShaderToRGB, Squeeze, TexIES, TexPointDensity,"
        "UVAlongStroke, Wireframe",
        NOT_FOLLOWED,
    ),
}
"""By the node's identifier."""


def _is_mapped(node: Any) -> bool:
    """Whether the mapping that a texture node has beside its Vector does anything."""
    b_mapping = node.b_node.texture_mapping
    moved = any(b_mapping.translation) or any(b_mapping.rotation) or tuple(b_mapping.scale) != (1.0, 1.0, 1.0)
    axes = (b_mapping.mapping_x, b_mapping.mapping_y, b_mapping.mapping_z)
    return moved or axes != ("X", "Y", "Z") or b_mapping.use_min or b_mapping.use_max


TEXTURE: Table = {
    "texture_mapping": Named("is not followed: use a Mapping node", None, _is_mapped),
    **irrelevant("EEVEE does not read it", "color_mapping"),
}
OUTPUT = "Blender says which output EEVEE uses"
GGX = Irrelevant("EEVEE draws GGX, whatever is chosen; whether it is Multiscatter is followed")

AS_DIFFUSE = "EEVEE draws it as Diffuse BSDF, and so does the traced half"

NODE_SETTINGS: dict[str, Table] = {
    **nodes("VolumeScatter, VolumeCoefficients", irrelevant(PHASE, "phase")),
    **nodes(
        "TexBrick, TexChecker, TexGabor, TexGradient, TexMagic, TexNoise, TexSky, TexVoronoi,TexWave",
        TEXTURE,
    ),
    "ShaderNodeTexImage": TEXTURE,
    "ShaderNodeTexEnvironment": TEXTURE,
    "ShaderNodeBsdfPrincipled": {"distribution": GGX, **irrelevant(CYCLES, "subsurface_method")},
    "ShaderNodeBsdfGlass": {"distribution": GGX},
    "ShaderNodeBsdfRefraction": {"distribution": GGX},
    "ShaderNodeBsdfAnisotropic": {"distribution": GGX},
    "ShaderNodeBsdfMetallic": {"distribution": GGX},
    **nodes("BsdfToon, BsdfHair", irrelevant(AS_DIFFUSE, "component")),
    "ShaderNodeBsdfHairPrincipled": irrelevant(AS_DIFFUSE, "model, parametrization"),
    "ShaderNodeSubsurfaceScattering": irrelevant(CYCLES, "falloff"),
    "ShaderNodeBsdfSheen": {"distribution": Named("is traced as Microfiber", "MICROFIBER")},
    **nodes(
        "OutputMaterial, OutputWorld, OutputLight, OutputLineStyle", irrelevant(OUTPUT, "is_active_output, target")
    ),
    "ShaderNodeMixRGB": irrelevant("alpha is no part of colours in materials", "use_alpha"),
}
"""By the node's identifier: what is not simply followed."""
