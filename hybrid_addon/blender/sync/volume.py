# SPDX-License-Identifier: GPL-3.0-or-later
"""A Volume socket -> the medium that it describes: what it absorbs, scatters and emits, and a warning for all the rest.

Sources: EEVEE's gpu_shader_material_volume_*.glsl. Of a mixture the anisotropies add up by the weights of its shaders,
whatever these scatter, as in closure_eval of EEVEE's volumes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from ...scene import BLACK, RGB, Expression, Fog, FogBody, Medium
from .coverage import name_sockets
from .messages import Warnings
from .nodes import Node, Socket
from .texture import NodeReader
from .values import color, emitted, number, once

MAX_DEPTH = 32  # of Mix and Add Shaders below one another
MOST_TURNED = 0.99  # EEVEE's clamp of the anisotropy
LEAST_DENSITY = 1e-5  # below it EEVEE's Principled Volume neither absorbs nor scatters
NOTHING = Medium()


class _VariesError(Exception):
    """A value of a volume is not the same everywhere."""


def medium_from(socket: Socket, reader: NodeReader) -> Medium:
    """The medium that the volume shader linked to `socket` describes; none where nothing is linked.

    One that varies from place to place is left out, with a warning: no guess of it would look like it.
    """
    try:
        return _medium(socket, reader, 0)
    except _VariesError as error:
        reader.warn(f"{error} varies, which is not traced: rays meet nothing of the volume")
        return NOTHING


def absorption_from(socket: Socket, reader: NodeReader) -> RGB:
    """Absorption, RGB in 1/m, of the volume behind a surface; what else it does is named."""
    medium = medium_from(socket, reader)
    if any(medium.scattering):
        reader.warn("behind a surface scattering is not traced, only what the volume absorbs")
    if any(medium.emission):
        reader.warn("behind a surface emission is not traced: the volume does not glow")
    return medium.absorption


def fog_of(b_scene: bpy.types.Scene, world: Medium | None, bodies: list[FogBody]) -> Fog:
    """All fog, with EEVEE's settings: as deep as EEVEE draws it, which is no deeper than the clip planes."""
    b_eevee, b_camera = b_scene.eevee, b_scene.camera
    start, reach = b_eevee.volumetric_start, b_eevee.volumetric_end
    if not b_eevee.use_volume_custom_range and b_camera is not None and b_camera.type == "CAMERA":
        start, reach = b_camera.data.clip_start, b_camera.data.clip_end
    return Fog(
        world,
        tuple(bodies),
        reach=float(reach),
        start=float(start),
        sky=bpy.app.version >= (5, 0, 0),
        shadows=bool(b_eevee.use_shadows and b_eevee.use_volumetric_shadows),
    )


def name_fog(b_object: bpy.types.Object, ray_traced: bool, warn: Warnings) -> None:
    """Warn of an object full of fog that is ticked: there is no surface of it to trace."""
    if ray_traced:
        warn.add(f"object {b_object.name!r}: it has no surface, only a volume, which EEVEE draws: untick Ray Traced")


def is_smoke(b_object: bpy.types.Object) -> bool:
    """Whether a fluid simulation fills it."""
    return any(
        b_modifier.type == "FLUID" and b_modifier.fluid_type == "DOMAIN" and b_modifier.show_render
        for b_modifier in b_object.original.modifiers
    )


# ------------------------------------------------------------------------------------------------ shaders


def _medium(socket: Socket, reader: NodeReader, depth: int) -> Medium:
    node = socket.node()
    if node is None:
        return NOTHING
    light = emitted(reader, socket)
    if light is not None:
        return Medium(emission=_fixed(light, node))
    if node.kind in ("ShaderNodeMixShader", "ShaderNodeAddShader") and depth < MAX_DEPTH:
        return once(reader, node, lambda: _of_two(node, reader, depth + 1), "volume", NOTHING)  # type: ignore[no-any-return]
    volume = VOLUMES.get(node.kind)
    if volume is None:
        reader.warn(f"volume node {node.name!r} ({node.b_node.bl_label}) is not traced")
        return NOTHING
    name_sockets(node, reader)
    return volume(node, reader)


def _of_two(node: Node, reader: NodeReader, depth: int) -> Medium:
    """Mix and Add Shader."""
    mixed = node.kind == "ShaderNodeMixShader"
    factor = min(max(_number(node, reader, 0), 0.0), 1.0) if mixed else 0.0
    weights = (1.0 - factor, factor) if mixed else (1.0, 1.0)
    parts = [
        _scaled(_medium(node.input(i + mixed), reader, depth), weight) if weight else NOTHING
        for i, weight in enumerate(weights)
    ]
    one, other = parts
    turned = min(max(one.anisotropy + other.anisotropy, -MOST_TURNED), MOST_TURNED)
    absorbed, scattered = _sum(one.absorption, other.absorption), _sum(one.scattering, other.scattering)
    return Medium(absorbed, scattered, _sum(one.emission, other.emission), turned)


def _absorption(node: Node, reader: NodeReader) -> Medium:
    return Medium(absorption=_kept_back(_color(node, reader, "Color"), _density(node, reader)))


def _scatter(node: Node, reader: NodeReader) -> Medium:
    scattered = _times(_color(node, reader, "Color"), _density(node, reader))
    return Medium(scattering=scattered, anisotropy=_anisotropy(node, reader))


def _principled(node: Node, reader: NodeReader) -> Medium:
    """What it does not scatter of each colour it absorbs, times one minus the root of the Absorption Color."""
    density, scattered = _density(node, reader), _color(node, reader, "Color")
    absorbed = _color(node, reader, "Absorption Color")
    glow = _times(_color(node, reader, "Emission Color"), max(_number(node, reader, "Emission Strength"), 0.0))
    if density <= LEAST_DENSITY:
        return Medium(emission=glow)
    rest = _kept_back(scattered, density)
    red, green, blue = (r * max(1.0 - math.sqrt(max(c, 0.0)), 0.0) for r, c in zip(rest, absorbed, strict=True))
    return Medium((red, green, blue), _times(scattered, density), glow, _anisotropy(node, reader))


def _coefficients(node: Node, reader: NodeReader) -> Medium:
    absorbed, scattered, glow = (
        _times(_color(node, reader, f"{name} Coefficients"), 1.0) for name in ("Absorption", "Scatter", "Emission")
    )
    return Medium(absorbed, scattered, glow, _anisotropy(node, reader))


def _emission(node: Node, reader: NodeReader) -> Medium:
    strength = max(_number(node, reader, "Strength"), 0.0)
    return Medium(emission=_times(_color(node, reader, "Color"), strength) if strength else BLACK)


VOLUMES: dict[str, Callable[[Node, NodeReader], Medium]] = {
    "ShaderNodeVolumeAbsorption": _absorption,
    "ShaderNodeVolumePrincipled": _principled,
    "ShaderNodeVolumeScatter": _scatter,
    "ShaderNodeVolumeCoefficients": _coefficients,
    "ShaderNodeEmission": _emission,
}


# ------------------------------------------------------------------------------------------------ numbers


def _density(node: Node, reader: NodeReader) -> float:
    return max(_number(node, reader, "Density"), 0.0)


def _anisotropy(node: Node, reader: NodeReader) -> float:
    return min(max(_number(node, reader, "Anisotropy"), -MOST_TURNED), MOST_TURNED)


def _number(node: Node, reader: NodeReader, name: str | int) -> float:
    return float(_fixed(_followed(node, reader, name, number), node, name))


def _color(node: Node, reader: NodeReader, name: str) -> RGB:
    red, green, blue = _fixed(_followed(node, reader, name, color), node, name)
    return red, green, blue


def _followed(node: Node, reader: NodeReader, name: str | int, read: Callable[..., object]) -> object:
    """An input's value; that of a node which cannot be followed counts as one that varies."""
    known = reader.approximate
    reader.approximate = False
    value = read(reader, node, name)
    lost, reader.approximate = reader.approximate, reader.approximate or known
    if lost:
        raise _VariesError(f"{node.input(name).name!r} of volume node {node.name!r}")
    return value


def _fixed(value: object, node: Node, name: str | int = "Emission") -> Any:
    """A number or a colour that is the same everywhere."""
    if isinstance(value, Expression):
        raise _VariesError(f"{name!r} of volume node {node.name!r}")
    return value


def _kept_back(color: RGB, density: float) -> RGB:
    """What a medium of this colour takes away, each part at least nothing."""
    red, green, blue = (max(1.0 - part, 0.0) * density for part in color)
    return red, green, blue


def _times(color: RGB, factor: float) -> RGB:
    """A colour, each part at least nothing, times a number."""
    red, green, blue = (max(part, 0.0) * factor for part in color)
    return red, green, blue


def _sum(one: RGB, other: RGB) -> RGB:
    red, green, blue = np.add(one, other).tolist()
    return red, green, blue


def _scaled(medium: Medium, weight: float) -> Medium:
    absorbed, scattered, glow = (
        _times(part, weight) for part in (medium.absorption, medium.scattering, medium.emission)
    )
    return Medium(absorbed, scattered, glow, medium.anisotropy * weight)
