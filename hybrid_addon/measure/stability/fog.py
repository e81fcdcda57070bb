# SPDX-License-Identifier: GPL-3.0-or-later
"""Fog: extreme densities, flat boxes, the camera inside, boxes that touch, glass in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import Float64, Fog, FogBody, Medium, Sphere, SunLight, Surface, TriangleMesh
from . import build
from .case import Measured, Theme
from .compare import largest

THEME = Theme("Fog")

CORNERS = np.array([(x, y, z) for x in (-2, 2) for y in (-2, 2) for z in (-2, 2)], np.float32)
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def _box(medium: Medium, height: float = 1.0, z: float = 0.0) -> FogBody:
    """4 m wide, `height` times 4 m high, its middle at z."""
    triangles = np.array([t for a, b, c, d in FACES for t in ((a, b, c), (a, c, d))], np.int32)
    matrix = np.diag([1.0, 1.0, height, 1.0])
    matrix[2, 3] = z
    return FogBody("box", TriangleMesh("box", CORNERS, triangles, triangles), matrix, medium)


def _seen(*bodies: FogBody, lit: bool = False, glass: bool = False) -> Float64:
    """(h, w, 3) of a white world, straight down from 5 m; lit: a sun from the side; glass: a ball in the middle."""
    sun = (SunLight("sun", direction=(0.0, 1.0, 0.0), irradiance=(1.0, 1.0, 1.0)),) if lit else ()
    eye = replace(build.camera(size=(8, 8)), view_plane=(-0.01, 0.01, -0.01, 0.01))
    scene = replace(build.make_scene(camera=eye, world=build.WHITE_WORLD), lights=sun, fog=Fog(bodies=bodies))
    if glass:
        ball = Sphere("ball", (0.0, 0.0, 0.0), 1.0, 0, ray_traced=True)
        scene = replace(scene, spheres=(ball,), surfaces=(Surface(opacity=0.0, ior=1.5),))
    return build.shoot(scene, max_depth=32).radiance.astype(np.float64)


@THEME.case(40, "white-furnace", "scattering 1e-6, 1 and 1e6 per metre, g 0.9", "a white world is white", 1e-5)
def _() -> Measured:
    media = (Medium(scattering=(1e-6, 1.0, 1e6), anisotropy=g) for g in (-0.9, 0.0, 0.9))
    return Measured(max(largest(_seen(_box(medium)), 1.0) for medium in media))


@THEME.case(40, "density-without-end", "absorption 0, 1e-30, 1e6 and 1e30, under a sun", "1 or 0, and finite", 1e-6)
def _() -> Measured:
    pairs = ((0.0, 1.0), (1e-30, 1.0), (1e6, 0.0), (1e30, 0.0))
    seen = [(_seen(_box(Medium(absorption=(a, a, a))), lit=True), expected) for a, expected in pairs]
    return Measured(max(largest(found, expected) for found, expected in seen))


@THEME.case(40, "box-without-height", "a box 0 and 4e-7 m high", "it holds nothing", 1e-6)
def _() -> Measured:
    medium = Medium(absorption=(9.0, 9.0, 9.0))
    return Measured(max(largest(_seen(_box(medium, height)), 1.0) for height in (0.0, 1e-7)))


@THEME.case(40, "camera-inside", "the camera in the middle of a box", "exp(-a d) of the half before it", 1e-4)
def _() -> Measured:
    found = _seen(_box(Medium(absorption=(0.5, 0.5, 0.5)), z=5.0))
    near = np.exp(-0.5 * (2.0 - build.camera().clip_start))
    return Measured(largest(found, near))


@THEME.case(40, "boxes-face-to-face", "three boxes whose faces lie in one plane", "exp(-a d) of all", 1e-4)
def _() -> Measured:
    medium = Medium(absorption=(0.1, 0.1, 0.1))
    found = _seen(_box(medium), _box(medium, 0.5, 1.0), _box(medium, 0.5, -1.0))
    return Measured(largest(found, np.exp(-0.8)))


@THEME.case(40, "glass-in-fog", "a glass ball in a box of fog", "fog around it, none in it; no medium lost", 1e-3)
def _() -> Measured:
    found = _seen(_box(Medium(absorption=(0.1, 0.1, 0.1))), glass=True)
    return Measured(largest(found, np.exp(-0.2)))
