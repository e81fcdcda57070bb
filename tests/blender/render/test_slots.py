# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that are ray traced by themselves: only the faces that wear them are held out, and traced."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.pipeline import scene_setup

from ..kit import empty_scene, nodes_of

pytestmark = [pytest.mark.blender, pytest.mark.render]


def material(name, **inputs):
    b_material = bpy.data.materials.new(name)
    shader = nodes_of(b_material).nodes["Principled BSDF"]
    for key, value in inputs.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    return b_material


def ball(name, materials, upper=True, lower=True):
    """A ball, flat shaded, whose upper half wears the first material, the lower the second; of both halves or one."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, segments=32, ring_count=16)
    b_object = bpy.context.object
    b_object.name = name
    for b_material in materials:
        b_object.data.materials.append(b_material)
    gone = [f.index for f in b_object.data.polygons if not (upper if f.center.z > 0 else lower)]
    for face in b_object.data.polygons:
        face.material_index = int(face.center.z < 0) % len(materials)
    if gone:
        import bmesh

        mesh = bmesh.new()
        mesh.from_mesh(b_object.data)
        mesh.faces.ensure_lookup_table()
        bmesh.ops.delete(mesh, geom=[mesh.faces[i] for i in gone], context="FACES")
        mesh.to_mesh(b_object.data)
        mesh.free()
    return b_object


def stage():
    scene = empty_scene(48, 48, 1)
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (0.2, 0.5, 0.9, 1), 1.0
    bpy.ops.object.light_add(type="SUN", rotation=(0.6, 0.3, 0))
    bpy.context.object.data.energy = 3
    bpy.ops.object.camera_add(location=(0, -4, 0), rotation=(np.pi / 2, 0, 0))
    scene.camera = bpy.context.object
    chrome = material("Chrome", Base_Color=(0.9, 0.9, 0.9, 1), Metallic=1.0, Roughness=0.0)
    matte = material("Matte", Base_Color=(0.8, 0.2, 0.1, 1), Roughness=1.0, Specular_IOR_Level=0.0)
    return scene, chrome, matte


@pytest.fixture(scope="module")
def rendered(addon):
    r = SimpleNamespace()
    scene, chrome, matte = stage()
    ball("Both", [chrome, matte])
    hybrid.mark(chrome)
    hybrid.enable(scene)
    before = len(chrome.node_tree.nodes)
    r.slots = hybrid.render(scene, samples=4, traced_shadows=False)
    r.plan = hybrid.plan(scene)
    r.nodes = (before, len(chrome.node_tree.nodes))
    r.held = scene_setup.ray_traced_objects(scene)
    scene, chrome, matte = stage()
    hybrid.mark(ball("Upper", [chrome], lower=False))
    ball("Lower", [matte], upper=False)
    r.halves = hybrid.render(scene, samples=4, traced_shadows=False)
    return r


def test_two_slots_are_two_halves_with_a_flag_each(rendered):
    """Off the seam, which is one edge, walked by two filters; the traced half sees the matte one in both."""
    a, b = rendered.slots, rendered.halves
    rows = np.abs(np.arange(48) - 23.5) > 2
    np.testing.assert_allclose(a.image[rows], b.image[rows], atol=2e-3)
    np.testing.assert_allclose(a.mask, b.mask, atol=1e-6)
    np.testing.assert_allclose(a.raster, b.raster, atol=1e-3)
    assert 0.1 < a.mask.mean() < 0.4 and a.mask[:22].max() == 0


def test_the_raster_and_the_mask_share_every_pixel(rendered):
    np.testing.assert_allclose(rendered.slots.raster[..., 3] + rendered.slots.mask, 1, atol=1e-6)
    np.testing.assert_array_equal(rendered.slots.image, rendered.slots.raster + rendered.slots.traced)
    np.testing.assert_array_equal(rendered.slots.traced[rendered.slots.mask == 0], 0)


def test_nothing_of_the_file_is_changed_and_the_report_tells(rendered):
    assert rendered.nodes[0] == rendered.nodes[1] and rendered.held == []
    assert rendered.slots.report["counts"]["ray_traced"] == 1 and rendered.slots.report["warnings"] == []
    assert rendered.plan["ray_traced"] == [] and rendered.plan["ray_traced_materials"] == ["Chrome"]
    assert rendered.plan["mode"] == "HYBRID"


def still_life():
    """A pane of half alpha, a ball that geometry nodes give its material, an instanced cone, over a ground; in sun."""
    scene = empty_scene(32, 32, 1)
    scene.eevee.use_shadows = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (0.2, 0.5, 0.9, 1), 0.5
    bpy.ops.object.light_add(type="SUN", rotation=(0.5, 0.5, 0))
    bpy.context.object.data.energy = 3
    bpy.ops.object.camera_add(location=(0, -7, 4), rotation=(1.05, 0, 0))
    scene.camera = bpy.context.object
    bpy.ops.mesh.primitive_plane_add(size=12)
    bpy.context.object.data.materials.append(material("Ground", Roughness=1.0))
    half, red, gold = (
        material("Half", Alpha=0.5),
        material("Red", Base_Color=(0.8, 0.1, 0.1, 1)),
        material("Gold", Alpha=0.7),
    )
    gold.surface_render_method = "BLENDED"
    bpy.ops.mesh.primitive_plane_add(size=1.6, location=(-1.4, 0, 1.2), rotation=(1.2, 0, 0))
    pane = bpy.context.object
    pane.data.materials.append(half)
    bpy.ops.mesh.primitive_ico_sphere_add(radius=0.7, location=(0.2, 0, 0.9))
    made = bpy.context.object
    tree = bpy.data.node_groups.new("Paint", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    ends = [tree.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeSetMaterial", "NodeGroupOutput")]
    ends[1].inputs["Material"].default_value = red
    tree.links.new(ends[1].inputs[0], ends[0].outputs[0])
    tree.links.new(ends[2].inputs[0], ends[1].outputs[0])
    made.modifiers.new("Paint", "NODES").node_group = tree
    bpy.ops.mesh.primitive_cone_add(radius1=0.6, depth=1.4)
    cone = bpy.context.object
    cone.data.materials.append(gold)
    shown = bpy.data.collections.new("Shown")
    shown.objects.link(cone)
    scene.collection.objects.unlink(cone)
    empty = bpy.data.objects.new("Shows", None)
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", shown, (1.8, 0, 0.8)
    scene.collection.objects.link(empty)
    return scene, (pane, made, empty), (half, red, gold)


def test_a_material_is_as_the_object_that_wears_nothing_else(addon):
    """Dithered and blended alpha, traced shadows, geometry nodes, an instance: one picture, to the bit."""
    scene, objects, materials = still_life()
    pictures = []
    for ticked in (objects, materials):
        for b_id in ticked:
            hybrid.mark(b_id)
        pictures.append(hybrid.render(scene, samples=4, traced_shadows=True))
        for b_id in ticked:
            hybrid.unmark(b_id)
    a, b = pictures
    assert 0.1 < a.mask.mean() < 0.5
    for name in ("mask", "raster", "image"):
        np.testing.assert_array_equal(getattr(b, name), getattr(a, name))


def test_what_cannot_be_held_out_is_refused_and_named(scene):
    plain = material("Worn")
    bpy.ops.object.metaball_add()
    bpy.context.object.data.materials.append(plain)
    with pytest.raises(hybrid.HybridError, match="metaball 'Mball' wears it"):
        hybrid.mark(plain)
    plain.hybrid.ray_traced = True
    bpy.data.objects["Cube"].data.materials.clear()
    bpy.data.objects["Cube"].data.materials.append(plain)
    found = hybrid.plan(scene)
    assert found["mode"] == "RASTER" and found["ray_traced_materials"] == []
    assert any("metaball" in warning for warning in found["warnings"])


def test_clearing_and_note_know_materials(scene):
    worn = bpy.data.objects["Cube"].data.materials[0]
    hybrid.mark(worn)
    assert scene_setup.effective_mode(scene) == "HYBRID"
    bpy.ops.hybrid.clear_all()
    assert not worn.hybrid.ray_traced and scene_setup.effective_mode(scene) == "RASTER"
