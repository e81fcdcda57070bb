"""Blender's world -> scene.World: a colour, or an equirectangular image and its rotation."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from ...scene import RGB, Float64, Texture, World
from .image import Images
from .messages import Warnings
from .nodes import Node, Socket, active_output, uses_nodes
from .texture import NodeReader, image_node_upstream, mapping_matrix, rotation_of

MAX_SHADERS = 32  # looked through on the way to the Background node


def translate_world(
    b_depsgraph: bpy.types.Depsgraph, b_scene: bpy.types.Scene, images: Images, warn: Warnings
) -> World:
    """The scene's world with its animated values; black without one, its plain colour where nodes are not followed."""
    if b_scene.world is None:
        return World()
    b_world = b_scene.world.evaluated_get(b_depsgraph)
    if not uses_nodes(b_world):
        return World(radiance=_rgb(b_world.color))
    reader = NodeReader(f"world {b_world.name!r}", images, warn)
    output = active_output(b_world.node_tree)
    if output is None:
        return World()
    if output.input("Volume").node() is not None:
        reader.warn("its volume is not traced")
    background = _background(output.input("Surface"), reader)
    return _from_background(background, _rgb(b_world.color), reader) if background else World()


def _background(socket: Socket, reader: NodeReader) -> Node | None:
    """The Background node behind `socket`; of a Mix or Add Shader the first branch that has one."""
    queue = [socket]
    for searched in queue:
        node = searched.node()
        if node is None:
            continue
        if node.kind in ("ShaderNodeBackground", "ShaderNodeEmission"):
            return node
        reader.warn(f"node {node.name!r} is not followed; the first background behind it is used")
        if len(queue) < MAX_SHADERS:
            queue.extend(upstream for upstream in node.inputs() if upstream.b_socket.type == "SHADER")
    return None


def _from_background(node: Node, viewport_color: RGB, reader: NodeReader) -> World:
    """Of a Background (or Emission) node; where its colour is not followed, with the world's viewport colour."""
    strength = reader.number(node, "Strength")
    if node.input("Color").is_constant():
        return World(radiance=_scaled(reader.color(node, "Color"), strength))
    image = image_node_upstream(reader, node, "Color", "ShaderNodeTexEnvironment")
    if image is None or not _is_equirectangular(image, reader):
        reader.warn(
            f"'Color' of node {node.name!r} comes from nodes that are not followed; the world's viewport colour is used"
        )
        return World(radiance=_scaled(viewport_color, strength))
    return World(
        radiance=(strength, strength, strength),
        environment=_environment(image, reader),
        rotation=_rotation(image, reader),
    )


def _is_equirectangular(node: Node, reader: NodeReader) -> bool:
    if node.b_node.image is None:
        reader.warn(f"node {node.name!r} has no image")
        return False
    if node.b_node.projection != "EQUIRECTANGULAR":
        reader.warn(f"node {node.name!r}: mirror ball projection is not followed")
        return False
    return True


def _environment(node: Node, reader: NodeReader) -> Texture:
    b_node = node.b_node
    return Texture(
        name=b_node.image.name,
        pixels=reader.images.pixels(b_node.image, b_node.image_user),
        interpolation="CLOSEST" if b_node.interpolation == "Closest" else "LINEAR",
    )


def _rotation(node: Node, reader: NodeReader) -> Float64:
    """(3, 3): world direction -> look-up direction, by the Mapping nodes in front of the image."""
    matrix = Matrix.Identity(4)
    source = node.input("Vector").node()
    while source and source.kind == "ShaderNodeMapping":
        matrix = matrix @ mapping_matrix(reader, source)
        node, source = source, source.input("Vector").node()
    if any(matrix.translation):
        reader.warn("the location in its Mapping node is not followed")
    if source and not (source.kind == "ShaderNodeTexCoord" and node.input("Vector").output() == "Generated"):
        reader.warn(f"node {node.name!r}: its vector comes from {source.name!r}, which is not followed")
    rotation = rotation_of(matrix)
    return rotation if np.isfinite(rotation).all() else np.eye(3)


def _rgb(values: bpy.types.bpy_prop_array) -> RGB:
    red, green, blue = values[:3]
    return red, green, blue


def _scaled(color: RGB, factor: float) -> RGB:
    return color[0] * factor, color[1] * factor, color[2] * factor
