# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures through Blender: the table of the thesis, and a hybrid frame against EEVEE's own time."""

from __future__ import annotations

from functools import partial

from hybrid_addon.presets import QUALITY

from . import files
from .measure import Bench
from .table import Cell, Goal, Table

SUPERSAMPLES = 16
MODES = ("RASTER", "HYBRID", "FULL")
EEVEE_SAMPLES = 64
ADAPTIVE = 0.05
DRAFT = QUALITY["DRAFT"][2]
PHASES = ("raster", "translate", "build", "trace", "composite")


def thesis(bench: Bench) -> list[Table]:
    """Three scenes x raster, hybrid, full x supersampling off and on, as the thesis measured its renderer."""
    size = (64, 48) if bench.quick else (1024, 768)
    modes = MODES[2:] if files.without_opengl() else MODES
    table = Table(
        f"The table of the thesis: seconds a frame (and frames a second), {size[0]}x{size[1]}",
        ["scene", "samples", "mask", *(mode.lower() for mode in MODES), "hybrid's tracer", "full's tracer"],
        note=f"Whole frames through Blender's pipeline, with translation and composite. Samples: EEVEE's and the "
        f"tracer's, 1 (supersampling off) or {SUPERSAMPLES}. The tracer's part: building the tree and tracing.",
    )
    for name in files.THESIS:
        scene = files.open_scene(name, size)
        if not files.without_opengl():
            files.warm_up(scene)
        for samples in (1, SUPERSAMPLES):
            if bench.is_over(table):
                return [table]
            bench.say(f"{name}, {samples} samples")
            timings = bench.side_by_side({mode: partial(files.render, scene, mode, samples, samples) for mode in modes})
            mask = f"{timings['HYBRID'].last['mask_coverage'] * 100:.0f} %" if "HYBRID" in timings else None
            cells: list[Cell] = [name, samples, mask]
            for mode in MODES:
                wall = timings[mode].wall if mode in timings else None
                cells.append(None if wall is None else f"{wall:.3g} ({1 / wall:.3g})")
            for mode in MODES[1:]:
                timing = timings.get(mode)
                cells.append(None if timing is None else timing.phase("build") + timing.phase("trace"))
            table.rows.append(cells)
    return [table]


def hybrid(bench: Bench) -> list[Table]:
    """A hybrid frame of the intermediate scene against the same frame drawn by EEVEE alone."""
    if files.without_opengl():
        raise RuntimeError(f"EEVEE needs OpenGL and {files.without_opengl()}")
    size = (128, 96) if bench.quick else (1024, 768)
    eevee = 4 if bench.quick else EEVEE_SAMPLES
    scene = files.open_scene("intermediate", size)
    files.warm_up(scene)
    files.warm_up(scene, "RASTER")
    hurried = {"max_depth": DRAFT.max_depth, "cutoff": DRAFT.cutoff}
    frames = {
        "EEVEE alone": partial(files.render, scene, "RASTER", eevee, SUPERSAMPLES),
        "hybrid": partial(files.render, scene, "HYBRID", eevee, SUPERSAMPLES),
        "hybrid, adaptive": partial(files.render, scene, "HYBRID", eevee, SUPERSAMPLES, adaptive=ADAPTIVE),
        "hybrid, Draft": partial(files.render, scene, "HYBRID", eevee, DRAFT.samples, **hurried),
    }
    timings = bench.side_by_side(frames)
    table = Table(
        f"A hybrid frame: intermediate, {size[0]}x{size[1]}, {eevee} EEVEE samples, {SUPERSAMPLES} tracer samples",
        ["frame", "wall s", "cpu s", "of EEVEE's", *(f"{phase} s" for phase in PHASES)],
        note=f"Adaptive: {SUPERSAMPLES} samples where {ADAPTIVE:g} of contrast asks for them. "
        f"Draft: that preset, {DRAFT.samples} samples.",
    )
    alone = timings["EEVEE alone"]
    for name, timing in timings.items():
        phases = [timing.phase(phase) if name != "EEVEE alone" else None for phase in PHASES]
        table.rows.append((name, timing.wall, timing.cpu, timing.wall / alone.wall, *phases))
        if name != "EEVEE alone":
            table.goals.append(Goal(f"{name}: frame / EEVEE's own", timing.wall / alone.wall, 2.0))
    return [table]
