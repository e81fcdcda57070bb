# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file holds that nobody thought of, and what it says where the add-on is missing. Nothing is rendered."""

from __future__ import annotations

import bpy
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.pipeline import note, scene_setup, trace_scenes
from hybrid_addon.blender.render.engine import scene_warnings

pytestmark = pytest.mark.blender


def test_a_scene_of_the_users_with_our_engine_stays_his(scene):
    """It stands in the list of engines, and somebody will choose it."""
    other = bpy.data.scenes.new("Other")
    scene.render.engine = scene_setup.ENGINE
    other.background_set = scene
    hybrid.enable(other)
    with pytest.raises(hybrid.HybridError, match="set Render Engine to EEVEE"):
        hybrid.enable(scene)
    hybrid.disable(other)
    scene_setup.sync_all()
    assert set(bpy.data.scenes) == {scene, other}


def test_a_scene_that_was_just_made(scene):
    """Its view layer is empty until somebody looks (Blender 5)."""
    fresh = bpy.data.scenes.new("Fresh")
    hybrid.enable(fresh)
    assert trace_scenes.owner(scene_setup.trace_scene(fresh)) == fresh
    assert scene_setup.mask_layer(fresh) is not None


def test_linked_things_may_have_the_names_of_local_ones(scene, tmp_path):
    path = str(tmp_path / "library.blend")
    glasses = bpy.data.collections.new("Glasses")
    scene.collection.children.link(glasses)
    glasses.objects.link(bpy.data.objects["Cube"])
    glasses.hybrid.ray_traced = True
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    with bpy.data.libraries.load(path, link=True) as (_, into):
        into.collections = ["Glasses"]
    (linked,) = into.collections
    scene.collection.children.link(linked)
    twins = {layer.collection: layer for layer in scene.view_layers[0].layer_collection.children}
    assert {layer.name for c, layer in twins.items() if c in (glasses, linked)} == {"Glasses"}
    twins[glasses].exclude = True
    hybrid.enable(scene)
    assert set(scene_setup.ray_traced_objects(scene)) == {
        *linked.objects,
        bpy.data.objects["Cube"],
    }  # which lies in the scene's other collection
    mask = {layer.collection: layer.exclude for layer in scene_setup.mask_layer(scene).layer_collection.children}
    assert (mask[glasses], mask[linked]) == (True, False)
    (own,) = scene_setup.own_collections(scene)  # the copies of linked objects cannot be held out
    assert set(own.objects) == set(linked.objects)


GIVEN = {"reflectivity": 0.25, "opacity": 0.125, "ior": 1.375, "surface": "CUSTOM"}


@pytest.mark.parametrize("touched", [False, True], ids=["never touched in the library", "touched in the library"])
def test_overrides_keep_what_is_set_in_them(scene, tmp_path, touched):
    """Of objects, materials and collections that are linked and overridden, over a save and a load."""
    cube, glasses = bpy.data.objects["Cube"], bpy.data.collections.new("Glasses")
    scene.collection.children.link(glasses)
    glasses.objects.link(cube)
    if touched:
        cube.hybrid.ior, cube.active_material.hybrid.ior = 1.4, 1.4
        cube.hybrid.ray_traced = glasses.hybrid.ray_traced = False
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "asset.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "asset.blend"), link=True) as (_, into):
        into.objects, into.materials, into.collections = ["Cube"], ["Material"], ["Glasses"]
    overridden = [item.override_create() for item in (into.objects[0], into.materials[0], into.collections[0])]
    b_object, material, collection = overridden
    bpy.context.scene.collection.objects.link(b_object)
    bpy.context.scene.collection.children.link(collection)
    for owner in (b_object, material):
        for name, value in GIVEN.items():
            setattr(owner.hybrid, name, value)
    b_object.hybrid.ray_traced = collection.hybrid.ray_traced = True
    material.use_fake_user = True
    told = [line for line in scene_warnings(bpy.context.scene) if "override" in line]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    kept = [next(i for i in ids if i.override_library) for ids in (bpy.data.objects, bpy.data.materials)]
    if not touched:  # Blender cannot; a render says so before the file is saved
        assert [kind for kind in ("object 'Cube'", "material 'Material'") if any(kind in line for line in told)]
        return
    assert not told
    for owner in kept:
        assert {name: getattr(owner.hybrid, name) for name in GIVEN} == GIVEN, owner
    assert kept[0].hybrid.ray_traced
    assert next(c for c in bpy.data.collections if c.override_library).hybrid.ray_traced


def notes():
    return [text for text in bpy.data.texts if note.MARK in text]


def test_the_saved_file_says_what_it_is(scene, tmp_path):
    """A text and a property of the scene, in the file only."""
    path = str(tmp_path / "file.blend")
    hybrid.mark(bpy.data.objects["Cube"])
    hybrid.enable(scene)
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    assert not notes() and note.TITLE not in scene
    with bpy.data.libraries.load(path) as (inside, into):
        into.texts, into.scenes = list(inside.texts), list(inside.scenes)
    (text,), (there,) = into.texts, into.scenes
    assert "plain EEVEE" in text.as_string() and "scene 'Scene': Cube" in text.as_string()
    assert note.TITLE in there[note.TITLE]
    bpy.ops.wm.open_mainfile(filepath=path)
    scene = bpy.context.scene
    assert not notes() and note.TITLE not in scene and not bpy.data.texts
    hybrid.disable(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "plain.blend"), copy=True)
    with bpy.data.libraries.load(str(tmp_path / "plain.blend")) as (inside, _):
        assert list(inside.texts) == []


def test_what_is_the_users_stays(scene, tmp_path):
    """A text and a property of the same name."""
    bpy.data.texts.new(note.TITLE).write("mine")
    scene[note.TITLE] = "mine"
    hybrid.enable(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    assert [text.as_string() for text in bpy.data.texts] == ["mine"]
    assert bpy.context.scene[note.TITLE] == "mine"


def test_a_compositor_tree_that_no_scene_uses_any_more_is_clean(scene):
    """The user's own tree, kept by him when its scene went: Blender 5 shares trees, 4.5 has one in each scene."""
    if bpy.app.version < (5, 0):
        pytest.skip("trees live in their scenes")
    hybrid.mark(bpy.data.objects["Cube"])
    tree = scene.compositing_node_group = bpy.data.node_groups.new("Mine", "CompositorNodeTree")
    tree.use_fake_user = True
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    layers, output = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("NodeGroupOutput")
    tree.links.new(output.inputs[0], layers.outputs["Image"])
    hybrid.enable(scene)
    assert len(tree.nodes) > 2
    bpy.data.scenes.new("Other")
    bpy.data.scenes.remove(scene)
    scene_setup.sync_all()
    assert set(tree.nodes) == {layers, output}
    assert list(bpy.data.node_groups) == [tree]
    assert output.inputs[0].links[0].from_node == layers
