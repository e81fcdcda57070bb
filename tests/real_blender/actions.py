# SPDX-License-Identifier: GPL-3.0-or-later
"""What the random walk does: each function is one thing that an artist does, by the operator that his click runs.

Each gets the dice; one that takes time is a generator of seconds to wait.
"""

import os
from collections.abc import Iterator
from random import Random

import bpy
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender import session, view_layers
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.pipeline import nodes, scene_setup

SURFACES = ["MIRROR", "GLASS", "WATER", "DIAMOND"]
OWN_NODES = {"BLUR", "FLIP"}
PATIENCE = 100  # seconds for a small render on a busy machine
FILE = ""  # where the walk saves; set by it
LIBRARY = ""  # a file with a ray traced object, a ray traced collection and a hybrid scene


def op(operator, **properties):
    """Run an operator as a click does, with its undo step: called plainly from Python it makes none."""
    return operator("EXEC_DEFAULT", True, **properties)


def push(message: str) -> None:
    """What was set from Python becomes an undo step, as if an operator had done it."""
    bpy.ops.ed.undo_push(message=message)


def own_scenes():
    return [s for s in bpy.data.scenes if not scene_setup.is_trace_scene(s) and s.library is None]


def pick(dice: Random) -> bpy.types.Object | None:
    """Some mesh of the scene, made the active and only selected object."""
    meshes = [o for o in bpy.context.view_layer.objects if o.type == "MESH" and o.library is None]
    if not meshes:
        return None
    b_object = dice.choice(meshes)
    op(bpy.ops.object.select_all, action="DESELECT")
    b_object.select_set(True)
    bpy.context.view_layer.objects.active = b_object
    return b_object


def preset(dice):
    if pick(dice):
        op(bpy.ops.hybrid.surface_preset, preset=dice.choice(SURFACES))


def flag(dice):
    if pick(dice):
        op(bpy.ops.hybrid.ray_traced_set, ray_traced=True)


def unflag(dice):
    if pick(dice):
        op(bpy.ops.hybrid.ray_traced_set, ray_traced=False)


def tick(dice):
    if pick(dice):
        op(bpy.ops.wm.context_toggle, data_path="object.hybrid.ray_traced")


def flag_collection(_dice):
    if bpy.context.collection.library is None:
        op(bpy.ops.hybrid.collection_toggle)


def toggle_enabled(_dice):
    op(bpy.ops.wm.context_toggle, data_path="scene.hybrid.enabled")


def change_mode(dice):
    op(bpy.ops.wm.context_set_enum, data_path="scene.hybrid.mode", value=dice.choice(["HYBRID", "RASTER", "FULL"]))


def change_shadows(dice):
    choice = dice.choice(["AUTO", "OFF", "ON"])
    op(bpy.ops.wm.context_set_enum, data_path="scene.hybrid.traced_shadows", value=choice)


def add_object(dice):
    place = [4 * dice.random() - 2 for _ in range(3)]
    op(bpy.ops.mesh.primitive_cube_add, size=1, location=place)


def duplicate(dice):
    if pick(dice):
        op(bpy.ops.object.duplicate_move, TRANSFORM_OT_translate={"value": (dice.random() * 2, 1, dice.random())})


def delete(dice):
    if pick(dice):
        op(bpy.ops.object.delete)


def rename(dice):
    things = [pick(dice), bpy.context.scene, bpy.context.view_layer, bpy.context.collection]
    fixed = (None, bpy.context.scene.collection)
    thing = dice.choice([t for t in things if t not in fixed and t.id_data.library is None])
    thing.name = f"N{dice.randrange(99)}"
    push("rename")


def undo(_dice):
    if bpy.ops.ed.undo.poll():
        bpy.ops.ed.undo()


def redo(_dice):
    if bpy.ops.ed.redo.poll():
        bpy.ops.ed.redo()


def copy_scene(dice):
    if len(own_scenes()) < 4:
        op(bpy.ops.scene.new, type=dice.choice(["LINK_COPY", "FULL_COPY", "EMPTY"]))


def switch_scene(dice):
    bpy.context.window.scene = dice.choice(own_scenes())


def delete_scene(_dice):
    if len(own_scenes()) > 1:
        op(bpy.ops.scene.delete)


def next_frame(_dice):
    op(bpy.ops.screen.frame_offset, delta=1)


def move_to_collection(dice):
    b_object = pick(dice)
    if b_object:
        collection = bpy.data.collections.new("More")
        bpy.context.scene.collection.children.link(collection)
        collection.objects.link(b_object)
        collection.hide_render = dice.random() < 0.3
        push("collection")


def exclude(dice):
    children = bpy.context.view_layer.layer_collection.children
    own = scene_setup.own_collections(bpy.context.scene)
    if layer := dice.choice([child for child in children if child.collection not in own] or [None]):
        layer.exclude = not layer.exclude
        push("exclude")


def film(_dice):
    op(bpy.ops.wm.context_toggle, data_path="scene.render.film_transparent")


def own_compositor(_dice):
    """A node of the user's own between the picture and the output."""
    tree = nodes.compositor_tree(bpy.context.scene)
    output = next((n for n in tree.nodes if n.type in nodes.OUTPUTS and n.inputs), None) if tree else None
    if output is None or not output.inputs[0].is_linked:
        return
    node = tree.nodes.new("CompositorNodeBlur" if len(tree.nodes) % 2 else "CompositorNodeFlip")
    assert node.type in OWN_NODES
    origin = output.inputs[0].links[0].from_socket
    tree.links.new(node.inputs[0], origin)
    tree.links.new(output.inputs[0], node.outputs[0])
    push("node")


def spoil(dice):
    """What the add-on made is in reach of everybody: delete a part of it."""
    scene = bpy.context.scene
    own, mask, tree = scene_setup.own_collections(scene), view_layers.mask_layer(scene), nodes.compositor_tree(scene)
    ours = [n for n in tree.nodes if nodes.role(n) or nodes.is_stand_in(n)] if tree else []
    what = dice.randrange(3)
    if what == 0 and own:
        bpy.data.collections.remove(own[0])
    elif what == 1 and mask:
        scene.view_layers.remove(mask)
    elif what == 2 and ours:
        tree.nodes.remove(dice.choice(ours))
    else:
        return
    push("spoil")


def render(_dice) -> Iterator[float]:
    """F12, where there is a camera."""
    if bpy.context.window_manager.windows[0].scene.camera is None:
        return
    ended: list[str] = []
    waiting = {name: lambda *_, name=name: ended.append(name) for name in ("render_complete", "render_cancel")}
    for name, handler in waiting.items():
        getattr(bpy.app.handlers, name).append(handler)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        began = bpy.ops.render.render("INVOKE_DEFAULT")
    for _ in range(PATIENCE * 20):
        yield 0.05
        if ended and not bpy.app.is_job_running("RENDER"):
            break
    for name, handler in waiting.items():
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)
    assert ended == ["render_complete"], (
        began,
        ended,
        bpy.app.is_job_running("RENDER"),
        [own.error for own in session.everyone()],
    )


def save_and_reload(_dice):
    op(bpy.ops.wm.save_as_mainfile, filepath=FILE)
    op(bpy.ops.wm.open_mainfile, filepath=FILE)


def save(_dice):
    op(bpy.ops.wm.save_as_mainfile, filepath=FILE, copy=True)


def append(dice):
    """An object, a collection or a whole scene of a hybrid file; appended or linked."""
    kind, name = dice.choice([("Object", "Ray traced"), ("Collection", "Glasses"), ("Scene", "Other")])
    if kind == "Scene" and len(list(bpy.data.scenes)) > 6:
        return
    operator = bpy.ops.wm.append if dice.random() < 0.7 else bpy.ops.wm.link
    op(operator, filepath=os.path.join(LIBRARY, kind, name), directory=os.path.join(LIBRARY, kind), filename=name)


ACTIONS = [
    preset, preset, flag, unflag, tick, flag_collection, toggle_enabled, change_mode, change_shadows, add_object,
    duplicate, delete, rename, undo, undo, undo, redo, redo, copy_scene, switch_scene, delete_scene, next_frame,
    move_to_collection, exclude, film, own_compositor, spoil, render, save, save_and_reload, append,
]  # fmt: skip
OURS = (preset, flag, unflag, tick, flag_collection, toggle_enabled, change_mode, change_shadows, spoil)


def library(path: str) -> None:
    """Save a file with things to append, with the add-on on: from Blender's default scene."""
    scene = bpy.context.scene
    scene.name = "Other"
    cube = bpy.data.objects["Cube"]
    cube.name, cube.hybrid.ray_traced, cube.hybrid.opacity = "Ray traced", True, 0.0
    glasses = bpy.data.collections.new("Glasses")
    scene.collection.children.link(glasses)
    glasses.hybrid.ray_traced = True
    glasses.objects.link(bpy.data.objects.new("In Glasses", cube.data))
    cube.location, bpy.data.objects["In Glasses"].location = (2.5, -1, 0.3), (-2, 2.2, 0.4)
    scene.hybrid.enabled = True
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
