# SPDX-License-Identifier: GPL-3.0-or-later
"""The same picture however the work is cut up, again and again, and on every Python."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import Float32, PointLight, Sphere, Surface, World
from . import build
from .case import Measured
from .compare import films_differ
from .film import SAMPLES, THEME, glass_scene
from .invariance import everything


@THEME.case(37, "threads", "1, 2 and 3 threads", "the same picture, bit by bit", 0)
def _() -> Measured:
    films = [build.shoot(everything(), samples=SAMPLES, max_depth=5, threads=t, chunk=3000) for t in (1, 2, 3)]
    return Measured(max(films_differ(films[0], f) for f in films[1:]), "", films[0].radiance)


@THEME.case(32, "chunks", "chunks of 7, 40, 333 and 16384 camera rays", "the same picture, bit by bit", 0)
def _() -> Measured:
    scene = replace(everything(), camera=replace(everything().camera, window=(28, 20, 44, 32)))
    films = [build.shoot(scene, max_depth=5, chunk=c) for c in (1 << 14, 333, 40, 7)]
    return Measured(max(films_differ(films[0], f) for f in films[1:]))


@THEME.case(37, "again", "the same scene traced twice, another one in between", "the same picture, bit by bit", 0)
def _() -> Measured:
    first = build.shoot(everything(), samples=SAMPLES, max_depth=5)
    build.shoot(glass_scene(), samples=2)
    return Measured(films_differ(first, build.shoot(everything(), samples=SAMPLES, max_depth=5)))


@THEME.case(
    35,
    "edit-and-undo",
    "an object moved, hidden, shown again and put back between renders",
    "the first picture, bit by bit",
    0,
)
def _() -> Measured:
    scene = glass_scene()
    first = build.shoot(scene)
    moved = replace(scene.instances[0], matrix_world=build.translation(0.5, 0, 0))
    changed = build.shoot(replace(scene, instances=(moved, scene.instances[1])))
    hidden = build.shoot(replace(scene, instances=scene.instances[1:]))
    if films_differ(changed, first) == 0 or films_differ(hidden, first) == 0:
        return Measured(np.nan, "an edit did not show")
    return Measured(films_differ(build.shoot(scene), first), "Blender's side of it: frame-and-back")


GOLDEN = (
    0.34170043, 0.12181193, 0.42311394, 0.52358514, 0.13101289, 0.41788641, 0.50860649, 0.13555492,
    0.41234517, 0.49230635, 0.12824947, 0.40651184, 0.47468936, 0.11367457, 0.40041822, 0.45579433,
    0.13967767, 0.39410719, 0.4357022, 0.14003956, 0.12634218, 0.41454256, 0.14024691, 0.13839105,
    0.3924993, 0.14027503, 0.13708642, 0.36981326, 0.14010042, 0.36396176, 0.04582699, 0.13970482,
    0.35813865, 0.21453325, 0.35617995, 0.112947, 0.2148556, 0.34064591, 0.12012533, 0.23684949,
    0.32551381, 0.12307669, 0.2294254, 0.31107914, 0.12532213, 0.24189049, 0.29762694, 0.12297381,
    0.241752, 0.28541073, 0.40000001, 0.2658948, 0.30000001, 0.40000001, 0.26646632, 0.29135069,
    0.40000001, 0.20378539, 0.25159845, 0.40000001, 0.2, 0.025987962, 0.40000001, 0.2,
    0.24167277, 0.40000001, 0.2, 0.30000001, 0.40000001, 0.2, 0.30000001, 0.40000001,
    0.2, 0.30000001, 0.40000001,
)  # fmt: skip
"""Radiance of every 31st value of the picture below, written down with Python 3.13 and numpy 2."""


def golden_picture() -> Float32:
    """A small picture with sines, powers and square roots in it; flat shaded, so that only arithmetic is tested."""
    shiny = Surface(base_color=(0.5, 0.3, 0.2), specular=(0.5, 0.5, 0.5), roughness=0.3, reflectivity=0.1)
    ball = (build.icosphere(2, 0.8), build.glass(1.5), {"matrix_world": build.translation(0.3, 0, 0.9)})
    crate = (build.box((-1.8, -0.5, 0), (-0.8, 0.5, 1)), shiny)
    lens = build.camera((0, -4, 2.2), (0, 0, 0.6), (0, 0, 1), (32, 24), 0.33)
    lamp = PointLight("lamp", (2, -3, 4), (30, 20, 10), radius=0.1)
    scene = build.make_scene(
        ball, crate, (build.floor(4), build.matte()), camera=lens, lights=(lamp,), world=World((0.2, 0.3, 0.4))
    )
    scene = replace(scene, spheres=(Sphere("s", (-0.5, -1.2, 0.4), 0.4, 1),))
    return build.shoot(scene, max_depth=3).radiance


@THEME.case(
    37,
    "pythons",
    "a picture with numbers written down by Python 3.13 and numpy 2",
    "the same numbers on every Python and numpy",
    1e-6,
)
def _() -> Measured:
    picture = golden_picture()
    got = picture.reshape(-1)[::31]
    if got.shape != np.shape(GOLDEN):
        return Measured(np.nan, "the numbers are not written down")
    return Measured(
        float(np.abs(got - np.array(GOLDEN)).max()), f"numpy {np.__version__}, {len(GOLDEN)} values", picture
    )
