# SPDX-License-Identifier: GPL-3.0-or-later
"""One scene three times: EEVEE with Raytracing, Hybrid at its defaults, Cycles; each kept, so that it is drawn once."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenImageIO as oiio
from demo import row, view_transformed

import hybrid_addon as hybrid
from hybrid_addon.blender.render import images
from hybrid_addon.blender.sync.image_file import srgb_to_linear
from hybrid_addon.clock import Clock
from hybrid_addon.measure.error_time import metrics

from . import ROOT

CHUNK = 512
"""Samples of Cycles in one render: what a stop in between can lose."""

BOUNCES = 32


class Drawing:
    """The pictures of one scene in a folder; `notes` says what each was drawn with, and how long it took."""

    def __init__(self, build: Callable[[], None], size: tuple[int, int], samples: int | None, folder: Path) -> None:
        self.folder, self.size, self.samples = folder, size, samples
        folder.mkdir(parents=True, exist_ok=True)
        build()
        self.scene = bpy.context.scene
        self.source = [
            hashlib.sha256(inspect.getsource(build).encode()).hexdigest()[:12],
            *size,
            bpy.app.version_string,
        ]
        path = folder / "notes.json"
        self.notes: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}

    def draw(self, cycles_samples: int) -> dict[str, Any]:
        """What is missing, the sheet, and the scene's figures."""
        self._once("eevee", [*self.source, self.samples], self._eevee)
        self._once("hybrid", [*self.source, self.samples, _tracer()], self._hybrid)
        self._cycles(cycles_samples)
        return self._compare()

    def _once(self, name: str, key: list[Any], work: Callable[[], dict[str, Any]]) -> None:
        if self.notes.get(name, {}).get("key") != key:
            self._note(name, {"key": key, **work()})

    def _note(self, name: str, what: dict[str, Any]) -> None:
        self.notes[name] = what
        (self.folder / "notes.json").write_text(json.dumps(self.notes, indent=1), encoding="utf-8")

    def _eevee(self) -> dict[str, Any]:
        self._small(lambda: _rendered(self.scene))
        picture, spent = _rendered(self.scene)
        images.write_exr(self.folder / "eevee.exr", picture)
        return spent

    def _hybrid(self) -> dict[str, Any]:
        self._small(lambda: hybrid.render(self.scene, samples=1))
        clock = Clock()
        result = hybrid.render(self.scene, samples=self.samples)
        spent = clock.read()
        images.write_exr(self.folder / "hybrid.exr", result.image)
        images.write_exr(self.folder / "mask.exr", result.mask)
        return {**spent, "warnings": result.report["warnings"], "time": result.report["time"]}

    def _small(self, work: Callable[[], Any]) -> None:
        """Let EEVEE compile its shaders on a small picture, and set the size and samples that count."""
        render, eevee = self.scene.render, self.scene.eevee
        render.resolution_x, render.resolution_y, eevee.taa_render_samples = 32, 24, 1
        work()
        render.resolution_x, render.resolution_y = self.size
        eevee.taa_render_samples = self.samples or 16

    def _cycles(self, samples: int) -> None:
        """Renders with other seeds, until all have enough samples together; at least two, which tell the noise."""
        note = self.notes.get("cycles", {})
        if note.get("key") != self.source:
            note = {"key": self.source, "chunks": [], "wall": 0.0, "cpu": 0.0}
        scene = self.scene
        scene.render.engine = "CYCLES"
        scene.render.resolution_x, scene.render.resolution_y = self.size
        c = scene.cycles
        c.device, c.use_adaptive_sampling, c.use_denoising = "CPU", False, False
        c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = BOUNCES
        c.transparent_max_bounces = BOUNCES
        c.blur_glossy = c.sample_clamp_direct = c.sample_clamp_indirect = 0.0
        while (missing := samples - sum(note["chunks"])) > 0:
            c.samples = min(CHUNK, missing, -(-samples // 2))
            c.seed = len(note["chunks"])
            picture, spent = _rendered(scene)
            images.write_exr(self.folder / f"cycles-{c.seed}.exr", picture)
            note["chunks"].append(c.samples)
            self._note("cycles", {**note, **{clock: note[clock] + spent[clock] for clock in spent}})
            note = self.notes["cycles"]

    def _compare(self) -> dict[str, Any]:
        """The sheet, and errors over the ray traced pixels as they are shown, against Cycles."""
        chunks = self.notes["cycles"]["chunks"]
        parts = [self._read(f"cycles-{seed}") for seed in range(len(chunks))]
        linear = {"eevee": self._read("eevee"), "hybrid": self._read("hybrid"), "cycles": _mean(parts, chunks)}
        shown = {name: self._shown(name, picture) for name, picture in linear.items()}
        row([self.folder / f"{name}.png" for name in linear], self.folder / "sheet.png")
        ray_traced = self._read("mask")[..., 0] > 0.5
        halves = [self._shown(f"half{i}", _mean(parts[i::2], chunks[i::2])) for i in (0, 1)] if len(parts) > 1 else []
        found: dict[str, Any] = {"ray traced": float(ray_traced.mean()), "cycles samples": sum(chunks)}
        found["noise"] = metrics.rmse(halves[0], halves[1], ray_traced) / 2 if halves else None
        for name in ("eevee", "hybrid"):
            difference = metrics.flip(srgb_to_linear(shown[name]), srgb_to_linear(shown["cycles"]))
            found[f"{name} rmse"] = metrics.rmse(shown[name], shown["cycles"], ray_traced)
            found[f"{name} flip"] = None if difference is None else float(difference[ray_traced].mean())
        for name in ("eevee", "hybrid", "cycles"):
            found[f"{name} wall"], found[f"{name} cpu"] = self.notes[name]["wall"], self.notes[name]["cpu"]
        return {**found, "warnings": self.notes["hybrid"]["warnings"]}

    def _read(self, name: str) -> np.ndarray:
        return next(iter(images.read_exr(self.folder / f"{name}.exr").values()))

    def _shown(self, name: str, picture: np.ndarray) -> np.ndarray:
        """The picture as the file's view transform shows it, 0..1, bottom row first; written as PNG, too."""
        path = self.folder / f"{name}.png"
        opaque = np.ones((*picture.shape[:2], 4), np.float32)
        opaque[..., :3] = picture[..., :3]
        view_transformed(self.scene, opaque, path, raw=False)
        return np.asarray(oiio.ImageBuf(str(path)).get_pixels("float"), np.float32)[::-1, :, :3]


def _mean(parts: list[np.ndarray], weights: list[int]) -> np.ndarray:
    return np.average(np.stack(parts).astype(np.float64), axis=0, weights=weights).astype(np.float32)


def _rendered(scene: bpy.types.Scene) -> tuple[np.ndarray, dict[str, float]]:
    """F12 by the engine that is set, and its seconds, wall and of all processors."""
    hybrid.disable(scene)
    clock = Clock()
    bpy.ops.render.render(scene=scene.name)
    spent = clock.read()
    planes = images.read_render_result(scene)
    return next(pixels for name, pixels in planes.items() if name.endswith("Combined")), spent


def _tracer() -> str:
    """A digest of the add-on's source: Hybrid's picture is drawn anew after each change of it."""
    total = hashlib.sha256()
    for path in sorted((ROOT / "hybrid_addon").rglob("*.py")):
        total.update(path.read_bytes())
    return total.hexdigest()[:12]
