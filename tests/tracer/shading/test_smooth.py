# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading normals: coarse smooth meshes look like the curved surfaces that they stand for."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import PointLight, Settings, SunLight, Surface, World
from hybrid_addon.tracer import trace

ALL = Settings(samples=16, camera_sees="ALL", transparent=True, threads=2)
SIDEWAYS = {
    "sun": SunLight("sun", (1, 0.3, 0.1), (np.pi,) * 3),
    "point": PointLight("p", (6, 1.8, 0.6), (100, 100, 100)),
}


def ball_scene(build, levels, light, squash=1.0):
    ball = build.icosphere(levels, 1, smooth=True)
    m = np.diag([1, 1, squash, 1.0])
    return build.scene(
        (ball, build.matte((1, 1, 1)), {"matrix": m}),
        lights=(light,),
        camera=build.camera((0.5, -0.4, 5), size=(48, 48), half=0.21),
    )


@pytest.mark.parametrize("light", SIDEWAYS.values(), ids=SIDEWAYS)
@pytest.mark.parametrize("squash", [1.0, 0.5])
@pytest.mark.parametrize("levels", [1, 2, 3])
def test_the_shadow_terminator_follows_a_finer_mesh(build, levels, light, squash):
    def lit(at):
        film = trace(ball_scene(build, at, light, squash), ALL)
        return ((film.radiance[..., 0] > 0.01) * film.coverage).sum() / film.coverage.sum()

    assert lit(levels) == pytest.approx(lit(levels + 2), abs=0.02)


@pytest.mark.parametrize("levels", [1, 2])
def test_no_dark_facets_on_the_lit_side(build, levels):
    # Without the lift, whole facets that face away from the light are black where the normals say they are lit.
    sun = SIDEWAYS["sun"]
    coarse = trace(ball_scene(build, levels, sun), ALL).radiance[..., 0]
    unshadowed = trace(ball_scene(build, levels, replace(sun, cast_shadow=False)), ALL).radiance[..., 0]
    assert (unshadowed > 0.02).sum() > 500
    assert np.count_nonzero((unshadowed > 0.02) & (coarse < 0.9 * unshadowed)) == 0


def test_other_things_still_cast_shadows_on_smooth_meshes(build):
    sun = SunLight("sun", (0, 0, 1), (np.pi,) * 3)
    s = ball_scene(build, 2, sun)
    roof = build.quad([(-3, -3, 1.05), (3, -3, 1.05), (3, 3, 1.05), (-3, 3, 1.05)])
    s = replace(s, meshes=(*s.meshes, roof), surfaces=(*s.surfaces, Surface()))
    s = replace(s, instances=(*s.instances, build.instance(1, 1)))
    s = replace(s, camera=build.camera((0, -3, 0.5), up=(0, 0, 1), size=(32, 32), half=0.3))
    film = trace(s, replace(ALL, samples=1))
    assert film.radiance.max() == 0


@pytest.mark.parametrize("levels", [0, 1, 2, 3])
def test_no_black_speckles_in_a_coarse_smooth_mirror(build, levels):
    # Reflected rays that went into the ball would see its black inside: the world is white.
    ball = (build.icosphere(levels, 1, smooth=True), build.mirror())
    core = (build.icosphere(0, 0.5), build.matte((0, 0, 0)))
    film = trace(build.scene(ball, core, world=World((1, 1, 1))), replace(ALL, max_depth=4, transparent=False))
    np.testing.assert_allclose(film.radiance, 1, atol=1e-6)


@pytest.mark.parametrize("levels", [0, 1, 2])
def test_refracted_rays_go_inside(build, levels):
    # A ray that a smooth normal refracts back outside would miss the glowing core that fills the ball.
    ball = (build.icosphere(levels, 1, smooth=True), build.glass(1.5))
    core = (build.icosphere(levels, 0.999), build.emitter(1, 1, 1))
    film = trace(build.scene(ball, core), replace(ALL, max_depth=6, samples=4))
    on_ball = film.coverage > 0.99
    assert film.invariants["lost_media"] == 0
    assert film.radiance[on_ball].min() > 0
