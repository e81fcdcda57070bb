"""One picture: passes over its pixels, then the film."""

from __future__ import annotations

import math
import time

import numpy as np

from ..scene import Film, Float32, Scene, Settings
from .cast import raster_shadow
from .compiled import CompiledScene
from .constants import FILL_SAMPLES
from .data import depth_and_normal
from .developed import Developed
from .film import fill_from_neighbours
from .kept import Kept
from .passes import Cancelled, Pass, Passes, Pixels, Progress
from .photons import caustic
from .schedule import END, EVEN, Schedule, is_adaptive
from .sums import wanted_parts
from .tally import Tally
from .totals import Totals
from .validate import validate

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
    kept: Kept | None = None,
) -> Film:
    """Trace a scene over its camera's window.

    mask     : (height, width); only pixels where it is not 0 are traced, and each of these gets a colour if any flagged
               object is in sight of it or of a neighbour. None: all pixels.
    progress : called on this thread with the fraction done, about every 0.1 s; returning False cancels.
    deadline : on time.perf_counter's clock; what is not traced by then is given up (`schedule`), and `skipped` says so.
    kept     : of earlier frames; what has not changed since the last one is not made ready again.

    Raises ValueError for scenes that cannot be traced, Cancelled if progress says so.
    """
    validate(scene, settings, mask)
    if progress is not None and progress(0.0) is False:
        raise Cancelled("tracing was cancelled")
    building = Tally()
    with building.phase("build"):
        compiled = _compiled(scene, settings, mask, kept)
    try:
        film = trace_compiled(compiled, mask, progress, deadline)
    finally:
        if kept is not None:
            kept.end()
    spent = {"wall": building.wall["build"], "cpu": building.cpu["build"]}
    film.time["build"] = spent
    film.time["total"] = {clock: film.time["total"][clock] + spent[clock] for clock in spent}
    return film


def _compiled(scene: Scene, settings: Settings, mask: Float32 | None, kept: Kept | None) -> CompiledScene:
    """The scene made ready; nothing of it for an empty mask, unless what is out of sight may cast shadows."""
    if mask is None or np.any(mask) or settings.raster_shadows or "empty-mask" in settings.keep:
        return CompiledScene(scene, settings, kept, None if mask is None else int(np.count_nonzero(mask)), once=True)
    compiled = CompiledScene(Scene(scene.camera), settings)
    compiled.plan.applies["empty-mask"] = True
    compiled.plan.skipped[:] = [{"what": "tracing", "why": "the mask is empty", "count": 1}]
    return compiled


def trace_compiled(
    compiled: CompiledScene,
    mask: Float32 | None = None,
    progress: Progress | None = None,
    deadline: float = math.inf,
) -> Film:
    """The same, for a scene that has been made ready before: `CompiledScene(scene, settings)` of a validated scene."""
    return _Frame(compiled, mask, progress, deadline).render()


class _Frame:
    """The work on one picture."""

    def __init__(self, scene: CompiledScene, mask: Float32 | None, progress: Progress | None, deadline: float) -> None:
        self.began, self.deadline = time.perf_counter(), deadline
        self.scene, self.settings = scene, scene.settings
        x0, y0, x1, y1 = scene.camera.window
        self.width, self.height = x1 - x0, y1 - y0
        self.mask = None if mask is None else np.asarray(mask, np.float32)
        self.must_fill = self.mask is not None and self.settings.see == "FLAGGED"
        self.passes = Passes(self.scene, progress, None if self.mask is None else self.mask != 0)
        self.tally, self.grid = self.passes.tally, self.passes.grid
        zeros, parts = self.passes.crew.zeros, wanted_parts(self.settings)
        self.total = Totals.zeros(self.grid, self.passes.filter, is_adaptive(scene), parts, zeros)
        self.picture = Developed.zeros(self.total, self.width * self.height, self.must_fill, zeros)
        self.passes.totals, self.passes.develop = self.total, self.picture.develop
        weight = None if self.mask is None else self.mask.reshape(-1)[self.grid.window] * (self.grid.window >= 0)
        self.schedule = Schedule(scene, self.passes, self.total, weight, deadline)
        self.skipped = list(self.scene.plan.skipped)
        self.shadow: Float32 | None = None
        self.caustic: Float32 | None = None

    # -------------------------------------------------------------------------------------------- stages

    def render(self) -> Film:
        """Trace all wanted pixels, fill those that no sample hit, and develop."""
        began = time.perf_counter()
        with self.passes:
            if self.settings.raster_shadows:
                self._work_on_raster()
                if self.scene.backing is not None and self.shadow is not None:
                    self.scene.backing.shade(self.shadow, self.caustic)
            self.schedule.run()
            for (what, why), number in self.schedule.skipped.items():
                self._skip(what, why, number)
            found = self._fill_gaps() if self.must_fill else np.zeros(0, np.intp)
            self.passes.report(1.0)
            sampled = time.perf_counter()
            self.passes.develop_all(BAND)
        with self.tally.phase("develop"):
            self.schedule.note_errors()
            film = self._finished(found)
        for phase in PHASES:
            film.time[phase] = {"wall": self.tally.wall[phase], "cpu": self.tally.cpu[phase]}
        # Of the others the seconds of all threads; of this one how long ago the last sample was taken.
        film.time["develop"]["wall"] = time.perf_counter() - sampled
        film.time["trace"] = {"wall": time.perf_counter() - began, "cpu": self._cpu()}
        film.time["total"] = {"wall": time.perf_counter() - self.began, "cpu": self._cpu()}
        return film

    def _work_on_raster(self) -> None:
        """Shadows and caustics of flagged objects on all others; first, or a time budget would leave none for them."""
        shape, wants_photons = (self.height, self.width), self.settings.caustics == "PHOTONS"
        self.shadow = np.ones((*shape, 3), np.float32)
        self.caustic = np.zeros((*shape, 3), np.float32) if wants_photons else None
        if not self.scene.plan.raster_shadows:
            return

        def go_on(_done: float = 0.0) -> None:
            self.passes.report(0.0)

        self.shadow = raster_shadow(self.scene, self.mask, self.tally, self.deadline, go_on)
        if wants_photons:
            self.caustic = caustic(self.scene, self.mask, self.tally, go_on)

    def _cpu(self) -> float:
        return sum(seconds for phase, seconds in self.tally.cpu.items() if phase != "build")

    def _fill_gaps(self) -> Pixels:
        """Give every masked pixel a sample that counts: more camera rays, then only flagged geometry.

        Returns the pixels (m,) that had none.
        """
        first, camera = self.settings.samples, self.scene.seen_by_camera
        inside = self.grid.inside()
        empty = without = inside[~self.total.seen(inside)]
        for why, seen in (
            ("found by more camera rays", camera),
            ("found behind what is not flagged", self.scene.flagged_only),
        ):
            before, taken = len(empty), 0
            for count in FILL_SAMPLES:
                if len(empty) and len(seen):
                    self.passes.run(empty, Pass(first + taken, count, seen, True), (END, 1.0), self.deadline)
                    empty, taken = empty[~self.total.seen(empty)], taken + count
            self._skip("pixels without a sample", why, before - len(empty))
        return without

    def _skip(self, what: str, why: str, number: int) -> None:
        if number:
            self.skipped.append({"what": what, "why": why, "count": number})

    def _finished(self, found: Pixels) -> Film:
        """The developed picture, gaps filled from the neighbours.

        found : pixels whose colour was looked for behind what covers it.
        """
        picture, shape = self.picture, (self.height, self.width)
        picture.coverage[self.grid.window[found]] = 0
        pictures = {name: part.reshape(*shape, -1) for name, part in picture.parts.items()}
        radiance, residual = picture.radiance.reshape(*shape, 3), picture.residual.reshape(shape)
        coverage = picture.coverage.reshape(shape)
        images = (radiance, residual, *pictures.values(), *(() if self.must_fill else (coverage,)))
        filled = fill_from_neighbours(images, picture.known.reshape(shape), picture.wanted.reshape(shape))
        self._skip("pixels without a sample", "copied from the nearest traced pixel", filled)
        flat = {name: part[..., 0] if part.shape[2] == 1 else part for name, part in pictures.items()}
        return self._film(radiance, coverage, residual, flat)

    def _film(self, radiance: Float32, coverage: Float32, residual: Float32, parts: dict[str, Float32]) -> Film:
        counts = self.tally.counts
        self._skip("triangles", "degenerate or not finite", self.scene.geometry.dropped)
        self._skip("triangles", "large ones next to small flagged objects, split", self.scene.geometry.split)
        self._skip("shadow rays", "no light would arrive", counts["shadow_not_needed"])
        self._skip(
            "shadow rays", "more surfaces crossed than are followed: in shadow", counts["shadow_crossings_exhausted"]
        )
        self._skip("shadow rays", "the light that they ask for is within the cutoff", counts["shadow_cut"])
        self._skip("rays", "their share of the picture is within the cutoff", counts["cut"])
        self._skip("rays", "more at once than are followed of one sample, the lightest", counts["crowded"])
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
            skipped=self.skipped,
            plan=self.scene.plan.table(self._saved()),
            sampling=self.schedule.sampling,
            shadow=self.shadow,
            caustic=self.caustic,
            passes=self._passes(parts),
            hits={name: counts[name] for name in ("backed", "not_backed")},
        )

    def _saved(self) -> dict[str, int]:
        """What prunings left out that only tracing can tell."""
        counts, mask = self.tally.counts, self.mask
        left_out = {
            "weightless": "weightless", "any-hit": "any_hit", "unlit": "shadow_not_needed", "faint-light": "shadow_cut",
            "cutoff": "cut",
        }  # fmt: skip
        return {
            **{name: counts[counter] for name, counter in left_out.items()},
            **{name: 0 if mask is None else int(np.count_nonzero(mask == 0)) for name in ("empty-mask", "unmasked")},
            "adaptive": self.schedule.skipped["samples", EVEN],
        }

    def _passes(self, parts: dict[str, Float32]) -> dict[str, Float32]:
        """The passes that are wanted, light passes among them; the others cost nothing."""
        wanted, found = self.settings.passes, dict(parts)
        if wanted & {"depth", "normal"}:
            traced = self.grid.window[self.grid.window >= 0].astype(np.intp)
            found |= depth_and_normal(self.scene, traced, self.tally)
        if "samples" in wanted:
            inside = self.grid.window >= 0
            samples = np.zeros(self.width * self.height, np.float32)
            samples[self.grid.window[inside]] = self.total.samples[inside]
            found["samples"] = samples.reshape(self.height, self.width)
        return {name: found[name] for name in sorted(wanted)}
