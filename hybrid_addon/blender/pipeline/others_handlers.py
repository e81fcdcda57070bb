# SPDX-License-Identifier: GPL-3.0-or-later
"""Handlers of others run as often, and with the same scenes, as without the add-on.

Blender calls `frame_change_pre` and `frame_change_post` for each view layer that it renders, and so for the mask layer
and for the trace scene. A handler that steps a simulation would step it twice. Blender walks through its lists of
handlers by index: ours stands first in `frame_change_pre`, and takes the others out for that evaluation.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from ..view_layers import MASK_MARK, imitated_by

_NAMES = ("frame_change_pre", "frame_change_post", "depsgraph_update_pre", "depsgraph_update_post")
_PACKAGE = __name__.rpartition(".blender.")[0]

_hidden: dict[str, list[Callable[..., Any]]] = {}  # whole lists, by name
_layers: list[str] = []  # that the frame in work has still to evaluate


def stand_first(handler: Callable[..., Any]) -> None:
    """Let this handler of ours be the first of `frame_change_pre`; others may have put theirs before it."""
    handlers = bpy.app.handlers.frame_change_pre
    if handlers and handlers[0] is not handler and handler in handlers:
        handlers.remove(handler)
        handlers.insert(0, handler)


def frame_begins(scene: bpy.types.Scene) -> None:
    """Blender renders the view layers of this scene next, in this order.

    With motion blur EEVEE evaluates each of them several times: then nothing tells them apart.
    """
    layers = [] if scene.render.use_motion_blur else [layer.name for layer in scene.view_layers if layer.use]
    _layers[:] = layers


def evaluation_begins(scene: bpy.types.Scene, ours: bool) -> None:
    """Blender evaluates a frame of this scene next: hide the handlers of others if it does so for us only.

    ours : it is a trace scene.
    """
    show()
    if ours or _is_for_the_mask(scene):
        hide()


def _is_for_the_mask(scene: bpy.types.Scene) -> bool:
    """Whether the mask layer is evaluated, beside the user's own. Alone it stands for that one."""
    if not _layers or (not bpy.app.background and threading.current_thread() is threading.main_thread()):
        return False
    layer = scene.view_layers.get(_layers.pop(0))
    source = imitated_by(scene, layer) if layer is not None and MASK_MARK in layer else None
    return source is not None and source.use


def hide() -> None:
    """Take the handlers of others out of Blender's lists, also those that have come since they were last hidden."""
    for name in _NAMES:
        handlers, before = getattr(bpy.app.handlers, name), _hidden.get(name, [])
        _hidden[name] = [*before, *(handler for handler in handlers if handler not in before)]
        handlers[:] = [handler for handler in handlers if getattr(handler, "__module__", "").startswith(_PACKAGE)]


def show() -> None:
    """Put them back, beside those that have come meanwhile."""
    for name in list(_hidden):
        handlers, before = getattr(bpy.app.handlers, name), _hidden.pop(name)
        handlers[:] = [*before, *(handler for handler in handlers if handler not in before)]


def frame_ends() -> None:
    """The frame is complete, or the render is over."""
    _layers.clear()
    show()


@contextmanager
def hidden() -> Iterator[None]:
    """Nobody else hears of what is done. Who was hidden before stays so."""
    were_hidden = bool(_hidden)
    hide()
    try:
        yield
    finally:
        if not were_hidden:
            show()
