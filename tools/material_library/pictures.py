# SPDX-License-Identifier: GPL-3.0-or-later
"""Ten materials, drawn by EEVEE without Raytracing, by Cycles and by Hybrid; all but Hybrid's are kept."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from demo import view_transformed

import hybrid_addon as hybrid
from hybrid_addon.blender.render import images
from hybrid_addon.blender.sync.image import srgb_to_linear
from hybrid_addon.measure.error_time import metrics

from . import stage, tree

REFERENCES = ("eevee", "cycles")
SHOWN = ("eevee", "hybrid", "cycles")
EEVEE_SAMPLES = 8

LEAST_COVERAGE = 0.05
"""Of the pixels that are compared: a bubble covers little."""


def draw(names: Sequence[str], size: int, cycles_samples: int, stem: Path) -> dict[str, dict[str, Any]]:
    """The figures of each material; the pictures lie beside `stem`, and stem.png has three of them below one another.

    size: pixels that a material is wide. For each reference: see `compare`, over the pixels that the thing covers.
    """
    scene, trees = stage.build(names, size)
    engine = scene.render.engine
    key = [stage.VERSION, *map(tree.digest, trees), size, EEVEE_SAMPLES, bpy.app.version_string]
    for kind in REFERENCES:
        note = _path(stem, kind, "json")
        wanted = [*key, cycles_samples] if kind == "cycles" else key
        if not note.exists() or json.loads(note.read_text(encoding="utf-8")) != wanted:
            scene.render.engine = engine
            images.write_exr(_path(stem, kind, "exr"), _reference(scene, kind, cycles_samples))
            note.write_text(json.dumps(wanted), encoding="utf-8")
    scene.render.engine, scene.eevee.use_raytracing = engine, False
    scene.eevee.taa_render_samples = EEVEE_SAMPLES
    result = hybrid.render(scene)
    images.write_exr(_path(stem, "hybrid", "exr"), result.image)
    linear = {kind: _read(_path(stem, kind, "exr")) for kind in (*REFERENCES, "hybrid")}
    shown = {kind: _show(scene, picture, _path(stem, kind, "png")) for kind, picture in linear.items()}
    _stack([_path(stem, kind, "png") for kind in SHOWN], stem.with_suffix(".png"))
    warnings, seconds = result.report["warnings"], result.report["time"].get("trace", {}).get("wall", 0.0)
    found = {}
    for name, columns in stage.slices(names, result.mask.shape[1]).items():
        covered = result.mask[:, columns] > LEAST_COVERAGE
        pictures = {kind: (linear[kind][:, columns], shown[kind][:, columns]) for kind in linear}
        found[name] = {
            "warnings": [warning for warning in warnings if f"'{name}'" in warning],
            "seconds of all": seconds,
            **{kind: compare(pictures["hybrid"], pictures[kind], covered) for kind in REFERENCES},
            "apart": compare(pictures["eevee"], pictures["cycles"], covered),
        }
    named = {warning for figures in found.values() for warning in figures["warnings"]}
    for warning in warnings:
        if warning not in named:
            print(f"{stem.name}: of no single material: {warning}")
    return found


def compare(
    picture: tuple[np.ndarray, np.ndarray], reference: tuple[np.ndarray, np.ndarray], covered: np.ndarray
) -> dict[str, float | None]:
    """How far pictures (linear, shown), (h, w, 3) each, are apart where covered (h, w).

    light: the linear mean over the reference's, less 1. mean: the mean of the absolute difference over the reference's
    mean, of means of squares of 4 x 4 pixels, since Cycles has noise. flip: FLIP's mean,
    None without its library.
    """
    a, b = (_coarse(which[0], covered) for which in (picture, reference))
    if not len(b):
        return {"light": None, "mean": None, "flip": None}
    mean = max(float(b.mean()), 1e-6)
    seen = metrics.flip(srgb_to_linear(picture[1]), srgb_to_linear(reference[1]))
    return {
        "light": float(a.mean()) / mean - 1.0,
        "mean": float(np.abs(a - b).mean()) / mean,
        "flip": None if seen is None else float(seen[covered].mean()),
    }


def _coarse(picture: np.ndarray, covered: np.ndarray) -> np.ndarray:
    """Means (n, 3) of the squares of 4 x 4 pixels that are covered (h, w) wholly."""
    height, width = (side // 4 * 4 for side in covered.shape)
    whole = covered[:height, :width].reshape(height // 4, 4, width // 4, 4).all(axis=(1, 3))
    parts = picture[:height, :width].astype(np.float64).reshape(height // 4, 4, width // 4, 4, 3)
    return parts.mean(axis=(1, 3))[whole]


def _path(stem: Path, kind: str, suffix: str) -> Path:
    return stem.with_name(f"{stem.name}.{kind}.{suffix}")


def _read(path: Path) -> np.ndarray:
    """The only picture of a file, (h, w, 3), bottom row first."""
    return next(iter(images.read_exr(path).values()))[..., :3]


def _show(scene: Any, picture: np.ndarray, path: Path) -> np.ndarray:
    """The picture as the view transform shows it, (h, w, 3) in 0..1, bottom row first; written as PNG, too."""
    import OpenImageIO as oiio

    opaque = np.ones((*picture.shape[:2], 4), np.float32)
    opaque[..., :3] = picture
    view_transformed(scene, opaque, path, raw=False)
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels("float"), np.float32)[::-1, :, :3]


def _reference(scene: Any, kind: str, cycles_samples: int) -> np.ndarray:
    """F12 by the engine of that name."""
    hybrid.disable(scene)
    if kind == "cycles":
        scene.render.engine = "CYCLES"
        cycles = scene.cycles
        cycles.device, cycles.use_denoising, cycles.use_adaptive_sampling = "CPU", False, False
        cycles.samples, cycles.blur_glossy, cycles.sample_clamp_indirect = cycles_samples, 0.0, 0.0
        cycles.max_bounces = cycles.transmission_bounces = cycles.glossy_bounces = 16
    else:
        scene.eevee.taa_render_samples, scene.eevee.use_raytracing = EEVEE_SAMPLES, False
    bpy.ops.render.render(scene=scene.name)
    planes = images.read_render_result(scene)
    return next(pixels for name, pixels in planes.items() if name.endswith("Combined"))


def _stack(pictures: Sequence[Path], target: Path) -> None:
    """Pictures of one size, below one another."""
    import OpenImageIO as oiio

    parts = [oiio.ImageBuf(str(path)) for path in pictures]
    width, height = parts[0].spec().width, parts[0].spec().height
    whole = oiio.ImageBuf(oiio.ImageSpec(width, height * len(parts), 3, "uint8"))
    for line, part in enumerate(parts):
        oiio.ImageBufAlgo.paste(whole, 0, line * height, 0, 0, oiio.ImageBufAlgo.channels(part, (0, 1, 2)))
    whole.write(str(target))
