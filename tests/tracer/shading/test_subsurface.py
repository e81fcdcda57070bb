# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that leaves bodies elsewhere than it fell on them, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Plane, Scene, Settings, SunLight, Surface, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.shading.subsurface import diffusion_length

COLOR = (0.8, 0.4, 0.1)
SETTINGS = Settings(samples=4, threads=1, max_depth=0, rough_samples=4, camera_sees="ALL")
BLACK = World((0, 0, 0))


def seen(scene, **other):
    """Mean radiance, one number for each channel."""
    film = trace(scene, replace(SETTINGS, **other))
    assert not any(film.invariants.values())
    return film.radiance.mean(axis=(0, 1))


def ball(build, surface, world, *lights):
    """The middle of a ball of many faces, of a radius of 1 m, seen from the side of the light."""
    return Scene(
        camera=build.camera(half=0.05, size=(8, 8)), surfaces=(surface,), meshes=(build.icosphere(4),),
        instances=(build.instance(0),), world=world, lights=lights,
    )  # fmt: skip


@pytest.mark.parametrize("radius", [0.05, 40.0])
def test_scattering_keeps_the_light_of_a_white_world(build, radius):
    """Whatever the radius: what is found, and the hit's own share, add up to 1."""
    surface = Surface(base_color=COLOR, scatter=0.7, scatter_radius=(radius, radius / 2, 0.0))
    assert seen(ball(build, surface, World((1, 1, 1)))) == pytest.approx(COLOR, rel=1e-5)


def test_a_closed_translucent_body_is_lit_by_all_that_falls_on_it(build):
    """A ball's inside is lit evenly: by a quarter of a sun, and by all of a world, each coloured on both ways."""
    surface = Surface(base_color=COLOR, translucent=True)
    squared = np.square(COLOR)
    assert seen(ball(build, surface, World((1, 1, 1)))) == pytest.approx(squared, rel=1e-4)
    sun = SunLight("sun", (0, 0, 1), (np.pi,) * 3)
    assert seen(ball(build, surface, BLACK, sun), samples=16) == pytest.approx(squared / 4, rel=0.05)


def test_an_edge_of_a_shadow_is_as_soft_as_the_profile(build):
    """2 d into the light, the share of the profile that does not reach into the shadow: an integral over r."""
    radius, at = 4.0, 2.0
    d = float(diffusion_length(np.full((3, 1), radius, np.float32), np.ones((3, 1), np.float32))[0, 0])
    r = (np.arange(200000) + 0.5) / 200000 * 16 * 3 * d
    share = (np.exp(-r / d) + np.exp(-r / (3 * d))) / (4 * d)
    dark = np.where(r > at * d, np.arccos(np.minimum(at * d / r, 1)) / np.pi, 0)
    expected = 1 - (share * dark).sum() * (r[1] - r[0])
    x = at * d
    floor = Plane("floor", (0, 0, 0), (0, 0, 1), 0)
    screen = build.quad([(-90, -90, 40), (0, -90, 40), (0, 90, 40), (-90, 90, 40)])
    scene = Scene(
        camera=build.camera(eye=(x, 0, 30), target=(x, 0, 0), half=1e-5, size=(16, 16)),
        surfaces=(Surface(base_color=(1, 1, 1), scatter=1.0, scatter_radius=(radius,) * 3), Surface()),
        planes=(floor,), meshes=(screen,), instances=(build.instance(0, 1),), world=BLACK,
        lights=(SunLight("sun", (0, 0, 1), (np.pi,) * 3),),
    )  # fmt: skip
    assert 0.7 < expected < 0.9
    assert seen(scene) == pytest.approx([expected] * 3, abs=0.01)
