# SPDX-License-Identifier: GPL-3.0-or-later
"""One picture from each camera, into files named after them."""

from __future__ import annotations

import bpy
import pytest

from hybrid_addon.blender.ui import cameras

pytestmark = pytest.mark.blender


def add_camera(scene, name, x=0.0):
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    camera.location, camera.rotation_euler = (x, -6, 1), (1.4, 0, 0)
    scene.collection.objects.link(camera)
    return camera


def test_each_camera_has_a_file_of_its_own(scene, tmp_path):
    found = [add_camera(scene, name) for name in ("Front / Left", "Front_/_Left")]
    scene.frame_current, scene.render.image_settings.file_format = 7, "PNG"
    for output, names in (
        (f"{tmp_path}/", ["Front___Left.png", "Front___Left.001.png"]),
        (f"{tmp_path}/shot_###.png", ["shot_007_Front___Left.png", "shot_007_Front___Left.001.png"]),
    ):
        scene.render.filepath = output
        paths = cameras.pictures(scene, found)
        assert [path.name for path in paths.values()] == names
        assert all(path.parent == tmp_path for path in paths.values())


def test_all_cameras_are_rendered_and_the_scene_is_as_before(scene, tmp_path):
    """But for what is hidden; without EEVEE, which these pictures do not need."""
    before = scene.camera
    add_camera(scene, "Left", -1.0)
    add_camera(scene, "Hidden").hide_render = True
    scene.hybrid.enabled, scene.hybrid.mode, scene.hybrid.samples = True, "FULL", 1
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 16, 12, 100
    scene.render.filepath = f"{tmp_path}/"
    assert bpy.ops.hybrid.render_cameras(which="ALL") == {"FINISHED"}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["Camera.png", "Left.png"]
    assert (tmp_path / "Camera.png").read_bytes() != (tmp_path / "Left.png").read_bytes()
    assert scene.camera == before and scene.render.filepath == f"{tmp_path}/"


def test_a_camera_that_fails_leaves_no_picture_and_does_not_stop_the_others(scene, tmp_path, monkeypatch):
    from hybrid_addon.blender.errors import HybridError
    from hybrid_addon.blender.render import engine

    add_camera(scene, "Left")
    trace_frame = engine.trace_frame

    def fails(b_scene, *given):
        if b_scene.camera.name == "Camera":
            raise HybridError("the lens is dirty")
        return trace_frame(b_scene, *given)

    monkeypatch.setattr(engine, "trace_frame", fails)
    scene.hybrid.enabled, scene.hybrid.mode, scene.hybrid.samples = True, "FULL", 1
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 16, 12, 100
    scene.render.filepath = f"{tmp_path}/"
    with pytest.raises(RuntimeError, match="the lens is dirty"):
        bpy.ops.hybrid.render_cameras(which="ALL")
    assert [path.name for path in tmp_path.iterdir()] == ["Left.png"]
