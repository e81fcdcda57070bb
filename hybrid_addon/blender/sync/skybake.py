# SPDX-License-Identifier: GPL-3.0-or-later
"""A script for a Blender of its own: one Sky Texture node through Cycles, all around, into an image.

    python skybake.py -- ORDER.json PICTURE.exr

The order has the node's settings, the picture's height, and what else the scene needs; nothing of the artist's file is
opened.
"""

from __future__ import annotations

import json
import math
import os
import sys
from typing import Any

import bpy


def main(order: dict[str, Any], picture: str) -> None:
    """Render it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    b_scene = bpy.context.scene
    b_scene.render.engine = "CYCLES"
    b_scene.world = _world(order["settings"])
    _camera(b_scene)
    b_render, b_cycles = b_scene.render, b_scene.cycles
    b_render.resolution_x, b_render.resolution_y = 2 * order["height"], order["height"]
    b_render.resolution_percentage = 100
    b_cycles.device, b_cycles.samples = "CPU", 1
    b_cycles.use_denoising = b_cycles.use_adaptive_sampling = False
    b_cycles.pixel_filter_type, b_cycles.filter_width = "BOX", 0.01  # each pixel is the sky in its middle
    b_settings = b_render.image_settings
    if hasattr(b_settings, "media_type"):
        b_settings.media_type = "IMAGE"
    b_settings.file_format, b_settings.color_depth, b_settings.exr_codec = "OPEN_EXR", "32", "NONE"
    b_render.filepath = picture
    bpy.ops.render.render(write_still=True)


def _world(settings: dict[str, Any]) -> bpy.types.World:
    b_world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0, 0):
        b_world.use_nodes = True
    b_tree = b_world.node_tree
    b_tree.nodes.clear()
    b_sky, b_background, b_output = (
        b_tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexSky", "Background", "OutputWorld")
    )
    b_sky.sky_type = settings["sky_type"]
    for name, value in settings.items():
        setattr(b_sky, name, value)
    b_tree.links.new(b_sky.outputs[0], b_background.inputs["Color"])
    b_tree.links.new(b_background.outputs[0], b_output.inputs["Surface"])
    return b_world


def _camera(b_scene: bpy.types.Scene) -> None:
    """It looks along +X: the middle of an equirectangular image, as Blender lays them out."""
    b_camera = bpy.data.cameras.new("Around")
    b_camera.type, b_camera.panorama_type = "PANO", "EQUIRECTANGULAR"
    b_object = bpy.data.objects.new("Around", b_camera)
    b_object.rotation_euler = (math.pi / 2, 0.0, -math.pi / 2)
    b_scene.collection.objects.link(b_object)
    b_scene.camera = b_object


if __name__ == "__main__":
    order_path, picture_path = sys.argv[sys.argv.index("--") + 1 :][:2]
    with open(order_path, encoding="utf-8") as file:
        main(json.load(file), picture_path)
    os._exit(0)  # bpy 4.5's static destructors can wait for ever
