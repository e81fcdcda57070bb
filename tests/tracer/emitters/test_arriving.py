# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of light where it arrives: its strength, and what limits it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import AreaLight, Arriving, SunLight, Surface, World
from hybrid_addon.tracer import trace

GREY = World((0.5, 0.5, 0.5))
FLOOR = [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]
ABOVE = [(-9, -9, 9), (-9, 9, 9), (9, 9, 9), (9, -9, 9)]


def colour(scene, one_ray, **arriving):
    """In the middle of the picture, of a camera 5 m above the origin."""
    film = trace(replace(scene, arriving=Arriving(**arriving)), replace(one_ray, max_depth=8))
    return film.radiance[8, 8].tolist()


def test_indirect_light_is_scaled_at_each_surface_and_what_is_seen_straight_is_not(build):
    def seen(surface, *others, **other):
        scene = build.scene((build.quad(FLOOR), surface), *others, world=GREY, **other)
        return colour(scene, build.one_ray, indirect=0.5)[0]

    assert seen(build.mirror()) == pytest.approx(0.25)
    assert seen(build.matte((1, 1, 1))) == pytest.approx(0.25)
    assert seen(build.glass(1.0)) == pytest.approx(0.5), "straight through, and the backdrop"
    assert seen(build.emitter(1, 1, 1)) == pytest.approx(1.0)
    glow = (build.quad(ABOVE), build.emitter(4, 4, 4))
    assert seen(build.mirror(), glow) == pytest.approx(2.0)
    # A slanted mirror sends the view to a second one, and that sends it back.
    slanted = build.quad([(-9, -9, -9), (9, -9, 9), (9, 9, 9), (-9, 9, -9)])
    second = (build.quad([(-8, -9, -9), (-8, -9, 9), (-8, 9, 9), (-8, 9, -9)]), build.mirror())
    scene = build.scene((slanted, build.mirror()), second, world=GREY)
    assert colour(scene, build.one_ray, indirect=0.5)[0] == pytest.approx(0.0625), "three times"


def test_indirect_strength_leaves_lamps_alone(build):
    sun = SunLight("sun", (0, 0, 1), (np.pi, np.pi, np.pi))
    scene = build.scene((build.quad(FLOOR), build.matte((0.5, 0.5, 0.5))), lights=(sun,), world=World())
    assert colour(scene, build.one_ray, indirect=0.0)[0] == pytest.approx(0.5)


def test_the_lights_of_a_surface_together_are_limited_and_keep_their_hue(build):
    suns = tuple(SunLight(f"sun {i}", (0, 0, 1), (np.pi, np.pi, np.pi)) for i in range(2))
    surface = Surface(base_color=(0.8, 0.4, 0.2), emission=(0.1, 0.1, 0.1))
    scene = build.scene((build.quad(FLOOR), surface), lights=suns, world=GREY)
    limited, free = (colour(scene, build.one_ray, direct_limit=limit) for limit in (0.4, 5.0))
    hue = np.array([0.8, 0.4, 0.2])
    rest = 0.5 * hue + 0.1  # of the world and its own
    np.testing.assert_allclose(free, rest + 2 * hue, rtol=1e-5)
    np.testing.assert_allclose(limited, rest + 0.5 * hue, rtol=1e-5)


def test_the_image_of_a_lamp_in_a_mirror_is_direct_light(build):
    lamp = AreaLight("lamp", (0, 0, 9), (0, 0, -1), (2, 0, 0), (0, 2, 0), (4.0, 2.0, 1.0))
    scene = build.scene((build.quad(FLOOR), build.mirror()), lights=(lamp,), world=World())
    scene = replace(scene, camera=build.camera(eye=(1, 0, 5), target=(0, 0, 0)))
    free = np.array(colour(scene, build.one_ray))
    assert free == pytest.approx([4, 2, 1])
    np.testing.assert_allclose(colour(scene, build.one_ray, indirect=0.25), free, rtol=1e-5)
    np.testing.assert_allclose(colour(scene, build.one_ray, indirect=0.25, direct_limit=1.0), free / 4, rtol=1e-5)


def test_what_a_surface_sends_into_a_reflected_ray_is_limited_and_to_the_camera_it_is_not(build):
    glow = (build.quad(ABOVE), Surface(base_color=(0.8, 0.8, 0.8), emission=(50, 25, 5)))
    for surface in (build.mirror(0.6, base_color=(0, 0, 0)), build.glass()):
        scene = build.scene((build.quad(FLOOR), surface), glow, world=World())
        free = np.array(colour(scene, build.one_ray))
        limited = np.array(colour(scene, build.one_ray, indirect_limit=10.0))
        np.testing.assert_allclose(limited, free / 5, rtol=1e-5)
    straight = build.scene((build.quad(FLOOR), glow[1]), world=World())
    assert colour(straight, build.one_ray, indirect_limit=10.0)[0] == pytest.approx(50.0)


def test_the_worlds_limit_is_not_for_what_is_seen_straight(build):
    scene = build.scene((build.quad(FLOOR), build.glass(1.0)), world=World((3.0, 3.0, 3.0), limit=1.0))
    assert colour(scene, build.one_ray)[0] == pytest.approx(3.0)
    assert colour(replace(scene, surfaces=(build.mirror(),)), build.one_ray)[0] == pytest.approx(1.0)
