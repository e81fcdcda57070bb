# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups of inputs of shader nodes, as fields of scene.Surface: highlights, coats, sheens, thin films, brushed metal.

EEVEE ignores the last two; they are Cycles' (kernel/svm/closure.h).
"""

from __future__ import annotations

import math
from typing import Any

import bpy

from ... import expressions as ex
from ...scene import Expression
from .image import SRGB_WORKING_SPACES, working_space
from .nodes import Node, is_thin_wall
from .texture import NodeReader
from .values import NORMAL, color, number, vector

FILMS_ON_METAL = bpy.app.version >= (5, 0, 0)
"""Blender 4.5 has films on dielectrics alone."""
STEEPEST = 0.99
"""Glossy's anisotropy is at most this."""
RADIUS = 4.0 * math.pi if bpy.app.version >= (5, 0, 0) else 1.0
"""By what EEVEE multiplies the radii of subsurface scattering: of 5.2 it is measured, like Cycles' of this version."""
LEAST_STEP = 2.0**-20
"""An IOR of 1 below a film counts as this much more: exactly 1 means nothing is there, but a soap bubble reflects."""


def film(node: Node, reader: NodeReader) -> dict[str, Any]:
    """Of the thin film, if there is one."""
    if not node.has_input("Thin Film Thickness"):
        return {}
    thickness = number(reader, node, "Thin Film Thickness")
    if not isinstance(thickness, Expression) and thickness <= 0.0:
        return {}
    if working_space() not in SRGB_WORKING_SPACES:
        reader.warn(f"node {node.name!r}: its thin film has the colours of Rec. 709, not of {working_space()}", 2)
    return {"film": thickness, "film_ior": number(reader, node, "Thin Film IOR")}


def index(ior: Any, film: dict[str, Any]) -> Any:
    """The IOR of what is below a film."""
    return 1.0 + LEAST_STEP if film and ior == 1.0 else ior


def principled_grain(node: Node, reader: NodeReader, anisotropy: str, rotation: str) -> dict[str, Any]:
    """Of an anisotropy of 0 to 1, as Principled and Metallic have it: alpha x aspect across, / aspect along."""
    share = ex.clamped(number(reader, node, anisotropy))
    return _grain(node, reader, rotation, ex.apply("root", ex.rest(ex.times(0.9, share))) if share != 0.0 else 1.0)


def glossy_grain(node: Node, reader: NodeReader) -> dict[str, Any]:
    """Of Glossy's from -1 to 1: alpha (1 - a) along and / (1 - a) across; below 0 / (1 + a) and (1 + a)."""
    share = ex.apply("clamp", number(reader, node, "Anisotropy"), -STEEPEST, STEEPEST)
    above, below = ex.rest(ex.apply("maximum", share, 0.0)), ex.plus(1.0, ex.apply("minimum", share, 0.0))
    return _grain(node, reader, "Rotation", ex.apply("divide", below, above) if share != 0.0 else 1.0)


def _grain(node: Node, reader: NodeReader, rotation: str, stretch: Any) -> dict[str, Any]:
    if stretch == 1.0:
        return {}
    tangent, turns = _tangent(node, reader), number(reader, node, rotation)
    if turns != 0.0:
        tangent = ex.apply("turned_about", tangent, 0.0, NORMAL, ex.times(math.tau, turns))
    return {"stretch": stretch, "tangent": tangent}


def _tangent(node: Node, reader: NodeReader) -> Any:
    """What is linked to the Tangent, else the direction around the object's Z axis (Cycles, primitive_tangent)."""
    if node.input("Tangent").node() is not None:
        given = vector(reader, node, "Tangent")
        if isinstance(given, Expression):
            return given
        return ex.apply("add", ex.apply("multiply", NORMAL, 0.0), given)
    return ex.apply("first_three", Expression("attribute", (), "around:Z"))


# ------------------------------------------------------------------------------------------------ other layers


def specular(node: Node, reader: NodeReader, ior: Any) -> Any:
    """Reflectance at normal incidence, at most 1; Specular IOR Level 0.5 leaves it as the IOR has it."""
    if isinstance(ior, Expression):
        amplitude = ex.apply("divide", ex.apply("subtract", ior, 1.0), ex.apply("add", ior, 1.0))
        twice: Any = ex.times(ex.apply("multiply", amplitude, amplitude), 2.0)
    else:
        twice = ((ior - 1.0) / (ior + 1.0)) ** 2 * 2.0
    f0 = ex.times(twice, number(reader, node, "Specular IOR Level"))
    return ex.as_color(ex.apply("minimum", ex.times(color(reader, node, "Specular Tint"), f0), 1.0))


def coat(node: Node, reader: NodeReader) -> dict[str, Any]:
    """Of the coat, if there is one."""
    weight = number(reader, node, "Coat Weight")
    if not isinstance(weight, Expression) and weight <= 0.0:
        return {}
    return {
        "coat": weight,
        "coat_roughness": ex.clamped(number(reader, node, "Coat Roughness")),
        "coat_ior": max(reader.number(node, "Coat IOR"), 1.0),
        "coat_tint": color(reader, node, "Coat Tint"),
    }


def sheen(node: Node, reader: NodeReader) -> dict[str, Any]:
    """Of the sheen, if there is one."""
    weight = number(reader, node, "Sheen Weight")
    if not isinstance(weight, Expression) and weight <= 0.0:
        return {}
    return {
        "sheen": weight,
        "sheen_roughness": ex.clamped(number(reader, node, "Sheen Roughness")),
        "sheen_tint": color(reader, node, "Sheen Tint"),
    }


def subsurface(node: Node, reader: NodeReader, weight: Any, prefix: str = "") -> dict[str, Any]:
    """Of the scattering below the surface, if there is any; weight: its share of the diffuse light."""
    scale = ex.apply("maximum", number(reader, node, f"{prefix}Scale"), 0.0)
    if weight == 0.0 or scale == 0.0:
        return {}
    radius = ex.apply("multiply", vector(reader, node, f"{prefix}Radius"), ex.times(scale, RADIUS))
    return {"scatter": weight, "scatter_radius": ex.as_color(radius)}


def translucency(node: Node, reader: NodeReader) -> Any:
    """Share of the diffuse light of a thin wall's subsurface that comes from its other side, as in EEVEE."""
    if not is_thin_wall(node):
        return 0.0
    weight = ex.clamped(number(reader, node, "Subsurface Weight"))
    forward = ex.clamped(ex.times(0.5, ex.plus(1.0, number(reader, node, "Subsurface Anisotropy"))))
    return ex.times(weight, forward)
