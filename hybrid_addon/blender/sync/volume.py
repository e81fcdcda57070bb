# SPDX-License-Identifier: GPL-3.0-or-later
"""A material's Volume socket -> absorption, RGB in 1/m: what Beer-Lambert's law needs, and a warning for all the rest.

Sources: node_shader_gpu_volume_principled, cycles/kernel/svm/closure.h (Principled Volume: what it does not scatter of
each colour it absorbs, times one minus the root of the Absorption Color).
"""

from __future__ import annotations

import math
from collections.abc import Callable

from ...scene import BLACK, RGB
from .coverage import name_sockets
from .nodes import Node, Socket
from .texture import NodeReader
from .values import once

MAX_DEPTH = 32  # of Mix and Add Shaders below one another


def absorption_from(socket: Socket, reader: NodeReader, depth: int = 0) -> RGB:
    """Absorption of the volume shader linked to `socket`; none where nothing is linked."""
    node = socket.node()
    if node is None:
        return BLACK
    if node.kind in ("ShaderNodeMixShader", "ShaderNodeAddShader") and depth < MAX_DEPTH:
        return once(reader, node, lambda: _of_two(node, reader, depth + 1), "volume", BLACK)  # type: ignore[no-any-return]
    volume = VOLUMES.get(node.kind)
    if volume is None:
        reader.warn(f"volume node {node.name!r} ({node.b_node.bl_label}) is not traced")
        return BLACK
    name_sockets(node, reader)
    return volume(node, reader)


def _of_two(node: Node, reader: NodeReader, depth: int) -> RGB:
    """Mix and Add Shader."""
    mixed = node.kind == "ShaderNodeMixShader"
    factor = min(max(reader.number(node, 0), 0.0), 1.0) if mixed else 0.0
    weights = (1.0 - factor, factor) if mixed else (1.0, 1.0)
    first, second = (absorption_from(node.input(i + mixed), reader, depth) for i in (0, 1))
    return _combined(first, weights[0], second, weights[1])


def _absorption(node: Node, reader: NodeReader) -> RGB:
    return _kept_back(reader.color(node, "Color"), _density(node, reader))


def _principled(node: Node, reader: NodeReader) -> RGB:
    density = _density(node, reader)
    if density == 0.0:
        return BLACK
    if any(reader.color(node, "Color")):
        reader.warn(f"volume node {node.name!r}: scattering is not traced, only what it absorbs")
    rest = _kept_back(reader.color(node, "Color"), density)
    red, green, blue = (math.sqrt(max(part, 0.0)) for part in reader.color(node, "Absorption Color"))
    kept = _kept_back((red, green, blue), 1.0)
    return rest[0] * kept[0], rest[1] * kept[1], rest[2] * kept[2]


def _scatter(node: Node, reader: NodeReader) -> RGB:
    reader.warn(f"volume node {node.name!r}: scattering is not traced")
    return BLACK


def _coefficients(node: Node, reader: NodeReader) -> RGB:
    if not node.input("Absorption Coefficients").is_constant():
        reader.warn(f"volume node {node.name!r}: linked Absorption Coefficients are not followed; there are none")
        return BLACK
    red, green, blue = (max(part, 0.0) for part in node.input("Absorption Coefficients").value())
    return red, green, blue


VOLUMES: dict[str, Callable[[Node, NodeReader], RGB]] = {
    "ShaderNodeVolumeAbsorption": _absorption,
    "ShaderNodeVolumePrincipled": _principled,
    "ShaderNodeVolumeScatter": _scatter,
    "ShaderNodeVolumeCoefficients": _coefficients,
}


def _density(node: Node, reader: NodeReader) -> float:
    return max(reader.number(node, "Density"), 0.0)


def _kept_back(color: RGB, density: float) -> RGB:
    """What a medium of this colour takes away, each part at least nothing."""
    red, green, blue = (max(1.0 - part, 0.0) * density for part in color)
    return red, green, blue


def _combined(first: RGB, weight_1: float, second: RGB, weight_2: float) -> RGB:
    red, green, blue = (a * weight_1 + b * weight_2 for a, b in zip(first, second, strict=True))
    return red, green, blue
