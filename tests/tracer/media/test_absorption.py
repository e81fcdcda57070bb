# SPDX-License-Identifier: GPL-3.0-or-later
"""Beer-Lambert: what goes d metres through a solid keeps exp(-absorption d) of itself."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hybrid_addon.scene import PointLight, Settings, Sphere, SunLight, Surface, World
from hybrid_addon.tracer import CompiledScene, trace
from hybrid_addon.tracer.integrator.explain import explain

SIGMA = (0.1, 0.5, 2.0)
WHITE = World((1, 1, 1))


def smoke(sigma=SIGMA, **other):
    """Neither bends nor reflects: only what is in it shows."""
    return Surface("smoke", opacity=0.0, ior=1.0, absorption=sigma, **other)


@pytest.fixture
def look(build):
    """A picture, seen along -Z without perspective, 4 m wide."""

    def radiance(*parts, settings=None, size=(16, 16), **other):
        camera = build.camera((0, 0, 5), size=size, projection="ORTHO", view_plane=(-2, 2, -2, 2))
        values = {"camera": camera, "world": WHITE, **other}
        settings = settings or Settings(1, 64, camera_sees="ALL")
        return trace(build.scene(*parts, **values), settings)

    return radiance


def middle(film):
    return film.radiance[8, 8]


def test_smoke_in_a_box(build, look):
    film = look((build.box(), smoke()))
    np.testing.assert_allclose(middle(film), np.exp(-2 * np.array(SIGMA)), rtol=1e-5)
    assert film.radiance[0, 0] == pytest.approx(1)
    assert not any(film.invariants.values())


def test_chords_of_a_ball(look):
    ball = Sphere("ball", (0, 0, 0), 1.5, 0, ray_traced=True)
    film = look(spheres=(ball,), surfaces=(smoke(),), size=(32, 32))
    x = (np.arange(32) + 0.5) / 8 - 2
    square = np.maximum(1.5**2 - x[:, None] ** 2 - x**2, 0)
    np.testing.assert_allclose(film.radiance[..., 1], np.exp(-2 * 0.5 * np.sqrt(square)), atol=3e-4)


def test_a_slab_of_tinted_glass_with_all_its_inner_reflections(build, look):
    """T = (1-F)^2 a / (1 - F^2 a^2), R = F + F (1-F)^2 a^2 / (1 - F^2 a^2), a = exp(-sigma d)."""
    film = look((build.box(), dataclasses.replace(build.glass(1.5), absorption=SIGMA)))
    f, a = 0.04, np.exp(-2 * np.array(SIGMA))
    through = (1 - f) ** 2 * a / (1 - f * f * a * a)
    back = f + f * (1 - f) ** 2 * a * a / (1 - f * f * a * a)
    np.testing.assert_allclose(middle(film), through + back, rtol=2e-5)


def test_a_bubble_keeps_the_smoke_out(build, look):
    bubble = build.box((-0.4, -0.4, -0.3), (0.4, 0.4, 0.3))
    film = look((build.box(), smoke()), (bubble, smoke((0, 0, 0))))
    np.testing.assert_allclose(middle(film), np.exp(-1.4 * np.array(SIGMA)), rtol=2e-4)
    denser = look((build.box(), smoke()), (bubble, smoke((1, 1, 1))))
    np.testing.assert_allclose(middle(denser), np.exp(-1.4 * np.array(SIGMA) - 0.6), rtol=2e-4)


def test_a_camera_within(build, look):
    camera = build.camera((0, 0, 0.5), size=(16, 16), half=1e-3, clip_start=1e-6)
    film = look((build.box(), smoke()), camera=camera)
    np.testing.assert_allclose(middle(film), np.exp(-1.5 * np.array(SIGMA)), rtol=1e-4)


def floor(build, z=-1.5):
    return build.quad([(-9, -9, z), (9, -9, z), (9, 9, z), (-9, 9, z)])


SUN = SunLight("sun", (0.0, 0.6, 0.8), (3.0, 3.0, 3.0))


def test_shadow_rays_are_absorbed_too(build, look):
    """The camera looks through the same box: from floor to eye 2 m, from sun to floor 2 m / cos."""
    plain = middle(look((floor(build), build.matte(ambient=0.0)), world=World(), lights=(SUN,)))
    wide = build.box((-5, -5, -1), (5, 5, 1))
    film = look((floor(build), build.matte(ambient=0.0)), (wide, smoke()), world=World(), lights=(SUN,))
    np.testing.assert_allclose(middle(film), plain * np.exp(-(2 + 2 / 0.8) * np.array(SIGMA)), rtol=1e-4)
    bubble = build.box((-4, -4, -0.5), (4, 4, 0.5))
    film = look(
        (floor(build), build.matte(ambient=0.0)),
        (wide, smoke()),
        (bubble, smoke((0, 0, 0))),
        world=World(),
        lights=(SUN,),
    )
    np.testing.assert_allclose(middle(film), plain * np.exp(-(1 + 1 / 0.8) * np.array(SIGMA)), rtol=1e-3)  # it swells


def test_a_floor_within_smoke_is_lit_through_what_lies_above_it(build, look):
    plain = middle(look((floor(build, 0.0), build.matte(ambient=0.0)), world=World(), lights=(SUN,)))
    wide = build.box((-5, -5, -1), (5, 5, 1))
    film = look((floor(build, 0.0), build.matte(ambient=0.0)), (wide, smoke()), world=World(), lights=(SUN,))
    np.testing.assert_allclose(middle(film), plain * np.exp(-(1 + 1 / 0.8) * np.array(SIGMA)), rtol=1e-4)


def test_a_lamp_within_smoke(build, look):
    """1 m from the lamp to the floor, 1.5 m from there to the top of the smoke."""
    lamp = PointLight("lamp", (0, 0, 0.5), (5, 5, 5))
    ground = floor(build, -0.5), build.matte(ambient=0.0)
    plain = look(ground, world=World(), lights=(lamp,), size=(65, 65)).radiance[32, 32]
    film = look(ground, (build.box(), smoke()), world=World(), lights=(lamp,), size=(65, 65))
    np.testing.assert_allclose(film.radiance[32, 32], plain * np.exp(-2.5 * np.array(SIGMA)), rtol=1e-4)


def test_open_surfaces_have_no_inside_and_the_report_says_so(build, look):
    sheet = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    film = look((sheet, smoke()))
    assert (film.radiance == 1).all()
    assert any(entry["why"] == "only closed bodies have an inside" for entry in film.skipped)


def test_without_absorption_nothing_is_tracked(build):
    scene = build.scene((build.box(), build.glass()), lights=(SUN,))
    media = CompiledScene(scene, Settings()).media
    assert media.absorption is None and media.shadow_absorption is None


def test_threads_and_chunks_change_no_bit(build, look):
    parts = (build.icosphere(2), dataclasses.replace(build.glass(), absorption=SIGMA, opacity=0.2)), (
        floor(build), build.matte(),
    )  # fmt: skip
    films = [
        look(*parts, lights=(SUN,), settings=Settings(4, 8, camera_sees="ALL", threads=threads, chunk=chunk))
        for threads, chunk in ((1, 1 << 16), (3, 61), (2, 7))
    ]
    assert all((film.radiance == films[0].radiance).all() for film in films)


def test_the_parts_of_a_pixel_add_up_to_it(build):
    scene = build.scene(
        (build.icosphere(2), dataclasses.replace(build.glass(), absorption=SIGMA, opacity=0.3)),
        world=WHITE,
        lights=(SUN,),
    )
    settings = Settings(1, 6)

    def total(node):
        return np.sum([node.adds, *(total(child) for child in node.children)], axis=0)

    film = trace(scene, settings)
    np.testing.assert_allclose(total(explain(CompiledScene(scene, settings), 8, 8)), film.radiance[8, 8], rtol=1e-5)


def test_it_must_not_be_negative(build):
    with pytest.raises(ValueError, match="absorption must not be negative"):
        trace(build.scene((build.box(), smoke((0, -1, 0)))))
