# SPDX-License-Identifier: GPL-3.0-or-later
"""Error against run time of one scene: the same picture at many settings, against a deep reference of our own.

Each knob alone, the others at the reference's level and with the same camera samples, so that its error is its own;
then the combinations that can be worth their time, one after the other and round again, so that a slow minute of the
machine hits all of them. All goes from cheap to dear, and ends when its time does.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from statistics import median
from typing import Any

import numpy as np

from ...presets import QUALITY, Quality
from ...scene import Film, Float32, Float64
from ...tracer import Cancelled
from ...tracer.core.constants import FIRST_SAMPLES
from . import fits, metrics
from .budget import Until
from .reference import Reference
from .renders import CUTOFFS, Axes, Renders

Say = Callable[[str], None]

PATIENCE = 5.0
"""Seconds; what takes longer is timed once."""

FIRST_LAP = 0.7
"""Of the time for the combinations, what the first round may take: the others make the times surer."""

HIDDEN = 0.1
"""Of the reference's noise: an error so small changes none, though few pixels make most of the noise."""

HOPELESS = 2.0
"""What is expected to take so many times the time that is left is not begun."""

PRESET_SHARE = 0.4
"""Of the first round: a preset that is expected to take no more is measured before all that is not a preset."""


@dataclass
class Point:
    """One combination: its times, its errors by region, and what was cut off.

    error : SHOWN and FLIP are those of all runs, each with samples of its own; the others are those of the first.
    clear : its error can be told from none.   deciding : how many pixels decide the RMSE of the first run.
    maps : the errors of single pixels, mean of all runs.   blocks : of each run, sums of those over masked pixels.
    film : of presets, for the page.
    """

    quality: Quality
    preset: str = ""
    times: list[dict[str, Any]] = field(default_factory=list)
    error: dict[str, dict[str, Any]] = field(default_factory=dict)
    bound: dict[str, float] = field(default_factory=dict)
    rays: dict[str, int] = field(default_factory=dict)
    sampling: dict[str, Any] = field(default_factory=dict)
    invariants: dict[str, int] = field(default_factory=dict)
    clear: bool = False
    deciding: float = 0.0
    maps: dict[str, Float64] = field(default_factory=dict)
    blocks: dict[str, list[Float64]] = field(default_factory=dict)
    film: Film | None = None

    @property
    def shown(self) -> float:
        """RMSE of what is shown, over all masked pixels."""
        value = self.error["all"][metrics.SHOWN]
        return float("nan") if value is None else float(value)

    def seconds(self, phase: str = "trace", clock: str = "wall") -> float:
        """Median of a phase."""
        result: float = median(times[phase][clock] for times in self.times)
        return result

    def as_dict(self, base: float) -> dict[str, Any]:
        """For JSON. base: seconds that every render spends before it traces."""
        time = {
            phase: {
                "wall_med": self.seconds(phase),
                "wall_min": min(times[phase]["wall"] for times in self.times),
                "cpu_med": self.seconds(phase, "cpu"),
                "n": len(self.times),
            }
            for phase in self.times[0]
        }
        return {
            "settings": self.quality.values(), "preset": self.preset, "seconds": base + self.seconds(), "time": time,
            "clear": self.clear, "deciding": self.deciding, "rays": self.rays, "error": self.error, "bound": self.bound,
            "sampling": self.sampling, "invariants": self.invariants,
        }  # fmt: skip


# ------------------------------------------------------------------------------------------------ one knob alone


def knobs(renders: Renders, axes: Axes, deep: Reference, say: Say, until: float = math.inf) -> dict[str, Any]:
    """Error of bounces and cutoff, alone and together, against the same camera samples without them.

    Each entry: settings, seconds, rmse and rmse_shown over all pixels, residual_mean and residual_max, and `beyond`:
    pixels whose error is larger than `Lmax` x the residuals of both pictures, for what they are compared with is cut,
    too. `left_out`: how many entries there was no time for, the dearest.
    """
    exact, region = axes.exact, deep.regions["all"]
    both = product((CUTOFFS[0], *axes.cutoff), (*axes.max_depth, axes.deepest))
    pairs = sorted(dict.fromkeys(both), key=lambda pair: (pair[1], -pair[0]))  # from cheap to dear
    found: dict[str, Any] = {"samples": exact.samples, "Lmax": 0.0, "entries": [], "left_out": len(pairs)}
    try:
        whole = renders.trace(exact, progress=Until(until))
    except Cancelled:
        return {**found, "why": "a picture with nothing cut off took too long"}
    target, brightest = renders.shown(whole), renders.brightest((whole, *deep.films))
    own = whole.residual * renders.weight(whole)
    rounding = 1e-6 * brightest
    for cutoff, max_depth in pairs:
        say(f"bounces {max_depth}, cutoff {cutoff:.2g}")
        try:
            film = renders.trace(replace(exact, max_depth=max_depth, cutoff=cutoff), progress=Until(until))
        except Cancelled:
            break
        bound = film.residual * renders.weight(film)
        off = np.abs(renders.shown(film).astype(np.float64) - target).max(axis=-1)
        allowed = (bound + own)[region] * brightest + rounding
        error = metrics.error(renders.shown(film), target, region)
        error |= metrics.judged({metrics.SHOWN: metrics.squares(renders.shown(film), target)}, region)
        found["entries"].append({
            "max_depth": max_depth, "cutoff": cutoff, "seconds": film.time["trace"]["wall"],
            "rmse": error["rmse"], metrics.SHOWN: error[metrics.SHOWN],
            "residual_mean": _mean(bound[region]), "residual_max": float(np.max(bound[region], initial=0.0)),
            "beyond": int(np.count_nonzero(off[region] > allowed)),
        })  # fmt: skip
    left_out = len(pairs) - len(found["entries"])
    return {**found, "Lmax": brightest, "left_out": left_out, "why": "there was no time" if left_out else ""}


def promising(entries: Sequence[dict[str, Any]], noise: float = 0.0, at_most: int = 4) -> list[tuple[int, float]]:
    """The (max_depth, cutoff) that no other beats, evenly chosen from the cheapest to the most exact.

    noise : of the reference, RMSE: of those that err much less only the cheapest can be worth its time.
    """
    least = HIDDEN * noise
    entries = list({max(e[metrics.SHOWN], least): e for e in reversed(entries)}.values())  # of equal ones the cheapest
    front = fits.pareto([e["seconds"] for e in entries], [e[metrics.SHOWN] for e in entries])
    chosen = np.unique(np.linspace(0, len(front) - 1, min(at_most, len(front))).round().astype(int))
    return [(entries[front[i]]["max_depth"], entries[front[i]]["cutoff"]) for i in chosen]


# ------------------------------------------------------------------------------------------------ combinations


def combinations(axes: Axes, pairs: Iterable[tuple[int, float]]) -> list[Point]:
    """What to time: samples alone with nothing cut, the promising combinations, and the presets; each once."""
    qualities = [axes.deep(samples) for samples in axes.samples]
    for (max_depth, cutoff), samples, adaptive in product(pairs, axes.samples, axes.adaptive):
        if adaptive == 0 or samples > FIRST_SAMPLES:
            qualities.append(Quality(samples, max_depth, cutoff, adaptive))
    named = {quality: label for label, _, quality in QUALITY.values()}
    return [Point(quality, named.get(quality, "")) for quality in dict.fromkeys([*qualities, *named])]


def expected(point: Point, single: dict[str, Any], deep: Reference) -> float:
    """Seconds to trace it, as far as what `knobs` found tells; what adaptive sampling saves is not known."""
    q = point.quality
    more = [e["seconds"] for e in single["entries"] if e["max_depth"] >= q.max_depth and e["cutoff"] <= q.cutoff]
    return float(q.samples * min([*(s / single["samples"] for s in more), deep.each]))


def measure(
    renders: Renders,
    points: Sequence[Point],
    deep: Reference,
    repeats: int,
    say: Say,
    until: float = math.inf,
    cost: Callable[[Point], float] = lambda point: 0.0,
) -> tuple[list[Point], list[Point]]:
    """Fill in points, presets first and then by their cost in seconds, `repeats` times in turn, until it is too late.

    Returns the points that were measured at least once, and the others.
    """
    began = time.perf_counter()
    end = began + FIRST_LAP * (until - began)
    order = sorted(points, key=lambda p: (not p.preset or cost(p) > PRESET_SHARE * (end - began), cost(p)))
    for number, point in enumerate(order, 1):
        if cost(point) >= HOPELESS * (end - time.perf_counter()):
            continue
        try:
            film = renders.trace(point.quality, progress=Until(end))
        except Cancelled:
            continue
        _judge(renders, point, film, deep)
        seconds = film.time["trace"]["wall"]
        say(f"{number}/{len(order)} {describe(point.quality)}: {seconds:.2f} s, RMSE {point.shown:.2g}")
    measured, late = [p for p in order if p.times], [p for p in order if not p.times]
    for lap in range(1, repeats):
        for point in measured:
            if point.times[0]["trace"]["wall"] < min(PATIENCE, until - time.perf_counter()):
                _judge(renders, point, renders.trace(point.quality, lap), deep)
    return measured, late


def describe(q: Quality) -> str:
    """In words."""
    rough = "" if q.rough_samples == 1 else f", rough {q.rough_samples}"
    return f"samples {q.samples}, bounces {q.max_depth}, cutoff {q.cutoff:.2g}, adaptive {q.adaptive:g}{rough}"


def _judge(renders: Renders, point: Point, film: Film, deep: Reference) -> None:
    picture, region, n = renders.shown(film), deep.regions["all"], len(point.times)
    maps = metrics.maps(picture, deep.picture, deep.halves)
    point.maps = {name: (n * point.maps[name] + more) / (n + 1) if n else more for name, more in maps.items()}
    for name, more in maps.items():
        point.blocks.setdefault(name, []).append(metrics.in_blocks(np.where(region, more, 0.0)))
    point.times.append(film.time)
    if n == 0:
        point.error = {name: metrics.error(picture, deep.picture, part) for name, part in deep.regions.items()}
        _first(renders, point, film, deep)
    for name, part in deep.regions.items():
        point.error[name] |= metrics.judged(point.maps, part)
    point.clear = metrics.tells(point.error["all"])


def _first(renders: Renders, point: Point, film: Film, deep: Reference) -> None:
    """What is noted of the first run alone."""
    region = deep.regions["all"]
    point.deciding = metrics.deciding(renders.shown(film), deep.picture, region)
    bound = (film.residual * renders.weight(film))[region]
    point.bound = {"residual_mean": _mean(bound), "residual_max": float(np.max(bound, initial=0.0))}
    point.rays, point.sampling, point.invariants = dict(film.rays), dict(film.sampling), dict(film.invariants)
    if point.preset:
        point.film = film


def _mean(values: Float32) -> float:
    return float(values.mean(dtype=np.float64)) if values.size else 0.0
