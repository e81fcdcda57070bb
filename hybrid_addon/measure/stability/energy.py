# SPDX-License-Identifier: GPL-3.0-or-later
"""Nothing is lost and nothing comes from nowhere: furnaces, the residual as an error bound, the ends of sliders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import BLACK, Film, Instance, PointLight, Scene, Sphere, Surface, World
from . import build
from .case import Measured, Theme
from .compare import different_pixels, largest

THEME = Theme("Energy, error bound, ends of the sliders")
FURNACE_IORS = (1e-3, 1 / 1.5, 1.0003, 1.5, 2.42, 1e3)


def furnace(shape: str, ior: float, depth: int, reflectivity: float = 0.25) -> float:
    """The largest |radiance + residual - 1| of a lossless body in a white world."""
    lens = build.camera((0.3, -0.4, 3), size=(32, 32))
    surface = build.glass(ior, reflectivity=reflectivity)
    scene = build.make_scene(camera=lens, world=build.WHITE_WORLD, surfaces=(surface,))
    if shape == "sphere":
        scene = replace(scene, spheres=(Sphere("ball", (0, 0, 0), 1.0, 0),))
    else:
        body = build.box() if shape == "box" else build.icosphere(2, 1, shape == "smooth")
        scene = replace(scene, meshes=(body,), instances=(Instance("body", 0, np.eye(4), (0,)),))
    film = build.shoot(scene, max_depth=depth)
    return largest(film.radiance + film.residual[..., None], 1)


def furnaces(shape: str, reflectivity: float = 0.25) -> Measured:
    """The worst of all indices and depths."""
    found = {(ior, depth): furnace(shape, ior, depth, reflectivity) for ior in FURNACE_IORS for depth in (1, 7)}
    ior, depth = max(found, key=lambda key: found[key])
    return Measured(found[ior, depth], f"worst for IOR {ior:.4g} at depth {depth}")


FURNACE = "radiance + residual = 1"


@THEME.case(19, "white-furnace-sphere", "an analytic glass ball, IOR 1e-3 .. 1e3, depth 1 and 7", FURNACE, 1e-6)
def _() -> Measured:
    return furnaces("sphere")


@THEME.case(19, "white-furnace-flat-ball", "a flat shaded glass ball of 320 triangles", FURNACE, 1e-6)
def _() -> Measured:
    return furnaces("flat")


@THEME.case(19, "white-furnace-smooth-ball", "the same, smooth shaded", FURNACE, 1e-6)
def _() -> Measured:
    return furnaces("smooth")


@THEME.case(19, "white-furnace-box", "a glass box", FURNACE, 1e-6)
def _() -> Measured:
    return furnaces("box")


@THEME.case(19, "white-furnace-mirror", "a perfect mirror ball of 320 triangles", FURNACE, 1e-6)
def _() -> Measured:
    return furnaces("smooth", reflectivity=1.0)


def deep_scene() -> Scene:
    """Glass and mirrors that need many bounces, in a world of radiance 1."""
    balls = [
        (build.icosphere(2, 0.5), build.glass(1.5), {"matrix_world": build.translation(x, y, 0.5)})
        for x, y in ((-0.6, 0.0), (0.6, 0.1), (0.0, 0.9))
    ]
    board = (build.floor(2), build.mirror(0.9, emission=(0.05, 0.05, 0.05)))
    lens = build.camera((0, -4, 2), (0, 0, 0.3), (0, 0, 1), (64, 48), 0.4)
    return build.make_scene(*balls, board, camera=lens, world=World((0.8, 0.9, 1.0)))


@THEME.case(
    19,
    "residual-bounds-the-error",
    "glass balls on a mirror at depth 2, 4, 6 against depth 14",
    "|error| <= residual x L_max in every pixel",
    1e-6,
    "excess radiance",
)
def _() -> Measured:
    scene = deep_scene()
    deep = build.shoot(scene, max_depth=14)
    brightest = 1.0 + 0.05 * 14  # the world, and what the board adds at each of at most 14 bounces
    worst, largest_error = -np.inf, 0.0
    for depth in (2, 4, 6):
        film = build.shoot(scene, max_depth=depth)
        error = np.abs(film.radiance.astype(np.float64) - deep.radiance).max(-1)
        worst = max(worst, float((error - film.residual * brightest).max()))
        largest_error = max(largest_error, float(error.max()))
    return Measured(max(worst, 0.0), f"errors up to {largest_error:.2f}", deep.radiance)


@THEME.case(
    19,
    "cutoff-keeps-its-promise",
    "the same with a cutoff of 1e-1, 1e-2, 1e-3 against none, depth 8",
    "|error| <= residual x L_max, residual <= the uncut one + cutoff",
    1e-6,
    "excess radiance",
)
def _() -> Measured:
    scene = deep_scene()
    whole = build.shoot(scene, max_depth=8)
    brightest, worst, cut = 1.0 + 0.05 * 8, -np.inf, []
    for cutoff in (1e-1, 1e-2, 1e-3):
        film = build.shoot(scene, max_depth=8, cutoff=cutoff)
        error = np.abs(film.radiance.astype(np.float64) - whole.radiance).max(-1)
        worst = max(worst, float((error - film.residual * brightest).max()))
        worst = max(worst, float(np.max(film.residual - whole.residual)) - cutoff)
        cut.append(f"{sum(film.rays.values()) / sum(whole.rays.values()):.0%}")
    return Measured(max(worst, 0.0), "rays left: " + ", ".join(cut))


@THEME.case(
    19,
    "half-mirrors",
    "four panes of glass that mirror 30 %, 16 bounces: 2^16 ways through, none of them small",
    "white within the residual, brighter nowhere; no sample becomes more than 256 rays; their mean within 1 % of white "
    "less what 16 bounces cut",
    1e-6,
)
def _() -> Measured:
    panes = ((build.box((-3, k / 2, -3), (3, k / 2 + 0.1, 3)), build.glass(1.5, reflectivity=0.3)) for k in range(4))
    lens = build.camera((0.5, -6, 1), (0, 0, 0), (0, 0, 1), (8, 8), 0.3)
    scene = build.make_scene(*panes, camera=lens, world=build.WHITE_WORLD)
    film, all_of_them = (build.shoot(scene, max_depth=16, cutoff=cutoff) for cutoff in (1 / 255, 1 / 2000))
    rays, light = film.rays["reflected"] + film.rays["refracted"], film.radiance.astype(np.float64)
    dark, bright = 1 - light - film.residual[..., None], light - 1
    error = max(float(np.max(dark)), float(np.max(bright)), 0.0)
    off = abs(float(light.mean() - all_of_them.radiance.mean()))
    found = f"{rays} rays, residual {np.max(film.residual):.2f}, {off:.4f} off in the mean"
    return Measured(error if rays <= 64 * 256 and off < 0.01 else np.nan, found, film.radiance)


@THEME.case(
    19,
    "stacked-panes",
    "six parallel panes of glass before a white wall in the dark, defaults, 16 samples",
    "(1 - R) / (1 + 11 R) in the mean, at most 256 rays a sample",
    5e-3,
)
def _() -> Measured:
    panes = [(build.box((-3, k / 2, -3), (3, k / 2 + 0.04, 3)), build.glass(1.5)) for k in range(6)]
    wall = build.quad([(-9, 5, -9), (9, 5, -9), (9, 5, 9), (-9, 5, 9)])
    lens = replace(build.camera((0, -6, 0), (0, 0, 0), (0, 0, 1), (8, 8)), projection="ORTHO")
    scene = build.make_scene(*panes, (wall, build.emitter(1, 1, 1)), camera=lens)
    film = build.shoot(scene, samples=16, max_depth=32, cutoff=1 / 255)
    rays = (film.rays["reflected"] + film.rays["refracted"]) / film.rays["camera"]
    error = abs(float(film.radiance.mean()) - 0.96 / (1 + 11 * 0.04))
    return Measured(error if rays <= 256 else np.nan, f"{rays:.0f} rays a sample")


@THEME.case(
    19,
    "shadow-rays-cut-short",
    "a floor lit through 70 tinted sheets: more than a shadow ray crosses",
    "|error| <= residual x L_max in every pixel, and a residual there alone",
    1e-4,
    "excess radiance",
)
def _() -> Measured:
    def seen(number: int) -> Film:
        tinted = build.glass(1.0, transmission_tint=(0.99999,) * 3)
        sheets = ((build.floor(1, 1 + k / 100), tinted) for k in range(number))
        lens = build.camera((0, -6, 2), (0, 0, 0), (0, 0, 1), (48, 36), 0.5)
        lamp = PointLight("lamp", (0, 0, 5), (20, 20, 20))
        return build.shoot(build.make_scene((build.floor(4), build.matte()), *sheets, camera=lens, lights=(lamp,)))

    film, below, brightest = seen(70), slice(8, 19), 20 / 5**2  # the camera looks at the floor below the sheets
    cut = film.residual[below] > 0
    lit = seen(0).radiance[below].astype(np.float64) * 1.0
    error = np.abs(film.radiance[below] - lit).max(-1)
    excess = float((error - film.residual[below] * brightest).max())
    there = bool(cut.any()) and float(np.max(error, where=~cut, initial=0)) < 1e-3
    return Measured(max(excess, 0.0) if there else np.nan, f"errors up to {error.max():.2f}", film.radiance)


# ------------------------------------------------------------------------------------------------ sliders


def ball_scene(surface: Surface) -> Scene:
    """A ball of this surface on a floor, lit, before a coloured world."""
    lens = build.camera((0, -4, 1.2), (0, 0, 0.4), (0, 0, 1), (64, 48), 0.4)
    ball = (build.icosphere(3, 1), surface, {"matrix_world": build.translation(0, 0, 0.5)})
    lamp = PointLight("lamp", (2, -2, 4), (30, 30, 30))
    board = (build.floor(3, -0.5), build.matte((0.5, 0.6, 0.7)))
    return build.make_scene(ball, board, camera=lens, lights=(lamp,), world=World((0.2, 0.3, 0.4)))


def differ(a: Surface, b: Surface) -> float:
    """The largest difference between two surfaces."""
    first, second = (build.shoot(ball_scene(s), max_depth=4).radiance for s in (a, b))
    return largest(first, second)


@THEME.case(
    29, "opacity-one", "opacity 1 with IOR 1.5 and a tint against the plain surface", "the same picture, bit by bit", 0
)
def _() -> Measured:
    return Measured(differ(build.matte(ior=1.5, transmission_tint=(1, 0, 0)), build.matte(ior=1.0)))


@THEME.case(29, "opacity-zero", "opacity 0 of a bright against a black base colour", "the same picture, bit by bit", 0)
def _() -> Measured:
    bright = Surface(base_color=(1, 1, 1), specular=(0.5, 0.5, 0.5), opacity=0.0, ior=1.5)
    return Measured(differ(bright, Surface(base_color=BLACK, opacity=0.0, ior=1.5)))


@THEME.case(29, "reflectivity-one", "reflectivity 1 of any base colour, opacity and IOR", "a mirror, bit by bit", 0)
def _() -> Measured:
    odd = Surface(base_color=(1, 0, 0), specular=(1, 1, 1), reflectivity=1.0, opacity=0.3, ior=2.0)
    return Measured(differ(odd, Surface(base_color=BLACK, reflectivity=1.0)))


@THEME.case(29, "reflectivity-zero", "reflectivity 0 with a tint against none", "the same picture, bit by bit", 0)
def _() -> Measured:
    return Measured(differ(build.matte(reflectivity=0.0, reflection_tint=(0, 1, 0)), build.matte()))


@THEME.case(29, "nearly-the-ends", "opacity 1e-8 and 1 - 1e-8, reflectivity 1e-8 and 1 - 1e-8", "as at the ends", 1e-6)
def _() -> Measured:
    base = build.matte(ior=1.5)
    found = []
    for e in (1e-8, 1 - 1e-8):
        found.append(differ(replace(base, opacity=e), replace(base, opacity=round(e))))
        found.append(differ(replace(base, reflectivity=e), replace(base, reflectivity=round(e))))
    return Measured(max(found))


@THEME.case(
    29,
    "what-is-left-out-changes-nothing",
    "a scene with and without a hidden glass ball that switches every stage on",
    "the same picture, bit by bit",
    0,
    "pixels",
)
def _() -> Measured:
    plain = ball_scene(build.matte())
    film = build.shoot(plain, max_depth=4)
    # Inside the matte ball, where nothing sees it: the plan must trace secondary rays and emission all the same.
    extra = Surface(base_color=BLACK, opacity=0.5, reflectivity=0.5, ior=1.5, emission=(1, 1, 1))
    speck = Sphere("speck", (0.0, 0.0, 0.5), 1e-3, len(plain.surfaces))
    fuller = build.shoot(replace(plain, surfaces=(*plain.surfaces, extra), spheres=(speck,)), max_depth=4)
    names = ", ".join(sorted({str(entry["what"]) for entry in film.skipped}))
    return Measured(different_pixels(film.radiance, fuller.radiance), f"left out: {names}")
