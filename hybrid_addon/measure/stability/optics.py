# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed forms of reflection: halls of mirrors, retroreflectors, a periscope, the mirrored world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import (
    Camera,
    Expression,
    Float64,
    Instance,
    PointLight,
    Scene,
    SunLight,
    Surface,
    TriangleMesh,
    Visibility,
)
from . import build
from .case import Measured, Theme
from .compare import largest, off_edges

THEME = Theme("Closed forms of optics")
TARGETS = (4.0, 12.0)
"""Distances in metres at which a screen catches an outgoing ray; the difference of two places gives its direction."""

SEEN, UNSEEN = Visibility(camera=False, shadow=False), Visibility(camera=False, secondary=False)


def outgoing(scene: Scene, start: Float64, expected: Float64, max_depth: int) -> Float64:
    """Direction of the ray that the 1 x 1 pixel camera of `scene` sends out, as an error (2,) in radians.

    start, expected : a point near which the ray leaves, and its expected unit direction. Two screens with a colour
    ramp, sunlit in a black world, say in floating point where the ray meets them.
    """
    side = np.cross(expected, (0.31, 0.87, 0.38))
    side /= np.sqrt((side * side).sum())
    up = np.cross(side, expected)
    corners = [a * side + b * up for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    screen = build.quad(corners, "screen", uv_maps={"": build.RAMP_UVS})
    paper = Surface(base_color=Expression("image", (), build.ramp()), ambient=0.0)
    sun = SunLight("sun", tuple(-expected), (np.pi,) * 3, cast_shadow=False)
    base = replace(scene, meshes=(*scene.meshes, screen), surfaces=(*scene.surfaces, paper), lights=(sun,))
    mesh, surface = len(scene.meshes), (len(scene.surfaces),)
    found = []
    for distance in TARGETS:
        # All screens, and one opposite, stand there every time: only then is the scene's centre always the same.
        screens = tuple(
            Instance(
                "screen",
                mesh,
                build.translation(*(start + d * expected)),
                surface,
                visibility=SEEN if d == distance else UNSEEN,
            )
            for d in (*TARGETS, -TARGETS[-1])
        )
        whole = replace(base, instances=(*scene.instances, *screens))
        red, green, blue = build.shoot(whole, allow=("lost_media",), max_depth=max_depth).radiance[0, 0]
        if not blue > 0:
            raise ValueError(f"the ray does not meet the screen at {distance:g} m")
        found.append(2 * np.array([float(red) / float(blue), float(green) / float(blue)]) - 1)
    return np.asarray((found[1] - found[0]) / (TARGETS[1] - TARGETS[0]))


def one_ray(eye: Float64, direction: Float64) -> Camera:
    """A camera of one pixel whose ray goes from `eye` along `direction`."""
    up = (0, 1, 0) if abs(direction[1]) < 0.9 else (1, 0, 0)
    lens = build.camera(eye, eye + direction, up, (1, 1), 1e-6)
    return replace(lens, projection="ORTHO", clip_start=0.0)


def unit(*v: float) -> Float64:
    """The unit vector along v."""
    a = np.array(v, np.float64)
    return np.asarray(a / np.sqrt((a * a).sum()))


# ------------------------------------------------------------------------------------------------ mirrors


@THEME.case(
    15,
    "hall-of-mirrors",
    "inside a glowing mirror box, r = .5, .9, .99, depth 0, 1, 5, 30",
    "E (1 - r^(D+1)) / (1 - r), residual r^(D+1)",
    1e-6,
    "relative",
)
def _() -> Measured:
    worst = 0.0
    for r in (0.5, 0.9, 0.99):
        for depth in (0, 1, 5, 30):
            glow = Surface(base_color=(0, 0, 0), emission=(0.1, 0.2, 0.3), reflectivity=r)
            lens = build.camera((0.1, 0.2, 0.3), (1, 0.5, 0.4), size=(12, 12))
            film = build.shoot(build.make_scene((build.box(), glow), camera=lens), max_depth=depth)
            series = np.array([0.1, 0.2, 0.3]) * (1 - r ** (depth + 1)) / (1 - r)
            worst = max(worst, largest(film.radiance / series, 1))
    return Measured(worst, "12 halls of 144 pixels")


@THEME.case(
    15,
    "hall-of-mirrors-to-the-end",
    "r = .5, .9, .99 as deep as a tail below 1e-3 needs: 11, 88, 1146",
    "radiance + residual L_max = E / (1 - r)",
    1e-5,
    "relative",
)
def _() -> Measured:
    worst, tail = 0.0, 0.0
    for r, depth in ((0.5, 11), (0.9, 88), (0.99, 1146)):
        glow = Surface(base_color=(0, 0, 0), emission=(1, 1, 1), reflectivity=r)
        lens = build.camera((0.1, 0.2, 0.3), (1, 0.5, 0.4), size=(4, 4))
        film = build.shoot(build.make_scene((build.box(), glow), camera=lens), max_depth=depth)
        limit = 1 / (1 - r)
        worst = max(worst, largest(film.radiance[..., 0] / limit + film.residual, 1))
        tail = max(tail, float(np.max(film.residual)))
    return Measured(worst, f"largest tail {tail:.1e}")


@THEME.case(17, "corner-cube", "three mirrors at right angles, turned at random", "out = -in", 1e-6, "rad")
def _() -> Measured:
    turn = build.rotation(17)
    sheets: list[TriangleMesh] = [
        build.quad([(0, 0, 0), (9, 0, 0), (9, 9, 0), (0, 9, 0)]),
        build.quad([(0, 0, 0), (0, 9, 0), (0, 9, 9), (0, 0, 9)]),
        build.quad([(0, 0, 0), (0, 0, 9), (9, 0, 9), (9, 0, 0)]),
    ]
    silver, worst = build.mirror(), 0.0
    for into in (unit(-1, -1, -1), unit(-1, -0.8, -1.1), unit(-0.9, -1.2, -0.7)):
        hit = np.array([1.0, 1.2, 0.9])
        ray = turn[:3, :3] @ into
        lens = one_ray(turn[:3, :3] @ hit - 5 * ray, ray)
        scene = build.make_scene(*[(q, silver, {"matrix_world": turn}) for q in sheets], camera=lens)
        worst = max(worst, largest(outgoing(scene, -turn[:3, :3] @ hit, -ray, 3), 0))
    return Measured(worst, "three rays")


@THEME.case(17, "periscope", "two parallel mirrors at 45 degrees, turned at random", "out = in", 1e-6, "rad")
def _() -> Measured:
    turn = build.rotation(18)
    tilted = build.translation(0, 0, 0)
    c = np.sqrt(0.5)
    tilted[:3, :3] = np.array([[c, 0, -c], [0, 1, 0], [c, 0, c]])
    raised = tilted.copy()
    raised[2, 3] = 2.0
    silver, plate = build.mirror(), build.floor(0.5)
    ray = turn[:3, :3] @ np.array([1.0, 0.0, 0.0])
    lens = one_ray(turn[:3, :3] @ np.array([-3.0, 0.1, 0.05]), ray)
    parts = [(plate, silver, {"matrix_world": turn @ m}) for m in (tilted, raised)]
    scene = build.make_scene(*parts, camera=lens)
    return Measured(largest(outgoing(scene, turn[:3, :3] @ np.array([0.0, 0.1, 2.0]), ray, 2), 0))


@THEME.case(
    17,
    "mirror-image",
    "a planar mirror with a lit scene in front of it",
    "the scene mirrored, seen directly, off edges",
    2e-6,
)
def _() -> Measured:
    things = [
        (build.box((-2.5, -0.9, -0.8), (-1.6, -0.2, 0.3)), build.matte((0.9, 0.3, 0.1)), np.eye(4)),
        (build.icosphere(3, 0.5), build.matte((0.1, 0.4, 0.9)), build.translation(-1.5, 0.6, 0.4)),
        (build.quad([(-9, -2, -1), (0, -2, -1), (0, 2, -1), (-9, 2, -1)]), build.emitter(0.2, 0.3, 0.1), np.eye(4)),
    ]
    lamp = PointLight("lamp", (-1, -1.2, 1.5), (6, 5, 4))
    lens = build.camera((-4, 0, 0.2), (0, 0, 0), (0, 0, 1), (64, 64), 0.4)
    unseen = Visibility(camera=False)
    silver = build.quad([(0, -9, -9), (0, -9, 9), (0, 9, 9), (0, 9, -9)], "mirror")  # in x = 0, facing -x
    hidden = [(m, s, {"matrix_world": at, "visibility": unseen}) for m, s, at in things]
    shown = build.shoot(build.make_scene((silver, build.mirror()), *hidden, camera=lens, lights=(lamp,)), max_depth=1)
    flip = build.scaling(-1, 1, 1)
    mirrored = [(m, s, {"matrix_world": flip @ at}) for m, s, at in things]
    other = replace(lamp, position=(1, -1.2, 1.5))
    direct = build.shoot(build.make_scene(*mirrored, camera=lens, lights=(other,)))
    found = off_edges(shown.radiance, direct.radiance)
    return Measured(found.value, found.detail, shown.radiance)
