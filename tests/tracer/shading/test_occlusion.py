# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient occlusion, against closed forms: what share of the sky a point sees, weighted by its cosine."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Plane, Scene, Settings, Sphere, SunLight, World
from hybrid_addon.tracer import trace

SETTINGS = Settings(samples=4, camera_sees="RAY_TRACED", threads=1, max_depth=0, occlusion_samples=16)
WORLD = World((1, 1, 1))
FLOOR = Plane("floor", (0, 0, 0), (0, 0, 1), 0, True)


def from_above(build, *things, at=(0, 0), size=(16, 16), **other):
    """A small piece of a white floor around a place, seen straight from above, with things that only hide."""
    camera = build.camera(eye=(*at, 5), target=(*at, 0), size=size, half=1e-4)
    planes, spheres = [FLOOR], []
    for thing in things:
        (planes if isinstance(thing, Plane) else spheres).append(thing)
    values = {"surfaces": (build.matte((1, 1, 1)),), "world": WORLD, **other}
    return Scene(camera=camera, planes=tuple(planes), spheres=tuple(spheres), **values)


def seen(scene, **other):
    """Mean radiance: the share of the sky that is open."""
    film = trace(scene, replace(SETTINGS, **other))
    assert not any(film.invariants.values())
    return film.radiance[..., 0].mean()


def test_an_open_floor_sees_all_of_the_sky(build):
    film = trace(from_above(build), SETTINGS)
    np.testing.assert_array_equal(film.radiance, 1)
    assert film.rays["occlusion"] == 16 * 16 * 4 * 16


def test_beside_an_endless_wall_half_of_the_sky_is_left(build):
    wall = Plane("wall", (0, 0, 0), (1, 0, 0), 0)
    assert seen(from_above(build, wall, at=(0.01, 0))) == pytest.approx(0.5, abs=0.005)


@pytest.mark.parametrize(("height", "radius"), [(2.0, 1.0), (1.5, 1.2)])
def test_a_ball_overhead_hides_its_form_factor(build, height, radius):
    """A ball over a point, its whole disk above the horizon: (r / h)^2 (Lambert)."""
    ball = Sphere("ball", (0, 0, height), radius, 0)
    unseen = replace(ball, visibility=replace(ball.visibility, camera=False))
    assert seen(from_above(build, unseen)) == pytest.approx(1 - (radius / height) ** 2, abs=0.005)


def test_what_is_further_than_the_distance_hides_nothing(build):
    ball = Sphere("ball", (0, 0, 2), 1.0, 0)
    scene = from_above(build, replace(ball, visibility=replace(ball.visibility, camera=False)))
    assert seen(scene, occlusion_distance=0.9) == 1
    assert seen(scene, occlusion_distance=1.1) < 0.97
    assert seen(scene, occlusion_distance=9.0) == pytest.approx(0.75, abs=0.005)


def test_a_closed_box_is_dark(build):
    """Exactly: no ray gets out, not in the corners either."""
    camera = build.camera(eye=(0, 0, 0.8), size=(24, 24), half=1.5)
    scene = build.scene((build.box(), build.matte()), camera=camera, world=WORLD)
    np.testing.assert_array_equal(trace(scene, SETTINGS).radiance, 0)
    assert trace(scene, replace(SETTINGS, occlusion_samples=0)).radiance.min() == pytest.approx(0.8)


def test_smooth_coarse_balls_do_not_hide_the_sky_from_themselves(build):
    scene = build.scene((build.icosphere(1, smooth=True), build.matte((1, 1, 1))), world=WORLD)
    film = trace(scene, SETTINGS)
    np.testing.assert_array_equal(film.radiance[film.coverage == 1], 1)


def test_glass_hides_nothing(build):
    ball = Sphere("ball", (0, 0, 2), 1.0, 1)
    unseen = replace(ball, visibility=replace(ball.visibility, camera=False))
    scene = from_above(build, unseen, surfaces=(build.matte((1, 1, 1)), build.glass()))
    assert seen(scene) == 1


def test_lights_are_not_dimmed(build):
    wall = Plane("wall", (0, 0, 0), (1, 0, 0), 0)
    sun = SunLight("sun", (0, 0, 1), (1, 1, 1))
    scene = from_above(build, wall, at=(0.01, 0), lights=(sun,), world=World())
    on, off = (trace(scene, replace(SETTINGS, occlusion_samples=n)).radiance for n in (16, 0))
    np.testing.assert_array_equal(on, off)


def test_chunks_and_threads_change_no_bit_and_reflections_are_occluded_too(build):
    floor = build.quad([(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)])
    scene = build.scene(
        (floor, build.mirror(0.5)), (build.box((-1, -1, 0), (1, 1, 1)), build.matte()),
        camera=build.camera(eye=(0, -6, 3)), world=WORLD,
    )  # fmt: skip
    settings = replace(SETTINGS, max_depth=3)
    one, other = trace(scene, settings), trace(scene, replace(settings, threads=3, chunk=200))
    np.testing.assert_array_equal(one.radiance, other.radiance)
    local = trace(scene, replace(settings, max_depth=0))
    assert one.rays["occlusion"] > local.rays["occlusion"]
