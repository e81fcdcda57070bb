# SPDX-License-Identifier: GPL-3.0-or-later
"""The trace scenes: they lie beside the file, not in it.

Blender renders a scene of our engine because a compositor node asks for it; nothing says that this scene has to be one
of the file's. Those here are in a temporary database (`bpy.data.temp_data`): no list of scenes has them, no exporter or
script meets them, no file is saved with them, and no undo step knows them.

Blender does not keep pointers right from one database into another. So a trace scene points to the user's only while
that is rendered, from `attach` to `detach`; the other way the compositor's nodes point to a trace scene, and none is
removed before the add-on leaves. That of a scene that is gone serves the next one.
"""

from __future__ import annotations

import threading
from collections.abc import Collection
from itertools import count
from typing import Any

import bpy

from ..view_layers import (
    MASK_MARK,
    copy_evaluation,
    copy_views,
    imitated_by,
    number_of,
    set_,
    source_layers,
)
from . import context_drivers, others_handlers

TRACE_SCENE = "Hybrid Trace"
TRACE_LAYER = "Traced"
ENGINE = "HYBRID_TRACER"
TRACE_MARK = "hybrid_trace"  # custom property on our scenes: a user may choose our engine for his own

_context: Any = None  # of the temporary database
_database: Any = None
_rendering = False
_read_by_drivers: list[context_drivers.Path] = []  # of the trace scene, in the render that runs
_not_given: dict[int, list[str]] = {}  # what of that a trace scene cannot have, by the `session_uid` of the user's
_owned: dict[tuple[int, int], bpy.types.Scene] = {}  # trace scenes by the user's `session_uid`, the layer's number


def is_trace_scene(scene: bpy.types.Scene) -> bool:
    """Whether the scene is one of ours."""
    return scene.render.engine == ENGINE and TRACE_MARK in scene


def is_ours(b_id: bpy.types.ID) -> bool:
    """Whether a datablock lies beside the file."""
    return _database is not None and any(b_id in there for there in (list(_database.objects), list(_database.cameras)))


def find(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> bpy.types.Scene | None:
    """The trace scene of this hybrid view layer of a scene, or None."""
    return _owned.get((scene.session_uid, number_of(layer)))


def owner(trace: bpy.types.Scene) -> bpy.types.Scene | None:
    """The user's scene that this trace scene, original or evaluated, belongs to; None for any other scene."""
    uid, _ = _key_of(trace)
    return next((scene for scene in bpy.data.scenes if scene.session_uid == uid), None)


def layer_of(trace: bpy.types.Scene, scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """The view layer of its owner that a trace scene, original or evaluated, renders."""
    _, number = _key_of(trace)
    return next((layer for layer in source_layers(scene) if number_of(layer) == number), source_layers(scene)[0])


def _key_of(trace: bpy.types.Scene) -> tuple[int | None, int]:
    return next((key for key, own in _owned.items() if own.session_uid == trace.session_uid), (None, 0))


def ensure(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> bpy.types.Scene:
    """The trace scene of this hybrid layer of a scene, made if there is none."""
    key = (scene.session_uid, number_of(layer))
    found = _owned.get(key)
    if found is not None and found.name in _names_of_the_file():
        _release(key)
        found = None
    if found is None:
        found = _owned[key] = _spare() or _new()
    return found


def release(scene: bpy.types.Scene) -> None:
    """This scene needs its trace scenes no more."""
    release_others(scene, ())


def release_others(scene: bpy.types.Scene, numbers: Collection[int]) -> None:
    """It needs those of the layers of these numbers only."""
    for key in [key for key in _owned if key[0] == scene.session_uid and key[1] not in numbers]:
        _release(key)


def release_lost() -> None:
    """Nor do scenes that are gone."""
    there = {scene.session_uid for scene in bpy.data.scenes}
    for key in [key for key in _owned if key[0] not in there]:
        _release(key)


def _release(key: tuple[int, int]) -> None:
    _point(_owned.pop(key), None)


def begin() -> None:
    """A render begins: look what drivers will read, and `attach`."""
    global _rendering
    _rendering = True
    _read_by_drivers[:] = context_drivers.paths() if _owned else []
    attach()


def attach() -> None:
    """Let each trace scene show its owner's objects, as that one evaluates them."""
    shown()
    for trace in _owned.values():
        scene = owner(trace)
        if scene is not None:
            _point(trace, scene)
            layer = layer_of(trace, scene)
            _not_given[scene.session_uid] = context_drivers.copy(_read_by_drivers, scene, layer, trace)


def evaluated(depsgraph: bpy.types.Depsgraph) -> None:
    """A layer of the user's scene has been evaluated for a render: what drivers read may be animated."""
    if depsgraph.mode != "RENDER" or not _read_by_drivers:
        return
    scene, layer = depsgraph.scene, depsgraph.view_layer
    source = imitated_by(scene, layer) if MASK_MARK in layer else layer
    trace = find(scene, source) if source in source_layers(scene) else None
    if trace is not None:
        context_drivers.copy(_read_by_drivers, depsgraph.scene_eval, depsgraph.view_layer_eval, trace)


def warnings(scene: bpy.types.Scene) -> list[str]:
    """What the traced half of the last render has not."""
    return [
        f"drivers read {path!r} of the active scene or view layer: what they move may be elsewhere in the traced half"
        for path in _not_given.get(scene.session_uid, ())
    ]


def detach() -> None:
    """Nothing is rendered any more."""
    global _rendering
    shown()
    _rendering = False
    for trace in _owned.values():
        _point(trace, None)


_switched: list[tuple[bpy.types.ViewLayer, bool]] = []  # off or on, and what was before


def show_layer(scene: bpy.types.Scene) -> None:
    """Blender is about to evaluate a scene of ours: have it show the view layer that is traced.

    Of a background scene Blender takes the first layer that has Use for Rendering: when it builds the dependency graph,
    which comes after this, and each time it evaluates that, maybe twice in a row. If they differ it crashes. So nothing
    is put back before Blender has done with it: `shown`.
    """
    shown()
    b_set = scene.background_set
    on_render_thread = bpy.app.background or threading.current_thread() is not threading.main_thread()
    if not _rendering or b_set is None or scene.render.engine != ENGINE or not on_render_thread:
        return
    wanted = layer_of(scene, b_set)
    if next((layer for layer in b_set.view_layers if layer.use), None) == wanted:
        return
    for layer in b_set.view_layers:
        if layer.use != (layer == wanted):
            _switched.append((layer, layer.use))
            layer.use = layer == wanted


def shown() -> None:
    """It has been evaluated: all layers as they were."""
    while _switched:
        layer, use = _switched.pop()
        layer.use = use


def close() -> None:
    """The add-on leaves: remove the database."""
    global _context, _database
    if _context is None:
        return
    ours = set(_database.scenes)
    trees = [*bpy.data.node_groups, *(getattr(scene, "node_tree", None) for scene in bpy.data.scenes)]
    for tree in trees:
        for node in tree.nodes if tree is not None else ():
            if node.bl_idname == "CompositorNodeRLayers" and node.scene in ours:
                node.scene = None
    detach()
    _owned.clear()
    _context.__exit__(None, None, None)
    _context = _database = None


def _names_of_the_file() -> set[str]:
    """None of them may be a trace scene's: Blender finds a scene's render by its name, in all databases."""
    return {scene.name for scene in bpy.data.scenes}


def _point(trace: bpy.types.Scene, scene: bpy.types.Scene | None) -> None:
    set_(trace, "background_set", scene)
    camera = None if scene is None else scene.camera or _marker_camera(scene)
    # One of its own else: before a render in a window begins, Blender asks whether all scenes have a camera.
    set_(trace, "camera", camera or _database.objects[trace.name])
    if scene is not None:
        copy_evaluation(scene, trace)
        copy_views(scene, trace)


def _marker_camera(scene: bpy.types.Scene) -> bpy.types.Object | None:
    return next((marker.camera for marker in scene.timeline_markers if marker.camera), None)


def _spare() -> bpy.types.Scene | None:
    if _database is None:
        return None
    taken = _names_of_the_file()
    there = (trace for trace in _database.scenes if trace.name not in taken)
    return next((trace for trace in there if trace not in _owned.values()), None)


def _new() -> bpy.types.Scene:
    global _context, _database
    if _database is None:
        _context = bpy.data.temp_data()
        _database = _context.__enter__()
    taken = _names_of_the_file().union(scene.name for scene in _database.scenes)
    names = (TRACE_SCENE if n == 1 else f"{TRACE_SCENE} {n}" for n in count(1))
    trace: bpy.types.Scene = _database.scenes.new(next(name for name in names if name not in taken))
    trace.render.engine = ENGINE
    trace[TRACE_MARK] = True
    trace.camera = _database.objects.new(trace.name, _database.cameras.new(trace.name))
    trace.view_layers[0].name = TRACE_LAYER
    with others_handlers.hidden():
        trace.view_layers[0].update()  # a render that meets a scene which was never evaluated crashes
    return trace
