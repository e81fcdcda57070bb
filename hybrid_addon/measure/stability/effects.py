# SPDX-License-Identifier: GPL-3.0-or-later
"""One scene with what the plain ones lack: lens, layers, bump, absorption, lights with a size, and a raster beside it.

Its picture is the hybrid one: masked, adaptive, with traced shadows, photons and raster-backed hits.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from ...scene import (
    BLACK,
    RGB,
    AreaLight,
    Expression,
    Film,
    Float64,
    Lens,
    PointLight,
    Raster,
    Scene,
    Settings,
    SpotLight,
    SunLight,
    Surface,
    Texture,
    World,
    WorldSun,
)
from ...tracer import trace
from . import build, film, invariance, lighting, transforms
from .case import Measured
from .compare import films_differ, largest

THEME = invariance.THEME
HYBRID: dict[str, Any] = {
    "camera_sees": "RAY_TRACED", "samples": 8, "max_depth": 3, "adaptive": 0.5, "shadow_samples": 1, "cutoff": 1 / 255,
    "raster_shadows": True, "caustics": "PHOTONS", "photons": 1 << 13, "rough_samples": 2,
    "occlusion_samples": 2,
    "passes": frozenset({"raster_backed", "samples"}),
}  # fmt: skip
SIZE = (36, 27)
ALL = "lens, layers, rough metal, occlusion, bump, absorption, linked soft lights, shadows, photons, backed hits"


def image(seed: int, height: int, width: int) -> Texture:
    """Random texels."""
    return Texture(f"image {seed}", np.random.default_rng(seed).random((height, width, 4)).astype(np.float32))


def lamps() -> tuple[PointLight | SpotLight | SunLight | AreaLight, ...]:
    """One of each kind, all with a size."""
    return (
        PointLight("ball", (1, -1, 2), (2, 2, 2), radius=0.125, soft_falloff=False),
        SpotLight(
            "spot", (-2, -1, 3), (5, 4, 3), range=8.0, radius=0.25, receivers=frozenset({0, 1}), blockers=frozenset({1})
        ),
        SunLight("sun", (0.5, 0.25, 1), (0.5, 0.5, 0.5), angle=0.125),
        AreaLight("area", (0, 1, 3), (0, 0, -1), (0.5, 0, 0), (0, 0.25, 0), (2, 1, 1), "ELLIPSE", range=16.0),
    )


@cache
def effects(unit: float = 1.0) -> Scene:
    """The scene, on a grid; `unit`: how many metres the height of its bump map is given in."""
    ball = build.icosphere(2, 0.5, smooth=True)
    grid = invariance.GRID
    ball = replace(ball, vertices=(np.round(ball.vertices * grid) / grid).astype(np.float32))
    cloth = Expression("image", (), image(1, 8, 8))
    slope = Expression("slope", (Expression("channel", (cloth,), 0),))
    bumpy = Expression("bump", (slope, 1.0, unit / 8, Expression("attribute", (), "normal")))
    plastic = Surface("plastic", cloth, roughness=0.125, specular=(0.04,) * 3, layered=True, normal=bumpy)
    metal = Surface("metal", BLACK, reflectivity=0.5, edge_tint=(0.9, 0.9, 0.9), roughness=0.3, layered=True)
    uvs = {"": np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)}
    scene = build.make_scene(
        (build.floor(3.0), build.matte((0.5, 0.6, 0.7)), {"ray_traced": False}),
        (ball, build.glass(1.5, absorption=(0.5, 1, 2)), {"matrix_world": build.translation(0.5, -0.5, 0.625)}),
        (
            build.floor(0.75, uv_maps=uvs),
            replace(plastic, coat=0.5, sheen=0.25),
            {"matrix_world": build.translation(-1, 0, 0.5)},
        ),
        (build.quad([(1, 1, 0.5), (2, 1, 0.5), (2, 1, 1.5), (1, 1, 1.5)]), metal, {"moves": True}),
        camera=build.camera((0.5, -4, 2), (0, 0, 0.5), (0, 0, 1), SIZE, 0.5),
        lights=lamps(),
        world=World((0.5, 0.5, 0.5), image(2, 8, 16), sun=WorldSun(0.45, 0.25)),
    )
    return drawn(scene)


def drawn(scene: Scene) -> Scene:
    """The scene, and a raster of all that is not ray traced."""
    found = trace(scene, Settings(samples=1, camera_sees="RASTER", threads=1, passes=frozenset({"depth"})))
    depth = found.passes["depth"]
    pixels = np.concatenate([found.radiance, np.ones((*depth.shape, 1), np.float32)], axis=2)
    return replace(scene, raster=Raster(pixels, depth, np.full((*depth.shape, 3), 0.5, np.float32)))


def out_of_focus(scene: Scene) -> Scene:
    """Through a lens; the raster is blurred then, and backs nothing."""
    return replace(scene, raster=None, camera=replace(scene.camera, lens=Lens(0.0625, 4.0, blades=5)))


def scaled(s: float, lens: bool) -> Scene:
    """The scene s times as large, and all that is a length in it."""
    scene = invariance.scaled(effects(s), s)
    if lens:
        scene = out_of_focus(scene)
        assert scene.camera.lens is not None
        opening = replace(scene.camera.lens, radius=s * 0.0625, focus_distance=s * 4)
        scene = replace(scene, camera=replace(scene.camera, lens=opening))
    elif scene.raster is not None:
        depth = effects().raster.depth  # type: ignore[union-attr]
        scene = replace(scene, raster=replace(scene.raster, depth=np.where(depth < 1e9, depth * np.float32(s), depth)))
    thinner = (replace(one, absorption=thinned(one.absorption, s)) for one in scene.surfaces)
    return replace(scene, surfaces=tuple(thinner))


def thinned(absorption: RGB, s: float) -> RGB:
    """Of a medium s times as large."""
    return absorption[0] / s, absorption[1] / s, absorption[2] / s


@cache
def reference(lens: bool) -> Film:
    """What must come out of every changed scene again."""
    return build.shoot(out_of_focus(effects()) if lens else effects(), **HYBRID)


def differ(a: Film, b: Film) -> float:
    """The largest |difference| of all that a film has, shadows, caustics and passes too."""
    assert a.shadow is not None and a.caustic is not None and b.shadow is not None and b.caustic is not None
    both = [(a.shadow, b.shadow), (a.caustic, b.caustic), *((a.passes[n], b.passes[n]) for n in a.passes)]
    return max(films_differ(a, b), *(largest(x, y) for x, y in both))


def worth_it(found: float) -> Measured:
    """The number, if the scene has all that it is to have."""
    sharp, blurred = reference(False), reference(True)
    assert sharp.caustic is not None and sharp.shadow is not None
    there = (
        sharp.hits["backed"] > 50, blurred.hits["backed"] == 0, float(np.max(sharp.caustic)) > 0.1,
        float(np.min(sharp.shadow)) < 0.7, np.unique(sharp.passes["samples"]).size > 1,
        np.any(sharp.radiance != blurred.radiance),
    )  # fmt: skip
    return Measured(found if all(there) else np.nan, f"{sharp.hits['backed']} hits backed", sharp.radiance)


@THEME.case(
    1, "scale-with-every-effect", f"{ALL}: all 2^k times as large, k = -13, 23", "the same picture, bit by bit", 0
)
def _() -> Measured:
    found = [
        differ(build.shoot(scaled(2.0**k, lens), **HYBRID), reference(lens))
        for k in (-13, 23)
        for lens in (False, True)
    ]
    return worth_it(max(found))


@THEME.case(2, "move-with-every-effect", f"{ALL}: all moved by (1e3, 1e6, -1e6) m", "the same picture", 1e-6)
def _() -> Measured:
    away = build.translation(1e3, 1e6, -1e6)
    found = [
        differ(build.shoot(invariance.rigidly(scene, away), **HYBRID), reference(lens))
        for lens, scene in ((False, effects()), (True, out_of_focus(effects())))
    ]
    return worth_it(max(found))


@film.THEME.case(
    37,
    "threads-with-every-effect",
    f"{ALL}: 1, 2, 3 threads, chunks of 999, 100 rays",
    "the same picture, bit by bit",
    0,
)
def _() -> Measured:
    found = [
        differ(build.shoot(scene, threads=threads, chunk=chunk, **HYBRID), reference(lens))
        for lens, scene in ((False, effects()), (True, out_of_focus(effects())))
        for threads, chunk in ((1, 1 << 16), (2, 999), (3, 100))
    ]
    return worth_it(max(found))


@lighting.THEME.case(
    28,
    "negative-lamps-focus-darkness",
    "photons of lamps of negative strength, and of two that all but cancel",
    "minus the caustic, bit by bit; no more photons than were asked for",
    0,
    "W/m^2",
)
def _() -> Measured:
    def focused(*strengths: float) -> Film:
        lights = tuple(
            PointLight(f"lamp {number}", (1, -1 + number / 64, 4), (e, e, e), radius=0.125)
            for number, e in enumerate(strengths)
        )
        return build.shoot(replace(effects(), raster=None, lights=lights), allow=("negative_radiance",), **HYBRID)

    light, dark, both = focused(16.0), focused(-16.0), focused(16.0, -15.99)
    assert light.caustic is not None and dark.caustic is not None
    wrong = largest(dark.caustic, -light.caustic)
    few = both.rays["reflected"] < 2 * light.rays["reflected"]
    return Measured(wrong if few and np.any(light.caustic) else np.nan, "", light.caustic)


@film.THEME.case(
    32,
    "smallest-pictures",
    f"{ALL}: pictures of 1 x 1, 1 x 7, 7 x 1 and 3 x 5 pixels",
    "finite; chunks of one pixel the same bit by bit",
    0,
)
def _() -> Measured:
    found = []
    for size in ((1, 1), (1, 7), (7, 1), (3, 5)):
        lens = replace(effects().camera, resolution=size, window=(0, 0, *size))
        scene = drawn(replace(effects(), raster=None, camera=lens))
        whole, pieces = (build.shoot(scene, chunk=chunk, **HYBRID) for chunk in (1 << 16, 1))
        found.append(differ(whole, pieces) if np.isfinite(whole.radiance).all() else np.nan)
    return Measured(max(found, key=lambda error: (np.isnan(error), error)))


# ------------------------------------------------------------------------------------------------ instances


def egg(axes: tuple[float, float, float], realised: bool) -> Scene:
    """A smooth egg with a normal map, by a matrix, or with the matrix applied to all that the mesh has."""
    shape = build.icosphere(3, 0.8, True)
    assert shape.normals is not None
    stretch = np.array([1, 0.5, 0.75])
    vertices = (shape.vertices * stretch).astype(np.float32)
    normals = shape.normals / stretch
    normals = (normals / np.sqrt((normals * normals).sum(1, keepdims=True))).astype(np.float32)
    tangent = np.tile(np.array([1, 0, 0, 1], np.float32), (len(vertices), 1))
    uvs = (vertices[:, :2] / 2 + 0.5).astype(np.float32)
    triangles, matrix = shape.triangles, np.diag([*axes, 1.0])
    if realised:
        m: Float64 = matrix[:3, :3]
        mirrors = np.linalg.det(m) < 0
        vertices, normals = (vertices @ m).astype(np.float32), (normals @ np.linalg.inv(m)).astype(np.float32)
        tangent[:, :3], tangent[:, 3] = tangent[:, :3] @ m, -1 if mirrors else 1
        triangles, matrix = triangles[:, [0, 2, 1]] if mirrors else triangles, np.eye(4)
    body = build.mesh(vertices, triangles, normals=normals, uv_maps={"": uvs}, attributes={"tangent:": tangent})
    cloth = Expression("image", (), image(3, 8, 8))
    mapped = Expression(
        "normal_map", (cloth, 1.0, Expression("attribute", (), "tangent:"), Expression("attribute", (), "normal"))
    )
    paint = Surface("paint", cloth, roughness=0.1, specular=(0.04,) * 3, layered=True, coat=0.5, normal=mapped)
    lens = build.camera((1, -3, 2), (0, 0, 0), (0, 0, 1), (64, 48), 0.4)
    lamp = PointLight("lamp", (2, -3, 5), (30, 30, 30), radius=0.25)
    parts = ((body, paint, {"matrix_world": matrix}), (build.floor(3, -1), build.matte()))
    return build.make_scene(*parts, camera=lens, lights=(lamp,), world=World((0.2, 0.3, 0.4)))


@transforms.THEME.case(
    24,
    "mirrored-normal-map",
    "a smooth coated egg with a normal map, mirrored on one axis and on three, stretched",
    "the realised mesh, bit by bit",
    0,
)
def _() -> Measured:
    found = []
    for axes in ((-1, 1, 1), (-1, -1, -1), (0.5, 1, -2)):
        a, b = (build.shoot(egg(axes, realised), samples=2, max_depth=3).radiance for realised in (False, True))
        found.append(largest(a, b))
    return Measured(max(found), "tangents turn with the mesh, their sign with its handedness", a)
