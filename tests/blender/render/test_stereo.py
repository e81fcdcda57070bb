# SPDX-License-Identifier: GPL-3.0-or-later
"""Stereoscopy: each view is a hybrid picture of its own, seen from where Blender has that view's camera."""

from __future__ import annotations

import time

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import view_layers
from hybrid_addon.blender.render import images, multilayer
from tests.blender.kit import empty_scene

pytestmark = [pytest.mark.blender, pytest.mark.render]

SIZE = WIDTH, HEIGHT = 48, 32
APART, CONVERGENCE = 1.0, 6.0  # metres


@pytest.fixture(scope="module")
def pair():
    """A mirror ball, ray traced, before a wall of two colours; a camera on the y axis; two views."""
    scene = empty_scene(*SIZE, 1)
    scene.hybrid.samples, scene.render.film_transparent = 1, True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 1.0
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0, -CONVERGENCE, 0), (np.pi / 2, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.data.lens = 35
    camera.data.stereo.interocular_distance, camera.data.stereo.convergence_distance = APART, CONVERGENCE
    bpy.ops.mesh.primitive_cube_add(size=2, location=(1.5, 3, 0))
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
    hybrid.mark(bpy.context.object, reflectivity=0.8)
    scene.render.use_multiview = True
    hybrid.enable(scene)
    return scene


def _centre(result):
    return (result.mask.sum(axis=0) @ np.arange(WIDTH)) / result.mask.sum()


def test_each_eye_sees_what_a_camera_there_sees_and_files_have_both(pair, tmp_path):
    scene, camera = pair, pair.camera
    camera.data.stereo.convergence_mode, camera.data.stereo.pivot = "PARALLEL", "CENTER"
    both = hybrid.render(scene)
    assert list(both.views) == ["left", "right"] and both.views["left"].report is both.report
    assert set(both.report["layers"]) == {"ViewLayer.left", "ViewLayer.right"}
    _check_files(scene, both, tmp_path)
    camera.location.x, scene.render.use_multiview = APART / 2, False
    try:
        alone = hybrid.render(scene)
    finally:
        camera.location.x, scene.render.use_multiview = 0, True
    for part in ("image", "raster", "traced", "mask"):
        np.testing.assert_allclose(getattr(both.views["right"], part), getattr(alone, part), atol=2e-3)
    assert not alone.views
    for seen in both.views.values():
        np.testing.assert_allclose(seen.image, seen.raster + seen.traced, atol=1e-6)
    assert _centre(both.views["left"]) - _centre(both.views["right"]) == pytest.approx(
        camera.data.lens / camera.data.sensor_width * WIDTH * APART / CONVERGENCE, rel=0.05
    )


def _check_files(scene, both, folder):
    """Of both views together, and of each: a picture, and a multilayer EXR as Blender writes and then tells of it."""
    images.write_render_result(folder / "one.exr", scene)
    assert sorted(path.name for path in folder.iterdir()) == ["one_L.exr", "one_R.exr"]
    settings = scene.render.image_settings
    settings.views_format = "STEREO_3D"
    images.write_render_result(folder / "pair.png", scene)
    assert settings.views_format == "STEREO_3D"
    image = bpy.data.images.load(str(folder / "pair.png"))
    assert WIDTH * HEIGHT in {image.size[0] * image.size[1], image.size[0] * image.size[1] // 2}
    for views_format in ("MULTIVIEW", "INDIVIDUAL"):
        scene.render.filepath = str(folder / views_format)
        with images.image_settings(scene, "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"):
            settings.views_format = views_format
            images._save_render(scene.render.frame_path(frame=scene.frame_current), scene)
            multilayer.written(scene, time.time())
            number = f"{views_format}{scene.frame_current:04d}"
        for view, result in both.views.items():
            tail = "" if views_format == "MULTIVIEW" else scene.render.views[view].file_suffix
            planes = images.of_view(images.read_exr(folder / f"{number}{tail}.exr"), view)
            assert not any(name.startswith(view_layers.MASK_LAYER) for name in planes)
            np.testing.assert_array_equal(planes["ViewLayer.Combined"], result.raster + result.traced)
            np.testing.assert_array_equal(planes["ViewLayer.Traced"], result.traced)


@pytest.mark.parametrize("mode", ["OFFAXIS", "TOE"])
@pytest.mark.parametrize("pivot", ["CENTER", "RIGHT"])
def test_what_is_at_the_convergence_distance_is_at_one_place_in_both_eyes(pair, mode, pivot):
    """There off-axis frusta and toed-in axes cross; with the pivot at one eye that one is the camera itself."""
    stereo = pair.camera.data.stereo
    stereo.convergence_mode, stereo.pivot = mode, pivot
    pair.hybrid.passes = {"DEPTH"}
    both = hybrid.render(pair, mode="full")
    # The middle of all that is nearer than the cube: the ball, whatever it mirrors.
    near = {name: own.passes["depth"] < CONVERGENCE + 1 for name, own in both.views.items()}
    middle = {name: np.nonzero(where)[1].mean() for name, where in near.items()}
    assert middle["left"] == pytest.approx(middle["right"], abs=0.5)
    if pivot == "RIGHT":
        assert middle["right"] == pytest.approx((WIDTH - 1) / 2, abs=0.5)


def test_each_view_may_have_a_camera_of_its_own(pair):
    """MULTIVIEW: those that are called as the scene's, but for the views' suffixes; at most one of each."""
    pair.render.views_format = "MULTIVIEW"
    pair.render.views.new("up").camera_suffix = "_UP"
    names = {"left": "Rig_L", "right": "Rig_R"}
    for name in names.values():
        pair.collection.objects.link(bpy.data.objects.new(name, pair.camera.data))
    before, pair.camera = pair.camera, bpy.data.objects["Rig_L"]
    try:
        assert view_layers.views(pair) == ["left", "right", "up"]
        seen = {}
        for view in view_layers.views(pair):
            with view_layers.in_work(pair, pair.view_layers[0], view):
                seen[view] = view_layers.camera_in_work(pair).name
        assert seen == {**names, "up": "Rig_L"}
        pair.render.views["right"].use = False
        assert view_layers.views(pair) == ["left", "up"]
    finally:
        pair.camera = before
