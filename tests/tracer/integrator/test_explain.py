# SPDX-License-Identifier: GPL-3.0-or-later
"""A pixel's ray tree: its parts add up to the pixel, and say what was met."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.report.pixel import pixel_text
from hybrid_addon.scene import AreaLight, Fog, FogBody, Medium, PointLight, Settings, World
from hybrid_addon.tracer import CompiledScene, trace
from hybrid_addon.tracer.integrator.explain import explain


def total(node):
    return np.sum([node.adds, *(total(child) for child in node.children)], axis=0)


def lost(node):
    return sum(max(child.throughput) if child.cut else lost(child) for child in node.children)


def each(node):
    return [node, *(found for child in node.children for found in each(child))]


@pytest.fixture
def room(build):
    ball = build.icosphere(2, smooth=True)
    floor = build.quad([(-3, -3, -1), (3, -3, -1), (3, 3, -1), (-3, 3, -1)])
    return build.scene(
        (ball, build.glass()),
        (floor, build.matte(reflectivity=0.2), {"ray_traced": False}),
        camera=build.camera((0, -4, 2), up=(0, 0, 1)),
        lights=(PointLight("lamp", (1, -2, 3), (5, 5, 5)),),
        world=World((0.2, 0.3, 0.4)),
    )


@pytest.mark.parametrize("settings", [Settings(1, 6), Settings(1, 6, cutoff=0.02)], ids=["all", "cutoff"])
def test_the_parts_of_a_pixel_add_up_to_it(room, settings):
    film, compiled = trace(room, settings), CompiledScene(room, settings)
    for x, y in ((8, 8), (6, 9), (9, 5)):
        tree = explain(compiled, x, y)
        np.testing.assert_allclose(total(tree), film.radiance[y, x], rtol=1e-5)
        assert lost(tree) == pytest.approx(film.residual[y, x], rel=1e-5, abs=1e-9)
        for node in each(tree):
            np.testing.assert_allclose(np.sum([(0, 0, 0), *node.parts.values()], axis=0), node.adds, rtol=1e-6)


def test_fog_and_what_absorbs_are_part_of_it(build):
    """A lamp that a mirror shows is direct light of the mirror: fog dims it no more than that."""
    wall = build.quad([(-3, -3, -1), (3, -3, -1), (3, 3, -1), (-3, 3, -1)])
    haze = Medium((0.02, 0.05, 0.1), (0.1, 0.1, 0.1), (0.01, 0.0, 0.02))
    body = FogBody("haze", build.box(), np.diag([4.0, 4.0, 2.0, 1.0]), haze)
    scene = build.scene(
        (build.icosphere(2, smooth=True), build.glass(absorption=(0.5, 0.1, 0.1))),
        (wall, build.mirror(0.8)),
        camera=build.camera((0, -4, 2), up=(0, 0, 1)),
        lights=(AreaLight("softbox", (0, 0, 1.8), (0, 0, -1), (1, 0, 0), (0, 1, 0), (3, 2, 1), volume=0.0),),
        world=World((0.2, 0.3, 0.4)),
        fog=Fog(bodies=(body,)),
    )
    settings = Settings(1, 4, camera_sees="ALL", shadow_samples=0)
    film, compiled = trace(scene, settings), CompiledScene(scene, settings)
    for x, y in ((8, 8), (8, 4), (3, 5)):
        tree = explain(compiled, x, y)
        np.testing.assert_allclose(total(tree), film.radiance[y, x], rtol=1e-5)
        assert 0.2 < tree.fog < 0.9
        assert "through fog that leaves" in pixel_text(scene, tree, x, y)


def test_it_says_what_was_met(room):
    settings = Settings(1, 2)
    tree = explain(CompiledScene(room, settings), 8, 8)
    text = pixel_text(room, tree, 8, 8).splitlines()
    assert text[0].startswith("pixel 8, 8: radiance ") and "cut off" in text[0]
    assert "'object 0', surface 'glass', from outside" in text[1]
    assert [child.kind for child in tree.children] == ["reflected", "refracted"]
    assert any("from inside" in line for line in text) and any("not followed" in line for line in text)
    assert sum(max(child.throughput) for child in tree.children) == pytest.approx(1, abs=1e-6)


def test_lamps_on_the_way_are_named_and_add_up(build):
    floor = build.quad([(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)])
    lamp = AreaLight("softbox", (0, 0, 3), (0, 0, -1), (1, 0, 0), (0, 1, 0), (3, 2, 1))
    s = build.scene((floor, build.mirror()), lights=(lamp,), world=World((0.2, 0.3, 0.4)))
    settings = Settings(1, 2)
    tree = explain(CompiledScene(s, settings), 8, 8)
    np.testing.assert_allclose(total(tree), (3.2, 2.3, 1.4), rtol=1e-5)
    assert tree.children[0].lamps == ("softbox",) and tree.lamps == ()
    text = pixel_text(s, tree, 8, 8)
    assert "reflected 100 %, past light 'softbox': it leaves the scene; world 0.2 0.3 0.4, lamps 3 2 1" in text
    assert text.splitlines()[0].endswith("of it world 13 %, lamps 87 %")


def test_what_a_surface_emits_is_told_from_the_light_that_it_gets(build):
    """A floor of albedo 0.5 that glows, under a world of radiance 1: it sends on half of that."""
    floor = build.quad([(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)])
    s = build.scene((floor, build.matte((0.5, 0.5, 0.5), emission=(0.1, 0.2, 0.3))), world=World((1, 1, 1)))
    tree = explain(CompiledScene(s, Settings(1, 2)), 8, 8)
    np.testing.assert_allclose(tree.parts["emission"], (0.1, 0.2, 0.3), rtol=1e-5)
    np.testing.assert_allclose(tree.parts["light"], (0.5, 0.5, 0.5), rtol=1e-5)
    assert "; light 0.5 0.5 0.5, emission 0.1 0.2 0.3" in pixel_text(s, tree, 8, 8)


@pytest.mark.parametrize("projection", ["PERSP", "ORTHO"])
def test_distances_are_from_the_camera(build, projection):
    """Rays begin near what they meet, not in the camera: 96 m away, and the wall still is."""
    wall = build.quad([(-9, 0, -9), (9, 0, -9), (9, 0, 9), (-9, 0, 9)])
    camera = replace(build.camera((0, -96, 0), up=(0, 0, 1)), projection=projection)
    tree = explain(CompiledScene(build.scene((wall, build.matte()), camera=camera), Settings(1, 2)), 8, 8)
    x, z = camera.view_plane[1] / 16, camera.view_plane[3] / 16
    assert tree.distance == pytest.approx(96 * (1 + x * x + z * z) ** 0.5 if projection == "PERSP" else 96, rel=1e-5)


def test_pixels_of_what_eevee_draws_are_named_so(room):
    tree = explain(CompiledScene(room, Settings(1, 4)), 0, 0)
    assert not tree.counts and "EEVEE draws it" in pixel_text(room, tree, 0, 0)
