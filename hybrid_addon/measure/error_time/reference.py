# SPDX-License-Identifier: GPL-3.0-or-later
"""What everything is compared with: a picture so deep that its own noise is small, and how small that is."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from ...presets import Quality
from ...scene import Film, Float64
from ...tracer import Cancelled
from ...tracer.core.constants import FIRST_SAMPLES
from . import metrics
from .budget import Until
from .metrics import Bools, Picture
from .regions import regions
from .renders import CUTOFFS, Axes, Renders

ENOUGH = 144
"""Samples of a good reference: noise falls at least with their root, so it is a third of that of 16 samples."""

SEEDS = (101, 202)
"""The reference's camera samples are none that a render uses, or a render would be compared with itself."""

UNSEEN = 0.01
"""Of the noise of few samples: an error that hundreds of them still hide."""

PILOT = 0.15
"""Of the time for the reference, what finding out its cost may take of it."""


TRIAL = 16
"""Of the samples that seem to fit one in so many tells how many do: the more at once, the less each costs."""


@dataclass(frozen=True)
class Pilot:
    """What the reference will cost: seconds for one sample, with this cutoff; finished: it was not only estimated."""

    cutoff: float
    each: float
    finished: bool


def pilot(renders: Renders, axes: Axes, until: float) -> Pilot:
    """Trace few samples. The looser cutoff is taken where the finer one would show nothing, and samples lack."""
    fine, loose = (replace(axes.exact, cutoff=cutoff) for cutoff in CUTOFFS)
    began = time.perf_counter()
    left = until - began
    watch = Until(np.inf if axes.patient else began + PILOT * left)
    try:
        film = renders.trace(loose, SEEDS[0], watch)
    except Cancelled:
        each = (time.perf_counter() - began) / max(watch.done, 0.01) / loose.samples
        return Pilot(loose.cutoff, each, False)
    cheap = Pilot(loose.cutoff, film.time["trace"]["wall"] / loose.samples, True)
    try:
        other = renders.trace(fine, SEEDS[0], watch)
        dear = Pilot(fine.cutoff, other.time["trace"]["wall"] / fine.samples, True)
        if dear.each * axes.reference_samples < left:
            return dear
        again = renders.trace(loose, SEEDS[1], watch)
    except Cancelled:
        return cheap
    region = renders.weight(film) > 0
    effect, noise = (metrics.error(renders.shown(f), renders.shown(film), region)["mae"] or 0.0 for f in (other, again))
    return cheap if effect < UNSEEN * noise else dear


@dataclass(eq=False)
class Reference:
    """The mean of two independent deep pictures, a and b.

    floor : how far it is itself from the truth, by region: the errors of a against it, |a - b| / 2 a pixel, whose RMSE
    is the standard error of the mean.
    films : a and b, as they were traced; halves: as they show in the composite, (h, w, 3).
    each : seconds for one sample of so deep a picture.
    """

    picture: Float64
    films: tuple[Film, Film]
    halves: tuple[Picture, Picture]
    regions: dict[str, Bools]
    floor: dict[str, dict[str, float | int | None]]
    quality: Quality
    seconds: float
    each: float

    def noise(self, region: str = "all") -> float:
        """The floor's RMSE of what is shown; 0 for an empty region."""
        return float(self.floor[region][metrics.SHOWN] or 0.0)


def reference(renders: Renders, axes: Axes, each: float, until: float = np.inf) -> Reference:
    """Twice half the samples that there is time for, one at least. each: seconds for one of them, about."""
    began = time.perf_counter()
    samples = axes.reference_samples

    def affordable(each: float) -> int:
        return int(min(axes.reference_samples, (until - time.perf_counter()) / max(each, 1e-9)))

    if not axes.patient:
        samples = affordable(each)
        some = samples // TRIAL
        if FIRST_SAMPLES < some and samples < axes.reference_samples:
            samples = affordable(renders.trace(axes.deep(some)).time["trace"]["wall"] / some)
    quality = axes.deep(max(1, samples // 2))
    films = (renders.trace(quality, SEEDS[0]), renders.trace(quality, SEEDS[1]))
    a, b = (renders.shown(film).astype(np.float64) for film in films)
    mean = (a + b) / 2
    found = regions(renders.ids, renders.weight(films[0]))
    floor = metrics.errors(a, mean, found)
    quality = replace(quality, samples=2 * quality.samples)
    seconds = time.perf_counter() - began
    return Reference(mean, films, (a, b), found, floor, quality, seconds, seconds / quality.samples)
