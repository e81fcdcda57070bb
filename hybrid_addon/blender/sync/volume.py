# SPDX-License-Identifier: GPL-3.0-or-later
"""A Volume socket -> the medium that it describes: what it absorbs, scatters and emits, and a warning for all the rest.

Sources: EEVEE's gpu_shader_material_volume_*.glsl. Of a mixture the anisotropies add up by the weights of its shaders,
whatever these scatter, as in closure_eval of EEVEE's volumes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ... import expressions as ex
from ...procedural.spectra import working_space
from ...scene import BLACK, RGB, Expression, Float64, Fog, FogBody, Medium, Value
from .coverage import name_sockets
from .messages import Warnings
from .nodes import Node, Socket
from .texture import NodeReader
from .values import NODES, attribute, color, emitted, number, once

MAX_DEPTH = 32  # of Mix and Add Shaders below one another
MOST_TURNED = 0.99  # EEVEE's clamp of the anisotropy
LEAST_DENSITY = 1e-5  # below it EEVEE's Principled Volume neither absorbs nor scatters
LEAST_BLACKBODY = 1e-3  # below it its heat does not glow
STEFAN_BOLTZMANN = 5.670373e-8 * 1e-6 / math.pi  # W/(m^2 K^4) over pi, as EEVEE scales it
NOTHING = Medium()


def medium_from(socket: Socket, reader: NodeReader, grids: Mapping[str, int] | None = None) -> Medium:
    """The medium that the volume shader linked to `socket` describes; none where nothing is linked.

    grids : of the object that it fills, by name how many numbers each has in a voxel.
    """
    known, reader.approximate, reader.grids = reader.approximate, False, grids or {}
    try:
        medium = _medium(socket, reader, 0)
    finally:
        reader.grids = None
    lost, reader.approximate = reader.approximate, reader.approximate or known
    if lost:  # no guess of it would look like it
        reader.warn("it is left out of what rays meet: its volume cannot be followed")
        return NOTHING
    return medium


def default_medium(grids: Mapping[str, int]) -> Medium:
    """Of a volume object without material: a new Principled Volume (BKE_material_default_volume)."""
    density = _grid(grids, "density", 1.0)
    half = ex.as_color(ex.times(0.5, density))
    return Medium(half, half)


def absorption_from(socket: Socket, reader: NodeReader) -> RGB:
    """Absorption, RGB in 1/m, of the volume behind a surface; what else it does is named."""
    medium = medium_from(socket, reader)
    if medium.scatters:
        reader.warn("behind a surface scattering is not traced, only what the volume absorbs")
    if any(medium.emission) if isinstance(medium.emission, tuple) else True:
        reader.warn("behind a surface emission is not traced: the volume does not glow")
    if not isinstance(medium.absorption, tuple):
        reader.warn("what its volume absorbs varies, which is not traced behind a surface: it absorbs nothing")
        return BLACK
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
        steps=int(b_eevee.volumetric_samples),
    )


def name_fog(b_object: bpy.types.Object, ray_traced: bool, warn: Warnings) -> None:
    """Warn of an object full of fog that is ticked: there is no surface of it to trace."""
    if ray_traced:
        warn.add(f"object {b_object.name!r}: it has no surface, only a volume, which EEVEE draws: untick Ray Traced")


def density_scale(b_object: bpy.types.Object, matrix: Float64) -> float:
    """What the medium of an object at `matrix` (4, 4) is multiplied by: a volume object's density is as dense as it was
    made, however large it is drawn, unless it is to be dense by the world's metres (BKE_volume_density_scale)."""
    if b_object.type != "VOLUME" or b_object.data.render.space != "OBJECT":
        return 1.0
    length = float(np.linalg.norm(matrix[:3, :3].sum(axis=1))) / math.sqrt(3.0)
    return 1.0 / length if length > 0.0 else 1.0


# ------------------------------------------------------------------------------------------------ shaders


def _medium(socket: Socket, reader: NodeReader, depth: int) -> Medium:
    node = socket.node()
    if node is None:
        return NOTHING
    light = emitted(reader, socket)
    if light is not None:
        return Medium(emission=light)
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
    factor = ex.clamped(number(reader, node, 0)) if mixed else 0.0
    weights = (ex.rest(factor), factor) if mixed else (1.0, 1.0)
    one, other = (
        NOTHING if weight == 0.0 else _weighted(_medium(node.input(i + mixed), reader, depth), weight)
        for i, weight in enumerate(weights)
    )
    return Medium(
        _sum(one.absorption, other.absorption),
        _sum(one.scattering, other.scattering),
        _sum(one.emission, other.emission),
        _within(ex.plus(one.anisotropy, other.anisotropy)),
    )


def _absorption(node: Node, reader: NodeReader) -> Medium:
    return Medium(absorption=_kept_back(color(reader, node, "Color"), _density(node, reader)))


def _scatter(node: Node, reader: NodeReader) -> Medium:
    scattered = _times(color(reader, node, "Color"), _density(node, reader))
    return Medium(scattering=scattered, anisotropy=_anisotropy(node, reader))


def _principled(node: Node, reader: NodeReader) -> Medium:
    """What it does not scatter of each colour it absorbs, times one minus the root of the Absorption Color.

    Grids that are not there count as 1, that of the temperature as 0; where none is asked for, each counts as 1.
    """
    density = _density(node, reader)
    density = ex.times(density, ex.apply("greater", density, LEAST_DENSITY))
    density = _at_least_nothing(ex.times(density, _named_grid(node, reader, "Density Attribute", 1.0)))
    density = ex.times(density, ex.apply("greater", density, LEAST_DENSITY))
    scattered = _at_least_nothing(color(reader, node, "Color"))
    scattered = ex.times(scattered, _named_grid(node, reader, "Color Attribute", 1.0))
    absorbed = ex.apply("root", _at_least_nothing(color(reader, node, "Absorption Color")))
    glow = _times(color(reader, node, "Emission Color"), _at_least_nothing(number(reader, node, "Emission Strength")))
    lost = ex.times(_kept_back(scattered, density), _at_least_nothing(ex.rest(absorbed)))
    return Medium(
        ex.as_color(lost), _times(scattered, density), _sum(glow, _heat(node, reader)), _anisotropy(node, reader)
    )


def _heat(node: Node, reader: NodeReader) -> Any:
    """What a Principled Volume glows by its temperature: a black body's colour, by Stefan and Boltzmann's law."""
    intensity = number(reader, node, "Blackbody Intensity")
    if not isinstance(intensity, Expression) and intensity <= LEAST_BLACKBODY:
        return BLACK
    kelvin = _at_least_nothing(_named_grid(node, reader, "Temperature Attribute", 0.0))
    kelvin = _at_least_nothing(ex.times(number(reader, node, "Temperature"), kelvin))
    if kelvin == 0.0:
        return BLACK
    squared = ex.times(kelvin, kelvin)
    power = ex.times(STEFAN_BOLTZMANN, ex.apply("mix", intensity, 1.0, ex.times(squared, squared)))
    power = ex.times(power, ex.apply("greater", power, LEAST_DENSITY))
    power = ex.times(power, ex.apply("greater", intensity, LEAST_BLACKBODY))
    body = ex.apply("blackbody", kelvin, data=working_space(reader.frame.working_space))
    return _times(ex.times(body, color(reader, node, "Blackbody Tint")), power)


def _coefficients(node: Node, reader: NodeReader) -> Medium:
    absorbed, scattered, glow = (
        _at_least_nothing(color(reader, node, f"{name} Coefficients")) for name in ("Absorption", "Scatter", "Emission")
    )
    return Medium(absorbed, scattered, glow, _anisotropy(node, reader))


def _emission(node: Node, reader: NodeReader) -> Medium:
    strength = _at_least_nothing(number(reader, node, "Strength"))
    return Medium(emission=_times(color(reader, node, "Color"), strength))


VOLUMES: dict[str, Callable[[Node, NodeReader], Medium]] = {
    "ShaderNodeVolumeAbsorption": _absorption,
    "ShaderNodeVolumePrincipled": _principled,
    "ShaderNodeVolumeScatter": _scatter,
    "ShaderNodeVolumeCoefficients": _coefficients,
    "ShaderNodeEmission": _emission,
}


# ------------------------------------------------------------------------------------------------ grids


MISSING_GRIDS = {"Density": 1.0, "Color": 1.0, "Flame": 0.0, "Temperature": 0.0}
"""What Volume Info tells of a grid that is not there, as in EEVEE."""


def _volume_info(node: Node, output: str, reader: NodeReader) -> Value | None:
    """A grid of the object; on a surface there is none, and in EEVEE all are 0."""
    if output not in MISSING_GRIDS:
        return None
    found = 0.0 if reader.grids is None else _grid(reader.grids, output.lower(), MISSING_GRIDS[output])
    return ex.as_color(found) if output == "Color" else found  # type: ignore[no-any-return]


NODES["ShaderNodeVolumeInfo"] = _volume_info


def _named_grid(node: Node, reader: NodeReader, name: str, missing: float) -> Any:
    """The grid that an input names, `missing` if the object has none of that name; 1 if it names none."""
    wanted = str(node.input(name).value() or "") if node.has_input(name) else ""
    found = _grid(reader.grids or {}, wanted, missing) if wanted else 1.0
    return found if name == "Color Attribute" or not isinstance(found, Expression) else _first(found)


def _grid(grids: Mapping[str, int], name: str, missing: float) -> Any:
    return attribute(f"{ex.VOLUME}:{name}") if name in grids else missing


def _first(value: Any) -> Any:
    return ex.apply("channel", value, data=0)


# ------------------------------------------------------------------------------------------------ numbers


def _density(node: Node, reader: NodeReader) -> Any:
    return _at_least_nothing(number(reader, node, "Density"))


def _anisotropy(node: Node, reader: NodeReader) -> Any:
    return _within(number(reader, node, "Anisotropy"))


def _within(turned: Value) -> Any:
    return ex.apply("clamp", turned, -MOST_TURNED, MOST_TURNED)


def _at_least_nothing(value: Value) -> Any:
    return ex.apply("maximum", value, 0.0)


def _kept_back(tint: Value, density: Value) -> Any:
    """What a medium of this colour takes away, each part at least nothing."""
    return ex.as_color(ex.times(_at_least_nothing(ex.rest(tint)), density))  # type: ignore[arg-type]


def _times(tint: Value, factor: Value) -> Any:
    """A colour, each part at least nothing, times a number."""
    return ex.as_color(ex.times(_at_least_nothing(tint), factor))


def _sum(one: Value, other: Value) -> Any:
    return other if one == BLACK else one if other == BLACK else ex.apply("add", one, other)


def _weighted(medium: Medium, weight: Value) -> Medium:
    """As one of the shaders of a mixture, of which the anisotropies add up, too."""
    return replace(scaled(medium, weight), anisotropy=ex.times(medium.anisotropy, weight))


def scaled(medium: Medium, factor: Value) -> Medium:
    """As much of it."""
    parts = [_times(part, factor) for part in (medium.absorption, medium.scattering, medium.emission)]
    return Medium(parts[0], parts[1], parts[2], medium.anisotropy)
