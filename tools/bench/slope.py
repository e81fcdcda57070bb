# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast the error of sampling falls with the samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hybrid_addon.measure.error_time import fits, metrics
from hybrid_addon.scene import Float64, Scene, Settings
from hybrid_addon.tracer import trace

from . import files, models
from .measure import Bench
from .table import Goal, Table

COUNTS = (4, 16, 64, 256)
SEEDS = 4
EXPECTED = -0.75  # of straight edges, with samples that are not random (Mitchell 1996)
DEEP = 8  # times the samples of the largest count


def slope(bench: Bench) -> list[Table]:
    """Error of antialiasing against samples: the exponent, over scenes of edges, reflections and refractions."""
    size, deep = ((32, 24), 4) if bench.quick else ((160, 120), DEEP)
    table = Table(
        f"Error against samples, {size[0]}x{size[1]}",
        ["scene", *(f"RMSE, {n} samples" for n in COUNTS), "exponent"],
        note=f"Against {deep * COUNTS[-1]} samples of other places, {SEEDS} seeds. Random samples: -0.5; edges, "
        f"well spread ones: {EXPECTED}. In the Cornell box few pixels decide: they see its lamp, 40 times white.",
    )
    surfaces = {"matte": models.MATTE, "mirror": models.MIRROR, "glass": models.GLASS}
    scenes = {f"ball, {name}": models.ball_on_floor(5, surface, size) for name, surface in surfaces.items()}
    scenes["Cornell box"] = files.translated("cornell_box", size)[0]
    found = []
    for name, scene in scenes.items():
        if bench.is_over(table):
            return [table]
        bench.say(name)
        errors = _errors(scene, deep)
        fit = fits.power(COUNTS, errors, EXPECTED)
        exponent = fit.fit if fit and fit.fit is not None else float("nan")
        found.append(exponent)
        table.rows.append((name, *errors, exponent))
    mean = float(np.mean(found))
    table.rows.append(("mean", *(None for _ in COUNTS), mean))
    table.goals.append(Goal("mean exponent of the error over samples", mean, -0.7))
    return [table]


def _errors(scene: Scene, deep: int) -> list[float]:
    """RMSE at each count, over all pixels, of all seeds."""
    how = Settings(camera_sees="ALL", cutoff=1e-3)
    x0, y0, x1, y1 = scene.camera.window
    everything = np.ones((y1 - y0, x1 - x0), bool)
    target = trace(scene, replace(how, samples=deep * COUNTS[-1], seed=99)).radiance.astype(np.float64)
    return [
        float(
            np.sqrt(np.mean([_error(scene, replace(how, samples=n, seed=s), target, everything) for s in range(SEEDS)]))
        )
        for n in COUNTS
    ]


def _error(scene: Scene, how: Settings, target: Float64, region: NDArray[np.bool_]) -> float:
    """Squared."""
    return metrics.rmse(trace(scene, how).radiance, target, region) ** 2
