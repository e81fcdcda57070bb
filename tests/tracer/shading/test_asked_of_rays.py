# SPDX-License-Identifier: GPL-3.0-or-later
"""What surfaces ask of the rays that see them, and of the instances that wear them."""

from __future__ import annotations

import numpy as np
import pytest

from hybrid_addon.expressions import INSTANCE, RAY
from hybrid_addon.scene import Expression, Settings, SunLight, Surface
from hybrid_addon.tracer import trace

SMOOTH = Settings(1, 64, camera_sees="ALL", threads=1)
HALF = 2.0  # metres, of the picture


def asked(key):
    return Expression("attribute", (), key)


def glow(key, factor=1.0):
    return Surface(base_color=(0.0, 0.0, 0.0), emission=Expression("multiply", (asked(key), factor)))


def clear(**other):
    return Surface(opacity=0.0, ior=1.0, **other)


@pytest.fixture
def look(build):
    """The radiance in the middle of a picture, seen along -Z without perspective from 5 m above."""

    def radiance(*parts, **other):
        view = build.camera((0, 0, 5), projection="ORTHO", view_plane=(-HALF, HALF, -HALF, HALF))
        return trace(build.scene(*parts, camera=view, **other), SMOOTH).radiance[8, 8]

    def sheet(z, size=9.0):
        return build.quad([(-size, -size, z), (size, -size, z), (size, size, z), (-size, size, z)])

    radiance.sheet, radiance.build = sheet, build
    return radiance


@pytest.mark.parametrize(
    ("key", "expected"),
    [("Is Camera Ray", 1), ("Is Shadow Ray", 0), ("Ray Depth", 0), ("Transparent Depth", 2), ("Ray Length", 7)],
)
def test_what_lies_behind_two_clear_panes_is_seen_by_the_same_camera_ray(look, key, expected):
    found = look((look.sheet(-2), glow(RAY + key)), (look.sheet(1), clear()), (look.sheet(0), clear()))
    np.testing.assert_allclose(found, expected, atol=2e-3)  # rays start at the near clip plane, 1 mm from the eye


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("Is Camera Ray", 0),
        ("Is Glossy Ray", 1),
        ("Is Singular Ray", 1),
        ("Is Reflection Ray", 0),
        ("Is Transmission Ray", 1),
        ("Ray Depth", 2),
        ("Glossy Depth", 0),
        ("Transmission Depth", 2),
        ("Ray Length", 1),
    ],
)
def test_what_lies_behind_glass_is_seen_by_a_ray_bent_twice(look, key, expected):
    """Its length counts from where it left the glass, one metre above."""
    slab = look.build.box((-9, -9, 0), (9, 9, 1))
    found = look((look.sheet(-1), glow(RAY + key)), (slab, look.build.glass(1.5)))
    # Each face lets 0.96 through; what is mirrored twice within adds 0.0016 of it, by rays two bounces deeper.
    assert found[0] == pytest.approx(0.96**2 * expected, abs=0.01 * max(expected, 1))


@pytest.mark.parametrize(("key", "expected"), [("Is Reflection Ray", 1), ("Glossy Depth", 1), ("Ray Length", 8)])
def test_what_a_mirror_shows_is_seen_by_a_reflection_ray(look, key, expected):
    """The mirror lies 5 m below the camera, what it shows 3 m above the camera."""
    shown = look.build.quad([(-9, 9, 8), (9, 9, 8), (9, -9, 8), (-9, -9, 8)])
    found = look((look.sheet(0), look.build.mirror()), (shown, glow(RAY + key)))
    np.testing.assert_allclose(found, expected, rtol=1e-4)


def test_a_pane_for_shadow_rays_alone_darkens_the_floor_and_is_not_seen(look):
    """Its tint is what is left of light: 1 for the camera, 0.25 for shadow rays."""
    tint = Expression("mix", (asked(RAY + "Is Shadow Ray"), 1.0, 0.25))
    sun = SunLight("sun", direction=(0.0, 0.0, 1.0), irradiance=(np.pi,) * 3, angle=0.0)
    parts = (look.sheet(0), look.build.matte((1.0, 1.0, 1.0))), (look.sheet(2), clear(transmission_tint=tint))
    np.testing.assert_allclose(look(*parts, lights=(sun,)), 0.25, rtol=1e-4)


@pytest.mark.parametrize(("key", "expected"), [("Ray Length", 3.0), ("Transparent Depth", 3.0), ("Ray Depth", 1.0)])
def test_the_second_pane_that_a_shadow_ray_meets_is_told_of_the_way_from_the_floor(look, key, expected):
    """The camera's ray has crossed both before it, and that counts."""
    tint = Expression("mix", (asked(RAY + "Is Shadow Ray"), 1.0, Expression("multiply", (asked(RAY + key), 0.1))))
    sun = SunLight("sun", direction=(0.0, 0.0, 1.0), irradiance=(np.pi,) * 3, angle=0.0)
    floor = look.sheet(0), look.build.matte((1.0, 1.0, 1.0))
    parts = (
        floor,
        (look.sheet(1), clear(transmission_tint=(0.5, 0.5, 0.5))),
        (look.sheet(3), clear(transmission_tint=tint)),
    )
    np.testing.assert_allclose(look(*parts, lights=(sun,))[0], 0.5 * 0.5 * 0.1 * expected, rtol=1e-3)


def test_instances_that_share_a_surface_have_values_of_their_own(build):
    """One that has none has 0."""
    small = build.quad([(-0.4, -0.4, 0), (0.4, -0.4, 0), (0.4, 0.4, 0), (-0.4, 0.4, 0)])
    tints = {-1: {"color": (1.0, 0.5, 0.25)}, 0: {}, 1: {"color": (0.0, 0.0, 3.0)}}
    instances = tuple(
        build.instance(0, 0, build.translation(x, 0, 0), name=str(x), ray_traced=True, values=values)
        for x, values in tints.items()
    )
    view = build.camera((0, 0, 5), size=(40, 40), projection="ORTHO", view_plane=(-HALF, HALF, -HALF, HALF))
    scene = build.scene(camera=view, meshes=(small,), instances=instances, surfaces=(glow(INSTANCE + "color"),))
    film = trace(scene, SMOOTH)
    found = film.radiance[20, [10, 20, 30]]
    np.testing.assert_allclose(found, [(1, 0.5, 0.25), (0, 0, 0), (0, 0, 3)], atol=1e-5)


def test_a_point_goes_to_object_space_and_back(build):
    """Through matrices that turn, scale unevenly and mirror."""
    matrix = np.array([[0.0, -3.0, 0.5, 1.0], [2.0, 0.0, 0.0, -2.0], [0.0, 0.3, -1.0, 0.5], [0, 0, 0, 1]])
    there = Expression("transformed", (asked("position"), asked(INSTANCE + "WORLD_TO_OBJECT")), "POINT")
    back = Expression("transformed", (there, asked(INSTANCE + "OBJECT_TO_WORLD")), "POINT")
    off = Expression("length", (Expression("subtract", (back, asked("position"))),))
    ball = build.icosphere(2)
    surface = Surface(base_color=(0.0, 0.0, 0.0), emission=Expression("add", (off, (0.0, 1.0, 0.0))))
    view = build.camera((0, 0, 9), projection="ORTHO", view_plane=(-HALF, HALF, -HALF, HALF))
    scene = build.scene((ball, surface, {"matrix": matrix}), camera=view)
    found = trace(scene, SMOOTH).radiance
    seen = found[..., 1] > 0.5
    assert seen.sum() > 20
    np.testing.assert_allclose(found[seen], [(0, 1, 0)] * seen.sum(), atol=1e-5)
