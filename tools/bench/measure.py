# SPDX-License-Identifier: GPL-3.0-or-later
"""Times that can be compared: all candidates in turn, A B C A B C, and the median of each."""

from __future__ import annotations

import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hybrid_addon.clock import Clock
from hybrid_addon.measure.error_time.host import cpu_name
from hybrid_addon.tracer.geometry.embree import embree_version

from .table import Table

ROOT = Path(__file__).resolve().parents[2]
Work = Callable[[], Any]


@dataclass
class Timing:
    """Runs of one candidate: wall and processor seconds of each, and what each returned."""

    walls: list[float] = field(default_factory=list)
    cpus: list[float] = field(default_factory=list)
    results: list[Any] = field(default_factory=list)

    @property
    def wall(self) -> float:
        """Median."""
        return statistics.median(self.walls)

    @property
    def cpu(self) -> float:
        """Median, all threads of this process, and the processes that it forked."""
        return statistics.median(self.cpus)

    @property
    def last(self) -> Any:
        """What the last run returned."""
        return self.results[-1]

    def phase(self, name: str, clock: str = "wall") -> float:
        """Median seconds of one phase, of results that are reports: {"time": {phase: {"wall", "cpu"}}}."""
        return statistics.median(result["time"][name][clock] for result in self.results)

    def run(self, work: Work) -> None:
        """One run more."""
        clock = Clock()
        result = work()
        spent = clock.read()
        self.cpus.append(spent["cpu"])
        self.walls.append(spent["wall"])
        self.results.append(result)


@dataclass
class Bench:
    """What all parts share.

    quick    : smaller pictures, fewer points: to see that everything runs.
    repeats  : counted rounds, as far as `patience` seconds for each comparison allow; one at least.
    deadline : of the whole command, in time.perf_counter() seconds.
    say      : prints one line.
    """

    quick: bool
    repeats: int
    patience: float
    deadline: float
    say: Callable[[str], None]

    @property
    def left(self) -> float:
        """Seconds until the deadline."""
        return self.deadline - time.perf_counter()

    def is_over(self, table: Table) -> bool:
        """Whether the time is up; the table then says that it is cut short."""
        if self.left > 0:
            return False
        table.note = "**The time limit cut this table short.** " + table.note
        return True

    def side_by_side(self, candidates: Mapping[str, Work]) -> dict[str, Timing]:
        """Run all candidates in turn, first once uncounted; a first round that tries the patience counts."""
        began = time.perf_counter()
        timings = _round(candidates, {name: Timing() for name in candidates})
        first = time.perf_counter() - began
        if first >= min(self.patience, self.left):
            return timings
        timings = {name: Timing() for name in candidates}
        for _ in range(self.repeats):
            _round(candidates, timings)
            if time.perf_counter() - began + first > self.patience or self.left < first:
                break
        return timings


def _round(candidates: Mapping[str, Work], timings: dict[str, Timing]) -> dict[str, Timing]:
    for name, work in candidates.items():
        timings[name].run(work)
    return timings


def host() -> dict[str, Any]:
    """This machine and these libraries."""
    import bpy

    return {
        "cpu": cpu_name(),
        "cores": cores(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "system": platform.platform(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "embree": embree_version(),
        "blender": bpy.app.version_string,
        "commit": _commit(),
    }


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def _commit() -> str:
    command = ["git", "-C", str(ROOT), "describe", "--always", "--dirty"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
