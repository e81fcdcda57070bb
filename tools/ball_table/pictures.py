# SPDX-License-Identifier: GPL-3.0-or-later
"""The balls by EEVEE, Cycles and hybrid; EEVEE's and Cycles' pictures may be kept. How far each ball is off."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

import hybrid_addon
from hybrid_addon.blender.render import images

from . import rows
from .stage import EEVEE_SAMPLES, SIZE

WITHIN = 0.02
"""Mean difference from the nearer of EEVEE and Cycles, as a share of the mean, that a ball may have."""
VERSION = 1
"""Of the stage: raise it to have EEVEE's and Cycles' pictures drawn anew."""
CYCLES_SAMPLES = 256
"""With 64, what glass and transparent share out is 1 to 2 % of noise."""
LEAST_MEAN = 0.01
"""Means below this count as this: a holdout is not compared with what the pixel filter brings it from around it."""
WITHIN_RADIUS = 0.36
"""Of a ball's square, whose side is 1: the blocks that lie wholly on the ball."""


@dataclass(frozen=True)
class Row:
    """A ball: its label and value, how far it is from EEVEE's and from Cycles', and whether it is warned of."""

    label: str
    value: Any
    eevee: float
    cycles: float
    warned: bool

    @property
    def nearer(self) -> float:
        """How far it is from the nearer of the two."""
        return min(self.eevee, self.cycles)

    @property
    def explained(self) -> bool:
        """Whether it is near enough, or warned of, or there is a reason in `rows.WHY`."""
        return self.nearer <= WITHIN or self.warned or self.label in rows.WHY


def compared(b_scene: Any, found: Sequence[tuple[str, Any]], across: int, keep: Path | None = None) -> list[Row]:
    """The rows of the balls `found`, as `stage.build` returns them.

    keep : folder that EEVEE's and Cycles' pictures are kept in until the balls change; None: nowhere.
    """
    hybrid_addon.enable(b_scene)
    b_scene.hybrid.rough_samples = 8
    balls = [VERSION, list(found), SIZE, rows.GGX, rows.PARTS, rows.NODES, rows.PRINCIPLED, bpy.app.version_string]
    pictures = {}
    for name, draw in (("eevee", _eevee), ("hybrid", _hybrid), ("cycles", _cycles)):
        path = keep / f"{name}.npy" if keep is not None and name != "hybrid" else None
        key = repr([*balls, CYCLES_SAMPLES if name == "cycles" else EEVEE_SAMPLES])
        if path is not None and _is_kept(path, key):
            pictures[name] = np.load(path)
            continue
        pictures[name] = draw(b_scene)
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            np.save(path, pictures[name])
            path.with_suffix(".json").write_text(json.dumps(key), encoding="utf-8")
    warnings = b_scene.get("ball table", [])
    result = []
    for number, (label, value) in enumerate(found):
        ours, eevee, cycles = (blocks(pictures[name], number, across) for name in ("hybrid", "eevee", "cycles"))
        warned = any(f"'{label} {value}'" in warning for warning in warnings)
        result.append(Row(label, value, apart(ours, eevee), apart(ours, cycles), warned))
    return result


def _is_kept(path: Path, key: str) -> bool:
    note = path.with_suffix(".json")
    return path.exists() and note.exists() and json.loads(note.read_text(encoding="utf-8")) == key


def _eevee(b_scene: Any) -> np.ndarray:
    return np.array(hybrid_addon.render(b_scene, mode="raster").image)[..., :3]


def _hybrid(b_scene: Any) -> np.ndarray:
    traced = hybrid_addon.render(b_scene, mode="full", samples=8)
    b_scene["ball table"] = list(traced.report["warnings"])
    return np.array(traced.image)[..., :3]


def _cycles(b_scene: Any) -> np.ndarray:
    hybrid_addon.disable(b_scene)
    b_scene.render.engine, cycles = "CYCLES", b_scene.cycles
    cycles.device, cycles.samples = "CPU", CYCLES_SAMPLES
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.blur_glossy = cycles.sample_clamp_indirect = 0.0
    bpy.ops.render.render(scene=b_scene.name)
    planes = images.read_render_result(b_scene)
    return next(pixels for name, pixels in planes.items() if name.endswith("Combined"))[..., :3]


def blocks(picture: np.ndarray, number: int, across: int) -> np.ndarray:
    """One ball's square as means of 4 x 4 pixels, those off its edge (n, 3): what Cycles' noise leaves."""
    i, j = number % across * SIZE, number // across * SIZE
    square = picture[j : j + SIZE, i : i + SIZE].astype(np.float64)
    square = square.reshape(SIZE // 4, 4, SIZE // 4, 4, 3).mean(axis=(1, 3))
    y, x = (np.mgrid[0 : SIZE // 4, 0 : SIZE // 4] + 0.5) / (SIZE // 4) - 0.5
    return square[x * x + y * y < WITHIN_RADIUS**2]


def apart(picture: np.ndarray, reference: np.ndarray) -> float:
    """Mean difference as a share of the reference's mean."""
    return float(np.abs(picture - reference).mean() / max(reference.mean(), LEAST_MEAN))
