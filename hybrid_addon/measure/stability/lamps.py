# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that rays meet: at grazing angles, within glass, tiny, huge, without an area, behind, many at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import AreaLight, Float32, Light, PointLight, SunLight, Visibility, World
from . import build
from .case import Measured
from .compare import different_pixels, largest
from .lighting import THEME

MIRROR = build.mirror()
NIGHT = World((0.0, 0.0, 0.0))
LAMP = AreaLight("lamp", (0, 0, 9), (0, 0, -1), (20, 0, 0), (0, 20, 0), (3, 2, 1))
HIDDEN = {"visibility": Visibility(camera=False)}


def mirrored(*lights: Light, scale: float = 1.0, eye: tuple[float, float, float] = (0, 0, 5)) -> Float32:
    """A mirror in the night, under lamps."""
    up = (0, 1, 0) if eye[1] == 0 else (0, 0, 1)
    lens = build.camera(tuple(scale * v for v in eye), up=up, half=0.1, clip_start=1e-9, clip_end=1e12)
    mirror = (build.floor(100 * scale), MIRROR)
    return build.shoot(build.make_scene(mirror, camera=lens, lights=lights, world=NIGHT)).radiance


@THEME.case(
    27,
    "lamp-met-at-grazing-angles",
    "a wall of light behind a mirror that is seen at 5, 0.5 and 0.05 degrees",
    "its radiance, where the lower half of the view is mirrored",
    1e-6,
)
def _() -> Measured:
    worst = 0.0
    wall = AreaLight("wall", (0, 90, 0), (0, -1, 0), (400, 0, 0), (0, 0, 400), (3, 2, 1))
    for degrees in (5.0, 0.5, 0.05):
        angle = np.radians(degrees)
        image = mirrored(wall, eye=(0, -5 * float(np.cos(angle)), 5 * float(np.sin(angle))))
        worst = max(worst, largest(image[:12, :, 0], 3))
    return Measured(worst)


@THEME.case(
    27,
    "lamp-met-within-glass",
    "a disk of light in the middle of a glass ball, seen from outside",
    "(1 - R) of its radiance: rays to the middle enter along the normal",
    1e-4,
    "relative",
)
def _() -> Measured:
    disk = AreaLight("disk", (0, 0, 0), (0, 0, 1), (0.3, 0, 0), (0, 0.3, 0), (3, 2, 1), shape="ELLIPSE")
    ball = (build.icosphere(5, 1, True), build.glass(1.5))
    lens = build.camera((0, 0, 5), half=1e-3)
    image = build.shoot(build.make_scene(ball, camera=lens, lights=(disk,), world=NIGHT), max_depth=1).radiance
    return Measured(largest(image[..., 0] / (3 * 0.96), 1))


def _square(scale: float) -> AreaLight:
    return replace(LAMP, position=(0, 0, 9 * scale), axis_u=(0.4 * scale, 0, 0), axis_v=(0, 0.2 * scale, 0))


def _ball(scale: float) -> PointLight:
    power = scale * scale
    return PointLight("ball", (0.2 * scale, 0, 9 * scale), (3 * power, 2 * power, power), 0.3 * scale)


@THEME.case(
    27,
    "lamp-met-at-any-size",
    "all of a scene with a lamp 2^-20 (1e-6) and 2^20 (1e6) times as large",
    "the same bits",
    0,
    "pixels",
)
def _() -> Measured:
    worst = 0
    for make in (_square, _ball):
        expected = mirrored(make(1.0))
        assert np.any(expected)
        for scale in (2.0**-20, 2.0**20):
            worst = max(worst, different_pixels(mirrored(make(scale), scale=scale), expected))
    return Measured(worst)


@THEME.case(
    27,
    "lamps-without-an-area",
    "area lights without a width, or with parallel edges, points and suns of size 0, over a mirror",
    "black: they show nothing",
    0,
)
def _() -> Measured:
    lamps: list[Light] = [replace(LAMP, axis_u=(0, 0, 0)), replace(LAMP, axis_v=(20, 0, 0))]
    lamps += [PointLight("point", (0, 0, 9), (9, 9, 9)), SunLight("sun", (0, 0, 1), (9, 9, 9))]
    return Measured(max(largest(mirrored(lamp), 0) for lamp in lamps))


@THEME.case(
    27,
    "lamps-behind-the-horizon",
    "lamps below a mirror, in its plane, and above it that shine up",
    "black",
    0,
)
def _() -> Measured:
    lamps = [replace(LAMP, position=(0, 0, -1)), replace(LAMP, direction=(0, 0, 1))]
    lamps += [replace(LAMP, position=(0, 0, 0), direction=(0, 0, d)) for d in (-1, 1)]
    return Measured(max(largest(mirrored(lamp), 0) for lamp in lamps))


@THEME.case(
    27,
    "lamp-met-on-a-ceiling",
    "a lamp exactly in the plane of a ceiling, seen in a mirror below",
    "as if the ceiling were not there",
    0,
)
def _() -> Measured:
    lamp = replace(LAMP, position=(0, 0, 4), axis_u=(1, 0, 0), axis_v=(0, 1, 0))
    roof = (build.ceiling(9, 4), build.BLACK_BODY, HIDDEN)
    parts = (build.floor(9), MIRROR), roof
    roofed = build.shoot(build.make_scene(*parts, lights=(lamp,), world=NIGHT)).radiance
    bare = build.shoot(build.make_scene(parts[0], lights=(lamp,), world=NIGHT)).radiance
    return Measured(largest(roofed, bare) if np.any(bare) else float("nan"))


@THEME.case(
    27,
    "many-lamps-at-once",
    "300 lamps one behind the other over a mirror",
    "the sum of their radiances: lamps hide nothing",
    1e-5,
    "relative",
)
def _() -> Measured:
    lamps = [replace(LAMP, name=f"lamp {k}", position=(0, 0, 6 + 0.01 * k)) for k in range(300)]
    return Measured(largest(mirrored(*lamps)[..., 0] / 900, 1))
