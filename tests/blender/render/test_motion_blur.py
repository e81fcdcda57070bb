# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur: at which moments the traced half is traced, and that it covers what EEVEE leaves free for it."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import session
from hybrid_addon.blender.render import motion_blur

pytestmark = pytest.mark.blender

SIZE = (96, 72)


def matte(name, color):
    b_material = bpy.data.materials.new(name)
    if b_material.node_tree is None:
        b_material.use_nodes = True
    b_tree = b_material.node_tree
    b_shader = b_tree.nodes.new("ShaderNodeBsdfDiffuse")
    b_shader.inputs["Color"].default_value = (*color, 1)
    b_tree.links.new(b_shader.outputs[0], b_tree.nodes["Material Output"].inputs["Surface"])
    return b_material


def keyed(b_owner, path, values):
    """Animate a property: its values at frames, evenly in between."""
    for frame, value in values.items():
        setattr(b_owner, path, value)
        b_owner.keyframe_insert(path, frame=frame)
    b_animated = b_owner.id_data  # of a shape key: the mesh's keys
    b_action = b_animated.animation_data.action
    b_curves = getattr(b_action, "fcurves", None) or b_action.layers[0].strips[0].channelbags[0].fcurves
    for b_curve in b_curves:
        for b_key in b_curve.keyframe_points:
            b_key.interpolation = "LINEAR"


@pytest.fixture(scope="module")
def blurred(addon, tmp_path_factory):
    """A matte ball that flies, a bar that grows by a shape key, a panning camera: hybrid, and EEVEE alone."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    for name in ("Cube", "Light"):
        bpy.data.objects.remove(bpy.data.objects[name])
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.5, 0.6, 0.8, 1)
    scene.camera.location, scene.camera.rotation_euler = (0, -8, 0), (np.pi / 2, 0, 0)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.9, location=(-1, 0, 1))
    ball = bpy.context.object
    ball.data.materials.append(matte("Ball", (0.8, 0.2, 0.1)))
    keyed(ball, "location", {0: (-2.5, 0, 0.9), 2: (0.5, 0, 0.9)})
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, -1))
    bar = bpy.context.object
    bar.data.materials.append(matte("Bar", (0.1, 0.7, 0.2)))
    bar.shape_key_add(name="Basis")
    key = bar.shape_key_add(name="Long")
    for point in key.data:
        point.co.x *= 5
    keyed(key, "value", {0: 0.0, 2: 1.0})
    keyed(scene.camera, "location", {0: (-0.2, -8, 0), 2: (0.2, -8, 0)})
    scene.frame_set(1)
    for b_object in (ball, bar):
        hybrid.mark(b_object)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.5
    scene.eevee.motion_blur_steps, scene.eevee.taa_render_samples, scene.eevee.use_shadows = 8, 16, False
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = *SIZE, 100
    hybrid.enable(scene)
    result = hybrid.render(scene, samples=32)
    traced_at = scene.frame_current + scene.frame_subframe
    hybrid.disable(scene)
    path = tmp_path_factory.mktemp("blur") / "eevee.exr"
    scene.render.image_settings.file_format, scene.render.filepath = "OPEN_EXR", str(path)
    bpy.ops.render.render(write_still=True)
    b_image = bpy.data.images.load(str(path))
    eevee = np.zeros(SIZE[0] * SIZE[1] * 4, np.float32)
    b_image.pixels.foreach_get(eevee)
    return SimpleNamespace(
        scene=scene, result=result, eevee=eevee.reshape(SIZE[1], SIZE[0], 4)[..., :3], traced_at=traced_at
    )


@pytest.mark.render
def test_both_halves_meet_at_blurred_edges(blurred):
    """Camera, object and shape move at once. Where nothing is blurred both halves agree anyway."""
    mask, picture = blurred.result.mask, blurred.result.image[..., :3]
    edge = (mask > 0.02) & (mask < 0.98)
    assert np.count_nonzero(edge) > 400
    off = (picture - blurred.eevee)[edge]
    mean = blurred.eevee[edge].mean()
    assert abs(off.mean()) < 0.01 * mean
    assert np.abs(off).mean() < 0.02 * mean


@pytest.mark.render
def test_colours_stay_those_of_the_objects_where_they_pass(blurred):
    """Of a moment alone a third of the swept pixels would have the colour of another place."""
    mask, traced = blurred.result.mask, blurred.result.traced
    seen = mask > 0.05
    color = traced[..., :3][seen] / mask[seen, None]
    is_ball, is_bar = color[:, 0] > color[:, 1], color[:, 1] > color[:, 0]
    assert np.count_nonzero(is_ball) > 300 and np.count_nonzero(is_bar) > 100
    ratio = color[is_ball] / color[is_ball].sum(axis=1, keepdims=True)
    assert np.abs(ratio - np.median(ratio, axis=0)).mean() < 0.02


@pytest.mark.render
def test_blender_stands_at_its_frame_afterwards_and_nothing_is_warned_of(blurred):
    assert blurred.traced_at == 1.0
    assert not [line for line in blurred.result.report["warnings"] if "blur" in line]
    assert session.of(blurred.scene.name).error is None


def times(scene, samples=64, **settings):
    for name, value in settings.items():
        setattr(scene.eevee if hasattr(scene.eevee, name) else scene.render, name, value)
    return np.array(motion_blur.moments(scene, samples))


def test_moments_are_the_middles_of_even_parts_of_the_shutter_time(scene):
    scene.frame_set(7)
    assert times(scene).tolist() == [7.0]
    scene.render.use_motion_blur = True
    found = times(scene, motion_blur_steps=4, motion_blur_shutter=0.5, motion_blur_position="CENTER")
    assert len(found) == 8
    assert np.allclose(found, 7 + 0.5 * ((np.arange(8) + 0.5) / 8 - 0.5))
    assert np.allclose(times(scene, motion_blur_position="START"), found + 0.25)
    assert np.allclose(times(scene, motion_blur_position="END"), found - 0.25)
    assert len(times(scene, motion_blur_steps=3)) == 9  # each of EEVEE's steps has as many
    assert len(times(scene, motion_blur_steps=20)) == 20
    assert len(times(scene, samples=6)) == 3  # two samples are left for each
    assert [len(times(scene, samples=n)) for n in (2, 3, 4)] == [2, 2, 2]  # rather unfiltered than standing still
    assert motion_blur.warnings(scene, 2) == []
    assert times(scene, samples=1).tolist() == [7.0]
    (line,) = motion_blur.warnings(scene, 1)
    assert "stand still" in line
    scene.render.use_motion_blur = False
    assert motion_blur.warnings(scene, 1) == []


def test_the_view_layer_can_do_without(scene):
    scene.render.use_motion_blur = True
    scene.view_layers[0].use_motion_blur = False
    assert times(scene).tolist() == [1.0]


def test_the_shutter_curve_deals_out_the_moments(scene):
    """A shutter that is open in its second half only."""
    scene.render.use_motion_blur = True
    b_points = scene.render.motion_blur_shutter_curve.curves[0].points
    while len(b_points) > 2:
        b_points.remove(b_points[1])
    (b_points[0].location, b_points[1].location) = (0, 0), (1, 0)
    for place in ((0.499, 0), (0.501, 1), (0.999, 1)):
        b_points.new(*place).handle_type = "VECTOR"
    for b_point in b_points:
        b_point.handle_type = "VECTOR"
    scene.render.motion_blur_shutter_curve.update()
    found = times(scene, motion_blur_steps=8, motion_blur_shutter=1.0, motion_blur_position="START") - 1
    assert np.allclose(found, 0.5 + (np.arange(8) + 0.5) / 16, atol=0.01)
