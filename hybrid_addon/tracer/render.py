"""One picture: chunks of pixels over threads, then the film.

A chunk is a run of whole pixels with all their samples. Every pixel is worked out from its own absolute place alone,
and each chunk writes its own slice: neither the number of threads nor the size of the chunks changes one bit.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene import Film, Float32, Scene, Settings
from .camera import generate_rays
from .compiled import CompiledScene
from .constants import FAILED_PIXEL, FILL_SAMPLES
from .film import fill_from_neighbours, film_positions
from .primitives import PrimitiveSet
from .rays import camera_rays
from .sums import Sums
from .tally import Tally
from .validate import validate
from .whitted import trace_rays

Progress = Callable[[float], bool]
Pixels = NDArray[np.intp]

POLL_SECONDS = 0.1
"""How often the caller hears of progress, and may cancel."""


SMALLEST_SHARE = 1 << 13
"""Small pictures are split evenly over the threads, but not into fewer camera rays than pay for a wave's overhead."""

DEFAULTS = Settings()


class Cancelled(Exception):
    """The progress callback asked to stop."""


def trace(
    scene: Scene, settings: Settings = DEFAULTS, mask: Float32 | None = None, progress: Progress | None = None
) -> Film:
    """Trace a scene over its camera's window.

    mask     : (height, width); only pixels where it is not 0 are traced, and each of these gets a colour if any flagged
               object is in sight of it or of a neighbour. None: all pixels.
    progress : called on this thread with the fraction done, about every 0.1 s; returning False cancels.

    Raises ValueError for scenes that cannot be traced, Cancelled if progress says so.
    """
    validate(scene, settings, mask)
    return _Frame(scene, settings, mask, progress).render()


@dataclass(frozen=True)
class _Pass:
    """Samples first .. first + count - 1 of some pixels."""

    first: int
    count: int
    seen: PrimitiveSet
    filtered: bool


class _Frame:
    """The work on one picture."""

    def __init__(self, scene: Scene, settings: Settings, mask: Float32 | None, progress: Progress | None) -> None:
        self.began = time.perf_counter()
        self.tally = Tally()
        self.progress = progress
        self.settings = settings
        self.stop = threading.Event()
        self._report(0.0)
        x0, y0, x1, y1 = scene.camera.window
        self.corner, self.width, self.height = (x0, y0), x1 - x0, y1 - y0
        self.mask = mask
        wanted = np.ones(self.width * self.height, bool) if mask is None else np.ravel(np.asarray(mask) != 0)
        self.pixels: Pixels = np.flatnonzero(wanted)
        with self.tally.phase("build"):
            self.scene = CompiledScene(scene, settings)
        self.total = Sums.zeros(self.width * self.height)
        self.skipped = list(self.scene.plan.skipped)

    # -------------------------------------------------------------------------------------------- stages

    def render(self) -> Film:
        """Trace all wanted pixels, fill those that no sample hit, and develop."""
        began = time.perf_counter()
        samples = self.settings.samples
        self._run(self.pixels, _Pass(0, samples, self.scene.seen_by_camera, samples > 1), 0.0, 0.95)
        coverage = self.total.seen / samples
        known = self.total.seen > 0
        if self.mask is not None and self.settings.see == "FLAGGED":
            known = self._fill_gaps(known)
        self._report(1.0)
        film = self._develop(coverage, known)
        film.time["trace"] = {"wall": time.perf_counter() - began, "cpu": self._cpu()}
        film.time["total"] = {"wall": time.perf_counter() - self.began, "cpu": self._cpu() + self.tally.cpu["build"]}
        return film

    def _cpu(self) -> float:
        return sum(seconds for phase, seconds in self.tally.cpu.items() if phase != "build")

    def _fill_gaps(self, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Give every masked pixel a colour: more camera rays, then only flagged geometry, then the neighbours'."""
        samples, camera = self.settings.samples, self.scene.seen_by_camera
        stages = (
            ("pixels without a sample", "found by more camera rays", _Pass(samples, FILL_SAMPLES, camera, True)),
            ("pixels without a sample", "found behind what is not flagged", None),
        )
        for what, why, work in stages:
            empty = self.pixels[~known[self.pixels]]
            if len(empty) == 0:
                return known
            if work is None:
                if len(self.scene.flagged_only) == 0:
                    break
                work = _Pass(samples, FILL_SAMPLES, self.scene.flagged_only, True)
            self._run(empty, work, 0.95, 1.0)
            known = self.total.seen > 0
            self._skip(what, why, int(np.count_nonzero(known[empty])))
        return known

    def _skip(self, what: str, why: str, number: int) -> None:
        if number:
            self.skipped.append({"what": what, "why": why, "count": number})

    def _develop(self, coverage: NDArray[np.float64], known: NDArray[np.bool_]) -> Film:
        """Means over the samples that count, failures in pink, gaps from the neighbours."""
        seen = np.where(self.total.seen > 0, self.total.seen, 1.0)
        with np.errstate(all="ignore"):
            radiance = np.ascontiguousarray((self.total.radiance / seen).astype(np.float32).T)
            residual = (self.total.residual / seen).astype(np.float32)
        failed = ~np.isfinite(radiance).all(axis=1) | ~np.isfinite(residual)
        self.tally.add("nan_pixels", np.count_nonzero(failed))
        self.tally.add("negative_radiance", np.count_nonzero((radiance < 0).any(axis=1)))
        radiance[failed] = FAILED_PIXEL
        residual[failed] = 1
        shape = (self.height, self.width)
        radiance = radiance.reshape(*shape, 3)
        if self.mask is not None and self.settings.see == "FLAGGED":
            wanted = np.zeros(self.width * self.height, bool)
            wanted[self.pixels] = True
            filled = fill_from_neighbours(radiance, known.reshape(shape), wanted.reshape(shape))
            self._skip("pixels without a sample", "copied from the nearest traced pixel", filled)
        return self._film(radiance, coverage.astype(np.float32).reshape(shape), residual.reshape(shape))

    def _film(self, radiance: Float32, coverage: Float32, residual: Float32) -> Film:
        counts, tally = self.tally.counts, self.tally
        self._skip("triangles", "degenerate or not finite", self.scene.geometry.dropped)
        self._skip("triangles", "large ones next to small flagged objects, split", self.scene.geometry.split)
        self._skip("shadow rays", "no light would arrive", counts["shadow_not_needed"])
        self._skip(
            "shadow rays", "more surfaces crossed than are followed: in shadow", counts["shadow_crossings_exhausted"]
        )
        self._skip("rays", "their share of the picture is within the cutoff", counts["cut"])
        kinds = ("camera", "reflected", "refracted", "straight", "shadow", "shadow_steps", "dropped")
        invariants = ("lost_media", "self_hits", "barycentrics_out_of_range", "negative_radiance", "nan_pixels")
        return Film(
            radiance=radiance,
            coverage=coverage,
            residual=residual,
            rays={kind: counts[kind] for kind in kinds},
            time={p: {"wall": tally.wall[p], "cpu": tally.cpu[p]} for p in ("build", "intersect", "occluded", "shade")},
            invariants={
                "dropped_rays": counts["dropped"],
                **{name: counts[name] for name in invariants},
            },
            skipped=self.skipped,
        )

    # -------------------------------------------------------------------------------------------- threads

    def _run(self, pixels: Pixels, work: _Pass, done: float, until: float) -> None:
        """Work through pixels in chunks; done .. until is this part of the progress."""
        threads = self.settings.threads or os.cpu_count() or 1
        share = max(SMALLEST_SHARE, len(pixels) * work.count // (2 * threads))  # a small picture is for all threads
        size = max(1, min(self.settings.chunk, share) // work.count)
        chunks: Iterator[Pixels] = (pixels[i : i + size] for i in range(0, len(pixels), size))
        pending: set[Future[Tally]] = set()
        finished = 0
        with ThreadPoolExecutor(threads, thread_name_prefix="hybrid-tracer") as pool:
            try:
                # A short queue: cancelling must not wait for chunks that nobody has begun.
                while True:
                    while len(pending) < 2 * threads and (chunk := next(chunks, None)) is not None:
                        pending.add(pool.submit(self._trace_chunk, chunk, work))
                    if not pending:
                        return
                    complete, pending = wait(pending, POLL_SECONDS, FIRST_COMPLETED)
                    for future in complete:
                        self.tally.merge(future.result())
                        finished += size
                    self._report(done + (until - done) * min(1.0, finished / len(pixels)))
            except BaseException:
                self.stop.set()
                raise

    def _report(self, fraction: float) -> None:
        if self.progress is not None and self.progress(fraction) is False:
            self.stop.set()
            raise Cancelled("tracing was cancelled")

    def _check(self) -> None:
        if self.stop.is_set():
            raise Cancelled("tracing was cancelled")

    def _trace_chunk(self, pixels: Pixels, work: _Pass) -> Tally:
        """All samples of some pixels; on a worker thread."""
        tally = Tally()
        self._check()
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
            rays = camera_rays(origin, direction, t_max, np.arange(len(pixels) * work.count), media)
            tally.add("camera", len(rays))
            sums = Sums.zeros(len(pixels), work.count, self.settings.cutoff)
            trace_rays(self.scene, rays, work.seen, sums, tally, self._check)
            self.total.radiance[:, pixels] = sums.radiance
            self.total.seen[pixels] = sums.seen
            self.total.residual[pixels] = sums.residual
        return tally
