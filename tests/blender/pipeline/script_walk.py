# SPDX-License-Identifier: GPL-3.0-or-later
"""Random sequences of what scripts do to a file between two renders: the next one renders, or says why not.

python script_walk.py SEEDS [STEPS]        SEEDS is a number or a range such as 1-300

One process for all; the line of each action is printed before it, so that the last one tells what a crash followed.
`test_script_walk.py` runs a few; run all of 1-300 before a release: nothing may crash, nothing may raise but one line.
"""

from __future__ import annotations

import random
import shutil
import sys
import tempfile
import traceback
from pathlib import Path
from typing import Any

import bpy

import hybrid_addon as hybrid
from hybrid_addon.blender import session
from hybrid_addon.blender.pipeline import scene_setup

Dice = random.Random
FOLDER = Path(tempfile.mkdtemp(prefix="script_walk_"))
EXPECTED = (RuntimeError, hybrid.HybridError, ReferenceError)
"""What an action itself may raise: Blender refuses it."""


def main_scene() -> bpy.types.Scene:
    """The first scene that is hybrid, or any."""
    return next((scene for scene in bpy.data.scenes if scene.hybrid.enabled), bpy.data.scenes[0])


def start(dice: Dice) -> None:
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 16, 12
    scene.eevee.taa_render_samples, scene.eevee.use_shadows, scene.hybrid.samples = 1, False, 1
    scene.cycles.samples = 1
    bpy.ops.mesh.primitive_plane_add(size=8)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6, location=(1.5, 0, 0))
    for name in dice.sample(["Cube", "Sphere", "Plane"], 2):
        hybrid.mark(bpy.data.objects[name], reflectivity=0.5)
    hybrid.enable(scene)


# ------------------------------------------------------------------------------------------------ actions


def _any(dice: Dice, things: Any) -> Any:
    things = list(things)
    return dice.choice(things) if things else None


def engine(dice: Dice) -> None:
    main_scene().render.engine = dice.choice(["CYCLES", "BLENDER_WORKBENCH", scene_setup.eevee(), scene_setup.ENGINE])


def eevee(dice: Dice) -> None:
    for scene in bpy.data.scenes:
        scene.render.engine = scene_setup.eevee()


def copy_scene(dice: Dice) -> None:
    _any(dice, bpy.data.scenes).copy()


def full_copy(dice: Dice) -> None:
    bpy.ops.scene.new(type=dice.choice(["NEW", "EMPTY", "LINK_COPY", "FULL_COPY"]))


def remove_other_scenes(dice: Dice) -> None:
    keep = main_scene()
    for scene in [scene for scene in bpy.data.scenes if scene != keep]:
        bpy.data.scenes.remove(scene)


def remove_a_scene(dice: Dice) -> None:
    if len(bpy.data.scenes) > 1:
        bpy.data.scenes.remove(_any(dice, bpy.data.scenes))


def rename_scene(dice: Dice) -> None:
    main_scene().name = dice.choice(["Shot", "Hybrid Trace", "Ä" * 30])


def add_layer(dice: Dice) -> None:
    main_scene().view_layers.new(dice.choice(["FG", "Hybrid Mask"]))


def remove_layers(dice: Dice) -> None:
    scene = main_scene()
    for layer in dice.sample(list(scene.view_layers), len(scene.view_layers) - 1):
        scene.view_layers.remove(layer)


def use_of_layers(dice: Dice) -> None:
    for layer in main_scene().view_layers:
        layer.use = dice.random() < 0.7


def _tree() -> Any:
    scene = main_scene()
    return scene.compositing_node_group if bpy.app.version >= (5, 0) else scene.node_tree


def clear_nodes(dice: Dice) -> None:
    tree = _tree()
    if tree is not None:
        tree.nodes.clear()


def remove_a_node(dice: Dice) -> None:
    tree = _tree()
    node = _any(dice, tree.nodes) if tree is not None else None
    if node is not None:
        tree.nodes.remove(node)


def own_tree(dice: Dice) -> None:
    scene = main_scene()
    if bpy.app.version < (5, 0):
        scene.use_nodes = not scene.use_nodes
        return
    tree = bpy.data.node_groups.new("Own", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    layers, leave = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("NodeGroupOutput")
    tree.links.new(leave.inputs[0], layers.outputs[0])
    scene.compositing_node_group = dice.choice([tree, None])


def share_tree(dice: Dice) -> None:
    if bpy.app.version >= (5, 0):
        _any(dice, bpy.data.scenes).compositing_node_group = _tree()


def remove_groups(dice: Dice) -> None:
    for group in list(bpy.data.node_groups):
        bpy.data.node_groups.remove(group)


def compositing(dice: Dice) -> None:
    main_scene().render.use_compositing = dice.random() < 0.5


def remove_a_collection(dice: Dice) -> None:
    collection = _any(dice, bpy.data.collections)
    if collection is not None:
        bpy.data.collections.remove(collection)


def new_collection(dice: Dice) -> None:
    collection = bpy.data.collections.new("Set")
    main_scene().collection.children.link(collection)
    for b_object in dice.sample(list(bpy.data.objects), min(2, len(bpy.data.objects))):
        collection.objects.link(b_object)
    collection.hybrid.ray_traced = dice.random() < 0.5


def exclude(dice: Dice) -> None:
    layer = _any(dice, main_scene().view_layers)
    child = _any(dice, layer.layer_collection.children)
    if child is not None:
        child.exclude = not child.exclude


def remove_an_object(dice: Dice) -> None:
    b_object = _any(dice, bpy.data.objects)
    if b_object is not None:
        bpy.data.objects.remove(b_object)


def remove_data(dice: Dice) -> None:
    kind = getattr(
        bpy.data, dice.choice(["meshes", "materials", "worlds", "lights", "cameras", "images", "linestyles"])
    )
    for b_id in list(kind):
        kind.remove(b_id)


def add_an_object(dice: Dice) -> None:
    b_object = bpy.data.objects.new("New", _any(dice, bpy.data.meshes))
    main_scene().collection.objects.link(b_object)
    if dice.random() < 0.5:
        b_object.hybrid.ray_traced = True


def flag(dice: Dice) -> None:
    b_object = _any(dice, main_scene().objects)
    if b_object is not None:
        b_object.hybrid.ray_traced = not b_object.hybrid.ray_traced


def hide(dice: Dice) -> None:
    b_object = _any(dice, main_scene().objects)
    if b_object is not None:
        b_object.hide_render = not b_object.hide_render


def camera(dice: Dice) -> None:
    scene = main_scene()
    b_object = bpy.data.objects.new("View", bpy.data.cameras.new("View"))
    scene.collection.objects.link(b_object)
    b_object.location = (0, 0, 9)
    scene.camera = dice.choice([b_object, b_object, b_object, None])


def purge(dice: Dice) -> None:
    bpy.data.orphans_purge()


def background(dice: Dice) -> None:
    other = _any(dice, bpy.data.scenes)
    if other != main_scene():
        main_scene().background_set = other


def save(dice: Dice) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "walk.blend"), copy=dice.random() < 0.5)


def load(dice: Dice) -> None:
    if (FOLDER / "walk.blend").exists():
        bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "walk.blend"))


def append(dice: Dice) -> None:
    if (FOLDER / "walk.blend").exists() and Path(bpy.data.filepath) != FOLDER / "walk.blend":
        with bpy.data.libraries.load(str(FOLDER / "walk.blend"), link=dice.random() < 0.5) as (there, wanted):
            wanted.scenes = there.scenes[:1]


def append_more(dice: Dice) -> None:
    """Objects and a material, linked or appended, by themselves."""
    if (FOLDER / "walk.blend").exists() and Path(bpy.data.filepath) != FOLDER / "walk.blend":
        with bpy.data.libraries.load(str(FOLDER / "walk.blend"), link=dice.random() < 0.5) as (there, wanted):
            wanted.objects = dice.sample(list(there.objects), min(2, len(there.objects)))
            wanted.materials = there.materials[:1]
        for b_object in filter(None, wanted.objects):
            if b_object.name not in main_scene().collection.all_objects:
                main_scene().collection.objects.link(b_object)


def materials(dice: Dice) -> None:
    """Another one, ticked or not, in a slot; or what one holds is another."""
    b_material = bpy.data.materials.new("Coat") if dice.random() < 0.5 else _any(dice, bpy.data.materials)
    b_object = _any(dice, (b_object for b_object in main_scene().objects if b_object.type == "MESH"))
    if b_material is None or b_object is None:
        return
    b_object.data.materials.append(b_material)
    b_object.material_slots[0].link = dice.choice(["DATA", "OBJECT"])
    b_material.hybrid.ray_traced = dice.random() < 0.5
    if b_material.node_tree is not None and dice.random() < 0.3:
        b_material.node_tree.nodes.clear()


def _raises(*_args: Any) -> None:
    raise KeyError("a handler of the user's")


def handler(dice: Dice) -> None:
    """One of the user's that raises; the next time it is another."""
    for name in ("render_pre", "render_post", "frame_change_post", "depsgraph_update_post", "render_complete"):
        there = getattr(bpy.app.handlers, name)
        there[:] = [each for each in there if each is not _raises]
    name = dice.choice(["render_pre", "render_post", "frame_change_post", "depsgraph_update_post"])
    getattr(bpy.app.handlers, name).append(_raises)


def animate(dice: Dice) -> None:
    """The camera is chosen by a marker, and moves."""
    scene = main_scene()
    if scene.camera is not None:
        scene.timeline_markers.new("Cut", frame=dice.randrange(1, 50)).camera = scene.camera
        scene.camera.keyframe_insert("location", frame=dice.randrange(1, 50))
    scene.render.use_motion_blur = dice.random() < 0.3


def size(dice: Dice) -> None:
    b_render = main_scene().render
    b_render.resolution_percentage = dice.choice([30, 50, 100, 130])
    b_render.use_crop_to_border = dice.random() < 0.5
    b_render.use_multiview = dice.random() < 0.2


def unlink(dice: Dice) -> None:
    b_object = _any(dice, (b_object for b_object in bpy.data.objects if b_object.users_collection))
    if b_object is not None:
        b_object.users_collection[0].objects.unlink(b_object)


def switch(dice: Dice) -> None:
    scene = _any(dice, bpy.data.scenes)
    scene.hybrid.enabled = not scene.hybrid.enabled


def mode(dice: Dice) -> None:
    main_scene().hybrid.mode = dice.choice(["HYBRID", "HYBRID", "RASTER", "FULL"])


def settings(dice: Dice) -> None:
    scene = main_scene()
    scene.hybrid.passes = set(dice.sample(["DEPTH", "NORMAL", "SHADOW"], dice.randrange(3)))
    scene.hybrid.traced_shadows = dice.choice(["OFF", "ON", "AUTO"])
    scene.render.film_transparent = dice.random() < 0.5
    scene.render.use_border = dice.random() < 0.3
    scene.render.use_persistent_data = dice.random() < 0.5
    scene.render.use_single_layer = dice.random() < 0.5
    scene.render.use_freestyle = dice.random() < 0.2


def frame(dice: Dice) -> None:
    main_scene().frame_set(dice.randrange(1, 50))


def look_at(dice: Dice) -> None:
    bpy.context.window.scene = _any(dice, bpy.data.scenes)


def bake_view(dice: Dice) -> None:
    bpy.context.view_layer.update()
    bpy.context.evaluated_depsgraph_get()


def again(dice: Dice) -> None:
    hybrid.unregister()
    hybrid.register()


def user_map(dice: Dice) -> None:
    bpy.data.user_map()
    for scene in bpy.data.scenes:
        scene.make_local() if scene.library else scene.update_tag()


ACTIONS = (
    engine, eevee, eevee, copy_scene, full_copy, remove_other_scenes, remove_a_scene, rename_scene, add_layer,
    remove_layers, use_of_layers, clear_nodes, remove_a_node, own_tree, share_tree, remove_groups, compositing,
    remove_a_collection, new_collection, exclude, remove_an_object, remove_data, add_an_object, flag, flag, hide,
    camera, purge, background, save, load, append, switch, mode, settings, frame, look_at, bake_view, again, user_map,
)  # fmt: skip
MORE_FROM = 201
"""The first seed with MORE, so that those before it stay the sequences that they were."""
MORE = (*ACTIONS, append_more, materials, materials, handler, animate, size, unlink)


# ------------------------------------------------------------------------------------------------ rendering


def render(dice: Dice) -> str:
    """Render some scene by some door; what came of it. Raises AssertionError for a silent or a wrong answer."""
    scene = main_scene() if dice.random() < 0.8 else _any(dice, bpy.data.scenes)
    session.of(scene.name).frame = None
    try:
        if dice.random() < 0.4:
            hybrid.render(scene)
            return "rendered"
        bpy.ops.render.render(scene=scene.name)
    except (RuntimeError, hybrid.HybridError) as error:
        text = str(error).strip()
        assert text and "Traceback" not in text, text
        return f"refused: {text.splitlines()[0]}"
    wanted = scene_setup.is_active(scene) and scene_setup.effective_mode(scene) != "RASTER"
    own = session.of(scene.name)
    assert not wanted or own.frame is not None or own.error, "the traced half is missing, and nothing was said"
    return "rendered hybrid" if own.frame else "rendered plain"


def walk(seed: int, steps: int) -> None:
    dice = Dice(seed)
    start(dice)
    for _ in range(steps):
        for action in dice.sample(ACTIONS if seed < MORE_FROM else MORE, dice.randrange(1, 4)):
            print("seed", seed, action.__name__, flush=True)
            try:
                action(dice)
            except EXPECTED as error:
                print("   refused:", str(error).strip().splitlines()[:1], flush=True)
        print("seed", seed, "render", flush=True)
        print("  ", render(dice), flush=True)


def main() -> int:
    """Walk all; the number of seeds that went wrong."""
    first, _, last = sys.argv[1].partition("-")
    steps = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    hybrid.register()
    wrong = []
    for seed in range(int(first), int(last or first) + 1):
        try:
            walk(seed, steps)
        except Exception:
            wrong.append(seed)
            print("WRONG", seed, traceback.format_exc(), flush=True)
    print("WALKED", first, last or first, "wrong:", wrong, flush=True)
    return len(wrong)


if __name__ == "__main__":
    import os

    code = main()
    shutil.rmtree(FOLDER, ignore_errors=True)
    sys.stdout.flush()
    os._exit(min(code, 1))
