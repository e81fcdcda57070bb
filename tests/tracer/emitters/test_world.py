# SPDX-License-Identifier: GPL-3.0-or-later
"""The world by direction: images, expressions, what camera rays see instead, and the sun that is taken out of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon import expressions as ex
from hybrid_addon.scene import Expression, Settings, SunLight, Texture, World, WorldSun
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.emitters.environment import directions
from hybrid_addon.tracer.emitters.world import CompiledWorld, lambert

DIRECTION = Expression("attribute", (), "generated")
SOME = np.random.default_rng(3).normal(size=(3, 200)).astype(np.float32)
SOME /= np.sqrt((SOME * SOME).sum(0))
ROWS = 128


def image(color):
    """An equirectangular image of colours (3, rows, columns)."""
    pixels = np.ones((*color.shape[1:], 4), np.float32)
    pixels[..., :3] = np.moveaxis(color, 0, 2)
    return Texture("sky", pixels, extension="SPHERE")


def patch(half_angle, toward=(0.6, 0.0, 0.8), inside=(50.0, 40.0, 30.0), outside=0.1):
    """(image, directions, solid angles): bright within that angle of a direction."""
    d = directions(ROWS, 2 * ROWS, 0, ROWS)
    bright = np.tensordot(toward, d, 1) > np.cos(np.radians(half_angle))
    share = np.diff(np.sin(np.linspace(-np.pi / 2, np.pi / 2, ROWS + 1))) * np.pi / ROWS
    return image(np.where(bright, np.array(inside)[:, None, None], outside)), d, share[:, None] + 0 * d[0]


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def test_an_expression_of_the_direction_is_exact_at_every_ray():
    world = CompiledWorld(World(ex.apply("add", ex.apply("multiply", DIRECTION, 0.25), 0.5)))
    np.testing.assert_allclose(world.radiance(SOME), SOME / 4 + 0.5, rtol=1e-5)
    # E / pi = mean + 2/3 of a linear part (2 v, and v = 1/3 of its slope).
    np.testing.assert_allclose(world.irradiance_over_pi(SOME), 0.5 + SOME / 6, atol=2e-4)


def test_a_turned_image_is_the_same_as_an_expression_or_an_environment():
    picture, rotation = patch(30)[0], turned(0.7)
    matrix = np.column_stack([rotation, np.zeros(3)])
    expression = Expression("image", (ex.apply("equirect", ex.apply("affine", DIRECTION, data=matrix)),), picture)
    one = CompiledWorld(World((1, 1, 1), picture, rotation))
    other = CompiledWorld(World(expression))
    np.testing.assert_allclose(one.radiance(SOME), other.radiance(SOME), rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(one.irradiance_over_pi(SOME), other.irradiance_over_pi(SOME), rtol=0.01)
    for world in (one, other):
        world.prepare_glossy(0.5, 0.7)
    rough = np.full(SOME.shape[1], 0.6, np.float32)
    np.testing.assert_allclose(one.glossy(SOME, rough), other.glossy(SOME, rough), rtol=0.05, atol=0.05)


def test_a_mirror_ball_shows_what_lies_behind_at_its_rim():
    uv = ex.apply("mirror_ball", (0.0, -1.0, 0.0))
    assert uv[:2] == pytest.approx((0.5, 0.5))  # what is behind the camera is in the middle of the ball
    assert ex.apply("mirror_ball", (1.0, 0.0, 0.0))[:2] == pytest.approx((0.5 + 0.5**0.5 / 2, 0.5))
    assert ex.apply("mirror_ball", (0.0, 0.0, 2.0))[:2] == pytest.approx((0.5, 0.5 + 0.5**0.5 / 2))


@pytest.mark.parametrize("rotation", [np.eye(3), turned(1.1)])
def test_the_sun_is_what_is_over_the_threshold(rotation):
    picture, d, share = patch(10)
    world = CompiledWorld(World((1, 1, 1), picture, rotation, sun=WorldSun(10.0, 0.01)))
    (sun,) = world.suns
    area = share[np.tensordot((0.6, 0, 0.8), d, 1) > np.cos(np.radians(10))].sum()
    np.testing.assert_allclose(sun.irradiance, np.array((50, 40, 30)) * 0.8 * area, rtol=1e-4)
    np.testing.assert_allclose(sun.direction, rotation.T @ (0.6, 0, 0.8), atol=2e-3)
    assert sun.angle == 0.01
    toward = np.array([rotation.T @ (0.6, 0, 0.8)], np.float32).T
    np.testing.assert_allclose(world.radiance(toward)[:, 0], (10, 8, 6), rtol=1e-5)  # of the same hue
    camera = np.ones(1, bool)
    np.testing.assert_allclose(world.seen(toward, camera)[:, 0], (50, 40, 30), rtol=1e-5)


def test_nothing_too_bright_no_sun():
    assert CompiledWorld(World((1, 1, 1), patch(10)[0], sun=WorldSun(60.0))).suns == []
    assert CompiledWorld(World((99, 99, 99), sun=WorldSun(10.0))).suns == []  # it has no direction


@pytest.mark.parametrize(
    ("half_angle", "threshold", "axes", "length"),
    [(5, None, 0.320, 0.324), (20, None, 2.656, 2.688), (40, None, 7.375, 7.312), (20, 10, 4.516, 4.531),
     (40, 10, 17.03, 17.06)],
)  # fmt: skip
def test_diffuse_light_is_what_eevee_draws(half_angle, threshold, axes, length):
    """On a white plane, in the red of EEVEE 4.5 and 5.2, Clamping at its 10."""
    for dering, expected in (("AXES", axes), ("LENGTH", length)):
        sun = WorldSun(float(threshold)) if threshold else None
        world = CompiledWorld(World((1, 1, 1), patch(half_angle)[0], sun=sun, limit=10.0, dering=dering))
        up = np.array([[0], [0], [1]], np.float32)
        direct = sum(s.irradiance[0] * s.direction[2] / np.pi for s in world.suns)
        assert world.irradiance_over_pi(up)[0, 0] + direct == pytest.approx(expected, rel=0.02)


def test_light_that_is_soft_enough_is_left_as_it_is():
    mean, vector = np.ones(3), np.full((3, 3), 0.24)
    m, k = lambert(mean, vector, np.inf, "LENGTH")
    assert np.array_equal(m[:, 0], mean) and np.array_equal(k, 2 * vector)
    _, k = lambert(mean, 2 * vector, np.inf, "AXES")
    assert np.allclose(k, 2 / 3)  # no axis below 0
    _, k = lambert(mean, 2 * vector, np.inf, "LENGTH")
    assert (1 - np.sqrt((k * k).sum(1)) > 0.1).all()  # no direction
    m, k = lambert(mean, vector, 1.0, "LENGTH")
    assert m[0, 0] + 1.5 * np.sqrt((k[0] ** 2).sum()) == pytest.approx(1.0)


@pytest.fixture
def balls(build):
    ball, aside = build.icosphere(3, 1, smooth=True), {"matrix": build.translation(2.5, 0, 0)}
    clear = build.box((-3.5, -1, -1), (-1.5, 1, 1))

    def look(world, lights=()):
        parts = (ball, build.matte()), (ball, build.mirror(), aside), (clear, build.glass(1.0))
        camera = build.camera((0, -12, 0), (0, 0, 0), (0, 0, 1), (90, 30), 0.4)
        scene = build.scene(*parts, world=world, lights=lights, camera=camera)
        return trace(scene, Settings(samples=1, camera_sees="ALL", shadow_samples=0)).radiance

    return look


def test_the_backdrop_is_for_the_camera_and_what_it_sees_straight_through(balls):
    light, backdrop = World((0.2, 0.4, 0.6)), World((9.0, 0.0, 0.0))
    found, plain = balls(replace(light, backdrop=backdrop)), balls(light)
    sees_sky = (found == np.float32((9, 0, 0))).all(-1)
    assert sees_sky.any()
    assert (plain[sees_sky] == np.float32((0.2, 0.4, 0.6))).all()  # through the box of IOR 1, too
    inner = (found < 1).all(-1)
    np.testing.assert_array_equal(found[inner], plain[inner])
    assert inner.sum() > 30
    assert (inner | sees_sky).mean() > 0.9


def test_a_sun_of_the_world_lights_as_a_light_of_the_scene(balls):
    picture = patch(10, (-0.6, -0.6, 0.53))[0]
    world = World((1, 1, 1), picture, sun=WorldSun(10.0))
    (sun,) = CompiledWorld(world).suns
    assert isinstance(sun, SunLight)
    pixels = picture.pixels.copy()
    pixels[..., :3] *= np.minimum(1, 10 / pixels[..., :3].max(-1, keepdims=True))
    same = World((1, 1, 1), replace(picture, pixels=pixels), backdrop=World((1, 1, 1), picture))
    np.testing.assert_allclose(balls(world), balls(same, (sun,)), rtol=2e-3, atol=2e-3)
