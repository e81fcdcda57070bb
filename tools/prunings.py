# SPDX-License-Identifier: GPL-3.0-or-later
"""What leaving things out saves: a table, in Markdown, of each exact pruning in each file.

    python -m tools.prunings sample_scenes/*.blend FOLDER/*.blend [--only NAME ...] [--repeat 9] [--width 80]

Each file is traced twice, hybrid (its ray traced objects; where none is, those that mirror or refract) and whole, with
each pruning and without it, in turns. A cell is the CPU time without the pruning over that with all, the median over
pairs that ran one right after the other (other work on the machine slows both), and the peak of the memory that numpy
asks for likewise. What does not apply shows the noise.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from hybrid_addon.scene import Scene, Settings
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.kernels.loading import load
from hybrid_addon.tracer.materials.surfaces import compile_surfaces
from tests.tracer.unpruned import EXACT, without

sys.path.append(str(Path(__file__).resolve().parent))

from leave import leave

ENDLESS = "weightless"
"""That without which rays double at each bounce, to no end."""

LONGEST = 90.0
"""Seconds of CPU time for one file and one way to trace it; what is left is measured once."""

WAYS: dict[str, dict[str, Any]] = {"hybrid": {"camera_sees": "RAY_TRACED"}, "whole": {"camera_sees": "ALL"}}

Ratio = tuple[float, float]


def translated(path: Path, width: int) -> tuple[Scene, Settings]:
    """A file as plain data, and its settings at one thread and two samples."""
    import bpy

    from hybrid_addon.blender.render.settings import tracer_settings
    from hybrid_addon.blender.sync import translate

    bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
    b_scene = bpy.context.scene
    height = max(4, round(width * b_scene.render.resolution_y / b_scene.render.resolution_x))
    b_scene.render.resolution_x, b_scene.render.resolution_y = width, height
    b_scene.render.resolution_percentage = 100
    layer = b_scene.view_layers[0]
    layer.update()
    size = width, height
    found = translate(layer.depsgraph, b_scene, size, (0, 0, *size), light_falloff=b_scene.hybrid.light_falloff)
    settings = replace(tracer_settings(b_scene), samples=2, adaptive=0.0, threads=1, processes=False)
    return _with_ray_traced(found.scene), settings


def _with_ray_traced(scene: Scene) -> Scene:
    """The scene; where no object is ray traced, those are that mirror or refract."""
    if any(instance.ray_traced for instance in scene.instances):
        return scene
    table = compile_surfaces(scene.surfaces)
    sends = table.reflects | table.transmits
    return replace(
        scene,
        instances=tuple(replace(i, ray_traced=bool(sends[list(i.surfaces)].any())) for i in scene.instances),
    )


def measured(scene: Scene, settings: Settings, only: Sequence[str], repeat: int) -> dict[str, Ratio]:
    """Pruning -> time and memory without it over those with all, where doing without it makes a difference."""
    names = [name for name in only or EXACT if name != ENDLESS]
    trace(scene, settings)  # what the first one alone builds and keeps is nobody's saving
    found, peak, began = {}, _peak(lambda: trace(scene, settings)), time.process_time()
    for name in names:
        run, ratios = _without(scene, settings, name), []
        for _ in range(repeat if time.process_time() - began < LONGEST else 1):
            with_all = _seconds(lambda: trace(scene, settings))
            ratios.append(_seconds(run) / with_all)
        found[name] = statistics.median(ratios), _peak(run) / peak
    return found


def _without(scene: Scene, settings: Settings, name: str) -> Callable[[], object]:
    def run() -> object:
        with without(name):
            return trace(scene, settings)

    return run


def _seconds(run: Callable[[], object]) -> float:
    began = time.process_time()
    run()
    return time.process_time() - began


def _peak(run: Callable[[], object]) -> int:
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def main() -> None:
    """All files, then the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--repeat", type=int, default=9)
    parser.add_argument("--width", type=int, default=80)
    arguments = parser.parse_args()
    import hybrid_addon as hybrid

    hybrid.register()
    load()  # compiled kernels: what a pruning saves is measured as users have it
    columns: dict[str, dict[str, Ratio]] = {}
    for path in arguments.files:
        scene, settings = translated(path, arguments.width)
        for way, seen in WAYS.items():
            how = replace(settings, **seen, raster_shadows=False)
            columns[f"{path.stem}, {way}"] = found = measured(scene, how, arguments.only, arguments.repeat)
            print(path.stem, way, {k: (round(t, 2), round(m, 2)) for k, (t, m) in found.items()}, file=sys.stderr)
    names = sorted({name for column in columns.values() for name in column})
    print("| " + " | ".join(["pruning", *columns]) + " |")
    print("| " + " | ".join(["---"] * (1 + len(columns))) + " |")
    for name in names:
        cells = [f"{column[name][0]:.2f}, {column[name][1]:.2f}" for column in columns.values()]
        print("| " + " | ".join([f"`{name}`", *cells]) + " |")


if __name__ == "__main__":
    main()
    leave()
