# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that the add-on adds to Blender, in order, and its removal in reverse order."""

from __future__ import annotations

import atexit
import contextlib
from pathlib import Path

import bpy

from . import cli, handlers, preview, session
from .errors import HybridError, require_tracer
from .pipeline import scene_setup, trace_scenes
from .render import engine, main_thread
from .ui import (
    advice,
    cameras,
    messages,
    operators,
    panels,
    presets,
    properties,
    render_panels,
    translations,
)
from .ui.image_editor import editor_panels, insets, picker, slots, wipe

_CLASSES = (
    *properties.CLASSES,
    *operators.CLASSES,
    *presets.CLASSES,
    *cameras.CLASSES,
    *messages.CLASSES,
    *picker.CLASSES,
    *wipe.CLASSES,
    *insets.CLASSES,
    *engine.CLASSES,
    *panels.CLASSES,
    *editor_panels.CLASSES,
    *render_panels.CLASSES,
    *advice.CLASSES,
)
_registered = False


def register() -> None:
    """Add classes, properties, handlers and the `hybrid` command. Twice is the same as once."""
    global _registered
    if _registered:
        return
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    translations.register()
    handlers.register()
    main_thread.register()
    preview.register(translations.sentence)
    panels.register()
    bpy.utils.register_manual_map(operators.manual_map)
    cli.register()
    _registered = True
    if getattr(bpy.app, "module", False):
        atexit.register(unregister)  # nothing else unregisters in the bpy module, and 4.5's then crashes at exit
    with contextlib.suppress(HybridError):  # the first render says it
        load_kernels()


def load_kernels() -> None:
    """Keep compiled kernels in the extension's own folder; in a window, load them now, else with the first picture."""
    require_tracer()
    from ..tracer.kernels import loading

    parts = __package__.split(".")
    if parts[0] == "bl_ext":
        loading.cache_in(Path(bpy.utils.extension_path_user(".".join(parts[:3]), path="kernels")))
    if not bpy.app.background:
        loading.begin()


def unregister() -> None:
    """Take the pipeline out of every open scene (its settings stay in the file), then everything else."""
    global _registered
    if not _registered:
        return
    atexit.unregister(unregister)
    if hasattr(bpy.data, "scenes"):  # restricted data while Blender shuts down has none
        scene_setup.tear_down_all()
        if bpy.context.window_manager is not None:
            handlers.push_undo()
    trace_scenes.close()
    cli.unregister()
    bpy.utils.unregister_manual_map(operators.manual_map)
    panels.unregister()
    insets.forget()
    slots.forget()
    session.forget()
    preview.unregister()
    main_thread.unregister()
    handlers.unregister()
    translations.unregister()
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
    _registered = False
