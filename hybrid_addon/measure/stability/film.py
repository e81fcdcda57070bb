# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks, the film, and coplanar surfaces of which the raster's mask chooses one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ...scene import Film, Float32, PointLight, Scene, World
from . import build
from .case import Measured, Theme
from .compare import different_pixels, films_differ

THEME = Theme("Masks, film, determinism")
SAMPLES = 4


def masked(scene: Scene, mask: Float32 | None, **settings: Any) -> Film:
    """The scene as hybrid mode traces it."""
    return build.shoot(scene, mask=mask, **{"camera_sees": "RAY_TRACED", "samples": SAMPLES, **settings})


def glass_scene(size: tuple[int, int] = (48, 48)) -> Scene:
    """A ray traced glass ball on an unflagged floor."""
    lens = build.camera((0, -4, 1), (0, 0, 0.3), (0, 0, 1), size, 0.4)
    plain = {"ray_traced": False}
    parts = ((build.icosphere(3, 0.7), build.glass(1.5)), (build.floor(3, -0.7), build.matte((0.7, 0.4, 0.2)), plain))
    return build.make_scene(
        *parts, camera=lens, lights=(PointLight("p", (2, -2, 4), (30, 30, 30)),), world=World((0.2, 0.3, 0.4))
    )


@THEME.case(36, "empty-mask", "a mask without a pixel", "nothing is traced, nothing is seen", 0, "rays")
def _() -> Measured:
    film = masked(glass_scene(), np.zeros((48, 48), np.float32))
    lit = int(np.count_nonzero(film.radiance)) + int(np.count_nonzero(film.coverage))
    return Measured(sum(film.rays.values()) + lit, f"{film.time['total']['wall'] * 1e3:.1f} ms")


@THEME.case(
    36,
    "mask-of-one-pixel",
    "each of 16 pixels traced alone, with a filter that reaches no other",
    "the pixels of the whole picture, bit by bit",
    0,
    "pixels",
)
def _() -> Measured:
    scene = glass_scene()
    whole, wrong = masked(scene, np.ones((48, 48), np.float32), filter_radius=0.5), 0
    for k in range(16):
        mask = np.zeros((48, 48), np.float32)
        i, j = 20 + k % 4 * 2, 17 + k // 4 * 4
        mask[i, j] = 0.5
        film = masked(scene, mask, filter_radius=0.5)
        inside = (film.radiance[i, j] != whole.radiance[i, j]).any()
        wrong += int(inside) + int(np.count_nonzero(film.radiance[mask == 0]))
    return Measured(wrong)


@THEME.case(
    36, "full-mask", "every pixel in the mask", "as without a mask where the object is, bit by bit", 0, "pixels"
)
def _() -> Measured:
    scene = glass_scene()
    whole, full = masked(scene, None), masked(scene, np.ones((48, 48), np.float32))
    there = whole.coverage > 0
    return Measured(different_pixels(full.radiance[there], whole.radiance[there]), "", full.radiance)


@THEME.case(
    36,
    "ray-traced-object-out-of-view",
    "the ray traced ball behind the camera, full mask",
    "black and finite, coverage 0",
    0,
    "pixels",
)
def _() -> Measured:
    scene = glass_scene()
    away = replace(scene.instances[0], matrix_world=build.translation(0, -50, 0))
    film = masked(replace(scene, instances=(away, scene.instances[1])), np.ones((48, 48), np.float32))
    return Measured(int(np.count_nonzero(film.radiance)) + int(np.count_nonzero(film.coverage)))


@THEME.case(
    36,
    "thin-wire",
    "a wire of 1/100 pixel in the mask that two samples a pixel miss",
    "every masked pixel shows the wire",
    0,
    "pixels",
)
def _() -> Measured:
    w = 0.0015
    wire = build.quad([(-w, -9, 0), (w, -9, 0), (w, 9, 0), (-w, 9, 0)])
    scene = build.make_scene((wire, build.emitter(1, 0.5, 0.25)))
    mask = np.zeros((32, 32), np.float32)
    mask[:, 15:17] = 0.01
    film = masked(scene, mask, samples=2)
    wrong = (film.radiance != np.array([1, 0.5, 0.25], np.float32)).any(-1) & (mask > 0)
    return Measured(int(np.count_nonzero(wrong)), "of 64 pixels")


def decal(order: int, seed: int) -> Scene:
    """A ray traced decal exactly in the plane of an unflagged wall; tilted, and differently cut into triangles."""
    turn = build.rotation(seed)
    wall = (build.floor(4), build.emitter(0.1, 0.1, 0.1), {"matrix_world": turn, "ray_traced": False})
    n = 7
    x = np.linspace(-1, 1, n)
    corners = [(a, b, 0) for b in x for a in x]
    k = [j * n + i for j in range(n - 1) for i in range(n - 1)]
    cut = build.mesh(corners, [t for c in k for t in ((c, c + 1, c + n + 1), (c, c + n + 1, c + n))])
    sticker = (cut, build.emitter(1, 0.5, 0.25), {"matrix_world": turn})
    lens = build.camera(5 * turn[:3, 2], (0, 0, 0), turn[:3, 1], (48, 48), 0.17)
    return build.make_scene(*((wall, sticker) if order else (sticker, wall)), camera=lens)


@THEME.case(
    25,
    "decal-in-the-mask",
    "a ray traced decal coplanar with an unflagged wall, in the mask, either order",
    "every masked pixel shows the decal",
    0,
    "pixels",
)
def _() -> Measured:
    wrong, lost, mask = 0, 0, np.ones((48, 48), np.float32)
    for order in (0, 1):
        for seed in (1, 2, 3):
            film = masked(decal(order, seed), mask)
            wrong += int(np.count_nonzero((film.radiance != np.array([1, 0.5, 0.25], np.float32)).any(-1)))
            lost += int(np.count_nonzero(film.coverage < 1))
    return Measured(wrong, f"in {lost} of 13824 pixels the wall won some samples; the raster's mask decides there")


@THEME.case(
    25,
    "coplanar-surfaces-are-stable",
    "the decal with 1 and 2 threads, chunks of 64 and 16384",
    "the same picture, bit by bit",
    0,
)
def _() -> Measured:
    films = [masked(decal(0, 1), None, threads=t, chunk=c) for t, c in ((1, 1 << 14), (2, 64), (2, 1 << 14))]
    return Measured(max(films_differ(films[0], f) for f in films[1:]))
