# SPDX-License-Identifier: GPL-3.0-or-later
"""`hybrid report`: Cycles beside the ray tracer. How its picture differs from ours, and what its own errors cost."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ...measure.error_time import metrics
from ...measure.error_time.reference import SEEDS, Reference
from ...measure.error_time.renders import Axes, Renders
from ...measure.error_time.sweep import Say
from ...scene import Float64
from ..errors import HybridError
from . import cycles

TRIAL = 16
"""Samples that tell what one costs."""

DEEP, PHYSICAL = 0.6, 0.2
"""Of the time, what Cycles' reference may take, and ours with lights as Cycles has them, if that must be traced."""


def against_cycles(
    scene: bpy.types.Scene,
    renders: Renders,
    physical: Callable[[], Renders] | None,
    deep: Reference,
    axes: Axes,
    samples: Sequence[int],
    say: Say,
    until: float,
) -> dict[str, Any]:
    """Cycles at several sample counts against its own reference, and our reference against that, by region.

    physical : the same with lights that never end, as Cycles' do; None: so they are.   until : on time.perf_counter's
    clock; what does not fit is in `left_out`. {"why"} alone where nothing was measured.
    """
    if not samples:
        return {"why": "Cycles was not asked for."}
    ours = deep.picture
    if physical is not None:
        say("our reference with physical lights, to compare with Cycles")
        ours = _deep(physical(), deep, axes, PHYSICAL * (until - time.perf_counter()))
    try:
        cycles.whitted_subset(scene, renders.scene, axes.deepest)
    except HybridError as error:
        return {"why": f"Not measured: {error}."}
    weight = renders.weight(deep.films[0])[..., None].astype(np.float64)
    cycles.limit(scene, _box(deep.regions["all"]), (weight.shape[1], weight.shape[0]))
    cycles.draw(scene, 1, 0)  # warm
    each = max(1e-6, cycles.draw(scene, TRIAL, 0)[1]["wall"] / TRIAL)
    half = 2 * axes.reference_samples  # its samples are not shared between pixels
    if not axes.patient:
        half = max(TRIAL, min(half, int(DEEP * (until - time.perf_counter()) / 2 / each)))
    say(f"Cycles' reference: {2 * half} samples")
    started = time.perf_counter()
    a, b = (cycles.draw(scene, half, seed)[0] for seed in SEEDS)
    spent, mean = time.perf_counter() - started, (a + b) / 2
    floor = metrics.errors(a * weight, mean * weight, deep.regions)
    points, late = _points(scene, sorted(samples), axes.repeats, each, until)
    for point in points:
        point["error"] = metrics.errors(
            point.pop("picture") * weight, mean * weight, deep.regions, (a * weight, b * weight)
        )
        shown = point["error"]["all"][metrics.SHOWN]
        say(f"Cycles, {point['samples']} samples: {point['time']['wall']:.2f} s, RMSE {shown:.2g}")
    return {
        "how": cycles.HOW,
        "reference": {
            "samples": 2 * half,
            "seconds": spent,
            "floor": floor,
            "difference": metrics.errors(ours, mean * weight, deep.regions),
            "mean": {name: float(mean[part].mean()) if part.any() else None for name, part in deep.regions.items()},
            "hash": metrics.digest(mean),
        },
        "points": points,
        "left_out": late,
    }


def _points(
    scene: bpy.types.Scene, samples: Sequence[int], repeats: int, each: float, until: float
) -> tuple[list[dict[str, Any]], list[int]]:
    """{"samples", "time", "picture"} of those that there is time for, timed in turn; and the others."""
    pictures: dict[int, Float64] = {}
    times: dict[int, list[dict[str, float]]] = {}
    for lap in range(repeats):
        for count in samples:
            if (lap == 0 or count in times) and each * count < until - time.perf_counter():
                picture, spent = cycles.draw(scene, count, lap)
                pictures.setdefault(count, picture)
                times.setdefault(count, []).append(spent)
    points = [
        {
            "samples": count,
            "time": {clock: float(np.median([t[clock] for t in times[count]])) for clock in ("wall", "cpu")},
            "picture": picture,
        }
        for count, picture in pictures.items()
    ]
    return points, [count for count in samples if count not in pictures]


def _deep(renders: Renders, deep: Reference, axes: Axes, seconds: float) -> Float64:
    """A picture (h, w, 3) as deep as the reference, with fewer samples, for which there are seconds."""
    count = deep.quality.samples // 4
    count = max(1, count if axes.patient else min(count, int(seconds / max(deep.each, 1e-9))))
    return renders.shown(renders.trace(replace(deep.quality, samples=count))).astype(np.float64)


def _box(region: metrics.Bools) -> tuple[int, int, int, int]:
    rows, columns = np.flatnonzero(region.any(axis=1)), np.flatnonzero(region.any(axis=0))
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
