# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of the whole scene that must not change the picture: the sharpest tests, as they need no reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from ...scene import (
    AreaLight,
    Expression,
    Film,
    Float64,
    Light,
    Plane,
    PointLight,
    Scene,
    Sphere,
    SpotLight,
    SunLight,
    Surface,
    World,
)
from . import build
from .case import Measured, Theme
from .compare import films_differ, off_edges

THEME = Theme("Scale, place and turn of the whole scene")
GRID = 1024.0
"""Coordinates rounded to multiples of 1 / GRID m stay exact in float64 when moved by whole kilometres."""


@cache
def everything(exact: bool = False) -> Scene:
    """Glass, mirror, highlight, texture, every kind of light, analytic shapes; `exact`: coordinates on a grid."""
    ball = build.icosphere(2, 0.5, smooth=True)
    if exact:
        ball = replace(ball, vertices=(np.round(ball.vertices * GRID) / GRID).astype(np.float32))
    board = build.floor(3.0, uv_maps={"": build.RAMP_UVS})
    scene = build.make_scene(
        (board, Surface(base_color=Expression("image", (), build.ramp()), reflectivity=0.125)),
        (ball, build.glass(1.5), {"matrix_world": build.translation(0.5, -0.5, 0.625)}),
        (build.box((-1, 0, 0.125), (-0.25, 1, 1)), build.matte(specular=(0.25, 0.5, 0.5), roughness=0.375)),
        (build.quad([(1, 1, 0.5), (2, 1, 0.5), (2, 1, 1.5), (1, 1, 1.5)]), build.mirror(0.75)),
        camera=build.camera((0.5, -4, 2), (0, 0, 0.5), (0, 0, 1), (72, 54), 0.5),
        lights=(
            PointLight("point", (1, -1, 2), (2, 2, 2), radius=0.125),
            SpotLight("spot", (-2, -1, 3), (5, 4, 3), range=8.0),
            SunLight("sun", (0.5, 0.25, 1), (0.5, 0.5, 0.5)),
            AreaLight("area", (0, 1, 3), (0, 0, -1), (0.5, 0, 0), (0, 0.25, 0), (2, 1, 1), range=16.0),
        ),
        world=World((0.25, 0.25, 0.25)),
    )
    shapes = (Sphere("ball", (-0.5, -1, 0.25), 0.25, 1, ray_traced=True),)
    return replace(scene, spheres=shapes, planes=(Plane("ground", (0, 0, -0.5), (0, 0, 1), 2),))


@cache
def reference(exact: bool = False, shadow_samples: int = 1) -> Film:
    """What must come out of every changed scene again."""
    return build.shoot(everything(exact), max_depth=5, shadow_samples=shadow_samples)


def _changed(light: Light, how: dict[str, Callable[[Any], Any]]) -> Light:
    """The light with those of its fields changed that have these names: in every kind of light they mean the same."""
    return replace(light, **{name: how[name](value) for name, value in vars(light).items() if name in how})


def scaled(scene: Scene, s: float) -> Scene:
    """The whole scene s times as large; point lights s^2 times as strong, so that nothing changes to the eye."""

    def times(vector: Any) -> Any:
        return tuple(s * np.array(vector))

    def length(value: float) -> float:
        return s * value

    grown: dict[str, Callable[[Any], Any]] = {"range": length, "radius": length}
    grown |= dict.fromkeys(("position", "axis_u", "axis_v"), times)
    grown["intensity"] = lambda color: tuple(s * s * np.array(color))

    lens, seen = scene.camera, scene.camera.matrix_world.copy()
    seen[:3, 3] *= s
    grow = build.scaling(s, s, s)
    return replace(
        scene,
        camera=replace(lens, matrix_world=seen, clip_start=s * lens.clip_start, clip_end=s * lens.clip_end),
        instances=tuple(replace(i, matrix_world=grow @ i.matrix_world) for i in scene.instances),
        spheres=tuple(replace(b, center=times(b.center), radius=s * b.radius) for b in scene.spheres),
        planes=tuple(replace(p, point=times(p.point)) for p in scene.planes),
        lights=tuple(_changed(one, grown) for one in scene.lights),
    )


def rigidly(scene: Scene, matrix: Float64) -> Scene:
    """The whole scene turned and moved by a rigid (4, 4) matrix."""
    turn = matrix[:3, :3]

    def point(p: Any) -> Any:
        return tuple(turn @ np.array(p, np.float64) + matrix[:3, 3])

    def vector(v: Any) -> Any:
        return tuple(turn @ np.array(v, np.float64))

    moved: dict[str, Callable[[Any], Any]] = dict.fromkeys(("direction", "axis_u", "axis_v"), vector)
    moved |= {"position": point, "world_to_light": lambda matrix: matrix @ turn.T}
    return replace(
        scene,
        camera=replace(scene.camera, matrix_world=matrix @ scene.camera.matrix_world),
        instances=tuple(replace(i, matrix_world=matrix @ i.matrix_world) for i in scene.instances),
        spheres=tuple(replace(b, center=point(b.center)) for b in scene.spheres),
        planes=tuple(replace(p, point=point(p.point), normal=vector(p.normal)) for p in scene.planes),
        lights=tuple(_changed(one, moved) for one in scene.lights),
    )


def worst(changed: list[tuple[str, Scene]]) -> Measured:
    """Of several changed scenes the one that differs most from the reference, off edges; with hard shadows.

    Soft ones sample other points of their lights when a scene turns: they agree in the mean only.
    """
    expected = reference(shadow_samples=0).radiance
    found = [(name, off_edges(build.shoot(s, max_depth=5, shadow_samples=0).radiance, expected)) for name, s in changed]
    name, most = max(found, key=lambda pair: pair[1].value)
    return Measured(most.value, f"largest for {name}: {most.detail}")


@THEME.case(
    1,
    "scale-by-powers-of-two",
    "the whole scene 2^k times as large, k = -13, -3, 8, 23",
    "the same picture, bit by bit",
    0,
)
def _() -> Measured:
    powers = (-13, -3, 8, 23)
    found = [films_differ(build.shoot(scaled(everything(), 2.0**k), max_depth=5), reference()) for k in powers]
    return Measured(max(found), "radiance, coverage and residual of 3888 pixels", reference().radiance)


@THEME.case(
    1,
    "scale-by-powers-of-ten",
    "the whole scene 1e-4, 1e-2, 1e2, 1e4, 1e7 times as large",
    "the same picture off edges",
    1e-5,
)
def _() -> Measured:
    return worst([(f"scale {s:g}", scaled(everything(), s)) for s in (1e-4, 1e-2, 1e2, 1e4, 1e7)])


@THEME.case(
    2,
    "move-exactly",
    "everything moved by (1e3, 1e6, -1e6) m, coordinates that float64 holds exactly",
    "the same picture, bit by bit",
    0,
)
def _() -> Measured:
    moved = build.shoot(rigidly(everything(True), build.translation(1e3, 1e6, -1e6)), max_depth=5)
    return Measured(films_differ(moved, reference(True)), "no digit is lost before the scene is recentred in float64")


@THEME.case(
    2, "move-anywhere", "everything moved by (1e3, 1e6, -1e6) m, any coordinates", "the same picture off edges", 1e-6
)
def _() -> Measured:
    return worst([("that offset", rigidly(everything(), build.translation(1e3, 1e6, -1e6)))])


@THEME.case(2, "move-to-orbit", "everything moved by 1e7 m along each axis", "the same picture off edges", 1e-5)
def _() -> Measured:
    return worst([("1e7 m", rigidly(everything(), build.translation(1e7, -1e7, 1e7)))])


@THEME.case(3, "turn", "scene and camera turned about a random axis", "the same picture off edges", 2e-6)
def _() -> Measured:
    return worst([(f"turn {seed}", rigidly(everything(), build.rotation(seed))) for seed in (1, 2, 3)])
