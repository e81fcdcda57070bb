# SPDX-License-Identifier: GPL-3.0-or-later
"""One picture: passes over its pixels, then the film."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ..scene import Film, Float32, Scene, Settings
from .catcher.caustics import caustic
from .catcher.shadow_catcher import raster_shadow
from .core.cache import SceneCache
from .core.constants import FILL_SAMPLES
from .core.stats import Stats
from .film import ended_rays
from .film.denoised import denoised
from .film.picture import ResolvedImage
from .film.samples import SEEN_THROUGH, resolved_aovs
from .film.so_far import Show
from .kernels import loading
from .parallel.pool import zeros_for
from .prepare.compiled import CompiledScene
from .prepare.footprint import longest_strip, taken
from .prepare.validate import validate
from .sampling.aovs import depth_and_normal, seen_through
from .sampling.passes import Cancelled, Pass, Passes, Progress
from .sampling.schedule import EVEN, Sampling, sampling_error, take_samples
from .sampling.strips import strips_of, together
from .sampling.tiles import Pixels
from .shading.programs import problems

__all__ = ["Cancelled", "Progress", "trace", "trace_compiled"]

DEFAULTS = Settings()
WORK = ("intersect", "occluded", "shade")
"""Phases of `Film.time` in which all threads work."""

KINDS = ("camera", "reflected", "refracted", "straight", "shadow", "shadow_steps", "occlusion", "dropped")
"""Of `Film.rays`."""

INVARIANTS = ("lost_media", "self_hits", "barycentrics_out_of_range", "negative_radiance", "nan_pixels")

LEFT_OUT = {
    "shadow_not_needed": ("shadow rays", "no light would arrive"),
    "shadow_crossings_exhausted": ("shadow rays", "more surfaces crossed than are followed: in shadow"),
    "shadow_cut": ("shadow rays", "the light that they ask for is within the cutoff"),
    "cut": ("rays", "their share of the picture is within the cutoff"),
    "crowded": ("rays", "too many of one sample: others, drawn by lot, stand for them"),
}
"""Counters of what tracing left out, and what `Film.skipped` says of them."""

SAVED = {
    "weightless": "weightless", "any-hit": "any_hit", "unlit": "shadow_not_needed", "faint-light": "shadow_cut",
    "cutoff": "cut",
}  # fmt: skip
"""Prunings, and the counters of what they saved."""


def trace(
    scene: Scene,
    settings: Settings = DEFAULTS,
    mask: Float32 | None = None,
    progress: Progress | None = None,
    deadline: float = math.inf,
    cache: SceneCache | None = None,
    show: Show | None = None,
) -> Film:
    """Trace a scene over its camera's window.

    mask     : (height, width); only pixels where it is not 0 are traced, and each of these gets a colour if any ray
               traced object is in sight of it or of a neighbour. None: all pixels. With the passes "background" and
               "passed" also those that may show a ray traced surface that one sees straight through.
    progress : called on this thread with the fraction done, about every 0.1 s; returning False cancels.
    deadline : on time.perf_counter's clock; what is not traced by then is given up: `schedule`, and `skipped` says so.
    cache    : of earlier frames; what has not changed since the last one is not prepared again.
    show     : called on this thread, about every 0.1 s, with a function that makes the picture so far. A picture that
               takes seconds then goes from coarse to fine, and in the end has the same bits.

    Raises ValueError for scenes that cannot be traced, NotEnoughMemory before anything is built of one that does not
    fit, Cancelled if progress says so.
    """
    validate(scene, settings, mask)
    if progress is not None and progress(0.0) is False:
        raise Cancelled("tracing was cancelled")
    building = Stats()
    with building.phase("build"):
        compiled = _compiled(scene, settings, mask, cache)
    try:
        film = _render(compiled, mask, progress, deadline, building, show)
        if settings.denoise and settings.fill:
            film = denoised(film, settings.threads, partial(_go_on, progress, 1.0))
        return replace(film, memory=taken(scene, compiled.geometry, _arrays(film)))
    finally:
        if cache is not None:
            cache.end()


def _arrays(film: Film) -> list[Float32]:
    known = (film.radiance, film.coverage, film.residual, film.shadow, film.caustic, *film.passes.values())
    return [array for array in known if array is not None]


def _compiled(scene: Scene, settings: Settings, mask: Float32 | None, cache: SceneCache | None) -> CompiledScene:
    """The scene prepared; nothing of it for an empty mask, unless what is out of sight may cast shadows."""
    if mask is None or np.any(mask) or settings.raster_shadows or SEEN_THROUGH & settings.passes:
        return CompiledScene(scene, settings, cache, None if mask is None else int(np.count_nonzero(mask)))
    compiled = CompiledScene(Scene(scene.camera), settings, pixels=0)
    nothing = ({"what": "tracing", "why": "the mask is empty", "count": 1},)
    compiled.plan = compiled.plan.with_pruning("empty-mask", True, mask.size, nothing)
    return compiled


def trace_compiled(
    compiled: CompiledScene,
    mask: Float32 | None = None,
    progress: Progress | None = None,
    deadline: float = math.inf,
    show: Show | None = None,
) -> Film:
    """The same, for a scene that has been prepared before: `CompiledScene(scene, settings)` of a validated scene."""
    return _render(compiled, mask, progress, deadline, Stats(), show)


def _render(
    scene: CompiledScene,
    mask: Float32 | None,
    progress: Progress | None,
    deadline: float,
    building: Stats,
    show: Show | None,
) -> Film:
    """Trace all wanted pixels, fill those that no sample hit, and develop. building: what preparing the scene took."""
    loading.begin(after=loading.PATIENCE)
    began, settings, stats = time.perf_counter(), scene.settings, Stats()
    x0, y0, x1, y1 = scene.camera.window
    shape = y1 - y0, x1 - x0
    mask = None if mask is None else np.asarray(mask, np.float32)

    report = partial(_go_on, progress)

    # Shadows and caustics of ray traced objects on all others; first, so that a time budget has time for them.
    shadow, light = _work_on_raster(scene, mask, stats, deadline, partial(report, 0.0))
    shadowed = scene if shadow is None else scene.shaded(shadow, light)
    ended_rays.forget(stats)

    # EEVEE holds out what is seen straight through as far as it is opaque: elsewhere the mask tells of none.
    if mask is not None and SEEN_THROUGH & settings.passes:
        mask = np.where(seen_through(scene, stats) & (mask == 0), np.float32(1), mask)

    # The picture, strip by strip.
    only_ray_traced = mask is not None and settings.camera_sees == "RAY_TRACED"
    image = ResolvedImage.zeros(
        shape[0] * shape[1], only_ray_traced, resolved_aovs(settings), "samples" in settings.passes, zeros_for(settings)
    )
    wanted, developing, sampled = None if mask is None else mask != 0, 0.0, []
    for strip in strips_of(shape[1], shape[0], wanted, longest_strip(settings) if settings.denoise else None):
        until = strip.deadline(deadline, time.perf_counter())
        with Passes(shadowed, strip.reports(progress), wanted, strip.rows, until, image, show) as passes:
            sampling, seconds = _trace_strip(passes, mask)
        sampled.append((len(passes.grid.inside()), sampling))
        stats.merge(passes.stats)
        developing += seconds
    report(1.0)

    # What no sample hit, and what else was asked for.
    taken = time.perf_counter()
    with stats.phase("develop"):
        filled = image.fill(shape) if settings.fill else 0
        stats.skip("pixels without a sample", "copied from the nearest traced pixel", filled)
        aovs = _aovs(scene, image, shape, stats)
    developing += time.perf_counter() - taken
    return Film(
        radiance=image.radiance.reshape(*shape, 3),
        coverage=image.coverage.reshape(shape),
        residual=image.residual.reshape(shape),
        rays={kind: stats.counts[kind] for kind in KINDS},
        time=_times(stats, building, developing, time.perf_counter() - began),
        invariants={"dropped_rays": stats.counts["dropped"], **{name: stats.counts[name] for name in INVARIANTS}},
        skipped=[*scene.plan.skipped, *_skipped(scene, stats)],
        plan=scene.plan.table(_saved(stats, mask)),
        sampling=together(sampled),
        shadow=shadow,
        caustic=light,
        passes=aovs,
        hits={name: stats.counts[name] for name in ("backed", "not_backed")},
        ended=ended_rays.found(stats),
        problems=problems(stats),
    )


def _go_on(progress: Progress | None, fraction: float) -> None:
    """Tell how far we are; raises Cancelled if that is no longer wanted."""
    if progress is not None and progress(fraction) is False:
        raise Cancelled("tracing was cancelled")


# ------------------------------------------------------------------------------------------------ stages


def _work_on_raster(
    scene: CompiledScene, mask: Float32 | None, stats: Stats, deadline: float, check: Callable[[], None]
) -> tuple[Float32 | None, Float32 | None]:
    """`Film.shadow` and `Film.caustic`. check: called now and then; raises to stop."""
    settings, (x0, y0, x1, y1) = scene.settings, scene.camera.window
    shape = y1 - y0, x1 - x0
    if not settings.raster_shadows:
        return None, None
    photons = settings.caustics == "PHOTONS"
    if not scene.plan.raster_shadows:
        return np.ones((*shape, 3), np.float32), np.zeros((*shape, 3), np.float32) if photons else None

    def go_on(_done: float) -> bool:
        check()
        return True

    shadow = raster_shadow(scene, mask, stats, deadline, go_on)
    return shadow, caustic(scene, mask, stats, check) if photons else None


def _trace_strip(passes: Passes, mask: Float32 | None) -> tuple[Sampling, float]:
    """Take the samples of a strip and develop them; what to expect of them, and seconds after the last one.

    mask : of the whole window.
    """
    grid, image = passes.grid, passes.image
    assert image is not None
    weight = None if mask is None else mask.reshape(-1)[grid.window] * (grid.window >= 0)
    sampling, audit = take_samples(passes, weight)
    found = _fill_gaps(passes) if image.only_ray_traced and passes.settings.fill else np.zeros(0, np.intp)
    sampled = time.perf_counter()
    passes.develop()
    with passes.stats.phase("develop"):
        sampling |= sampling_error(passes, audit, weight)
        image.coverage[grid.window[found]] = 0
    return sampling, time.perf_counter() - sampled


def _fill_gaps(passes: Passes) -> Pixels:
    """Give every masked pixel a sample that counts: more camera rays, then only ray traced geometry.

    Returns the pixels (m,) that had none.
    """
    first, scene, pixel_buffer = passes.settings.samples, passes.scene, passes.pixel_buffer
    inside = passes.grid.inside()
    empty = without = inside[~pixel_buffer.seen(inside)]
    for why, seen in (
        ("found by more camera rays", scene.seen_by_camera),
        ("found behind what is not ray traced", scene.ray_traced_only),
    ):
        before, taken = len(empty), 0
        for count in FILL_SAMPLES:
            if len(empty) and len(seen):
                passes.run(empty, Pass(first + taken, count, seen, True), 1.0, passes.deadline)
                empty, taken = empty[~pixel_buffer.seen(empty)], taken + count
        passes.stats.skip("pixels without a sample", why, before - len(empty))
    return without


def _aovs(scene: CompiledScene, image: ResolvedImage, shape: tuple[int, int], stats: Stats) -> dict[str, Float32]:
    """`Film.passes`: those that are wanted, light passes among them; the others cost nothing."""
    wanted = scene.settings.passes
    found = {name: aov.reshape(shape if aov.shape[1] == 1 else (*shape, -1)) for name, aov in image.aovs.items()}
    if wanted & {"depth", "normal"}:
        found |= depth_and_normal(scene, np.flatnonzero(image.wanted), stats)
    if "samples" in wanted:
        found["samples"] = image.samples.reshape(shape)
    return {name: found[name] for name in sorted(wanted)}


# ------------------------------------------------------------------------------------------------ what was counted


def _times(stats: Stats, building: Stats, developing: float, passed: float) -> dict[str, dict[str, float]]:
    """`Film.time`. developing: seconds that passed after samples were taken. passed: in all, but for building."""
    cpu = sum(stats.cpu.values())
    built = {"wall": building.wall["build"], "cpu": building.cpu["build"]}
    return {
        "build": built,
        # Of these the seconds of all threads; of the next those that passed.
        **{phase: {"wall": stats.wall[phase], "cpu": stats.cpu[phase]} for phase in WORK},
        "develop": {"wall": developing, "cpu": stats.cpu["develop"]},
        "trace": {"wall": passed, "cpu": cpu},
        "total": {"wall": passed + built["wall"], "cpu": cpu + built["cpu"]},
    }


def _skipped(scene: CompiledScene, stats: Stats) -> list[dict[str, object]]:
    """`Film.skipped`, but for what the plan left out."""
    for what, why, number in (
        ("triangles", "degenerate or not finite", scene.geometry.dropped),
        ("triangles", "large ones next to small ray traced objects, split", scene.geometry.split),
        *((what, why, stats.counts[name]) for name, (what, why) in LEFT_OUT.items()),
    ):
        stats.skip(what, why, number)
    return [{"what": what, "why": why, "count": n} for (what, why), n in stats.skipped.items()]


def _saved(stats: Stats, mask: Float32 | None) -> dict[str, int]:
    """What prunings left out that only tracing can tell."""
    unmasked = 0 if mask is None else int(np.count_nonzero(mask == 0))
    return {
        **{pruning: stats.counts[name] for pruning, name in SAVED.items()},
        "empty-mask": unmasked, "unmasked": unmasked, "adaptive": stats.skipped["samples", EVEN],
    }  # fmt: skip
