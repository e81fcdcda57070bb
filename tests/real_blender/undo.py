"""Run in a real Blender with a window: a random walk of what an artist does, checking the pipeline after each step.

xvfb-blender --python undo.py -- SEED STEPS FILE.blend
"""

import os
import random
import sys

import bpy
from bl_ext.user_default import hybrid_addon as hybrid
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender import handlers, layers, nodes, pipeline

sys.path.insert(0, os.path.dirname(__file__))
import window as screen

SEED, STEPS, FILE = sys.argv[sys.argv.index("--") + 1 :]
dice = random.Random(int(SEED))


def op(operator, **properties):
    """Run an operator as a click does, with its undo step: called plainly from Python it makes none."""
    operator("EXEC_DEFAULT", True, **properties)


def own_scenes():
    return [s for s in bpy.data.scenes if not pipeline.is_trace_scene(s)]


def some_object():
    meshes = [o for o in bpy.context.view_layer.objects if o.type == "MESH"]
    return dice.choice(meshes) if meshes else None


def preset():
    b_object = some_object()
    if b_object:
        bpy.context.view_layer.objects.active = b_object
        op(bpy.ops.hybrid.surface_preset, preset=dice.choice(["MIRROR", "GLASS", "WATER", "DIAMOND"]))


def toggle_flag():
    b_object = some_object()
    if b_object:
        bpy.context.view_layer.objects.active = b_object
        op(bpy.ops.wm.context_toggle, data_path="object.hybrid.ray_traced")


def toggle_enabled():
    op(bpy.ops.wm.context_toggle, data_path="scene.hybrid.enabled")


def change_mode():
    op(bpy.ops.wm.context_set_enum, data_path="scene.hybrid.mode", value=dice.choice(["HYBRID", "RASTER", "FULL"]))


def add_object():
    op(bpy.ops.mesh.primitive_cube_add, location=(dice.random(), 0, 0))


def duplicate():
    b_object = some_object()
    if b_object:
        op(bpy.ops.object.select_all, action="DESELECT")
        b_object.select_set(True)
        op(bpy.ops.object.duplicate)


def delete():
    b_object = some_object()
    if b_object:
        op(bpy.ops.object.select_all, action="DESELECT")
        b_object.select_set(True)
        op(bpy.ops.object.delete)


def rename():
    b_object = some_object()
    if b_object:
        b_object.name = f"N{dice.randrange(99)}"
        bpy.ops.ed.undo_push(message="rename")


def undo():
    if bpy.ops.ed.undo.poll():
        bpy.ops.ed.undo()


def redo():
    if bpy.ops.ed.redo.poll():
        bpy.ops.ed.redo()


def copy_scene():
    if len(own_scenes()) < 4:
        op(bpy.ops.scene.new, type=dice.choice(["LINK_COPY", "FULL_COPY", "EMPTY"]))


def switch_scene():
    bpy.context.window.scene = dice.choice(own_scenes())


def delete_scene():
    if len(own_scenes()) > 1:
        op(bpy.ops.scene.delete)


def next_frame():
    op(bpy.ops.screen.frame_offset, delta=1)


def move_to_collection():
    b_object = some_object()
    if b_object:
        collection = bpy.data.collections.new("More")
        bpy.context.scene.collection.children.link(collection)
        collection.objects.link(b_object)
        collection.hide_render = dice.random() < 0.3
        bpy.ops.ed.undo_push(message="collection")


def exclude():
    layers = bpy.context.view_layer.layer_collection.children
    if layers and (layer := dice.choice(list(layers))).collection != pipeline.own_collection(bpy.context.scene):
        layer.exclude = not layer.exclude
        bpy.ops.ed.undo_push(message="exclude")


def save_and_reload():
    op(bpy.ops.wm.save_as_mainfile, filepath=FILE)
    op(bpy.ops.wm.open_mainfile, filepath=FILE)


ACTIONS = [
    preset, toggle_flag, toggle_enabled, change_mode, add_object, duplicate, delete, rename, undo, undo, redo,
    copy_scene, switch_scene, delete_scene, next_frame, move_to_collection, exclude, save_and_reload,
]  # fmt: skip


if os.environ.get("PLAIN"):  # the same walk without the add-on's part: is it Blender that fails?
    ACTIONS = [action for action in ACTIONS if action not in (preset, toggle_flag, toggle_enabled, change_mode)]


def check():
    """What must hold after every step, once the add-on had its turn."""
    handlers._tick()
    if handlers._undone is not None:
        return  # an undo is left alone until the next change
    scenes = own_scenes()
    traces = [s for s in bpy.data.scenes if pipeline.is_trace_scene(s)]
    standing = [s for s in scenes if pipeline.is_active(s)]
    assert len(traces) == len(standing), (len(traces), len(standing))
    assert len(set(pipeline.trace_scene(s) for s in standing)) == len(standing)
    named = [c for c in bpy.data.collections if c.name.startswith(pipeline.COLLECTION)]
    assert len(named) == len(standing), [c.name for c in named]
    for scene in scenes:
        masks = [layer for layer in scene.view_layers if layer.get(layers.MASK_MARK)]
        assert len(masks) == (scene in standing), (scene.name, len(masks))
        tree = nodes.compositor_tree(scene)
        ours = [n for n in tree.nodes if n.get(nodes.ROLE) in {"mask", "trace"} or nodes.SOURCE in n] if tree else []
        if scene not in standing:
            assert not ours, (scene.name, [n.name for n in ours])
            continue
        assert pipeline.trace_scene(scene).background_set == scene
        assert set(pipeline.own_collection(scene).objects) == set(pipeline.flagged_objects(scene))
        assert not nodes.feeds_nothing(scene, pipeline.source_layer(scene)), scene.name
        assert {n.scene for n in ours if n.get(nodes.ROLE) == "trace"} == {pipeline.trace_scene(scene)}


def walk():
    for number in range(int(STEPS)):
        action = dice.choice(ACTIONS)
        print(f"WALK {number} {action.__name__}", flush=True)
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            action()
        check()
    for scene in own_scenes():
        hybrid.disable(scene)
    check()
    print("WALK: consistent", flush=True)
    os._exit(0)


screen.soon(walk, persistent=True)
