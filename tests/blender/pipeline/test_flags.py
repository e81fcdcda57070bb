# SPDX-License-Identifier: GPL-3.0-or-later
"""Flags of objects and collections; values of objects and materials, keyframed and driven; their operators."""

from __future__ import annotations

import bpy
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.pipeline import scene_setup, traced_objects
from hybrid_addon.blender.pipeline.fingerprint import fingerprint
from hybrid_addon.blender.scan import translated

pytestmark = pytest.mark.blender


def add(scene, name, collection=None):
    b_object = bpy.data.objects.new(name, bpy.data.objects["Cube"].data)
    (collection or scene.collection).objects.link(b_object)
    return b_object


def child(parent, name):
    collection = bpy.data.collections.new(name)
    parent.children.link(collection)
    return collection


def traced(scene):
    """By the translator; the pipeline and what it holds out must say the same."""
    shown = {o for o, i in zip(*_owners(scene), strict=True) if i.ray_traced}
    assert {ob.name for ob in scene_setup.ray_traced_objects(scene)} == shown
    if scene.hybrid.enabled:
        scene_setup.sync(scene)  # in the background it waits for the next render
        source = scene_setup.source_layer(scene)
        by_collection = {ob.name for ob in traced_objects.held_out_by_collection(scene, source)}
        assert {ob.name for c in scene_setup.own_collections(scene) for ob in c.objects} == by_collection <= shown
    return shown


def _owners(scene):
    translation = translated(scene)
    return translation.owners, translation.scene.instances


def test_a_collection_flags_all_that_lies_in_it(scene):
    outer = child(scene.collection, "Outer")
    inner = child(outer, "Inner")
    a, b = add(scene, "A", outer), add(scene, "B", inner)
    hybrid.enable(scene)
    assert traced(scene) == set()
    outer.hybrid.ray_traced = True
    assert traced(scene) == {"A", "B"}
    b.hybrid.ray_traced = True
    outer.hybrid.ray_traced = False
    assert traced(scene) == {"B"}
    inner.hybrid.ray_traced, b.hybrid.ray_traced = True, False
    inner.objects.link(a)  # membership alone
    bpy.context.view_layer.update()
    assert traced(scene) == {"A", "B"}
    inner.objects.unlink(b)
    bpy.context.view_layer.update()
    assert traced(scene) == {"A"}
    bpy.data.collections.remove(inner)
    bpy.context.view_layer.update()
    assert traced(scene) == set()


def test_what_instances_a_flagged_collection_is_flagged(scene):
    shown = bpy.data.collections.new("Shown")  # in no scene
    add(scene, "A", shown)
    empty = bpy.data.objects.new("Empty", None)
    scene.collection.objects.link(empty)
    hybrid.enable(scene)
    empty.instance_type, empty.instance_collection = "COLLECTION", shown
    bpy.context.view_layer.update()
    before = fingerprint()
    shown.hybrid.ray_traced = True
    assert traced(scene) == {"Empty"} and fingerprint() != before
    empty.instance_collection = None
    bpy.context.view_layer.update()
    assert traced(scene) == set()


def test_a_render_counts_a_collections_objects(scene):
    scene.collection.children[0].hybrid.ray_traced = True
    scene.render.resolution_x, scene.render.resolution_y = 32, 32
    report = hybrid.render(scene, samples=1, mode="full").report
    assert report["counts"]["ray_traced"] == 1


def surfaces(scene):
    found = translated(scene).scene
    (instance,) = found.instances
    return [found.surfaces[number] for number in instance.surfaces]


def test_each_slot_has_its_own_values_and_the_objects_win(scene):
    cube = bpy.data.objects["Cube"]
    cube.data.materials.clear()
    for name in ("Plain", "Window"):
        cube.data.materials.append(bpy.data.materials.new(name))
    window = bpy.data.materials["Window"].hybrid
    window.opacity, window.ior = 0.25, 1.2
    assert window.surface == "CUSTOM" and cube.hybrid.surface == "MATERIAL"
    plain, clear = surfaces(scene)
    assert (plain.opacity, clear.opacity, clear.ior) == (1.0, 0.25, pytest.approx(1.2))
    cube.hybrid.reflectivity = 1.0
    assert [s.reflectivity for s in surfaces(scene)] == [1.0, 1.0]
    assert [s.opacity for s in surfaces(scene)] == [1.0, 1.0]


@pytest.mark.parametrize("owner", ["object", "material"])
def test_values_are_keyframed_and_driven(scene, owner):
    cube = bpy.data.objects["Cube"]
    b_id = cube if owner == "object" else cube.data.materials[0]
    b_id.hybrid.surface = "CUSTOM"
    for frame, value in ((1, 0.0), (11, 1.0)):
        b_id.hybrid.reflectivity = value
        b_id.keyframe_insert("hybrid.reflectivity", frame=frame)
    driver = b_id.driver_add("hybrid.ior").driver
    driver.type, driver.expression = "SCRIPTED", "1 + frame / 10"
    seen = []
    for frame in (1, 6, 11):
        scene.frame_set(frame)
        (surface,) = surfaces(scene)
        seen.append((surface.reflectivity, surface.ior))
    assert [r for r, _ in seen] == pytest.approx([0, 0.5, 1], abs=0.01)
    assert [n for _, n in seen] == pytest.approx([1.1, 1.6, 2.1])


def select(*objects):
    bpy.ops.object.select_all(action="DESELECT")
    for b_object in objects:
        b_object.select_set(True)
    bpy.context.view_layer.objects.active = objects[-1] if objects else None


def test_operators(scene):
    cube, a = bpy.data.objects["Cube"], add(scene, "A")
    b = add(scene, "B", child(scene.collection, "Glasses"))
    lamp = bpy.data.objects["Light"]
    select(a, lamp)
    assert bpy.ops.hybrid.ray_traced_set() == {"FINISHED"}
    assert a.hybrid.ray_traced and not lamp.hybrid.ray_traced
    a.hybrid.ior = 2.0
    select(cube, a)
    assert bpy.ops.hybrid.copy_to_selected() == {"FINISHED"}
    assert cube.hybrid.ray_traced and cube.hybrid.surface == "CUSTOM" and cube.hybrid.ior == 2.0
    b.users_collection[0].hybrid.ray_traced = True
    select(lamp)
    bpy.ops.hybrid.select_ray_traced()
    assert {ob.name for ob in bpy.context.selected_objects} == {"Cube", "A", "B"}
    bpy.ops.hybrid.ray_traced_set(ray_traced=False)
    assert traced(scene) == {"B"}
    bpy.ops.hybrid.clear_all()
    assert traced(scene) == set()
    bpy.context.view_layer.active_layer_collection = bpy.context.view_layer.layer_collection.children["Glasses"]
    bpy.ops.hybrid.collection_toggle()
    assert traced(scene) == {"B"}


def test_copying_from_material_stays_from_material(scene):
    cube, a = bpy.data.objects["Cube"], add(scene, "A")
    cube.hybrid.ray_traced, a.hybrid.opacity = True, 0.5
    select(a, cube)
    bpy.ops.hybrid.copy_to_selected()
    assert a.hybrid.ray_traced and a.hybrid.surface == "MATERIAL" and a.hybrid.opacity == 1.0
