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
from ...scene.surfaces import MIN_IOR
from . import lobes
from . import object_nodes as _objects  # noqa: F401  (these three add their nodes to the table of `values`)
from . import texture_nodes as _textures  # noqa: F401
from . import value_nodes as _registered  # noqa: F401
from .conductor import conductor_tints
from .coverage import name_sockets
from .nodes import Node, Socket, is_thin_wall
from .sums import added, each, may_be, mixed, weighted
from .texture import NodeReader
from .values import color, emitted, number, once, value_of, vector

Share = Any  # a float or an expression

MAX_DEPTH = 32  # of Mix and Add Shaders below one another


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


def _normal(node: Node, reader: NodeReader, name: str = "Normal") -> Expression | None:
    """What is linked to the shader's Normal, if it can be followed."""
    if not node.has_input(name) or node.input(name).node() is None:
        return None
    return ex.held(vector(reader, node, name))


# ------------------------------------------------------------------------------------------------ single shaders


def _principled(node: Node, reader: NodeReader) -> Surface:
    alpha = _unit(number(reader, node, "Alpha"))
    surface = _principled_body(node, reader, alpha)
    normal, coat_normal = _normal(node, reader), _normal(node, reader, "Coat Normal")
    coat, through = lobes.coat(node, reader), lobes.translucency(node, reader)
    if not (coat and normal is not coat_normal) and not may_be(through):
        return surface
    parts, changed = [], dict[str, Any](normal=normal)
    if coat and normal is not coat_normal:
        parts.append((alpha, replace(_opaque(BLACK), layered=True, normal=coat_normal, **coat)))
        changed["coat_shows"] = False
    if may_be(through):
        passes = Surface(base_color=color(reader, node, "Base Color"), translucent=True, normal=normal)
        body = (
            ex.rest(_unit(number(reader, node, "Metallic"))),
            ex.rest(_unit(number(reader, node, "Transmission Weight"))),
        )
        parts.append((ex.times(alpha, *body, through), passes))

    def without(closure: Surface) -> Surface:
        """A closure without what has closures of its own."""
        return replace(closure, base_color=ex.as_color(ex.times(ex.rest(through), closure.base_color)), **changed)

    return weighted((1.0, each(surface, lambda closure: without(closure) if closure.layered else closure)), *parts)


def _principled_body(node: Node, reader: NodeReader, alpha: Share) -> Surface:
    """The node with this alpha."""
    base_color = color(reader, node, "Base Color")
    metallic, transmission = _unit(number(reader, node, "Metallic")), _unit(number(reader, node, "Transmission Weight"))
    film = lobes.film(node, reader)
    ior = lobes.index(_ior(node, reader), film)
    if metallic == 1.0 and not lobes.FILMS_ON_METAL:
        film = {}
    glass, straight = ex.times(alpha, ex.rest(metallic), transmission), ex.rest(alpha)
    thin = is_thin_wall(node) and may_be(glass)
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
        specular=lobes.specular(node, reader, ior),
        roughness=_roughness(node, reader),
        emission=ex.as_color(ex.times(alpha, _emitted(node, reader, "Emission Color", "Emission Strength"))),
        reflection_tint=clear if may_be(metallic) else WHITE,
        edge_tint=color(reader, node, "Specular Tint"),
        transmission_tint=tint if bent else WHITE,
        ior=ior if thin or bent or not may_be(straight) else 1.0,
        thin=thin,
        **film,
        multiscatter=_multiscatter(node),
        **lobes.principled_grain(node, reader, "Anisotropic", "Anisotropic Rotation"),
        **lobes.coat(node, reader),
        **lobes.sheen(node, reader),
        **(
            {}
            if is_thin_wall(node) or not may_be(local)
            else lobes.subsurface(node, reader, _unit(number(reader, node, "Subsurface Weight")), "Subsurface ")
        ),
    )


def _multiscatter(node: Node) -> bool:
    return bool(node.b_node.distribution == "MULTI_GGX")


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
        multiscatter=_multiscatter(node),
        **film,
    )


def _refraction(node: Node, reader: NodeReader) -> Surface:
    return replace(_glass(node, reader), reflection_tint=WHITE, interface_tint=BLACK, multiscatter=True)


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
        "multiscatter": _multiscatter(node),
    }
    return replace(_shared(1.0, 0.0, 0.0), layered=True, **fields)


def _diffuse(node: Node, reader: NodeReader) -> Surface:
    return _opaque(color(reader, node, "Color"))


def _subsurface(node: Node, reader: NodeReader) -> Surface:
    return replace(_diffuse(node, reader), **lobes.subsurface(node, reader, 1.0))


def _hair(node: Node, reader: NodeReader) -> Surface:
    """EEVEE draws hair as Diffuse BSDF of its colour, whether that is shown or melanin is."""
    return _opaque(ex.as_color(value_of(reader, node.identified("Color"), "RGBA")))


def _translucent(node: Node, reader: NodeReader) -> Surface:
    return replace(_diffuse(node, reader), translucent=True)


def _sheen(node: Node, reader: NodeReader) -> Surface:
    """Principled's sheen over nothing. EEVEE draws a Diffuse BSDF instead."""
    sheen = {"sheen": 1.0, "sheen_tint": color(reader, node, "Color"), "sheen_roughness": _roughness(node, reader)}
    return replace(_opaque(BLACK), layered=True, **sheen)


def _specular_bsdf(node: Node, reader: NodeReader) -> Surface:
    """EEVEE's own (gpu_shader_material_eevee_specular.glsl): a sum, in which nothing takes light from another."""
    clear, coat = (_unit(number(reader, node, name)) for name in ("Transparency", "Clear Coat"))
    alpha, normal = ex.rest(clear), _normal(node, reader)
    black = replace(_opaque(BLACK), layered=True)
    gloss = replace(
        black,
        specular=ex.as_color(_unit(color(reader, node, "Specular"))),
        roughness=_roughness(node, reader),
        multiscatter=False,
        normal=normal,
    )
    varnish = replace(
        black,
        coat=1.0,
        coat_roughness=_unit(number(reader, node, "Clear Coat Roughness")),
        normal=_normal(node, reader, "Clear Coat Normal"),
    )
    return weighted(
        (1.0, replace(_opaque(BLACK), emission=color(reader, node, "Emissive Color"))),
        (alpha, replace(_opaque(color(reader, node, "Base Color")), normal=normal)),
        (alpha, gloss),
        (ex.times(0.25, alpha, coat), varnish),
        (clear, replace(_shared(0.0, 0.0, 1.0), ior=1.0)),
    )


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
    "ShaderNodeBsdfHair": _hair,
    "ShaderNodeBsdfHairPrincipled": _hair,
    "ShaderNodeBsdfRayPortal": _transparent,
    "ShaderNodeSubsurfaceScattering": _subsurface,
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
    return mixed(first, second, factor)


def _add(node: Node, reader: NodeReader, depth: int) -> Surface:
    return added(*(surface_from(node.input(position), reader, depth) for position in (0, 1)))


COMBINED = {"ShaderNodeMixShader": _mix, "ShaderNodeAddShader": _add}


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
