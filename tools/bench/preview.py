# SPDX-License-Identifier: GPL-3.0-or-later
"""The viewport's preview: from a change of the view to its traced pictures, the scene known already."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from typing import Any

import bpy

from hybrid_addon.blender.preview.display import Display
from hybrid_addon.blender.preview.job import COARSE, Job
from hybrid_addon.blender.preview.view import View
from hybrid_addon.blender.render.settings import preview_settings
from hybrid_addon.scene import Scene, Settings
from hybrid_addon.tracer import CompiledScene

from . import files
from .measure import Bench
from .speed import MANY_CORES, PICTURES_A_SECOND, cores
from .table import Goal, Table

POLL_SECONDS = 0.0005


def preview(bench: Bench) -> list[Table]:
    """From a change of the view to the preview's first picture and to the one with all pixels, one sample each."""
    size = (128, 96) if bench.quick else (1024, 768)
    table = Table(
        f"The preview after a change of the view, {size[0]}x{size[1]}, {cores()} threads",
        ["scene", f"first picture (1:{COARSE[0]}) s", "all pixels, 1 sample s", "pictures a second"],
        note="The scene is translated and its trees are built, as while the view moves. Tracing, colour management and "
        "the coarser pictures before are counted; EEVEE, the overlay and what the window waits before it begins are "
        "not. Ray traced objects only.",
    )
    for name in files.THESIS:
        if bench.is_over(table):
            break
        bench.say(name)
        scene, _ = files.translated(name, size)
        b_scene = bpy.context.scene
        settings = replace(preview_settings(b_scene), samples=1, adaptive=0.0)
        compiled = CompiledScene(scene, settings, pixels=0)
        views = [_view(b_scene, size, turn) for turn in (0.0, 0.01)]
        work = partial(_pictures, scene, settings, views, compiled, Display.of(b_scene), [0])
        timing = bench.side_by_side({"preview": work})["preview"]
        first, whole = (sorted(run[i] for run in timing.results)[len(timing.results) // 2] for i in (0, 1))
        table.rows.append((name, first, whole, 1 / whole))
        if name == "simple" and cores() >= MANY_CORES and not bench.quick:
            table.goals.append(Goal("simple: previews a second", 1 / whole, PICTURES_A_SECOND, at_least=True))
    return [table]


def _view(scene: bpy.types.Scene, size: files.Size, turn: float) -> View:
    """The scene's camera as a viewport of that size sees through it, moved sideways by so many metres."""
    depsgraph = scene.view_layers[0].depsgraph
    matrix, projection = (
        [list(row) for row in m]
        for m in (scene.camera.matrix_world, scene.camera.calc_matrix_camera(depsgraph, x=size[0], y=size[1]))
    )
    for row in matrix[:3]:
        row[3] += row[0] * turn
    clip = scene.camera.data.clip_start, scene.camera.data.clip_end
    return View(tuple(map(tuple, matrix)), tuple(map(tuple, projection)), size, (0, 0, *size), clip)


def _pictures(
    scene: Scene, settings: Settings, views: list[View], compiled: CompiledScene, display: Display, turn: list[int]
) -> tuple[float, float]:
    """Seconds to the first picture, and to the last; each time of the other view."""
    turn[0] += 1
    began, first = time.perf_counter(), 0.0
    job: Any = Job(scene, views[turn[0] % len(views)], settings, display, 0.0, compiled)
    while not job.done:
        if not first and job.take_picture() is not None:
            first = time.perf_counter() - began
        time.sleep(POLL_SECONDS)
    if job.problem:
        raise RuntimeError(job.problem)
    whole = time.perf_counter() - began
    return first or whole, whole
