# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows of ray traced objects on everything else: `Film.shadow`."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import AreaLight, PointLight, Settings, Sphere, SunLight, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.shading.scattering import fresnel_dielectric
from tests.tracer.unpruned import without

SETTINGS = Settings(samples=1, raster_shadows=True, threads=1)
EYE = (0, 0, 20)
LAMP = PointLight("lamp", (6, 0, 6), (100, 100, 100))


@pytest.fixture(scope="module")
def floor(build):
    return (build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]), build.matte(), {"ray_traced": False})


def places():
    """World x, y of the pixel centres of the camera below, on z = 0."""
    steps = ((np.arange(64) + 0.5) / 64 * 2 - 1) * 0.3 * 20
    return np.meshgrid(steps, steps)


def scene_of(build, floor, *parts, lights=(LAMP,), **other):
    camera = build.camera(eye=EYE, size=(64, 64), half=0.3)
    return build.scene(floor, *parts, camera=camera, lights=lights, **other)


def test_a_pane_between_light_and_floor_leaves_its_transmittance(build, floor):
    pane = build.box((1, -1, 3), (3, 1, 3.1))
    shadow = trace(scene_of(build, floor, (pane, build.glass(1.5))), SETTINGS).shadow
    x, y = places()
    way = np.array([6 - x, 0 - y, np.full_like(x, 6)])
    cosine = 6 / np.sqrt((way**2).sum(axis=0))
    at_pane = [np.array([x, y]) + way[:2] * (height / 6) for height in (3, 3.1)]
    inside = np.all([(1 < p[0]) & (p[0] < 3) & (abs(p[1]) < 1) for p in at_pane], axis=0)
    visible = np.abs(x) < 0.9  # straight below the camera the pane is not in the way
    expected = (1 - fresnel_dielectric(cosine, np.full_like(x, 1.5))) ** 2
    chosen = inside & visible
    assert np.count_nonzero(chosen) > 50
    np.testing.assert_allclose(shadow[chosen], np.repeat(expected[chosen, None], 3, axis=1), rtol=1e-5)
    missed = ~np.any([(0.99 < p[0]) & (p[0] < 3.01) & (abs(p[1]) < 1.01) for p in at_pane], axis=0)
    assert (shadow[missed] == 1).all()


@pytest.mark.parametrize("samples", [1, 4])
def test_an_opaque_ball_casts_the_shadow_that_the_tracer_draws(build, floor, samples):
    ball = Sphere("ball", (2, 0, 2), 1, 1, ray_traced=True)
    scene = scene_of(build, floor, spheres=(ball,), surfaces=(floor[1], build.matte()), world=World((0.3, 0.2, 0.1)))
    settings = replace(SETTINGS, samples=samples)
    film = trace(scene, settings)
    ray_traced = replace(scene, instances=tuple(replace(i, ray_traced=True) for i in scene.instances))
    with_ball = trace(ray_traced, replace(settings, raster_shadows=False)).radiance
    hidden = replace(ball, visibility=replace(ball.visibility, shadow=False))
    without = trace(replace(ray_traced, spheres=(hidden,)), replace(settings, raster_shadows=False)).radiance
    seen = film.coverage == 0
    np.testing.assert_allclose(film.shadow[seen], (with_ball / without)[seen], rtol=1e-5)
    darkest = film.shadow[seen].min(axis=0)
    assert (darkest > 0.01).all()  # the light of the world stays
    assert darkest[0] > darkest[1] > darkest[2]
    assert film.shadow.min() < 0.6


def test_what_lies_in_another_shadow_is_not_darkened(build, floor):
    roof = (build.quad([(-9, -9, 5), (9, -9, 5), (9, 9, 5), (-9, 9, 5)]), build.matte((1, 0, 0)), {"ray_traced": False})
    camera = build.camera(eye=(0, -12, 2), target=(0, 0, 1), up=(0, 0, 1), size=(32, 32))
    ball = (build.icosphere(), build.matte(), {"matrix": build.translation(0, 0, 2)})
    sun = SunLight("sun", (0, 0, 1), (1, 1, 1))
    world = World((0.5, 0.5, 0.5))
    film = trace(replace(scene_of(build, floor, roof, ball, lights=(sun,), world=world), camera=camera), SETTINGS)
    assert (film.shadow == 1).all()


@pytest.mark.parametrize(
    "light",
    [
        replace(LAMP, radius=0.8),
        replace(LAMP, radius=0.8, soft_falloff=False),
        SunLight("sun", (0.6, 0, 0.8), (1, 1, 1), angle=0.3),
        AreaLight("area", (5, 0, 5), (-0.7071, 0, -0.7071), (0, 1.5, 0), (0.7, 0, -0.7), (9, 9, 9)),
    ],
)
def test_the_pixels_that_are_looked_at_are_enough(build, floor, light, monkeypatch):
    """Balls around the casters may only leave out pixels on which no shadow lies."""
    parts = [
        (build.icosphere(1, 0.5), build.glass(), {"matrix": build.translation(x, y, 1)})
        for x, y in ((-2, -2), (2, 1), (-1, 2), (0, 0))
    ]
    scene, settings = scene_of(build, floor, *parts, lights=(light,)), replace(SETTINGS, samples=4)
    film = trace(scene, settings)
    monkeypatch.setattr(
        "hybrid_addon.tracer.catcher.shadow_catcher.ball_between", lambda light, point, *ball: point[0] < np.inf
    )
    everything = trace(scene, settings)
    np.testing.assert_array_equal(film.shadow, everything.shadow)
    assert film.rays["camera"] < everything.rays["camera"]
    assert film.shadow.min() < 0.99


def test_threads_and_chunks_change_no_bit(build, floor):
    ball = (build.icosphere(), build.glass(), {"matrix": build.translation(1, 0, 2)})
    scene = scene_of(build, floor, ball, lights=(replace(LAMP, radius=0.5),))
    settings = replace(SETTINGS, samples=4)
    one, other = trace(scene, settings), trace(scene, replace(settings, threads=3, chunk=512))
    np.testing.assert_array_equal(one.shadow, other.shadow)


def test_the_traced_half_is_the_same_with_it(build, floor):
    ball = (build.icosphere(), build.glass(), {"matrix": build.translation(1, 0, 2)})
    scene = scene_of(build, floor, ball)
    settings = replace(SETTINGS, samples=4)
    film, plain = trace(scene, settings), trace(scene, replace(settings, raster_shadows=False))
    assert plain.shadow is None
    np.testing.assert_array_equal(film.radiance, plain.radiance)
    np.testing.assert_array_equal(film.residual, plain.residual)


def test_what_casts_no_shadow_costs_nothing(build, floor):
    ball = (build.icosphere(), build.glass(1.0), {"matrix": build.translation(1, 0, 2)})
    scene = scene_of(build, floor, ball)
    film = trace(scene, SETTINGS)
    assert (film.shadow == 1).all()
    assert film.rays == trace(scene, replace(SETTINGS, raster_shadows=False)).rays
    assert "shadows on the raster" in {row["what"] for row in film.skipped}
    with without("raster-shadows"):
        cache = trace(scene, SETTINGS)
    np.testing.assert_array_equal(film.shadow, cache.shadow)


def test_objects_out_of_sight_cast_shadows_too(build, floor):
    ball = (build.icosphere(), build.matte(), {"matrix": build.translation(8, 0, 8)})
    sun = SunLight("sun", (0.7071, 0, 0.7071), (1, 1, 1))
    scene = scene_of(build, floor, ball, lights=(sun,))
    film = trace(scene, SETTINGS, np.zeros((64, 64), np.float32))
    assert (film.shadow == 0).any()


def test_covered_pixels_are_left_alone(build, floor):
    ball = (build.icosphere(), build.matte(), {"matrix": build.translation(2, 0, 2)})
    mask = np.ones((64, 64), np.float32)
    mask[:, :32] = 0
    shadow = trace(scene_of(build, floor, ball), SETTINGS, mask).shadow
    assert (shadow[:, 32:] == 1).all()
    assert (shadow[:, :32] == 0).any()


def test_a_budget_takes_fewer_samples_but_all_pixels(build, floor):
    ball = (build.icosphere(), build.matte(), {"matrix": build.translation(2, 0, 2)})
    scene = scene_of(build, floor, ball)
    shadow = trace(scene, replace(SETTINGS, samples=64), deadline=0.0).shadow
    assert (shadow == 0).any()


@pytest.mark.parametrize("ior", [1.33, 1.5])
def test_the_simple_caustic_is_the_original_systems(build, floor, ior):
    """Along a ray that meets both faces of a ball at one angle: its formula, twice; in all about the ball's light."""
    ball = Sphere("ball", (0, 0, 6), 1, 1, ray_traced=True)
    sun = SunLight("sun", (0.6, 0, 0.8), (1, 1, 1))
    scene = scene_of(build, floor, spheres=(ball,), surfaces=(floor[1], build.glass(ior)), lights=(sun,))
    film = trace(scene, replace(SETTINGS, caustics="SIMPLE"))
    x, y = places()
    middle, along = np.array([-4.5, 0, 0]), np.array([0.6, 0, 0.8])
    away = np.array([x - middle[0], y, np.zeros_like(x)])
    d2 = (away**2).sum(axis=0) - (away[0] * along[0]) ** 2
    cosine = np.sqrt(np.maximum(1 - d2, 0))
    r = ior - 1
    once = cosine ** (2 ** (9 * r)) * ior * (1 + 4 * r) * (1 - fresnel_dielectric(cosine, np.full_like(x, ior)))
    inside = d2 < 0.95
    np.testing.assert_allclose(film.shadow[inside][:, 0], once[inside] ** 2, rtol=1e-3, atol=1e-4)
    assert np.count_nonzero(inside) > 50
    passed = film.shadow[d2 < 1].mean()
    assert passed == pytest.approx((ior * (1 + 4 * r)) ** 2 / (2 ** (9 * r) + 1), rel=0.15)


@pytest.mark.parametrize("kind", ["a thin surface", "a body that float32 makes flat"])
def test_a_thin_wall_focuses_nothing(build, floor, kind):
    """It bends no light: what gets through both of its faces is (1 - R) / (1 + R), under Simple caustics, too."""
    if kind == "a thin surface":
        pane = (build.quad([(1, -1, 3), (3, -1, 3), (3, 1, 3), (1, 1, 3)]), build.glass(1.5, thin=True))
    else:
        pane = (build.box((1, -1, 3), (3, 1, 3 + 1e-8)), build.glass(1.5))
    plain, simple = (
        trace(scene_of(build, floor, pane), replace(SETTINGS, caustics=c)).shadow for c in ("NONE", "SIMPLE")
    )
    np.testing.assert_array_equal(plain, simple)
    if kind != "a thin surface":
        x, y = places()
        cosine = 6 / np.sqrt((6 - x) ** 2 + y * y + 36)
        r = fresnel_dielectric(cosine, np.full_like(x, 1.5))
        inside = (-3.5 < x) & (x < -0.5) & (np.abs(y) < 1.5)
        np.testing.assert_allclose(simple[inside][:, 0], ((1 - r) / (1 + r))[inside], rtol=1e-4)
