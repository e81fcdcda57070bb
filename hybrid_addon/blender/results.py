"""What the last render of each scene gave: filled by the engine and the handlers, read by the API and the panel."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

from ..scene import Float32


@dataclass(eq=False)
class Frame:
    """One traced frame over the rendered window: raster, traced (h, w, 4), mask (h, w), float32, associated alpha."""

    window: tuple[int, int, int, int]
    raster: Float32 | None
    mask: Float32
    traced: Float32
    report: dict[str, Any]


@dataclass
class Clock:
    """Wall and processor seconds since it was made."""

    wall: float = field(default_factory=time.perf_counter)
    cpu: float = field(default_factory=time.process_time)

    def read(self) -> dict[str, float]:
        """{"wall": s, "cpu": s}; cpu counts all threads of the process."""
        return {"wall": time.perf_counter() - self.wall, "cpu": time.process_time() - self.cpu}


frames: dict[str, Frame] = {}  # by scene name
reports: dict[str, dict[str, Any]] = {}  # the last report of each scene, kept for the panel
errors: dict[str, str] = {}  # why the last trace of a scene failed
_starts: dict[str, Clock] = {}
_ends: dict[str, Clock] = {}


def start(scene: str) -> None:
    """A frame of this scene begins: forget the last one."""
    frames.pop(scene, None)
    errors.pop(scene, None)
    _ends.pop(scene, None)
    _starts[scene] = Clock()


def since_start(scene: str) -> dict[str, float]:
    """Seconds since the frame began."""
    return _starts.setdefault(scene, Clock()).read()


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
