"""Shader nodes -> scene.Surface: one small function for each node, found in the table SHADERS.

Light that meets a surface is shared out: a share is mirrored, a share lights the surface itself (local), a share is
transmitted; scene.Surface holds them as reflectivity r and opacity o, with (r, (1 - r) o, (1 - r)(1 - o)).

Sources: gpu_shader_material_principled.glsl (order of the layers, F0, sqrt of the base colour for transmission).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ...scene import BLACK, RGB, WHITE, Surface
from .nodes import Node, Socket
from .texture import NodeReader, textured_color

Shares = tuple[float, float, float]

MAX_DEPTH = 32  # of Mix and Add Shaders below one another
MIN_IOR = 1e-5  # Blender's own clamp
SHARP_ROUGHNESS = 0.25  # above it a sharp mirror image looks wrong enough to be worth a warning
NOT_FOLLOWED = (  # Principled inputs that change the picture when they are not 0, and that the tracer has not got
    "Coat Weight",
    "Sheen Weight",
    "Subsurface Weight",
    "Thin Film Thickness",
    "Anisotropic",
)


def surface_from(socket: Socket, reader: NodeReader, depth: int = 0) -> Surface:
    """The surface that the shader linked to `socket` describes; black, as in Blender, where nothing is linked."""
    node = socket.node()
    if node is None:
        return _opaque(BLACK)
    if node.kind == "ShaderNodeMixShader" and depth < MAX_DEPTH:
        return _mix(node, reader, depth + 1)
    if node.kind == "ShaderNodeAddShader" and depth < MAX_DEPTH:
        return _add(node, reader, depth + 1)
    shader = SHADERS.get(node.kind)
    if shader is None:
        return _unknown(node, reader)
    if node.has_input("Normal") and not node.input("Normal").is_constant():
        reader.warn(f"'Normal' of node {node.name!r} is not followed; the mesh's normals are used")
    return shader(node, reader)


# ------------------------------------------------------------------------------------------------ single shaders


def _principled(node: Node, reader: NodeReader) -> Surface:
    base_color, texture = textured_color(reader, node, "Base Color")
    metallic, alpha = _unit(reader.number(node, "Metallic")), _unit(reader.number(node, "Alpha"))
    transmission, ior = _unit(reader.number(node, "Transmission Weight")), _ior(node, reader)
    _warn_of_layers(node, reader)
    glass, straight = alpha * (1.0 - metallic) * transmission, 1.0 - alpha
    if glass > 0.0 and straight > 0.0:
        reader.warn(f"node {node.name!r}: alpha and transmission together are approximated by the stronger of them")
    bent = glass > straight
    return replace(
        _shared(alpha * metallic, alpha * (1.0 - metallic) * (1.0 - transmission), glass + straight),
        base_color=base_color,
        base_color_texture=texture,
        specular=_specular(node, reader, ior),
        roughness=_roughness(node, reader, mirrors=metallic > 0.0 or glass > 0.0),
        emission=_scaled(_emitted(node, reader, "Emission Color", "Emission Strength"), alpha),
        reflection_tint=base_color if metallic > 0.0 else WHITE,
        transmission_tint=_root(base_color) if bent else WHITE,
        ior=1.0 if straight > 0.0 and not bent else ior,
    )


def _specular(node: Node, reader: NodeReader, ior: float) -> RGB:
    """Reflectance at normal incidence, at most 1; Specular IOR Level 0.5 leaves it as the IOR has it."""
    f0 = ((ior - 1.0) / (ior + 1.0)) ** 2 * 2.0 * reader.number(node, "Specular IOR Level")
    tint = reader.color(node, "Specular Tint")
    return min(f0 * tint[0], 1.0), min(f0 * tint[1], 1.0), min(f0 * tint[2], 1.0)


def _warn_of_layers(node: Node, reader: NodeReader) -> None:
    for name in NOT_FOLLOWED:
        if node.has_input(name) and (node.input(name).value() or not node.input(name).is_constant()):
            reader.warn(f"{name!r} of node {node.name!r} is not traced")


def _glass(node: Node, reader: NodeReader) -> Surface:
    tint = reader.color(node, "Color")
    return replace(
        _shared(0.0, 0.0, 1.0),
        roughness=_roughness(node, reader, mirrors=True),
        reflection_tint=tint,
        transmission_tint=tint,
        ior=_ior(node, reader),
    )


def _refraction(node: Node, reader: NodeReader) -> Surface:
    reader.warn(f"node {node.name!r}: Refraction BSDF is traced as Glass BSDF, which reflects, too")
    return replace(_glass(node, reader), reflection_tint=WHITE)


def _transparent(node: Node, reader: NodeReader) -> Surface:
    return replace(_shared(0.0, 0.0, 1.0), transmission_tint=reader.color(node, "Color"), ior=1.0)


def _glossy(node: Node, reader: NodeReader) -> Surface:
    tint, texture = textured_color(reader, node, "Color")
    if texture:
        reader.warn(f"node {node.name!r}: the image does not colour reflections; {tint} is used")
    return replace(
        _shared(1.0, 0.0, 0.0),
        base_color=tint,
        reflection_tint=tint,
        roughness=_roughness(node, reader, mirrors=True),
    )


def _diffuse(node: Node, reader: NodeReader) -> Surface:
    base_color, texture = textured_color(reader, node, "Color")
    return replace(_opaque(base_color), base_color_texture=texture)


def _as_diffuse(node: Node, reader: NodeReader) -> Surface:
    reader.warn(f"node {node.name!r} ({node.b_node.bl_label}) is traced as Diffuse BSDF")
    return _diffuse(node, reader)


def _emission(node: Node, reader: NodeReader) -> Surface:
    return replace(_opaque(BLACK), emission=_emitted(node, reader, "Color", "Strength"))


def _holdout(node: Node, reader: NodeReader) -> Surface:
    reader.warn(f"node {node.name!r}: Holdout is not traced; the surface is black")
    return _opaque(BLACK)


def _unknown(node: Node, reader: NodeReader) -> Surface:
    reader.warn(f"node {node.name!r} ({node.b_node.bl_label}) is not followed; the surface is grey")
    return _opaque((0.8, 0.8, 0.8))


SHADERS: dict[str, Callable[[Node, NodeReader], Surface]] = {
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeBsdfGlass": _glass,
    "ShaderNodeBsdfRefraction": _refraction,
    "ShaderNodeBsdfTransparent": _transparent,
    "ShaderNodeBsdfAnisotropic": _glossy,
    "ShaderNodeBsdfGlossy": _glossy,
    "ShaderNodeBsdfMetallic": _glossy,
    "ShaderNodeBsdfDiffuse": _diffuse,
    "ShaderNodeBsdfTranslucent": _as_diffuse,
    "ShaderNodeBsdfSheen": _as_diffuse,
    "ShaderNodeBsdfToon": _as_diffuse,
    "ShaderNodeSubsurfaceScattering": _as_diffuse,
    "ShaderNodeEmission": _emission,
    "ShaderNodeHoldout": _holdout,
}


# ------------------------------------------------------------------------------------------------ Mix and Add Shader


def _mix(node: Node, reader: NodeReader, depth: int) -> Surface:
    factor = _unit(reader.number(node, 0))
    if factor in (0.0, 1.0):
        return surface_from(node.input(1 + int(factor)), reader, depth)
    first, second = (surface_from(node.input(position), reader, depth) for position in (1, 2))
    if not blend_is_exact(first, second):
        reader.warn(f"node {node.name!r}: the two shaders are approximated by one average surface")
    return blend(first, second, factor)


def _add(node: Node, reader: NodeReader, depth: int) -> Surface:
    first: Any
    second: Any
    first, second = (surface_from(node.input(position), reader, depth) for position in (0, 1))
    emission = _sum(first.emission, second.emission)
    for only_glows, other in ((first, second), (second, first)):
        if _is_black(only_glows):
            return replace(other, emission=emission)
    reader.warn(f"node {node.name!r}: the sum of two shaders is approximated by their average")
    return replace(blend(first, second, 0.5), emission=emission)


def blend(first: Any, second: Any, factor: float) -> Surface:
    """`first` x (1 - factor) + `second` x factor, by the shares of light that each gives away.

    What one surface can hold only once (roughness, IOR, image) is taken from the one with the larger share of it.
    """
    mirrored_1, local_1, passed_1 = (share * (1.0 - factor) for share in shares(first))
    mirrored_2, local_2, passed_2 = (share * factor for share in shares(second))
    local = first if local_1 >= local_2 else second
    glossy = first if mirrored_1 + local_1 >= mirrored_2 + local_2 else second
    passing = first if passed_1 >= passed_2 else second
    return replace(
        _shared(mirrored_1 + mirrored_2, local_1 + local_2, passed_1 + passed_2),
        base_color=_average(first.base_color, local_1, second.base_color, local_2),
        base_color_texture=local.base_color_texture,
        specular=_average(first.specular, local_1, second.specular, local_2),
        roughness=glossy.roughness,
        emission=_average(first.emission, 1.0 - factor, second.emission, factor),
        reflection_tint=_average(first.reflection_tint, mirrored_1, second.reflection_tint, mirrored_2),
        transmission_tint=_average(first.transmission_tint, passed_1, second.transmission_tint, passed_2),
        ior=passing.ior,
    )


def blend_is_exact(first: Surface, second: Surface) -> bool:
    """Whether `blend` of the two loses nothing."""
    (mirrored_1, local_1, passed_1), (mirrored_2, local_2, passed_2) = shares(first), shares(second)
    mirrors_agree = not (mirrored_1 and mirrored_2) or first.reflection_tint == second.reflection_tint
    passing_agree = not (passed_1 and passed_2) or (
        first.ior == second.ior and first.transmission_tint == second.transmission_tint
    )
    return mirrors_agree and passing_agree and (not (local_1 and local_2) or _locals_agree(first, second))


def _locals_agree(first: Surface, second: Surface) -> bool:
    if first.base_color_texture is not None or second.base_color_texture is not None:
        return False
    return first.roughness == second.roughness or first.specular == second.specular == BLACK


def shares(surface: Any) -> Shares:
    """(mirrored, local, transmitted), their sum 1."""
    rest = 1.0 - surface.reflectivity
    return surface.reflectivity, rest * surface.opacity, rest * (1.0 - surface.opacity)


# ------------------------------------------------------------------------------------------------ building blocks


def _shared(mirrored: float, local: float, transmitted: float) -> Surface:
    """A surface with these shares, normalised to a sum of 1; `shares` is the inverse."""
    rest = local + transmitted
    return Surface(
        reflectivity=mirrored / (mirrored + rest) if mirrored > 0.0 else 0.0,
        opacity=local / rest if rest > 0.0 else 1.0,
    )


def _opaque(base_color: RGB) -> Surface:
    return Surface(base_color=base_color)


def _is_black(surface: Surface) -> bool:
    """Whether nothing but emission comes from it."""
    lit = surface.base_color_texture is not None or surface.base_color != BLACK or surface.specular != BLACK
    return shares(surface) == (0.0, 1.0, 0.0) and not lit


def _roughness(node: Node, reader: NodeReader, *, mirrors: bool) -> float:
    roughness = _unit(reader.number(node, "Roughness"))
    if mirrors and roughness > SHARP_ROUGHNESS:
        reader.warn(f"node {node.name!r}: roughness {roughness:.2g} is not traced; it mirrors and refracts sharply")
    return roughness


def _unit(value: float) -> float:
    """Clamped to 0..1, as the shaders clamp: a Value node may feed a socket anything."""
    return min(max(value, 0.0), 1.0)


def _ior(node: Node, reader: NodeReader) -> float:
    return max(reader.number(node, "IOR"), MIN_IOR)


def _emitted(node: Node, reader: NodeReader, color: str, strength: str) -> RGB:
    factor = reader.number(node, strength)
    return _scaled(reader.color(node, color), factor) if factor else BLACK


def _scaled(color: RGB, factor: float) -> RGB:
    return color[0] * factor, color[1] * factor, color[2] * factor


def _root(color: RGB) -> RGB:
    red, green, blue = (math.sqrt(max(component, 0.0)) for component in color)
    return red, green, blue


def _sum(first: RGB, second: RGB) -> RGB:
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]


def _average(first: RGB, weight_1: float, second: RGB, weight_2: float) -> RGB:
    total = weight_1 + weight_2
    if total <= 0.0:
        return first
    values: Any = ((a * weight_1 + b * weight_2) / total for a, b in zip(first, second, strict=True))
    red, green, blue = values
    return red, green, blue
