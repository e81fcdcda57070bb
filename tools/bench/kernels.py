# SPDX-License-Identifier: GPL-3.0-or-later
"""What compiled kernels bring: the same traces with them and with numpy, one thread, in turn in one process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from hybrid_addon import accelerated
from hybrid_addon.scene import Film
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.kernels import loading

from . import files
from .measure import Bench
from .table import Table


def kernels(bench: Bench) -> list[Table]:
    """The tracer with compiled kernels and without: processor seconds of one thread."""
    if not accelerated.in_use():
        raise RuntimeError(f"there are no kernels: {loading.line()}")
    size = (128, 96) if bench.quick else (512, 384)
    table = Table(
        f"Compiled kernels and numpy, {size[0]}x{size[1]}, one thread",
        ["scene", "samples", "numpy s", "kernels s", "times as fast", "same bits"],
        note=f"Processor seconds of tracing every pixel, the tree built before. {loading.line()}.",
    )
    for name in files.THESIS:
        scene, settings = files.translated(name, size)
        for samples in (1, 4):
            if bench.is_over(table):
                return [table]
            bench.say(f"{name}, {samples} samples")
            how = replace(settings, samples=samples, camera_sees="ALL", threads=1, processes=False)
            work = partial(trace, scene, how)
            found = bench.side_by_side({"numpy": partial(_with, False, work), "kernels": partial(_with, True, work)})
            seconds = {
                who: float(np.median([film.time["trace"]["cpu"] for film in timing.results]))
                for who, timing in found.items()
            }
            same = np.array_equal(*(timing.last.radiance for timing in found.values()))
            gain = seconds["numpy"] / seconds["kernels"]
            table.rows.append((name, samples, seconds["numpy"], seconds["kernels"], gain, "yes" if same else "NO"))
    return [table]


def _with(wanted: bool, work: Callable[[], Film]) -> Film:
    """Do it with kernels in use, or not."""
    accelerated.use(wanted)
    try:
        return work()
    finally:
        accelerated.use(True)
