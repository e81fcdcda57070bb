# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that start on surfaces: no surface may shadow itself, none may leak, at any scale, place and angle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import Float32, Float64, Instance, Plane, Scene, SunLight, Surface, TriangleMesh, World
from . import build
from .case import Measured, Theme
from .compare import different_pixels, edges, largest
from .fresnel import normal_reflectance

THEME = Theme("Rays that leave a surface")
SUN = SunLight("sun", (0.3, -0.5, 1.0), (np.pi,) * 3)
SAMPLES = 64


def convex_bodies() -> list[tuple[str, TriangleMesh]]:
    """Bodies of which no part can shadow another."""
    return [("ball", build.icosphere(3)), ("cube", build.box())]


def placed(scale: float, offset: float, seed: int = 4) -> Float64:
    """(4, 4): turned at random, scaled and moved."""
    matrix = build.rotation(seed) @ build.scaling(scale, scale, scale)
    matrix[:3, 3] = offset, -offset / 3, offset / 7
    return matrix


def body_scene(body: TriangleMesh, surface: Surface, matrix: Float64, scale: float, offset: float) -> Scene:
    """The body in the middle of a picture; with an offset a second one opposite keeps the scene's centre away."""
    scene = build.make_scene((body, surface, {"matrix_world": matrix}), lights=(SUN,))
    if offset:
        far = matrix.copy()
        far[:3, 3] *= -1
        scene = replace(scene, instances=(*scene.instances, Instance("far", 0, far, (0,))))
    where = matrix[:3, 3]
    lens = build.camera(where + np.array([0.4, -0.3, 4]) * scale, where, (0, 1, 0), (48, 48), 0.3)
    return replace(scene, camera=replace(lens, clip_start=0.0, clip_end=1e12))


def self_shadowed(scale: float, offset: float) -> tuple[int, int]:
    """Pixels of convex bodies that shadow themselves, and how many shadow rays were traced.

    Not counted on are camera rays within a rounding error of a silhouette, one in a million: they may meet the face
    behind it from inside, where it is dark. This seed has none.
    """
    wrong = rays = 0
    for _, body in convex_bodies():
        scene = body_scene(body, build.matte(), placed(scale, offset), scale, offset)
        bright = replace(scene, lights=(replace(SUN, cast_shadow=False),))
        shadowed, free = (build.shoot(s, samples=SAMPLES, filter_radius=0.5, seed=1) for s in (scene, bright))
        wrong += different_pixels(shadowed.radiance, free.radiance)
        rays += shadowed.rays["shadow"]
    return wrong, rays


def measure_self_shadow(places: list[tuple[float, float]]) -> Measured:
    """The sum over scales and offsets."""
    found = [self_shadowed(*place) for place in places]
    return Measured(sum(wrong for wrong, _ in found), f"{sum(rays for _, rays in found)} shadow rays")


@THEME.case(
    1,
    "no-self-shadow-at-any-scale",
    "a sunlit ball and cube, turned at random, at scales 1e-4, 1, 1e4, 1e7",
    "no pixel differs from the picture without shadows",
    0,
    "pixels",
)
def _() -> Measured:
    return measure_self_shadow([(s, 0.0) for s in (1e-4, 1.0, 1e4, 1e7)])


@THEME.case(
    2,
    "no-self-shadow-far-from-the-centre",
    "the same, 1 m large, 1e3 and 1e4 m from the centre of the scene",
    "no pixel differs from the picture without shadows",
    0,
    "pixels",
)
def _() -> Measured:
    return measure_self_shadow([(1.0, 1e3), (1.0, 1e4)])


def leaks(scale: float, offset: float) -> tuple[int, int]:
    """Pixels in which closed mirror shells let a white world in, and how many rays were reflected inside them."""
    lit = rays = 0
    for body in (build.icosphere(2), build.box()):
        matrix = placed(scale, offset)
        scene = replace(body_scene(body, build.mirror(), matrix, scale, offset), world=build.WHITE_WORLD, lights=())
        where = matrix[:3, 3]
        lens = build.camera(where, where + np.array([1, 0.3, 0.2]) * scale, (0, 0, 1), (48, 48), 1.5)
        scene = replace(scene, camera=replace(lens, clip_start=0.0, clip_end=1e12))
        film = build.shoot(scene, max_depth=24)
        lit, rays = lit + int(np.count_nonzero(film.radiance.any(-1))), rays + film.rays["reflected"]
    return lit, rays


def measure_leaks(places: list[tuple[float, float]]) -> Measured:
    """The sum over scales and offsets."""
    found = [leaks(*place) for place in places]
    return Measured(sum(lit for lit, _ in found), f"{sum(rays for _, rays in found)} reflected rays")


@THEME.case(
    1,
    "no-leak-at-any-scale",
    "camera inside a closed mirror shell, white world outside, scales 1e-4 .. 1e7, 24 bounces",
    "black: no ray gets out",
    0,
    "pixels",
)
def _() -> Measured:
    return measure_leaks([(s, 0.0) for s in (1e-4, 1.0, 1e4, 1e7)])


@THEME.case(2, "no-leak-1-km-from-the-centre", "the same, 1e3 m from the centre", "black: no ray gets out", 0, "pixels")
def _() -> Measured:
    return measure_leaks([(1.0, 1e3)])


@THEME.case(
    2, "no-leak-10-km-from-the-centre", "the same, 1e4 m from the centre", "black: no ray gets out", 0, "pixels"
)
def _() -> Measured:
    return measure_leaks([(1.0, 1e4)])


@THEME.case(
    4,
    "grazing-sun",
    "a tilted plane of 10 m under a sun at cosines 1e-1 .. 1e-7",
    "every pixel lit, and as without shadows",
    0,
    "pixels",
)
def _() -> Measured:
    turn = build.rotation(6)
    ground = build.make_scene((build.floor(10), build.matte((1, 1, 1)), {"matrix_world": turn}))
    up, along = turn[:3, 2], turn[:3, 0]
    lens = build.camera(5 * up, (0, 0, 0), turn[:3, 1], (48, 48), 0.8)
    wrong = 0
    for c in 10.0 ** np.arange(-1, -8, -1):
        toward = tuple(c * up + np.sqrt(1 - c * c) * along)
        sun = SunLight("sun", toward, (1 / c,) * 3)
        with_shadow = build.shoot(replace(ground, camera=lens, lights=(sun,))).radiance
        without = build.shoot(replace(ground, camera=lens, lights=(replace(sun, cast_shadow=False),))).radiance
        wrong += different_pixels(with_shadow, without)
    return Measured(wrong, "seven angles, 2304 pixels each")


@THEME.case(
    4,
    "grazing-view-of-glass",
    "a sheet of glass over black seen at cosines 1 .. 1e-7, white world",
    "radiance = Fresnel's reflectance, rising to 1",
    4e-5,
)
def _() -> Measured:
    worst, last, rising = 0.0, 0.0, True
    for c in 10.0 ** np.arange(0, -8, -1):
        toward = np.array([np.sqrt(1 - c * c), 0, c])
        lens = replace(build.camera(3 * toward, (0, 0, 0), (0, 1, 0), (4, 4), 1e-10), projection="ORTHO")
        scene = build.make_scene(
            (build.floor(4, -0.5), build.BLACK_BODY), camera=lens, world=build.WHITE_WORLD, surfaces=(build.glass(1.5),)
        )
        scene = replace(scene, planes=(Plane("glass", (0, 0, 0), (0, 0, 1), 0),))
        got = build.shoot(scene, allow=("lost_media",), max_depth=1).radiance
        s2 = (1 - c * c) / 2.25
        ct = np.sqrt(1 - s2)
        exact = (((c - 1.5 * ct) / (c + 1.5 * ct)) ** 2 + ((1.5 * c - ct) / (1.5 * c + ct)) ** 2) / 2
        worst, rising = max(worst, largest(got, exact)), rising and bool(np.min(got) >= last)
        last = float(np.max(got))
    return Measured(worst if rising else np.nan, f"at normal incidence {normal_reflectance(1.5):.4f}")


def small_thing_on_ground(half_width: float) -> Float32:
    """A 2 mm ball 20 um above tilted mirror ground of this half width, as the ground reflects it: (h, w, 3)."""
    turn = build.rotation(8)
    ball = (
        build.icosphere(3, 1e-3),
        build.emitter(1, 0.5, 0.25),
        {"matrix_world": turn @ build.translation(0, 0, 1.02e-3)},
    )
    ground = (build.floor(half_width), build.mirror(), {"matrix_world": turn})
    up, side = turn[:3, 2], turn[:3, 0]
    eye = 1.02e-3 * up + 8e-3 * (0.6 * up + 0.8 * side)
    lens = build.camera(eye, (0, 0, 0), up, (64, 64), 0.35)
    scene = build.make_scene(ball, ground, camera=replace(lens, clip_start=1e-4), world=World((0.2, 0.2, 0.2)))
    return build.shoot(scene, allow=("self_hits",), max_depth=1).radiance


@THEME.case(
    4,
    "small-thing-on-10-m-ground",
    "a 2 mm ball 20 um above a tilted mirror ground, 10 m wide each way",
    "the picture is that on a ground of 2 cm, off edges",
    0,
    "pixels",
)
def _() -> Measured:
    return compare_ground(10.0)


@THEME.case(
    4,
    "small-thing-on-1-km-ground",
    "the same on 1 km of ground",
    "the picture is that on a ground of 2 cm",
    0,
    "pixels",
)
def _() -> Measured:
    return compare_ground(1e3)


@THEME.case(
    4,
    "small-thing-on-10-km-ground",
    "the same on 10 km of ground",
    "the picture is that on a ground of 2 cm",
    0,
    "pixels",
)
def _() -> Measured:
    return compare_ground(1e4)


def compare_ground(half_width: float) -> Measured:
    """Pixels off edges in which the width of the ground shows."""
    near, got = small_thing_on_ground(0.02), small_thing_on_ground(half_width)
    wrong = (np.abs(got - near).max(-1) > 1e-3) & ~edges(near)
    return Measured(int(np.count_nonzero(wrong)), "of 4096 pixels", np.concatenate([near, got], axis=1))
