# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's world -> scene.World: what its nodes make of each direction, once for camera rays and once for light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import bpy
import numpy as np

from ... import expressions as ex
from ...scene import BLACK, RGB, Expression, Medium, World, WorldSun
from ..view_layers import source_layer
from . import object_nodes as _objects  # noqa: F401  (these three add their nodes to the table of `values`)
from . import texture_nodes as _textures  # noqa: F401
from . import value_nodes as _registered  # noqa: F401
from .coverage import name_settings, name_sockets
from .image import Images
from .messages import Warnings
from .nodes import Node, Socket, active_output, uses_nodes
from .settings import direct_strength
from .texture import FrameFacts, NodeReader
from .values import color, emitted, number
from .volume import medium_from

MAX_DEPTH = 32  # of Mix and Add Shaders below one another
DIRECTION = ("generated", "position", "object")  # attributes that are a world's direction itself


def translate_world(
    b_depsgraph: bpy.types.Depsgraph, b_scene: bpy.types.Scene, images: Images, warn: Warnings, frame: FrameFacts
) -> tuple[World, Medium]:
    """The world of the scene, or of its view layer, with its animated values; black without one.

    And what its volume fills everything with. What dims light lets none of the world's through, nor of suns, as in
    EEVEE: it is infinitely far, behind infinitely much of that.
    """
    b_world = _drawn(b_depsgraph, b_scene)
    if b_world is None:
        return World(), Medium()
    owner = f"world {b_world.name!r}"
    name_settings(b_world, owner, warn)
    output = active_output(b_world.node_tree) if uses_nodes(b_world) else None
    medium = Medium() if output is None else medium_from(output.input("Volume"), NodeReader(owner, images, warn, frame))
    if medium.dims:
        return World(), medium
    world = _seen(b_world, output, images, warn, frame)
    sun = WorldSun(
        b_world.sun_threshold,
        b_world.sun_angle,
        b_world.use_sun_shadow and b_scene.eevee.use_shadows,
        direct_strength(b_scene),
    )
    limit = b_scene.eevee.clamp_surface_indirect
    world = replace(
        world,
        sun=sun if sun.threshold > 0 else None,
        limit=limit if limit > 0 else float("inf"),
        dering="LENGTH" if bpy.app.version >= (5, 0, 0) else "AXES",
    )
    return world, medium


def _drawn(b_depsgraph: bpy.types.Depsgraph, b_scene: bpy.types.Scene) -> bpy.types.World | None:
    """The evaluated world of the scene, or of its view layer; None: EEVEE draws none."""
    b_layer = source_layer(b_scene)
    overridden = bpy.app.version >= (5, 0, 0) and b_layer.world_override  # EEVEE of Blender 4.5 has none
    b_world = overridden or b_scene.world
    return b_world.evaluated_get(b_depsgraph) if b_world is not None and b_layer.use_sky else None


def _seen(b_world: bpy.types.World, output: Node | None, images: Images, warn: Warnings, frame: FrameFacts) -> World:
    """What lights; with a backdrop if the nodes tell camera rays from others."""
    if not uses_nodes(b_world):
        return World(radiance=_rgb(b_world.color))
    if output is None:
        return World()
    name = f"world {b_world.name!r}"
    name_sockets(output, NodeReader(name, images, warn, frame))
    seen = {}
    for camera in (False, True):
        reader = NodeReader(name, images, warn, frame, camera)
        reader.unseen = _rgb(b_world.color)
        seen[camera] = _world(_radiance(output.input("Surface"), reader))
        if not reader.light_path:
            return seen[False]
    return replace(seen[False], backdrop=seen[True])


# ------------------------------------------------------------------------------------------------ shaders


def _radiance(socket: Socket, reader: NodeReader, depth: int = 0) -> Any:
    """The colour, by direction, that the shader linked to `socket` sends."""
    node = socket.node()
    if node is None:
        return BLACK
    light = emitted(reader, socket)
    if light is not None:
        return light
    shader = SHADERS.get(node.kind)
    if shader is None or depth > MAX_DEPTH:
        reader.give_up(f"node {node.name!r} ({node.b_node.bl_label}) is not followed; it is black")
        return BLACK
    return shader(node, reader, depth)


def _background(node: Node, reader: NodeReader, depth: int) -> Any:
    strength = number(reader, node, "Strength")
    return BLACK if strength == 0.0 else ex.as_color(ex.times(strength, color(reader, node, "Color")))


def _mix(node: Node, reader: NodeReader, depth: int) -> Any:
    factor = ex.clamped(number(reader, node, 0))
    if factor in (0.0, 1.0):
        return _radiance(node.input(1 + int(factor)), reader, depth + 1)
    first, second = (_radiance(node.input(position), reader, depth + 1) for position in (1, 2))
    return ex.apply("mix", factor, first, second)


def _add(node: Node, reader: NodeReader, depth: int) -> Any:
    first, second = (_radiance(node.input(position), reader, depth + 1) for position in (0, 1))
    return ex.apply("add", first, second)


SHADERS: dict[str, Callable[[Node, NodeReader, int], Any]] = {
    "ShaderNodeBackground": _background,
    "ShaderNodeEmission": _background,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
}


# ------------------------------------------------------------------------------------------------ the simplest form


def _world(radiance: Any) -> World:
    """A colour, an image that is only turned and tinted (it keeps its own pixels), or else an expression."""
    if not isinstance(radiance, Expression):
        return World(radiance=tuple(max(channel, 0.0) for channel in radiance))
    factor, image = np.ones(3), cast(Any, radiance)
    while image.operation == "multiply" and sum(isinstance(value, Expression) for value in image.inputs) == 1:
        varies = 0 if isinstance(image.inputs[0], Expression) else 1
        factor = factor * np.array(image.inputs[1 - varies])
        image = image.inputs[varies]
    rotation = _rotation_of(image)
    if rotation is None or (factor < 0).any():
        return World(radiance=radiance)
    red, green, blue = factor.tolist()
    return World((red, green, blue), environment=image.data, rotation=rotation)


def _rotation_of(image: Expression) -> Any:
    """(3, 3) that takes a world direction to that of an equirectangular image; None for anything else."""
    if image.operation != "image" or not image.inputs or image.data.extension != "SPHERE":
        return None
    direction, rotation = image.inputs[0], np.eye(3)
    if not isinstance(direction, Expression) or direction.operation != "equirect":
        return None
    direction = direction.inputs[0]
    while isinstance(direction, Expression) and direction.operation == "affine" and not direction.data[:, 3].any():
        rotation = rotation @ direction.data[:, :3]
        direction = direction.inputs[0]
    plain = isinstance(direction, Expression) and direction.operation == "attribute" and direction.data in DIRECTION
    return rotation if plain and np.isfinite(rotation).all() else None


def _rgb(values: bpy.types.bpy_prop_array) -> RGB:
    red, green, blue = values[:3]
    return red, green, blue
