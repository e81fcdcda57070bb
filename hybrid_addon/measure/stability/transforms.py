# SPDX-License-Identifier: GPL-3.0-or-later
"""Matrices of every kind, instances in numbers, and a million triangles."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ...scene import Float32, Float64, Instance, PointLight, Surface, TriangleMesh, World
from . import build
from .case import Measured, Theme
from .compare import different_pixels, largest, off_edges

THEME = Theme("Matrices, instances, large scenes")
LAMP = PointLight("lamp", (2, -3, 5), (30, 30, 30))
PAINT = Surface(reflectivity=0.25, opacity=0.5, ior=1.4)


def seen(*parts: object, depth: int = 3) -> Float32:
    """The parts under a lamp, (h, w, 3)."""
    lens = build.camera((1, -3, 4), (0, 0, 0), (0, 0, 1), (64, 48), 0.4)
    scene = build.make_scene(*parts, camera=lens, lights=(LAMP,), world=World((0.2, 0.3, 0.4)))
    return build.shoot(scene, max_depth=depth).radiance


def against_realised(shape: TriangleMesh, matrix: Float64, surface: Surface = PAINT) -> float:
    """The largest difference between an instance and the mesh with the matrix applied to its vertices."""
    moved = (build.transformed(shape, matrix), surface)
    return largest(seen((shape, surface, {"matrix_world": matrix})), seen(moved))


@THEME.case(
    24,
    "mirrored-instance",
    "a squashed glass ball mirrored by its matrix, against a mirrored mesh",
    "the same picture, bit by bit",
    0,
)
def _() -> Measured:
    egg = replace(build.icosphere(2), vertices=build.icosphere(2).vertices * np.array([1, 0.5, 0.75], np.float32))
    return Measured(against_realised(egg, build.scaling(-1, 1, 1)))


@THEME.case(23, "mirrored-three-times", "negative scale on all three axes, smooth normals", "the mirrored mesh", 1e-6)
def _() -> Measured:
    return Measured(against_realised(build.icosphere(2, 1, True), build.scaling(-1, -1, -1)))


@THEME.case(
    23,
    "stretched",
    "scale 1e-3 : 1 : 1e3, smooth normals",
    "the stretched mesh, normals by the inverse transpose",
    1e-6,
)
def _() -> Measured:
    return Measured(against_realised(build.icosphere(3, 1, True), build.scaling(1e-3, 1, 1e3), build.matte()))


@THEME.case(23, "sheared", "a sheared smooth ball", "the sheared mesh, normals by the inverse transpose", 1e-6)
def _() -> Measured:
    shear = np.eye(4)
    shear[0, 1], shear[2, 0] = 1.5, -0.5
    return Measured(against_realised(build.icosphere(3, 1, True), shear, build.matte(specular=(0.5, 0.5, 0.5))))


@THEME.case(23, "flattened", "a box with scale 0 along z", "a flat sheet", 1e-6)
def _() -> Measured:
    flat = {"matrix_world": build.scaling(1, 1, 0)}
    paint = build.matte()
    return Measured(largest(seen((build.box(), paint, flat)), seen((build.floor(1), paint))))


@THEME.case(
    23,
    "vanished",
    "a ball with scale 0 on two and on three axes beside a box",
    "the box alone, bit by bit",
    0,
    "pixels",
)
def _() -> Measured:
    crate, paint = (build.box((-1, -1, -1), (1, 1, 1)), build.matte()), build.matte()
    alone = seen(crate)
    shrunk = [
        seen(crate, (build.icosphere(1), paint, {"matrix_world": build.scaling(*s)})) for s in ((1, 0, 0), (0, 0, 0))
    ]
    return Measured(sum(different_pixels(alone, s) for s in shrunk))


@THEME.case(
    23,
    "smooth-and-flattened",
    "a smooth ball with scale 0 along each axis in turn",
    "finite, no pixel lost",
    0,
    "pixels",
)
def _() -> Measured:
    pictures = [
        seen((build.icosphere(2, 1, True), build.matte(), {"matrix_world": np.diag([*axes, 1.0])}))
        for axes in 1 - np.eye(3)
    ]
    return Measured(sum(int(np.count_nonzero(~np.isfinite(p).all(-1))) for p in pictures))


def many(count: int) -> Float64:
    """(count, 4, 4) matrices of a pile of small things, every other one mirrored, on a grid that float32 holds."""
    m = np.zeros((count, 4, 4))
    m[:, [0, 1, 2], [0, 1, 2]] = 2.0**-7
    m[1::2, 2, 2] *= -1
    m[:, :3, 3] = np.random.default_rng(24).integers(-2048, 2048, (count, 3)) * [2.0**-10, 2.0**-10, 2.0**-12]
    m[:, 3, 3] = 1
    return m


@THEME.case(
    24,
    "many-instances",
    "1e5 tetrahedra, every other one mirrored, against one mesh of all of them",
    "the same picture, bit by bit",
    0,
    "pixels",
)
def _() -> Measured:
    tetra = build.mesh([(-1, -1, -1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)], [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])
    matrices, paint = many(100_000), build.matte()
    base = build.make_scene(camera=build.camera(size=(64, 48)), lights=(LAMP,), surfaces=(paint,))
    began = time.perf_counter()
    instanced = replace(base, meshes=(tetra,), instances=tuple(Instance("t", 0, m, (0,)) for m in matrices))
    first = build.shoot(instanced).radiance
    took = time.perf_counter() - began
    world = matrices[:, None, [0, 1, 2], [0, 1, 2]] * tetra.vertices + matrices[:, None, :3, 3]
    mirrored = (np.arange(len(matrices)) % 2 == 1)[:, None, None]
    order = np.where(mirrored, tetra.triangles[:, [0, 2, 1]], tetra.triangles)
    triangles = (order + 4 * np.arange(len(matrices))[:, None, None]).reshape(-1, 3)
    one = replace(
        base, meshes=(build.mesh(world.reshape(-1, 3), triangles),), instances=(Instance("all", 0, np.eye(4), (0,)),)
    )
    wrong = np.abs(first - build.shoot(one).radiance).max(-1) > 0
    return Measured(int(np.count_nonzero(wrong)), f"{took:.2f} s for 1e5 instances", first)


def hilly(n: int) -> TriangleMesh:
    """Ground of 2 n^2 triangles."""
    y, x = (a.ravel() for a in np.mgrid[0 : n + 1, 0 : n + 1])
    hills = np.stack([x / n * 4 - 2, y / n * 4 - 2, 0.1 * np.sin(x * (40 / n)) * np.sin(y * (40 / n))], axis=1)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + n + 2], 1), np.stack([a, a + n + 2, a + n + 1], 1)])
    return build.mesh(hills, faces)


def cost(n: int) -> float:
    """CPU seconds to build and trace hilly ground of 2 n^2 triangles in a small picture, the least of two."""
    scene = build.make_scene((hilly(n), build.matte()), camera=build.camera(size=(16, 16)), lights=(LAMP,))
    found = []
    for _ in range(2):
        began = time.process_time()
        build.shoot(scene)
        found.append(time.process_time() - began)
    return min(found)


@THEME.case(
    33,
    "a-million-triangles",
    "1.28e6 triangles against 3.2e5",
    "CPU time and memory grow linearly: at most twice the time per triangle",
    2.0,
    "times",
)
def _() -> Measured:
    small, large = cost(400), cost(800)
    return Measured(large / (4 * small), f"{large:.2f} CPU seconds for 1 280 000 triangles, building included")


@THEME.case(
    33,
    "drops-on-a-large-mesh",
    "200 drops of water on 3.2e5 triangles, which each of them may touch",
    "prepared in at most three times the time of 200 drops of lead",
    3.0,
    "times",
)
def _() -> Measured:
    ground, drop, rng = hilly(400), build.icosphere(2, 0.02), np.random.default_rng(33)
    places = [build.translation(x, y, 0.1) for x, y in rng.uniform(-2, 2, (200, 2))]

    def seconds(surface: Surface) -> float:
        drops = ((drop, surface, {"matrix_world": place}) for place in places)
        scene = build.make_scene((ground, build.matte()), *drops, camera=build.camera(size=(4, 4)))
        return min(build.shoot(scene).time["build"]["cpu"] for _ in range(2))

    water, lead = seconds(build.glass(1.33)), seconds(build.matte())
    return Measured(water / lead, f"{water:.2f} CPU seconds")


@THEME.case(
    24,
    "nested-instances",
    "an instance in a turned instance in a moved one: the product of the matrices",
    "the realised mesh, off edges",
    2e-6,
)
def _() -> Measured:
    matrix = (
        build.translation(0.2, -0.1, 0.3)
        @ build.rotation(24)
        @ build.scaling(0.5, -0.7, 0.9)
        @ build.translation(0.3, 0, 0)
    )
    ball = build.icosphere(3)
    a, b = seen((ball, PAINT, {"matrix_world": matrix})), seen((build.transformed(ball, matrix), PAINT))
    return off_edges(a, b)
