# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that are sums of closures: extreme weights, many of them, IORs that vary through 1, dispersion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import Closure, Expression, Float32, Sphere, Surface
from . import build
from .case import Measured, Theme
from .compare import largest

THEME = Theme("Sums of closures")

BACKFACING = Expression("attribute", (), "backfacing")
HEIGHT = Expression("channel", (Expression("attribute", (), "position"),), 1)
MIRROR, CLEAR = Surface(reflectivity=1.0), Surface(opacity=0.0, ior=1.0)
WHITE_WALL = Surface(base_color=(1.0, 1.0, 1.0))


def _sum(*parts: tuple[float | Expression, Surface]) -> Surface:
    return Surface(closures=tuple(Closure(weight, surface) for weight, surface in parts))


def _pane(surface: Surface, samples: int = 1) -> Float32:
    """What a pane of it shows of a white world, (h, w, 3): the sum of the weights, where each closure loses nothing."""
    pane = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])
    scene = build.make_scene((pane, surface), camera=build.camera(size=(8, 8)), world=build.WHITE_WORLD)
    return build.shoot(scene, samples=samples).radiance


def _ball(surface: Surface) -> Float32:
    """What a ball of it shows of a white world, (h, w, 3). No ray that enters it is caught inside."""
    ball = Sphere("ball", (0.0, 0.0, 0.0), 1.0, 0, ray_traced=True)
    scene = build.make_scene(camera=build.camera(size=(24, 24)), world=build.WHITE_WORLD)
    return build.shoot(replace(scene, spheres=(ball,), surfaces=(surface,)), max_depth=64).radiance


@THEME.case(38, "shares-of-one", "mirror, wall, clear and glass pane, a quarter each", "a white world is white", 2e-6)
def _() -> Measured:
    glass = Surface(opacity=0.0, ior=1.5)
    seen = _pane(_sum((0.25, MIRROR), (0.25, WHITE_WALL), (0.25, CLEAR), (0.25, glass)))
    return Measured(largest(seen, 1.0), f"{float(np.min(seen)):.7f} to {float(np.max(seen)):.7f}")


@THEME.case(38, "a-sum-above-one", "two mirrors and a wall, added", "3 times the world", 2e-6)
def _() -> Measured:
    return Measured(largest(_pane(_sum((1.0, MIRROR), (1.0, MIRROR), (1.0, WHITE_WALL))), 3.0))


@THEME.case(
    38, "extreme-weights", "weights of 1e-30 and 1e20 beside 1", "finite; the sum of what they weigh", 1e-6, "relative"
)
def _() -> Measured:
    small = _pane(_sum((1e-30, MIRROR), (1.0, WHITE_WALL)))
    large = _pane(_sum((1e20, MIRROR), (1.0, WHITE_WALL)))
    return Measured(max(largest(small, 1.0), largest(large / np.float32(1e20), 1.0)))


@THEME.case(38, "64-closures", "64 mirrors of 1 / 64, of which a sample takes 16", "a white world is white", 2e-5)
def _() -> Measured:
    mirrors = [Surface(reflectivity=1.0, roughness=0.01 * k) for k in range(64)]
    return Measured(largest(_pane(_sum(*((1 / 64, mirror) for mirror in mirrors)), samples=4), 1.0))


@THEME.case(38, "factors-that-are-no-numbers", "weights NaN and -1 beside a wall of 1", "they weigh nothing", 1e-6)
def _() -> Measured:
    nan = Expression("add", (BACKFACING, float("nan")))
    below = Expression("subtract", (BACKFACING, 1.0))
    return Measured(largest(_pane(_sum((nan, MIRROR), (below, MIRROR), (1.0, WHITE_WALL))), 1.0))


@THEME.case(38, "nothing-is-left", "all weights 0", "black, and no light is lost count of", 0.0)
def _() -> Measured:
    return Measured(largest(_pane(_sum((0.0, MIRROR), (Expression("multiply", (BACKFACING, 0.0)), WHITE_WALL))), 0.0))


@THEME.case(
    38, "ior-varies-through-1", "a ball of glass, IOR 0.5 to 1.5 from bottom to top", "a white world is white", 2e-3
)
def _() -> Measured:
    ior = Expression("add", (Expression("multiply", (HEIGHT, 0.5)), 1.0))
    seen = _ball(Surface(opacity=0.0, ior=ior))
    return Measured(largest(seen, 1.0), picture=seen)


@THEME.case(38, "glass-of-two-glasses", "a ball, half of IOR 1.2 and half of 1.8", "a white world is white", 2e-3)
def _() -> Measured:
    both = _sum((0.5, Surface(opacity=0.0, ior=1.2)), (0.5, Surface(opacity=0.0, ior=1.8)))
    return Measured(largest(_ball(both), 1.0))


@THEME.case(
    38, "dispersion-at-its-ends", "a ball of dispersion 0.36 and 100", "a white world is white, without colour", 2e-3
)
def _() -> Measured:
    worst, seen = 0.0, []
    for dispersion in (0.36, 100.0):
        picture = _ball(Surface(opacity=0.0, ior=1.6, dispersion=dispersion))
        seen.append(f"{float(np.max(np.ptp(picture, axis=2))):.1e}")
        worst = max(worst, largest(picture, 1.0))
    return Measured(worst, "between channels: " + ", ".join(seen))
