# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real Blender with a window: random walks of what an artist does, checking the pipeline after each step.

xvfb-blender --python walk.py -- SEEDS STEPS FOLDER

SEEDS is a number or a range such as 1-100, each a sequence of STEPS actions, all in one Blender. Each ends with F12:
the mask must be where Blender's own rays meet ticked objects, and the pipeline must be one that was set up afresh. Then
the file is saved and opened without the add-on: nothing of ours may be in it but a note. Every fifth sequence (EVERY=5)
compares pictures, too: with those of a fresh pipeline, with EEVEE's beside the ray traced objects, and EEVEE's with
what the file renders without the add-on. PLAIN=1 walks without the add-on's part: is it Blender that fails?
"""

import os
import random
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import bpy
import mathutils
import numpy as np
from bl_ext.user_default import hybrid_addon as hybrid
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender import handlers, session, view_layers
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.pipeline import (
    compositor_setup,
    nodes,
    scene_setup,
    trace_scenes,
    traced_objects,
)
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.pipeline.node_group import GROUP_MARK

sys.path.insert(0, os.path.dirname(__file__))
import actions
import window as screen

SEEDS, STEPS, FOLDER = sys.argv[sys.argv.index("--") + 1 :]
PACKAGE = "bl_ext.user_default.hybrid_addon"
SIZE = 64, 48
FIRST, _, LAST = SEEDS.partition("-")
TOLERANCE = 2 / 255
EVERY = int(os.environ.get("EVERY", "5"))  # sequences for one that compares pictures: EEVEE takes seconds for each
ACTIONS = [a for a in actions.ACTIONS if not os.environ.get("PLAIN") or a not in actions.OURS]


def check() -> None:
    """What must hold after every step, once the add-on had its turn."""
    handlers._tick()
    while handlers._history.again is not None:
        handlers._tick()
    scenes = actions.own_scenes()
    traces = [s for s in bpy.data.scenes if scene_setup.is_trace_scene(s) and s.library is None]
    standing = [s for s in scenes if scene_setup.is_active(s)]
    assert not traces, traces
    assert len(set(scene_setup.trace_scene(s) for s in standing)) == len(standing)
    marked = {c for c in bpy.data.collections if scene_setup.COLLECTION_MARK in c and c.library is None}
    assert marked == {c for s in standing for c in scene_setup.own_collections(s)}, [c.name for c in marked]
    for scene in scenes:
        masks = [layer for layer in scene.view_layers if layer.get(view_layers.MASK_MARK)]
        wanted = len(view_layers.source_layers(scene)) if scene in standing else 0
        assert len(masks) == wanted, (scene.name, len(masks))
        tree = nodes.compositor_tree(scene)
        ours = [n for n in tree.nodes if n.get(nodes.ROLE) in {"mask", "trace"} or nodes.SOURCE in n] if tree else []
        if scene not in standing:
            assert not ours, (scene.name, [n.name for n in ours])
            continue
        assert trace_scenes.owner(scene_setup.trace_scene(scene)) == scene
        held_out = {ob for collection in scene_setup.own_collections(scene) for ob in collection.objects}
        wanted = set(traced_objects.held_out_by_collection(scene, scene_setup.source_layer(scene)))
        assert held_out == wanted, (scene.name, [ob.name_full for ob in held_out ^ wanted])
        assert not compositor_setup.feeds_nothing(scene, scene_setup.source_layer(scene)), scene.name
        traces = {trace_scenes.find(scene, layer) for layer in view_layers.source_layers(scene)}
        assert {n.scene for n in ours if n.get(nodes.ROLE) == "trace"} == traces


def shape() -> dict[str, object]:
    """What the pipeline has made of each scene, but for the numbers that Blender adds to names that are taken."""
    return {scene.name: (_layers(scene), _links(scene)) for scene in actions.own_scenes()}


def _layers(scene: bpy.types.Scene) -> list[tuple[object, ...]]:
    own = scene_setup.own_collections(scene)

    def walked(b_layer: bpy.types.LayerCollection) -> tuple[object, ...]:
        name = "ours" if b_layer.collection in own else b_layer.collection.name
        switches = (b_layer.exclude, b_layer.holdout, b_layer.indirect_only)
        return (name, switches, sorted(map(walked, b_layer.children), key=repr))

    names = ["mask" if layer.get(view_layers.MASK_MARK) else layer.name for layer in scene.view_layers]
    switches = [(layer.use, layer.use_pass_z, layer.use_pass_diffuse_color) for layer in scene.view_layers]
    trees = [walked(layer.layer_collection) for layer in scene.view_layers]
    return sorted(zip(names, switches, trees, strict=True), key=repr)


def _links(scene: bpy.types.Scene) -> list[tuple[str, ...]]:
    tree = nodes.compositor_tree(scene)

    def called(node: bpy.types.Node) -> str:
        own = "Hybrid" if nodes.is_stand_in(node) else nodes.role(node).replace("own", "")
        return f"{own or node.type}{' muted' * node.mute}"

    return sorted((called(k.from_node), k.from_socket.name, called(k.to_node), k.to_socket.name)
                  for k in (tree.links if tree else ()))  # fmt: skip


def picture(scene: bpy.types.Scene) -> Iterator[float]:
    """F12; afterwards `shot` is (h, w, 4), as it would be saved."""
    global shot
    yield from actions.render(None)
    path = str(FOLDER / "shot.png")
    bpy.data.images["Render Result"].save_render(path)
    image = bpy.data.images.load(path)
    shot = np.array(image.pixels[:], np.float32).reshape(image.size[1], image.size[0], -1)
    bpy.data.images.remove(image)
    assert shot.shape[:2] == (scene.render.resolution_y, scene.render.resolution_x), shot.shape


def ticked(scene: bpy.types.Scene) -> set[bpy.types.Object]:
    """What should be ray traced, by the rule in docs/manual/first-render.md."""
    collections = [scene.collection, *scene.collection.children_recursive]
    by_collection = {ob for c in collections if c.hybrid.ray_traced for ob in c.all_objects}
    found = {ob for ob in scene.objects if ob.hybrid.ray_traced or ob in by_collection or shows_ticked(ob)}
    return found | {inner for ob in found if ob.instance_collection for inner in ob.instance_collection.all_objects}


def shows_ticked(b_object: bpy.types.Object) -> bool:
    """Whether it instances a ticked collection."""
    shown = b_object.instance_collection
    return shown is not None and any(c.hybrid.ray_traced for c in (shown, *shown.children_recursive))


def expected_mask(scene: bpy.types.Scene) -> np.ndarray:
    """(h, w) bool: where the camera's ray through the pixel's centre meets a ticked object first, by Blender's cast."""
    layer = scene_setup.source_layer(scene)
    layer.update()
    depsgraph, camera, wanted = layer.depsgraph, scene.camera, ticked(scene)
    matrix, corners = camera.matrix_world, camera.data.view_frame(scene=scene)
    width, height = SIZE
    right, top = (max(corner[axis] for corner in corners) for axis in (0, 1))
    left, bottom = (min(corner[axis] for corner in corners) for axis in (0, 1))
    found = np.zeros((height, width), bool)
    for y in range(height):
        for x in range(width):
            across, up = left + (right - left) * (x + 0.5) / width, bottom + (top - bottom) * (y + 0.5) / height
            towards = matrix.to_3x3() @ mathutils.Vector((across, up, corners[0].z))
            hit = scene.ray_cast(depsgraph, matrix.translation, towards.normalized())
            found[y, x] = hit[0] and hit[4].original in wanted
    return found


def ambiguous(scene: bpy.types.Scene) -> bool:
    """Whether two things lie in one place, or are hidden from renders only: rays and EEVEE may choose another one."""
    shown = scene_setup.source_layer(scene).depsgraph.object_instances
    places = [tuple(round(x, 3) for x in i.matrix_world.translation) for i in shown if i.object.type == "MESH"]
    return len(set(places)) < len(places) or any(collection.hide_render for collection in bpy.data.collections)


def steady(flags: np.ndarray) -> np.ndarray:
    """Pixels whose neighbours are all like them: no edge within the pixel filter's reach."""
    around = np.pad(flags, 1, mode="edge")
    rows, columns = flags.shape
    shifts = [around[y : y + rows, x : x + columns] for y in range(3) for x in range(3)]
    return np.all([shift == flags for shift in shifts], axis=0)


def ending(number: int) -> Iterator[float]:
    """The picture at the end of a walk, and the file; see the head."""
    scene = bpy.context.window_manager.windows[0].scene
    if scene.library is not None or scene.camera is None or os.environ.get("PLAIN"):
        return
    scene.hybrid.enabled, scene.hybrid.mode = True, "HYBRID"
    yield 0.05
    check()
    expected = expected_mask(scene)
    yield from picture(scene)
    walked, frame = shot, session.of(scene.name).frame
    mask = np.zeros(expected.shape) if frame is None else frame.mask
    right = np.where(expected, mask > 0.99, mask < 0.01) | ~steady(expected)
    if not ambiguous(scene):
        assert right.all(), (int((~right).sum()), sorted(ob.name for ob in ticked(scene)))
    walked_shape = shape()
    hybrid.disable(scene)
    yield 0.05
    plain_shape = shape()
    if number % EVERY == 0:
        yield from picture(scene)
    plain = shot
    hybrid.enable(scene)
    yield 0.05
    assert shape() == walked_shape, ("another pipeline than a fresh one", walked_shape, shape())
    if number % EVERY == 0:
        yield from picture(scene)
        assert np.abs(walked - shot).max() <= TOLERANCE, "another picture than by a fresh set-up"
        tree = nodes.compositor_tree(scene)
        if not (scene_setup.traces_shadows(scene) or any(node.type in actions.OWN_NODES for node in tree.nodes)):
            assert np.abs(walked - plain)[far_from(mask)].max(initial=0.0) <= TOLERANCE, "EEVEE's half is not EEVEE's"
    print(f"WALK {number} {len(ticked(scene))} ray traced, {mask.mean() * 100:.1f} % of the picture", flush=True)
    yield from without(scene.name, plain_shape[scene.name], plain if number % EVERY == 0 else None)


def without(name: str, plain_shape: object, plain: np.ndarray | None) -> Iterator[float]:
    """Save; open without the add-on: a plain file, with a note, and EEVEE's picture."""
    path = str(FOLDER / "ended.blend")
    actions.op(bpy.ops.wm.save_as_mainfile, filepath=path)
    bpy.ops.preferences.addon_disable(module=PACKAGE)
    bpy.ops.wm.open_mainfile(filepath=path)
    yield 0.05
    ours = [s.name for s in bpy.data.scenes if s.library is None and trace_scenes.TRACE_SCENE in s.name]
    ours += [c.name for c in bpy.data.collections if c.library is None and scene_setup.COLLECTION_MARK in c]
    ours += [g.name for g in bpy.data.node_groups if g.library is None and GROUP_MARK in g]
    assert not ours, ours
    notes = [text.as_string() for text in bpy.data.texts if text.library is None]
    assert sum("plain EEVEE" in text and name in text for text in notes) == 1, notes
    scene = bpy.data.scenes[name]
    assert (_layers(scene), _links(scene)) == plain_shape
    if plain is not None:
        bpy.context.window_manager.windows[0].scene = scene
        yield from picture(scene)
        assert np.abs(shot - plain).max() <= TOLERANCE, "without the add-on another picture than EEVEE's"
    bpy.ops.preferences.addon_enable(module=PACKAGE)
    yield 0.05


def far_from(mask: np.ndarray) -> np.ndarray:
    """Pixels with no coverage in themselves or beside them: the tail of the pixel filter ends there."""
    around = np.pad(mask, 1)
    shifts = [np.roll(around, (y, x), (0, 1)) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    return np.max(shifts, axis=0)[1:-1, 1:-1] == 0


def walk(number: int) -> Iterator[float]:
    """One sequence."""
    dice = random.Random(number)
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "start.blend"))
    for step in range(int(STEPS)):
        action = dice.choice(ACTIONS)
        print(f"WALK {number}.{step} {action.__name__}", flush=True)
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            todo = action(dice)
        if todo is not None:
            yield from todo
        elif dice.random() < 0.5:
            yield 0.0  # Blender draws, and its own timers run
        check()


def walks() -> Iterator[float]:
    """All of them."""
    actions.FILE, actions.LIBRARY = str(FOLDER / "walk.blend"), str(FOLDER / "library.blend")
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.eevee.taa_render_samples, scene.hybrid.samples = 1, 1
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "start.blend"))
    actions.library(actions.LIBRARY)
    for number in range(int(FIRST), int(LAST or FIRST) + 1):
        began = time.perf_counter()
        yield from walk(number)
        yield from ending(number)
        for scene in actions.own_scenes():
            hybrid.disable(scene)
        check()
        print(f"WALK {number}: consistent, {time.perf_counter() - began:.1f} s", flush=True)
    print("WALK: all consistent", flush=True)
    os._exit(0)


FOLDER = Path(FOLDER)
shot = np.zeros((0, 0, 4), np.float32)
screen.limit(max(screen.PATIENCE, 120 * (int(LAST or FIRST) - int(FIRST) + 1)))
bpy.context.preferences.view.render_display_type = "NONE"
_walks = walks()
screen.soon(lambda: next(_walks), persistent=True)
