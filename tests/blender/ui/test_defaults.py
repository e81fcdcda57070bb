# SPDX-License-Identifier: GPL-3.0-or-later
"""Defaults that have changed: files from before keep theirs, whether they are opened or appended from."""

from __future__ import annotations

import bpy
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import handlers
from hybrid_addon.blender.ui import defaults

pytestmark = pytest.mark.blender

TODAY = {"samples": 16, "adaptive": 0.05, "rough_samples": 1, "traced_shadows": "AUTO", "preview_budget": 0.0}
BEFORE = {"samples": 16, "adaptive": 0.0, "rough_samples": 0, "traced_shadows": "OFF", "preview_budget": 3.0}


def held(scene):
    values = {name: getattr(scene.hybrid, name) for name in TODAY}
    return {name: round(v, 6) if isinstance(v, float) else v for name, v in values.items()}


def old_file(path, values):
    """As the add-on wrote it when it had no version: what was set, ticks as numbers; and a scene with nothing."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.name = "Old"
    bpy.data.scenes.new("Untouched")
    owner = scene.bl_system_properties_get(do_create=True) if hasattr(scene, "bl_system_properties_get") else scene
    if "hybrid" not in owner:
        owner["hybrid"] = {}
    for name, value in values.items():
        owner["hybrid"][name] = value
    handlers.unregister()  # which would write the version
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_factory_settings()
    handlers.register()
    return str(path)


def test_a_new_scene_has_todays(scene):
    assert held(scene) == TODAY
    hybrid.enable(scene)
    assert held(scene) == TODAY and scene.hybrid.version == defaults.VERSION


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"enabled": 1}, BEFORE),
        ({"enabled": 1, "traced_shadows": 1, "samples": 4}, {**BEFORE, "traced_shadows": "ON", "samples": 4}),
        ({"enabled": 1, "traced_shadows": 0, "rough_samples": 8}, {**BEFORE, "rough_samples": 8}),
        ({"samples": 8}, {**BEFORE, "samples": 8}),
    ],
)
def test_an_old_file_keeps_its_own(addon, tmp_path, values, expected):
    path = old_file(tmp_path / "old.blend", values)
    for _ in range(2):  # and once more after it was saved by today's
        bpy.ops.wm.open_mainfile(filepath=path)
        assert held(bpy.data.scenes["Old"]) == expected
        assert held(bpy.data.scenes["Untouched"]) == TODAY
        assert not bpy.data.scenes["Untouched"].hybrid.version
        bpy.ops.wm.save_mainfile()


def test_an_appended_scene_keeps_its_own_and_what_is_open_is_left_alone(addon, tmp_path):
    path = old_file(tmp_path / "old.blend", {"enabled": 1})
    bpy.context.scene.hybrid.samples = 3  # settings of today that no file has seen yet
    with bpy.data.libraries.load(path) as (_, into):
        into.scenes = ["Old"]
    assert held(into.scenes[0]) == BEFORE
    assert held(bpy.context.scene) == {**TODAY, "samples": 3}


def test_a_file_of_today_keeps_todays_also_where_hybrid_was_never_on(scene, tmp_path):
    scene.hybrid.samples = 3
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "new.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "new.blend"))
    assert held(bpy.context.scene) == {**TODAY, "samples": 3}


def test_an_old_file_that_is_open_when_the_add_on_is_switched_on(addon, tmp_path):
    path = old_file(tmp_path / "old.blend", {"enabled": 1})
    addon.unregister()
    bpy.ops.wm.open_mainfile(filepath=path)
    addon.register()
    assert held(bpy.data.scenes["Old"]) == BEFORE
