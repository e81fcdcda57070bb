# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramic cameras against Cycles: a world that shows the direction of each ray."""

import bpy
import numpy as np
import pytest

from hybrid_addon.blender.sync import Warnings
from hybrid_addon.blender.sync.camera import panorama_settings, translate_camera
from hybrid_addon.tracer.core.camera import generate_rays
from hybrid_addon.tracer.core.panorama import MAPPINGS
from tests.blender.kit import empty_scene, nodes_of

WIDTH, HEIGHT = 24, 16

OTHER = {
    "latitude_min": -0.5, "longitude_max": 1.0, "fisheye_fov": 4.0, "fisheye_lens": 14.0,
    "central_cylindrical_range_u_max": 1.0, "central_cylindrical_range_v_max": 2.0, "central_cylindrical_radius": 1.5,
}  # fmt: skip


@pytest.fixture(scope="module")
def scene(addon, tmp_path_factory):
    """A tilted panoramic camera in a world whose color is 1 + half of the direction."""
    scene = empty_scene(WIDTH, HEIGHT, 1)
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.render.filepath = str(tmp_path_factory.mktemp("panorama") / "cycles.exr")
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    scene.world = bpy.data.worlds.new("World")
    tree = nodes_of(scene.world)
    half, place = tree.nodes.new("ShaderNodeVectorMath"), tree.nodes.new("ShaderNodeTexCoord")
    half.operation = "MULTIPLY_ADD"
    half.inputs[1].default_value, half.inputs[2].default_value = (0.5, 0.5, 0.5), (1.0, 1.0, 1.0)
    tree.links.new(place.outputs["Generated"], half.inputs[0])
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(half.outputs[0], background.inputs["Color"])
    b_camera = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    b_camera.location, b_camera.rotation_euler, b_camera.data.type = (1, 2, 3), (1.1, 0.2, 0.7), "PANO"
    scene.collection.objects.link(b_camera)
    scene.camera = b_camera
    scene.hybrid.mode = "FULL"
    return scene


def by_cycles(scene):
    """Directions (h, w, 3) of Cycles' rays, NaN where it has none."""
    bpy.ops.render.render(write_still=True)
    b_image = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(b_image.pixels[:], np.float32).reshape(HEIGHT, WIDTH, -1)[..., :3]
    bpy.data.images.remove(b_image)
    return np.where((pixels == 0).all(axis=2)[..., None], np.nan, 2 * (pixels - 1))


def by_us(scene):
    bpy.context.view_layer.update()
    b_depsgraph = bpy.context.evaluated_depsgraph_get()
    camera = translate_camera(b_depsgraph, scene, (WIDTH, HEIGHT), (0, 0, WIDTH, HEIGHT), Warnings())
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    _, direction, t_max = generate_rays(camera, x.ravel(), y.ravel(), np.zeros(3), 100.0)
    return np.where(t_max > 0, direction, np.nan).T.reshape(HEIGHT, WIDTH, 3)


@pytest.mark.parametrize("kind", MAPPINGS)
def test_rays_go_where_those_of_cycles_go(scene, kind):
    b_camera = scene.camera.data
    b_mapping = panorama_settings(b_camera)
    b_mapping.panorama_type = kind
    b_camera.shift_x, b_camera.sensor_fit = 0.1, "VERTICAL"
    for name, value in OTHER.items():
        setattr(b_mapping, name, value)
    np.testing.assert_allclose(by_us(scene), by_cycles(scene), atol=3e-3, equal_nan=True)


def test_elsewhere_it_is_eevees_perspective_and_says_what_draws_it(scene):
    scene.hybrid.mode, warn = "HYBRID", Warnings()
    bpy.context.view_layer.update()
    camera = translate_camera(bpy.context.evaluated_depsgraph_get(), scene, (8, 8), (0, 0, 8, 8), warn)
    scene.hybrid.mode = "FULL"
    assert camera.projection == "PERSP"
    assert "Everything draws it as a panorama" in " ".join(warn)
