# SPDX-License-Identifier: GPL-3.0-or-later
"""The work on one view, on a thread of its own: coarse first, then finer, until it is done, dropped or out of time."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from ...scene import Float32, Scene, Settings
from .display import Display
from .reproject import Surface, surface_of
from .view import Rect, View

if TYPE_CHECKING:
    from ...tracer import CompiledScene, SceneCache

COARSE = (8, 4, 2)
"""Region pixels across one traced pixel, at first."""

TIMES = 4
"""Each level is so many times the work of the one before."""


@dataclass(frozen=True, eq=False)
class Picture:
    """Premultiplied display colours (h, w, 4) over the region's pixels x0..x1, y0..y1."""

    pixels: Float32
    rect: Rect
    label: str


def levels(samples: int) -> Iterator[tuple[int, int]]:
    """(region pixels across one traced pixel, samples), the last ones all there are."""
    yield from ((step, 1) for step in COARSE)
    count = 1
    while count < samples:
        yield 1, count
        count *= TIMES
    yield 1, max(1, samples)


class Job:
    """Traces a translated scene as one view shows it. budget: seconds; 0: until it has all samples.

    Raises nothing: `problem` is a line for people if the scene cannot be traced. `surface` is what the first picture
    showed.
    """

    def __init__(
        self,
        scene: Scene,
        view: View,
        settings: Settings,
        display: Display,
        budget: float,
        compiled: CompiledScene | None = None,
        kept: SceneCache | None = None,
    ) -> None:
        self.scene, self.view, self.settings, self.display = scene, view, settings, display
        self.budget = budget
        self.compiled, self._kept = compiled, kept
        self.problem = ""
        self.surface: Surface | None = None
        self.done = False
        self._pictures: deque[Picture] = deque(maxlen=1)
        self._dropped = threading.Event()
        self._deadline = float("inf")
        self._thread = threading.Thread(target=self._run, name="hybrid-preview", daemon=True)
        self._thread.start()

    def drop(self) -> None:
        """Stop soon; does not wait."""
        self._dropped.set()

    def join(self) -> None:
        """Stop and wait for it."""
        self.drop()
        self._thread.join()

    def take_picture(self) -> Picture | None:
        """The newest picture, once."""
        return self._pictures.pop() if self._pictures else None

    def _run(self) -> None:
        from ...tracer import Cancelled

        try:
            self._refine()
        except Cancelled:
            pass
        except (ValueError, MemoryError) as error:
            self.problem = str(error) or "not enough memory for the preview"
        except Exception as error:  # a bug of ours: Python prints it
            self.problem = f"the ray tracer failed: {type(error).__name__}: {error}"
            raise
        finally:
            if self._kept is not None:
                self._kept.end()
            self.done = True

    def _refine(self) -> None:
        from ...tracer import CompiledScene, trace_compiled
        from ...tracer.prepare.validate import validate

        if self.compiled is None:
            validate(self.scene, self.settings, None)
            self.compiled = CompiledScene(self.scene, self.settings, self._kept, pixels=0)  # what moves is on its own
        if self.budget:
            self._deadline = time.perf_counter() + self.budget
        for step, samples in levels(self.settings.samples):
            passes = frozenset({"depth"}) if step == COARSE[0] else self.settings.passes
            settings = replace(self.settings, samples=samples, passes=passes)
            compiled = self.compiled.seen_from(self.view.camera(step), settings)
            film = trace_compiled(compiled, progress=None if step == COARSE[0] else self._goes_on)
            if step == COARSE[0]:
                self.surface = surface_of(compiled.camera, film.passes["depth"], film.coverage, step)
            self._pictures.append(self._develop(film.radiance, film.coverage, step, samples))

    def _goes_on(self, _fraction: float) -> bool:
        return not self._dropped.is_set() and time.perf_counter() < self._deadline

    def _develop(self, radiance: Float32, coverage: Float32, step: int, samples: int) -> Picture:
        x0, y0 = self.view.camera(step).window[:2]
        rows, columns = np.flatnonzero(coverage.any(axis=1)), np.flatnonzero(coverage.any(axis=0))
        if len(rows) == 0:
            return Picture(np.zeros((1, 1, 4), np.float32), (0, 0, 1, 1), "")
        top, bottom, left, right = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
        part, alpha = radiance[top:bottom, left:right], coverage[top:bottom, left:right, None]
        pixels = np.concatenate([self.display.encode_by_table(part) * alpha, alpha], axis=2)
        rect = tuple(int(n) * step for n in (x0 + left, y0 + top, x0 + right, y0 + bottom))
        label = f"{samples if step == 1 else 0}/{self.settings.samples}" + (f" (1:{step})" if step > 1 else "")
        return Picture(np.ascontiguousarray(pixels, np.float32), cast(Rect, rect), label)
