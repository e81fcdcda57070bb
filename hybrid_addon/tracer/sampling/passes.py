# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes: some samples of some pixels of a strip, traced tile by tile, added to what earlier passes found.

A tile is what a thread or process traces at once (see `tiles`), with all its samples of the pass. Its camera rays are
begun in chunks. Every pixel is worked out from its own absolute place alone, and gives to no array but its own: neither
the number of threads nor the size of tiles and chunks changes one bit.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...scene import Float64
from ..core.camera import points_on_lens
from ..core.constants import FIRST_SAMPLES
from ..core.rays import Rays
from ..core.sampler import Sampler, pixel_keys
from ..core.stats import Stats
from ..film.ended_rays import count_samples
from ..film.filter import Grid, PixelFilter
from ..film.path_hash import Identities, Signatures
from ..film.picture import ResolvedImage
from ..film.pixels import PixelBuffer
from ..film.samples import SampleBuffer, branch_rows, wanted_aovs
from ..film.so_far import Show, so_far
from ..geometry.aggregate import PrimitiveSet
from ..integrator.tile_records import TileScene
from ..integrator.tiles import tiles_of, trace_samples
from ..integrator.whitted import trace_rays
from ..parallel.pool import FEWEST, Task, WorkerPool, wanted_workers, workers, zeros_for
from ..prepare.compiled import CompiledScene
from . import tiles
from .tiles import Pixels

Progress = Callable[[float], bool]

WITHOUT_TREES = 2
"""Where no ray spawns another, chunks are so many times shorter: what they take stays in the cache, and less of it is
new to a process that was just forked. Elsewhere long ones are worth more: few rays of them are left in the end."""

DEVELOP_CHUNK = 1 << 16
"""Pixels that are developed at once, at most: what is only needed meanwhile stays small in large pictures."""

DEVELOP = -1
"""The kind of a task that takes no samples."""


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
    """Takes samples of the pixels of a strip: all of them, or those `wanted` (h, w). To be used in a `with`.

    filter, grid : what samples count for, and the pixels that are traced.
    pixel_buffer : what the samples add up to.   image : what they are developed into; None: nobody asks for it.
    stats        : what was counted, and left out.
    pool         : who does the work. On its board lie the numbers of the pixels of the pass, tile by tile.
    """

    def __init__(
        self,
        scene: CompiledScene,
        progress: Progress | None,
        wanted: NDArray[np.bool_] | None,
        rows: slice | None = None,
        deadline: float = math.inf,
        image: ResolvedImage | None = None,
        show: Show | None = None,
    ) -> None:
        """rows: of the window, those of the strip; None: all. deadline: on time.perf_counter's clock. show: told often
        that there is more of the picture."""
        self.scene, self.settings = scene, scene.settings
        self.progress, self.fraction, self.show = progress, 0.0, show
        self.adaptive = self.settings.adaptive > 0 and self.settings.samples > FIRST_SAMPLES
        self.filter = PixelFilter(
            self.settings.filter_radius, self.settings.seed, self.settings.samples > 1, self.settings.first
        )
        self.grid = Grid.of(scene.camera.window, scene.camera.resolution, wanted, self.filter.reach, rows)
        zeros = zeros_for(self.settings)
        self.pixel_buffer = PixelBuffer.zeros(self.grid, self.filter, self.adaptive, wanted_aovs(self.settings), zeros)
        self.image = image
        self.stats = Stats()
        self.speed = 0.0  # camera rays a second of each thread or process, in the last pass
        self.overhead = 0.0  # seconds of a pass of few rays; 0: not known, nobody asks
        self.pool = WorkerPool(self.settings)
        self._identity = Identities(scene.geometry) if self.settings.adaptive > 0 else None
        self._board = zeros((len(self.grid),), np.int32)
        self._seen: list[PrimitiveSet] = []
        self._tile_scenes: dict[int, TileScene | None] = {}
        self.began, self.deadline = time.perf_counter(), deadline

    @property
    def hurries(self) -> bool:
        """There is a deadline."""
        return self.deadline < math.inf

    @property
    def grows(self) -> bool:
        """Somebody looks on, and it takes so long that a coarse picture first is worth its own waves."""
        rays = len(self.grid) * self.settings.samples
        speed = tiles.guessed_speed(self.scene.plan.refraction) * workers(self.settings)
        return self.show is not None and rays > tiles.WORTH_GROWING * speed

    def run(self, pixels: Pixels, work: Pass, until: float, deadline: float = math.inf) -> bool:
        """Work through pixels tile by tile; whether all were done before the deadline.

        until : the fraction of the work that is done after this pass.
        """
        # Who works: threads on tiles, which hold no lock, or processes, if there is enough for them to do.
        n, kind = len(pixels) * work.count, self._kind(work.seen)
        speed = self.speed or tiles.guessed_speed(self.scene.plan.refraction)
        threads = wanted_workers(self.settings)
        enough = self.pool.has_processes or tiles.pays_for_processes(n, speed)
        free = self._tiles_of(work.seen) is not None
        forked = self.pool.forks and threads >= FEWEST and enough and not free
        threads = threads if forked or free else workers(self.settings)
        if forked:
            self.scene.build_all()

        # On what: tiles, put on the board.
        left = deadline if deadline == math.inf else deadline - time.perf_counter()
        longest, smallest = tiles.longest_tile(left, self.speed), tiles.smallest_tile(forked or free, speed)
        if self.overhead:
            longest = min(longest, max(int(self.overhead / tiles.DEAREST_SHOW * speed), tiles.SHORT_TILE))
        dealt = tiles.deal(pixels, work.count, threads, longest, smallest)
        tasks = self._tasks(dealt, kind, work, deadline)

        # Do it, and learn how long it takes.
        done = self.fraction

        def watch() -> None:
            self.report(done + (until - done) * self.pool.so_far() / max(n, 1))

        began = time.perf_counter()
        in_time = self.pool.run(self._do, tasks, forked, self.stats.merge, watch, threads)
        at_once = max(min(threads, len(dealt)), 1)
        self.speed = self.pool.so_far() / max((time.perf_counter() - began) * at_once, 1e-9)
        self.fraction = until
        return in_time

    def develop(self) -> None:
        """Develop all pixels into the image."""
        n, many = len(self.grid), self.pool.many()
        size = max(math.ceil(n / (many * max(math.ceil(n / (many * DEVELOP_CHUNK)), 1))), 1)  # even: as many for each
        tasks = [Task(k, start, min(start + size, n), DEVELOP) for k, start in enumerate(range(0, n, size))]
        self.pool.run(self._do, tasks, False, self.stats.merge, lambda: None)

    def __enter__(self) -> Passes:
        return self

    def __exit__(self, error: object, *_: object) -> None:
        """Let the pool go, at once if something went wrong."""
        self.pool.end(kill=error is not None)

    def report(self, fraction: float) -> None:
        """Tell the caller how far we are; raises Cancelled if it has had enough."""
        if self.progress is not None and self.progress(fraction) is False:
            self.pool.stop.set()
            raise Cancelled("tracing was cancelled")
        if self.show is not None and self.image is not None:
            x0, y0, x1, y1 = self.scene.camera.window
            self.show(partial(so_far, self.image, self.pixel_buffer, (y1 - y0, x1 - x0)))

    def _kind(self, seen: PrimitiveSet) -> int:
        """The kind of the tasks in which camera rays see this."""
        kind = next((k for k, known in enumerate(self._seen) if known is seen), len(self._seen))
        if kind == len(self._seen):
            self.pool.end()  # processes that are there do not know it
            self._seen.append(seen)
        return kind

    def _tasks(self, dealt: list[Pixels], kind: int, work: Pass, deadline: float) -> list[Task]:
        """The tiles of a pass, put on the board."""
        tasks, start = [], 0
        for number, pixels in enumerate(dealt):
            stop = start + len(pixels)
            self._board[start:stop] = pixels
            tasks.append(Task(number, start, stop, kind, work.first, work.count, work.spread, work.signed, deadline))
            start = stop
        return tasks

    def _do(self, task: Task) -> tuple[Stats, bool]:
        """Work of a thread or a process."""
        if task.kind == DEVELOP:
            assert self.image is not None
            return self.image.develop(self.pixel_buffer, task.start, task.stop), True
        work = Pass(task.first, task.samples, self._seen[task.kind], task.spread, task.signed)
        pixels = self._board[task.start : task.stop].astype(np.intp)
        return self._trace_tile(pixels, work, task.deadline, self.pool.slot(task))

    def _trace_tile(self, pixels: Pixels, work: Pass, deadline: float, begun: NDArray[np.int64]) -> tuple[Stats, bool]:
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
            # Trace the samples, and give them to their pixels.
            keys = pixel_keys(*self.grid.at(pixels), settings.seed)
            sampler = Sampler(keys, settings.first + work.first, work.count)
            try:
                check()
                sample_buffer = self._traced(pixels, work, sampler, stats, begun, check)
            except _TooLate:
                return stats, False
            count_samples(sample_buffer, stats)
            sample_buffer.close()
            self.pixel_buffer.add(pixels, sample_buffer, work.first)
        return stats, True

    def _traced(
        self, pixels: Pixels, work: Pass, sampler: Sampler, stats: Stats, begun: NDArray[np.int64],
        check: Callable[[], None],
    ) -> SampleBuffer:  # fmt: skip
        """What all samples of some pixels add up to, by tiles, or in waves."""
        tile_scene = self._tiles_of(work.seen)
        if tile_scene is not None:
            sample_buffer, at = self._buffer(len(pixels), work, sampler), self.grid.at(pixels)
            if trace_samples(tile_scene, at, self._places(work), sampler, sample_buffer, stats, check, begun):
                return sample_buffer
            begun[0] = 0
        sample_buffer = self._buffer(len(pixels), work, sampler)
        chunks = self._camera_rays(pixels, work, sampler, stats, begun)
        draws = sampler if self.scene.plan.draws else None
        trace_rays(self.scene, chunks, work.seen, sample_buffer, stats, check, sampler=draws)
        return sample_buffer

    def _buffer(self, pixels: int, work: Pass, sampler: Sampler) -> SampleBuffer:
        """Sums of the samples of so many pixels, all 0."""
        settings, signatures = self.settings, None
        if work.signed and self._identity is not None:
            nothing = np.zeros(pixels * work.count, np.uint32)
            signatures = Signatures(nothing, self._identity, np.float32(settings.adaptive))
        return SampleBuffer.zeros(
            pixels, work.count, settings.cutoff, wanted_aovs(settings), settings.max_depth,
            settings.rough_samples + 1, sampler, signatures,
        )  # fmt: skip

    def _tiles_of(self, seen: PrimitiveSet) -> TileScene | None:
        """The scene as tiles see it; None: it is for the waves."""
        key = id(seen)
        if key not in self._tile_scenes:
            self._tile_scenes[key] = tiles_of(self.scene, seen, self._identity)
        return self._tile_scenes[key]

    def _places(self, work: Pass) -> tuple[Float64, Float64]:
        """Where in each pixel the samples (count,) fall."""
        u, v = (place.astype(np.float64) for place in self.filter.places(work.first, work.count, work.spread))
        return u, v

    def _camera_rays(
        self, pixels: Pixels, work: Pass, sampler: Sampler, stats: Stats, begun: NDArray[np.int64]
    ) -> Iterator[Rays]:
        """The camera rays of a tile, chunk by chunk: those of some pixels after those of others."""
        camera, count = self.scene.camera, work.count
        u, v = self._places(work)
        signed = work.signed or self.scene.plan.draws
        branched = branch_rows(self.settings)
        # Chunks of whole pixels, all of one size.
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
