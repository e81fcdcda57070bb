# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights in impossible places and of impossible strength; linearity of light."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ...scene import Float32, Light, PointLight, Scene, Sphere, SunLight, Visibility
from . import build
from .case import Measured, Theme
from .compare import largest

THEME = Theme("Lights and world")
SHEET = build.matte((1, 1, 1))


def under(*lights: Light, parts: tuple[Any, ...] = (), **other: Any) -> Scene:
    """A white floor seen from above."""
    return build.make_scene((build.floor(4), SHEET), *parts, lights=lights, **other)


def look(scene: Scene, **settings: Any) -> Float32:
    """The picture."""
    return build.shoot(scene, **settings).radiance


HIDDEN = {"visibility": Visibility(camera=False)}


# ------------------------------------------------------------------------------------------------ places


@THEME.case(
    27,
    "lamp-in-glass",
    "a lamp in the middle of a glass ball over a floor",
    "(1 - R) of its light: every ray leaves along the normal",
    1e-6,
    "relative",
)
def _() -> Measured:
    lamp = PointLight("lamp", (0.1, 0.2, 1.5), (3, 3, 3))
    scene = under(lamp)
    ball = Sphere("ball", lamp.position, 0.5, 1, visibility=Visibility(camera=False))
    shaded = look(replace(scene, surfaces=(*scene.surfaces, build.glass(1.5)), spheres=(ball,)))
    return Measured(largest(shaded / look(scene), 0.96))


@THEME.case(
    27,
    "lamp-in-an-opaque-ball",
    "a lamp inside a closed matte ball, coarse and smooth shaded",
    "black: nothing gets out",
    0,
)
def _() -> Measured:
    lamp = PointLight("lamp", (0, 0, 0), (100, 100, 100))
    scene = build.make_scene((build.icosphere(1, 1, True), SHEET), lights=(lamp,))
    return Measured(largest(look(scene, samples=4), 0))


@THEME.case(
    27,
    "lamp-on-a-surface",
    "a lamp exactly on, and 1 mm below, a ceiling lights the floor",
    "as if the ceiling were not there",
    2e-6,
    "relative",
)
def _() -> Measured:
    worst = 0.0
    for gap in (0.0, 1e-3):
        lamp = PointLight("lamp", (0.3, 0.2, 2 - gap), (3, 3, 3))
        roofed = look(under(lamp, parts=((build.ceiling(4, 2), SHEET, HIDDEN),)))
        worst = max(worst, largest(roofed / look(under(lamp)), 1))
    return Measured(worst, "Embree counts a hit at exactly the end of a shadow ray")


@THEME.case(
    27,
    "lamp-on-its-own-surface",
    "a lamp exactly in the plane that it could light, on an edge, on a corner",
    "0: the cosine is 0",
    0,
)
def _() -> Measured:
    places = ((0.3, 0.2, 0.0), (0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (4.0, 4.0, 0.0))
    return Measured(max(largest(look(under(PointLight("lamp", p, (1, 1, 1)))), 0) for p in places))


@THEME.case(
    27,
    "lamp-just-above-a-surface",
    "a lamp of radius 0.1 m, 1e-1 .. 1e-7 m above a floor",
    "I cos / (d^2 + r^2) / pi: capped by its radius",
    1e-5,
    "relative",
)
def _() -> Measured:
    worst = 0.0
    for height in 10.0 ** -np.arange(1, 8):
        lamp = PointLight("lamp", (0, 0, float(height)), (3, 3, 3), radius=0.1)
        lens = build.camera((0, 0, 2), size=(33, 33), half=0.25)
        x = ((np.arange(33) + 0.5) / 33 - 0.5) * 2 * 0.25 * 2
        d2 = x[None, :] ** 2 + x[:, None] ** 2 + height**2
        expected = 3 * (height / np.sqrt(d2)) / (d2 + 0.01) / np.pi
        far = np.sqrt(d2) > 1e-3  # nearer, float32 cannot say where the point is
        got = look(under(lamp, camera=lens))[..., 0]
        worst = max(worst, largest(got[far] / expected[far], 1))
    return Measured(worst)


@THEME.case(
    27,
    "lamp-at-the-shading-point",
    "a lamp of no size within 1e-9 m of a floor, in a pixel's centre",
    "finite, no failed pixel",
    0,
    "pixels",
)
def _() -> Measured:
    lens = build.camera((0, 0, 5), size=(33, 33))
    wrong = 0
    for height in (0.0, 1e-9, 1e-20, -1e-9):
        film = build.shoot(under(PointLight("lamp", (0, 0, height), (1, 1, 1)), camera=lens))
        wrong += int(np.count_nonzero(~np.isfinite(film.radiance).all(-1)))
    return Measured(wrong)


@THEME.case(27, "lamp-behind-a-surface", "a lamp 1e-2 .. 1e-6 m below a floor", "black", 0)
def _() -> Measured:
    lamps = [PointLight("lamp", (0.1, 0.1, -(10.0**-k)), (9, 9, 9)) for k in range(2, 7)]
    return Measured(max(largest(look(under(lamp)), 0) for lamp in lamps))


@THEME.case(
    27,
    "lamp-behind-a-sheet-with-slanted-normals",
    "the shading normals see the sun, the sheet itself does not",
    "black",
    0,
)
def _() -> Measured:
    corners = [(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)]
    sheet = build.quad(corners, normals=np.array([(0.8, 0, 0.6)] * 4, np.float32))
    sun = SunLight("sun", (1, 0, -0.1), (1, 1, 1))
    options = {"visibility": Visibility(shadow=False)}
    return Measured(largest(look(build.make_scene((sheet, SHEET, options), lights=(sun,))), 0))
