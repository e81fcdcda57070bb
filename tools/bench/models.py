# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of plain data whose size can be chosen."""

from __future__ import annotations

import numpy as np

from hybrid_addon.measure.stability.build import camera, floor, icosphere, quad
from hybrid_addon.scene import Camera, Instance, PointLight, Scene, Surface, TriangleMesh, World

GLASS = Surface("Glass", opacity=0.0, ior=1.5)
MIRROR = Surface("Mirror", reflectivity=0.9)
MATTE = Surface("Matte")
LAMP = PointLight("Lamp", (2.0, -3.0, 5.0), (60.0, 60.0, 60.0))
SKY = World((0.3, 0.4, 0.5))


def ball_on_floor(levels: int, surface: Surface, size: tuple[int, int], lights: int = 1) -> Scene:
    """A ball of 20 x 4^levels triangles on a floor, filling most of the picture; the lights stand in a ring."""
    angles = 2 * np.pi * np.arange(lights) / lights
    ring = [
        PointLight(f"Lamp {i}", (4 * np.cos(a), 4 * np.sin(a), 5.0), (60 / lights,) * 3) for i, a in enumerate(angles)
    ]
    return _scene([icosphere(levels, smooth=True), floor(6.0, -1.0)], [surface, MATTE], _view(size), ring)


def between_mirrors(size: tuple[int, int]) -> Scene:
    """Two mirrors face to face, with a matte ball between: each bounce of a camera ray is one ray more."""
    near = quad([(-9, -3, -9), (-9, -3, 9), (9, -3, 9), (9, -3, -9)], "near")
    far = quad([(-9, 3, -9), (9, 3, -9), (9, 3, 9), (-9, 3, 9)], "far")
    view = camera((0.4, -2.9, 0.6), (0, 0, 0), (0, 0, 1), size)
    return _scene([icosphere(4, 0.8), near, far], [MATTE, MIRROR, MIRROR], view, [LAMP])


def _view(size: tuple[int, int]) -> Camera:
    return camera((0, -3.2, 1.2), (0, 0, -0.1), (0, 0, 1), size)


def _scene(meshes: list[TriangleMesh], surfaces: list[Surface], view: Camera, lights: list[PointLight]) -> Scene:
    return Scene(
        camera=view,
        meshes=tuple(meshes),
        instances=tuple(Instance(m.name, i, np.eye(4), (i,), ray_traced=True) for i, m in enumerate(meshes)),
        surfaces=tuple(surfaces),
        lights=tuple(lights),
        world=SKY,
    )
