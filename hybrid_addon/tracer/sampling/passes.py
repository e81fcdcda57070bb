"""Passes: some samples of some pixels, dealt out in portions, added to what earlier passes found.

A portion is what a thread or process works through at once: many short runs of pixels from all over the picture, so
that all portions cost about the same, with all their samples of the pass. Its camera rays are begun in blocks. Every
pixel is worked out from its own absolute place alone, and gives to no array but its own: neither the number of threads
nor the size of portions and blocks changes one bit.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.camera import points_on_lens
from ..core.rays import Rays
from ..core.sampler import Sampler, pixel_keys
from ..core.stats import Stats
from ..film.ended_rays import count_samples
from ..film.filter import Grid, PixelFilter
from ..film.path_hash import Signatures, identities
from ..film.pixels import PixelBuffer
from ..film.samples import BRANCHES, SampleBuffer, wanted_parts
from ..geometry.aggregate import PrimitiveSet
from ..integrator.whitted import trace_rays
from ..parallel.pool import FEWEST, Task, WorkerPool, wanted_workers, workers, zeros_for
from ..prepare.compiled import CompiledScene

Progress = Callable[[float], bool]
Pixels = NDArray[np.intp]

WORTH_IT = 0.03
"""Seconds of one thread's work, below which starting processes, some milliseconds each, and copying what they touch
cost too much."""

FIRST_GUESS, OF_GLASS = 1e6, 2e5
"""Camera rays a second of one thread, before any were traced; where rays are refracted each becomes many."""

LONGEST_PORTION = 1 << 20
"""Camera rays of a portion: the sums of their samples take 80 bytes each, and share 64 bits with their budgets."""

SMALLEST_PORTION, SHORTEST = 1 << 13, 0.02
"""Small pictures are split evenly over the processes, but not into fewer camera rays than pay for a wave's overhead:
so many, or of those that become many rays what takes so many seconds."""

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

MANY = 4
"""Processes that are more than a few."""

TURN = 0.618
"""Of the portions, by how much each deal is turned against the last."""

RUNS = 32
"""For each portion: from so many places of the picture at least."""

WITHOUT_TREES = 2
"""Where no ray spawns another, blocks are so many times shorter: what they take stays in the cache, and less of it is
new to a process that was just forked. Elsewhere long ones are worth more: few rays of them are left in the end."""

DEVELOP = -1
"""The kind of a job that takes no samples."""


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
    """Runs passes over pixels of a window: all of them, or those `wanted` (h, w), in some of its rows or all. To be
    used in a `with`.

    filter, grid : what samples count for, and the pixels that are traced.
    totals       : what the passes add to, set by whoever begins.
    develop      : what turns totals of pixels `start` to `stop` into a picture, likewise.
    crew         : who does the work. On its board lie the numbers of the pixels of the pass, portion by portion.
    """

    pixel_buffer: PixelBuffer
    develop: Callable[[int, int], Stats]

    def __init__(
        self,
        scene: CompiledScene,
        progress: Progress | None,
        wanted: NDArray[np.bool_] | None,
        rows: slice | None = None,
    ) -> None:
        self.scene, self.settings = scene, scene.settings
        self.filter = PixelFilter(self.settings.filter_radius, self.settings.seed, self.settings.samples > 1)
        self.grid = Grid.of(scene.camera.window, scene.camera.resolution, wanted, self.filter.reach, rows)
        self.stats = Stats()
        self.progress = progress
        self.speed = 0.0  # camera rays a second of each thread or process, in the last pass
        self.pool = WorkerPool(self.settings)
        self.identity = identities(scene.geometry) if scene.settings.adaptive > 0 else None
        self._board = zeros_for(self.settings)((len(self.grid),), np.int32)
        self._seen: list[PrimitiveSet] = []

    def run(self, pixels: Pixels, work: Pass, progress: tuple[float, float], deadline: float = math.inf) -> bool:
        """Work through pixels in portions; whether all were done before the deadline, on time.perf_counter's clock.

        progress : the fractions done before and after this pass.
        """
        threads = wanted_workers(self.settings)
        n, kind = len(pixels) * work.count, self._kind(work.seen)
        speed = self.speed or (OF_GLASS if self.scene.plan.refraction else FIRST_GUESS)
        worth_it = n >= WORTH_IT * speed or self.pool.has_processes
        forked = self.pool.forks and threads >= FEWEST and worth_it
        threads = threads if forked else workers(self.settings)
        longest = LONGEST_PORTION
        if deadline < math.inf:
            at_risk = SHARE_AT_RISK * max(deadline - time.perf_counter(), 0.0)
            longest = int(min(max(at_risk * self.speed, SHORT_PORTION), LONGEST_PORTION))
        smallest = min(SMALLEST_PORTION, int(SHORTEST * speed) + 1) if forked else FOR_A_THREAD
        portions = _portions(pixels, work.count, threads, longest, smallest)
        jobs = self._jobs(portions, kind, work, deadline)
        done, until = progress

        def watch() -> None:
            self.report(done + (until - done) * self.pool.so_far() / max(n, 1))

        if forked:
            self.scene.build_all()
        began = time.perf_counter()
        in_time = self.pool.run(self._do, jobs, forked, self.stats.merge, watch)
        at_once = max(min(threads, len(portions)), 1)
        self.speed = self.pool.so_far() / max((time.perf_counter() - began) * at_once, 1e-9)
        return in_time

    def develop_all(self, longest: int) -> None:
        """Develop all pixels, at most so many at once."""
        n, many = len(self.grid), self.pool.many()
        size = max(math.ceil(n / (many * max(math.ceil(n / (many * longest)), 1))), 1)  # even, and as many for each
        jobs = [Task(k, start, min(start + size, n), DEVELOP) for k, start in enumerate(range(0, n, size))]
        self.pool.run(self._do, jobs, False, self.stats.merge, lambda: None)

    def __enter__(self) -> Passes:
        return self

    def __exit__(self, error: object, *_: object) -> None:
        """Let the crew go, at once if something went wrong."""
        self.pool.end(kill=error is not None)

    def report(self, fraction: float) -> None:
        """Tell the caller how far we are; raises Cancelled if it has had enough."""
        if self.progress is not None and self.progress(fraction) is False:
            self.pool.stop.set()
            raise Cancelled("tracing was cancelled")

    def _kind(self, seen: PrimitiveSet) -> int:
        """The kind of the jobs in which camera rays see this."""
        kind = next((k for k, known in enumerate(self._seen) if known is seen), len(self._seen))
        if kind == len(self._seen):
            self.pool.end()  # processes that are there do not know it
            self._seen.append(seen)
        return kind

    def _jobs(self, portions: list[Pixels], kind: int, work: Pass, deadline: float) -> list[Task]:
        """The portions of a pass, put on the board."""
        jobs, start = [], 0
        for number, pixels in enumerate(portions):
            stop = start + len(pixels)
            self._board[start:stop] = pixels
            jobs.append(Task(number, start, stop, kind, work.first, work.count, work.spread, work.signed, deadline))
            start = stop
        return jobs

    def _do(self, task: Task) -> tuple[Stats, bool]:
        """Work of a thread or a process."""
        if task.kind == DEVELOP:
            return self.develop(task.start, task.stop), True
        work = Pass(task.first, task.samples, self._seen[task.kind], task.spread, task.signed)
        pixels = self._board[task.start : task.stop].astype(np.intp)
        return self._trace_portion(pixels, work, task.deadline, self.pool.slot(task))

    def _trace_portion(
        self, pixels: Pixels, work: Pass, deadline: float, begun: NDArray[np.int64]
    ) -> tuple[Stats, bool]:
        """All samples of some pixels; False: none of them, the deadline came first.

        begun : (1,) where to note how many there are so far.
        """
        stats = Stats()

        def check() -> None:
            if self.pool.stop.is_set():
                raise Cancelled("tracing was cancelled")
            if time.perf_counter() > deadline:
                raise _TooLate

        settings = self.settings
        with stats.phase("shade"), np.errstate(all="ignore"):
            sampler = Sampler(pixel_keys(*self.grid.at(pixels), settings.seed), work.first, work.count)
            sample_buffer = SampleBuffer.zeros(
                len(pixels), work.count, settings.cutoff, wanted_parts(settings), settings.max_depth,
                settings.rough_samples + 1, sampler,
            )  # fmt: skip
            if work.signed and self.identity is not None:
                nothing = np.zeros(len(pixels) * work.count, np.uint32)
                sample_buffer.signatures = Signatures(nothing, self.identity, np.float32(settings.adaptive))
            blocks = self._blocks(pixels, work, sampler, stats, begun)
            draws = sampler if self.scene.plan.draws else None
            try:
                check()
                trace_rays(self.scene, blocks, work.seen, sample_buffer, stats, check, sampler=draws)
            except _TooLate:
                return stats, False
            count_samples(sample_buffer, stats)
            sample_buffer.close()
            self.pixel_buffer.add(pixels, sample_buffer, work.first)
        return stats, True

    def _blocks(
        self, pixels: Pixels, work: Pass, sampler: Sampler, stats: Stats, begun: NDArray[np.int64]
    ) -> Iterator[Rays]:
        """The camera rays of a portion, some pixels after the others."""
        camera, count = self.scene.camera, work.count
        u, v = (place.astype(np.float64) for place in self.filter.places(work.first, count, work.spread))
        signed = work.signed or self.scene.plan.draws
        branched = not BRANCHES.keys().isdisjoint(wanted_parts(self.settings))
        longest = self.settings.chunk if self.scene.plan.secondary else -(-self.settings.chunk // WITHOUT_TREES)
        number = -(-len(pixels) * count // longest)
        size = -(-len(pixels) // min(number, len(pixels)))
        for start in range(0, len(pixels), size):
            x, y = self.grid.at(pixels[start : start + size])
            sample = np.arange(start * count, (start + len(x)) * count)
            film_x, film_y = (x[:, None] + 0.5 + u).ravel(), (y[:, None] + 0.5 + v).ravel()
            on_lens = None if camera.lens is None else points_on_lens(camera.lens, sampler, sample)
            rays = self.scene.camera_rays(film_x, film_y, stats, sample, on_lens, signed, branched)
            stats.add("camera", len(sample))
            begun += len(sample)
            yield rays


def _portions(pixels: Pixels, count: int, threads: int, longest: int, smallest: int) -> list[Pixels]:
    """Pixels with `count` samples each, dealt out in short runs to portions of `smallest` to `longest` samples."""
    n = len(pixels) * count
    each = min(max(n // (threads * EVEN_PORTION), 1), PORTIONS) if threads > MANY else 1
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
