"""Passes: some samples of some pixels, in chunks over threads, added to what earlier passes found.

A portion is what a thread or process works through at once: many short runs of pixels from all over the picture, so
that all portions cost about the same, with all their samples of the pass. Its camera rays are begun in blocks. Every
pixel is worked out from its own absolute place alone, and gives to no array but its own: neither the number of threads
nor the size of portions and blocks changes one bit.
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

from ..scene import Settings
from .camera import generate_rays, points_on_lens
from .compiled import CompiledScene
from .film import Grid, PixelFilter
from .forks import AVAILABLE, FEWEST, WORTH_IT, Forks, Work, shared_zeros
from .primitives import PrimitiveSet
from .rays import Rays, camera_rays
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

LONGEST_PORTION = 1 << 20
"""Camera rays of a portion: the sums of their samples take 80 bytes each, and share 64 bits with their budgets."""

SMALLEST_PORTION = 1 << 13
"""Small pictures are split evenly over the processes, but not into fewer camera rays than pay for a wave's overhead."""

FOR_A_THREAD = 1 << 16
"""The same for threads: two with half as many each take up to 1.8 times as long as one with all. They hand the
interpreter lock over at every call, and the waves at the end of a portion are many short calls."""

SHORT_PORTION = 1 << 14
"""Camera rays that are taken at once at least against a deadline: what is not done by then is lost."""

SHARE_AT_RISK = 0.25
"""Of the time that is left, what a portion may take: short ones would cost more than is lost of long ones, up to three
times the time."""

PORTIONS, EVEN_PORTION = 4, 1 << 17
"""For each of many processes, and of so many camera rays: the slowest decides, and of 16 equal portions one takes half
as long again as another. Few processes are even, and lose more to the short waves at the end of each portion."""

TURN = 0.618
"""Of the portions, by how much each deal is turned against the last."""

MOST_THREADS = 4
"""At once, where there are no processes: more wait for the interpreter lock. On 16 cores 16 threads take 1.3 to 1.7
times as long as four, in a deep scene as long as one."""

SLOW_START = 10.0
"""Seconds after which a forked process that has not begun its portion never will: it may wait for something that
another thread held when it was forked."""

RUNS = 32
"""For each portion: from so many places of the picture at least."""


def workers(settings: Settings) -> int:
    """How many threads work at once."""
    return min(settings.threads or os.cpu_count() or 1, MOST_THREADS)


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
        self.speed = 0.0  # camera rays a second of each thread or process, in the last pass
        self.forks = self.settings.processes and AVAILABLE
        self.identity = identities(scene.geometry) if scene.settings.adaptive > 0 else None

    def run(
        self,
        pixels: Pixels,
        work: Pass,
        totals: Totals,
        progress: tuple[float, float],
        deadline: float = math.inf,
    ) -> bool:
        """Work through pixels in portions; whether all were done before the deadline, on time.perf_counter's clock.

        progress : the fractions done before and after this pass.
        """
        threads = self.settings.threads or os.cpu_count() or 1
        n = len(pixels) * work.count
        forked = totals.shared and threads >= FEWEST and n >= WORTH_IT
        threads = threads if forked else workers(self.settings)
        longest = LONGEST_PORTION
        if deadline < math.inf:
            at_risk = SHARE_AT_RISK * max(deadline - time.perf_counter(), 0.0)
            longest = int(min(max(at_risk * self.speed, SHORT_PORTION), LONGEST_PORTION))
        portions = _portions(pixels, work.count, threads, longest, SMALLEST_PORTION if forked else FOR_A_THREAD)
        done, until = progress
        begun = shared_zeros((max(len(portions), 1),), np.int64)  # samples of each portion

        def trace(portion: int) -> tuple[Tally, bool]:
            return self._trace_portion(portions[portion], work, totals, deadline, begun[portion : portion + 1])

        def watch() -> None:
            self.report(done + (until - done) * int(begun.sum()) / max(n, 1))

        left, in_time, began = list(range(len(portions))), True, time.perf_counter()
        if forked:
            self.scene.build_all()
            left, in_time = _over_processes(min(threads, len(portions)), trace, begun, self.tally.merge, watch)
        in_time = self._over_threads(workers(self.settings), trace, left, self.tally.merge, watch) and in_time
        at_once = max(min(threads, len(portions)), 1)
        self.speed = int(begun.sum()) / max((time.perf_counter() - began) * at_once, 1e-9)
        return in_time

    def _over_threads(self, threads: int, trace: Work, portions: list[int], finished: Finished, watch: Watch) -> bool:
        """Do portions; whether all came to their end in time."""
        in_time, waiting = True, iter(portions)
        pending: set[Future[tuple[Tally, bool]]] = set()
        with ThreadPoolExecutor(threads, thread_name_prefix="hybrid-tracer") as pool:
            try:
                # A short queue: cancelling must not wait for portions that nobody has begun.
                while True:
                    while in_time and len(pending) < 2 * threads and (portion := next(waiting, None)) is not None:
                        pending.add(pool.submit(trace, portion))
                    if not pending:
                        return in_time
                    complete, pending = wait(pending, POLL_SECONDS, FIRST_COMPLETED)
                    for future in complete:
                        tally, ended = future.result()
                        finished(tally)
                        in_time &= ended
                    watch()
            except BaseException:
                self.stop.set()
                raise

    def report(self, fraction: float) -> None:
        """Tell the caller how far we are; raises Cancelled if it has had enough."""
        if self.progress is not None and self.progress(fraction) is False:
            self.stop.set()
            raise Cancelled("tracing was cancelled")

    def _trace_portion(
        self, pixels: Pixels, work: Pass, totals: Totals, deadline: float, begun: NDArray[np.int64]
    ) -> tuple[Tally, bool]:
        """All samples of some pixels, on a worker thread; False: none of them, the deadline came first.

        begun : (1,) where to note how many there are so far.
        """
        tally = Tally()

        def check() -> None:
            if self.stop.is_set():
                raise Cancelled("tracing was cancelled")
            if time.perf_counter() > deadline:
                raise _TooLate

        settings = self.settings
        with tally.phase("shade"), np.errstate(all="ignore"):
            sampler = Sampler(pixel_keys(*self.grid.at(pixels), settings.seed), work.first, work.count)
            sums = Sums.zeros(
                len(pixels), work.count, settings.cutoff, wanted_parts(settings), settings.max_depth,
                max(settings.rough_samples, 1),
            )  # fmt: skip
            if work.signed and self.identity is not None:
                nothing = np.zeros(len(pixels) * work.count, np.uint32)
                sums.signatures = Signatures(nothing, self.identity, np.float32(settings.adaptive))
            blocks = self._blocks(pixels, work, sampler, tally, begun)
            draws = sampler if self.scene.plan.draws else None
            try:
                check()
                trace_rays(self.scene, blocks, work.seen, sums, tally, check, sampler=draws)
            except _TooLate:
                return tally, False
            totals.add(pixels, sums, work.first)
        return tally, True

    def _blocks(
        self, pixels: Pixels, work: Pass, sampler: Sampler, tally: Tally, begun: NDArray[np.int64]
    ) -> Iterator[Rays]:
        """The camera rays of a portion, some pixels after the others."""
        geometry, camera, count = self.scene.geometry, self.scene.camera, work.count
        u, v = (place.astype(np.float64) for place in self.filter.places(work.first, count, work.spread))
        signed = work.signed or self.scene.plan.draws
        branched = not BRANCHES.keys().isdisjoint(wanted_parts(self.settings))
        number = -(-len(pixels) * count // self.settings.chunk)
        size = -(-len(pixels) // min(number, len(pixels)))
        in_solid = self.scene.camera_in_solid
        for start in range(0, len(pixels), size):
            x, y = self.grid.at(pixels[start : start + size])
            sample = np.arange(start * count, (start + len(x)) * count)
            film_x, film_y = (x[:, None] + 0.5 + u).ravel(), (y[:, None] + 0.5 + v).ravel()
            on_lens = None if camera.lens is None else points_on_lens(camera.lens, sampler, sample)
            origin, direction, t_max = generate_rays(
                camera, film_x, film_y, geometry.center, geometry.bounds_radius(), on_lens
            )
            media = self.scene.media.empty(len(sample))
            if in_solid:
                media = self.scene.media.around_camera(origin, direction, lambda: self.scene.solids, tally)
            tally.add("camera", len(sample))
            begun += len(sample)
            yield camera_rays(origin, direction, t_max, sample, media, signed, branched)


def _portions(pixels: Pixels, count: int, threads: int, longest: int, smallest: int) -> list[Pixels]:
    """Pixels with `count` samples each, dealt out in short runs to portions of `smallest` to `longest` samples."""
    n = len(pixels) * count
    each = min(max(n // (threads * EVEN_PORTION), 1), PORTIONS) if threads > MOST_THREADS else 1
    wanted = max(-(-n // longest), min(each * threads if threads > 1 else 1, n // smallest))
    if wanted > threads:  # in whole rounds, or some would wait for the others' last
        wanted = -(-wanted // threads) * threads
    number = max(1, min(wanted, len(pixels)))
    if number == 1:
        return [pixels] if len(pixels) else []
    run = max(1, len(pixels) // (number * RUNS))
    whole = len(pixels) // (number * run) * (number * run)
    deals, rest = pixels[:whole].reshape(-1, number, run), pixels[whole:]
    # A deal may be so many rows of the picture: it begins with another portion each time, or they would be columns.
    deal, turn = np.arange(len(deals)), int(number * TURN) | 1
    return [
        np.concatenate([deals[deal, (k + deal * turn) % number].reshape(-1), rest[k * run : (k + 1) * run]])
        for k in range(number)
    ]


def _over_processes(
    number: int, trace: Work, begun: NDArray[np.int64], finished: Finished, watch: Watch
) -> tuple[list[int], bool]:
    """Do portions in forked processes: which are left, because they failed; and whether the others were in time.

    begun : (portions,) samples of each that have been begun so far.
    """
    given, left, in_time = 0, set(range(len(begun))), True
    seen, since = 0, time.perf_counter()
    with Forks(number, trace) as processes:
        while True:
            while in_time and given < len(begun) and given - (len(begun) - len(left)) < 2 * number:
                processes.give(given)
                given += 1
            if given == len(begun) or not in_time:
                processes.no_more()
            answers = processes.answers(POLL_SECONDS)
            if answers is None:
                processes.check()
                return sorted(left), in_time
            for portion, tally, complete in answers:
                left.discard(portion)
                finished(tally)
                in_time &= complete
            if not left:
                return [], in_time
            watch()
            if answers or int(begun.sum()) != seen:
                seen, since = int(begun.sum()), time.perf_counter()
            elif time.perf_counter() - since > SLOW_START and not begun[sorted(left)].any():
                return sorted(left), in_time  # none of them has added anything yet
