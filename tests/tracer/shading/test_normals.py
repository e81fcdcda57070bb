# SPDX-License-Identifier: GPL-3.0-or-later
"""Mapped normals: normal maps and bumps in closed form, whatever the scale, the side and the angle of view."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon import expressions as ex
from hybrid_addon.scene import Expression, SunLight, Surface, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.shading.scattering import above, reflect, reflecting_normal

SHEAR = np.array([[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


@pytest.mark.parametrize(
    ("matrix", "tilt"),
    [
        (np.eye(4), (1, 0)),
        (np.diag([0.01, 0.01, 0.01, 1]), (1, 0)),
        (np.diag([100.0, 100, 100, 1]), (1, 0)),
        (np.diag([7, 0.3, 2, 1]), (1, 0)),
        (np.diag([1.0, 1, 0, 1]), (1, 0)),
        (np.diag([-2.0, 1, 1, 1]), (-1, 0)),
        (SHEAR, (1, -0.5)),
    ],
    ids=["unit", "0.01", "100", "uneven", "flat", "mirrored", "sheared"],
)
def test_a_normal_map_tilts_the_normal_along_the_tangent_whatever_the_scale(build, matrix, tilt):
    """By the angle of its pixels; a tangent is turned as normals are."""
    mapped = ((0.6 + 1) / 2, 0.5, (0.8 + 1) / 2)
    frame = Expression("attribute", (), "tangent:"), Expression("attribute", (), "interpolated_normal")
    quad, light = tangent_quad(build), (SunLight("s", (*tilt, 1), (np.pi,) * 3),)
    surface = Surface(base_color=(1, 1, 1), normal=ex.apply("normal_map", mapped, 1.0, *frame))
    s = build.scene((quad, surface, {"matrix": matrix}), lights=light)
    s = replace(s, camera=build.camera(half=1e-4))
    along = np.hypot(*tilt)
    lit = trace(s, build.one_ray).radiance[8, 8, 0]
    assert lit == pytest.approx((0.6 * along + 0.8) / np.sqrt(1 + along**2), rel=1e-5)


def tangent_quad(build, **other):
    tangent = np.tile(np.array([1, 0, 0, 1], np.float32), (4, 1))
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    return build.quad(corners, attributes={"tangent:": tangent}, **other)


def test_a_normal_map_is_stronger_between_corners_whose_normals_differ(build):
    """MikkTSpace: the normal that it tilts is as interpolation leaves it, shorter than 1 between the corners."""
    lean = np.sqrt(0.5)
    normals = np.float32([(-lean, 0, lean), (lean, 0, lean), (lean, 0, lean), (-lean, 0, lean)])
    quad = tangent_quad(build, normals=normals)
    mapped = (0.9, 0.5, 0.8)
    frame = Expression("attribute", (), "tangent:"), Expression("attribute", (), "interpolated_normal")
    surface = Surface(base_color=(1, 1, 1), normal=ex.apply("normal_map", mapped, 1.0, *frame))
    s = build.scene((quad, surface), lights=(SunLight("s", (1, 0, 1), (np.pi,) * 3),), camera=build.camera(half=1e-4))
    x, z = 0.8, 0.6 * lean  # in the middle of the quad, where the normal is lean long
    assert trace(s, build.one_ray).radiance[8, 8, 0] == pytest.approx((x + z) / np.hypot(x, z) / np.sqrt(2), rel=1e-3)


@pytest.mark.parametrize("kind", ["map", "bump"])
def test_seen_from_behind_a_mapped_normal_is_turned_around(build, kind):
    """A hill on the outer side is a hollow seen from the inner one: the same slope, lit from the other side."""
    if kind == "map":
        frame = Expression("attribute", (), "tangent:"), Expression("attribute", (), "interpolated_normal")
        normal = ex.apply("normal_map", (0.8, 0.5, 0.9), 1.0, *frame)
    else:
        height = ex.apply("multiply", ex.apply("channel", Expression("attribute", (), "position"), data=0), -0.75)
        normal = ex.apply("bump", Expression("slope", (height,)), 1.0, 1.0, Expression("attribute", (), "normal"))
    surface = Surface(base_color=(1, 1, 1), normal=normal)
    for side in (1, -1):
        light = SunLight("s", (side, 0, side), (np.pi,) * 3)
        cam = build.camera((0, 0, 5 * side), half=1e-4)
        s = build.scene((tangent_quad(build), surface), lights=(light,), camera=cam)
        assert trace(s, build.one_ray).radiance[8, 8, 0] == pytest.approx((0.6 + 0.8) / np.sqrt(2), rel=1e-3)


# ------------------------------------------------------------------------------------------------ grazing views


def directions(seed, n=4000):
    v = np.random.default_rng(seed).normal(size=(3, n))
    return (v / np.linalg.norm(v, axis=0)).astype(np.float32)


def test_a_normal_that_would_reflect_into_the_surface_is_turned_just_enough():
    """In the plane of both normals, so far that the reflection leaves at min(0.01, 0.9 n_g.wo); others stay."""
    wo, n, up = directions(1), directions(2), directions(3)
    wo *= np.sign((wo * up).sum(0))
    least = np.minimum(0.9 * (wo * up).sum(0), 0.01)
    turned = reflecting_normal(wo, n, up)
    was, now = ((reflect(wo, m) * up).sum(0) for m in (n, turned))
    sunk = was < least
    assert 1000 < sunk.sum() < 3000
    np.testing.assert_array_equal(turned[:, ~sunk], n[:, ~sunk])
    np.testing.assert_allclose(now[sunk], least[sunk], atol=2e-6)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=0), 1, atol=1e-6)
    np.testing.assert_allclose((np.cross(n, up, axis=0) * turned).sum(0), 0, atol=1e-5)
    assert ((turned * up).sum(0)[sunk] >= 0).all()
    assert ((turned * wo).sum(0)[sunk] > 0).all()


def test_an_eye_below_the_plane_of_a_normal_is_lifted_into_it():
    wo, n = directions(1), directions(2)
    cos = (wo * n).sum(0)
    lifted, seen = above(wo, n, cos)
    front = cos > 1e-6
    np.testing.assert_array_equal(lifted[:, front], wo[:, front])
    np.testing.assert_array_equal(seen[front], cos[front])
    assert (seen > 0).all()
    np.testing.assert_allclose((lifted * n).sum(0)[~front], 0, atol=2e-4)
    np.testing.assert_allclose(np.linalg.norm(lifted, axis=0), 1, atol=1e-6)


GRAZING = np.radians(25)  # between the floor and the view


def leaning(build, surface, angle, **other):
    """A floor whose mapped normals lean away from the eye by `angle`, seen along it."""
    floor = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    normal = Expression("add", ((0.0, float(np.sin(angle)), float(np.cos(angle))), (0.0, 0.0, 0.0)))
    eye = (0, -5 * np.cos(GRAZING), 5 * np.sin(GRAZING))
    s = build.scene(
        (floor, replace(surface, normal=normal)), camera=build.camera(eye, up=(0, 0, 1), half=1e-4), **other
    )
    return trace(s, replace(build.one_ray, samples=16, rough_samples=1)).radiance[8, 8]


@pytest.mark.parametrize("degrees", [10, 24, 26, 50, 80])
def test_a_normal_that_looks_away_from_the_eye_is_lit_as_any_other(build, degrees):
    """Not as the plain one: its cosine with the light counts, whatever the eye's; 25 degrees are edge on."""
    angle, sun = np.radians(degrees), np.array([0, -0.6, 0.8])
    lit = leaning(build, build.matte((1, 1, 1)), angle, lights=(SunLight("s", tuple(sun), (np.pi,) * 3),))
    expected = max(0, float(sun @ (0, np.sin(angle), np.cos(angle))))
    np.testing.assert_allclose(lit, expected, atol=1e-5)


@pytest.mark.parametrize("layered", [True, False])
def test_highlights_and_layers_have_no_border_where_the_normal_turns_away(build, layered):
    """From edge on to beyond it they go on evenly, and do not end."""
    surface = Surface(base_color=(0, 0, 0), specular=(0.04,) * 3, roughness=0.6, layered=layered)
    sun = SunLight("s", (0, 0.9, 0.3), (np.pi,) * 3)
    found = [leaning(build, surface, np.radians(25 + d), lights=(sun,))[0] for d in (-0.2, -0.1, 0.1, 0.2, 5)]
    assert found[1] > 1e-3
    assert found[2] == pytest.approx(found[1], rel=0.05)
    assert found[3] == pytest.approx(found[0], rel=0.1)
    assert found[4] > 0.3 * found[1]


@pytest.mark.parametrize("roughness", [0.0, 0.3])
@pytest.mark.parametrize("degrees", [20, 30, 60, 85])
def test_a_mirror_whose_normals_look_away_shows_the_horizon_behind_it(build, degrees, roughness):
    """The world is red in front of the mirror (y < 0), green behind it, black below: it never shows its own inside."""
    place = Expression("attribute", (), "generated")
    behind, up = (ex.apply("greater", ex.apply("channel", place, data=row), 0.0) for row in (1, 2))
    world = World(ex.apply("join", ex.apply("multiply", up, ex.rest(behind)), ex.apply("multiply", up, behind), 0.0))
    metal = Surface(reflectivity=1.0, layered=True, roughness=roughness)
    seen = leaning(build, metal, np.radians(degrees), world=world)
    assert seen[1] > 0.9
    assert seen[0] < 0.1
