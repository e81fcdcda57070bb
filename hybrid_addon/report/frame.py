# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of one frame: a plain dict for JSON (docs/manual/report.md has its keys), and two lines for the panel."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..scene import Film, Float32

SCHEMA = 1
EMPTY_RAYS = {"camera": 0, "reflected": 0, "refracted": 0, "shadow": 0, "dropped": 0}


def frame_report(
    *,
    versions: Mapping[str, str],
    settings: Mapping[str, Any],
    frame: int,
    resolution: tuple[int, int],
    mask: Float32,
    film: Film | None,
    counts: Mapping[str, int],
    time: Mapping[str, Mapping[str, float]],
    warnings: Sequence[str],
    skipped: Sequence[Mapping[str, Any]] = (),
) -> dict[str, Any]:
    """Assemble the report of one frame.

    mask : (h, w) float32 over the rendered window. film : None if nothing was traced.
    time : seconds by phase, {"raster": {"wall": s, "cpu": s}, ...}; the tracer's own phases come with the film.
    """
    traced = mask != 0
    residual: Float32 = np.zeros(1, np.float32)
    if film is not None and traced.any():
        residual = film.residual[traced]
    return {
        "schema": SCHEMA,
        "versions": {"python": ".".join(map(str, sys.version_info[:3])), "numpy": np.__version__, **versions},
        "frame": frame,
        "resolution": list(resolution),
        "settings": dict(settings),
        "mask_pixels": int(np.count_nonzero(traced)),
        "mask_coverage": float(mask.mean(dtype=np.float64)) if mask.size else 0.0,
        "triangles": int(counts.get("triangles", 0)),
        "counts": dict(counts),
        "time": {**(film.time if film else {}), **{phase: dict(seconds) for phase, seconds in time.items()}},
        "memory": dict(film.memory) if film else {},
        "denoising": dict(film.denoising) if film else {},
        "hits": dict(film.hits) if film else {},
        "rays": dict(film.rays) if film else dict(EMPTY_RAYS),
        "skipped": [*map(dict, skipped), *(film.skipped if film else [])],
        "plan": [*map(dict, film.plan)] if film else [],
        "error": {
            "bound_max": float(np.max(residual)),
            "bound_mean": float(np.mean(residual, dtype=np.float64)),
            "sampling": dict(film.sampling) if film else {},
        },
        "invariants": dict(film.invariants) if film else {},
        "warnings": list(warnings),
    }


def summary(report: Mapping[str, Any]) -> tuple[str, str]:
    """Two lines for the panel: what was done and what it cost; then what to know about it."""
    time, rays = report["time"], sum(report["rays"].values())
    total = time.get("total", {}).get("wall", 0.0)
    raster = time.get("raster", {}).get("wall", 0.0)
    covered = report["mask_coverage"] * 100
    first = f"{total:.2f} s, EEVEE {raster:.2f} s, {rays / 1e6:.2f} million rays, {covered:.1f} % traced"
    broken = {name: count for name, count in report["invariants"].items() if count}
    if broken:
        return first, "Check: " + ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in broken.items())
    warnings = report["warnings"]
    if warnings:
        return first, warnings[0] + (f" (and {len(warnings) - 1} more)" if len(warnings) > 1 else "")
    sampling = report["error"]["sampling"]
    rmse = "" if sampling.get("rmse") is None else f", sampling error about {sampling['rmse']:.2g}"
    late = any("time budget" in entry["why"] for entry in report["skipped"])
    begin = f"In time: {sampling['samples_mean']:.1f} samples" if late else "No warnings"
    if report["denoising"].get("pixels"):
        return first, f"{begin}; denoised: no bound of the error there"
    return first, f"{begin}; cut-off error at most {report['error']['bound_max']:.2g}{rmse}"
