# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene as a render evaluates it, without rendering it.

A viewport's dependency graph has other levels of modifiers than a render's, leaves out what is hidden from viewports,
and shows what is hidden from renders. Python gets a render's only inside a render. So a scene with nothing in it is
rendered by our engine, with the one to look at as its background set. With a window that would change which picture is
in which slot of the Render Result; there the viewport's has to do.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import bpy

from ..errors import HybridError
from ..view_layers import copy_evaluation, source_layer
from . import scene_setup
from .guard import guard

EMPTY_MARK = "hybrid_empty"  # custom property on a scene that is rendered for what happens meanwhile

T = TypeVar("T")
Work = Callable[[bpy.types.Depsgraph], T]

_work: Work[Any] | None = None


def look(scene: bpy.types.Scene, work: Work[T]) -> T:
    """What `work` returns of the scene's dependency graph, evaluated for a render at the current frame.

    Raises what `work` does, and HybridError where Blender does not evaluate the scene.
    """
    if not bpy.app.background:
        layer = source_layer(scene)
        layer.update()
        return work(layer.depsgraph)
    found: list[T] = []
    failed: list[Exception] = []

    def seen(depsgraph: bpy.types.Depsgraph) -> None:
        try:
            found.append(work(depsgraph))
        except Exception as error:  # Blender would print it and go on
            failed.append(error)

    render_nothing(scene, seen)
    if failed:
        raise failed[0]
    if not found:
        raise HybridError(f"Blender does not evaluate scene '{scene.name}': does it render?")
    return found[0]


def differs(scene: bpy.types.Scene) -> list[str]:
    """Names of the objects of which `look` gets anything else than a render would: with a window, some."""
    if bpy.app.background:
        return []
    layer = source_layer(scene)
    rendered = {b_object for b_object in scene_setup.rendered_objects(scene, layer) if not b_object.hide_render}
    return [
        b_object.name
        for b_object in layer.objects
        if b_object.visible_get(view_layer=layer) != (b_object in rendered)
        or (b_object in rendered and any(map(_is_other_in_a_render, b_object.modifiers)))
    ]


def _is_other_in_a_render(modifier: bpy.types.Modifier) -> bool:
    levels = [getattr(modifier, name, 0) for name in ("levels", "render_levels")]
    return modifier.show_viewport != modifier.show_render or (modifier.show_render and levels[0] != levels[1])


def render_nothing(scene: bpy.types.Scene | None = None, work: Work[None] | None = None) -> None:
    """Render a scene with nothing in it; `work` gets its dependency graph, in which `scene` is evaluated, too."""
    global _work
    with guard():
        empty = bpy.data.scenes.new("Hybrid Empty")
        camera = bpy.data.cameras.new("Hybrid Empty")
        try:
            empty.render.engine, empty[EMPTY_MARK] = scene_setup.ENGINE, True
            b_object = bpy.data.objects.new("Hybrid Empty", camera)
            empty.camera = b_object  # without one Blender ends the process
            empty.render.resolution_x = empty.render.resolution_y = 4
            if scene is not None:
                empty.background_set, empty.camera = scene, scene.camera or b_object
                copy_evaluation(scene, empty)
                empty.frame_set(scene.frame_current, subframe=scene.frame_subframe)
            _work = work
            bpy.ops.render.render(scene=empty.name)
        finally:
            _work = None
            bpy.data.cameras.remove(camera)  # and with it the object
            bpy.data.scenes.remove(empty)


def seen(depsgraph: bpy.types.Depsgraph) -> None:
    """The engine is asked to render nothing."""
    if _work is not None:
        _work(depsgraph)
