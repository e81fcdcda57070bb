"""`hybrid report`: error against run time for the open file. EEVEE draws once; then only the tracer runs."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..report import fits, metrics, page
from ..report.sweep import (
    REFERENCE_SEEDS,
    Axes,
    Point,
    Reference,
    Studio,
    affordable,
    combinations,
    describe,
    knobs,
    measure,
    promising,
    reference,
    slopes,
)
from ..scene import Float32, Float64, Settings
from . import api, cycles, engine, files, pipeline, results
from .errors import HybridError
from .scan import translated
from .settings import public_settings, tracer_settings
from .sync import Translation

SCHEMA = 1
Say = Callable[[str], None]
Size = tuple[int, int]

USUAL_PIXELS = 240 * 180
"""Without a resolution the picture is made smaller until it has no more pixels than this."""


def write(
    scene: bpy.types.Scene,
    folder: Path,
    axes: Axes,
    *,
    mode: str | None,
    resolution: Size | None,
    cycles_samples: Sequence[int],
    say: Say,
) -> Path:
    """Measure, and write report.html and report.json into the folder; returns the page. The open file is changed."""
    size = _set_up(scene, mode, resolution)
    raster, mask = _raster(scene, say)
    clock = results.Clock()
    translation = translated(scene, size)
    base = clock.read()
    studio = Studio(translation.scene, _settings(scene), mask)
    say(f"reference: up to {axes.reference_samples} samples, {axes.deepest} bounces")
    deep = reference(studio, axes)
    if not deep.regions["all"].any():
        raise HybridError("no ray traced object is in the picture")
    single = knobs(studio, axes, deep, say)
    points, too_long = affordable(combinations(axes, promising(single["entries"])), single, deep, axes)
    measure(studio, points, deep, axes.repeats, say)
    seconds = base["wall"] + studio.build["wall"]
    theirs = _against_cycles(scene, translation, studio, deep, axes, cycles_samples, say)
    notes = [*translation.warnings]
    notes += [f"not measured, it would take minutes: {p.preset or describe(p.quality)}" for p in too_long]
    if metrics.flip_library() is None:
        notes.append("no FLIP: flip-evaluator is not installed")
    report = {
        "schema": SCHEMA,
        "host": _host(),
        "scene": _facts(scene, translation, size, deep),
        "reference": {
            "kind": "own", **deep.quality.values(), "seconds": deep.seconds, "floor_rmse": deep.floor,
            "hash": _hash(deep.picture),
        },
        "settings": public_settings(scene),
        "time": {"translate": base, "build": studio.build},
        "knobs": single,
        "points": [{**p.as_dict(seconds), "alone": p.quality == axes.deep(p.quality.samples)} for p in points],
        "pareto": fits.pareto([p.seconds() for p in points], [p.rmse for p in points]),
        "slopes": {name: asdict(s) if s else None for name, s in slopes(points, deep, single, axes).items()},
        "cycles": _equal_error(theirs, points, seconds),
        "notes": notes,
    }  # fmt: skip
    text = page.render(report, _pictures(studio, points, deep, raster))
    with files.atomic(folder / "report.json") as data, files.atomic(folder / "report.html") as html:
        Path(data).write_text(json.dumps(_finite(report), indent=1, allow_nan=False), encoding="utf-8")
        Path(html).write_text(text, encoding="utf-8")
    say(page.summary(report))
    return folder / "report.html"


def _set_up(scene: bpy.types.Scene, mode: str | None, resolution: Size | None) -> Size:
    b_render = scene.render
    if mode:
        scene.hybrid.mode = mode.upper()
    if resolution is None:
        scale = b_render.resolution_percentage / 100
        shrink = min(1.0, math.sqrt(USUAL_PIXELS / (b_render.resolution_x * b_render.resolution_y * scale * scale)))
        resolution = tuple(max(4, round(n * scale * shrink)) for n in (b_render.resolution_x, b_render.resolution_y))
    b_render.resolution_x, b_render.resolution_y = resolution
    b_render.resolution_percentage = 100
    b_render.use_border = False
    if pipeline.effective_mode(scene) == "RASTER":
        raise HybridError("nothing is ray traced: flag an object, or use --mode full")
    pipeline.enable(scene)
    api.check(scene)
    return resolution


def _raster(scene: bpy.types.Scene, say: Say) -> tuple[Float32 | None, Float32 | None]:
    """EEVEE's picture without the ray traced objects (h, w, 4), and their mask (h, w); None in mode FULL."""
    if scene.hybrid.mode == "FULL":
        return None, None
    say("EEVEE draws its half, once")
    result = api.render(scene, samples=1, max_depth=0)
    return result.raster, result.mask


def _settings(scene: bpy.types.Scene) -> Settings:
    """The scene's, without what is done to EEVEE's half: the report is of the ray traced one."""
    return replace(tracer_settings(scene), raster_shadows=False)


# ------------------------------------------------------------------------------------------------ Cycles


def _against_cycles(
    scene: bpy.types.Scene,
    translation: Translation,
    studio: Studio,
    deep: Reference,
    axes: Axes,
    samples: Sequence[int],
    say: Say,
) -> dict[str, Any]:
    """Cycles at several sample counts against its own reference, and its reference against ours."""
    if not samples:
        return {"why": "Cycles was not asked for."}
    size = deep.picture.shape[1], deep.picture.shape[0]
    ours = _with_physical_lights(scene, translation, studio, deep, axes, say)
    try:
        cycles.whitted_subset(scene, translation.scene, axes.deepest)
    except HybridError as error:
        return {"why": f"Not measured: {error}."}
    region, weight = deep.regions["all"], studio.weight(deep.film)[..., None].astype(np.float64)
    cycles.limit(scene, _box(region), size)
    cycles.draw(scene, 1, 0)  # warm
    half = max(1, 2 * axes.reference_samples)  # its samples are not shared between pixels
    say(f"Cycles' reference: {2 * half} samples")
    clock = results.Clock()
    a, b = (cycles.draw(scene, half, seed)[0] for seed in REFERENCE_SEEDS)
    spent = clock.read()["wall"]
    mean = (a + b) / 2
    points = []
    for count in samples:
        runs = [cycles.draw(scene, count, seed) for seed in range(axes.repeats)]
        errors = metrics.error(runs[0][0] * weight, mean * weight, region)
        time = {clock: float(np.median([run[1][clock] for run in runs])) for clock in ("wall", "cpu")}
        say(f"Cycles, {count} samples: {time['wall']:.2f} s, RMSE {errors['rmse']:.2g}")
        points.append({"samples": count, "time": time, "rmse": errors["rmse"], "error": errors})
    inside = deep.regions["interior"]
    return {
        "how": cycles.HOW,
        "reference": {
            "samples": 2 * half,
            "seconds": spent,
            "floor_rmse": metrics.rmse(a * weight, b * weight, region) / 2,
            "difference": metrics.error(ours, mean * weight, inside),
            "mean": float(mean[inside].mean()) if inside.any() else None,
            "hash": _hash(mean),
        },
        "points": points,
    }


def _with_physical_lights(
    scene: bpy.types.Scene, translation: Translation, studio: Studio, deep: Reference, axes: Axes, say: Say
) -> Float64:
    """Our reference with lights that never end, as Cycles' do."""
    if scene.hybrid.light_falloff == "PHYSICAL" or not translation.scene.lights:
        return deep.picture
    say("our reference with physical lights, to compare with Cycles")
    physical = translated(scene, translation.scene.camera.resolution, "PHYSICAL")
    other = Studio(physical.scene, _settings(scene), studio.mask)
    film = other.trace(replace(deep.quality, samples=max(1, deep.quality.samples // 4)))
    return other.shown(film).astype(np.float64)


def _box(region: metrics.Bools) -> tuple[int, int, int, int]:
    rows, columns = np.flatnonzero(region.any(axis=1)), np.flatnonzero(region.any(axis=0))
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def _equal_error(theirs: dict[str, Any], points: Sequence[Point], base: float) -> dict[str, Any]:
    """For each of Cycles' errors that stand clear of its reference's noise, our time to the same."""
    if "points" not in theirs:
        return theirs
    times, errors = [base + p.seconds() for p in points], [p.rmse for p in points]
    found = []
    for point in theirs["points"]:
        ours = fits.time_to(point["rmse"], times, errors)
        if point["rmse"] > 3 * theirs["reference"]["floor_rmse"] and ours:
            wall = point["time"]["wall"]
            found.append({"rmse": point["rmse"], "ours": ours, "cycles": wall, "ratio": wall / ours})
    return {**theirs, "equal_error": found}


# ------------------------------------------------------------------------------------------------ facts and pictures


def _host() -> dict[str, Any]:
    load = {"load": round(os.getloadavg()[0], 2)} if hasattr(os, "getloadavg") else {}
    python = ".".join(map(str, sys.version_info[:3]))
    return {**engine.versions(), "python": python, "numpy": np.__version__, "cores": os.cpu_count(), **load}


def _facts(scene: bpy.types.Scene, translation: Translation, size: Size, deep: Reference) -> dict[str, Any]:
    return {
        "name": scene.name,
        "file": Path(bpy.data.filepath).name,
        "frame": scene.frame_current,
        "resolution": list(size),
        "mask_pixels": int(np.count_nonzero(deep.regions["all"])),
        "triangles": translation.counts["triangles"],
        "lights": translation.counts["lights"],
        "regions": {name: int(np.count_nonzero(region)) for name, region in deep.regions.items()},
    }


def _hash(picture: Float64) -> str:
    import hashlib

    return hashlib.sha256(np.ascontiguousarray(picture, np.float32).tobytes()).hexdigest()[:16]


def _pictures(studio: Studio, points: Sequence[Point], deep: Reference, raster: Float32 | None) -> dict[str, Float32]:
    """The preset for delivery, ten times its error, and its residual."""
    chosen = next((p for p in points if p.preset == "Final"), points[-1])
    film = studio.trace(chosen.quality)
    shown = studio.shown(film)
    whole = shown if raster is None else shown + raster[..., :3]
    residual = np.repeat((film.residual * studio.weight(film))[..., None], 3, axis=-1)
    return {
        "Final": whole,
        "Final: 10 x its error": np.asarray(10 * np.abs(shown - deep.picture), np.float32),
        "Final: 100 x its residual": np.asarray(100 * residual, np.float32),
    }


def _finite(value: Any) -> Any:
    """JSON has no NaN and no infinity: null."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
