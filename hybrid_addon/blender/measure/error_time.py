# SPDX-License-Identifier: GPL-3.0-or-later
"""`hybrid report`: error against run time for the open file. EEVEE draws once; then only the tracer runs."""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...clock import Clock
from ...measure.error_time import findings, host, metrics, page
from ...measure.error_time.budget import Budget
from ...measure.error_time.reference import ENOUGH, Pilot, Reference, pilot, reference
from ...measure.error_time.renders import Axes, Renders
from ...measure.error_time.sweep import Point, Say, combinations, expected, knobs, measure, promising
from ...presets import Quality
from ...scene import Film, Float32, Settings
from ...tracer.kernels import loading
from .. import api, files, scan
from ..errors import HybridError
from ..pipeline import scene_setup
from ..render import engine
from ..render.settings import public_settings, tracer_settings
from ..sync import Translation
from .beside_cycles import against_cycles

SCHEMA = 3
Size = tuple[int, int]

USUAL_PIXELS = 240 * 180
"""Without a resolution the picture is made smaller until it has no more pixels than this."""

LEAST_PIXELS = 80 * 60
"""Nor fewer than this where a scene is so costly that a good reference of more has no time."""

WORTH_IT = 0.7
"""Of the pixels: to save less than the rest EEVEE need not draw again."""

UNSEEN = "no ray traced object is in the picture"


@dataclass(eq=False)
class _Set:
    """All that is ready to be traced, and how long that took; raster and mask are None in mode FULL."""

    size: Size
    raster: Float32 | None
    translation: Translation
    renders: Renders
    pilot: Pilot
    time: dict[str, dict[str, float]]


def write(
    scene: bpy.types.Scene,
    folder: Path,
    axes: Axes,
    *,
    mode: str | None,
    resolution: Size | None,
    minutes: float,
    cycles_samples: Sequence[int],
    say: Say,
) -> Path:
    """Measure, and write report.html and report.json into the folder; returns the page. The open file is changed."""
    loading.load()  # all kernels, so that the last setting is not timed with more of them than the first
    budget = Budget(60 * minutes)
    until = budget.begin("reference")
    ready, left_out = _ready(scene, axes, mode, resolution, until, say)
    renders, axes = ready.renders, replace(axes, reference_cutoff=ready.pilot.cutoff)
    say(f"reference: up to {axes.reference_samples} samples, {axes.deepest} bounces, cutoff {axes.reference_cutoff:g}")
    deep = reference(renders, axes, ready.pilot.each, until)
    if not deep.regions["all"].any():
        raise HybridError(UNSEEN)
    if deep.quality.samples < axes.reference_samples:
        why = "there was no time for more"
        left_out.append({"what": f"reference samples beyond {deep.quality.samples}", "why": why})
    single = knobs(renders, axes, deep, say, budget.begin("knobs"))
    if single["left_out"]:
        left_out.append({"what": f"{single['left_out']} pairs of bounces and cutoff", "why": single["why"]})
    cost = partial(expected, single=single, deep=deep)
    wanted_workers = combinations(axes, promising(single["entries"], deep.noise()))
    if not cycles_samples:
        budget.shares = {**budget.shares, "points": budget.shares["points"] + budget.shares["cycles"]}
    points, late = measure(renders, wanted_workers, deep, axes.repeats, say, budget.begin("points"), cost)
    left_out += findings.too_late(late)
    seconds = ready.time["translate"]["wall"] + renders.build["wall"]
    is_physical = scene.hybrid.light_falloff == "PHYSICAL" or not renders.scene.lights
    physical = None if is_physical else partial(_physical, scene, ready)
    theirs = against_cycles(scene, renders, physical, deep, axes, cycles_samples, say, budget.begin("cycles"))
    left_out += [
        {"what": f"Cycles, {n} samples", "why": "there was no time for it"} for n in theirs.get("left_out", [])
    ]
    budget.end()
    name, film, quality = _chosen(points, deep)
    times = [seconds + p.seconds() for p in points]
    front = findings.front(points, times)
    flip = [] if metrics.flip_library() else ["no FLIP: flip-evaluator is not installed"]
    report = {
        "schema": SCHEMA,
        "version": host.version(),
        "commit": host.commit(),
        "host": _host(),
        "scene": _facts(scene, ready, deep),
        "reference": {
            "kind": "own", **deep.quality.values(), "seconds": deep.seconds,
            "floor": deep.floor,
            "hash": metrics.digest(deep.picture),
        },
        "settings": public_settings(scene),
        "minutes": {"asked": minutes, "spent": {part: spent / 60 for part, spent in budget.spent.items()}},
        "time": {**ready.time, "build": renders.build},
        "knobs": single,
        "points": [{**p.as_dict(seconds), "alone": p.quality == axes.deep(p.quality.samples)} for p in points],
        "pareto": front,
        "pareto_why": findings.no_front(front, points, deep),
        "presets": findings.presets(points, times, deep),
        "slopes": {name: asdict(s) for name, s in findings.slopes(points, deep, single, axes).items()},
        "cycles": {**theirs, "equal_error": findings.equal_errors(theirs, points, seconds)},
        "plan": renders.plan(quality),
        "skipped": film.skipped,
        "invariants": findings.invariants(points),
        "left_out": left_out,
        "notes": [*findings.reservations(points, deep, single), *ready.translation.warnings, *flip],
    }  # fmt: skip
    text = page.render(report, _pictures(name, film, renders, deep, ready.raster))
    with files.atomic(folder / "report.json") as data, files.atomic(folder / "report.html") as html:
        Path(data).write_text(json.dumps(_finite(report), indent=1, allow_nan=False), encoding="utf-8")
        Path(html).write_text(text, encoding="utf-8")
    if left_out:
        say("left out: " + "; ".join(f"{entry['what']} ({entry['why']})" for entry in left_out))
    say(page.summary(report))
    return folder / "report.html"


# ------------------------------------------------------------------------------------------------ before the sweep


def _ready(
    scene: bpy.types.Scene, axes: Axes, mode: str | None, resolution: Size | None, until: float, say: Say
) -> tuple[_Set, list[dict[str, str]]]:
    """The scene, at a size at which the reference can be good in its time, if that may be chosen; what this cost."""
    size = wanted_workers = _set_up(scene, mode, resolution)
    while True:
        began = time.perf_counter()
        found = _prepared(scene, size, axes, until, say)
        left, again = until - time.perf_counter(), time.perf_counter() - began
        least, whole = LEAST_PIXELS / (size[0] * size[1]), ENOUGH * found.pilot.each
        if resolution or axes.patient or max(left / whole, least) > WORTH_IT:
            break
        size = _shrunk(size, max((left - again) / whole, least))
    if not axes.patient and not found.pilot.finished and 2 * found.pilot.each > left:
        each = found.pilot.each / 60
        what = f"one sample of the reference takes about {each:.2g} minutes"
        if left <= 0:
            what = f"EEVEE's half, the scene and its first samples took {again / 60:.2g} minutes"
        raise HybridError(f"{what}: raise --minutes, or lower --resolution or --max-depth")
    if size == wanted_workers:
        return found, []
    why = f"a reference of {ENOUGH} samples has no time there: {size[0]} x {size[1]} instead"
    return found, [{"what": f"{wanted_workers[0]} x {wanted_workers[1]} pixels", "why": why}]


def _prepared(scene: bpy.types.Scene, size: Size, axes: Axes, until: float, say: Say) -> _Set:
    scene.render.resolution_x, scene.render.resolution_y = size
    raster, mask, spent = _raster(scene, say)
    if mask is not None and not mask.any():
        raise HybridError(UNSEEN)
    clock = Clock()
    translation = scan.translated(scene, size)
    spent["translate"] = clock.read()
    renders = Renders(translation.scene, _settings(scene), mask)
    return _Set(size, raster, translation, renders, pilot(renders, axes, until), spent)


def _physical(scene: bpy.types.Scene, ready: _Set) -> Renders:
    """The same with lights that never end."""
    return Renders(scan.translated(scene, ready.size, "PHYSICAL").scene, _settings(scene), ready.renders.mask)


def _set_up(scene: bpy.types.Scene, mode: str | None, resolution: Size | None) -> Size:
    b_render = scene.render
    if mode:
        scene.hybrid.mode = mode.upper()
    if resolution is None:
        share = b_render.resolution_percentage / 100
        width, height = b_render.resolution_x * share, b_render.resolution_y * share
        resolution = _shrunk((width, height), min(1.0, USUAL_PIXELS / (width * height)))
    b_render.resolution_x, b_render.resolution_y = resolution
    b_render.resolution_percentage = 100
    b_render.use_border = False
    if scene_setup.effective_mode(scene) == "RASTER":
        raise HybridError("nothing is ray traced: flag an object, or use --mode full")
    scene_setup.enable(scene)
    api.check(scene)
    return resolution


def _shrunk(size: tuple[float, float], share: float) -> Size:
    """About so large a share of the pixels."""
    width, height = (max(4, round(n * math.sqrt(share))) for n in size)
    return width, height


def _raster(scene: bpy.types.Scene, say: Say) -> tuple[Float32 | None, Float32 | None, dict[str, dict[str, float]]]:
    """EEVEE's picture without the ray traced objects (h, w, 4), their mask (h, w), what they took. Mode FULL: None."""
    if scene.hybrid.mode == "FULL":
        return None, None, {}
    say("EEVEE draws its half")
    result = api.render(scene, samples=1, max_depth=0)
    spent = {phase: result.report["time"][phase] for phase in ("raster", "composite") if phase in result.report["time"]}
    return result.raster, result.mask, spent


def _settings(scene: bpy.types.Scene) -> Settings:
    """The scene's, without what is done to EEVEE's half: the report is of the ray traced one.

    Ready for what each point of the report asks for: rough surfaces, and lamps with their size.
    """
    return replace(tracer_settings(scene), raster_shadows=False, rough_samples=1, shadow_samples=1)


# ------------------------------------------------------------------------------------------------ facts and pictures


def _host() -> dict[str, Any]:
    load = {"load": round(os.getloadavg()[0], 2)} if hasattr(os, "getloadavg") else {}
    python = ".".join(map(str, sys.version_info[:3]))
    versions = {**engine.versions(), "python": python, "numpy": np.__version__}
    return {"cpu": host.cpu_name(), "cores": os.cpu_count(), **versions, **load}


def _facts(scene: bpy.types.Scene, ready: _Set, deep: Reference) -> dict[str, Any]:
    return {
        "name": scene.name,
        "file": Path(bpy.data.filepath).name,
        "frame": scene.frame_current,
        "resolution": list(ready.size),
        "mask_pixels": int(np.count_nonzero(deep.regions["all"])),
        "triangles": ready.translation.counts["triangles"],
        "lights": ready.translation.counts["lights"],
        "regions": {name: int(np.count_nonzero(region)) for name, region in deep.regions.items()},
    }


def _chosen(points: Sequence[Point], deep: Reference) -> tuple[str, Film, Quality]:
    """The picture to show, its name and quality: the preset for delivery, else another, else half of the reference."""
    presets = {p.preset: p for p in points if p.preset}
    for name in ("Final", "Draft", "Reference"):
        film = presets[name].film if name in presets else None
        if film is not None:
            return name if name == "Final" else f"{name} (there was no time for Final)", film, presets[name].quality
    return "Half of the reference (there was no time for any preset)", deep.films[0], deep.quality


def _pictures(name: str, film: Film, renders: Renders, deep: Reference, raster: Float32 | None) -> dict[str, Float32]:
    """A film in the composite, ten times its error, and its residual, each by its caption."""
    shown = renders.shown(film)
    whole = shown if raster is None else shown + raster[..., :3]
    residual = np.repeat((film.residual * renders.weight(film))[..., None], 3, axis=-1)
    return {
        name: whole,
        f"{name}: 10 x its error": np.asarray(10 * np.abs(shown - deep.picture), np.float32),
        f"{name}: 100 x its residual": np.asarray(100 * residual, np.float32),
    }


def _finite(value: Any) -> Any:
    """JSON has no NaN and no infinity: null."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
