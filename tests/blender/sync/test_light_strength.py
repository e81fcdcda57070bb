# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE's Light Strength, Clamping and Shadows, and a view layer's overrides, by EEVEE and traced, side by side.

A matte, a mirror and a plastic ball in a grey world, under a lamp: what a lamp lights directly, and what comes from the
world, diffuse and mirrored. The mirror ball is compared where it shows neither the lamp, whose image there is smaller
than a pixel, nor its neighbours, which EEVEE does not mirror.
"""

from __future__ import annotations

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.sync.coverage import PROPERTIES, Irrelevant, status_of
from tests.blender.kit import empty_scene, new_world

pytestmark = [pytest.mark.blender, pytest.mark.render]
SIZE = (96, 32)
MIST = {"use_mist": status_of(PROPERTIES["World"], "mist_settings")}
BALLS = {"matte": (0.0, 1.0), "mirror": (1.0, 0.0), "plastic": (0.0, 0.4)}  # metallic, roughness


@pytest.fixture(scope="module")
def studio(addon):
    """Three balls that hang side by side, ray traced."""
    scene = empty_scene(*SIZE, 4)
    for i, (name, (metallic, roughness)) in enumerate(BALLS.items()):
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.9, location=(2 * i - 2, 0, 0))
        ball = bpy.context.object
        ball.data.shade_smooth()
        material = bpy.data.materials.new(name)
        if bpy.app.version < (5, 0, 0):
            material.use_nodes = True
        inputs = material.node_tree.nodes["Principled BSDF"].inputs
        inputs["Base Color"].default_value = (0.8, 0.5, 0.3, 1)
        inputs["Metallic"].default_value, inputs["Roughness"].default_value = metallic, roughness
        ball.data.materials.append(material)
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))
    lamp.data.energy, lamp.data.shadow_soft_size, lamp.location = 2500.0, 0.2, (1, -2, 9)
    lamp.data.use_custom_distance, lamp.data.cutoff_distance = True, 1000.0
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 6.0
    camera.location, camera.rotation_euler = (0, -9, 0), (np.pi / 2, 0, 0)
    for thing in (lamp, camera):
        scene.collection.objects.link(thing)
    scene.camera = camera
    scene.world = world("grey", (0.5, 0.5, 0.5, 1))
    hybrid.enable(scene)
    for shown in scene.objects:
        if shown.type == "MESH":
            hybrid.mark(shown)
            shown.hybrid.surface = "MATERIAL"
    return scene


def world(name, color):
    made = new_world(name)
    made.node_tree.nodes["Background"].inputs["Color"].default_value = color
    return made


def middles(scene, mode):
    """The mean colour of each ball around its middle, (3, rgb), and of the sky beside it, (rgb,)."""
    image = np.array(hybrid.render(scene, mode=mode, samples=8).image)[..., :3]
    height, width = SIZE[1], SIZE[0] // 3
    across = slice(width // 4, -width // 4)
    balls = [image[height // 4 : -height // 4, i * width : (i + 1) * width][:, across].mean((0, 1)) for i in range(3)]
    return np.array(balls), image[-1, 0]


STEPS = {
    "clamped": {"clamp_surface_direct": 0.15, "clamp_surface_indirect": 0.2},
    "other strengths": {"direct_light_intensity": 0.4, "indirect_light_intensity": 1.7},
    "clamped, other strengths": {
        "clamp_surface_direct": 0.15,
        "clamp_surface_indirect": 0.2,
        "direct_light_intensity": 2.0,
        "indirect_light_intensity": 0.5,
    },
}


def test_light_strength_and_clamping_are_eevees(studio):
    eevee, neutral = studio.eevee, {}
    plain, _ = middles(studio, "raster")
    for name, values in STEPS.items():
        known = {key: value for key, value in values.items() if hasattr(eevee, key)}
        neutral |= {key: getattr(eevee, key) for key in known if key not in neutral}
        for key, value in {**neutral, **known}.items():
            setattr(eevee, key, value)
        (raster, sky), (traced, traced_sky) = middles(studio, "raster"), middles(studio, "full")
        off = np.abs(traced - raster).mean(axis=1) / raster.mean(axis=1)
        print(f"{name}: EEVEE {raster.mean(axis=1)}, traced {traced.mean(axis=1)}, off {off}")
        if known:
            assert (np.abs(raster - plain).mean(axis=1) > 0.02).all(), "it changes every ball"
        assert (off < 0.02).all()
        np.testing.assert_allclose(sky, traced_sky, atol=0.005)
    for key, value in neutral.items():
        setattr(eevee, key, value)


def test_a_view_layers_world_environment_and_material_are_eevees(studio):
    layer = next(layer for layer in studio.view_layers if layer.get("hybrid_source"))
    steps = [("world_override", world("red", (0.6, 0.1, 0.1, 1))), ("use_sky", False)]
    if bpy.app.version >= (5, 0, 0):
        steps.append(("material_override", bpy.data.materials["matte"]))
    for name, value in steps:
        before = getattr(layer, name)
        setattr(layer, name, value)
        (raster, sky), (traced, traced_sky) = middles(studio, "raster"), middles(studio, "full")
        setattr(layer, name, before)
        print(f"{name}: EEVEE {raster.mean(axis=1)}, traced {traced.mean(axis=1)}")
        np.testing.assert_allclose(traced[[0, 2]], raster[[0, 2]], rtol=0.03, atol=0.003)
        np.testing.assert_allclose(sky, traced_sky, atol=0.005)


def test_what_the_tables_call_irrelevant_leaves_eevees_picture_as_it_is(studio):
    ball, lamp, layer = bpy.data.objects["Sphere"], studio.objects["lamp"], studio.view_layers[0]
    changes = [
        (ball, "is_shadow_catcher", True),
        (ball, "shadow_terminator_shading_offset", 0.5),
        (lamp.data, "shadow_maximum_resolution", 0.1),
        (studio.world.mist_settings, "use_mist", True),
        (layer, "use_ao", False),
        (studio.eevee, "clamp_volume_direct", 0.01),
    ]
    before, _ = middles(studio, "raster")
    held = [(owner, name, getattr(owner, name)) for owner, name, _ in changes]
    for owner, name, value in changes:
        setattr(owner, name, value)
        status = status_of(PROPERTIES.get(type(owner).__name__, MIST), name)
        assert isinstance(status, Irrelevant), name
    after, _ = middles(studio, "raster")
    for owner, name, value in held:
        setattr(owner, name, value)
    np.testing.assert_array_equal(after, before)
