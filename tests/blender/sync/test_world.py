# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's colour and environment, and the translation through a scene that only has the artist's as background."""

from __future__ import annotations

import math
from collections import OrderedDict

import bpy
import numpy as np
import pytest

from hybrid_addon.blender.sync import Warnings, translate
from hybrid_addon.blender.sync import sky as sky_module
from hybrid_addon.blender.sync.image import Images
from hybrid_addon.blender.sync.texture import FrameFacts
from hybrid_addon.blender.sync.world import translate_world
from hybrid_addon.expressions import walk

pytestmark = pytest.mark.blender

SIZE, WINDOW = (64, 48), (0, 0, 64, 48)


@pytest.fixture
def warn():
    return Warnings()


def world(scene, warn):
    bpy.context.view_layer.update()
    return translate_world(bpy.context.evaluated_depsgraph_get(), scene, Images(warn), warn, FrameFacts())[0]


def background(scene):
    return scene.world.node_tree.nodes["Background"]


def environment(scene, output="Generated", **inputs):
    """An environment image behind a Mapping node, as artists set it up."""
    b_tree, b_image = scene.world.node_tree, bpy.data.images.new("Sky", 8, 4, float_buffer=True)
    b_node, b_mapping, b_coordinates = (
        b_tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexEnvironment", "Mapping", "TexCoord")
    )
    b_node.image = b_image
    for name, value in inputs.items():
        b_mapping.inputs[name].default_value = value
    b_tree.links.new(b_coordinates.outputs[output], b_mapping.inputs["Vector"])
    b_tree.links.new(b_mapping.outputs[0], b_node.inputs["Vector"])
    b_tree.links.new(b_node.outputs[0], background(scene).inputs["Color"])
    return b_node


def test_colour_times_strength(scene, warn):
    background(scene).inputs["Color"].default_value = (0.1, 0.2, 0.4, 1)
    background(scene).inputs["Strength"].default_value = 3.0
    assert world(scene, warn).radiance == pytest.approx((0.3, 0.6, 1.2))
    assert list(warn) == []


def test_a_color_linked_to_the_output_is_the_light(scene, warn):
    b_tree = scene.world.node_tree
    b_node = b_tree.nodes.new("ShaderNodeRGB")
    b_node.outputs[0].default_value = (0.1, 0.2, 0.4, 1)
    b_tree.links.new(b_node.outputs[0], b_tree.nodes["World Output"].inputs["Surface"])
    assert world(scene, warn).radiance == pytest.approx((0.1, 0.2, 0.4))
    assert list(warn) == []


def test_no_world_is_black(scene, warn):
    scene.world = None
    assert world(scene, warn).radiance == (0, 0, 0)
    assert list(warn) == []


def test_an_environment_image_with_strength_and_rotation(scene, warn):
    background(scene).inputs["Strength"].default_value = 2.0
    environment(scene, Rotation=(0, 0, math.pi / 2))
    found = world(scene, warn)
    assert found.radiance == (2, 2, 2)
    assert (found.environment.name, found.environment.pixels.shape) == ("Sky", (4, 8, 4))
    assert found.rotation @ (1, 0, 0) == pytest.approx((0, 1, 0), abs=1e-7)
    assert list(warn) == []


def test_what_is_more_than_turned_and_tinted_is_an_expression(scene, warn):
    b_node = environment(scene, output="Object", Location=(1, 0, 0))
    found = world(scene, warn)
    assert found.environment is None
    assert [e.operation for e in walk(found.radiance)] == ["image", "equirect", "affine", "attribute"]
    b_node.projection = "MIRROR_BALL"
    assert "mirror_ball" in [e.operation for e in walk(world(scene, warn).radiance)]
    assert list(warn) == []


def test_an_environment_without_an_image_is_pink_as_in_eevee(scene, warn):
    environment(scene).image = None
    assert world(scene, warn).radiance == (1, 0, 1)
    assert "no image" in next(iter(warn))


def sky(scene, kind="PREETHAM", **settings):
    b_sky = scene.world.node_tree.nodes.new("ShaderNodeTexSky")
    b_sky.sky_type = kind
    for name, value in settings.items():
        setattr(b_sky, name, value)
    scene.world.node_tree.links.new(b_sky.outputs[0], background(scene).inputs["Color"])
    return b_sky


@pytest.fixture
def small_skies(monkeypatch):
    """Skies of few pixels; the list of those that are drawn."""
    drawn, draw = [], sky_module._draw
    monkeypatch.setattr(sky_module, "HEIGHT", 32)
    monkeypatch.setattr(sky_module, "_kept", OrderedDict())
    monkeypatch.setattr(sky_module, "_draw", lambda settings: drawn.append(settings) or draw(settings))
    return drawn


def test_a_sky_is_drawn_once_where_its_sun_is(scene, warn, small_skies):
    kinds = {item.identifier for item in bpy.types.ShaderNodeTexSky.bl_rna.properties["sky_type"].enum_items}
    atmosphere = "NISHITA" if "NISHITA" in kinds else "SINGLE_SCATTERING"
    b_sky = sky(scene, atmosphere, sun_rotation=0.0, sun_elevation=0.3)  # it stands over +Y
    background(scene).inputs["Strength"].default_value = 0.5
    found = world(scene, warn)
    assert (list(warn), found.radiance) == ([], (0.5, 0.5, 0.5))
    texels = found.environment.pixels
    pixels = texels.rgba()
    assert pixels.shape == (32, 64, 4)
    row, column = np.unravel_index(pixels[..., 0].argmax(), (32, 64))
    assert (row, column) == pytest.approx((17, 15.5), abs=2)  # just over the horizon, at u = 0.25
    assert pixels[:14, :, :3].mean() < 0.2 * pixels[18:, :, :3].mean()
    assert world(scene, warn).environment.pixels is texels
    b_sky.sun_disc = False  # EEVEE draws none
    assert world(scene, warn).environment.pixels is texels
    assert len(small_skies) == 1


def test_a_sky_that_cannot_be_drawn_is_the_viewport_colour_by_name(scene, warn, small_skies, monkeypatch):
    monkeypatch.setattr(sky_module, "_blender", lambda: ["nowhere/blender"])
    sky(scene)
    scene.world.color = (0.5, 0.25, 0.125)
    background(scene).inputs["Strength"].default_value = 2.0
    for _ in range(2):
        assert world(scene, warn).radiance == pytest.approx((1.0, 0.5, 0.25))
    (line,) = warn
    assert line.startswith("world 'World': node 'Sky Texture': the Blender that was to draw it failed: ")
    assert line.endswith("; the world's viewport colour is used")
    assert len(small_skies) == 1


def test_a_sky_that_takes_too_long_is_given_up(scene, warn, small_skies, monkeypatch):
    monkeypatch.setattr(sky_module, "SECONDS", 0.05)
    sky(scene)
    assert world(scene, warn).environment is None
    assert "took more than" in next(iter(warn))


def mixed(scene, factor=None):
    """Backgrounds of 0.5 and of red, behind a Mix Shader."""
    b_tree = scene.world.node_tree
    b_mix, b_other = b_tree.nodes.new("ShaderNodeMixShader"), b_tree.nodes.new("ShaderNodeBackground")
    background(scene).inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    b_other.inputs["Color"].default_value = (1, 0, 0, 1)
    b_tree.links.new(background(scene).outputs[0], b_mix.inputs[1])
    b_tree.links.new(b_other.outputs[0], b_mix.inputs[2])
    b_tree.links.new(b_mix.outputs[0], b_tree.nodes["World Output"].inputs["Surface"])
    if factor is not None:
        b_tree.links.new(factor, b_mix.inputs[0])


def test_backgrounds_are_mixed(scene, warn):
    mixed(scene)
    assert world(scene, warn).radiance == (0.75, 0.25, 0.25)
    assert list(warn) == []


def test_camera_rays_can_see_another_world(scene, warn):
    b_path = scene.world.node_tree.nodes.new("ShaderNodeLightPath")
    mixed(scene, b_path.outputs["Is Camera Ray"])
    found = world(scene, warn)
    assert (found.radiance, found.backdrop.radiance) == ((0.5, 0.5, 0.5), (1, 0, 0))
    assert list(warn) == []


def test_sun_and_clamping_are_eevees(scene, warn):
    assert (world(scene, warn).sun.threshold, world(scene, warn).limit) == (10.0, 10.0)
    scene.world.sun_threshold = scene.eevee.clamp_surface_indirect = 0.0
    assert world(scene, warn).sun is None
    assert world(scene, warn).limit == math.inf


def test_a_shader_that_is_not_followed_is_named(scene, warn):
    b_tree = scene.world.node_tree
    b_tree.links.new(b_tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0], b_tree.nodes["World Output"].inputs[0])
    assert world(scene, warn).radiance == (0, 0, 0)
    assert list(warn) == ["world 'World': node 'Diffuse BSDF' (Diffuse BSDF) is not followed; it is black"]


# ------------------------------------------------------------------------------------------------ as a background set


@pytest.fixture
def animated(scene):
    """Camera, lens, world, material, object and light all move: 0 at frame 1, 10 at frame 11."""
    b_cube, b_light = bpy.data.objects["Cube"], bpy.data.objects["Light"].data
    b_metallic = b_cube.data.materials[0].node_tree.nodes["Principled BSDF"].inputs["Metallic"]
    strength = background(scene).inputs["Strength"]
    for frame, value in ((1, 0.0), (11, 10.0)):
        scene.camera.location.x = b_cube.location.y = b_light.energy = strength.default_value = value
        scene.camera.data.lens, b_metallic.default_value = 20 + value, value / 10
        for b_owner, path in (
            (scene.camera, "location"),
            (scene.camera.data, "lens"),
            (b_cube, "location"),
            (b_light, "energy"),
            (strength, "default_value"),
            (b_metallic, "default_value"),
        ):
            b_owner.keyframe_insert(path, frame=frame)
    for b_action in bpy.data.actions:
        for b_curve in curves_of(b_action):
            for b_point in b_curve.keyframe_points:
                b_point.interpolation = "LINEAR"
    return scene


def curves_of(b_action):
    if bpy.app.version < (5, 0, 0):
        return list(b_action.fcurves)
    return [c for layer in b_action.layers for strip in layer.strips for bag in strip.channelbags for c in bag.fcurves]


def trace_depsgraph(scene, frame):
    """Of another, empty scene at `frame`, with the artist's scene for a background; his own frame stays as it is."""
    b_trace = bpy.data.scenes.new("Hybrid Trace")
    b_trace.background_set, b_trace.camera = scene, scene.camera
    b_trace.frame_set(frame)
    b_trace.view_layers[0].update()
    return b_trace.view_layers[0].depsgraph


def test_a_background_set_is_translated_with_the_values_of_its_frame(animated):
    animated.frame_set(1)
    b_depsgraph = trace_depsgraph(animated, 6)
    assert animated.camera.location.x == 0.0  # so 5 below can only come from the other scene's evaluation
    result = translate(b_depsgraph, animated, SIZE, WINDOW)
    (instance,) = result.scene.instances
    (lamp,) = result.scene.lights
    assert result.scene.camera.matrix_world[0, 3] == pytest.approx(5)
    assert result.scene.camera.view_plane[1] == pytest.approx(0.5 * 36 / 25)
    assert instance.matrix_world[1, 3] == pytest.approx(5)
    assert lamp.intensity[0] == pytest.approx(5 / (4 * math.pi))
    assert result.scene.surfaces[instance.surfaces[0]].reflectivity == pytest.approx(0.5)
    assert result.scene.world.radiance == pytest.approx((5 * 0.050876,) * 3, rel=1e-3)


def test_both_depsgraphs_give_the_same_scene(animated):
    animated.frame_set(4)
    through_set = translate(trace_depsgraph(animated, 4), animated, SIZE, WINDOW).scene
    direct = translate(bpy.context.evaluated_depsgraph_get(), animated, SIZE, WINDOW).scene
    assert through_set.camera.view_plane == direct.camera.view_plane
    assert through_set.world.radiance == direct.world.radiance
    assert [lamp.intensity for lamp in through_set.lights] == [lamp.intensity for lamp in direct.lights]
    assert [i.name for i in through_set.instances] == [i.name for i in direct.instances]
    for ours, other in zip(through_set.instances, direct.instances, strict=True):
        assert np.array_equal(ours.matrix_world, other.matrix_world)
    for ours, other in zip(through_set.meshes, direct.meshes, strict=True):
        assert np.array_equal(ours.vertices, other.vertices)
        assert np.array_equal(ours.triangles, other.triangles)
