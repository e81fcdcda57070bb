# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that no modeller means and every file has: flat, doubled, broken and impossible triangles and numbers."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from ...scene import (
    Expression,
    Film,
    Float32,
    Instance,
    Light,
    Plane,
    PointLight,
    Scene,
    SpotLight,
    SunLight,
    Surface,
    Texture,
    TriangleMesh,
    World,
)
from . import build
from .case import Measured, Theme
from .compare import different_pixels, largest, off_edges

THEME = Theme("Degenerate and broken data")
LAMP = PointLight("lamp", (1, -2, 4), (20, 20, 20))
SAME = "the same picture, bit by bit"


def lit(shape: TriangleMesh, surface: Surface | None = None) -> Scene:
    """One mesh under a lamp and a grey sky."""
    lens = build.camera(size=(48, 48), half=0.3)
    world = World((0.1, 0.1, 0.1))
    return build.make_scene((shape, surface or build.matte()), lights=(LAMP,), world=world, camera=lens)


def dropped(film: Film) -> int:
    """Triangles that the film says were left out."""
    return sum(int(str(e["count"])) for e in film.skipped if e["what"] == "triangles" and "degenerate" in str(e["why"]))


def with_triangles(shape: TriangleMesh, extra: Any) -> TriangleMesh:
    """The mesh and more triangles."""
    triangles = np.concatenate([shape.triangles, np.array(extra, np.int32).reshape(-1, 3)])
    return replace(shape, triangles=triangles, corners=triangles)


@THEME.case(
    21,
    "zero-area",
    "triangles with two or three equal corners, and with three corners on a line",
    "left out and counted",
    0,
    "pixels",
)
def _() -> Measured:
    ball = build.icosphere(2)
    line = np.array([(0, 0, 0), (0.25, 0, 0), (0.5, 0, 0)], np.float32)
    n = len(ball.vertices)
    worse = replace(ball, vertices=np.concatenate([ball.vertices, line]))
    worse = with_triangles(worse, [(0, 0, 5), (3, 3, 3), (1, 2, 1), (n, n + 1, n + 2)])
    film = build.shoot(lit(worse))
    wrong = different_pixels(film.radiance, build.shoot(lit(ball)).radiance) + abs(dropped(film) - 4)
    return Measured(wrong, f"{dropped(film)} of 4 counted")


@THEME.case(21, "duplicates", "every triangle three times, and three times turned over", SAME, 0, "pixels")
def _() -> Measured:
    ball = build.icosphere(2)
    one = build.shoot(lit(ball)).radiance
    same = with_triangles(ball, np.tile(ball.triangles, (2, 1)))
    turned = with_triangles(ball, np.tile(ball.triangles[:, [0, 2, 1]], (2, 1)))
    return Measured(sum(different_pixels(build.shoot(lit(m)).radiance, one) for m in (same, turned)))


@THEME.case(
    21, "slivers", "a square cut into 4000 slivers of width 1e-3 and one fan of width 1e-6", "the plain square", 1e-5
)
def _() -> Measured:
    x = np.concatenate([np.linspace(-2, 0, 1000), 1e-6 * np.arange(1, 11), np.linspace(0.01, 2, 1000)])
    bottom, top = ([(a, y, 0) for a in x] for y in (-2, 2))
    n, k = len(x), np.arange(len(x) - 1)
    strips = np.concatenate([np.stack([k, k + 1, n + k + 1], 1), np.stack([k, n + k + 1, n + k], 1)])
    cut = build.mesh(bottom + top, strips)
    return Measured(
        largest(build.shoot(lit(cut)).radiance, build.shoot(lit(build.floor(2))).radiance), f"{len(strips)} triangles"
    )


def holed(bad: float) -> int:
    """Pixels that differ between a mesh with a bad vertex and one without the triangles around it."""
    ball = build.icosphere(3)
    broken = replace(ball, vertices=ball.vertices.copy())
    broken.vertices[7, 1] = bad
    fan = (ball.triangles == 7).any(1)
    without = replace(ball, triangles=ball.triangles[~fan], corners=ball.corners[~fan])
    film = build.shoot(lit(broken))
    missing = abs(dropped(film) - int(fan.sum()))
    return different_pixels(film.radiance, build.shoot(lit(without)).radiance) + missing


@THEME.case(
    22,
    "broken-vertices",
    "a vertex that is NaN, infinite, or 1e30 m away",
    "the mesh without its triangles, which are counted",
    0,
    "pixels",
)
def _() -> Measured:
    return Measured(sum(holed(bad) for bad in (np.nan, np.inf, -np.inf, 1e30)))


def seconds(scene: Scene) -> float:
    """The least CPU time of three traces."""
    found = []
    for _ in range(3):
        began = time.process_time()
        build.shoot(scene, samples=4, max_depth=3)
        found.append(time.process_time() - began)
    return min(found)


@THEME.case(
    22,
    "broken-vertices-cost-no-time",
    "1 % NaN vertices among 20 480 triangles of glass",
    "at most 2.5 times the clean mesh's time",
    2.5,
    "times",
)
def _() -> Measured:
    ball = build.icosphere(5)
    broken = replace(ball, vertices=ball.vertices.copy())
    broken.vertices[::100] = np.nan
    clean, bad = (seconds(lit(m, build.glass(1.5))) for m in (ball, broken))
    return Measured(bad / clean, "CPU time; NaN rays in Embree would take 600 times as long")


def normals_scene(value: Float32) -> Scene:
    """A smooth ball whose normals are replaced."""
    ball = build.icosphere(2, 1, True)
    assert ball.normals is not None
    return lit(replace(ball, normals=np.broadcast_to(value, ball.normals.shape).astype(np.float32)))


@THEME.case(
    22,
    "broken-normals",
    "shading normals that are NaN, zero or point inward",
    "the flat shaded mesh, bit by bit",
    0,
    "pixels",
)
def _() -> Measured:
    flat = build.shoot(lit(build.icosphere(2))).radiance
    smooth = build.icosphere(2, 1, True).normals
    assert smooth is not None
    bad = (np.full(3, np.nan, np.float32), np.zeros(3, np.float32), -smooth)
    return Measured(sum(different_pixels(build.shoot(normals_scene(n)).radiance, flat) for n in bad))


@THEME.case(
    22,
    "broken-texture-coordinates",
    "texture coordinates NaN, infinite, 1e30, -1e30",
    "finite colours of the image",
    0,
    "pixels",
)
def _() -> Measured:
    wrong = 0
    for bad in (np.nan, np.inf, 1e30, -1e30):
        uvs = build.RAMP_UVS.copy()
        uvs[1] = bad
        surface = Surface(base_color=Expression("image", (), build.ramp()))
        film = build.shoot(lit(build.floor(2, uv_maps={"": uvs}), surface))
        wrong += int(np.count_nonzero(~(np.isfinite(film.radiance) & (film.radiance >= 0)).all(-1)))
    return Measured(wrong)


@THEME.case(
    22,
    "broken-texels",
    "an image and a sky with a NaN and an infinite texel each",
    "the picture with black ones there, bit by bit; they are counted",
    0,
    "pixels",
)
def _() -> Measured:
    def seen(nan: float, inf: float) -> Film:
        pixels = np.full((4, 4, 4), 0.5, np.float32)
        pixels[0, 0, :3], pixels[3, 3, :3] = nan, inf
        image = Texture("broken", pixels)
        scene = lit(
            build.floor(2, uv_maps={"": build.RAMP_UVS}),
            Surface(base_color=Expression("image", (), image), reflectivity=0.5),
        )
        return build.shoot(replace(scene, world=World((1, 1, 1), replace(image, name="sky"))))

    broken = seen(np.nan, np.inf)
    counted = sum(int(str(e["count"])) for e in broken.skipped if e["what"] == "texels")
    wrong = different_pixels(broken.radiance, seen(0, 0).radiance) + abs(counted - 4)
    return Measured(wrong, f"{counted} of 4 texels counted", broken.radiance)


IMPOSSIBLE: tuple[dict[str, Any], ...] = (
    {"opacity": 1.5}, {"opacity": np.nan}, {"reflectivity": -0.1}, {"base_color": (0, np.nan, 0)},
    {"emission": (np.inf, 0, 0)}, {"roughness": np.inf}, {"specular": (0, 0, np.nan)}, {"ior": np.nan},
)  # fmt: skip


def is_refused(scene: Scene) -> bool:
    """Whether the tracer refuses a scene in one line."""
    try:
        build.shoot(scene)
    except ValueError as error:
        return "\n" not in str(error)
    return False


@THEME.case(
    22, "impossible-surfaces", "NaN, infinite and out of range colours and weights", "refused by name", 0, "not refused"
)
def _() -> Measured:
    return Measured(sum(not is_refused(lit(build.box(), Surface(**values))) for values in IMPOSSIBLE))


@THEME.case(
    22, "impossible-lights", "NaN, infinite and negative sizes, ranges, cones and weights", "refused", 0, "not refused"
)
def _() -> Measured:
    wrong: tuple[dict[str, Any], ...] = (
        {"radius": np.nan}, {"radius": -1.0}, {"radius": np.inf}, {"range": np.nan}, {"range": -1.0},
        {"diffuse": np.nan}, {"specular": np.inf}, {"cos_cone": np.nan}, {"blend": np.nan},
        {"world_to_light": np.full((3, 3), np.nan)}, {"position": (0, 0, np.nan)}, {"intensity": (0, np.inf, 0)},
    )  # fmt: skip
    spot, sun = SpotLight("spot", (1, -2, 4), (20, 20, 20)), SunLight("sun", (0, 0, 1), (1, 1, 1))
    lights: list[Light] = [replace(spot, **values) for values in wrong]
    lights += [replace(sun, angle=angle) for angle in (np.nan, -0.1)]
    return Measured(sum(not is_refused(replace(lit(build.box()), lights=(light,))) for light in lights))


@THEME.case(
    22,
    "indices-out-of-range",
    "triangles that name vertex 99 of 8, or -1",
    "refused: Embree would read foreign memory",
    0,
    "not refused",
)
def _() -> Measured:
    accepted = 0
    for bad in (99, -1):
        crate = build.box()
        triangles = crate.triangles.copy()
        triangles[3, 1] = bad
        accepted += not is_refused(lit(replace(crate, triangles=triangles)))
    return Measured(accepted)


@THEME.case(
    21,
    "empty-meshes",
    "a mesh without triangles, one without vertices, a scene without anything",
    "the others unchanged",
    0,
    "pixels",
)
def _() -> Measured:
    ball = lit(build.icosphere(1))
    nothing = build.mesh(np.zeros((0, 3)), np.zeros((0, 3)))
    loose = build.mesh([(0, 0, 0)], np.zeros((0, 3)))
    extra = tuple(Instance(f"empty {k}", k, np.eye(4), (0,)) for k in (1, 2))
    more = replace(ball, meshes=(*ball.meshes, nothing, loose), instances=(*ball.instances, *extra))
    wrong = different_pixels(build.shoot(more).radiance, build.shoot(ball).radiance)
    empty = build.shoot(build.make_scene(world=World((0.25, 0.5, 0.75)))).radiance
    return Measured(
        wrong + different_pixels(empty, np.broadcast_to(np.array([0.25, 0.5, 0.75], np.float32), empty.shape))
    )


@THEME.case(21, "tiny-and-huge-triangles", "the same ball of 1e-10 m and of 1e10 m", "the same picture off edges", 1e-5)
def _() -> Measured:
    from .invariance import scaled  # shared helper

    ball = lit(build.icosphere(3))
    one = build.shoot(ball).radiance
    found = [off_edges(build.shoot(scaled(ball, s)).radiance, one) for s in (1e-10, 1e10)]
    return max(found, key=lambda m: m.value)


@THEME.case(
    22,
    "rays-that-are-none",
    "a camera 1e39 m away on an unbounded plane: float32 has no such origin",
    "no ray reaches Embree: all dropped, counted, in the residual",
    0,
    "pixels",
)
def _() -> Measured:
    lens = build.camera((0, 0, 1e39), (0, 0, 0), size=(16, 16))
    scene = replace(lit(build.icosphere(2)), camera=lens, planes=(Plane("ground", (0, 0, -1), (0, 0, 1), 0),))
    film = build.shoot(scene, allow=("dropped_rays",))
    missing = abs(film.invariants["dropped_rays"] - 256)
    return Measured(int(np.count_nonzero(film.residual != 1)) + missing, f"{film.rays['dropped']} of 256 counted")
