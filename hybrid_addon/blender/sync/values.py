# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that give numbers, colours and vectors -> values: constants where they are, else expressions.

`value_of` follows whatever is linked to a socket. A node that is not in the table NODES (here the inputs; the rest in
`value_nodes`, `object_nodes` and `texture_nodes`) is named in a warning, and the socket's own value is used.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ... import expressions as ex
from ...scene import Expression, Texture, Value
from ...scene.surfaces import MIN_IOR
from .coverage import name_sockets
from .image import MISSING_COLOR
from .nodes import Node, Socket
from .texture import NodeReader, image_texture, mapping

Translator = Callable[[Node, str, NodeReader], Value | None]
MAX_NESTED = 96
"""Nodes behind one another; deeper trees than that are not followed."""


def attribute(key: str) -> Expression:
    """What a hit, its ray, its instance or its mesh's corners know (expressions.Hits)."""
    return Expression("attribute", (), key)


NORMAL = attribute("normal")
INCOMING = attribute("incoming")
COSINE = attribute("cosine")
BACKFACING = attribute("backfacing")


def number(reader: NodeReader, node: Node, name: str | int) -> Any:
    """A float or an expression of one number."""
    return value_of(reader, node.input(name), "VALUE")


def color(reader: NodeReader, node: Node, name: str | int) -> Any:
    """Three numbers or an expression of a colour."""
    return ex.as_color(value_of(reader, node.input(name), "RGBA"))


def vector(reader: NodeReader, node: Node, name: str | int) -> Any:
    """Three numbers or an expression of a vector."""
    return ex.as_color(value_of(reader, node.input(name), "VECTOR"))


def value_of(reader: NodeReader, socket: Socket, kind: str) -> Any:
    """What arrives at a socket, converted to `kind`: VALUE, RGBA or VECTOR."""
    upstream = socket.node()
    if upstream is not None and not socket.is_constant():
        value = _of_node(reader, upstream, socket)
        if value is not None:
            return converted(value, socket.output_type(), kind)
        reader.give_up(
            f"{socket.name!r} is linked to node {upstream.name!r} ({upstream.b_node.bl_label}), "
            "which is not followed; its own value is used: bake it to an image"
        )
    return _constant(socket.value(), kind)


def emitted(reader: NodeReader, socket: Socket) -> Any:
    """What a shader's socket sends if a colour, number or vector is linked to it: Blender takes it as Emission.

    None: it is linked to a shader, or to nothing.
    """
    if socket.output_type() in ("SHADER", ""):
        return None
    return ex.as_color(value_of(reader, socket, "RGBA"))


def _constant(value: Any, kind: str) -> Any:
    if isinstance(value, tuple):
        plain = tuple(float(v) for v in value[:3])
        return converted(plain, "RGBA" if len(value) == 4 else "VECTOR", kind) if kind == "VALUE" else plain
    plain_number = float(value or 0.0)
    return plain_number if kind == "VALUE" else (plain_number,) * 3


def converted(value: Any, from_kind: str, to_kind: str) -> Any:
    """Blender's implicit conversions: a colour's luminance, a vector's mean; numbers spread by themselves."""
    if to_kind != "VALUE" or isinstance(value, float | int) or from_kind not in ("RGBA", "VECTOR", "ROTATION"):
        return value
    return ex.apply("gray" if from_kind == "RGBA" else "average", value)


def _of_node(reader: NodeReader, node: Node, socket: Socket) -> Any:
    """The value at an output of a node, each worked out once; None: not followed."""
    key = (node.b_node.as_pointer(), tuple(g.as_pointer() for g in node.groups), socket.output_identifier())
    if key not in reader.values:
        translate = NODES.get(node.kind)
        reader.nested += 1
        known = translate is not None and reader.nested < MAX_NESTED
        reader.values[key] = translate(node, socket.output(), reader) if known and translate is not None else None
        if reader.values[key] is not None:
            name_sockets(node, reader)
        reader.nested -= 1
    return reader.values[key]


# ------------------------------------------------------------------------------------------------ images, coordinates


def once(reader: NodeReader, node: Node, make: Callable[[], Any], what: str = "node", meanwhile: Any = None) -> Any:
    """What several outputs of a node have in common, or several nodes ask of it, made once.

    what : one of several such things.   meanwhile : it, to those who ask while it is made, in a circle of nodes.
    """
    key = (what, node.b_node.as_pointer(), tuple(g.as_pointer() for g in node.groups))
    if key not in reader.values:
        if meanwhile is not None:
            reader.values[key] = meanwhile
        reader.values[key] = make()
    return reader.values[key]


def _image(node: Node, output: str, reader: NodeReader) -> Value | None:
    if node.b_node.image is None:
        reader.warn(f"node {node.name!r} has no image; it is drawn black")
        return ex.as_color(0.0) if output == "Color" else 0.0
    key = ("texture", node.b_node.as_pointer(), tuple(g.as_pointer() for g in node.groups))
    if key not in reader.values:
        texture, plain = image_texture(reader, node)
        reader.values[key] = texture, () if plain else (vector(reader, node, "Vector"),)
    texture, coordinates = reader.values[key]
    if node.b_node.projection in ("SPHERE", "TUBE") and coordinates:
        coordinates = (ex.apply("wrap_" + node.b_node.projection.lower(), coordinates[0]),)
    if node.b_node.projection == "BOX" and coordinates:
        return _boxed(reader, texture, coordinates[0], output, node.b_node.projection_blend)
    return Expression("image_alpha" if output == "Alpha" else "image", coordinates, texture)


def _environment(node: Node, output: str, reader: NodeReader) -> Value:
    b_node = node.b_node
    if b_node.image is None:
        reader.warn(f"node {node.name!r} has no image; it is drawn pink")
        return MISSING_COLOR[:3]
    sphere = b_node.projection == "EQUIRECTANGULAR"
    texture = Texture(
        name=b_node.image.name,
        pixels=reader.images.pixels(b_node.image, b_node.image_user),
        extension="SPHERE" if sphere else "EXTEND",
        interpolation="CLOSEST" if b_node.interpolation == "Closest" else "LINEAR",
    )
    linked = node.input("Vector").node() is not None
    direction = vector(reader, node, "Vector") if linked else Expression("attribute", (), "position")
    return Expression("image", (ex.apply("equirect" if sphere else "mirror_ball", direction),), texture)


def _boxed(reader: NodeReader, texture: Any, point: Value, output: str, blend: float) -> Value:
    """Three views along the axes, mixed by the normal."""
    operation = "image_alpha" if output == "Alpha" else "image"
    views = [Expression(operation, (ex.apply("box_view", point, NORMAL, data=axis),), texture) for axis in range(3)]
    weights = ex.apply("box_weights", NORMAL, data=blend)
    parts = [ex.times(views[axis], ex.apply("channel", weights, data=axis)) for axis in range(3)]
    return ex.plus(ex.plus(parts[0], parts[1]), parts[2])


def _texture_coordinate(node: Node, output: str, reader: NodeReader) -> Value | None:
    if output == "Object" and node.b_node.object is not None:
        matrix = np.array(node.b_node.object.matrix_world.inverted_safe())[:3]
        return ex.apply("affine", Expression("attribute", (), "position"), data=matrix)
    keys = {"UV": "uv:", "Generated": "generated", "Object": "object"}
    if output == "Normal":
        return ex.apply("normalize", Expression("attribute", (), "object_normal"))
    if output == "Reflection":
        twice = ex.times(2.0, ex.apply("dot", NORMAL, INCOMING))
        return ex.apply("subtract", ex.times(twice, NORMAL), INCOMING)
    return Expression("attribute", (), keys[output]) if output in keys else None


def _uv_map(node: Node, output: str, reader: NodeReader) -> Value:
    return Expression("attribute", (), "uv:" + node.b_node.uv_map)


STRAND = ("Intercept", "Length", "Thickness", "Random")
"""Of attribute "strand", in this order."""


def _hair_info(node: Node, output: str, reader: NodeReader) -> Value | None:
    strand = Expression("attribute", (), "strand")
    if output == "Is Strand":
        return ex.apply("greater", ex.apply("channel", strand, data=STRAND.index("Length")), 0.0)
    return ex.apply("channel", strand, data=STRAND.index(output)) if output in STRAND else None


def default_coordinates(reader: NodeReader, node: Node) -> Any:
    """The Vector of a procedural texture: Generated where nothing is linked."""
    if node.input("Vector").node() is None:
        return Expression("attribute", (), "generated")
    return vector(reader, node, "Vector")


def _mapping(node: Node, output: str, reader: NodeReader) -> Value:
    kind, given = node.b_node.vector_type, vector(reader, node, "Vector")
    location = vector(reader, node, "Location") if kind in ("POINT", "TEXTURE") else (0.0, 0.0, 0.0)
    rotation, scale = vector(reader, node, "Rotation"), vector(reader, node, "Scale")
    if any(isinstance(value, Expression) for value in (location, rotation, scale)):
        moved = ex.apply("mapping", given, location, rotation, scale, data=kind)
    else:
        moved = ex.apply("affine", given, data=np.array(mapping(kind, location, rotation, scale))[:3])
    return ex.apply("normalize", moved) if kind == "NORMAL" else moved


AXES = {"X_AXIS": (1.0, 0.0, 0.0), "Y_AXIS": (0.0, 1.0, 0.0), "Z_AXIS": (0.0, 0.0, 1.0)}


def _vector_rotate(node: Node, output: str, reader: NodeReader) -> Value:
    kind, back = node.b_node.rotation_type, bool(node.b_node.invert)
    given, center = vector(reader, node, "Vector"), vector(reader, node, "Center")
    if kind == "EULER_XYZ":
        return ex.apply("turned", given, center, vector(reader, node, "Rotation"), data=back)
    axis = AXES[kind] if kind in AXES else vector(reader, node, "Axis")
    angle = ex.times(-1.0 if back else 1.0, number(reader, node, "Angle"))
    return ex.apply("turned_about", given, center, axis, angle)


# ------------------------------------------------------------------------------------------------ normals, view


def _normal_map(node: Node, output: str, reader: NodeReader) -> Value:
    b_node = node.b_node
    mapped, strength = color(reader, node, "Color"), number(reader, node, "Strength")
    if getattr(b_node, "convention", "OPENGL") == "DIRECTX":  # green counts downwards
        mapped = ex.apply("multiply_add", mapped, (1.0, -1.0, 1.0), (0.0, 1.0, 0.0))
    if b_node.space == "TANGENT":
        tangent, normal = attribute("tangent:" + b_node.uv_map), attribute("interpolated_normal")
        return ex.apply("normal_map", mapped, strength, tangent, normal)
    # After gpu_shader_material_normal_map.glsl. Of Blender's own spaces y and z are turned over before 1 is taken off.
    flip = (2.0, -2.0, -2.0) if b_node.space.startswith("BLENDER") else (2.0, 2.0, 2.0)
    turned = ex.apply("subtract", ex.times(flip, mapped), 1.0)
    if b_node.space in ("OBJECT", "BLENDER_OBJECT"):
        turned = ex.apply("transformed", turned, attribute(ex.INSTANCE + "WORLD_TO_OBJECT"), data="NORMAL")
    return ex.apply("normalize", ex.apply("mix", ex.apply("maximum", strength, 0.0), NORMAL, turned))


def _bump(node: Node, output: str, reader: NodeReader) -> Value:
    height = number(reader, node, "Height")
    below = vector(reader, node, "Normal") if node.input("Normal").node() is not None else NORMAL
    if not isinstance(height, Expression):
        return below
    distance = number(reader, node, "Distance")
    if node.b_node.invert:
        distance = ex.times(-1.0, distance)
    slope = Expression("slope", (height,))
    return ex.apply("bump", slope, number(reader, node, "Strength"), distance, below)


def _cosine(node: Node, reader: NodeReader) -> Value:
    """Of the angle between the eye and the surface's normal, or what is linked to the node's own."""
    if node.input("Normal").node() is None:
        return COSINE
    return ex.apply("cosine_between", vector(reader, node, "Normal"), INCOMING)


def _fresnel(node: Node, output: str, reader: NodeReader) -> Value:
    ior = ex.apply("maximum", number(reader, node, "IOR"), MIN_IOR)
    return ex.apply("fresnel", _cosine(node, reader), _from_either_side(ior))


def _from_either_side(ior: Value) -> Value:
    """Seen from within it is turned over, as in EEVEE (gpu_shader_material_fresnel.glsl)."""
    return ex.apply("mix", BACKFACING, ior, ex.apply("divide", 1.0, ior))


def _layer_weight(node: Node, output: str, reader: NodeReader) -> Value:
    blend = ex.clamped(number(reader, node, "Blend"))
    if output == "Fresnel":
        ior = ex.apply("divide", 1.0, ex.apply("maximum", ex.rest(blend), 1e-5))
        return ex.apply("fresnel", _cosine(node, reader), _from_either_side(ior))
    return ex.apply("facing", _cosine(node, reader), blend)


NODES: dict[str, Translator] = {
    "ShaderNodeTexImage": _image,
    "ShaderNodeTexEnvironment": _environment,
    "ShaderNodeTexCoord": _texture_coordinate,
    "ShaderNodeUVMap": _uv_map,
    "ShaderNodeHairInfo": _hair_info,
    "ShaderNodeMapping": _mapping,
    "ShaderNodeVectorRotate": _vector_rotate,
    "ShaderNodeNormalMap": _normal_map,
    "ShaderNodeBump": _bump,
    "ShaderNodeFresnel": _fresnel,
    "ShaderNodeLayerWeight": _layer_weight,
}
