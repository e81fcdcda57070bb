# SPDX-License-Identifier: GPL-3.0-or-later
"""Glass that is open, inverted or vanishingly thin."""

from __future__ import annotations

from dataclasses import replace

from ...scene import PointLight, Surface, TriangleMesh
from . import build
from .case import Measured
from .compare import largest
from .media import THEME, down, product, transmission


@THEME.case(
    13,
    "open-sheet",
    "a single sheet of glass before a lamp, n = 1.5",
    "the ray enters and never leaves: 1 - R1 = .96",
    1e-6,
)
def _() -> Measured:
    scene = build.make_scene((build.floor(9), build.glass(1.5)), (build.floor(9, -4), build.emitter()), camera=down())
    got = build.shoot(scene, allow=("lost_media",), max_depth=3).radiance
    return Measured(largest(got, product(1.5)), f"{got[0, 0, 0]:.6f}")


@THEME.case(
    13,
    "open-sheet-furnace",
    "an open sheet of glass, slanted, white world",
    "radiance + residual = 1: not black, not NaN",
    1e-6,
)
def _() -> Measured:
    lens = build.camera((0.3, -2, 3), size=(32, 32), up=(0, 0, 1))
    scene = build.make_scene((build.floor(1), build.glass(1.5)), camera=lens, world=build.WHITE_WORLD)
    film = build.shoot(scene, allow=("lost_media",), max_depth=4)
    return Measured(largest(film.radiance + film.residual[..., None], 1))


def inverted(shape: TriangleMesh, every: int = 1) -> TriangleMesh:
    """The mesh with every nth triangle turned over."""
    triangles = shape.triangles.copy()
    triangles[::every] = triangles[::every][:, [0, 2, 1]]
    return replace(shape, triangles=triangles, corners=triangles)


def turned_over(surface: Surface, every: int) -> Measured:
    """How much turning triangles over changes a lit ball of this surface."""
    lamp = PointLight("lamp", (2, -3, 4), (30, 30, 30))
    ball, lens = build.icosphere(2), build.camera((0, -4, 1), (0, 0, 0), (0, 0, 1), (48, 48), 0.4)
    found = [
        build.shoot(
            build.make_scene((b, surface), camera=lens, lights=(lamp,), world=build.WHITE_WORLD), max_depth=2
        ).radiance
        for b in (ball, inverted(ball, every))
    ]
    return Measured(largest(*found))


@THEME.case(14, "inverted-matte", "a matte ball with all normals inward", "the same picture, bit by bit", 0)
def _() -> Measured:
    return turned_over(build.matte(), 1)


@THEME.case(14, "inverted-mirror", "a mirror ball with all normals inward", "the same picture, bit by bit", 0)
def _() -> Measured:
    return turned_over(build.mirror(0.75), 1)


@THEME.case(
    14, "mixed-winding", "a matte ball with every third triangle turned over", "the same picture, bit by bit", 0
)
def _() -> Measured:
    return turned_over(build.matte(), 3)


@THEME.case(
    14, "inverted-glass", "a glass ball with all normals inward", "the media swapped: a ball of IOR 1/1.5", 1e-6
)
def _() -> Measured:
    lens = build.camera((0, -4, 1), (0, 0, 0), (0, 0, 1), (48, 48), 0.4)
    stripes = [(build.floor(4, -2 - k / 4), build.emitter(k / 4, 0.5, 1 - k / 4)) for k in range(3)]
    ball = build.icosphere(2)
    cases = ((inverted(ball), build.glass(1.5)), (ball, build.glass(1 / 1.5)))
    found = [build.shoot(build.make_scene(b, *stripes, camera=lens), max_depth=4).radiance for b in cases]
    return Measured(largest(*found), "", found[0])


# ------------------------------------------------------------------------------------------------ thin


def thin(thickness: float, distance: float = 0.0) -> float:
    """|T - (1 - R)/(1 + R)| of a plate so thin; a second body at `distance` keeps the scene's centre away."""
    turn = build.rotation(26)
    plate = (build.box((-1, -1, -thickness / 2), (1, 1, thickness / 2)), build.glass(1.5), {"matrix_world": turn})
    lamp = (build.floor(2, -2), build.emitter(), {"matrix_world": turn})
    parts = [plate, lamp]
    if distance:
        parts.append((build.box(), build.BLACK_BODY, {"matrix_world": build.translation(2 * distance, 0, 0)}))
    up = turn[:3, 2]
    lens = replace(build.camera(2 * up, (0, 0, 0), turn[:3, 1], (8, 8), 0.5), projection="ORTHO")
    film = build.shoot(build.make_scene(*parts, camera=lens), max_depth=12)
    return largest(film.radiance, transmission(1.5, 1.5))


THIN = "the thin-wall limit T = (1 - R)/(1 + R) = .923077"


@THEME.case(26, "thin-glass", "tilted plates 1e-2, 1e-3, 1e-4, 1e-5 m thick, 1 m wide", THIN, 1e-3)
def _() -> Measured:
    return Measured(max(thin(h) for h in (1e-2, 1e-3, 1e-4, 1e-5)))


@THEME.case(26, "thinner-glass-than-float32", "tilted plates 1e-6, 1e-7, 1e-8 m thick", THIN, 1e-3)
def _() -> Measured:
    found = {h: thin(h) for h in (1e-6, 1e-7, 1e-8)}
    worst = max(found, key=lambda h: found[h])
    return Measured(found[worst], f"worst at {worst:g} m")


@THEME.case(26, "thin-glass-a-kilometre-away", "a plate of 1e-4 m, 1 km from the centre of the scene", THIN, 1e-3)
def _() -> Measured:
    return Measured(thin(1e-4, 1e3))
