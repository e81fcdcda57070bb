# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a render while it grows: EEVEE's half at once, the traced half over it, coarse to fine.

Blender shows of a running render the scene that F12 was pressed for, and ours is another: what a render engine updates
meanwhile is nowhere to be seen. So the render's thread leaves the picture so far in the session, the main thread has
the Image Editors redrawn, and a gizmo draws it over the Render Result (`ui/insets.py`) until Blender has the whole one.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...compositor import premultiply
from ...scene import Float32
from .. import session

if TYPE_CHECKING:
    from ...tracer.film.so_far import SoFar as Make

LONGEST_SIDE = 1024
"""Of the picture that is shown meanwhile, in pixels: every second or third of a larger one is enough to look at."""

EVERY_SECONDS = 1.0
"""Between two pictures."""

SOON_SECONDS = 0.2
"""Until the next look, while nothing is traced yet: the first picture is the one that is waited for."""

SHARE = 0.01
"""Of the time goes into making them, at most: those that take longer are made less often."""


class Growing:
    """The picture of one frame of a scene, on the render's thread."""

    def __init__(self, scene: bpy.types.Scene, window: tuple[int, int, int, int]) -> None:
        self.own, self.window = session.of(scene.name), window
        self.step = -(-max(window[2] - window[0], window[3] - window[1]) // LONGEST_SIDE)
        self.raster: Float32 | None = None
        self.mask: Float32 | None = None
        self.next, self.traces_since = 0.0, 0.0
        self.frame = frame_of(scene)
        self._put(None, "", 0.0)

    def begins_with(self, raster: Float32 | None, mask: Float32 | None) -> None:
        """EEVEE's half (h, w, 4) and mask (h, w) are there; None: the tracer draws all."""
        if raster is not None and mask is not None:
            self.raster, self.mask = (np.ascontiguousarray(half[:: self.step, :: self.step]) for half in (raster, mask))
            self._put(self.raster[..., :3], "EEVEE's picture", 0.0)

    def show(self, make: Make) -> None:
        """There is more of the traced half (the tracer's `show`). A render never fails because it is looked on."""
        if time.perf_counter() < self.next:
            return
        try:
            self._show(make)
        except Exception:  # too little memory for another picture, say: what is shown stays
            self.next = math.inf

    def _show(self, make: Make) -> None:
        began = time.thread_time()  # what it costs, however long it waits for the workers
        radiance = make(self.step)
        if not radiance.any():
            self.next = time.perf_counter() + SOON_SECONDS
            return
        picture = radiance
        if self.raster is not None and self.mask is not None:
            picture = premultiply(radiance, self.mask)[..., :3] + self.raster[..., :3]
        now = self.own.so_far
        self._put(picture, "" if now is None else now.text, 0.0 if now is None else now.fraction)
        self.next = time.perf_counter() + max(EVERY_SECONDS, (time.thread_time() - began) / SHARE)

    def told(self, phase: str, fraction: float) -> str:
        """How far the render is; returns what that says of the time that is left, as text."""
        left = ""
        if fraction > 0:
            self.traces_since = self.traces_since or time.perf_counter()
            passed = time.perf_counter() - self.traces_since
            if passed > 1:
                left = f", about {duration(passed * (1 - fraction) / fraction)} left"
        now = self.own.so_far
        text = f"{phase} {fraction * 100:.0f} %{left}" if fraction > 0 else phase
        if now is not None and now.text != text:
            self._put(now.picture, text, fraction)
        return left

    def _put(self, picture: Float32 | None, text: str, fraction: float | None) -> None:
        self.own.so_far = session.SoFar(picture, self.window, self.frame, _into[0], text, fraction)


def begin(scene: bpy.types.Scene, window: tuple[int, int, int, int]) -> Growing | None:
    """For the frame of this scene that is traced next; None: without a window nobody looks on."""
    return None if bpy.app.background else Growing(scene, window)


def stopped(scene: bpy.types.Scene) -> None:
    """Esc: the picture that is there stays to be looked at, until the next render."""
    own = session.of(scene.name)
    now, own.so_far = own.so_far, None
    if now is not None and now.picture is not None:
        text = f"Stopped at {now.fraction * 100:.0f} %" if now.fraction else "Stopped: EEVEE's picture alone"
        own.so_far = replace(now, text=text, fraction=None)


def duration(seconds: float) -> str:
    """Seconds as people say them."""
    whole = round(seconds)
    if whole < 90:
        return f"{max(whole, 1)} s"
    return f"{round(whole / 60)} min" if whole < 5400 else f"{whole / 3600:.1f} h"


def frame_of(scene: bpy.types.Scene) -> tuple[object, ...]:
    """What says how large a picture of this scene is, and which part of the frame it shows."""
    own = scene.render
    size = (own.resolution_x, own.resolution_y, own.resolution_percentage)
    if not own.use_border:
        return size
    border = (own.border_min_x, own.border_min_y, own.border_max_x, own.border_max_y)
    return (*size, own.use_crop_to_border, *border)


_into = [-1]  # the slot that is rendered into


def render_begins() -> None:
    """Blender renders into the slot of the Render Result that is shown now, whatever the user looks at meanwhile."""
    image = bpy.data.images.get("Render Result")
    _into[0] = -1 if image is None else image.render_slots.active_index


def slot() -> int:
    """The slot that is rendered into."""
    return _into[0]


_seen: dict[str, tuple[object, object]] = {}  # by scene, what was redrawn last


def redraw() -> None:
    """On the main thread: have the editors redrawn that show what has changed."""
    states = {name: (own.so_far, own.error) for name, own in session.by_name().items()}
    if states == _seen:
        return
    _seen.clear()
    _seen.update(states)
    for window in getattr(bpy.context.window_manager, "windows", ()):
        for area in window.screen.areas:
            if area.type in {"IMAGE_EDITOR", "PROPERTIES"}:
                area.tag_redraw()
