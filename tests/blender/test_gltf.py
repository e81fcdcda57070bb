# SPDX-License-Identifier: GPL-3.0-or-later
"""Dispersion of imported glTF files."""

from __future__ import annotations

import json

import bpy
import pytest

pytestmark = pytest.mark.blender


@pytest.fixture
def importer():
    """Blender's importer, which asks the add-ons of the preferences."""
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    b_addon = bpy.context.preferences.addons.new()
    b_addon.module = "hybrid_addon"
    yield
    bpy.context.preferences.addons.remove(b_addon)


@pytest.mark.parametrize(("value", "expected"), [(0.36, 0.36), (None, 0.0), (-1.0, 0.0)])
def test_dispersion_is_read_from_gltf(scene, importer, tmp_path, value, expected):
    bpy.ops.mesh.primitive_cube_add()
    b_material = bpy.data.materials.new("Crown")
    bpy.context.object.data.materials.append(b_material)
    path = tmp_path / "cube.gltf"
    bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLTF_SEPARATE", use_selection=True)
    document = json.loads(path.read_text())
    if value is not None:
        document["materials"][0]["extensions"] = {"KHR_materials_dispersion": {"dispersion": value}}
        document["extensionsUsed"] = ["KHR_materials_dispersion"]
        path.write_text(json.dumps(document))
    before = set(bpy.data.materials)
    bpy.ops.import_scene.gltf(filepath=str(path))
    (b_imported,) = set(bpy.data.materials) - before
    assert b_imported.hybrid.dispersion == pytest.approx(expected)
    assert b_imported.hybrid.surface == "MATERIAL"
