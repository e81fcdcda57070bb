"""One picture: passes over its pixels, then the film."""

from __future__ import annotations

import math
import time
from collections import Counter
from functools import partial

import numpy as np

from ..scene import Film, Float32, Scene, Settings
from .catcher.caustics import caustic
from .catcher.shadow_catcher import raster_shadow
from .core.cache import SceneCache
from .core.constants import FILL_SAMPLES
from .core.stats import Stats
from .film import ended_rays
from .film.filter import fill_from_neighbours
from .film.picture import ResolvedImage
from .film.pixels import PixelBuffer
from .film.samples import wanted_parts
from .parallel.pool import zeros_for
from .prepare.compiled import CompiledScene
from .prepare.validate import validate
from .sampling.aovs import depth_and_normal
from .sampling.passes import Cancelled, Pass, Passes, Pixels, Progress
from .sampling.schedule import END, EVEN, Schedule, is_adaptive
from .sampling.strips import Sampling, Strip, strips_of, together

__all__ = ["Cancelled", "Progress", "trace", "trace_compiled"]

DEFAULTS = Settings()
BAND = 1 << 16
"""Pixels that are developed at once, at most: what is only needed meanwhile stays small in large pictures."""

PHASES = ("build", "intersect", "occluded", "shade", "develop")


def trace(
    scene: Scene,
    settings: Settings = DEFAULTS,
    mask: Float32 | None = None,
    progress: Progress | None = None,
    deadline: float = math.inf,
    cache: SceneCache | None = None,
) -> Film:
    """Trace a scene over its camera's window.

    mask     : (height, width); only pixels where it is not 0 are traced, and each of these gets a colour if any ray
               traced object is in sight of it or of a neighbour. None: all pixels.
    progress : called on this thread with the fraction done, about every 0.1 s; returning False cancels.
    deadline : on time.perf_counter's clock; what is not traced by then is given up (`schedule`), and `skipped` says so.
    kept     : of earlier frames; what has not changed since the last one is not prepared again.

    Raises ValueError for scenes that cannot be traced, Cancelled if progress says so.
    """
    validate(scene, settings, mask)
    if progress is not None and progress(0.0) is False:
        raise Cancelled("tracing was cancelled")
    building = Stats()
    with building.phase("build"):
        compiled = _compiled(scene, settings, mask, cache)
    try:
        film = trace_compiled(compiled, mask, progress, deadline)
    finally:
        if cache is not None:
            cache.end()
    spent = {"wall": building.wall["build"], "cpu": building.cpu["build"]}
    film.time["build"] = spent
    film.time["total"] = {clock: film.time["total"][clock] + spent[clock] for clock in spent}
    return film


def _compiled(scene: Scene, settings: Settings, mask: Float32 | None, cache: SceneCache | None) -> CompiledScene:
    """The scene prepared; nothing of it for an empty mask, unless what is out of sight may cast shadows."""
    if mask is None or np.any(mask) or settings.raster_shadows:
        return CompiledScene(scene, settings, cache, None if mask is None else int(np.count_nonzero(mask)))
    compiled = CompiledScene(Scene(scene.camera), settings)
    nothing = ({"what": "tracing", "why": "the mask is empty", "count": 1},)
    compiled.plan = compiled.plan.with_pruning("empty-mask", True, mask.size, nothing)
    return compiled


def trace_compiled(
    compiled: CompiledScene,
    mask: Float32 | None = None,
    progress: Progress | None = None,
    deadline: float = math.inf,
) -> Film:
    """The same, for a scene that has been prepared before: `CompiledScene(scene, settings)` of a validated scene."""
    return _Frame(compiled, mask, progress, deadline).render()


class _Frame:
    """The work on one picture, strip by strip."""

    def __init__(self, scene: CompiledScene, mask: Float32 | None, progress: Progress | None, deadline: float) -> None:
        self.began, self.deadline, self.progress = time.perf_counter(), deadline, progress
        self.scene, self.settings = scene, scene.settings
        x0, y0, x1, y1 = scene.camera.window
        self.width, self.height = x1 - x0, y1 - y0
        self.mask = None if mask is None else np.asarray(mask, np.float32)
        self.wanted = None if self.mask is None else self.mask != 0
        n, zeros = self.width * self.height, zeros_for(self.settings)
        must_fill = self.mask is not None and self.settings.camera_sees == "RAY_TRACED"
        self.picture = ResolvedImage.zeros(n, must_fill, wanted_parts(self.settings), zeros)
        self.samples = np.zeros(n if "samples" in self.settings.passes else 0, np.float32)
        self.stats, self.developing = Stats(), 0.0
        self.skipped: Counter[tuple[str, str]] = Counter()
        self.sampling: Sampling = {}
        self.shadow: Float32 | None = None
        self.caustic: Float32 | None = None

    # -------------------------------------------------------------------------------------------- stages

    def render(self) -> Film:
        """Trace all wanted pixels, fill those that no sample hit, and develop."""
        began = time.perf_counter()
        if self.settings.raster_shadows:
            self._work_on_raster()
            if self.scene.screen_space is not None and self.shadow is not None:
                self.scene.screen_space.shade(self.shadow, self.caustic)
        ended_rays.forget(self.stats)
        self.sampling = together([self._take(strip) for strip in strips_of(self.width, self.height, self.wanted)])
        self._report(1.0)
        taken = time.perf_counter()
        with self.stats.phase("develop"):
            film = self._finished()
        for phase in PHASES:
            film.time[phase] = {"wall": self.stats.wall[phase], "cpu": self.stats.cpu[phase]}
        # Of the others the seconds of all threads; of this one those that passed after the samples were taken.
        film.time["develop"]["wall"] = self.developing + time.perf_counter() - taken
        film.time["trace"] = {"wall": time.perf_counter() - began, "cpu": self._cpu()}
        film.time["total"] = {"wall": time.perf_counter() - self.began, "cpu": self._cpu()}
        return film

    def _work_on_raster(self) -> None:
        """Shadows and caustics of ray traced objects on all others; first, so that a time budget has time for them."""
        shape, wants_photons = (self.height, self.width), self.settings.caustics == "PHOTONS"
        self.shadow = np.ones((*shape, 3), np.float32)
        self.caustic = np.zeros((*shape, 3), np.float32) if wants_photons else None
        if not self.scene.plan.raster_shadows:
            return

        def go_on(_done: float) -> bool:
            self._report(0.0)
            return True

        self.shadow = raster_shadow(self.scene, self.mask, self.stats, self.deadline, go_on)
        if wants_photons:
            self.caustic = caustic(self.scene, self.mask, self.stats, partial(self._report, 0.0))

    def _report(self, fraction: float) -> None:
        """Tell the caller how far we are; raises Cancelled if it has had enough."""
        if self.progress is not None and self.progress(fraction) is False:
            raise Cancelled("tracing was cancelled")

    def _take(self, strip: Strip) -> tuple[int, Sampling]:
        """The picture of a strip; how many pixels were traced for it, and what to expect of them."""
        deadline = strip.deadline(self.deadline, time.perf_counter())
        passes = Passes(self.scene, strip.told(self.progress), self.wanted, strip.rows)
        part = _Part(passes, self.picture, self.mask, deadline)
        part.render()
        self.stats.merge(part.stats)
        self.developing += part.developing
        self.skipped += part.schedule.skipped
        inside = part.grid.window >= 0
        if len(self.samples):
            self.samples[part.grid.window[inside]] = part.total.samples[inside]
        return int(np.count_nonzero(inside)), part.schedule.sampling

    def _cpu(self) -> float:
        return sum(seconds for phase, seconds in self.stats.cpu.items() if phase != "build")

    def _skip(self, what: str, why: str, number: int) -> None:
        self.skipped[what, why] += number

    def _finished(self) -> Film:
        """The developed picture, gaps filled from the neighbours."""
        picture, shape = self.picture, (self.height, self.width)
        pictures = {name: part.reshape(*shape, -1) for name, part in picture.parts.items()}
        radiance, residual = picture.radiance.reshape(*shape, 3), picture.residual.reshape(shape)
        coverage = picture.coverage.reshape(shape)
        images = (radiance, residual, *pictures.values(), *(() if picture.only_ray_traced else (coverage,)))
        filled = fill_from_neighbours(images, picture.known.reshape(shape), picture.wanted.reshape(shape))
        self._skip("pixels without a sample", "copied from the nearest traced pixel", filled)
        flat = {name: part[..., 0] if part.shape[2] == 1 else part for name, part in pictures.items()}
        return self._film(radiance, coverage, residual, flat)

    def _film(self, radiance: Float32, coverage: Float32, residual: Float32, parts: dict[str, Float32]) -> Film:
        counts = self.stats.counts
        self._skip("triangles", "degenerate or not finite", self.scene.geometry.dropped)
        self._skip("triangles", "large ones next to small ray traced objects, split", self.scene.geometry.split)
        self._skip("shadow rays", "no light would arrive", counts["shadow_not_needed"])
        self._skip(
            "shadow rays", "more surfaces crossed than are followed: in shadow", counts["shadow_crossings_exhausted"]
        )
        self._skip("shadow rays", "the light that they ask for is within the cutoff", counts["shadow_cut"])
        self._skip("rays", "their share of the picture is within the cutoff", counts["cut"])
        self._skip("rays", "too many of one sample: others, drawn by lot, stand for them", counts["crowded"])
        entries = [{"what": what, "why": why, "count": n} for (what, why), n in self.skipped.items() if n]
        kinds = ("camera", "reflected", "refracted", "straight", "shadow", "shadow_steps", "occlusion", "dropped")
        invariants = ("lost_media", "self_hits", "barycentrics_out_of_range", "negative_radiance", "nan_pixels")
        return Film(
            radiance=radiance,
            coverage=coverage,
            residual=residual,
            rays={kind: counts[kind] for kind in kinds},
            time={},  # `render` knows them when all is done
            invariants={
                "dropped_rays": counts["dropped"],
                **{name: counts[name] for name in invariants},
            },
            skipped=[*self.scene.plan.skipped, *entries],
            plan=self.scene.plan.table(self._saved()),
            sampling=self.sampling,
            shadow=self.shadow,
            caustic=self.caustic,
            passes=self._passes(parts),
            hits={name: counts[name] for name in ("backed", "not_backed")},
            ended=ended_rays.found(self.stats),
        )

    def _saved(self) -> dict[str, int]:
        """What prunings left out that only tracing can tell."""
        counts, mask = self.stats.counts, self.mask
        left_out = {
            "weightless": "weightless", "any-hit": "any_hit", "unlit": "shadow_not_needed", "faint-light": "shadow_cut",
            "cutoff": "cut",
        }  # fmt: skip
        return {
            **{name: counts[counter] for name, counter in left_out.items()},
            **{name: 0 if mask is None else int(np.count_nonzero(mask == 0)) for name in ("empty-mask", "unmasked")},
            "adaptive": self.skipped["samples", EVEN],
        }

    def _passes(self, parts: dict[str, Float32]) -> dict[str, Float32]:
        """The passes that are wanted, light passes among them; the others cost nothing."""
        wanted, found = self.settings.passes, dict(parts)
        if wanted & {"depth", "normal"}:
            found |= depth_and_normal(self.scene, np.flatnonzero(self.picture.wanted), self.stats)
        if "samples" in wanted:
            found["samples"] = self.samples.reshape(self.height, self.width)
        return {name: found[name] for name in sorted(wanted)}


class _Part:
    """The work on one strip: the passes over its pixels, and what they add up to.

    grid, total, schedule : of these pixels.   tally : what was counted.   developing : seconds after the last sample.
    """

    def __init__(self, passes: Passes, picture: ResolvedImage, mask: Float32 | None, deadline: float) -> None:
        """picture, mask: of the whole window."""
        self.passes, self.scene, self.picture, self.deadline = passes, passes.scene, picture, deadline
        self.stats, self.grid, self.developing = passes.stats, passes.grid, 0.0
        settings, adaptive = passes.settings, is_adaptive(passes.scene)
        self.total = PixelBuffer.zeros(self.grid, passes.filter, adaptive, wanted_parts(settings), zeros_for(settings))
        passes.pixel_buffer, passes.develop = self.total, partial(picture.develop, self.total)
        weight = None if mask is None else mask.reshape(-1)[self.grid.window] * (self.grid.window >= 0)
        self.schedule = Schedule(self.scene, passes, self.total, weight, deadline)

    def render(self) -> None:
        """Take the samples, and develop them."""
        with self.passes:
            self.schedule.run()
            found = self._fill_gaps() if self.picture.only_ray_traced else np.zeros(0, np.intp)
            sampled = time.perf_counter()
            self.passes.develop_all(BAND)
        with self.stats.phase("develop"):
            self.schedule.note_errors()
            self.picture.coverage[self.grid.window[found]] = 0
        self.developing = time.perf_counter() - sampled

    def _fill_gaps(self) -> Pixels:
        """Give every masked pixel a sample that counts: more camera rays, then only ray traced geometry.

        Returns the pixels (m,) that had none.
        """
        first, camera = self.passes.settings.samples, self.scene.seen_by_camera
        inside = self.grid.inside()
        empty = without = inside[~self.total.seen(inside)]
        for why, seen in (
            ("found by more camera rays", camera),
            ("found behind what is not ray traced", self.scene.ray_traced_only),
        ):
            before, taken = len(empty), 0
            for count in FILL_SAMPLES:
                if len(empty) and len(seen):
                    self.passes.run(empty, Pass(first + taken, count, seen, True), (END, 1.0), self.deadline)
                    empty, taken = empty[~self.total.seen(empty)], taken + count
            self.schedule.skipped["pixels without a sample", why] += before - len(empty)
        return without
