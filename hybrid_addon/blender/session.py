# SPDX-License-Identifier: GPL-3.0-or-later
"""One session for each scene: what its last render gave, and what it left for the next one or for a retrace.

The engine and the handlers fill it, on the render's thread; the API and the panels read it. It is known by the scene's
name: a scene that is renamed begins anew, and nothing is saved with a file.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import bpy
import numpy as np

from ..clock import Clock
from ..scene import Float32, TriangleMesh
from .sync import MeshCache

if TYPE_CHECKING:
    from ..tracer import SceneCache

FIRST_TAIL = 4e-7
"""Seconds a pixel to develop, deliver and composite a frame, before one has been measured: twice what the sample scenes
take, on 2 cores."""

SHORTEST_TAIL = 0.02
"""Seconds for it, however few the pixels."""


OF_LAYERS = ("mask_pixels", "mask_coverage", "counts", "rays", "hits", "error", "denoising", "time")
"""Keys of a report that differ from one hybrid view layer to another."""


@dataclass(eq=False)
class Frame:
    """One traced frame over the rendered window: raster, traced (h, w, 4), mask (h, w), float32, associated alpha.

    passes : the data passes that were asked for, by name: (h, w) or (h, w, 3) float32.
    of     : what its size and its part of the frame came from (`render/growing.py`).
    """

    window: tuple[int, int, int, int]
    raster: Float32 | None
    mask: Float32
    traced: Float32
    report: dict[str, Any]
    passes: dict[str, Float32] = field(default_factory=dict)
    of: tuple[object, ...] = ()

    def to_look_at(self) -> Frame:
        """The same without passes, in half precision: what is kept of it for the slot that it was rendered into."""
        small: Any = [
            None if part is None else np.clip(part, -HALF, HALF).astype(np.float16)
            for part in (self.raster, self.mask, self.traced)
        ]
        return replace(self, raster=small[0], mask=small[1], traced=small[2], passes={})


HALF = 65504.0
"""The largest number of half precision."""


@dataclass(frozen=True, eq=False)
class SoFar:
    """A render that is not done, or was stopped: what there is to look at meanwhile.

    picture  : (h, w, 3) float32 scene-linear, every so many of its pixels over `window`; None: nothing yet.
    frame    : what its size and its part of the frame came from (render/growing.py); another one has other pixels.
    slot     : of the Render Result that the render goes into.
    text, fraction : how far it is, for people; 0..1, or None once it is stopped.
    """

    picture: Float32 | None
    window: tuple[int, int, int, int]
    frame: tuple[object, ...]
    slot: int
    text: str
    fraction: float | None


def _trees() -> SceneCache:
    from ..tracer import SceneCache  # a missing library must not keep Blender from loading the add-on

    return SceneCache()


@dataclass(eq=False)
class FrameCaches:
    """What the translator and what the tracer have left for the next frame."""

    meshes: MeshCache = field(default_factory=MeshCache)
    trees: SceneCache = field(default_factory=_trees)

    def skipped(self) -> list[dict[str, Any]]:
        """What of it the frame in work could use, as a report says it."""
        counts = {"meshes": self.meshes.meshes, "images": self.meshes.images}
        return [{"what": w, "why": "kept from the last frame", "count": n} for w, n in counts.items() if n]


class Witness(Protocol):
    """Who knows what a scene looked like, and so what has changed (render/snapshot.py)."""

    def touch(self, b_update: bpy.types.DepsgraphUpdate) -> None:
        """The dependency graph has been told of a change."""

    def reason(self, scene: bpy.types.Scene, thorough: bool = False) -> str:
        """What has changed, as the subject and verb of a sentence; "" if nothing has."""


class Half(NamedTuple):
    """EEVEE's half of a picture, over the rendered window, scene-linear float32; None: it was not asked for.

    raster : (h, w, 4) without the ray traced objects.   mask : (h, w) their coverage.
    depth  : (h, w) metres, of that picture.   albedo : (h, w, 3) its diffuse colour, black where the objects are.
    lines  : (h, w, 4) Freestyle's, over both halves.
    """

    raster: Float32 | None = None
    mask: Float32 | None = None
    depth: Float32 | None = None
    albedo: Float32 | None = None
    lines: Float32 | None = None


@dataclass(eq=False)
class EeveeHalf:
    """EEVEE's half of the last render of a scene.

    half     : what it drew, over `window`.
    shadows  : whether the shadows of ray traced objects were left out of it.
    snapshot : the scene as it was when that render began.
    drawn    : what the tracer knows of all that EEVEE draws: places and lights, meshes.
    """

    window: tuple[int, int, int, int]
    half: Half
    frame: int
    shadows: bool
    snapshot: Witness
    drawn: tuple[dict[str, list[object]], list[TriangleMesh]] | None = None


@dataclass(eq=False)
class Session:
    """What the add-on remembers of one scene.

    frame, report  : of the last render, of its first hybrid view layer; the report stays, for the panel, while the next
                     frame is in work.
    frames         : of all its hybrid view layers, by their names (`view_layers.part`).
    slot           : of the Render Result that it went into.   kept : what earlier renders left in the others.
    error          : why the last trace failed, in one line; None if it did not.
    so_far         : of the render that runs, or was stopped; None: there is none, or its picture is complete.
    caches         : for the next render (`caches_of`).
    snapshot       : the scene as it was when its last render began.
    eevee_halves   : what a retrace goes over, by the names of the hybrid view layers.
    began          : when the frame began, on time.time()'s clock.
    retracing      : whether the next render takes EEVEE's half from there (render/retrace.py).
    casting        : names of objects that keep EEVEE's shadows because something shows them that is not ray traced.
    traces_shadows : whether EEVEE was told in this frame to leave shadows to the tracer; None: it has not drawn yet.
    """

    frame: Frame | None = None
    frames: dict[str, Frame] = field(default_factory=dict)
    report: dict[str, Any] | None = None
    error: Exception | None = None
    so_far: SoFar | None = None
    caches: FrameCaches | None = None
    snapshot: Witness | None = None
    eevee_halves: dict[str, EeveeHalf] = field(default_factory=dict)
    retracing: bool = False
    casting: list[str] = field(default_factory=list)
    traces_shadows: bool | None = None
    slot: int = -1
    kept: dict[int, Frame] = field(default_factory=dict)
    began: float = 0.0
    _start: Clock | None = None  # when the frame began
    _delivered: Clock | None = None  # when the engine had done its part
    _sampled: float | None = None  # when the last sample was taken
    _tail: float = FIRST_TAIL  # seconds a pixel from there to the end of the frame

    def begin_frame(self, slot: int = -1) -> None:
        """A frame of this scene begins, and goes into this slot: forget what was there."""
        if self.frame is not None and slot != self.slot:
            self.kept[self.slot] = self.frame.to_look_at()
        self.kept.pop(slot, None)
        self.slot = slot
        self.frame = self.error = self._delivered = self.so_far = self.traces_shadows = None
        self.frames = {}
        self.began = time.time()
        self._start = Clock()

    def fail(self, error: Exception) -> None:
        """The frame has failed, and why. Only the words are kept: a traceback would keep all that the frame had."""
        error.__context__ = error.__cause__ = None
        self.error, self.so_far = error.with_traceback(None), None

    def frame_in(self, slot: int) -> Frame | None:
        """What was rendered into a slot; None: nothing of ours, or too long ago."""
        return self.frame if slot == self.slot else self.kept.get(slot)

    def since_start(self) -> dict[str, float]:
        """Seconds since the frame began, wall and cpu."""
        self._start = self._start or Clock()
        return self._start.read()

    def deadline(self, budget: float, pixels: int, parts: int) -> float:
        """When to stop tracing, on time.perf_counter's clock, so that the frame ends within its budget (0: never).

        What comes after is taken to last as long as in this scene's last frame. parts : in how many parts the frame is
        traced; those that are left share the time that is left.
        """
        if budget <= 0:
            return math.inf
        self._start = self._start or Clock()
        until = self._start.wall + budget - max(SHORTEST_TAIL, self._tail * pixels)
        left = parts - len(self.frames)
        now = time.perf_counter()
        return until if left <= 1 else now + (until - now) / left

    def sampled(self, ago: float) -> None:
        """So many seconds ago the last sample was taken."""
        self._sampled = time.perf_counter() - ago

    def deliver(self, frame: Frame, part: str) -> None:
        """The engine has delivered a part; Blender composites next, or has another one traced."""
        self.frames[part] = frame
        if self.frame is None or self.report is None:
            self.frame, self.report = frame, frame.report
        else:
            said = self.report["warnings"]
            said += [text for text in frame.report["warnings"] if text not in said]
            reports = {name: each.report for name, each in self.frames.items()}
            self.report["layers"] = {name: {key: each[key] for key in OF_LAYERS} for name, each in reports.items()}
        self._delivered = Clock()

    def end_frame(self) -> None:
        """The frame is complete: add the times that only its end knows."""
        if self.frame is not None:
            self.so_far = None
        if self.frame is None or self._delivered is None:
            return
        timing = self.frame.report["time"]
        timing["composite"] = self._delivered.read()
        timing["total"] = self.since_start()
        if self._sampled is not None:
            self._tail = (time.perf_counter() - self._sampled) / self.frame.mask.size
            self._sampled = None

    def release(self) -> None:
        """Hybrid is switched off here: let go of all that is kept for another render, not of what the last one gave."""
        self.caches = self.snapshot = None
        self.eevee_halves = {}


_sessions: dict[str, Session] = {}  # by the scene's name


def of(name: str) -> Session:
    """The session of the scene of this name."""
    return _sessions.setdefault(name, Session())


def everyone() -> list[Session]:
    """All sessions that there are."""
    return list(_sessions.values())


def by_name() -> dict[str, Session]:
    """The same, by their scenes' names."""
    return dict(_sessions)


def begin_frame(name: str, slot: int = -1) -> None:
    """Blender begins a frame of the scene of this name, which goes into this slot of the Render Result."""
    of(name).begin_frame(slot)


def caches_of(name: str) -> FrameCaches:
    """What the last render of this scene has left; that of any other is let go of, which bounds the memory."""
    own = of(name)
    for session in everyone():
        if session is not own:
            session.caches = None
    own.caches = own.caches or FrameCaches()
    return own.caches


def forget() -> None:
    """Another file, or the end: let go of everything."""
    _sessions.clear()
