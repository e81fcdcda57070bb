# SPDX-License-Identifier: GPL-3.0-or-later
"""Equal error against Cycles on sample scenes of different kinds, as `hybrid report` measures it."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

from hybrid_addon.blender.errors import HybridError
from hybrid_addon.blender.measure import error_time
from hybrid_addon.measure.error_time.metrics import SHOWN

from . import files
from .measure import Bench
from .table import Goal, Table

SCENES = {
    "simple": "lamps, mirror",
    "intermediate": "glass in glass",
    "complex": "a room, mirrors",
    "studio": "sun and sky, brushed",
    "cornell_box": "a box, area light",
}
CYCLES = (4, 16, 64)
MINUTES = 4.0
FASTER = 3.0
ERRORS = (SHOWN, "flip_ldr", "mae")


def equal_error(bench: Bench) -> list[Table]:
    """Times to the same error: the tracer, and Cycles' whole render of the rectangle around the traced pixels."""
    table = Table(
        "Equal error against Cycles on the sample scenes",
        ["scene", "kind", "Cycles' samples", "RMSE", "FLIP", "MAE", "Cycles s", "ours s", "times as fast"],
        note="`hybrid report` on each file, the same lamps on both sides. RMSE is of clipped radiance, against each "
        "renderer's own reference; FLIP and MAE are Cycles' at these samples. Ours: the settings of all measured "
        "that reach this RMSE first.",
    )
    for name, kind in SCENES.items():
        if bench.is_over(table):
            break
        bench.say(name)
        try:
            report = _report(name, bench)
        except HybridError as error:
            table.rows.append((name, f"{kind}: {error}", None, None, None, None, None, None, None))
            continue
        theirs, best = report["cycles"], 0.0
        points = theirs.get("points", [])
        if not points:
            why = theirs.get("why", "there was no time for Cycles")
            table.rows.append((name, f"{kind}: {why}", None, None, None, None, None, None, None))
        for point, equal in zip(points, theirs["equal_error"], strict=True):
            errors = [point["error"]["all"].get(metric) for metric in ERRORS]
            ratio = equal["ratio"] if equal["ratio"] is not None else equal["why"]
            table.rows.append((name, kind, point["samples"], *errors, equal["cycles"], equal["ours"], ratio))
            best = max(best, equal["ratio"] or 0.0)
        if best and not bench.quick:
            table.goals.append(Goal(f"{name}: faster than Cycles at equal error", best, FASTER, at_least=True))
    return [table]


def _report(name: str, bench: Bench) -> dict[str, Any]:
    scene = files.open_scene(name, (64, 48) if bench.quick else (320, 240))
    mode = "FULL" if bench.quick or files.without_opengl() else None  # without EEVEE, which is not measured
    minutes = 0.5 if bench.quick else max(min(MINUTES, bench.left / 60), 0.1)
    with tempfile.TemporaryDirectory() as folder:
        error_time.write(
            scene, Path(folder), error_time.Axes(), mode=mode, resolution=None, minutes=minutes, cycles_samples=CYCLES,
            say=lambda line: None,
        )  # fmt: skip
        report: dict[str, Any] = json.loads((Path(folder) / "report.json").read_text())
    return report
