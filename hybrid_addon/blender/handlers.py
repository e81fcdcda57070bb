"""When the pipeline has to look again: after edits, undo, load, save, append; once more before a background render."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
from bpy.app.handlers import persistent

from . import pipeline, results


def _later() -> None:
    """Sync soon: in a window from a timer, since Blender is in the middle of an update; in the background at once."""
    if bpy.app.background:
        pipeline.sync_all()
    elif not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=0.0)


def _tick() -> float | None:
    if bpy.app.is_job_running("RENDER"):
        return 0.5  # a render reads the scene on another thread: wait
    pipeline.sync_all()
    return None


@persistent
def _on_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if not any(scene.hybrid.enabled or pipeline.is_trace_scene(scene) for scene in bpy.data.scenes):
        return
    if any(isinstance(update.id, (bpy.types.Scene, bpy.types.Collection)) for update in depsgraph.updates):
        _later()


@persistent
def _on_restored(*_args: Any) -> None:
    """After a load, undo, redo or append anything may be different."""
    _later()


@persistent
def _before_save(*_args: Any) -> None:
    """A saved file holds the user's scene and our settings, nothing that needs the add-on to render."""
    if not bpy.app.background and bpy.app.is_job_running("RENDER"):
        return  # saved as it is; the next load brings it in step
    for scene in list(bpy.data.scenes):
        pipeline.tear_down(scene)


@persistent
def _after_save(*_args: Any) -> None:
    pipeline.sync_all()


@persistent
def _before_render(scene: bpy.types.Scene, *_args: Any) -> None:
    """In the background only: in a window this runs on the render thread, where editing the scene crashes Blender."""
    if bpy.app.background and not pipeline.is_trace_scene(scene):
        pipeline.sync(scene)


@persistent
def _frame_begins(scene: bpy.types.Scene, *_args: Any) -> None:
    results.start(scene.name)


@persistent
def _frame_ends(scene: bpy.types.Scene, *_args: Any) -> None:
    results.finish(scene.name)


_HANDLERS: tuple[tuple[str, Callable[..., None]], ...] = (
    ("depsgraph_update_post", _on_update),
    ("undo_post", _on_restored),
    ("redo_post", _on_restored),
    ("load_post", _on_restored),
    ("blend_import_post", _on_restored),
    ("save_pre", _before_save),
    ("save_post", _after_save),
    ("save_post_fail", _after_save),
    ("render_init", _before_render),
    ("render_pre", _frame_begins),
    ("render_post", _frame_ends),
)


def register() -> None:
    """Add the handlers."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Remove them, and a timer that may still wait."""
    for name, handler in reversed(_HANDLERS):
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)
    if not bpy.app.background and bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
