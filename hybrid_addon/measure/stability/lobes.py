# SPDX-License-Identifier: GPL-3.0-or-later
"""Thin films and brushed surfaces at the ends of their sliders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import BLACK, Expression, Float32, PointLight, Surface
from . import build
from .case import Measured, Theme
from .compare import different_pixels, largest

THEME = Theme("Thin films and brushed surfaces")

NORMAL = Expression("attribute", (), "normal")
ALONG_X = Expression("add", (Expression("multiply", (NORMAL, 0.0)), (1.0, 0.0, 0.0)))
FAINT_TINT = (1e-6, 1e-6, 1e-6)  # of reflections, so that only what passes is seen
GLASS = Surface(layered=True, opacity=0.0, ior=1.5, roughness=0.0)


def _pane(surface: Surface, rough_samples: int = 0) -> Float32:
    """What a pane of it shows of a white world and a lamp of no power, (h, w, 3)."""
    pane = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])
    lamp = PointLight("lamp", (0.0, 0.0, 3.0), BLACK, radius=0.1)
    scene = build.make_scene((pane, surface), camera=build.camera(size=(8, 8)), world=build.WHITE_WORLD, lights=(lamp,))
    return build.shoot(scene, rough_samples=rough_samples).radiance


def _beyond(seen: Float32) -> float:
    """By how much radiance leaves 0 .. 1; infinite if it is no number."""
    if not np.isfinite(seen).all():
        return float("inf")
    return max(float(np.max(seen)) - 1, -float(np.min(seen)), 0.0)


@THEME.case(39, "a-film-of-0-nm", "glass with a film of index 2, 0 nm thick", "the bits of glass without one", 0.0)
def _() -> Measured:
    return Measured(different_pixels(_pane(replace(GLASS, film=0.0, film_ior=2.0)), _pane(GLASS)))


@THEME.case(
    39, "a-film-of-1-mm", "a film of index 1.33 in air, 1e6 nm thick, seen through", "as a pane, no colour", 1e-4
)
def _() -> Measured:
    bubble = replace(GLASS, ior=1 + 2.0**-20, film=1e6, film_ior=1.33, interface_tint=FAINT_TINT)
    seen, once = _pane(bubble)[3:5, 3:5], (0.33 / 2.33) ** 2
    return Measured(largest(seen, 1 - 2 * once / (1 + once)))


@THEME.case(39, "a-film-of-index-1", "glass below films of index 1, 1 to 1e6 nm", "as glass without one", 2e-5)
def _() -> Measured:
    bare = _pane(replace(GLASS, interface_tint=FAINT_TINT))
    found = [_pane(replace(GLASS, interface_tint=FAINT_TINT, film=nm, film_ior=1.0)) for nm in (1.0, 400.0, 1e6)]
    return Measured(max(largest(one, bare) for one in found))


@THEME.case(39, "films-of-all-kinds", "0.01 to 1e9 nm of index 1e-5 to 1e5 on glass and metal", "within 0 .. 1", 1e-6)
def _() -> Measured:
    worst = 0.0
    for nm in (0.01, 100.0, 1e9):
        for index in (1e-5, 1.5, 1e5):
            for body in (GLASS, Surface(layered=True, reflectivity=1.0, roughness=0.3, edge_tint=(0.5, 1.0, 0.0))):
                seen = _pane(replace(body, film=nm, film_ior=index))
                worst = max(worst, _beyond(seen))
    return Measured(worst)


@THEME.case(
    39, "an-anisotropy-of-1", "metal stretched by 0.316 and by 1e-2 and 1e2, in a white world", "within 0 .. 1", 1e-6
)
def _() -> Measured:
    worst = 0.0
    for stretch in (0.1**0.5, 0.01, 100.0):
        for roughness in (0.05, 0.5, 1.0):
            metal = Surface(layered=True, reflectivity=1.0, roughness=roughness, stretch=stretch, tangent=ALONG_X)
            seen = _pane(metal, rough_samples=2)
            worst = max(worst, _beyond(seen))
    return Measured(worst)
