# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as arrays: what the numbers say about geometry whose shape is known."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from hybrid_addon.blender.sync import Warnings
from hybrid_addon.blender.sync.mesh import translate_mesh

pytestmark = pytest.mark.blender

QUAD = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)]


def mesh_of(vertices, faces, name="Mesh"):
    b_mesh = bpy.data.meshes.new(name)
    b_mesh.from_pydata(vertices, [], faces)
    return b_mesh


def translated(b_mesh, uv_names=(), warn=None):
    keys = [f"uv:{uv_name}" for uv_name in uv_names]
    return translate_mesh(b_mesh, "Thing", keys, warn or Warnings(), lambda: b_mesh)


def areas(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]].astype(np.float64) for corner in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def test_an_ngon_becomes_triangles_of_the_same_area_and_side(scene):
    b_mesh = mesh_of([*QUAD, (1, 2, 0)], [(0, 1, 2, 4, 3)])
    mesh = translated(b_mesh)
    assert mesh.triangles.shape == mesh.corners.shape == (3, 3)
    assert mesh.triangles.dtype == mesh.corners.dtype == np.int32
    assert mesh.vertices.dtype == np.float32
    assert areas(mesh).sum() == pytest.approx(3.0)
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_corners_and_triangles_agree(scene):
    bpy.ops.mesh.primitive_monkey_add()
    b_mesh = bpy.context.object.data
    mesh = translated(b_mesh)
    vertex_of_corner = np.array([b_loop.vertex_index for b_loop in b_mesh.loops])
    assert (vertex_of_corner[mesh.corners] == mesh.triangles).all()


def test_a_mesh_without_faces_is_none(scene):
    assert translated(mesh_of([(0, 0, 0), (1, 0, 0)], [])) is None


def test_flat_meshes_have_no_normals(scene):
    b_mesh = bpy.data.objects["Cube"].data
    assert translated(b_mesh).normals is None


def test_smooth_normals_are_the_corners_own(scene):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    b_mesh = bpy.context.object.data
    assert translated(b_mesh).normals is None
    b_mesh.shade_smooth()
    mesh = translated(b_mesh)
    at_corner = mesh.vertices[mesh.triangles]
    cosine = (mesh.normals[mesh.corners] * at_corner).sum(-1)
    assert cosine.min() > 0.999  # a unit sphere's normals are its positions
    b_mesh.polygons.foreach_set("use_smooth", [True] + [False] * (len(b_mesh.polygons) - 1))
    assert translated(b_mesh).normals is not None  # one smooth face is enough


def test_uv_maps_by_name_and_the_one_active_for_rendering(scene):
    b_mesh = mesh_of(QUAD, [(0, 1, 2, 3)])
    for name, offset in (("First", 0.0), ("Second", 10.0)):
        b_layer = b_mesh.uv_layers.new(name=name)
        b_layer.uv.foreach_set("vector", np.arange(8, dtype=np.float32) + offset)
    b_mesh.uv_layers["Second"].active_render = True
    mesh = translated(b_mesh, ["", "First"])
    assert sorted(mesh.uv_maps) == ["", "First"]
    assert mesh.uv_maps[""].tolist() == (np.arange(8).reshape(4, 2) + 10).tolist()
    assert mesh.uv_maps["First"].tolist() == np.arange(8).reshape(4, 2).tolist()


def test_a_missing_uv_map_is_zero_and_warned_of(scene):
    warn = Warnings()
    mesh = translated(mesh_of(QUAD, [(0, 1, 2, 3)]), ["Nowhere"], warn)
    assert mesh.uv_maps["Nowhere"].shape == (4, 2)
    assert not mesh.uv_maps["Nowhere"].any()
    assert "object 'Thing' has no UV map 'Nowhere'" in next(iter(warn))


def test_material_slots_follow_the_faces(scene):
    b_mesh = mesh_of([*QUAD, (0, 5, 0)], [(0, 1, 2, 3), (2, 4, 3)])
    assert translated(b_mesh).surface_slots is None
    for _ in range(4):
        b_mesh.materials.append(None)
    b_mesh.polygons[1].material_index = 3
    mesh = translated(b_mesh)
    assert mesh.surface_slots.dtype == np.int32
    assert sorted(mesh.surface_slots.tolist()) == [0, 0, 3]
    assert mesh.triangles[mesh.surface_slots == 3].max() == 4


@pytest.mark.parametrize("slots", [0, 1, 3])
@pytest.mark.parametrize("index", [-1, -(2**31)])
def test_a_face_without_a_slot_wears_the_first(scene, slots, index):
    b_mesh = mesh_of([*QUAD, (0, 5, 0)], [(0, 1, 2, 3), (2, 4, 3)])
    for _ in range(slots):
        b_mesh.materials.append(None)
    b_indices = b_mesh.attributes.get("material_index") or b_mesh.attributes.new("material_index", "INT", "FACE")
    b_indices.data.foreach_set("value", [2, index])
    assert sorted(translated(b_mesh).surface_slots.tolist()) == [0, 2, 2]
    b_indices.data.foreach_set("value", [0, index])
    assert translated(b_mesh).surface_slots is None


def test_broken_vertices_stay_and_are_counted(scene):
    warn = Warnings()
    mesh = translated(mesh_of([*QUAD, (float("nan"), 0, 0), (0, float("inf"), 0)], [(0, 1, 2, 3), (3, 4, 5)]), (), warn)
    assert len(mesh.vertices) == 6
    assert np.isnan(mesh.vertices[4, 0])
    assert list(warn) == ["object 'Thing': 2 of 6 vertices are not finite; their triangles are left out"]
