# SPDX-License-Identifier: GPL-3.0-or-later
"""The pipeline stands, keeps in step and goes without a trace. No rendering here: only what is in the file."""

from __future__ import annotations

from contextlib import contextmanager

import bpy
import pytest

from hybrid_addon import HybridError, disable, enable, mark, unmark
from hybrid_addon.blender.pipeline import nodes, opengl, scene_setup, trace_scenes

pytestmark = pytest.mark.blender
NEW_API = bpy.app.version >= (5, 0)


def snapshot(scene):
    """Everything that the pipeline could touch, as plain data."""
    tree = nodes.compositor_tree(scene)
    return {
        "scenes": sorted(s.name for s in bpy.data.scenes),
        "collections": sorted(c.name for c in bpy.data.collections),
        "groups": sorted(g.name for g in bpy.data.node_groups),
        "layers": [(v.name, v.use, sorted(v.keys())) for v in scene.view_layers],
        "children": [c.name for c in scene.collection.children_recursive],
        "objects": {o.name: sorted(c.name for c in o.users_collection) for o in scene.objects},
        "nodes": sorted((n.name, n.mute, sorted(n.keys())) for n in tree.nodes) if tree else None,
        "links": links(tree),
        "use_nodes": NEW_API or scene.use_nodes,
        "render": (scene.render.use_compositing, scene.render.use_single_layer, scene.render.compositor_device),
        "engine": scene.render.engine,
        "restore": scene.hybrid.restore,
        "worlds": len(bpy.data.worlds),
        "excluded": [
            (v.name, c.name, c.exclude, c.holdout) for v in scene.view_layers for c in v.layer_collection.children
        ],
        "selected": [o.name for o in scene.view_layers[0].objects if o.select_get()],
    }


def links(tree):
    if tree is None:
        return None
    ends = [(k.from_node.name, k.from_socket.identifier, k.to_node.name, k.to_socket.identifier) for k in tree.links]
    return sorted(ends)


def user_tree(scene):
    """A compositor tree as users have: the picture through an effect, another pass beside it."""
    if NEW_API:
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Mine", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        output = tree.nodes.new("NodeGroupOutput")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
        output = tree.nodes.new("CompositorNodeComposite")
    source = tree.nodes.new("CompositorNodeRLayers")
    blur = tree.nodes.new("CompositorNodeBlur")
    tree.links.new(blur.inputs[0], source.outputs["Image"])
    tree.links.new(output.inputs[0], blur.outputs[0])
    return tree


@pytest.mark.parametrize("compositor", ["none", "mine"])
def test_disable_restores_the_file(scene, compositor):
    if compositor == "mine":
        user_tree(scene)
    elif not NEW_API:
        scene.use_nodes, scene.use_nodes = True, False  # Blender makes its default tree once, for good
    mark(bpy.data.objects["Cube"])
    before = snapshot(scene)
    enable(scene)
    assert snapshot(scene) != before
    assert scene_setup.mask_layer(scene) is not None
    disable(scene)
    assert snapshot(scene) == before


def test_software_opengl_does_not_composite(scene, monkeypatch):
    """One of some hundred pictures ended Blender there; a graphics card keeps the user's choice."""
    scene.render.compositor_device = "GPU"
    monkeypatch.setattr(opengl, "draws_on_processor", lambda: False)
    enable(scene)
    assert scene.render.compositor_device == "GPU"
    monkeypatch.setattr(opengl, "draws_on_processor", lambda: True)
    scene_setup.sync(scene)
    assert scene.render.compositor_device == "CPU"
    disable(scene)
    assert scene.render.compositor_device == "GPU"


def test_sync_writes_nothing_the_second_time(scene):
    mark(bpy.data.objects["Cube"])
    enable(scene)
    first = snapshot(scene)
    for _ in range(3):
        scene_setup.sync_all()
    assert snapshot(scene) == first


def test_the_picture_that_the_user_took_is_the_composite(scene):
    tree = user_tree(scene)
    mark(bpy.data.objects["Cube"])
    enable(scene)
    blur = next(n for n in tree.nodes if n.type == "BLUR")
    assert nodes.SOURCE in blur.inputs[0].links[0].from_node
    disable(scene)
    assert blur.inputs[0].links[0].from_node.type == "R_LAYERS"


def test_flagged_objects_are_held_out_in_the_mask_layer_only(scene):
    cube = bpy.data.objects["Cube"]
    mark(cube)
    enable(scene)
    mask, source = scene_setup.mask_layer(scene), scene_setup.source_layer(scene)
    assert scene_setup.ray_traced_objects(scene) == [cube]
    assert not scene_setup.own_collections(scene)  # it is held out in the render's own copy of it
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", cube.users_collection[0]
    scene.collection.objects.link(empty)
    scene_setup.sync(scene)
    (ours,) = scene_setup.own_collections(scene)  # what instances show has the flags of them all
    assert list(ours.objects) == [cube]
    assert mask.layer_collection.children[ours.name].holdout
    assert source.layer_collection.children[ours.name].exclude
    bpy.data.objects.remove(empty)
    scene_setup.sync(scene)
    assert not scene_setup.own_collections(scene)
    assert not source.use and mask.use  # an opaque film needs the mask layer alone
    scene.render.film_transparent = True
    scene_setup.sync(scene)
    assert source.use and mask.use
    unmark(cube)
    assert not scene_setup.ray_traced_objects(scene)
    assert source.use and not mask.use  # nothing ray traced: EEVEE alone


def test_an_object_that_the_user_hid_stays_hidden(scene):
    cube = bpy.data.objects["Cube"]
    hidden = bpy.data.collections.new("Hidden")
    scene.collection.children.link(hidden)
    hidden.objects.link(cube)
    for collection in list(cube.users_collection):
        if collection != hidden:
            collection.objects.unlink(cube)
    mark(cube)
    enable(scene)
    assert scene_setup.ray_traced_objects(scene) == [cube]
    scene_setup.source_layer(scene).layer_collection.children["Hidden"].exclude = True
    scene_setup.sync(scene)
    assert not scene_setup.ray_traced_objects(scene)
    scene_setup.source_layer(scene).layer_collection.children["Hidden"].exclude = False
    hidden.hide_render = True
    scene_setup.sync(scene)
    assert not scene_setup.ray_traced_objects(scene)


def test_the_mask_layer_imitates_the_users_layer(scene):
    extra = bpy.data.collections.new("Extra")
    scene.collection.children.link(extra)
    source = scene_setup.source_layer(scene)
    source.layer_collection.children["Extra"].exclude = True
    mark(bpy.data.objects["Cube"])
    enable(scene)
    mask = scene_setup.mask_layer(scene)
    assert mask.layer_collection.children["Extra"].exclude
    source.layer_collection.children["Extra"].exclude = False
    source.layer_collection.children["Extra"].holdout = True
    scene_setup.sync(scene)
    assert not mask.layer_collection.children["Extra"].exclude
    assert mask.layer_collection.children["Extra"].holdout


@contextmanager
def attached():
    """As a render begins and ends."""
    trace_scenes.begin()
    yield
    trace_scenes.detach()


def test_the_mask_layer_has_the_custom_properties_of_the_users(scene):
    """Attribute nodes of type View Layer read them."""
    mark(bpy.data.objects["Cube"])
    source = scene.view_layers[0]
    source["number"], source["color"], source["group"] = 0.5, [0.1, 0.2, 0.3], {"inner": 2}
    source["pointer"] = bpy.data.objects["Cube"]
    enable(scene)
    mask = scene_setup.mask_layer(scene)
    assert mask["number"] == 0.5 and list(mask["color"]) == pytest.approx([0.1, 0.2, 0.3])
    assert mask["group"].to_dict() == {"inner": 2} and "pointer" not in mask
    del source["color"]
    source["number"] = 0.25
    scene_setup.sync(scene)
    assert mask["number"] == 0.25 and "color" not in mask


def test_the_camera_follows(scene):
    mark(bpy.data.objects["Cube"])
    enable(scene)
    other = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))
    scene.collection.objects.link(other)
    scene.camera = other
    with attached():
        assert scene_setup.trace_scene(scene).camera == other


def test_the_frame_rate_follows(scene):
    """Scene Time of geometry nodes gives seconds of the scene that is rendered: the trace scene."""
    mark(bpy.data.objects["Cube"])
    enable(scene)
    scene.render.fps, scene.render.fps_base = 60, 1.001
    scene_setup.sync(scene)
    with attached():
        render = scene_setup.trace_scene(scene).render
    assert (render.fps, render.fps_base) == (60, scene.render.fps_base)


def test_deleting_a_flagged_object(scene):
    mark(bpy.data.objects["Cube"])
    enable(scene)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.context.view_layer.update()
    scene_setup.sync_all()
    assert scene_setup.effective_mode(scene) == "RASTER"


def test_save_and_load(scene, tmp_path):
    mark(bpy.data.objects["Cube"])
    enable(scene)
    standing = snapshot(scene)
    path = str(tmp_path / "a b é.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    assert snapshot(scene) == standing
    bpy.ops.wm.open_mainfile(filepath=path)
    assert snapshot(bpy.context.scene) == standing


def test_a_saved_file_holds_nothing_of_ours_but_settings(scene, tmp_path):
    mark(bpy.data.objects["Cube"])
    enable(scene)
    path = str(tmp_path / "plain.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings()
    with bpy.data.libraries.load(path) as (inside, _):
        assert len(inside.scenes) == 1
        assert scene_setup.COLLECTION not in inside.collections
        assert not [name for name in inside.node_groups if name.startswith("Hybrid")]


def test_a_copied_scene_gets_a_pipeline_of_its_own(scene):
    mark(bpy.data.objects["Cube"])
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", bpy.data.objects["Cube"].users_collection[0]
    scene.collection.objects.link(empty)
    enable(scene)
    for kind in ("LINK_COPY", "FULL_COPY"):
        bpy.context.window.scene = scene
        bpy.ops.scene.new(type=kind)
        copy = bpy.context.scene
        assert copy != scene
        scene_setup.sync_all()
        for each in (scene, copy):
            assert trace_scenes.owner(scene_setup.trace_scene(each)) == each
            assert [c for c in each.collection.children if c.name.startswith(scene_setup.COLLECTION)] == (
                scene_setup.own_collections(each)
            )
            assert len(scene_setup.own_collections(each)) == 1
        assert scene_setup.trace_scene(copy) != scene_setup.trace_scene(scene)
        assert scene_setup.own_collections(copy) != scene_setup.own_collections(scene)
        tree = nodes.compositor_tree(copy)
        roles = {n[nodes.ROLE]: n.scene for n in tree.nodes if n.get(nodes.ROLE) in {"mask", "trace"}}
        assert roles == {"mask": copy, "trace": scene_setup.trace_scene(copy)}
        disable(copy)
        assert scene_setup.trace_scene(copy) is None
        assert trace_scenes.owner(scene_setup.trace_scene(scene)) == scene
        assert len(scene_setup.own_collections(scene)) == 1


def test_append_brings_a_scene_that_renders_hybrid(scene, tmp_path):
    mark(bpy.data.objects["Cube"])
    enable(scene)
    path = str(tmp_path / "lib.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings()
    with bpy.data.libraries.load(path) as (inside, into):
        into.scenes = inside.scenes
    scene_setup.sync_all()
    appended = next(s for s in bpy.data.scenes if s.hybrid.enabled)
    assert trace_scenes.owner(scene_setup.trace_scene(appended)) == appended
    assert not [s for s in bpy.data.scenes if scene_setup.is_trace_scene(s)]


def test_deleting_the_scene_takes_its_trace_scene_along(scene):
    mark(bpy.data.objects["Cube"])
    other = bpy.data.scenes.new("Other")
    enable(scene)
    bpy.data.scenes.remove(scene)
    scene_setup.sync_all()
    assert list(bpy.data.scenes) == [other]


@pytest.mark.skipif(NEW_API, reason="5.x has no Use Nodes switch")
def test_a_tree_that_was_switched_off_stays_without_effect(scene):
    tree = user_tree(scene)
    scene.use_nodes = False
    mark(bpy.data.objects["Cube"])
    before = snapshot(scene)
    enable(scene)
    output = next(n for n in tree.nodes if n.type == "COMPOSITE")
    assert nodes.SOURCE in output.inputs[0].links[0].from_node  # not the user's blur
    disable(scene)
    assert snapshot(scene) == before


@pytest.mark.skipif(not NEW_API, reason="4.5 keeps its tree inside the scene")
def test_compositing_switched_off_stays_without_effect(scene):
    tree = user_tree(scene)
    scene.render.use_compositing = False
    mark(bpy.data.objects["Cube"])
    before = snapshot(scene)
    enable(scene)
    assert scene.compositing_node_group != tree
    disable(scene)
    assert scene.compositing_node_group == tree
    assert snapshot(scene) == before


def test_renamed_parts_are_found_again(scene):
    mark(bpy.data.objects["Cube"])
    before_layers = [v.name for v in scene.view_layers]
    enable(scene)
    scene_setup.mask_layer(scene).name = "My Mask"
    scene_setup.sync_all()
    assert len(scene.view_layers) == 2
    disable(scene)
    assert [v.name for v in scene.view_layers] == before_layers
    assert len(bpy.data.scenes) == 1


def test_other_engines_are_refused_and_left_alone(scene):
    scene.render.engine = "CYCLES" if "cycles" in bpy.context.preferences.addons else "BLENDER_WORKBENCH"
    before = snapshot(scene)
    with pytest.raises(HybridError, match="EEVEE"):
        enable(scene)
    assert snapshot(scene) == before


def test_modes_mute_what_they_do_not_need(scene):
    mark(bpy.data.objects["Cube"])
    enable(scene)
    muted = {}
    for mode in ("HYBRID", "RASTER", "FULL"):
        scene.hybrid.mode = mode
        tree = nodes.compositor_tree(scene)
        muted[mode] = {n.get(nodes.ROLE) or "user": n.mute for n in tree.nodes if n.type == "R_LAYERS"}
    user = "own" if NEW_API else "user"
    assert muted["HYBRID"] == {"mask": False, "trace": False, user: False}
    assert muted["RASTER"] == {"mask": True, "trace": True, user: False}
    assert muted["FULL"] == {"mask": True, "trace": False, user: True}


def test_setting_a_value_means_custom(scene):
    cube = bpy.data.objects["Cube"]
    mark(cube)
    assert cube.hybrid.surface == "MATERIAL"
    mark(cube, ior=1.33)
    assert (cube.hybrid.surface, round(cube.hybrid.ior, 5)) == ("CUSTOM", 1.33)


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [("Light", {}, "light"), ("Cube", {"opacity": 2.0}, "opacity is 2"), ("Cube", {"ior": float("nan")}, "ior is nan")],
)
def test_mark_refuses_nonsense(scene, name, values, words):
    with pytest.raises(HybridError, match=words):
        mark(bpy.data.objects[name], **values)
    assert not bpy.data.objects[name].hybrid.ray_traced


def test_undo(scene):
    cube = bpy.data.objects["Cube"]
    bpy.ops.ed.undo_push(message="before")
    mark(cube)
    enable(scene)
    bpy.ops.ed.undo_push(message="hybrid")
    unmark(bpy.data.objects["Cube"])
    bpy.ops.ed.undo_push(message="unmarked")
    try:
        bpy.ops.ed.undo()
    except RuntimeError:
        pytest.skip("undo needs a window here")
    scene = bpy.context.scene
    assert [o.name for o in scene_setup.ray_traced_objects(scene)] == ["Cube"]
    assert scene_setup.mask_layer(scene).use
