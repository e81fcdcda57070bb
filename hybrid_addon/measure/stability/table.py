# SPDX-License-Identifier: GPL-3.0-or-later
"""All cases in one table, and running them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from . import (  # some files only add cases to a theme of another one
    cameras,
    degenerate,
    determinism,
    effects,
    energy,
    film,
    fog,
    fresnel,
    invariance,
    lamps,
    lenses,
    lighting,
    lobes,
    media,
    normals,
    optics,
    rays,
    sheets,
    strength,
    sums,
    transforms,
)
from .case import Case, Result

MODULES = (
    invariance, rays, fresnel, optics, lenses, energy, media, sheets, degenerate, transforms, lighting, lamps, strength,
    normals, cameras, film, determinism, effects, sums, lobes, fog,
)  # fmt: skip
THEMES = tuple(dict.fromkeys(module.THEME for module in MODULES))
CASES: tuple[Case, ...] = tuple(case for theme in THEMES for case in theme.cases)

SCHEMA = 1
SITUATIONS: dict[int, str] = {
    1: "uniform scale", 2: "far from the origin", 3: "rotation", 4: "grazing angles", 5: "critical angle",
    6: "IOR 1", 7: "IOR 1 +- a little", 8: "IOR below 1", 9: "huge IOR", 10: "impossible IOR",
    11: "nested and touching media", 12: "camera inside glass", 13: "open glass", 14: "inverted normals",
    15: "two mirrors", 16: "plane-parallel plate", 17: "prism, corner cube, periscope", 18: "mesh against formula",
    19: "white furnace", 20: "R + T = 1", 21: "degenerate triangles", 22: "NaN and infinity", 23: "odd matrices",
    24: "mirrored and many instances", 25: "coplanar surfaces", 26: "thin glass", 27: "lights in odd places",
    28: "extreme light", 29: "ends of the sliders", 30: "clip planes", 31: "lenses and projections",
    32: "odd resolutions and tiles", 33: "large meshes", 34: "smooth normals", 35: "edits between frames",
    36: "masks", 37: "determinism", 38: "sums of closures", 39: "thin films and brushed surfaces", 40: "fog",
}  # fmt: skip
"""The situations by number, as docs/stability.md lists them; every one has at least one case."""


def run(cases: Sequence[Case]) -> Iterator[tuple[Case, Result]]:
    """Run cases one after the other."""
    for case in cases:
        yield case, case.run()


def to_json(results: Sequence[tuple[Case, Result]], versions: Mapping[str, str]) -> dict[str, Any]:
    """A plain, JSON-able dict of everything but the pictures; a value that is not finite is null."""
    return {
        "schema": SCHEMA,
        "versions": dict(versions),
        "cases": len(results),
        "passed": sum(result.passed for _, result in results),
        "seconds": sum(result.seconds for _, result in results),
        "results": [
            {
                "number": case.number,
                "situation": SITUATIONS[case.number],
                "name": case.name,
                "theme": case.theme,
                "what": case.what,
                "answer": case.answer,
                "value": result.value if math.isfinite(result.value) else None,
                "tolerance": case.tolerance,
                "unit": case.unit,
                "passed": result.passed,
                "detail": result.detail,
                "seconds": round(result.seconds, 3),
            }
            for case, result in results
        ],
    }
