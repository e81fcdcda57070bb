# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights of impossible strength: light is linear, lamps superpose, one texel may be the sun."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ...scene import (
    AreaLight,
    Expression,
    Float32,
    Light,
    PointLight,
    Scene,
    SpotLight,
    SunLight,
    Surface,
    Texture,
    World,
)
from . import build
from .case import Measured
from .compare import largest
from .lighting import SHEET, THEME, look, under

LAMPS: tuple[Light, ...] = (
    PointLight("point", (1, -1, 2), (2, 2, 2), radius=0.125),
    SpotLight("spot", (-2, -1, 3), (5, 4, 3), range=8.0),
    SunLight("sun", (0.5, 0.25, 1), (0.5, 0.5, 0.5)),
    AreaLight("area", (0, 1, 3), (0, 0, -1), (0.5, 0, 0), (0, 0.25, 0), (2, 1, 1)),
)


def brighter(light: Light, factor: float) -> Light:
    """The light with its colour multiplied."""
    red, green, blue = getattr(light, light.color_field)
    color: dict[str, Any] = {light.color_field: (factor * red, factor * green, factor * blue)}
    return replace(light, **color)


def things(*lights: Light, world: World = World()) -> Scene:  # noqa: B008 (frozen)
    """Matte, shiny and clear things under these lights."""
    ball = {"matrix_world": build.translation(0, 0, 1)}
    parts = (
        (build.icosphere(2, 0.8), build.matte(specular=(0.5, 0.5, 0.5), roughness=0.3), ball),
        (build.box((-2.5, -1, 0), (-1, 1, 1)), build.glass(1.5)),
        (build.box((1.2, -1, 0), (2.5, 1, 1)), build.mirror(0.5)),
    )
    lens = build.camera((0, -5, 4), (0, 0, 0.5), (0, 0, 1), (48, 36), 0.45)
    return under(*lights, parts=parts, camera=lens, world=world)


def lit(factor: float = 1.0, allow: tuple[str, ...] = ()) -> Float32:
    """All lamps, a factor stronger."""
    return build.shoot(things(*(brighter(light, factor) for light in LAMPS)), allow=allow, max_depth=4).radiance


@THEME.case(
    28,
    "light-is-linear",
    "all lamps 2^k times as strong, k = -20, 3, 40 (1e12)",
    "2^k times the picture, bit by bit",
    0,
    "pixels",
)
def _() -> Measured:
    one, wrong = lit(), 0
    for k in (-20, 3, 40):
        wrong += int(np.count_nonzero((lit(2.0**k) != one * np.float32(2.0**k)).any(-1)))
    return Measured(wrong, "", one)


@THEME.case(28, "lamps-of-1e12-watts", "all lamps 1e12 times as strong", "1e12 times the picture", 1e-6, "relative")
def _() -> Measured:
    one, strong = lit().astype(np.float64), lit(1e12).astype(np.float64) / 1e12
    return Measured(largest(strong, one) / float(np.max(one)))


@THEME.case(28, "lamps-superpose", "four lamps together and one by one", "the sum", 1e-6)
def _() -> Measured:
    apart = np.sum([build.shoot(things(light), max_depth=4).radiance.astype(np.float64) for light in LAMPS], axis=0)
    together = lit()
    return Measured(largest(together, apart) / float(np.max(together)))


@THEME.case(28, "negative-lamps", "all lamps of negative strength", "minus the picture, bit by bit", 0)
def _() -> Measured:
    return Measured(largest(lit(-1.0, allow=("negative_radiance",)), -lit()), "counted as negative radiance")


@THEME.case(28, "lamps-of-no-strength", "all lamps black, black world", "black, and no shadow ray is traced", 0)
def _() -> Measured:
    film = build.shoot(things(*(brighter(light, 0.0) for light in LAMPS)), max_depth=4)
    return Measured(largest(film.radiance, 0) + film.rays["shadow"])


def sunny(peak: float) -> Texture:
    """A grey sky with one texel of `peak`."""
    pixels = np.full((32, 64), 0.5, np.float32)
    pixels[24, 10] = peak
    return Texture("sky", build.image(pixels), interpolation="CLOSEST")


@THEME.case(
    28,
    "sun-in-the-sky-image",
    "one texel of 1e6 in a sky of 0.5, seen in mirrors and glass",
    "seen at its full strength, everything finite",
    1e-6,
    "relative",
)
def _() -> Measured:
    lens = build.camera(size=(96, 96), half=1.2)
    scene = build.make_scene((build.floor(50), build.mirror()), camera=lens, world=World((1, 1, 1), sunny(1e6)))
    got = build.shoot(scene, max_depth=2).radiance
    peaks = got[got > 1]
    return Measured(largest(peaks / 1e6, 1) if peaks.size else np.nan, f"{peaks.size // 3} pixels see it")


@THEME.case(
    28, "sky-image-is-linear", "the sky 2^10 times as bright", "2^10 times the picture, bit by bit", 0, "pixels"
)
def _() -> Measured:
    sky = World((1, 1, 1), sunny(1e6))
    one = build.shoot(things(world=sky), max_depth=4).radiance
    bright = build.shoot(things(world=replace(sky, radiance=(1024.0,) * 3)), max_depth=4).radiance
    return Measured(int(np.count_nonzero((bright != 1024 * one).any(-1))))


@THEME.case(
    28,
    "smallest-sky-images",
    "sky and texture of 1 x 1, 1 x 7 and 7 x 1 texels of one colour",
    "the uniform colour",
    1e-6,
)
def _() -> Measured:
    def uniform(sky: World, surface: Surface) -> Float32:
        part = (build.floor(2, uv_maps={"": build.RAMP_UVS * 7}), surface)
        return build.shoot(build.make_scene(part, world=sky, camera=build.camera(half=0.8))).radiance

    plain = uniform(World((0.25, 0.25, 0.25)), build.matte((0.5, 0.5, 0.5)))
    found = []
    for shape in ((1, 1), (1, 7), (7, 1)):
        sky, cloth = (Texture("t", build.image(np.full(shape, c, np.float32))) for c in (0.25, 0.5))
        found.append(largest(uniform(World((1, 1, 1), sky), Surface(base_color=Expression("image", (), cloth))), plain))
    return Measured(max(found))


@THEME.case(
    27,
    "spot-at-its-ends",
    "a spot of half angle 1e-4 and of almost 90 degrees, no blend and full blend",
    "finite, nothing behind it",
    0,
    "pixels",
)
def _() -> Measured:
    wrong = 0
    for angle in (1e-4, np.pi / 2 - 1e-6):
        for blend in (0.0, 1.0):
            spot = SpotLight("spot", (0, 0, 2), (9, 9, 9), cos_cone=float(np.cos(angle)), blend=blend)
            upward = build.camera((0, 0, 1), (0, 0, 3))
            above = build.make_scene((build.ceiling(4, 3), SHEET), lights=(spot,), camera=upward)
            lit_floor = look(under(spot))
            wrong += int(np.count_nonzero(~np.isfinite(lit_floor).all(-1))) + int(look(above).any())
    return Measured(wrong)
