# SPDX-License-Identifier: GPL-3.0-or-later
"""The shadows that ray traced objects cast on everything else: what the rasteriser's picture of that has to lose.

The rasteriser draws without them. So what it draws is traced twice, once as it is and once with these shadows, and the
quotient of the two pictures is what they leave over: exactly 1 where both agree. Whatever the tracer does for local
shading holds here too: coloured shadows through glass, lights with a size, light of the world, which nothing takes
away, and points that are in another object's shadow already. Both pictures take the same samples, so the quotient has
less noise than either.
"""

from __future__ import annotations

import math
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64
from ..core.constants import REACH_MARGIN
from ..core.stats import Stats
from ..core.vectors import dot
from ..emitters.light import CompiledLight
from ..film.denoised import denoised_shadow
from ..film.filter import grow, reach_of_centres
from ..parallel.pool import workers
from ..prepare.compiled import CompiledScene
from ..sampling.passes import Pass, Passes, Progress
from ..sampling.strips import strips_of
from ..sampling.tiles import Pixels
from .caster_bounds import BoundingBalls, find_caster_bounds

Bools = NDArray[np.bool_]

CHUNK = 1 << 16
"""Pixels that are looked at at once."""

BUDGET_SHARE = 0.5
"""Against a deadline the shadows on the raster take no more samples after this share of the time."""


def raster_shadow(
    scene: CompiledScene, mask: Float32 | None, stats: Stats, deadline: float, report: Progress
) -> Float32:
    """`Film.shadow` (h, w, 3): light with the shadows of ray traced objects over light without; 1 within the mask.

    mask   : (h, w) coverage of the ray traced objects; None: unknown.
    report : called now and then; may raise to stop.
    """
    x0, y0, x1, y1 = scene.camera.window
    n = (x1 - x0) * (y1 - y0)
    # Which pixels a shadow may reach.
    pixels = np.arange(n) if mask is None else np.flatnonzero(np.asarray(mask).reshape(-1) < 1)
    views = [scene.raster_view(shadowed) for shadowed in (True, False)]
    pixels = _concerned(views[0], pixels, stats)
    result = np.ones((n, 3), np.float32)
    # Trace them with these shadows and without, strip by strip.
    if len(pixels):
        wanted = np.zeros(n, bool)
        wanted[pixels] = True
        rows, found, now = wanted.reshape(y1 - y0, x1 - x0), [], time.perf_counter()
        enough = now + BUDGET_SHARE * (deadline - now)
        for strip in strips_of(x1 - x0, y1 - y0, rows):
            until = strip.deadline(enough, time.perf_counter())
            found.append(_trace(views, scene, rows, strip.rows, stats, until, report))
        means = [np.concatenate(of_view, axis=1) for of_view in zip(*found, strict=True)]
        # What the shadows leave over.
        result[pixels] = _left_over(*means[:2]).T
        if scene.settings.denoise and scene.plan.soft_shadows:
            own = np.ones((n, 3), np.float32)
            own[pixels] = _left_over(*means[2:]).T
            shape, threads = (y1 - y0, x1 - x0, 3), scene.settings.threads

            def check() -> None:
                report(0.0)

            result = denoised_shadow(result.reshape(shape), own.reshape(shape), rows, threads, check)
    return result.reshape(y1 - y0, x1 - x0, 3)


def _left_over(shadowed: Float32, plain: Float32) -> Float32:
    """The share (3, m) that shadows leave over of light (3, m): exactly 1 where they take nothing, or there is none."""
    with np.errstate(all="ignore"):
        share = np.where(shadowed == plain, np.float32(1), shadowed / plain)
    return np.where(np.isfinite(share), share, np.float32(1))


def _trace(
    views: list[CompiledScene],
    scene: CompiledScene,
    wanted: Bools,
    rows: slice,
    stats: Stats,
    deadline: float,
    report: Progress,
) -> list[Float32]:
    """Radiance (3, m) of the wanted pixels (h, w) of some rows in both views, with the same samples: all that there is
    time for. And that of the pixels' own samples alone, if that is to be denoised."""
    samples = scene.settings.samples
    both = [Passes(view, report, wanted, rows) for view in views]
    pixels = np.arange(len(both[0].grid))
    taken, count = 0, samples if deadline == math.inf else 1
    with both[0], both[1]:
        while taken < samples:
            for number, passes in enumerate(both):
                # Samples that see a ray traced object do not count: the raster shows none there.
                work = Pass(taken, count, scene.seen_by_camera, samples > 1)
                passes.run(pixels, work, (taken + count * (number + 1) / 2) / samples)
            taken += count
            count = min(taken, samples - taken)
            if time.perf_counter() > deadline:
                break
    for passes in both:
        stats.merge(passes.stats)
    inside = both[0].grid.inside()
    means = [passes.pixel_buffer.mean(inside) for passes in both]
    return [*means, *(passes.pixel_buffer.own_mean(inside) for passes in both if scene.settings.denoise)]


# ------------------------------------------------------------------------------------------------ which pixels


def _concerned(view: CompiledScene, pixels: Pixels, stats: Stats) -> Pixels:
    """The pixels (m,) on which a shadow may lie: those whose centre shows a place that one can reach, and around them.

    Places that are told by balls around the casters; a filter's radius around them, for the samples of a pixel are
    spread. What mirrors or lets through shows other places, and always counts.
    """
    if view.camera.lens is not None:
        return pixels  # out of focus a pixel shows places from far around its centre
    x0, y0, x1, y1 = view.camera.window
    caster_bounds = find_caster_bounds(view)
    reached = np.zeros((y1 - y0) * (x1 - x0), bool)

    def look(start: int) -> tuple[Pixels, Stats]:
        chunk = pixels[start : start + CHUNK]
        counted = Stats()
        with np.errstate(all="ignore"):
            return chunk[_may_be_shadowed(view, chunk, caster_bounds, counted)], counted

    with ThreadPoolExecutor(workers(view.settings)) as pool:
        for found, counted in pool.map(look, range(0, len(pixels), CHUNK)):
            reached[found] = True
            stats.merge(counted)
    around = reach_of_centres(view.settings.filter_radius) if view.settings.samples > 1 else 0
    grown = grow(reached.reshape(y1 - y0, x1 - x0), around).reshape(-1)
    return pixels[grown[pixels]]


def _may_be_shadowed(view: CompiledScene, chunk: Pixels, caster_bounds: list[BoundingBalls], stats: Stats) -> Bools:
    """Which pixels (m,) show, at their centres, places where a shadow may lie."""
    table = view.surfaces
    rays, hits = view.shown(chunk, stats)
    surface = view.geometry.surface.take(hits.prim)
    point = rays.origin + rays.direction * hits.t
    found = table.reflects.take(surface) | table.transmits.take(surface)
    for light in view.lights:
        if light.light.cast_shadow:
            for group in caster_bounds:
                found |= ball_between(light, point, group.center, group.radius)
    result = np.zeros(len(chunk), bool)
    result[rays.sample] = found
    return result


def ball_between(light: CompiledLight, point: Float64, center: Float64, radius: float) -> Bools:
    """Whether a ball may lie between points (3, n) and any point of a light; in doubt it does."""
    place = light.position.astype(np.float64)
    toward = light.toward(point)
    away = center[:, None] - point
    margin = REACH_MARGIN * (np.abs(point).max(axis=0) + np.abs(place).max() + np.abs(center).max())
    # Nearest to the ball's centre on the way to the light's centre; any other way leaves that one by `spread` at most.
    t = np.maximum(dot(away, toward) / np.maximum(dot(toward, toward) + np.zeros_like(away[0]), 1e-300), 0.0)
    spread = light.half_size(toward)
    if light.is_infinite:
        spread = spread * (t + radius)
    else:
        t = np.minimum(t, 1.0)
    gap = away - toward * t
    return np.asarray(dot(gap, gap) <= (radius + spread + margin) ** 2)
