# SPDX-License-Identifier: GPL-3.0-or-later
"""Raycast: what rays from expressions hit, against closed forms."""

import numpy as np
import pytest

from hybrid_addon.scene import Expression, Plane, Scene, Settings, Sphere, Surface, Visibility, World
from hybrid_addon.tracer import trace

UP = (0.0, 0.0, 2.0)  # of any length
HIT, SELF, DISTANCE, Z, NORMAL_Z = 0, 1, 2, 5, 8


def seen(build, row, *things, start=None, length=10.0, only_local=False, **ball):
    """What the middle of a floor, 1 m across its camera, finds above it: a ball of 1 m whose lowest point is at 2."""
    position = Expression("attribute", (), "position") if start is None else start
    inputs = position, Expression("held", (UP,)), length
    glow = Expression("channel", (Expression("raycast", inputs, only_local),), row)
    return trace(
        Scene(
            camera=build.camera(eye=(0, 0, 1), half=1e-4, size=(2, 2)),
            surfaces=(Surface(base_color=(0, 0, 0), emission=glow), Surface()),
            planes=(Plane("floor", (0, 0, 0), (0, 0, 1), 0),),
            spheres=(Sphere("ball", (0, 0, 3), 1.0, 1, **ball), *things),
            world=World((0, 0, 0)),
        ),
        Settings(samples=1, camera_sees="ALL", threads=1),
    ).radiance[0, 0, 0]  # fmt: skip


@pytest.mark.parametrize(("row", "value"), [(HIT, 1), (SELF, 0), (DISTANCE, 2), (Z, 2)])
def test_a_ray_finds_the_ball_above(build, row, value):
    assert seen(build, row) == pytest.approx(value, abs=1e-5)


def test_beyond_its_length_there_is_nothing_and_the_distance_is_the_length(build):
    assert seen(build, HIT, length=1.9) == 0
    assert seen(build, DISTANCE, length=1.9) == pytest.approx(1.9)
    assert seen(build, DISTANCE, length=2.1) == pytest.approx(2, abs=1e-5)


def test_what_others_are_not_to_hit_is_passed(build):
    assert seen(build, HIT, visibility=Visibility(raycast=False)) == 0
    assert seen(build, HIT, only_local=True) == 0


def test_the_normal_is_on_the_side_of_the_ray(build):
    """From within the ball upwards: its inside looks down."""
    assert seen(build, DISTANCE, start=(0.0, 0.0, 3.0)) == pytest.approx(1, abs=1e-5)
    below = Sphere("cap", (0, 0, -3), 1.0, 1)
    assert seen(build, NORMAL_Z, below, start=(0.0, 0.0, -3.0)) == 0  # -1, and no surface glows less than 0
    assert seen(build, Z, below, start=(0.0, 0.0, -9.0), length=20.0) == 0  # -4


def test_only_local_looks_through_other_objects(build):
    """A floor below finds itself behind the ball: from 3 m above it, down through the ball's inside."""
    down = Expression("held", ((0.0, 0.0, -1.0),))
    inputs = Expression("held", ((0.0, 0.0, 3.0),)), down, 10.0
    for local, distance in ((False, 1.0), (True, 3.0)):
        glow = Expression("channel", (Expression("raycast", inputs, local),), DISTANCE)
        scene = Scene(
            camera=build.camera(eye=(0, 0, 1), half=1e-4, size=(2, 2)),
            surfaces=(Surface(base_color=(0, 0, 0), emission=glow), Surface()),
            planes=(Plane("floor", (0, 0, 0), (0, 0, 1), 0),), spheres=(Sphere("ball", (0, 0, 3), 1.0, 1),),
            world=World((0, 0, 0)),
        )  # fmt: skip
        film = trace(scene, Settings(samples=1, camera_sees="ALL", threads=1))
        np.testing.assert_allclose(film.radiance, distance, atol=1e-5)
