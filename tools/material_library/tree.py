# SPDX-License-Identifier: GPL-3.0-or-later
"""A node tree in few words, the same for Blender 4.5 and 5.x, which name some sockets differently ("Fac", "Factor")."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

import bpy

Input = Any
"""For a socket: a number, a tuple of three (a colour or a vector), an output to link, or a node (its first output)."""


class Tree:
    """The nodes of a new material; methods make nodes and return them, or the output that is meant."""

    def __init__(self, name: str) -> None:
        self.material = bpy.data.materials.new(name)
        if not self.material.node_tree:
            self.material.use_nodes = True
        self.b_tree = self.material.node_tree
        self.b_tree.nodes.clear()
        self.output = self.b_tree.nodes.new("ShaderNodeOutputMaterial")

    def node(self, kind: str, inputs: Mapping[Any, Input] | None = None, **settings: Any) -> Any:
        """A node "ShaderNode" + `kind`; `inputs` by name or place. KeyError for an input that it has not."""
        b_node = self.b_tree.nodes.new(f"ShaderNode{kind}")
        for key, value in settings.items():
            setattr(b_node, key, value)
        for key, value in (inputs or {}).items():
            self.plug(b_node.inputs[key], value)
        return b_node

    def plug(self, socket: Any, value: Input) -> None:
        """Give a socket its value, or link it."""
        if isinstance(value, bpy.types.Node):
            value = value.outputs[0]
        if isinstance(value, bpy.types.NodeSocket):
            self.b_tree.links.new(value, socket)
        elif isinstance(value, tuple) and socket.type == "RGBA":
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value

    def optional(self, b_node: Any, name: str, value: Input) -> Any:
        """Set an input that not every version of Blender has; the node."""
        if name in b_node.inputs:
            self.plug(b_node.inputs[name], value)
        return b_node

    def principled(self, color: Input = (0.8, 0.8, 0.8), **inputs: Input) -> Any:
        """A Principled BSDF; inputs by their names, with underscores: Coat_Weight=1."""
        named = {name.replace("_", " "): value for name, value in inputs.items()}
        return self.node("BsdfPrincipled", {"Base Color": color, **named})

    def glossy(self, color: Input, roughness: Input, **inputs: Input) -> Any:
        """A Glossy BSDF."""
        return self.node("BsdfAnisotropic", {"Color": color, "Roughness": roughness, **inputs})

    def diffuse(self, color: Input, **inputs: Input) -> Any:
        """A Diffuse BSDF."""
        return self.node("BsdfDiffuse", {"Color": color, **inputs})

    def transparent(self, color: Input = (1.0, 1.0, 1.0)) -> Any:
        """A Transparent BSDF."""
        return self.node("BsdfTransparent", {"Color": color})

    def emission(self, color: Input, strength: Input = 1.0) -> Any:
        """An Emission shader."""
        return self.node("Emission", {"Color": color, "Strength": strength})

    def mix(self, factor: Input, first: Any, second: Any) -> Any:
        """A Mix Shader."""
        return self.node("MixShader", {0: factor, 1: first, 2: second})

    def add(self, first: Any, second: Any) -> Any:
        """An Add Shader."""
        return self.node("AddShader", {0: first, 1: second})

    def math(self, operation: str, first: Input, second: Input = 0.5, clamp: bool = False) -> Any:
        """A Math node."""
        return self.node("Math", {0: first, 1: second}, operation=operation, use_clamp=clamp)

    def vector(self, operation: str, first: Input, second: Input = (0.0, 0.0, 0.0)) -> Any:
        """A Vector Math node's vector."""
        return self.node("VectorMath", {0: first, 1: second}, operation=operation).outputs["Vector"]

    def blend(self, factor: Input, first: Input, second: Input, kind: str = "MIX") -> Any:
        """A Mix node's colour."""
        return self.node("Mix", {0: factor, 6: first, 7: second}, data_type="RGBA", blend_type=kind).outputs[2]

    def fresnel(self, ior: Input = 1.45, **inputs: Input) -> Any:
        """A Fresnel node."""
        return self.node("Fresnel", {"IOR": ior, **inputs})

    def facing(self, blend: Input = 0.5, **inputs: Input) -> Any:
        """Layer Weight's Facing: 0 in the middle of a ball, 1 at its rim."""
        return self.node("LayerWeight", {"Blend": blend, **inputs}).outputs["Facing"]

    def ramp(self, factor: Input, stops: Sequence[tuple[float, Any]], interpolation: str = "LINEAR") -> Any:
        """A Color Ramp's colour; stops (place, colour or grey), two at least, from left to right."""
        b_node = self.node("ValToRGB", {0: factor})
        b_node.color_ramp.interpolation = interpolation
        elements = b_node.color_ramp.elements
        for _ in range(len(stops) - 2):
            elements.new(0.5)
        for place, (position, color) in enumerate(stops):
            elements[place].position = position
            elements[place].color = (*(color if isinstance(color, tuple) else (color,) * 3), 1.0)
        return b_node.outputs["Color"]

    def band(self, value: Input, low: float, high: float) -> Any:
        """Map Range: 0 at `low`, 1 at `high`, clamped."""
        return self.node("MapRange", {0: value, 1: low, 2: high}).outputs[0]

    def coordinates(self, output: str = "Object") -> Any:
        """An output of Texture Coordinate."""
        return self.node("TexCoord").outputs[output]

    def noise(self, scale: float, detail: float = 2.0, at: Input = None, **inputs: Input) -> Any:
        """A Noise Texture in object space; its first output is the factor."""
        place = self.coordinates() if at is None else at
        return self.node("TexNoise", {"Vector": place, "Scale": scale, "Detail": detail, **inputs})

    def cells(self, scale: float, at: Input = None, feature: str = "F1") -> Any:
        """A Voronoi Texture in object space."""
        place = self.coordinates() if at is None else at
        return self.node("TexVoronoi", {"Vector": place, "Scale": scale}, feature=feature)

    def mapped(self, vector: Input, **inputs: tuple[float, float, float]) -> Any:
        """A Mapping node: Location, Rotation, Scale."""
        return self.node("Mapping", {"Vector": vector, **inputs})

    def bump(self, height: Input, distance: float, strength: float = 1.0) -> Any:
        """A Bump node; the distance in metres."""
        return self.node("Bump", {"Height": height, "Distance": distance, "Strength": strength})

    def light_path(self, output: str) -> Any:
        """An output of Light Path."""
        return self.node("LightPath").outputs[output]

    def surface(self, shader: Any) -> None:
        """What the material's surface is."""
        self.plug(self.output.inputs["Surface"], shader)

    def absorption(self, color: tuple[float, float, float], density: float) -> None:
        """A body that absorbs: density a metre."""
        self.plug(self.output.inputs["Volume"], self.node("VolumeAbsorption", {"Color": color, "Density": density}))


def digest(b_tree: Any) -> str:
    """Twelve digits that stand for a tree: they change with its nodes, values, settings and links."""
    lines = []
    for b_node in b_tree.nodes:
        lines.append(f"{b_node.name} {b_node.bl_idname} {_settings(b_node)}")
        lines += [f"  {s.identifier} {_plain(s.default_value)}" for s in b_node.inputs if hasattr(s, "default_value")]
    for link in b_tree.links:
        lines.append(
            f"{link.from_node.name} {link.from_socket.identifier} {link.to_node.name} {link.to_socket.identifier}"
        )
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:12]


IGNORED = {"name", "label", "select", "hide", "width", "height", "location", "location_absolute", "parent", "color"}


def _settings(b_thing: Any) -> list[tuple[str, Any]]:
    """Every setting of a node that an artist can change, those of ramps and of what a node holds included."""
    found: list[tuple[str, Any]] = []
    for prop in b_thing.bl_rna.properties:
        value = getattr(b_thing, prop.identifier)
        if prop.type == "POINTER" and isinstance(value, bpy.types.ColorRamp):
            found += [(prop.identifier, value.interpolation)]
            found += [(prop.identifier, (e.position, *e.color)) for e in value.elements]
        elif prop.type not in ("POINTER", "COLLECTION") and not prop.is_readonly and prop.identifier not in IGNORED:
            found.append((prop.identifier, _plain(value)))
    return found


def _plain(value: Any) -> Any:
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
