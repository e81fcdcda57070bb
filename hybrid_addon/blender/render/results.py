"""What the last render of each scene gave: filled by the engine and the handlers, read by the API and the panel."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import Any

from ...clock import Clock
from ...scene import Float32


@dataclass(eq=False)
class Frame:
    """One traced frame over the rendered window: raster, traced (h, w, 4), mask (h, w), float32, associated alpha.

    passes : the data passes that were asked for, by name: (h, w) or (h, w, 3) float32.
    """

    window: tuple[int, int, int, int]
    raster: Float32 | None
    mask: Float32
    traced: Float32
    report: dict[str, Any]
    passes: dict[str, Float32] = field(default_factory=dict)


frames: dict[str, Frame] = {}  # by scene name
reports: dict[str, dict[str, Any]] = {}  # the last report of each scene, kept for the panel
errors: dict[str, str] = {}  # why the last trace of a scene failed
current = ""  # the scene that Blender is asked to render, or was last
_starts: dict[str, Clock] = {}
_ends: dict[str, Clock] = {}
_sampled: dict[str, float] = {}  # when the last sample was taken
_tails: dict[str, float] = {}  # seconds a pixel from there to the end of the frame

FIRST_TAIL = 4e-7
"""Seconds a pixel to develop, deliver and composite a frame, before one has been measured: twice what the sample scenes
take, on 2 cores."""

SHORTEST_TAIL = 0.02
"""Seconds for it, however few the pixels."""


def start(scene: str) -> None:
    """A frame of this scene begins: forget the last one."""
    global current
    current = scene
    frames.pop(scene, None)
    errors.pop(scene, None)
    _ends.pop(scene, None)
    _starts[scene] = Clock()


def since_start(scene: str) -> dict[str, float]:
    """Seconds since the frame began."""
    return _starts.setdefault(scene, Clock()).read()


def deadline(scene: str, budget: float, pixels: int) -> float:
    """When to stop tracing, on time.perf_counter's clock, so that the frame ends within its budget (0: never).

    What comes after is taken to last as long as in this scene's last frame.
    """
    if budget <= 0:
        return math.inf
    since_start(scene)
    return _starts[scene].wall + budget - max(SHORTEST_TAIL, _tails.get(scene, FIRST_TAIL) * pixels)


def sampled(scene: str, ago: float) -> None:
    """So many seconds ago the last sample was taken."""
    _sampled[scene] = time.perf_counter() - ago


def traced(scene: str, frame: Frame) -> None:
    """The engine has delivered; Blender composites next."""
    frames[scene] = frame
    reports[scene] = frame.report
    _ends[scene] = Clock()


def finish(scene: str) -> None:
    """The frame is complete: add the times that only its end knows."""
    if scene in frames and scene in _ends:
        timing = frames[scene].report["time"]
        timing["composite"] = _ends[scene].read()
        timing["total"] = since_start(scene)
        if scene in _sampled:
            _tails[scene] = (time.perf_counter() - _sampled.pop(scene)) / frames[scene].mask.size
