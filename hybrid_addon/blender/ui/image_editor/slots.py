# SPDX-License-Identifier: GPL-3.0-or-later
"""The slots of the Render Result: what was rendered into each, of our halves and of Blender's picture."""

from __future__ import annotations

from functools import partial

import bpy
import numpy as np

from ....scene import Float32
from ... import files, session
from ...errors import HybridError
from ...render import growing, images, main_thread
from ...session import Frame

LAST_CHOICE = "SLOT"
"""Of `Scene.hybrid.shown`: the picture in the slot `compare_slot`."""


class _Read:
    """The picture that was last read out of a slot, (h, w, 4) display values, and why there is none, if so."""

    slot = -1
    pixels: Float32 | None = None
    problem = ""


_read = _Read()


def active() -> int:
    """The slot that is shown, from 0; -1: there is no Render Result."""
    image = bpy.data.images.get(images.RENDER_RESULT)
    return -1 if image is None else image.render_slots.active_index


def frame_shown(scene: bpy.types.Scene) -> Frame | None:
    """Our halves of the picture that is shown; None where the slot has none, or of another size."""
    frame = session.of(scene.name).frame_in(active())
    return None if frame is None or (frame.of and frame.of != growing.frame_of(scene)) else frame


def other_picture(scene: bpy.types.Scene) -> Float32 | None:
    """What is in the slot to compare with, as it was read last."""
    return _read.pixels if _read.slot == scene.hybrid.compare_slot - 1 else None


def problem(scene: bpy.types.Scene) -> str:
    """Why the other slot's picture is not shown, as one line for people; "" if it is, or nobody wants it."""
    if scene.hybrid.shown != LAST_CHOICE:
        return ""
    if scene.hybrid.compare_slot - 1 == active():
        return "this is the slot that is shown: choose another one"
    return _read.problem if _read.slot == scene.hybrid.compare_slot - 1 else ""


def changed(scene: bpy.types.Scene) -> None:
    """The choice of what is shown, or what is in a slot: read the other slot if it is wanted, and draw again.

    On the main thread, and later than now: a slot is read by showing it for a moment.
    """
    redraw()
    if scene.hybrid.shown == LAST_CHOICE and not bpy.app.background:
        main_thread.post(partial(_fetch, scene.name))


def _fetch(name: str) -> None:
    scene = bpy.data.scenes.get(name)
    if scene is not None and not bpy.app.is_job_running("RENDER"):  # its end comes here again
        read(scene)
        redraw()


def read(scene: bpy.types.Scene) -> None:
    """Read the picture in the scene's other slot, as Blender shows it, view transform and all."""
    _read.slot, _read.pixels, _read.problem = scene.hybrid.compare_slot - 1, None, ""
    image = bpy.data.images.get(images.RENDER_RESULT)
    if image is None or not image.render_slots:
        _read.problem = "nothing is rendered yet"
        return
    before = image.render_slots.active_index
    if _read.slot >= len(image.render_slots):
        _read.problem = f"slot {_read.slot + 1} is empty: render into it"
        return
    try:
        image.render_slots.active_index = _read.slot
        with files.scratch() as path, images.image_settings(scene, "IMAGE", "PNG", "8"):
            image.save_render(path, scene=scene)
            _read.pixels = _opaque(path)
    except (RuntimeError, HybridError):
        _read.problem = f"slot {_read.slot + 1} is empty: render into it"
    finally:
        image.render_slots.active_index = before


def _opaque(path: str) -> Float32:
    """(h, w, 4) display values of a file, bottom row first."""
    import OpenImageIO as oiio

    source = oiio.ImageBuf(path)
    pixels = np.asarray(source.get_pixels("float"), np.float32)
    if pixels.ndim != 3:
        raise HybridError(f"cannot read '{path}': {source.geterror()}")
    return np.dstack([pixels[::-1, :, :3], np.ones(pixels.shape[:2], np.float32)])


def forget() -> None:
    """Let go of the picture."""
    _read.slot, _read.pixels, _read.problem = -1, None, ""


def redraw() -> None:
    """All image editors, soon."""
    for window in getattr(bpy.context.window_manager, "windows", ()):
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                area.tag_redraw()
