# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage: each ball 8 m behind the last, so that none sees or shadows another, before an orthographic camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import bpy

import hybrid_addon

from .rows import GGX, NODES, PARTS, PRINCIPLED

SIZE = 24
"""Pixels of a ball's square."""
EEVEE_SAMPLES = 4

Wanted = Callable[[str, Any], bool]
"""Of a label and a value: whether that ball is wanted."""


def put(tree: Any, b_node: Any, key: Any, value: Any) -> bool:
    """Set an input, or link the shader of that name; whether this version of Blender has the input."""
    if isinstance(key, str) and key not in b_node.inputs:
        return False
    socket = b_node.inputs[key]
    if isinstance(value, str):
        kind, inputs = PARTS[value]
        b_part = tree.nodes.new(f"ShaderNode{kind}")
        for name, given in inputs.items():
            put(tree, b_part, name, given)
        tree.links.new(b_part.outputs[0], socket)
    else:
        socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
    return True


def made(tree: Any, kind: str, inputs: Any, key: Any, value: Any) -> Any:
    """The node, or None where this version of Blender lacks it or the input."""
    try:
        b_node = tree.nodes.new(f"ShaderNode{kind}")
    except RuntimeError:
        return None
    if kind in GGX:
        b_node.distribution = "GGX"
    there = [put(tree, b_node, name, given) for name, given in inputs.items()]
    there.append(key == "" or put(tree, b_node, key, value))
    return b_node if all(there) else None


def rows() -> dict[str, tuple[Any, ...]]:
    """{label: (node, what it is given, the input that varies, its values)} of all rows."""
    own: dict[str, tuple[Any, ...]] = {
        f"Principled, {name}": ("BsdfPrincipled", beside, _input(name), *values)
        for name, (beside, *values) in PRINCIPLED.items()
    }
    return {**own, **NODES}


def cells(wanted: Wanted) -> Iterator[tuple[str, Any, Any]]:
    """(label, value, material) of each ball that is wanted and that this version of Blender has."""
    for label, (kind, inputs, key, *values) in rows().items():
        for value in values:
            if not wanted(label, value):
                continue
            b_material = bpy.data.materials.new(f"{label} {value}")
            if bpy.app.version < (5, 0, 0):
                b_material.use_nodes = True
            tree = b_material.node_tree
            tree.nodes.clear()
            b_shader = made(tree, kind, inputs, key, value)
            if b_shader is None:
                bpy.data.materials.remove(b_material)
                continue
            tree.links.new(b_shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
            yield label, value, b_material


def _input(name: str) -> str:
    """Of a row of PRINCIPLED."""
    return {"IOR of glass": "IOR", "Thin Film on plastic": "Thin Film Thickness"}.get(name, name.split(",")[0])


def sky(b_scene: Any) -> None:
    """A world that changes slowly with the height, and a soft sun."""
    b_world = bpy.data.worlds.new("World")
    b_world.probe_resolution = "512"
    if bpy.app.version < (5, 0, 0):
        b_world.use_nodes = True
    tree = b_world.node_tree
    b_background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    b_place, b_parts, b_range, b_mix = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexCoord", "SeparateXYZ", "MapRange", "Mix")
    )
    b_mix.data_type = "RGBA"
    b_mix.inputs[6].default_value, b_mix.inputs[7].default_value = (0.25, 0.18, 0.12, 1), (0.6, 0.75, 1.0, 1)
    b_range.inputs[1].default_value = -1.0
    tree.links.new(b_place.outputs["Generated"], b_parts.inputs[0])
    tree.links.new(b_parts.outputs["Z"], b_range.inputs[0])
    tree.links.new(b_range.outputs[0], b_mix.inputs[0])
    tree.links.new(b_mix.outputs[2], b_background.inputs["Color"])
    b_scene.world = b_world
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.angle = 2.0, math.radians(30)
    b_sun = bpy.data.objects.new("Sun", data)
    b_sun.rotation_euler = (math.radians(50), 0, math.radians(-35))
    b_scene.collection.objects.link(b_sun)


def everything(label: str, value: Any) -> bool:
    """All balls are wanted."""
    return True


def build(wanted: Wanted = everything) -> tuple[Any, list[tuple[str, Any]], int]:
    """(scene, [(label, value)], balls in a row)."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    b_scene = bpy.context.scene
    b_scene.render.engine = "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT"
    b_scene.eevee.taa_render_samples = EEVEE_SAMPLES
    sky(b_scene)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.48)
    b_first = bpy.context.object
    b_first.data.shade_smooth()
    b_mesh = b_first.data
    bpy.data.objects.remove(b_first)
    b_mesh.materials.append(None)
    found = list(cells(wanted))
    across = math.ceil(math.sqrt(len(found)))
    down = math.ceil(len(found) / across)
    for number, (label, value, b_material) in enumerate(found):
        b_ball = bpy.data.objects.new(f"{label} {value}", b_mesh)
        b_scene.collection.objects.link(b_ball)
        b_ball.material_slots[0].link = "OBJECT"
        b_ball.material_slots[0].material = b_material
        b_ball.location = (number % across + 0.5 - across / 2, 8.0 * number, number // across + 0.5 - down / 2)
        hybrid_addon.mark(b_ball)
    b_camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    b_camera.data.type, b_camera.data.ortho_scale, b_camera.data.clip_end = "ORTHO", float(across), 5000.0
    b_camera.location, b_camera.rotation_euler = (0, -10, 0), (math.pi / 2, 0, 0)
    b_scene.collection.objects.link(b_camera)
    b_scene.camera = b_camera
    b_scene.render.resolution_x, b_scene.render.resolution_y = across * SIZE, down * SIZE
    return b_scene, [(label, value) for label, value, _ in found], across
