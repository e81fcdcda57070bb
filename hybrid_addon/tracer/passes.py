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
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .camera import generate_rays, points_on_lens
from .compiled import CompiledScene
from .film import Grid, PixelFilter
from .forks import AVAILABLE, FEWEST, WORTH_IT, Forks, Work
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
Finished = Callable[[Tally], None]
Watch = Callable[[], None]

POLL_SECONDS = 0.1
"""How often the caller hears of progress, and may cancel."""

LONGEST_CHUNK = 1 << 22
"""However large chunks are asked for: samples of a chunk and their budgets share 64 bits (see `sums`)."""

SMALLEST_SHARE = 1 << 13
"""Small pictures are split evenly over the threads, but not into fewer camera rays than pay for a wave's overhead."""

SHORT_CHUNK = 1 << 14
"""Camera rays that are taken at once against a deadline: what is not done by then is lost; and by a process.

Processes do not wait for one another's lock, so the thousand calls that each chunk costs are cheap, and what stays in a
core's cache is not fetched twice: on 16 cores a fifth faster than 2^16.
"""

FORKED_SHARES = 8
"""Chunks for each process in small pictures: few of a glass's pixels can cost as much as all others together."""


class Cancelled(Exception):
    """The progress callback asked to stop."""


class _TooLate(Exception):
    """The deadline has passed."""


@dataclass(frozen=True)
class Pass:
    """Samples first .. first + count - 1 of some pixels.

    seen   : what camera rays can hit first.
    spread : the samples are spread over the pixel; otherwise they go through its centre.
    signed : each sample leaves its signature: what adaptive sampling looks at.
    """

    first: int
    count: int
    seen: PrimitiveSet
    spread: bool
    signed: bool = False


class Passes:
    """Runs passes over pixels of a window: all of them, or those `wanted` (h, w).

    filter, grid : what samples count for, and the pixels that are traced.
    """

    def __init__(self, scene: CompiledScene, progress: Progress | None, wanted: NDArray[np.bool_] | None) -> None:
        self.scene, self.settings = scene, scene.settings
        self.filter = PixelFilter(self.settings.filter_radius, self.settings.seed, self.settings.samples > 1)
        self.grid = Grid.of(scene.camera.window, scene.camera.resolution, wanted, self.filter.reach)
        self.tally = Tally()
        self.stop = threading.Event()
        self.progress = progress
        self.forks = self.settings.processes and AVAILABLE
        self._finished = 0
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
        n = len(pixels) * work.count
        forked = totals.shared and threads >= FEWEST and n >= WORTH_IT
        share = max(SMALLEST_SHARE, n // ((FORKED_SHARES if forked else 2) * threads))
        longest = min(self.settings.chunk, SHORT_CHUNK if forked or deadline < math.inf else LONGEST_CHUNK)
        size = max(1, min(longest, share) // work.count)
        chunks = [slice(i, i + size) for i in range(0, len(pixels), size)]
        (done, until), self._finished = progress, 0

        def trace(chunk: int) -> tuple[Tally, bool]:
            return self._trace_chunk(pixels[chunks[chunk]], work, totals, deadline)

        def finished(tally: Tally) -> None:
            self.tally.merge(tally)
            self._finished += 1

        def watch() -> None:
            self.report(done + (until - done) * self._finished / max(len(chunks), 1))

        left, in_time = list(range(len(chunks))), True
        if forked:
            self.scene.build_all()
            left, in_time = _over_processes(min(threads, len(chunks)), trace, len(chunks), finished, watch)
        return self._over_threads(threads, trace, left, finished, watch) and in_time

    def _over_threads(self, threads: int, trace: Work, chunks: list[int], finished: Finished, watch: Watch) -> bool:
        """Do chunks; whether all came to their end in time."""
        in_time, waiting = True, iter(chunks)
        pending: set[Future[tuple[Tally, bool]]] = set()
        with ThreadPoolExecutor(threads, thread_name_prefix="hybrid-tracer") as pool:
            try:
                # A short queue: cancelling must not wait for chunks that nobody has begun.
                while True:
                    while in_time and len(pending) < 2 * threads and (chunk := next(waiting, None)) is not None:
                        pending.add(pool.submit(trace, chunk))
                    if not pending:
                        return in_time
                    complete, pending = wait(pending, POLL_SECONDS, FIRST_COMPLETED)
                    for future in complete:
                        tally, complete_chunk = future.result()
                        finished(tally)
                        in_time &= complete_chunk
                    watch()
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
            x, y = self.grid.at(pixels)
            u, v = (place.astype(np.float64) for place in self.filter.places(work.first, work.count, work.spread))
            film_x, film_y = (x[:, None] + 0.5 + u).ravel(), (y[:, None] + 0.5 + v).ravel()
            geometry, camera = self.scene.geometry, self.scene.camera
            n = len(pixels) * work.count
            sampler = Sampler(pixel_keys(x, y, self.settings.seed), work.first, work.count)
            on_lens = None if camera.lens is None else points_on_lens(camera.lens, sampler, n)
            origin, direction, t_max = generate_rays(
                camera, film_x, film_y, geometry.center, geometry.bounds_radius(), on_lens
            )
            media = self.scene.media.around_camera(origin, direction, lambda: self.scene.solids, tally)
            draws = sampler if self.scene.plan.draws else None
            parts = wanted_parts(self.settings)
            signed, branched = work.signed or draws is not None, not BRANCHES.keys().isdisjoint(parts)
            rays = camera_rays(origin, direction, t_max, np.arange(n), media, signed, branched)
            tally.add("camera", n)
            sums = Sums.zeros(len(pixels), work.count, self.settings.cutoff, parts)
            if work.signed and self.identity is not None:
                importance = np.float32(self.settings.adaptive)
                sums.signatures = Signatures(np.zeros(n, np.uint32), self.identity, importance)
            trace_rays(self.scene, rays, work.seen, sums, tally, check, sampler=draws)
            totals.add(pixels, sums, work.first)


def _over_processes(number: int, trace: Work, chunks: int, finished: Finished, watch: Watch) -> tuple[list[int], bool]:
    """Do chunks in forked processes: which are left, because they failed; and whether the others were in time."""
    given, left, in_time = 0, set(range(chunks)), True
    with Forks(number, trace) as processes:
        while True:
            while in_time and given < chunks and given - (chunks - len(left)) < 2 * number:
                processes.give(given)
                given += 1
            if given == chunks or not in_time:
                processes.no_more()
            answers = processes.answers(POLL_SECONDS)
            if answers is None:
                processes.check()
                return sorted(left), in_time
            for chunk, tally, complete in answers:
                left.discard(chunk)
                finished(tally)
                in_time &= complete
            watch()
