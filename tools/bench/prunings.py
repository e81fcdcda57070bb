# SPDX-License-Identifier: GPL-3.0-or-later
"""What leaving things out saves: each exact pruning off, against all on."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from hybrid_addon.scene import Scene, Settings
from hybrid_addon.tracer import trace
from tests.tracer.unpruned import without

from . import files
from .measure import Bench
from .table import Table

ELSEWHERE = ("empty-mask", "unmasked", "unchanged", "weightless")
"""Those that the part `coverage` measures, and that without which rays double at each bounce, to no end: minutes."""


def prunings(bench: Bench) -> list[Table]:
    """Each exact pruning that applies in the thesis' scenes: how much it leaves out, and the time without it."""
    size = (96, 72) if bench.quick else (400, 300)
    tables: list[Table] = []
    for name in files.THESIS:
        table = Table(
            f"What is left out: {name}, {size[0]}x{size[1]}, 4 samples, one thread",
            ["left out", "how much", "s without it", "of the time with all"],
            note="Exact ones that apply; the picture is the same bit for bit. Below some 102 % it is noise.",
        )
        tables.append(table)
        if bench.is_over(table):
            break
        bench.say(name)
        scene, settings = files.translated(name, size)
        how = replace(settings, samples=4, camera_sees="RAY_TRACED", threads=1)
        rows = {str(row["name"]): row for row in trace(scene, how).plan if _counts(row)}
        work = {"": partial(_traced, scene, how, "")} | {left: partial(_traced, scene, how, left) for left in rows}
        timings = bench.side_by_side(work)
        everything = timings.pop("").wall
        for left, timing in sorted(timings.items(), key=lambda item: -item[1].wall):
            saved = rows[left]["saved"]
            much = "-" if saved is None else f"{saved:,} {rows[left]['unit']}"
            table.rows.append((f"`{left}`", much, timing.wall, f"{timing.wall / everything:.0%}"))
    return tables


def _counts(row: dict[str, object]) -> bool:
    return bool(row["applies"]) and "exact" in str(row["class"]) and row["name"] not in ELSEWHERE


def _traced(scene: Scene, settings: Settings, left: str) -> None:
    with without(*([left] if left else [])):
        files.traced(scene, settings)
