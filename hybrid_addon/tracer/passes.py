"""Passes: some samples of some pixels, in chunks over threads, added to what earlier passes found.

A chunk is a run of whole pixels with all their samples of the pass. Every pixel is worked out from its own absolute
place alone, and each chunk writes its own slice: neither the number of threads nor the size of the chunks changes one
bit.
"""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .camera import generate_rays
from .compiled import CompiledScene
from .film import film_positions
from .primitives import PrimitiveSet
from .rays import camera_rays
from .sampler import Sampler, pixel_keys
from .signature import Signatures, identities
from .sums import BRANCHES, Sums, wanted_parts
from .tally import Tally
from .totals import Totals
from .whitted import trace_rays

Progress = Callable[[float], bool]
Pixels = NDArray[np.intp]

POLL_SECONDS = 0.1
"""How often the caller hears of progress, and may cancel."""

LONGEST_CHUNK = 1 << 22
"""However large chunks are asked for: samples of a chunk and their budgets share 64 bits (see `sums`)."""

SMALLEST_SHARE = 1 << 13
"""Small pictures are split evenly over the threads, but not into fewer camera rays than pay for a wave's overhead."""


SHORT_CHUNK = 1 << 14
"""Camera rays that a thread takes at once against a deadline: what is not done by then is lost."""


class Cancelled(Exception):
    """The progress callback asked to stop."""


class _TooLate(Exception):
    """The deadline has passed."""


@dataclass(frozen=True)
class Pass:
    """Samples first .. first + count - 1 of some pixels.

    seen     : what camera rays can hit first.
    filtered : the samples are spread over the pixel filter; otherwise they go through the pixel's centre.
    signed   : each sample is a group of its own and leaves its signature: what adaptive sampling looks at.
    """

    first: int
    count: int
    seen: PrimitiveSet
    filtered: bool
    signed: bool = False

    @property
    def groups(self) -> int:
        """Groups of samples that are told apart: two tell how sure their mean is."""
        return self.count if self.signed else min(2, self.count)


class Passes:
    """Runs passes over the pixels of one window."""

    def __init__(self, scene: CompiledScene, progress: Progress | None) -> None:
        x0, y0, x1, _ = scene.camera.window
        self.scene, self.settings = scene, scene.settings
        self.corner, self.width = (x0, y0), x1 - x0
        self.tally = Tally()
        self.stop = threading.Event()
        self.progress = progress
        self.identity = identities(scene.geometry) if scene.settings.adaptive > 0 else None

    def run(
        self,
        pixels: Pixels,
        work: Pass,
        totals: Totals,
        progress: tuple[float, float],
        deadline: float = math.inf,
    ) -> bool:
        """Work through pixels in chunks; whether all were done before the deadline, on time.perf_counter's clock.

        progress : the fractions done before and after this pass.
        """
        threads = self.settings.threads or os.cpu_count() or 1
        share = max(SMALLEST_SHARE, len(pixels) * work.count // (2 * threads))  # a small picture is for all threads
        longest = min(self.settings.chunk, LONGEST_CHUNK if deadline == math.inf else SHORT_CHUNK)
        size = max(1, min(longest, share) // work.count)
        (done, until), in_time = progress, True
        chunks: Iterator[Pixels] = (pixels[i : i + size] for i in range(0, len(pixels), size))
        pending: set[Future[tuple[Tally, bool]]] = set()
        finished = 0
        with ThreadPoolExecutor(threads, thread_name_prefix="hybrid-tracer") as pool:
            try:
                # A short queue: cancelling must not wait for chunks that nobody has begun.
                while True:
                    while in_time and len(pending) < 2 * threads and (chunk := next(chunks, None)) is not None:
                        pending.add(pool.submit(self._trace_chunk, chunk, work, totals, deadline))
                    if not pending:
                        return in_time
                    complete, pending = wait(pending, POLL_SECONDS, FIRST_COMPLETED)
                    for future in complete:
                        tally, complete_chunk = future.result()
                        self.tally.merge(tally)
                        in_time &= complete_chunk
                        finished += size
                    self.report(done + (until - done) * min(1.0, finished / len(pixels)))
            except BaseException:
                self.stop.set()
                raise

    def report(self, fraction: float) -> None:
        """Tell the caller how far we are; raises Cancelled if it has had enough."""
        if self.progress is not None and self.progress(fraction) is False:
            self.stop.set()
            raise Cancelled("tracing was cancelled")

    def _trace_chunk(self, pixels: Pixels, work: Pass, totals: Totals, deadline: float) -> tuple[Tally, bool]:
        """All samples of some pixels, on a worker thread; False: none of them, the deadline came first."""
        tally = Tally()

        def check() -> None:
            if self.stop.is_set():
                raise Cancelled("tracing was cancelled")
            if time.perf_counter() > deadline:
                raise _TooLate

        try:
            check()
            self._trace(pixels, work, totals, tally, check)
        except _TooLate:
            return tally, False
        return tally, True

    def _trace(self, pixels: Pixels, work: Pass, totals: Totals, tally: Tally, check: Callable[[], None]) -> None:
        with tally.phase("shade"), np.errstate(all="ignore"):
            x, y = self.corner[0] + pixels % self.width, self.corner[1] + pixels // self.width
            if work.filtered:
                radius = self.settings.filter_radius
                film_x, film_y = film_positions(x, y, work.first, work.count, self.settings.seed, radius)
            else:
                film_x, film_y = np.asarray(x + 0.5, np.float64), np.asarray(y + 0.5, np.float64)
            geometry = self.scene.geometry
            origin, direction, t_max = generate_rays(
                self.scene.camera, film_x, film_y, geometry.center, geometry.bounds_radius()
            )
            media = self.scene.media.around_camera(origin, direction, lambda: self.scene.solids, tally)
            n = len(pixels) * work.count
            sampler = None
            if self.scene.plan.soft_shadows:
                sampler = Sampler(pixel_keys(x, y, self.settings.seed), work.first, work.count)
            parts = wanted_parts(self.settings)
            signed, branched = work.signed or sampler is not None, not BRANCHES.keys().isdisjoint(parts)
            rays = camera_rays(origin, direction, t_max, np.arange(n), media, signed, branched)
            tally.add("camera", n)
            sums = Sums.zeros(len(pixels), work.count, self.settings.cutoff, work.groups, parts)
            if work.signed and self.identity is not None:
                importance = np.float32(self.settings.adaptive)
                sums.signatures = Signatures(np.zeros(n, np.uint32), self.identity, importance)
            trace_rays(self.scene, rays, work.seen, sums, tally, check, sampler=sampler)
            totals.add(pixels, sums)
