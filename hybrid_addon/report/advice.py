# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects need rays, why, and what rays would cost: a survey in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..tracer.integrator.survey import KINDS, Survey

LEAST_SHARE = 0.02
"""An object is worth rays if this share of its light comes in ways that EEVEE cannot follow."""

REASONS = {
    "OFF_SCREEN": "mirrors what the picture does not show",
    "UNSEEN": "mirrors glass or blended materials, which EEVEE leaves out of reflections",
    "MIRRORS": "mirrors other mirrors",
    "BEHIND": "has glass behind its glass, which EEVEE leaves out",
    "REFRACTED": "refracts light more than once",
}


def advice(
    survey: Survey, owners: Sequence[str], ray_traced: set[str], *, pixels: int, samples: int, threads: int
) -> list[dict[str, Any]]:
    """What is known of each object that the survey found worth rays, or that is ray traced; most of the picture first.

    owners  : of each of the survey's objects the one to flag.   ray traced : those that are.
    pixels, samples, threads : of the render whose cost is estimated.

    Each: object, coverage (share of the picture), needs (share of its light that EEVEE cannot follow), why (one short
    sentence each, the most important first), suggested, ray_traced, rays and seconds (an estimate, without building).
    """
    names = list(dict.fromkeys(owners))
    number = np.array([names.index(owner) for owner in owners], np.intp)
    shown = _sum(number, survey.pixels, len(names))
    needs = _sum(number, survey.pixels * survey.needs, len(names)) / np.maximum(shown, 1)
    shares = [_sum(number, survey.pixels * share, len(names)) / np.maximum(shown, 1) for share in survey.shares]
    rays = _sum(number, survey.pixels * survey.rays, len(names)) / survey.all_pixels * pixels * samples
    found = [
        {
            "object": name,
            "coverage": float(shown[i] / survey.all_pixels),
            "needs": float(needs[i]),
            "why": _why({kind: float(share[i]) for kind, share in zip(KINDS, shares, strict=True)}),
            "suggested": bool(needs[i] >= LEAST_SHARE),
            "ray_traced": name in ray_traced,
            "rays": round(float(rays[i])),
            "seconds": float(rays[i] * survey.seconds_per_ray / threads),
        }
        for i, name in enumerate(names)
    ]
    worth = [entry for entry in found if entry["suggested"] or entry["ray_traced"]]
    return sorted(worth, key=lambda entry: (-entry["coverage"] * entry["needs"], -entry["coverage"], entry["object"]))


def _sum(number: np.ndarray, values: np.ndarray, size: int) -> np.ndarray:
    return np.bincount(number, values, minlength=size)


def _why(shares: dict[str, float]) -> list[str]:
    order = sorted(shares, key=lambda kind: -shares[kind])
    told = [f"{REASONS[kind]} ({shares[kind] * 100:.0f} % of its light)" for kind in order if shares[kind] >= 0.005]
    return told or ["nothing that EEVEE cannot draw"]


def sentence(entry: dict[str, Any]) -> str:
    """One line: what, how much of the picture, why, and the cost."""
    what = f"{entry['object']}: {entry['coverage'] * 100:.1f} % of the picture; {', '.join(entry['why'])}"
    return f"{what}; {cost(entry)}"


def cost(entry: dict[str, Any]) -> str:
    """The estimate as people read it."""
    return f"about {entry['seconds']:.2g} s" if entry["seconds"] < 100 else f"about {entry['seconds'] / 60:.0f} min"
