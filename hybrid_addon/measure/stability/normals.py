# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth normals on coarse meshes: what the shading normal and the true surface disagree about."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Scene, SunLight
from . import build
from .case import Measured, Theme
from .compare import largest

THEME = Theme("Smooth normals on coarse meshes")


@THEME.case(
    34,
    "reflection-stays-outside",
    "a coarse smooth mirror ball of 80 triangles around a blinding one, black world",
    "black: no reflected ray gets in",
    0,
)
def _() -> Measured:
    lens = build.camera((0, 0, 4), size=(64, 64), half=0.35)
    parts = ((build.icosphere(1, 1, True), build.mirror()), (build.icosphere(2, 0.9), build.emitter(100, 100, 100)))
    return Measured(largest(build.shoot(build.make_scene(*parts, camera=lens), max_depth=20, samples=4).radiance, 0))


@THEME.case(
    34,
    "refraction-stays-inside",
    "a coarse smooth glass ball in a white world, 64 bounces",
    "no black speckle: radiance + residual = 1",
    1e-6,
)
def _() -> Measured:
    lens = build.camera((0, 0, 4), size=(64, 64), half=0.3)
    scene = build.make_scene((build.icosphere(1, 1, True), build.glass(1.5)), camera=lens, world=build.WHITE_WORLD)
    film = build.shoot(scene, max_depth=16)
    return Measured(
        largest(film.radiance + film.residual[..., None], 1),
        f"darkest pixel {np.min(film.radiance):.4f}",
        film.radiance,
    )


@THEME.case(
    34,
    "refracted-rays-never-skip-the-inside",
    "a coarse smooth glass shell around a black ball that fills it",
    "the world is not seen through it: only reflections",
    1e-6,
)
def _() -> Measured:
    lens = build.camera((0, 0, 4), size=(64, 64), half=0.18)
    parts = ((build.icosphere(1, 1, True), build.glass(1.0001)), (build.icosphere(1, 0.999), build.BLACK_BODY))
    film = build.shoot(build.make_scene(*parts, camera=lens, world=build.WHITE_WORLD), max_depth=1)
    middle = film.radiance[20:44, 20:44]  # where Fresnel's reflection of IOR 1.0001 is below 1e-6
    return Measured(largest(middle, 0))


def sunlit(levels: int, smooth: bool = True) -> Scene:
    """A matte ball lit from the side."""
    lens = build.camera((0, 0, 4), size=(96, 96), half=0.28)
    sun = SunLight("sun", (1.0, 0.2, 0.15), (np.pi,) * 3)
    return build.make_scene((build.icosphere(levels, 1, smooth), build.matte((1, 1, 1))), camera=lens, lights=(sun,))


def lit_fraction(picture: Float32) -> float:
    """Share of the ball's pixels with light on them."""
    return float(np.count_nonzero(picture[..., 0] > 0)) / float(np.count_nonzero(ball_pixels()))


def ball_pixels() -> NDArray[np.bool_]:
    """(96, 96) bool: where the fine ball is."""
    return build.shoot(replace(sunlit(4), lights=()), camera_sees="RAY_TRACED").coverage > 0


@THEME.case(
    34,
    "terminator",
    "a matte ball of 320 triangles lit from the side, smooth shaded",
    "lit fraction as on a ball of 5120 triangles",
    0.02,
    "share of pixels",
)
def _() -> Measured:
    coarse, fine = build.shoot(sunlit(2)).radiance, build.shoot(sunlit(4)).radiance
    a, b = lit_fraction(coarse), lit_fraction(fine)
    return Measured(abs(a - b), f"{a:.3f} against {b:.3f}", np.concatenate([coarse, fine], axis=1))


@THEME.case(
    34, "no-black-speckles", "the same: pixels that the sun clearly reaches and that are black", "none", 0, "pixels"
)
def _() -> Measured:
    coarse, fine = build.shoot(sunlit(2)).radiance[..., 0], build.shoot(sunlit(5)).radiance[..., 0]
    there = build.shoot(replace(sunlit(2), lights=()), camera_sees="RAY_TRACED").coverage > 0
    return Measured(
        int(np.count_nonzero((coarse == 0) & (fine > 0.1) & there)),
        "a tenth of the full light or more on the fine ball",
    )
