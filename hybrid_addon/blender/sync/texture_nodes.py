# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of textures that are formulas -> expressions, with the formulas in `procedural`; and skies. See `values`."""

from __future__ import annotations

from typing import Any

import bpy

from ... import expressions as ex
from ...procedural import cells
from ...procedural.gabor import INTENSITY, PHASE, VALUE
from ...scene import Expression, Texture, Value
from .image import MISSING
from .nodes import Node
from .sky import baked, settings_of
from .texture import NodeReader
from .values import NODES, color, default_coordinates, number, once, value_of, vector

VORONOI_HASH = "PCG" if bpy.app.version >= (5, 0, 0) else "LOOKUP3"


def _checker(node: Node, output: str, reader: NodeReader) -> Value:
    point, scale = default_coordinates(reader, node), number(reader, node, "Scale")
    if output != "Color":
        return ex.apply("checker_factor", point, scale)
    return ex.apply("checker", point, color(reader, node, "Color1"), color(reader, node, "Color2"), scale)


def _gradient(node: Node, output: str, reader: NodeReader) -> Value:
    kind = {"QUADRATIC_SPHERE": "QUADRATIC_SPHERE"}.get(node.b_node.gradient_type, node.b_node.gradient_type)
    return ex.apply("gradient", default_coordinates(reader, node), data=kind)


def _numbers(reader: NodeReader, node: Node, *names: str) -> list[Any]:
    """Of these inputs; 0 for those that the node's settings hide, and do not use."""
    return [number(reader, node, name) if node.has_input(name) else 0.0 for name in names]


def _place(reader: NodeReader, node: Node, dimensions: int) -> tuple[Value, Value]:
    """The point and its fourth coordinate; 0 for what the node's dimensions leave out."""
    point = default_coordinates(reader, node) if dimensions > 1 else 0.0
    return point, number(reader, node, "W") if dimensions in (1, 4) else 0.0


def _noise(node: Node, output: str, reader: NodeReader) -> Value:
    b_node, dimensions = node.b_node, int(node.b_node.noise_dimensions[0])
    names = ("Scale", "Detail", "Roughness", "Lacunarity", "Offset", "Gain", "Distortion")
    inputs = (*_place(reader, node, dimensions), *_numbers(reader, node, *names))
    operation = "noise_color" if output == "Color" else "noise"
    return ex.apply(operation, *inputs, data=(dimensions, b_node.noise_type, bool(b_node.normalize)))


def _voronoi(node: Node, output: str, reader: NodeReader) -> Value:
    b_node, dimensions = node.b_node, int(node.b_node.voronoi_dimensions[0])
    names = ("Scale", "Detail", "Roughness", "Lacunarity", "Smoothness", "Exponent", "Randomness")
    data = dimensions, b_node.feature, b_node.distance, bool(b_node.normalize), VORONOI_HASH

    def everything() -> Value:
        return ex.apply("voronoi", *_place(reader, node, dimensions), *_numbers(reader, node, *names), data=data)

    rows = {"Distance": cells.DISTANCE, "Color": cells.COLOR, "Position": cells.POSITION, "W": cells.W}
    return ex.apply("rows", once(reader, node, everything), data=rows.get(output, cells.RADIUS))


def _gabor(node: Node, output: str, reader: NodeReader) -> Value:
    def everything() -> Value:
        names = ("Scale", "Frequency", "Anisotropy")
        numbers, dimensions = _numbers(reader, node, *names), int(node.b_node.gabor_type[0])
        angle = value_of(reader, node.identified("Orientation 2D"), "VALUE")
        direction = value_of(reader, node.identified("Orientation 3D"), "VECTOR")
        return ex.apply("gabor", default_coordinates(reader, node), *numbers, angle, direction, data=dimensions)

    rows = {"Phase": PHASE, "Intensity": INTENSITY}
    return ex.apply("rows", once(reader, node, everything), data=rows.get(output, VALUE))


def _wave(node: Node, output: str, reader: NodeReader) -> Value:
    b_node = node.b_node
    names = ("Scale", "Distortion", "Detail", "Detail Scale", "Detail Roughness", "Phase Offset")
    direction = b_node.bands_direction if b_node.wave_type == "BANDS" else b_node.rings_direction
    data = b_node.wave_type, direction, b_node.wave_profile
    return ex.apply("wave", default_coordinates(reader, node), *_numbers(reader, node, *names), data=data)


def _magic(node: Node, output: str, reader: NodeReader) -> Value:
    numbers = _numbers(reader, node, "Scale", "Distortion")
    tint = ex.apply("magic", default_coordinates(reader, node), *numbers, data=node.b_node.turbulence_depth)
    return tint if output == "Color" else ex.apply("average", tint)


def _brick(node: Node, output: str, reader: NodeReader) -> Value:
    b_node = node.b_node
    names = ("Scale", "Mortar Size", "Mortar Smooth", "Bias", "Brick Width", "Row Height")
    inputs = (default_coordinates(reader, node), *_numbers(reader, node, *names))
    data = b_node.offset, b_node.offset_frequency, b_node.squash, b_node.squash_frequency
    if output != "Color":
        return ex.apply("brick_factor", *inputs, data=data)
    colors = (color(reader, node, name) for name in ("Color1", "Color2", "Mortar"))
    return ex.apply("brick", *colors, *inputs, data=data)


def _white_noise(node: Node, output: str, reader: NodeReader) -> Value:
    dimensions = int(node.b_node.noise_dimensions[0])
    point = vector(reader, node, "Vector") if dimensions > 1 else 0.0
    w = number(reader, node, "W") if dimensions in (1, 4) else 0.0
    return ex.apply("white_noise_color" if output == "Color" else "white_noise", point, w, data=dimensions)


def _sky(node: Node, output: str, reader: NodeReader) -> Value | None:
    image = baked(settings_of(node.b_node)) if reader.images.looked_at else MISSING
    if isinstance(image, str):
        if reader.unseen is None:
            return None
        reader.give_up(f"node {node.name!r}: {image}; the world's viewport colour is used")
        return reader.unseen
    linked = node.has_input("Vector") and node.input("Vector").node() is not None
    direction = vector(reader, node, "Vector") if linked else Expression("attribute", (), "generated")
    return Expression("image", (ex.apply("equirect", direction),), Texture("sky", image, extension="SPHERE"))


NODES.update(
    {
        "ShaderNodeTexChecker": _checker,
        "ShaderNodeTexGradient": _gradient,
        "ShaderNodeTexNoise": _noise,
        "ShaderNodeTexVoronoi": _voronoi,
        "ShaderNodeTexGabor": _gabor,
        "ShaderNodeTexWave": _wave,
        "ShaderNodeTexMagic": _magic,
        "ShaderNodeTexBrick": _brick,
        "ShaderNodeTexWhiteNoise": _white_noise,
        "ShaderNodeTexSky": _sky,
    }
)
