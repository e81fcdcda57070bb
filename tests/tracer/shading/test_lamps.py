# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that rays meet: shape and radiance in closed form, what hides them, and who sees none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import (
    AreaLight,
    Camera,
    Plane,
    PointLight,
    Scene,
    Settings,
    Sphere,
    SpotLight,
    SunLight,
    Surface,
    Visibility,
    World,
)
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.emitters.lights import compile_lights

MIRROR = Surface("mirror", layered=True, reflectivity=1.0, roughness=0.0)
GLASS = Surface("glass", layered=True, opacity=0.0, roughness=0.0, ior=1.5)
BLACK = Surface("black", base_color=(0, 0, 0))
SIZE, HEIGHT = 64, 2.0
DOWN = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]])  # a camera above that looks down

SQUARE = AreaLight("a", (0, 0, 10), (0, 0, -1), (0.5, 0, 0), (0, 0.25, 0), (3, 2, 1))
LIGHTS = {  # name -> light, area of its image in the mirror, radiance
    "rectangle": (SQUARE, 0.5, 3.0),
    "ellipse": (replace(SQUARE, shape="ELLIPSE"), np.pi / 8, 3.0),
    "soft point": (PointLight("p", (0, 0, 10), (3, 2, 1), radius=0.4), np.pi * 0.16, 3 / (np.pi * 0.16)),
    "ball": (PointLight("p", (0, 0, 10), (3, 2, 1), radius=0.4, soft_falloff=False), np.pi * 0.16, 3 / (np.pi * 0.16)),
}


def camera(width=2.0):
    half = width / 2
    return Camera("ORTHO", DOWN, (-half, half, -half, half), (SIZE, SIZE), (0, 0, SIZE, SIZE))


def seen(lights, surface=MIRROR, spheres=(), planes=None, visibility=None, **settings):
    """(h, w, 3) of a floor from above, under lamps."""
    floor = Plane("floor", (0, 0, 0), (0, 0, 1), 0, ray_traced=True)
    scene = Scene(
        camera(), surfaces=(surface, BLACK, GLASS), planes=(floor,) if planes is None else planes, spheres=spheres,
        lights=tuple(lights), world=World((0, 0, 0)),
    )  # fmt: skip
    values = {"samples": 16, "camera_sees": "ALL", "threads": 1, **settings}
    return trace(scene, Settings(**values)).radiance


@pytest.mark.parametrize("name", LIGHTS)
def test_a_mirror_shows_the_shape_and_the_radiance(name):
    """Seen straight from above the mirror image of a lamp has the lamp's own size (a disk faces each ray's origin)."""
    light, area, radiance = LIGHTS[name]
    red = seen([light])[..., 0]
    assert red.max() == pytest.approx(radiance, rel=1e-5)
    assert red.sum() * (2.0 / SIZE) ** 2 == pytest.approx(radiance * area, rel=0.01)
    assert ((red > 0.01 * radiance) & (red < 0.99 * radiance)).mean() < 0.1  # sharp, but for the pixel filter
    assert red[:3].max() == 0


def test_a_sun_is_a_disk_in_the_sky():
    """Of half its angle, and of the radiance that its irradiance makes: E / (pi sin^2)."""
    angle = 0.4
    ball = Sphere("ball", (0, 0, 0), 1.0, 0, ray_traced=True)
    sun = SunLight("s", (0, 0, 1), (2, 2, 2), angle=angle)
    red = seen([sun], planes=(), spheres=(ball,), samples=64)[..., 0]
    radiance = 2 / (np.pi * np.sin(angle / 2) ** 2)
    assert red.max() == pytest.approx(radiance, rel=1e-5)
    # A ball mirrors up what is at twice the angle of its normal: sin(angle / 4) from its middle.
    assert red.sum() * (2.0 / SIZE) ** 2 == pytest.approx(radiance * np.pi * np.sin(angle / 4) ** 2, rel=0.03)


@pytest.mark.parametrize(
    "light",
    [
        replace(SQUARE, direction=(0, 0, 1)),
        replace(SQUARE, axis_u=(0, 0, 0)),
        PointLight("p", (0, 0, 10), (3, 2, 1)),
        SunLight("s", (0, 0, 1), (2, 2, 2)),
        replace(SQUARE, position=(0, 0, -3)),
        replace(SQUARE, specular=0.0),
    ],
    ids=["back", "no area", "point", "sharp sun", "below", "factor 0"],
)
def test_nothing_to_see(light):
    assert seen([light]).max() == 0


def test_a_lamp_of_negative_power_takes_light_away():
    """As Blender allows: before a brighter one of the same shape it leaves the rest."""
    both = [SQUARE, replace(SQUARE, name="b", position=(0, 0, 9), radiance=(-1, -1, -1))]
    assert seen(both)[SIZE // 2, SIZE // 2] == pytest.approx((2, 1, 0), abs=1e-5)


def test_range_cone_and_factor_are_those_of_the_mirror():
    plain = seen([SQUARE]).max()
    assert seen([replace(SQUARE, range=20.0)]).max() == pytest.approx(plain * (1 - 0.5**4) ** 2, rel=1e-4)
    assert seen([replace(SQUARE, range=9.0)]).max() == 0
    assert seen([replace(SQUARE, specular=0.25)]).max() == pytest.approx(plain / 4)
    spot = SpotLight("s", (0, 0, 10), (3, 2, 1), radius=0.4, cos_cone=0.9, blend=0.0)
    assert seen([spot]).max() == pytest.approx(3 / (np.pi * 0.16), rel=1e-5)
    sideways = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    assert seen([replace(spot, world_to_light=sideways)]).max() == 0


def test_what_is_before_a_lamp_hides_it_and_what_is_behind_does_not():
    card = Sphere("card", (0, 0, 7), 1.5, 1, visibility=Visibility(camera=False))
    assert seen([SQUARE], spheres=(card,)).max() == 0
    assert seen([SQUARE], spheres=(replace(card, center=(0, 0, 15)),)).max() == pytest.approx(3, rel=1e-5)
    assert seen([replace(SQUARE, cast_shadow=False)], spheres=(card,)).max() == pytest.approx(3, rel=1e-5)


def test_linked_lamps():
    """Objects count spheres before planes: the floor is 1, the card 0."""
    card = Sphere("card", (0, 0, 7), 1.5, 1, visibility=Visibility(camera=False))
    assert seen([replace(SQUARE, receivers=frozenset({0}))], spheres=(replace(card, center=(0, 0, 15)),)).max() == 0
    lit = seen([replace(SQUARE, receivers=frozenset({1}))], spheres=(replace(card, center=(0, 0, 15)),))
    assert lit.max() == pytest.approx(3, rel=1e-5)
    passes = seen([replace(SQUARE, blockers=frozenset({1}))], spheres=(card,))
    assert passes.max() == pytest.approx(3, rel=1e-5)
    other = Sphere("other", (0, 0, 8.5), 1.2, 1, visibility=Visibility(camera=False))
    # Objects: card 0, other 1, floor 2. What blocks hides the lamp behind what does not.
    assert seen([replace(SQUARE, blockers=frozenset({1}))], spheres=(card, other)).max() == 0


def test_camera_rays_see_none_not_even_straight_through():
    pane = Surface("pane", opacity=0.0, ior=1.0)
    up = replace(SQUARE, direction=(0, 0, 1), position=(0, 0, 2))
    assert seen([up], planes=()).max() == 0
    assert seen([up], surface=pane, planes=(Plane("p", (0, 0, 4), (0, 0, 1), 0, ray_traced=True),)).max() == 0


def test_through_glass_by_the_factor_of_transmission():
    """A glass ball before a lamp that faces the camera: its middle passes (1 - R)^2, R = 0.04."""
    ball = Sphere("ball", (0, 0, 0), 0.5, 2, ray_traced=True)
    lamp = replace(SQUARE, direction=(0, 0, 1), position=(0, 0, -3), axis_u=(4, 0, 0), axis_v=(0, 4, 0))
    image = seen([lamp], planes=(), spheres=(ball,))
    middle = image[SIZE // 2, SIZE // 2, 0]
    assert middle == pytest.approx(3 * 0.96**2, rel=0.01)
    half = seen([replace(lamp, transmission=0.5, specular=0.0)], planes=(), spheres=(ball,))
    assert half[SIZE // 2, SIZE // 2, 0] == pytest.approx(middle / 2, rel=0.01)


def test_in_a_mirror_of_a_mirror():
    """Two facing mirrors show one another's lamps, at full strength."""
    ceiling = Plane("ceiling", (0, 0, 6), (0, 0, -1), 0)
    above = replace(ceiling, visibility=Visibility(camera=False))
    floor = Plane("floor", (0, 0, 0), (0, 0, 1), 0, ray_traced=True)
    lamp = replace(SQUARE, position=(0, 0, 3), direction=(0, 0, 1))  # shines at the ceiling, away from the floor
    assert seen([lamp], planes=(floor, above), max_depth=1).max() == 0
    assert seen([lamp], planes=(floor, above), max_depth=2).max() == pytest.approx(3, rel=1e-4)


@pytest.mark.parametrize("rough_samples", [1, 4])
def test_no_light_is_counted_twice(rough_samples):
    """Below the sharpest highlight and above it a mirror shows the same sum of a lamp's light."""
    lamp = replace(SQUARE, axis_u=(0.5, 0, 0), axis_v=(0, 0.5, 0))
    sums = [
        seen([lamp], replace(MIRROR, roughness=r), rough_samples=rough_samples)[..., 0].sum() for r in (0.04, 0.0401)
    ]
    assert sums[1] == pytest.approx(sums[0], rel=0.03)


def test_the_highlight_of_a_rough_mirror_keeps_the_light():
    """A lobe of albedo 1 spreads a lamp's image, and loses nothing of what stays in view."""
    small = replace(SQUARE, axis_u=(0.1, 0, 0), axis_v=(0, 0.1, 0), position=(0, 0, 2))
    sharp, rough = (seen([small], replace(MIRROR, roughness=r), rough_samples=1)[..., 0].sum() for r in (0.0, 0.1))
    assert rough == pytest.approx(sharp, rel=0.05)


def slab(build, roughness, lamps, **settings):
    """(h, w) of a glass slab, 4 m wide and high and 1 m thick, from above."""
    body = build.box((-2, -2, -1), (2, 2, 0))
    surface = replace(GLASS, roughness=roughness)
    s = build.scene((body, surface), camera=camera(), lights=tuple(lamps), world=World((0, 0, 0)))
    return trace(
        s, Settings(**{"samples": 16, "camera_sees": "ALL", "threads": 1, "rough_samples": 1, **settings})
    ).radiance[..., 0]


def test_both_faces_of_a_slab_show_a_lamp_before_it_and_no_more(build):
    """In the middle both images lie one over the other: R + (1 - R)^2 R (1 + R^2 + ...) = 2 R / (1 + R)."""
    image = slab(build, 0.0, [replace(SQUARE, position=(0, 0, 10))])
    assert image[SIZE // 2, SIZE // 2] == pytest.approx(3 * 2 * 0.04 / 1.04, rel=0.01)


@pytest.mark.once
@pytest.mark.parametrize("roughness", [0.06, 0.2, 0.4])
def test_a_frosted_slab_spreads_a_lamp_behind_it_and_keeps_its_light(build, roughness):
    """A wide lamp behind it is seen through, whether by rays or in the highlight of the face that it leaves by."""
    wide = AreaLight("a", (0, 0, -3), (0, 0, 1), (30, 0, 0), (0, 30, 0), (1, 1, 1))
    clear = slab(build, 0.0, [wide])[SIZE // 2, SIZE // 2]
    frosted = slab(build, roughness, [wide], samples=64)
    assert clear == pytest.approx(1 - 2 * 0.04 / 1.04, rel=0.01)
    assert frosted[24:40, 24:40].mean() == pytest.approx(clear, rel=0.06)


@pytest.mark.once
def test_a_lamp_without_a_size_glows_through_frosted_glass_alone(build):
    point = PointLight("p", (0, 0, -3), (5, 5, 5))
    assert slab(build, 0.0, [point]).max() == 0
    glow = slab(build, 0.3, [point], samples=64)
    assert glow[28:36, 28:36].mean() > 4 * glow[:4, :4].mean() > 0
    assert slab(build, 0.3, [replace(point, transmission=0.0)]).max() == 0


def test_without_rough_samples_nothing_rough_is_sharp(build):
    """It shows no lamp but in highlights, and of the world the blurred image."""
    world = World((1, 1, 1))
    body = build.box((-2, -2, -1), (2, 2, 0))
    s = build.scene((body, replace(GLASS, roughness=0.3)), camera=camera(), world=world)
    below = build.mesh([[-9, -9, -2], [9, -9, -2], [0, 9, -2]], [(0, 1, 2)])
    s = build.scene((body, replace(GLASS, roughness=0.3)), (below, BLACK), camera=camera(), world=world)
    image = trace(s, Settings(samples=4, camera_sees="ALL", threads=1, rough_samples=0)).radiance
    assert image == pytest.approx(1, abs=0.02)  # all of the world's light, though what is behind is black
    assert trace(s, Settings(samples=4, camera_sees="ALL", threads=1, rough_samples=1)).radiance.mean() < 0.2


@pytest.mark.parametrize("rough_samples", [1, 3])
def test_a_smooth_coat_over_a_rough_base_shows_lamps_without_noise(rough_samples):
    """At normal incidence it reflects 0.04 of the lamp, sharply, in every sample; the rest is the base's highlight."""
    paint = replace(MIRROR, reflection_tint=(0.5, 0.1, 0.1), roughness=0.5, coat=1.0, coat_roughness=0.0)
    bare = seen([SQUARE], replace(paint, coat=0.0), samples=1, rough_samples=rough_samples)[..., 0]
    image = seen([SQUARE], paint, samples=1, rough_samples=rough_samples)[..., 0]
    row = image[SIZE // 2] - (1 - 0.04) * bare[SIZE // 2]
    inside, outside = row[20:44], np.concatenate([row[:12], row[52:]])
    np.testing.assert_allclose(inside, 0.04 * 3, rtol=0.03)
    np.testing.assert_allclose(outside, 0, atol=0.003)


# ------------------------------------------------------------------------------------------------ shapes alone


def place(lamp):
    return compile_lights([lamp], np.zeros(3), np.zeros(1, np.intp))[0]


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("name", LIGHTS)
def test_rims_are_where_they_are_at_any_size(name, scale):
    light, _, _ = LIGHTS[name]
    changed = {"position": tuple(scale * np.array(light.position))}
    for field in ("axis_u", "axis_v", "radius"):
        if hasattr(light, field):
            changed[field] = tuple(scale * np.array(v)) if isinstance(v := getattr(light, field), tuple) else scale * v
    lamp = place(replace(light, **changed))
    reach = 0.5 if isinstance(light, AreaLight) else 0.4
    angle = np.arctan(reach / 10) if name != "ball" else np.arcsin(reach / 10)
    for factor, expected in ((0.999, True), (1.001, False)):
        d = np.array([[np.sin(angle * factor)], [0], [np.cos(angle * factor)]], np.float64)
        with np.errstate(all="ignore"):
            meets, t = lamp.met_by(np.zeros((3, 1), np.float32), d)
        assert meets[0] == expected
        if expected:
            assert t[0] == pytest.approx(10 * scale, rel=0.01)


def test_rays_that_run_along_an_area_light_miss_it():
    lamp = place(replace(SQUARE, position=(0, 0, 0)))
    d = np.array([[1.0, 1.0], [0.0, 0.0], [0.0, -1e-7]], np.float32)
    with np.errstate(all="ignore"):
        meets, _ = lamp.met_by(np.array([[-3, -3], [0, 0], [0, 0]], np.float32), d)
    assert not meets.any()
