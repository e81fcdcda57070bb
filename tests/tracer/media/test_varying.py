# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that vary: closed forms along rays, grids and where they lie, and that no ray hangs on its neighbours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon import expressions as ex
from hybrid_addon.scene import Expression, Fog, Medium, Sphere, SunLight, VoxelGrid
from hybrid_addon.tracer.integrator import fog as integrator_fog
from hybrid_addon.tracer.media.varying import sample_voxels
from tests.tracer.media.test_fog import MIRROR, WHITE, box, seen

RAMP = VoxelGrid(np.arange(64, dtype=np.float32).reshape(1, 1, 64, 1), np.eye(3, 4))
HEIGHT = ex.apply("channel", Expression("attribute", (), "position"), data=2)
DENSITY = ex.plus(0.1, ex.times(0.03, ex.plus(2.0, HEIGHT)))  # 1/m, of the box from z = -2 to 2: 0.1 to 0.22
DEPTH = 4 * 0.16  # its integral


def placed(values, **medium):
    """The 4 m box full of a medium with a grid `values` (nx, ny, nz, width) all over it."""
    grid = VoxelGrid(values.astype(np.float32), np.eye(3, 4) + np.array([[0, 0, 0, 0.5]] * 3))
    return replace(box(Medium(**medium)), grids={"density": grid})


def test_a_density_that_grows_along_the_ray_dims_by_its_integral():
    """Steps that are taken in their middles integrate a line exactly, however few they are."""
    for steps in (1, 5, 64):
        found, _ = seen(Fog(bodies=(box(Medium(absorption=DENSITY)),), steps=steps), WHITE)
        np.testing.assert_allclose(found, np.exp(-DEPTH), rtol=1e-4)


def test_a_glow_that_varies_adds_up():
    found, _ = seen(Fog(bodies=(box(Medium(emission=ex.times((0.1, 0.2, 0.0), ex.plus(2.0, HEIGHT)))),)))
    np.testing.assert_allclose(found, (0.8, 1.6, 0), rtol=1e-4)


def test_what_varies_and_what_does_not_add_up_where_they_overlap():
    even = box(Medium(absorption=(0.05, 0.1, 0.0)), (0, 0, 1), (4, 4, 2))
    fog = Fog(Medium(absorption=(0.01,) * 3), (box(Medium(absorption=DENSITY)), even), reach=20)
    found, _ = seen(fog, WHITE)
    np.testing.assert_allclose(found, np.exp(-DEPTH - np.array([0.1, 0.2, 0.0]) - 0.2), rtol=1e-4)


def test_a_world_that_varies_ends_where_it_is_said_to():
    """From z = 10 down to -10: the glow above the floor of z = 0."""
    glow = ex.times(0.01, ex.apply("maximum", HEIGHT, 0.0))
    found, _ = seen(Fog(Medium(emission=ex.as_color(glow)), reach=20, steps=40))
    np.testing.assert_allclose(found, 0.5, rtol=1e-3)


def test_smoke_in_a_grid_dims_by_its_sum_also_where_the_body_is_turned_and_scaled():
    values = np.random.default_rng(1).random((1, 1, 16, 1))
    fog = Fog(bodies=(placed(values, absorption=ex.as_color(Expression("attribute", (), "volume:density"))),))
    even = np.interp(np.arange(640) / 40 - 0.4875, np.arange(16), values.ravel()).mean()
    found, _ = seen(replace(fog, steps=512), WHITE)
    np.testing.assert_allclose(found, np.exp(-4 * even), rtol=2e-3)
    turned = fog.bodies[0].matrix_world @ np.diag([1.0, -1.0, -1.0, 1.0])
    again, _ = seen(replace(fog, bodies=(replace(fog.bodies[0], matrix_world=turned),), steps=512), WHITE)
    np.testing.assert_allclose(again, found, rtol=2e-3)


def test_a_lamp_lights_what_varies():
    """A sun in a slab whose density is a step: 0 below the middle, 0.4 above."""
    values = np.repeat([0.0, 0.4], 64).reshape(1, 1, 128, 1)
    medium = {"scattering": ex.as_color(Expression("attribute", (), "volume:density"))}
    sun = SunLight("sun", direction=(0, 0, 1), irradiance=(10, 10, 10), cast_shadow=False)
    found, _ = seen(Fog(bodies=(placed(values, **medium),), steps=128), lights=(sun,), samples=256)
    np.testing.assert_allclose(found, 10 / (4 * np.pi) * (1 - np.exp(-0.8)), rtol=0.02)


def test_fog_that_varies_dims_lamps_within_it_where_it_is_asked_to():
    sun = SunLight("sun", direction=(0, 0, 1), irradiance=(10, 10, 10))
    fog = Fog(bodies=(box(Medium(scattering=DENSITY)),), shadows=True)
    found, _ = seen(fog, lights=(sun,), samples=64)
    np.testing.assert_allclose(found, 10 / (4 * np.pi) * (1 - np.exp(-2 * DEPTH)) / 2, rtol=0.02)


def test_a_mirror_shows_it_twice():
    ball = Sphere("ball", (0, 0, 0), 1.0, 0, ray_traced=True)
    found, _ = seen(Fog(bodies=(box(Medium(absorption=DENSITY)),)), WHITE, spheres=(ball,), surfaces=(MIRROR,))
    np.testing.assert_allclose(found, np.exp(-2 * (0.1 + 0.03 * 3.5)), rtol=1e-3)


def test_rays_do_not_hang_on_what_else_is_worked_on(monkeypatch):
    fog = Fog(
        Medium(absorption=(0.01,) * 3), (box(Medium(scattering=DENSITY)), box(Medium(emission=DENSITY), (0, 0, 1)))
    )
    sun = SunLight("sun", direction=(0, 0, 1), irradiance=(10, 10, 10))
    whole, _ = seen(fog, WHITE, (sun,), samples=4)
    monkeypatch.setattr(integrator_fog, "TOGETHER", 1000)
    np.testing.assert_array_equal(seen(fog, WHITE, (sun,), samples=4)[0], whole)


@pytest.mark.parametrize("worst", [np.nan, np.inf, -1.0, 1e38])
def test_no_voxel_makes_a_pixel_that_is_no_number(worst):
    values = np.full((4, 4, 4, 1), worst)
    medium = {name: ex.as_color(Expression("attribute", (), "volume:density")) for name in ("absorption", "scattering")}
    sun = SunLight("sun", direction=(0, 0, 1), irradiance=(1, 1, 1))
    found, _ = seen(Fog(bodies=(placed(values, **medium),), shadows=True), WHITE, (sun,))
    assert np.isfinite(found).all() and (found >= 0).all() and (found <= 1.1).all()


def test_a_grid_is_linear_between_its_voxels_and_constant_beyond():
    at = np.array([[0.5] * 5, [0.5] * 5, [-1.0, 0.5 / 64, 10 / 64, 10.5 / 64, 2.0]])
    np.testing.assert_allclose(sample_voxels(RAMP, at)[0], [0, 0, 9.5, 10, 63])


@pytest.mark.parametrize(("values", "steps", "told"), [(np.zeros((2, 2, 2)), 64, "grid 'density'"), (None, 0, "steps")])
def test_bad_grids_and_steps_are_refused_in_one_line(values, steps, told):
    body = box(Medium(absorption=(0.1,) * 3))
    body = body if values is None else replace(body, grids={"density": VoxelGrid(values, np.eye(3, 4))})
    with pytest.raises(ValueError, match=told):
        seen(Fog(bodies=(body,), steps=steps))
