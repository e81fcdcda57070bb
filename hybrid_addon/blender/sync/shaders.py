# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes -> scene.Surface: one small function for each node, found in the table SHADERS.

Light at a closure is mirrored, lights it (local), or is transmitted: shares (r, (1 - r) o, (1 - r)(1 - o)) of
reflectivity r and opacity o in scene.Surface. Any number or colour may be an expression (`values`). Mix and Add Shader
make sums of closures (`sums`).

Sources: gpu_shader_material_principled.glsl (order of the layers, F0, sqrt of the base colour for transmission).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ... import expressions as ex
from ...scene import BLACK, WHITE, Expression, Surface
from . import object_nodes as _objects  # noqa: F401
from . import texture_nodes as _textures  # noqa: F401  (these two add their nodes to the table of `values`)
from . import value_nodes as _registered  # noqa: F401
from .conductor import conductor_tints
from .coverage import name_sockets
from .nodes import Node, Socket
from .sums import added, may_be, mixed, weighted
from .texture import NodeReader
from .values import color, emitted, number, once, vector

Share = Any  # a float or an expression
Shares = tuple[Share, Share, Share]

MAX_DEPTH = 32  # of Mix and Add Shaders below one another
MIN_IOR = 1e-5  # Blender's own clamp


def surface_from(socket: Socket, reader: NodeReader, depth: int = 0) -> Surface:
    """The surface that the shader linked to `socket` describes; black, as in Blender, where nothing is linked."""
    node = socket.node()
    if node is None:
        return _opaque(BLACK)
    if (light := emitted(reader, socket)) is not None:
        return replace(_opaque(BLACK), emission=light)
    combine = COMBINED.get(node.kind) if depth < MAX_DEPTH else None
    if combine is not None:
        return once(reader, node, lambda: combine(node, reader, depth + 1), "surface", _opaque(BLACK))
    shader = SHADERS.get(node.kind)
    if shader is None:
        reader.give_up(f"node {node.name!r} ({node.b_node.bl_label}) is not followed; the surface is grey")
        return _opaque((0.8, 0.8, 0.8))
    name_sockets(node, reader)
    surface = shader(node, reader)
    return surface if surface.closures else replace(surface, normal=_normal(node, reader))


def _normal(node: Node, reader: NodeReader) -> Expression | None:
    """What is linked to the shader's Normal, if it can be followed."""
    if not node.has_input("Normal") or node.input("Normal").node() is None:
        return None
    return ex.held(vector(reader, node, "Normal"))


# ------------------------------------------------------------------------------------------------ single shaders


def _principled(node: Node, reader: NodeReader) -> Surface:
    return _principled_body(node, reader, _unit(number(reader, node, "Alpha")))


def _principled_body(node: Node, reader: NodeReader, alpha: Share) -> Surface:
    """The node with this alpha."""
    base_color = color(reader, node, "Base Color")
    metallic, transmission = _unit(number(reader, node, "Metallic")), _unit(number(reader, node, "Transmission Weight"))
    ior = _ior(node, reader)
    glass, straight = ex.times(alpha, ex.rest(metallic), transmission), ex.rest(alpha)
    thin = node.has_input("Thin Wall") and bool(node.input("Thin Wall").value()) and may_be(glass)
    if may_be(glass) and may_be(straight):  # a sum: what lies there, and what is seen past it
        opaque, clear = _principled_body(node, reader, 1.0), replace(_shared(0.0, 0.0, 1.0), ior=1.0)
        return weighted((alpha, replace(opaque, normal=_normal(node, reader))), (straight, clear))
    bent = may_be(glass)
    clear = ex.apply("clamp", base_color, 0.0, 1.0) if isinstance(base_color, Expression) else base_color
    tint = clear if thin else ex.as_color(ex.apply("root", clear))
    local = ex.times(alpha, ex.rest(metallic), ex.rest(transmission))
    return replace(
        _shared(ex.times(alpha, metallic), local, ex.plus(glass, straight)),
        layered=True,
        base_color=base_color,
        specular=_specular(node, reader, ior),
        roughness=_roughness(node, reader),
        emission=ex.as_color(ex.times(alpha, _emitted(node, reader, "Emission Color", "Emission Strength"))),
        reflection_tint=clear if may_be(metallic) else WHITE,
        edge_tint=color(reader, node, "Specular Tint"),
        transmission_tint=tint if bent else WHITE,
        ior=ior if thin or bent or not may_be(straight) else 1.0,
        thin=thin,
        **_coat_and_sheen(node, reader),
    )


def _coat_and_sheen(node: Node, reader: NodeReader) -> dict[str, Any]:
    """The fields of the layers that are there."""
    fields: dict[str, Any] = {}
    coat = number(reader, node, "Coat Weight") if node.has_input("Coat Weight") else 0.0
    if may_be(coat):
        fields.update(
            coat=coat,
            coat_roughness=_unit(number(reader, node, "Coat Roughness")),
            coat_ior=max(reader.number(node, "Coat IOR"), 1.0),
            coat_tint=color(reader, node, "Coat Tint"),
        )
    sheen = number(reader, node, "Sheen Weight") if node.has_input("Sheen Weight") else 0.0
    if may_be(sheen):
        fields.update(
            sheen=sheen,
            sheen_roughness=_unit(number(reader, node, "Sheen Roughness")),
            sheen_tint=color(reader, node, "Sheen Tint"),
        )
    return fields


def _specular(node: Node, reader: NodeReader, ior: Share) -> Any:
    """Reflectance at normal incidence, at most 1; Specular IOR Level 0.5 leaves it as the IOR has it."""
    if isinstance(ior, Expression):
        amplitude = ex.apply("divide", ex.apply("subtract", ior, 1.0), ex.apply("add", ior, 1.0))
        twice: Any = ex.times(ex.apply("multiply", amplitude, amplitude), 2.0)
    else:
        twice = ((ior - 1.0) / (ior + 1.0)) ** 2 * 2.0
    f0 = ex.times(twice, number(reader, node, "Specular IOR Level"))
    return ex.as_color(ex.apply("minimum", ex.times(color(reader, node, "Specular Tint"), f0), 1.0))


def _glass(node: Node, reader: NodeReader) -> Surface:
    tint = color(reader, node, "Color")
    return replace(
        _shared(0.0, 0.0, 1.0),
        layered=True,
        roughness=_roughness(node, reader),
        reflection_tint=tint,
        interface_tint=tint,
        transmission_tint=tint,
        ior=_ior(node, reader),
    )


def _refraction(node: Node, reader: NodeReader) -> Surface:
    return replace(_glass(node, reader), reflection_tint=WHITE, interface_tint=BLACK)


def _transparent(node: Node, reader: NodeReader) -> Surface:
    return replace(_shared(0.0, 0.0, 1.0), transmission_tint=color(reader, node, "Color"), ior=1.0)


def _metallic(node: Node, reader: NodeReader) -> Surface:
    if node.b_node.fresnel_type != "PHYSICAL_CONDUCTOR":
        return _glossy(node, reader)
    n, k = (np.maximum(tuple(reader.vector(node, name)), 0.0) for name in ("IOR", "Extinction"))
    return _metal(*conductor_tints(n, k), node, reader)


def _glossy(node: Node, reader: NodeReader) -> Surface:
    tint = color(reader, node, "Color" if node.has_input("Color") else "Base Color")
    return _metal(tint, color(reader, node, "Edge Tint") if node.has_input("Edge Tint") else None, node, reader)


def _metal(tint: Any, edge: Any, node: Node, reader: NodeReader) -> Surface:
    fields: dict[str, Any] = {
        "base_color": tint,
        "reflection_tint": tint,
        "edge_tint": edge,
        "roughness": _roughness(node, reader),
    }
    return replace(_shared(1.0, 0.0, 0.0), layered=True, **fields)


def _diffuse(node: Node, reader: NodeReader) -> Surface:
    return _opaque(color(reader, node, "Color"))


def _as_diffuse(node: Node, reader: NodeReader) -> Surface:
    reader.give_up(f"node {node.name!r} ({node.b_node.bl_label}) is traced as Diffuse BSDF")
    return _diffuse(node, reader)


def _emission(node: Node, reader: NodeReader) -> Surface:
    return replace(_opaque(BLACK), emission=_emitted(node, reader, "Color", "Strength"))


def _holdout(node: Node, reader: NodeReader) -> Surface:
    reader.warn(f"node {node.name!r}: Holdout is not traced; the surface is black")
    return _opaque(BLACK)


SHADERS: dict[str, Callable[[Node, NodeReader], Surface]] = {
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeBsdfGlass": _glass,
    "ShaderNodeBsdfRefraction": _refraction,
    "ShaderNodeBsdfTransparent": _transparent,
    "ShaderNodeBsdfAnisotropic": _glossy,
    "ShaderNodeBsdfGlossy": _glossy,
    "ShaderNodeBsdfMetallic": _metallic,
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
    factor = _unit(number(reader, node, 0))
    if factor in (0.0, 1.0):
        return surface_from(node.input(1 + int(factor)), reader, depth)
    first, second = (surface_from(node.input(position), reader, depth) for position in (1, 2))
    return mixed(first, second, factor)


def _add(node: Node, reader: NodeReader, depth: int) -> Surface:
    return added(*(surface_from(node.input(position), reader, depth) for position in (0, 1)))


COMBINED = {"ShaderNodeMixShader": _mix, "ShaderNodeAddShader": _add}


def shares(surface: Surface) -> Shares:
    """(mirrored, local, transmitted) of a closure, their sum 1."""
    rest = ex.rest(surface.reflectivity)
    return surface.reflectivity, ex.times(rest, surface.opacity), ex.times(rest, ex.rest(surface.opacity))


# ------------------------------------------------------------------------------------------------ building blocks


def _shared(mirrored: Share, local: Share, transmitted: Share) -> Surface:
    """A surface with these shares, normalised to a sum of 1; `shares` is the inverse."""
    rest = ex.plus(local, transmitted)
    return Surface(
        reflectivity=ex.apply("ratio", mirrored, ex.plus(mirrored, rest), 0.0) if may_be(mirrored) else 0.0,
        opacity=ex.apply("ratio", local, rest, 1.0) if may_be(transmitted) else 1.0,
    )


def _opaque(base_color: Any) -> Surface:
    return Surface(base_color=base_color)


def _roughness(node: Node, reader: NodeReader) -> Share:
    return _unit(number(reader, node, "Roughness"))


def _unit(value: Share) -> Share:
    """Clamped to 0..1, as the shaders clamp: a Value node may feed a socket anything."""
    return ex.clamped(value)


def _ior(node: Node, reader: NodeReader) -> Share:
    return ex.apply("maximum", number(reader, node, "IOR"), MIN_IOR)


def _emitted(node: Node, reader: NodeReader, color_name: str, strength: str) -> Any:
    factor = number(reader, node, strength)
    return ex.as_color(ex.times(factor, color(reader, node, color_name))) if factor != 0.0 else BLACK
