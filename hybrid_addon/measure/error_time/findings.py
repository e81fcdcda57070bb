# SPDX-License-Identifier: GPL-3.0-or-later
"""What the measured points say: slopes, the front, the presets on it or behind it; and why, where they say nothing."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from statistics import median
from typing import Any

from ...presets import QUALITY
from ...tracer.core.constants import SAMPLING_SLOPE
from . import fits, metrics
from .metrics import CLEAR, LEAST, SHOWN
from .reference import ENOUGH, Reference
from .renders import CUTOFFS, Axes
from .sweep import Point, describe

METRICS = (SHOWN, "flip_ldr")
"""By which presets are judged."""

FEW = 30.0
"""Pixels: RMSE says little, it is not known to a tenth, where it is decided by fewer."""


def slopes(points: Sequence[Point], deep: Reference, single: dict[str, Any], axes: Axes) -> dict[str, fits.Slope]:
    """How the error falls with each knob, beside what is expected of it; where it cannot be told, why.

    aa_*: exponent of RMSE over samples; stratified samples of edges have -0.75 (Mitchell 1996). Points that the
    reference's noise hides are left out. depth: decades a bounce; expected is the residual's own, which the error must
    not fall slower than. cutoff: exponent of RMSE over cutoff; its bound is a straight line, exponent 1.
    """
    alone = [p for p in points if p.quality == axes.deep(p.quality.samples)]
    found = {}
    for region in deep.floor:
        clear = [p for p in alone if metrics.tells(p.error[region])]
        samples, errors = [p.quality.samples for p in clear], [p.error[region][SHOWN] for p in clear]
        why = "no pixel is there" if not deep.regions[region].any() else (
            f"{len(clear)} of {len(alone)} points stand clear of the reference's noise, two are needed"
        )  # fmt: skip
        found[f"aa_{region}"] = _fitted(fits.power(samples, errors, SAMPLING_SLOPE), SAMPLING_SLOPE, why)
    entries, why = single["entries"], "fewer than two numbers of bounces were measured that cut anything off"
    deeper = [e for e in entries if e["cutoff"] == CUTOFFS[0]]
    residual = fits.decay([e["max_depth"] for e in deeper], [e["residual_mean"] for e in deeper])
    bounces, errors = [e["max_depth"] for e in deeper], [e["rmse"] for e in deeper]
    bound = residual.fit if residual else None
    found["depth"] = _fitted(fits.decay(bounces, errors, bound), bound, why)
    cut, why = [e for e in entries if e["max_depth"] == axes.deepest], "fewer than two cutoffs that cut anything off"
    exponent = fits.power([e["cutoff"] for e in cut], [e["rmse"] for e in cut], 1.0)
    found["cutoff"] = _fitted(exponent, 1.0, why)
    return found


def _fitted(slope: fits.Slope | None, expected: float | None, why: str) -> fits.Slope:
    return slope or fits.Slope(None, None, expected, why)


def front(points: Sequence[Point], time: Sequence[float]) -> list[int]:
    """The points that stand clear of the noise and that no point clearly beats (`fits.beaten_by`), by time."""
    errors, against = [p.shown for p in points], _against(points, SHOWN)
    found = [i for i, p in enumerate(points) if p.clear and fits.beaten_by(i, time, errors, against) is None]
    return sorted(found, key=lambda i: time[i])


def _against(points: Sequence[Point], metric: str) -> Callable[[int, int], tuple[float, float] | None]:
    """For `fits.beaten_by`: by the runs that both points have had, which had the same samples. None without blocks.

    Errors of one point at different samples can differ more than those of two points: a few highlights decide.
    """
    power = 0.5 if metric == SHOWN else 1.0  # SHOWN is the root of what was summed

    def against(j: int, i: int) -> tuple[float, float] | None:
        theirs, ours = (points[k].blocks.get(metric, []) for k in (j, i))
        laps = min(len(theirs), len(ours))
        if not laps:
            return None
        a, b = sum(theirs[1:laps], theirs[0]), sum(ours[1:laps], ours[0])
        ratio = max(float(a.sum()), 0.0) / float(b.sum()) if b.sum() > 0 else math.inf
        return ratio**power, power * metrics.doubt(a, b)

    return against


def no_front(found: Sequence[int], points: Sequence[Point], deep: Reference) -> str:
    """Why a front that was found has no point; empty if it has."""
    if found:
        return ""
    if any(p.clear for p in points):
        return "each point whose error can be told is beaten by one whose error is within the reference's noise"
    return f"no error can be told from none: the noise of the reference is {deep.noise():.2g}"


def presets(points: Sequence[Point], time: Sequence[float], deep: Reference) -> list[dict[str, Any]]:
    """Of each preset: its point, or None, and by each of METRICS what beats it, or None, and the verdict in words."""
    names = [p.preset for p in points]
    found: list[dict[str, Any]] = []
    for label, _, _ in QUALITY.values():
        i = names.index(label) if label in names else None
        by = {metric: {"beaten_by": None, "verdict": "not measured: there was no time"} for metric in METRICS}
        if i is not None:
            for metric in METRICS:
                errors = [p.error["all"][metric] for p in points]
                least = points[i].error["all"][LEAST] if metric == SHOWN else CLEAR * (deep.floor["all"][metric] or 0.0)
                by[metric] = _verdict(i, time, errors, least or 0.0, _against(points, metric))
        found.append({"preset": label, "point": i, "by": by})
    return found


def _verdict(
    i: int,
    time: Sequence[float],
    error: Sequence[float | None],
    noise: float,
    against: Callable[[int, int], tuple[float, float] | None],
) -> dict[str, Any]:
    """Whether point i is on the front, if its error stands clear of the noise."""
    own, known = error[i], [math.inf if e is None else e for e in error]
    if own is None:
        return {"beaten_by": None, "verdict": "not told: there is no such error"}
    if own <= noise:
        return {"beaten_by": None, "verdict": "not told: its error is within the reference's noise"}
    by = fits.beaten_by(i, time, known, against)
    if by is None:
        return {"beaten_by": None, "verdict": "on the front"}
    times = (against(by, i) or (known[by] / own, 0.0))[0]
    verdict = f"behind the front: another takes {time[by] / time[i]:.2f} of its time and has {times:.2f} of "
    return {"beaten_by": by, "verdict": verdict + "its error"}


def equal_errors(theirs: Mapping[str, Any], points: Sequence[Point], base: float) -> list[dict[str, Any]]:
    """For each of Cycles' errors our time to the same; where it cannot be told, why. base: seconds before we trace."""
    clear = [p for p in points if p.clear]
    times, errors = [base + p.seconds() for p in clear], [p.shown for p in clear]
    found = []
    for point in theirs.get("points", []):
        error, wall, ours, why = point["error"]["all"][SHOWN], point["time"]["wall"], None, ""
        if not metrics.tells(point["error"]["all"]):
            why = "its error is within its own reference's noise"
        else:
            ours = fits.time_to(error, times, errors)
            why = "" if ours else "none of our points that stand clear of our reference's noise is as exact"
        ratio = wall / ours if ours else None
        found.append({"samples": point["samples"], SHOWN: error, "cycles": wall, "ours": ours, "ratio": ratio,
                      "why": why})  # fmt: skip
    return found


def reservations(points: Sequence[Point], deep: Reference, single: Mapping[str, Any]) -> list[str]:
    """What must be known to read the errors: a noisy reference, highlights that decide, checks that failed."""
    found = []
    lost, of = sum(not p.clear for p in points), len(points)
    if lost:
        few = f", it has {deep.quality.samples} samples only" if deep.quality.samples < ENOUGH else ""
        found.append(f"the reference is too noisy for {lost} of {of} points (RMSE {deep.noise():.2g}{few}): they are "
                     "drawn hollow and make no front, slope or comparison")  # fmt: skip
    pixels = median([p.deciding for p in points if p.deciding] or [FEW])
    if pixels < FEW:
        found.append(f"few pixels decide the RMSE, though all of white and above count as white: about "
                     f"{max(1, round(pixels))} (median of all points). It may be much else with other samples; read "
                     "FLIP, too")  # fmt: skip
    beyond = [e for e in single["entries"] if e["beyond"]]
    if beyond:
        worst = max(beyond, key=lambda e: e["beyond"])
        found.append(f"the bound did not hold: in {worst['beyond']} pixels the error at {worst['max_depth']} bounces, "
                     f"cutoff {worst['cutoff']:.2g}, is larger than residual x {single['Lmax']:.3g}, in "
                     f"{len(beyond)} settings; something brighter was not seen")  # fmt: skip
    failed = [f"{name.replace('_', ' ')} {check['value']}" for name, check in invariants(points).items()
              if not check["pass"]]  # fmt: skip
    if failed:
        found.append("counters that must be 0 are not: " + ", ".join(failed))
    return found


def invariants(points: Sequence[Point]) -> dict[str, dict[str, Any]]:
    """Of each counter that must be 0: the most that any point had, and whether that passes."""
    names = dict.fromkeys(name for p in points for name in p.invariants)
    most = {name: max(p.invariants.get(name, 0) for p in points) for name in names}
    return {name: {"value": value, "tol": 0, "pass": value == 0} for name, value in most.items()}


def too_late(points: Sequence[Point]) -> list[dict[str, str]]:
    """Points that there was no time for, as what was left out."""
    return [{"what": p.preset or describe(p.quality), "why": "there was no time for it"} for p in points]
