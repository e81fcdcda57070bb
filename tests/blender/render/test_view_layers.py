# SPDX-License-Identifier: GPL-3.0-or-later
"""Every view layer in which a ray traced object is visible is hybrid, and so are objects of background scenes."""

from __future__ import annotations

import time

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import session, view_layers
from hybrid_addon.blender.pipeline import nodes, scene_setup, trace_scenes
from hybrid_addon.blender.render import images, multilayer
from tests.blender.kit import empty_scene, nodes_of

pytestmark = [pytest.mark.blender, pytest.mark.render]

WIDTH, HEIGHT = 60, 20
NEAR, FAR, THERE, NEXT = 0, 1, 2, 3  # places, from left to right


def _pixels(place):
    """Some of a place that its square fills."""
    return slice(8, 12), slice(15 * place + 6, 15 * place + 9)


def _square(name, place, collection, color):
    """One that shines, before the camera."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    b_material = bpy.data.materials.new(name)
    tree = nodes_of(b_material)
    tree.nodes.clear()
    emission, output = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
    emission.inputs["Color"].default_value = (*color, 1)
    tree.links.new(output.inputs["Surface"], emission.outputs[0])
    mesh.materials.append(b_material)
    b_object = bpy.data.objects.new(name, mesh)
    b_object.location.x = 3 * (place - 1.5)
    collection.objects.link(b_object)
    return b_object


@pytest.fixture(scope="module")
def layered():
    """Near (blue) is in layer Front, Far (green) in layer Back, There (red) in the background scene; Next in both."""
    scene = empty_scene(WIDTH, HEIGHT, 1)
    scene.render.film_transparent = True
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", 12
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.location.z = 5
    scene.collection.objects.link(scene.camera)
    stage = bpy.data.scenes.new("Stage")
    scene.background_set = stage
    homes = {name: bpy.data.collections.new(name) for name in ("Front", "Back")}
    for home in homes.values():
        scene.collection.children.link(home)
    ticked = [
        _square("Near", NEAR, homes["Front"], (0, 0, 1)), _square("Far", FAR, homes["Back"], (0, 1, 0)),
        _square("There", THERE, stage.collection, (1, 0, 0)),
    ]  # fmt: skip
    _square("Next", NEXT, scene.collection, (1, 1, 1))
    front, back = scene.view_layers[0], scene.view_layers.new("Back")
    front.name = "Front"
    for layer, hidden in ((front, "Back"), (back, "Front")):
        layer.layer_collection.children[hidden].exclude = True
    for b_object in ticked:
        hybrid.mark(b_object)
    hybrid.enable(scene)
    scene.hybrid.passes, scene.hybrid.traced_shadows = {"DEPTH"}, "OFF"
    scene.view_layers[0].use_pass_z = True
    result = hybrid.render(scene)
    return scene, result, dict(session.of(scene.name).frames)


def test_each_layer_has_its_own_halves(layered):
    _, result, frames = layered
    assert list(frames) == ["Front", "Back"]
    shown = {"Front": (NEAR, THERE), "Back": (FAR, THERE)}
    colors = {NEAR: (0, 0, 1, 1), FAR: (0, 1, 0, 1), THERE: (1, 0, 0, 1), NEXT: (1, 1, 1, 1)}
    for name, frame in frames.items():
        for place, color in colors.items():
            half = frame.raster if place == NEXT else frame.traced
            there = place in (*shown[name], NEXT)
            np.testing.assert_allclose(
                half[_pixels(place)], np.broadcast_to(color if there else 0, (4, 3, 4)), atol=1e-4
            )
            np.testing.assert_array_equal(frame.mask[_pixels(place)], float(place in shown[name]))
    assert set(result.report["layers"]) == {"Front", "Back"}
    np.testing.assert_allclose(result.image, frames["Front"].raster + frames["Front"].traced, atol=1e-6)


def test_a_multilayer_file_has_the_hybrid_picture_and_no_layer_of_ours(layered, tmp_path):
    """As Blender writes it in an animation, and then tells `render_write`."""
    scene, _, frames = layered
    scene.render.filepath = str(tmp_path / "frame_")
    path = scene.render.frame_path(frame=scene.frame_current)
    with images.image_settings(scene, "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"):
        path = scene.render.frame_path(frame=scene.frame_current)
        bpy.data.images["Render Result"].save_render(path, scene=scene)
        before = images.read_exr(path)
        multilayer.written(scene, time.time())
    after = images.read_exr(path)
    masks = {name for name in before if name.startswith("Hybrid Mask")}
    own = {f"{layer}.{name}" for layer in frames for name in ("Mask", "Raster", "Traced")}
    assert masks and after.keys() == before.keys() - masks | own | {"Front.Traced Depth", "Back.Depth"}
    for layer, frame in frames.items():
        np.testing.assert_array_equal(after[f"{layer}.Combined"], frame.raster + frame.traced)
        np.testing.assert_array_equal(after[f"{layer}.Mask"][..., 0], frame.mask)
    np.testing.assert_array_equal(after["Front.Depth"], before["Front.Depth"])
    picture = bpy.data.images.load(path)
    assert len(picture.pixels) == 0 and picture.type == "MULTILAYER"  # Blender reads it


def test_a_retrace_goes_over_every_layer(layered):
    """All are traced again, with other samples, over the same bits of EEVEE's."""
    scene, _, frames = layered
    result = hybrid.retrace(scene, samples=4)
    again = session.of(scene.name).frames
    assert list(again) == list(result.report["layers"]) == ["Front", "Back"]
    for name, frame in again.items():
        assert frame is not frames[name] and any("retraced" in each["why"] for each in frame.report["skipped"])
        np.testing.assert_array_equal(frame.raster, frames[name].raster)
        np.testing.assert_array_equal(frame.mask, frames[name].mask)
        np.testing.assert_allclose(frame.traced, frames[name].traced, atol=0.02)


def test_every_layer_moves_within_its_share_of_the_time(layered):
    """Both objects move by a third of their width; where they are for a part of the time, rays meet them, too."""
    scene, _, _ = layered
    moving = [bpy.data.objects[name] for name in ("Near", "Far")]
    for b_object in moving:
        b_object.keyframe_insert("location", frame=1)
        b_object.location.x += 1.4
        b_object.keyframe_insert("location", frame=3)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    scene.eevee.taa_render_samples, scene.hybrid.samples, scene.hybrid.time_budget = 1, 8, 1000
    try:
        result = hybrid.render(scene, frame=2)
        frames = session.of(scene.name).frames
    finally:
        scene.render.use_motion_blur, scene.hybrid.time_budget = False, 0
        for b_object in moving:
            b_object.animation_data_clear()
    assert list(frames) == ["Front", "Back"] and not any("Time Limit" in each for each in result.report["warnings"])
    for name, place, channel in (("Front", NEAR, 2), ("Back", FAR, 1)):
        around = (slice(8, 12), slice(15 * place, 15 * place + 13))
        mask, traced = frames[name].mask[around], frames[name].traced[around][..., channel]
        assert ((mask > 0.2) & (mask < 0.8)).any() and (mask == 1).any()
        np.testing.assert_allclose(traced, mask, atol=2e-3)


def test_the_user_keeps_his_layers_and_collections(layered):
    scene, _, _ = layered
    assert [layer.use for layer in view_layers.own_layers(scene)] == [True, True]
    assert not scene_setup.own_collections(scene)
    assert [c.name for c in bpy.data.objects["Near"].users_collection] == ["Front"]
    assert not any(b_object.is_holdout for b_object in bpy.data.objects)


def test_a_layer_that_is_switched_off_is_hybrid_no_more(layered):
    """The one that is left needs no picture of EEVEE's with everything in it, once the film is opaque."""
    scene, _, _ = layered
    scene.render.film_transparent, scene.view_layers["Back"].use = False, False
    scene_setup.sync(scene)
    front = scene.view_layers["Front"]
    assert view_layers.source_layers(scene) == [front] and not front.use and view_layers.is_wanted(front)
    assert len(view_layers.mask_layers(scene)) == 1
    assert trace_scenes.find(scene, front) is not None
    scene.view_layers["Back"].use = True
    scene_setup.sync(scene)
    assert front.use and len(view_layers.mask_layers(scene)) == 2
    scene.view_layers["Back"].name = "Renamed"
    scene_setup.sync(scene)
    numbers = {view_layers.number_of(layer) for layer in view_layers.source_layers(scene)}
    tree = nodes.compositor_tree(scene)
    ours = [node for node in tree.nodes if nodes.role(node) == "trace"]
    assert {nodes.layer_number(node) for node in ours} == numbers and len(ours) == len(numbers) == 2
    hybrid.disable(scene)
    assert [(layer.name, layer.use, "hybrid" in str(list(layer.keys()))) for layer in scene.view_layers] == [
        ("Front", True, False), ("Renamed", True, False),
    ]  # fmt: skip
