# SPDX-License-Identifier: GPL-3.0-or-later
"""When the pipeline has to look again: after edits, undo, load, save, append; in the background before a render."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import bpy
from bpy.app.handlers import persistent

from . import preview, session
from .errors import HybridError
from .pipeline import eevee_shadows, note, others_handlers, scene_setup, trace_scenes, traced_objects, transmission
from .pipeline.fingerprint import Fingerprint, fingerprint
from .pipeline.guard import guard
from .render import growing, images, multilayer, retrace
from .ui import defaults, messages
from .ui.image_editor import insets, picker, slots
from .view_layers import hand_over_properties


@dataclass(eq=False)
class _History:
    """Where the user stands in Blender's undo history.

    undone     : fingerprint of what an undo or redo has just brought back, until the user changes something.
    unfinished : hashes of the fingerprints that a step of ours followed.
    again      : the operator, undo or redo, that goes on.
    """

    undone: Fingerprint | None = None
    unfinished: deque[int] = field(default_factory=partial(deque, maxlen=1024))
    again: Any = None


_history = _History()


def _later() -> None:
    """Sync soon, from a timer: Blender is in the middle of an update. In the background when a render begins.

    Never at once: an update that goes on after its handlers has kept pointers to what they changed (5.2 crashes).
    """
    if not bpy.app.background and not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=0.0)


def _tick() -> float | None:
    """Bring the scenes in step, as an undo step of its own.

    Blender's undo reuses what did not change between two steps from memory, pointers included: a change that no step
    knows of leaves pointers to removed data there, and crashes it later. For the same reason an undo is left alone
    until the user changes something: our repair would be a step that he can never undo past. Undo and redo do not stop
    between the user's step and ours after it, where the picture would be wrong: they go on to the next one.
    """
    if bpy.app.is_job_running("RENDER"):
        return 0.5  # a render reads the scene on another thread: wait
    if _history.again is not None:
        operator, _history.again = _history.again, None
        _in_window(operator)
        return None
    before = fingerprint()
    if before == _history.undone:
        return None
    _history.undone = None
    imported = note.take_back()
    scene_setup.sync_all()
    if fingerprint() != before:
        _history.unfinished.append(hash(before))
        push_undo()
    elif imported:
        push_undo()
    return None


def push_undo() -> None:
    """Make what the pipeline has just changed a step of the undo history (there is none in the background)."""
    _in_window(bpy.ops.ed.undo_push, message="Hybrid")


def _in_window(operator: Any, **properties: str) -> None:
    """Run an operator of the undo history; a timer's context has no window of its own."""
    windows = [] if bpy.app.background else list(bpy.context.window_manager.windows)
    if windows:
        with bpy.context.temp_override(window=bpy.context.window or windows[0]):
            if operator.poll():
                operator(**properties)


@persistent
def _on_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    transmission.changed()
    retrace.touched(depsgraph)
    if not any(scene.hybrid.enabled or scene_setup.is_trace_scene(scene) for scene in bpy.data.scenes):
        return
    if any(_concerns_us(update.id) for update in depsgraph.updates):
        _later()


def _concerns_us(b_id: bpy.types.ID) -> bool:
    """Whether the change of a datablock may change what the pipeline depends on."""
    if isinstance(b_id, bpy.types.Object):
        return b_id.instance_collection is not None  # it may show another collection now
    return isinstance(b_id, (bpy.types.Scene, bpy.types.Collection))


@persistent
def _on_undone(*_args: Any) -> None:
    _moved(bpy.ops.ed.undo)


@persistent
def _on_redone(*_args: Any) -> None:
    _moved(bpy.ops.ed.redo)


def _moved(operator: Any) -> None:
    """The user has gone one step through the history: leave it as it is, or go on if a step of ours is the next."""
    transmission.changed()
    if bpy.app.background:
        scene_setup.sync_all()
        return
    scene_setup.rejoin_all()
    _history.undone = fingerprint()
    _history.again = operator if hash(_history.undone) in _history.unfinished else None
    if _history.again is not None:
        _later()


@persistent
def _on_loaded(*_args: Any) -> None:
    """At once: Blender makes the first undo step of the new file after this."""
    _history.undone = _history.again = None
    defaults.pin(bpy.data.scenes)
    note.take_back()
    session.forget()
    insets.forget()
    slots.forget()
    picker.forget()
    preview.forget()
    transmission.changed()
    scene_setup.sync_all()
    if bpy.app.background and any(scene_setup.is_active(scene) for scene in bpy.data.scenes):
        images.ensure_render_result()


@persistent
def _on_imported(imported: bpy.types.BlendImportContext) -> None:
    defaults.pin(item.id for item in imported.import_items if isinstance(item.id, bpy.types.Scene))
    _later()


@persistent
def _before_save(*_args: Any) -> None:
    """A saved file holds the user's scene and our settings, nothing that needs the add-on to render."""
    if not bpy.app.background and bpy.app.is_job_running("RENDER"):
        return  # saved as it is; the next load brings it in step
    defaults.stamp(*bpy.data.scenes)
    note.leave()
    scene_setup.tear_down_all()


@persistent
def _after_save(*_args: Any) -> None:
    note.take_back()
    if any(scene.hybrid.enabled for scene in bpy.data.scenes):
        scene_setup.sync_all()
        push_undo()


_alone: list[str] = []  # the scene whose render a script has confined to one layer since we last looked

ALONE = "only EEVEE drew it: Render Single Layer, which leaves the ray traced half out, was switched on. Render again"


@persistent
def _before_render(scene: bpy.types.Scene, *_args: Any) -> None:
    """In the background only: in a window this runs on the render thread, where editing the scene crashes Blender.

    Whatever is evaluated here must not have our handlers edit scenes in the middle of it: that crashes Blender, too.
    """
    others_handlers.stand_first(_evaluation_begins)
    growing.render_begins()
    messages.render_begins(scene)
    if bpy.app.background:
        _alone[:] = [scene.name] if scene.render.use_single_layer and scene_setup.is_active(scene) else []
        scene_setup.sync_all()  # the scenes that its compositor shows, too
        scene_setup.sync(scene)  # it last: scenes may share a compositor
    trace_scenes.begin()
    with guard():
        retrace.begins(scene)


@persistent
def _evaluation_begins(scene: bpy.types.Scene, *_args: Any) -> None:
    others_handlers.evaluation_begins(scene, scene_setup.is_trace_scene(scene))
    trace_scenes.show_layer(scene)


@persistent
def _evaluated(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Blender calls this for each view layer that it is about to render, too."""
    transmission.changed()
    if scene.hybrid.enabled and scene_setup.is_active(scene.original):
        traced_objects.hold_out(scene.original, depsgraph)
        eevee_shadows.hand_over(scene.original, depsgraph)
        trace_scenes.evaluated(depsgraph)
        hand_over_properties(scene.original, depsgraph.view_layer_eval)


@persistent
def _frame_begins(scene: bpy.types.Scene, *_args: Any) -> None:
    trace_scenes.attach()  # handlers may have chosen another camera for this frame
    others_handlers.frame_begins(scene)
    session.begin_frame(scene.name, growing.slot())
    messages.frame_begins(scene)


@persistent
def _written(scene: bpy.types.Scene, *_args: Any) -> None:
    """Blender has written a picture."""
    own = session.of(scene.name)
    try:
        multilayer.written(scene, own.began)
    except HybridError as error:
        own.fail(error)


@persistent
def _frame_ends(scene: bpy.types.Scene, *_args: Any) -> None:
    others_handlers.frame_ends()
    session.of(scene.name).end_frame()


@persistent
def _render_ends(scene: bpy.types.Scene, *_args: Any) -> None:
    others_handlers.frame_ends()
    trace_scenes.detach()
    own = session.of(scene.name)
    if scene.name in _alone and own.frame is None and own.error is None:  # Blender asked before it told us
        if scene_setup.effective_mode(scene) != "RASTER":
            own.fail(HybridError(f"scene '{scene.name}': {ALONE}"))
    _alone.clear()
    retrace.finished(scene.name)
    messages.render_ended(scene.name)


_HANDLERS: tuple[tuple[str, Callable[..., None]], ...] = (
    ("depsgraph_update_post", _on_update),
    ("undo_post", _on_undone),
    ("redo_post", _on_redone),
    ("load_post", _on_loaded),
    ("blend_import_post", _on_imported),
    ("save_pre", _before_save),
    ("save_post", _after_save),
    ("save_post_fail", _after_save),
    ("frame_change_pre", _evaluation_begins),
    ("frame_change_post", _evaluated),
    ("render_init", _before_render),
    ("render_pre", _frame_begins),
    ("render_post", _frame_ends),
    ("render_write", _written),
    ("render_complete", _render_ends),
    ("render_cancel", _render_ends),
)


def register() -> None:
    """Add the handlers, and look at the file that is open already."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)
    if hasattr(bpy.data, "scenes"):  # restricted data while Blender starts has none
        defaults.pin(bpy.data.scenes)
        if bpy.app.background:  # before anything is evaluated: in the middle of that 5.2 crashes on a new view layer
            scene_setup.sync_all()
    if not bpy.app.background:
        bpy.app.timers.register(_tick, first_interval=0.0)


def unregister() -> None:
    """Remove them, and a timer that may still wait."""
    for name, handler in reversed(_HANDLERS):
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)
    if not bpy.app.background and bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
