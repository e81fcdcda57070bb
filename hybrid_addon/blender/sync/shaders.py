# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes -> scene.Surface: one small function for each node, found in the table SHADERS.

Light at a surface is mirrored, lights it (local), or is transmitted: shares (r, (1 - r) o, (1 - r)(1 - o)) of
reflectivity r and opacity o in scene.Surface. Any number or colour may be an expression (`values`).

Sources: gpu_shader_material_principled.glsl (order of the layers, F0, sqrt of the base colour for transmission).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ... import expressions as ex
from ...scene import BLACK, WHITE, Expression, Surface
from . import lobes
from . import texture_nodes as _textures  # noqa: F401  (these two add their nodes to the table of `values`)
from . import value_nodes as _registered  # noqa: F401
from .conductor import conductor_tints
from .coverage import name_sockets
from .nodes import Node, Socket
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
    return replace(shader(node, reader), normal=_normal(node, reader))


def _normal(node: Node, reader: NodeReader) -> Expression | None:
    """What is linked to the shader's Normal, if it can be followed."""
    if not node.has_input("Normal") or node.input("Normal").node() is None:
        return None
    value = vector(reader, node, "Normal")
    return value if isinstance(value, Expression) else None


# ------------------------------------------------------------------------------------------------ single shaders


def _principled(node: Node, reader: NodeReader) -> Surface:
    base_color, alpha = color(reader, node, "Base Color"), _unit(number(reader, node, "Alpha"))
    metallic, transmission = _unit(number(reader, node, "Metallic")), _unit(number(reader, node, "Transmission Weight"))
    film = lobes.film(node, reader)
    ior = lobes.index(_ior(node, reader), film)
    if metallic == 1.0 and not lobes.FILMS_ON_METAL:
        film = {}
    glass, straight = ex.times(alpha, ex.rest(metallic), transmission), ex.rest(alpha)
    thin = node.has_input("Thin Wall") and bool(node.input("Thin Wall").value()) and may_be(glass)
    if may_be(glass) and may_be(straight) and not thin:
        reader.warn(f"node {node.name!r}: alpha and transmission together are approximated by the stronger of them")
    bent = may_be(glass) and not _exceeds(straight, glass)
    clear = ex.apply("clamp", base_color, 0.0, 1.0) if isinstance(base_color, Expression) else base_color
    tint = clear if thin else ex.as_color(ex.apply("root", clear))
    local = ex.times(alpha, ex.rest(metallic), ex.rest(transmission))
    return replace(
        _shared(ex.times(alpha, metallic), local, ex.plus(glass, straight)),
        layered=True,
        base_color=base_color,
        specular=lobes.specular(node, reader, ior),
        roughness=_roughness(node, reader),
        emission=ex.as_color(ex.times(alpha, _emitted(node, reader, "Emission Color", "Emission Strength"))),
        reflection_tint=clear if may_be(metallic) else WHITE,
        edge_tint=color(reader, node, "Specular Tint"),
        transmission_tint=tint if bent else WHITE,
        ior=ior if thin or bent or not may_be(straight) else 1.0,
        thin=thin,
        **film,
        **lobes.principled_grain(node, reader, "Anisotropic", "Anisotropic Rotation"),
        **lobes.coat_and_sheen(node, reader),
    )


def _glass(node: Node, reader: NodeReader) -> Surface:
    tint = color(reader, node, "Color")
    film = lobes.film(node, reader)
    return replace(
        _shared(0.0, 0.0, 1.0),
        layered=True,
        roughness=_roughness(node, reader),
        reflection_tint=tint,
        interface_tint=tint,
        transmission_tint=tint,
        ior=lobes.index(_ior(node, reader), film),
        **film,
    )


def _refraction(node: Node, reader: NodeReader) -> Surface:
    return replace(_glass(node, reader), reflection_tint=WHITE, interface_tint=BLACK)


def _transparent(node: Node, reader: NodeReader) -> Surface:
    return replace(_shared(0.0, 0.0, 1.0), transmission_tint=color(reader, node, "Color"), ior=1.0)


def _metallic(node: Node, reader: NodeReader) -> Surface:
    extra = {**lobes.film(node, reader), **lobes.principled_grain(node, reader, "Anisotropy", "Rotation")}
    if node.b_node.fresnel_type != "PHYSICAL_CONDUCTOR":
        tints = color(reader, node, "Base Color"), color(reader, node, "Edge Tint")
        return replace(_metal(*tints, node, reader), **extra)
    n, k = (np.maximum(tuple(reader.vector(node, name)), 0.0) for name in ("IOR", "Extinction"))
    return replace(_metal(*conductor_tints(n, k), node, reader), metal_ior=tuple(n.tolist()), **extra)


def _glossy(node: Node, reader: NodeReader) -> Surface:
    return replace(_metal(color(reader, node, "Color"), None, node, reader), **lobes.glossy_grain(node, reader))


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


def _translucent(node: Node, reader: NodeReader) -> Surface:
    return replace(_diffuse(node, reader), translucent=True)


def _sheen(node: Node, reader: NodeReader) -> Surface:
    """Principled's sheen over nothing. EEVEE draws a Diffuse BSDF instead."""
    sheen = {"sheen": 1.0, "sheen_tint": color(reader, node, "Color"), "sheen_roughness": _roughness(node, reader)}
    return replace(_opaque(BLACK), layered=True, **sheen)


def _specular_bsdf(node: Node, reader: NodeReader) -> Surface:
    clear = _unit(number(reader, node, "Transparency"))
    fields = {**lobes.specular_bsdf(node, reader), "roughness": _roughness(node, reader)}
    return replace(_shared(0.0, ex.rest(clear), clear), layered=True, **fields)


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
    "ShaderNodeBsdfTranslucent": _translucent,
    "ShaderNodeBsdfSheen": _sheen,
    "ShaderNodeBsdfToon": _diffuse,
    "ShaderNodeBsdfHair": _diffuse,
    "ShaderNodeBsdfHairPrincipled": _diffuse,
    "ShaderNodeBsdfRayPortal": _transparent,
    "ShaderNodeSubsurfaceScattering": _diffuse,
    "ShaderNodeEeveeSpecular": _specular_bsdf,
    "ShaderNodeEmission": _emission,
    "ShaderNodeHoldout": _holdout,
}


# ------------------------------------------------------------------------------------------------ Mix and Add Shader


def _mix(node: Node, reader: NodeReader, depth: int) -> Surface:
    factor = _unit(number(reader, node, 0))
    if factor in (0.0, 1.0):
        return surface_from(node.input(1 + int(factor)), reader, depth)
    first, second = (surface_from(node.input(position), reader, depth) for position in (1, 2))
    if not blend_is_exact(first, second):
        reader.warn(f"node {node.name!r}: the two shaders are approximated by one average surface")
    return blend(first, second, factor)


def _add(node: Node, reader: NodeReader, depth: int) -> Surface:
    first, second = (surface_from(node.input(position), reader, depth) for position in (0, 1))
    emission = ex.as_color(ex.plus(first.emission, second.emission))
    for only_glows, other in ((first, second), (second, first)):
        if _is_black(only_glows):
            return replace(other, emission=emission)
    reader.warn(f"node {node.name!r}: the sum of two shaders is approximated by their average")
    return replace(blend(first, second, 0.5), emission=emission)


COMBINED = {"ShaderNodeMixShader": _mix, "ShaderNodeAddShader": _add}
MIRRORED = ("reflection_tint",)
LOCAL = ("base_color", "specular")
PASSED = ("transmission_tint", "interface_tint")
WHOLE = ("coat", "coat_roughness", "coat_tint", "sheen", "sheen_roughness", "sheen_tint")


def blend(first: Surface, second: Surface, factor: Share) -> Surface:
    """`first` x (1 - factor) + `second` x factor, by the shares of light that each gives away.

    What one surface can hold only once (IOR, edge tint) is taken from the one with the larger share of it.
    """
    weights = ex.rest(factor), factor
    mirrored, local, passed = (
        tuple(ex.times(share, weight) for share, weight in zip(pair, weights, strict=True))
        for pair in zip(shares(first), shares(second), strict=True)
    )
    glossy = tuple(ex.plus(a, b) for a, b in zip(mirrored, local, strict=True))
    by_share = {**dict.fromkeys(MIRRORED, mirrored), **dict.fromkeys(LOCAL, local), **dict.fromkeys(PASSED, passed)}
    by_share |= {"roughness": glossy, "emission": weights, **dict.fromkeys(WHOLE, weights)}
    averages = {
        name: _average(getattr(first, name), share[0], getattr(second, name), share[1])
        for name, share in by_share.items()
    }
    passing, coated = _larger(first, second, passed), _larger(first, second, (first.coat, second.coat))
    return replace(
        _shared(ex.plus(*mirrored), ex.plus(*local), ex.plus(*passed)),
        **averages,
        edge_tint=_larger(first, second, mirrored).edge_tint,
        coat_ior=coated.coat_ior,
        ior=passing.ior,
        thin=passing.thin,
        layered=first.layered or second.layered,
        normal=first.normal or second.normal,
    )


def blend_is_exact(first: Surface, second: Surface) -> bool:
    """Whether `blend` of the two loses nothing."""
    both = [may_be(a) and may_be(b) for a, b in zip(shares(first), shares(second), strict=True)]
    mirrors, local, passing = both

    def agree(*names: str) -> bool:
        return all(getattr(first, name) == getattr(second, name) for name in names)

    if first.normal is not second.normal or not agree("coat", "sheen"):
        return False
    if mirrors and not agree("reflection_tint", "edge_tint", "roughness"):
        return False
    if passing and not agree("ior", "transmission_tint"):
        return False
    varies = isinstance(first.base_color, Expression) or isinstance(second.base_color, Expression)
    return not local or (not varies and (agree("roughness") or first.specular == second.specular == BLACK))


def shares(surface: Surface) -> Shares:
    """(mirrored, local, transmitted), their sum 1."""
    rest = ex.rest(surface.reflectivity)
    return surface.reflectivity, ex.times(rest, surface.opacity), ex.times(rest, ex.rest(surface.opacity))


# ------------------------------------------------------------------------------------------------ building blocks


def may_be(share: Share) -> bool:
    """Whether it is more than 0 anywhere."""
    return isinstance(share, Expression) or share > 0.0


def _exceeds(first: Share, second: Share) -> bool:
    """Whether `first` >= `second`; what varies counts as the larger."""
    if isinstance(first, Expression) or isinstance(second, Expression):
        return isinstance(first, Expression)
    return bool(first >= second)


def _larger(first: Surface, second: Surface, share: tuple[Share, ...]) -> Surface:
    return first if not may_be(share[1]) or (may_be(share[0]) and _exceeds(share[0], share[1])) else second


def _shared(mirrored: Share, local: Share, transmitted: Share) -> Surface:
    """A surface with these shares, normalised to a sum of 1; `shares` is the inverse."""
    rest = ex.plus(local, transmitted)
    return Surface(
        reflectivity=ex.apply("ratio", mirrored, ex.plus(mirrored, rest), 0.0) if may_be(mirrored) else 0.0,
        opacity=ex.apply("ratio", local, rest, 1.0) if may_be(transmitted) else 1.0,
    )


def _opaque(base_color: Any) -> Surface:
    return Surface(base_color=base_color)


def _is_black(surface: Surface) -> bool:
    """Whether nothing but emission comes from it."""
    return (
        shares(surface) == (0.0, 1.0, 0.0) and surface.base_color == surface.specular == BLACK and not surface.layered
    )


def _roughness(node: Node, reader: NodeReader) -> Share:
    return _unit(number(reader, node, "Roughness"))


def _unit(value: Share) -> Share:
    """Clamped to 0..1, as the shaders clamp: a Value node may feed a socket anything."""
    return ex.clamped(value)


def _ior(node: Node, reader: NodeReader) -> float:
    return max(reader.number(node, "IOR"), MIN_IOR)


def _emitted(node: Node, reader: NodeReader, color_name: str, strength: str) -> Any:
    factor = number(reader, node, strength)
    return ex.as_color(ex.times(factor, color(reader, node, color_name))) if factor != 0.0 else BLACK


def _average(first: Any, weight_1: Share, second: Any, weight_2: Share) -> Any:
    if first is second or (not isinstance(first, Expression) and first == second):
        return first
    if not may_be(weight_1):
        return second if may_be(weight_2) else first
    if not may_be(weight_2):
        return first
    total = ex.plus(weight_1, weight_2)
    weighted = ex.apply("add", ex.apply("multiply", first, weight_1), ex.apply("multiply", second, weight_2))
    return ex.apply("ratio", weighted, total, first)
