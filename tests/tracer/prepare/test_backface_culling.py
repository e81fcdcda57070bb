# SPDX-License-Identifier: GPL-3.0-or-later
"""Backface culling: what turns its back is not there, for rays and for light, but for solids: rays must leave them."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Plane, PointLight, Settings, Sphere, SunLight, Surface, Visibility, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.geometry.shapes import onto_sphere

MANY = Settings(samples=4, camera_sees="ALL", threads=1, max_depth=8)
NO_SHADOW = Visibility(shadow=False)
CULLED = Surface(base_color=(1, 0, 0), culled=True)
SUN = SunLight("sun", (0.3, 0.2, 1), (3, 3, 3))
OVERHEAD = SunLight("sun", (0, 0, 1), (np.pi,) * 3)


def sheet(build, z, size=2.0, up=True):
    """A square at height z."""
    corners = [(-size, -size, z), (size, -size, z), (size, size, z), (-size, size, z)]
    return build.quad(corners if up else corners[::-1])


def world_of(build):
    """What lies behind: a floor, a smooth ball, a box."""
    return [
        (sheet(build, -1, 3), build.matte((0.2, 0.5, 0.8))),
        (build.icosphere(3, 0.6, True), build.matte((0.9, 0.6, 0.3))),
        (build.box((0.7, -1, -1), (1.4, 1, 0)), build.matte((0.5, 0.9, 0.1))),
    ]


def picture(build, *parts, settings=MANY, **other):
    values = {"lights": (SUN,), "world": World((0.3, 0.3, 0.3)), "camera": build.camera(size=(24, 24)), **other}
    film = trace(build.scene(*world_of(build), *parts, **values), settings)
    assert not any(film.invariants.values())
    return film


def raised(z):
    matrix = np.eye(4)
    matrix[2, 3] = z
    return matrix


def unseen_by_lights(shape, surface=CULLED, **other):
    return shape, surface, {"visibility": NO_SHADOW, **other}


@pytest.mark.parametrize("kind", ["sheet", "pile", "mirrored", "around the camera", "plane", "sphere"])
def test_seen_from_behind_it_is_as_if_it_were_not_there(build, kind):
    """Rays go on in their directions, at no price."""
    parts, other = [], {}
    if kind == "sheet":
        parts = [unseen_by_lights(sheet(build, 2, up=False))]
    elif kind == "pile":
        parts = [unseen_by_lights(sheet(build, 1 + 0.1 * i, up=False)) for i in range(40)]
    elif kind == "mirrored":
        parts = [unseen_by_lights(sheet(build, -2), matrix=np.diag([1.0, 1, -1, 1]))]
    elif kind == "around the camera":
        parts = [unseen_by_lights(build.icosphere(2, 0.5), matrix=raised(5))]
    elif kind == "plane":
        other["planes"] = (Plane("plane", (0, 0, 2), (0, 0, -1), 3, visibility=NO_SHADOW),)
    else:
        other["spheres"] = (Sphere("ball", (0, 0, 5), 1.0, 3, visibility=NO_SHADOW),)
    surfaces = [surface for _, surface in world_of(build)]
    other["surfaces"] = (*surfaces, CULLED)
    got, bare = picture(build, *parts, **other), picture(build, surfaces=other["surfaces"])
    np.testing.assert_allclose(got.radiance, bare.radiance, atol=2e-6)
    assert got.rays["camera"] == bare.rays["camera"]
    solid = tuple(replace(s, culled=False) for s in other["surfaces"])
    parts = [(shape, replace(surface, culled=False), *rest) for shape, surface, *rest in parts]
    there = picture(build, *parts, **{**other, "surfaces": solid})
    assert np.abs(there.radiance - bare.radiance).max() > 0.1


def test_seen_from_the_front_it_is_there(build):
    culled, plain = (
        picture(build, unseen_by_lights(sheet(build, 2), s)) for s in (CULLED, replace(CULLED, culled=False))
    )
    np.testing.assert_array_equal(culled.radiance, plain.radiance)


def test_analytic_balls_behind_it_keep_their_exact_distance(build):
    balls = (Sphere("ball", (0.2, 0.1, 0), 1.0, 0),)
    s = build.scene(surfaces=(build.matte(), CULLED), spheres=balls, lights=(SUN,))
    front = sheet(build, 2, up=False)
    both = replace(s, meshes=(front,), instances=(build.instance(0, 1, visibility=NO_SHADOW),))
    np.testing.assert_allclose(trace(both, MANY).radiance, trace(s, MANY).radiance, atol=2e-6)
    center, radius = np.zeros((3, 1)), np.ones(1)
    origin, direction = np.float32([[0.3], [0], [5]]), np.float32([[0], [0], [-1]])
    t = onto_sphere(center, radius, origin, direction, np.array([5 - np.sqrt(1 - 0.09) + 1e-5]))
    assert t[0] == pytest.approx(5 - np.sqrt(1 - float(origin[0, 0]) ** 2), abs=1e-9)


@pytest.mark.parametrize("between", ["mirror", "glass"])
def test_rays_of_mirrors_and_glass_pass_its_back(build, between):
    """A white world above, seen by a mirror or through glass past the back of a sheet."""
    shape = sheet(build, 0) if between == "mirror" else build.box((-2, -2, -0.5), (2, 2, 0))
    surface = build.mirror() if between == "mirror" else build.glass()
    behind = sheet(build, 1, up=True) if between == "mirror" else sheet(build, -1, up=False)
    eye = build.camera((0, -1, 0.9) if between == "mirror" else (0, -3, 3), (0, 0, 0), up=(0, 0, 1), half=0.05)
    for culled in (True, False):
        black = Surface(base_color=(0, 0, 0), culled=culled)
        s = build.scene((shape, surface), (behind, black), camera=eye, world=World((1, 1, 1)))
        seen = trace(s, replace(MANY, max_depth=12)).radiance
        assert (seen.min() > 0.9) if culled else (seen.max() < 0.5)


@pytest.mark.parametrize("others", ["opaque", "tinted", "solid"])
@pytest.mark.parametrize("light", ["sun", "point"])
def test_a_light_that_sees_its_back_shines_through(build, others, light):
    """Whatever else may be in the way: each kind is asked in its own way."""
    lamp = OVERHEAD if light == "sun" else PointLight("p", (0, 0, 30), (np.pi * 31**2,) * 3, soft_falloff=False)
    roof = Surface(base_color=(0, 0, 0), shadow_culled=True)
    aside = {
        "opaque": build.matte(),
        "tinted": build.glass(1.0, transmission_tint=(0.5, 0.5, 0.5)),
        "solid": build.glass(1.5),
    }
    away = build.box((5, 5, 0), (6, 6, 1))
    floor = sheet(build, 0), build.matte((1, 1, 1))
    eye = build.camera((0, -3, 0.4), (0, 0, 0), up=(0, 0, 1), half=0.02)

    def lit(up, surface=roof):
        parts = [floor, (sheet(build, 1, up=up), surface), (away, aside[others])]
        return trace(build.scene(*parts, camera=eye, lights=(lamp,)), build.one_ray).radiance[8, 8, 0]

    open_ = trace(build.scene(floor, camera=eye, lights=(lamp,)), build.one_ray).radiance[8, 8, 0]
    assert lit(True) == 0
    assert open_ > 0.5
    assert lit(False) == pytest.approx(open_, rel=1e-5)
    assert lit(False, CULLED) == 0  # the camera's switch is not the lights'


@pytest.mark.parametrize(
    "switches", [{"culled": True}, {"shadow_culled": True}, {"culled": True, "shadow_culled": True}]
)
def test_glass_stays_glass(build, switches):
    """Closed bodies that bend light are solids: bit by bit the same, with their shadows, bubbles and absorption."""

    def seen(**given):
        glass = build.glass(1.5, layered=True, **given)
        parts = [
            (build.icosphere(3, 0.8, True), glass),
            (build.icosphere(2, 0.3, True), replace(glass, ior=1.0, absorption=(1.0, 2, 3))),
            (build.box((-1, -1, -1), (-0.5, 1, 0.5)), replace(glass, absorption=(0.5, 1, 2))),
        ]
        return picture(build, *parts).radiance

    np.testing.assert_array_equal(seen(**switches), seen())


def test_a_culled_shell_that_bends_nothing_has_one_side(build):
    """Its front tints, its back does not; with a glass in the scene and within it as without: it is no solid."""
    tint = Surface(opacity=0.0, ior=1.0, transmission_tint=(0.5, 0.5, 0.5), culled=True)
    shell = build.icosphere(3, 2.0)
    for glasses in ([], [(build.icosphere(2, 0.5, True), build.glass())]):
        for culled, expected in ((True, 0.5), (False, 0.25)):
            parts = [(shell, replace(tint, culled=culled)), *glasses]
            film = trace(build.scene(*parts, world=World((1, 1, 1)), camera=build.camera(half=0.05)), MANY)
            assert not any(film.invariants.values())
            np.testing.assert_allclose(film.radiance, expected, rtol=0.02)


def test_the_mask_is_without_its_backs(build):
    """A ray traced sheet seen from behind is left to the raster, and hides no ray traced thing."""
    ball = build.icosphere(3, 0.6, True)
    ray_traced = replace(MANY, camera_sees="RAY_TRACED")
    s = build.scene((ball, build.matte()), (sheet(build, 2, up=False), CULLED))
    bare = build.scene((ball, build.matte()))
    np.testing.assert_array_equal(trace(s, ray_traced).coverage, trace(bare, ray_traced).coverage)
