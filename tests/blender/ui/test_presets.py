# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets and the asset library that they come from."""

from __future__ import annotations

import bpy
import pytest

from hybrid_addon.blender.pipeline.transmission import surface_of
from hybrid_addon.blender.ui import presets
from hybrid_addon.presets import QUALITY

pytestmark = pytest.mark.blender


@pytest.fixture
def cube(scene):
    b_object = scene.objects["Cube"]
    bpy.context.view_layer.objects.active = b_object
    b_object.select_set(True)
    return b_object


def test_the_library_has_twenty_materials_and_three_light_rigs_with_previews(addon):
    with bpy.data.libraries.load(str(presets.LIBRARY), assets_only=True) as (found, wanted):
        assert len(found.materials) == 20 and len(found.collections) == 3
        assert {name for name, _ in presets.SURFACES.values()} <= set(found.materials)
        wanted.materials, wanted.collections = list(found.materials), list(found.collections)
    catalogs = (presets.ASSETS / "blender_assets.cats.txt").read_text(encoding="utf-8")
    for b_id in (*wanted.materials, *wanted.collections):
        assert b_id.asset_data.license == "CC0-1.0" and b_id.asset_data.description
        assert b_id.asset_data.catalog_id in catalogs
        assert len(set(b_id.preview.image_pixels)) > 100, b_id.name
    assert all(light.type == "LIGHT" for rig in wanted.collections for light in rig.objects)


def test_a_preset_is_worn_and_used_once(cube):
    for _ in range(2):
        assert bpy.ops.hybrid.surface_preset(preset="RUBY") == {"FINISHED"}
    assert cube.hybrid.ray_traced and cube.hybrid.surface == "MATERIAL"
    assert [b_slot.material.name for b_slot in cube.material_slots] == ["Ruby"]
    assert [m.name for m in bpy.data.materials if m.name.startswith("Ruby")] == ["Ruby"]
    surface = surface_of(cube.active_material, bpy.context.scene)
    assert surface.opacity == 0.0 and surface.ior == pytest.approx(1.766)
    assert surface.absorption == pytest.approx((8.0, 280.0, 200.0), rel=1e-4)


def test_each_preset_is_what_its_tooltip_says(cube):
    for key, metal in (("CHROME", True), ("GOLD", True), ("WINDOW", False), ("ICE", False)):
        bpy.ops.hybrid.surface_preset(preset=key)
        surface = surface_of(cube.active_material, bpy.context.scene)
        assert (surface.reflectivity, surface.opacity) == ((1.0, 1.0) if metal else (0.0, 0.0))


def test_a_preset_in_edit_mode_and_without_asset_marks(cube):
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.ops.hybrid.surface_preset(preset="GLASS") == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert cube.active_material.name == "Glass" and cube.active_material.asset_data is None
    assert "preset" not in cube.active_material.keys(), list(cube.active_material.keys())
    cube.active_material.name = "Of mine"
    assert presets.preset_material("Glass") == cube.active_material


def test_a_preset_changes_what_is_selected_and_no_more(cube):
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object  # selected alone
    bpy.context.view_layer.objects.active = cube
    bpy.ops.hybrid.surface_preset(preset="GLASS")
    assert plane.hybrid.ray_traced and not cube.hybrid.ray_traced
    plane.select_set(False)
    bpy.ops.hybrid.surface_preset(preset="GOLD")
    assert cube.active_material.name == "Gold" and plane.active_material.name == "Glass"


def test_a_missing_library_is_told(cube, monkeypatch, tmp_path):
    assert presets.preset_material("No such") is None
    monkeypatch.setattr(presets, "LIBRARY", tmp_path / "none.blend")
    with pytest.raises(RuntimeError, match=r"none\.blend: Glass is missing"):
        bpy.ops.hybrid.surface_preset(preset="GLASS")
    assert not cube.hybrid.ray_traced


def test_own_presets_hold_what_quality_presets_set():
    known = {f"hybrid.{name}" for name in next(iter(QUALITY.values()))[2].values()}
    assert set(presets.HYBRID_OT_quality_preset_add.preset_values) == known
    assert presets.HYBRID_OT_surface_preset_add.preset_values.index("hybrid.surface") == 4  # values set it: after them


def test_one_click_adds_the_library_once(scene):
    libraries = bpy.context.preferences.filepaths.asset_libraries
    before = len(libraries)
    for _ in range(2):
        assert bpy.ops.hybrid.add_asset_library() == {"FINISHED"}
    assert len(libraries) == before + 1 and libraries[-1].name.startswith("Hybrid")
    libraries.remove(libraries[-1])
