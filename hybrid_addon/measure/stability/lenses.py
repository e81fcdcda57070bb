# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed forms of refraction: plates, a prism, a glass ball; and meshes against formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import Expression, Instance, Plane, PointLight, Sphere, SunLight, Surface
from . import build
from .case import Measured
from .compare import largest, off_edges
from .fresnel import normal_reflectance
from .optics import THEME, one_ray, outgoing, unit


@THEME.case(
    16,
    "plate-at-normal-incidence",
    "a plane-parallel plate, n = 1.5",
    "R = 2 R1 / (1 + R1) = .0769231, T = 1 - R",
    1e-6,
)
def _() -> Measured:
    lens = replace(build.camera(size=(8, 8)), projection="ORTHO")
    plate = (build.box((-9, -9, -0.1), (9, 9, 0.1)), build.glass(1.5))
    lit = build.emitter()
    up = build.shoot(build.make_scene(plate, (build.ceiling(9, 9), lit), camera=lens), max_depth=16).radiance
    down = build.shoot(build.make_scene(plate, (build.floor(9, -9), lit), camera=lens), max_depth=16).radiance
    r1 = normal_reflectance(1.5)
    r = 2 * r1 / (1 + r1)
    return Measured(max(largest(up, r), largest(down, 1 - r)), f"R = {up[0, 0, 0]:.7f}, T = {down[0, 0, 0]:.7f}")


@THEME.case(
    16,
    "plate-cut-short",
    "the plate after 0, 1, 2 internal pairs of bounces",
    "missing: R1^(2(k+1)) (1-R1)^2 / (1-R1^2) = 1.5e-3, 2.4e-6, 3.8e-9",
    2e-7,
)
def _() -> Measured:
    lens = replace(build.camera(size=(4, 4)), projection="ORTHO")
    scene = build.make_scene(
        (build.box((-9, -9, -0.1), (9, 9, 0.1)), build.glass(1.5)), (build.floor(9, -9), build.emitter()), camera=lens
    )
    r1 = normal_reflectance(1.5)
    full, worst, seen = (1 - r1) / (1 + r1), 0.0, []
    for k in (0, 1, 2):
        got = build.shoot(scene, max_depth=2 + 2 * k).radiance[0, 0, 0]
        missing = r1 ** (2 * (k + 1)) * (1 - r1) ** 2 / (1 - r1**2)
        worst = max(worst, abs(full - missing - float(got)))
        seen.append(f"{full - float(got):.1e}")
    return Measured(worst, "missing: " + ", ".join(seen))


@THEME.case(
    16,
    "plate-shifts-sideways",
    "a plate of 0.8 m at 50 degrees, n = 1.5",
    "shift t sin i (1 - cos i / sqrt(n^2 - sin^2 i)), direction unchanged",
    2e-6,
    "m",
)
def _() -> Measured:
    angle, n, thick = np.radians(50), 1.5, 0.8
    shift = thick * np.sin(angle) * (1 - np.cos(angle) / np.sqrt(n * n - np.sin(angle) ** 2))
    ray, across = unit(-np.sin(angle), 0, -np.cos(angle)), unit(-np.cos(angle), 0, np.sin(angle))
    lens = replace(build.camera(-6 * ray, (0, 0, 0), (0, 1, 0), (1, 1), 1e-6), projection="ORTHO")
    center, half = 1.5 * ray, 0.5
    corners = [center + half * (a * across + b * np.array([0, 1, 0])) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    paper = Surface(base_color=Expression("image", (), build.ramp()), ambient=0.0)
    screen = (build.quad(corners, uv_maps={"": build.RAMP_UVS}), paper)
    sun = SunLight("sun", tuple(-ray), (np.pi,) * 3, cast_shadow=False)
    plate = (build.box((-1, -1, -0.4), (1, 1, 0.4)), build.glass(n))

    def place(*parts: object) -> float:
        r, _, b = build.shoot(build.make_scene(screen, *parts, camera=lens, lights=(sun,)), max_depth=2).radiance[0, 0]
        return half * (2 * float(r) / float(b) - 1)

    got = abs(place(plate) - place())
    return Measured(abs(got - shift), f"{got:.7f} m, expected {shift:.7f} m")


@THEME.case(
    17,
    "prism",
    "a 60 degree prism, n = 1.5, at minimum deviation",
    "deviation 2 asin(n sin 30) - 60 = 37.18 deg",
    1e-6,
    "rad",
)
def _() -> Measured:
    n, h = 1.5, np.sqrt(3) / 2
    deviation = 2 * np.arcsin(n * 0.5) - np.radians(60)
    outline = [(-0.5, -h / 2), (0.5, -h / 2), (0.0, h / 2)]
    corners = [(x, y, z) for y in (-5, 5) for x, z in outline]
    sides = [(0, 1, 2), (5, 4, 3), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (2, 3, 0)]
    turn = build.rotation(19)
    into = turn[:3, :3] @ np.array([np.cos(deviation / 2), 0, np.sin(deviation / 2)])
    out = turn[:3, :3] @ np.array([np.cos(deviation / 2), 0, -np.sin(deviation / 2)])
    entry = turn[:3, :3] @ np.array([-0.25, 0.1, 0.0])
    prism = (build.mesh(corners, sides), build.glass(n), {"matrix_world": turn})
    scene = build.make_scene(prism, camera=one_ray(entry - 3 * into, into))
    return Measured(largest(outgoing(scene, turn[:3, :3] @ np.array([0.25, 0.1, 0.0]), out, 2), 0))


@THEME.case(
    18,
    "glass-ball",
    "rays at .1, .5, .9 of the radius of an analytic glass ball",
    "deviation 2 (asin b - asin(b / n))",
    3e-6,
    "rad",
)
def _() -> Measured:
    worst, n = 0.0, 1.5
    for b in (0.1, 0.5, 0.9):
        i, t = np.arcsin(b), np.arcsin(b / n)
        turned = 2 * (i - t)
        out = np.array([np.cos(turned), 0, -np.sin(turned)])
        scene = build.make_scene(camera=one_ray(np.array([-3.0, 0, b]), unit(1, 0, 0)), surfaces=(build.glass(n),))
        scene = replace(scene, spheres=(Sphere("ball", (0, 0, 0), 1.0, 0),))
        exit_angle = np.pi - i - (np.pi - 2 * t)  # where the ray leaves, seen from the centre
        start = np.array([np.cos(exit_angle), 0, np.sin(exit_angle)])
        worst = max(worst, largest(outgoing(scene, start, out, 2), 0))
    return Measured(worst, "an offset of 5 ulp at the surface turns the ray at .9 by 1.7e-6 rad")


@THEME.case(
    18,
    "mesh-of-a-ball-converges",
    "smooth shaded icospheres against the analytic sphere",
    "error of second order in the edge",
    0.2,
    "|slope - 2|",
)
def _() -> Measured:
    lamp = PointLight("lamp", (2, -3, 4), (30, 30, 30))
    lens = build.camera((0, -4, 0), (0, 0, 0), (0, 0, 1), (64, 64), 0.2)
    scene = build.make_scene(camera=lens, lights=(lamp,), surfaces=(build.matte(),))
    exact = build.shoot(replace(scene, spheres=(Sphere("ball", (0, 0, 0), 1.0, 0),))).radiance
    lit = exact > 0.1 * np.max(exact)  # away from the terminator, where facets shadow each other
    errors = []
    for levels in (3, 4, 5):
        ball = replace(scene, meshes=(build.icosphere(levels, 1, True),))
        ball = replace(ball, instances=(Instance("ball", 0, np.eye(4), (0,)),))
        errors.append(float(np.sqrt(((build.shoot(ball).radiance - exact)[lit] ** 2).mean())))
    slope = float(np.log2(errors[0] / errors[2]) / 2)
    return Measured(abs(slope - 2), f"slope {slope:.2f}; errors " + ", ".join(f"{e:.1e}" for e in errors))


@THEME.case(18, "analytic-plane-is-a-big-quad", "a lit box on either of them", "the same picture, off edges", 2e-6)
def _() -> Measured:
    lamp = PointLight("lamp", (1, 1, 2), (9, 9, 9))
    thing = (build.box((-0.5, -0.5, 0), (0.5, 0.5, 0.7)), build.matte((0.2, 0.5, 0.3)))
    quads = build.make_scene(thing, (build.floor(50), build.matte()), lights=(lamp,))
    plane = build.make_scene(thing, lights=(lamp,))
    plane = replace(plane, surfaces=(*plane.surfaces, build.matte()), planes=(Plane("floor", (3, 1, 0), (0, 0, 7), 1),))
    return off_edges(build.shoot(quads).radiance, build.shoot(plane).radiance)
