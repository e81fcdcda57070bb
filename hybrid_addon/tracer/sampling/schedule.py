# SPDX-License-Identifier: GPL-3.0-or-later
"""Which passes a picture takes: all samples at once, where they are needed, or as many as there is time for.

While somebody looks on at a long picture, it goes from coarse to fine, too, and has the same bits in the end.

Against a deadline the passes are short and go from coarse to fine: one sample of every 8th pixel across and up, then of
every 4th, of every 2nd, of all; then 2, 4, 8, ... samples. So what is given up for want of time is, in this order,
samples, then resolution. Bounces and the cutoff never are: a coarse picture is better than a black glass. Time that is
left but too short for a whole pass goes to the pixels that differ most from their neighbours. A picture that was in
time is the same, bit for bit, as one without a deadline.
"""

from __future__ import annotations

import math
import time

import numpy as np

from ...scene import Float32
from ..core.constants import COARSEST, FIRST_SAMPLES, SAMPLING_SLOPE
from ..core.vectors import evenly
from ..film.pixels import ESTIMATED, SEEN, neighbours_rmse
from ..parallel.pool import wanted_workers
from .adaptive import Audit, choose, looks, unsettled
from .passes import Pass, Passes
from .tiles import DEAREST_SHOW, Pixels

Sampling = dict[str, object]
"""What to expect of the samples: see `scene.Film.sampling`."""

END = 0.95
"""The fraction of the progress at which all samples are taken."""

IN_TIME, WORTH_IT = 0.8, 1 / 16
"""Of the samples that the time left should allow, those that are asked for where they show most, which is where they
take longest; and of all pixels how many these must be, to be worth looking for."""

EVEN = "their pixels are even (adaptive)"
"""Why samples are left out."""


def take_samples(passes: Passes, weight: Float32 | None) -> tuple[Sampling, Audit | None]:
    """Take the samples of a strip, and note what was left out.

    Against a deadline each pass is as long as all before it or as the time allows.

    weight : (n,) share of the picture that is each pixel's; None: 1.
    Returns how many samples were taken, and the pixels that check adaptive sampling.
    """
    # The first sample, against a deadline; adaptive sampling looks at the pixels now and then.
    samples, pixel_buffer, taken, in_time = passes.settings.samples, passes.pixel_buffer, 0, True
    pixels: Pixels = np.arange(len(passes.grid))
    stops = looks(samples) if passes.adaptive else []
    audit = Audit(pixel_buffer, passes.settings.seed) if passes.adaptive else None
    if passes.hurries:
        taken, in_time = 1, _coarse_to_fine(passes, pixels)
    elif passes.grows:
        taken = _coarse_first(passes, pixels)

    # As many passes as it takes, or as there is time for.
    while in_time and taken < samples and len(pixels):
        if audit is not None and taken in stops:
            pixels = _go_on(passes, pixels, taken, weight, audit)
            if len(pixels) == 0:
                break
        count = next((stop for stop in stops if stop > taken), samples) - taken
        if passes.hurries:
            count = min(count, taken, _affordable(passes) // len(pixels))
        if passes.overhead and _is_long(passes, len(pixels) * count) and count >= 3 * taken:
            count = taken  # what follows is as long again: errors are estimated from halves of the samples
        if count == 0:
            _where_it_shows(passes, pixels, taken, weight)
            break
        total = int(pixel_buffer.samples.sum(dtype=np.int64)) + len(pixels) * (samples - taken)
        in_time = _pass(passes, pixels, taken, count, total)
        taken += count

    # What was given up for want of time.
    if passes.hurries:
        taken_of = pixel_buffer.samples[pixels]
        passes.stats.skip("samples", "the time budget: samples go first", int((samples - taken_of).sum()))
        copied = int((taken_of == 0).sum())
        why = "the time budget: when no samples are left to give up, pixels go"
        passes.stats.skip("resolution", why, copied)
    taken_of = pixel_buffer.samples[passes.grid.window >= 0]
    mean = float(taken_of.mean()) if len(taken_of) else 0.0
    return {"samples_mean": mean, "samples_max": int(np.max(taken_of, initial=0))}, audit


def _coarse_to_fine(passes: Passes, everything: Pixels) -> bool:
    """The first sample of all pixels. Of the coarsest raster that meets any it is taken whatever the time."""
    step, coarser = COARSEST, np.zeros(len(everything), bool)
    x, y = passes.grid.at(everything)
    deadline = math.inf
    while step >= 1:
        met = (x % step == 0) & (y % step == 0)
        pixels = everything[met & ~coarser]
        if len(pixels):
            if not _pass(passes, pixels, 0, 1, len(everything) * passes.settings.samples, deadline):
                return False
            deadline = passes.deadline
        coarser, step = met, step // 2
    return True


def _coarse_first(passes: Passes, everything: Pixels) -> int:
    """The first samples of all pixels, those of a coarse raster before the others; how many of each."""
    count, (x, y) = min(FIRST_SAMPLES, passes.settings.samples), passes.grid.at(everything)
    total, coarse = len(everything) * passes.settings.samples, (x % COARSEST == 0) & (y % COARSEST == 0)
    began = time.perf_counter()
    _pass(passes, everything[coarse], 0, count, total)
    passes.overhead = time.perf_counter() - began
    _pass(passes, everything[~coarse], 0, count, total)
    return count


def _is_long(passes: Passes, rays: int) -> bool:
    """Whether so many camera rays take so long that showing half of them first costs little."""
    return rays * DEAREST_SHOW > passes.overhead * passes.speed * wanted_workers(passes.settings)


def _pass(passes: Passes, pixels: Pixels, first: int, count: int, total: int, deadline: float | None = None) -> bool:
    """Take more samples of some pixels; whether there was time for all.

    total : samples of all pixels, those that are taken included, if no pixel has enough before it has all.
    """
    samples, signed = passes.settings.samples, passes.adaptive and first < FIRST_SAMPLES
    work = Pass(first, count, passes.scene.seen_by_camera, samples > 1, signed)
    # Progress is the time that has passed, if it is limited; else the share of the samples.
    done = int(passes.pixel_buffer.samples.sum(dtype=np.int64)) + len(pixels) * count
    until = max(END * min(done / max(total, 1), 1.0), passes.fraction)
    if passes.hurries:
        until = min((time.perf_counter() - passes.began) / max(passes.deadline - passes.began, 1e-9), END)
    return passes.run(pixels, work, until, passes.deadline if deadline is None else deadline)


def _affordable(passes: Passes) -> int:
    """How many samples the time that is left should allow, by what they cost so far."""
    now, taken = time.perf_counter(), int(passes.pixel_buffer.samples.sum())
    each = (now - passes.began) / max(taken, 1)
    left = max(passes.deadline - now, 0.0)
    return int(min(left / max(each, 1e-9), passes.settings.samples * len(passes.grid)))


def _where_it_shows(passes: Passes, pixels: Pixels, taken: int, weight: Float32 | None) -> None:
    """One sample more, for which there is no time in all pixels, in those that differ most from a neighbour."""
    number = int(IN_TIME * _affordable(passes))
    if len(pixels) * WORTH_IT < number < len(pixels):
        differs = passes.pixel_buffer.beside_neighbours(weight)[pixels]
        _pass(passes, np.sort(pixels[np.argpartition(differs, -number)[-number:]]), taken, 1, 0)


def _go_on(passes: Passes, pixels: Pixels, taken: int, weight: Float32 | None, audit: Audit) -> Pixels:
    """The pixels that take more samples: those that need them, and some of the others as a check."""
    needs = choose if taken == FIRST_SAMPLES else unsettled
    needed = needs(passes.pixel_buffer, pixels, weight, passes.settings.adaptive)
    needed |= audit.going_on[pixels]
    kept = audit.keep(passes.pixel_buffer, pixels[~needed])
    left = np.union1d(pixels[needed], kept)
    passes.stats.skip("samples", EVEN, (len(pixels) - len(left)) * (passes.settings.samples - taken))
    return left


def sampling_error(passes: Passes, audit: Audit | None, weight: Float32 | None) -> Sampling:
    """The error to expect of the samples of a strip, over the traced pixels and as they show: see `take_samples`."""
    pixel_buffer, found = passes.pixel_buffer, Sampling()
    if audit is not None and audit.left_alone:
        found["audit"] = audit.result(pixel_buffer, passes.settings.adaptive)
    pixels = evenly(passes.grid.window >= 0, ESTIMATED)
    variance = pixel_buffer.variance_of_mean(pixels)
    if weight is not None:
        variance *= weight[pixels] ** 2
    known = variance[np.isfinite(variance)]
    square, share = float(known.sum(dtype=np.float64)) / max(len(known), 1), len(known) / max(len(variance), 1)
    others = _rmse_from_neighbours(passes, weight) if share < 1 else 0.0
    # Of one sample each, with a few pixels that got more because none counted, these few say little of the rest.
    both = share * square + (1 - share) * (others or 0.0) ** 2
    unknown = (others is None and share == 0) or not math.isfinite(both)
    return found | {"rmse": None if unknown else math.sqrt(both), "slope": SAMPLING_SLOPE}


def _rmse_from_neighbours(passes: Passes, weight: Float32 | None) -> float | None:
    """Of one sample a pixel, or less."""
    if len(passes.grid) == 0:
        return None
    traced = passes.pixel_buffer.given[0, SEEN] > 0
    return neighbours_rmse(passes.pixel_buffer.mean, passes.grid, traced, weight)
