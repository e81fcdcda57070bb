# SPDX-License-Identifier: GPL-3.0-or-later
"""The sampler, and shadows of lights that have a size."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import AreaLight, PointLight, Settings, SpotLight, SunLight, Surface
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.sampler import Sampler, disk, permute, pixel_keys, r2

SAMPLES = 64


def draws(pixels, samples, path=0, first=0):
    keys = pixel_keys(np.arange(pixels), np.zeros(pixels, int), 0)
    sampler = Sampler(keys, first, samples)
    return sampler.draws(np.arange(pixels * samples), np.full((1, pixels * samples), path, np.uint32))


# ------------------------------------------------------------------------------------------------ sampler


def test_a_permutation_maps_blocks_of_powers_of_two_onto_each_other():
    number = np.arange(256, dtype=np.uint32)
    moved = permute(number, np.full(256, 0x1234567, np.uint32))
    for k in range(9):
        blocks = (moved >> k).reshape(-1, 1 << k)
        assert (blocks == blocks[:, :1]).all()
    assert len(set(moved.tolist())) == 256
    assert not np.array_equal(np.diff(moved.astype(np.int64)), np.ones(255))


def test_a_sample_depends_on_pixel_number_path_and_dimension_alone():
    u, v = draws(4, 8).square(np.uint32(5))
    later = draws(4, 4, first=4).square(np.uint32(5))
    np.testing.assert_array_equal(u.reshape(4, 8)[:, 4:], later[0].reshape(4, 4))
    np.testing.assert_array_equal(v.reshape(4, 8)[:, 4:], later[1].reshape(4, 4))
    for other in (draws(4, 8, path=1).square(np.uint32(5)), draws(4, 8).square(np.uint32(6))):
        assert np.abs(other[0] - u).mean() > 0.2


def test_samples_are_stratified_and_dimensions_independent():
    pixels, n = 2000, 16
    film, _ = r2(pixel_keys(np.arange(pixels), np.zeros(pixels, int), 0)[:, None], np.arange(n, dtype=np.uint32))
    u, v = draws(pixels, n).square(np.uint32(77))
    x, y = disk(u, v)
    assert np.abs(x * x + y * y).max() <= 1 + 1e-6
    # Left of a line through the disk: better than random samples, whose error is 0.115.
    assert (x.reshape(pixels, n) < 0.3).mean(1).std() < 0.085
    # Film times light: as two independent variables, not the diagonal of a square.
    both = ((film < 0.5) & (u < 0.5)).reshape(pixels, n).mean(1)
    assert both.mean() == pytest.approx(0.25, abs=0.01)
    assert both.std() < np.sqrt(0.25 * 0.75 / n) * 0.75


# ------------------------------------------------------------------------------------------------ soft shadows


def edge_scene(b, light, height=1.0):
    """A floor at z = 0, seen from above, lit past the straight edge of an unseen half plane x > 0 at a height."""
    floor = b.quad([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)])
    shade = b.quad([(0, -9, height), (9, -9, height), (9, 9, height), (0, 9, height)])
    hidden = {"visibility": replace(b.instance(0).visibility, camera=False)}
    return b.scene(
        (floor, b.matte()), (shade, b.matte(), hidden), lights=(light,), camera=b.camera(size=(64, 4), half=0.05)
    )


@pytest.mark.parametrize(
    "light",
    [
        AreaLight("a", (0, 0, 2), (0, 0, -1), (0.5, 0, 0), (0, 0.5, 0), (9, 9, 9)),
        AreaLight("e", (0, 0, 2), (0, 0, -1), (0.5, 0, 0), (0, 0.5, 0), (9, 9, 9), shape="ELLIPSE"),
        SunLight("s", (0, 0, 1), (1, 1, 1), angle=2 * np.arctan(0.5)),
        PointLight("p", (0, 0, 2), (9, 9, 9), radius=0.5),
        SpotLight("spot", (0, 0, 2), (9, 9, 9), radius=0.5, cos_cone=0.1),
        PointLight("ball", (0, 0, 2), (9, 9, 9), radius=0.5, soft_falloff=False),
    ],
    ids=lambda light: light.name,
)
def test_a_penumbra_has_its_closed_form(build, light):
    scene = edge_scene(build, light)
    lens = replace(scene.camera, view_plane=(-0.4, 0.4, -0.025, 0.025))
    quality = Settings(samples=SAMPLES, filter_radius=0.0, threads=1)
    plain = replace(scene, camera=lens, lights=(replace(light, cast_shadow=False),))
    got = trace(replace(scene, camera=lens), quality).radiance / trace(plain, quality).radiance
    x = (np.arange(64) + 0.5 - 32) / 64 * 4
    # The edge cuts the light's shape where the line from (x, 0) past (0, height 1) meets it, t from its centre.
    if isinstance(light, (SunLight, AreaLight)):
        t = -x / 0.5
    else:  # a disk that faces the receiver: the edge's distance from the centre, along the disk
        d = np.sqrt(x * x + 4)
        radius = 0.5 if light.soft_falloff else 0.5 * d / np.sqrt(d * d - 0.25)
        t = _facing(x, d) / radius
    t = np.clip(t, -1, 1)
    square = isinstance(light, AreaLight) and light.shape == "RECTANGLE"
    expected = (1 + t) / 2 if square else 0.5 + (t * np.sqrt(1 - t * t) + np.arcsin(t)) / np.pi
    np.testing.assert_allclose(got[..., 0].mean(0), expected, atol=0.025)


def test_a_penumbra_close_to_a_ball_is_that_of_its_cone(build):
    """A ball of radius r at distance d fills a cone of sine r / d: a disk of radius r d / sqrt(d^2 - r^2)."""
    r, height, edge = 0.6, 1.0, 0.3
    ball = PointLight("ball", (0, 0, height), (9, 9, 9), radius=r, soft_falloff=False)
    scene = edge_scene(build, ball, edge)
    scene = replace(scene, camera=replace(scene.camera, view_plane=(-0.1, 0.1, -0.00625, 0.00625)))
    quality = Settings(samples=256, filter_radius=0.0, threads=1)
    plain = replace(scene, lights=(replace(ball, cast_shadow=False),))
    got = trace(scene, quality).radiance / trace(plain, quality).radiance
    x = (np.arange(64) + 0.5 - 32) / 64
    sine = r / np.sqrt(x * x + height**2)
    # Seen from (x, 0, 0) the edge is as far from the ball's middle, in tangents, as these angles differ.
    t = np.clip(np.tan(np.arctan(x / height) - np.arctan(x / edge)) * np.sqrt(1 - sine**2) / sine, -1, 1)
    expected = 0.5 + (t * np.sqrt(1 - t * t) + np.arcsin(t)) / np.pi
    assert ((0.02 < expected) & (expected < 0.98)).sum() > 20
    np.testing.assert_allclose(got[..., 0].mean(0), expected, atol=0.02)


def _facing(x, d):
    """Where the plane through (x, 0, 0) and the edge (0, *, 1) meets the disk about (0, 0, 2) that faces (x, 0, 0)."""
    across = np.stack([np.full_like(x, 2.0), x]) / d  # in the disk, towards +x: perpendicular to (-x, 2)
    toward = np.stack([-x, np.full_like(x, 2.0)])
    # (toward + s across) is parallel to (-x, 1): its cross product with it vanishes.
    s = -(toward[0] * 1 + toward[1] * x) / (across[0] * 1 + across[1] * x)
    return s


def test_a_light_without_size_costs_and_changes_nothing(build):
    lights = (PointLight("p", (1, 0, 2), (9, 9, 9)), SunLight("s", (0, 1, 1), (1, 1, 1)))
    scene = replace(edge_scene(build, lights[0]), lights=lights)
    on, off = (trace(scene, Settings(samples=4, threads=1, shadow_samples=n)) for n in (1, 0))
    np.testing.assert_array_equal(on.radiance, off.radiance)
    assert on.rays == off.rays
    assert "random points on lights" in {entry["what"] for entry in on.skipped}


def test_no_light_comes_from_below_the_horizon(build):
    # A floor alone, lights that reach below its plane: nothing shadows it but itself, so shadows change nothing.
    floor = build.quad([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)])
    lights = (
        PointLight("p", (0, 0, 0.2), (1, 1, 1), radius=0.5),
        SunLight("s", (1, 0, 0.1), (1, 1, 1), angle=0.5),
        AreaLight("a", (3, 0, 0.3), (-1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)),
    )
    for light in lights:
        scene = build.scene((floor, build.matte()), lights=(light,))
        free = replace(scene, lights=(replace(light, cast_shadow=False),))
        got, expected = (trace(s, Settings(samples=4, threads=1)).radiance for s in (scene, free))
        np.testing.assert_array_equal(got, expected)


def test_more_shadow_samples_have_the_same_mean_and_less_noise(build):
    light = AreaLight("a", (0, 0, 2), (0, 0, -1), (0.5, 0, 0), (0, 0.5, 0), (9, 9, 9))
    scene = edge_scene(build, light)
    one, four, many = (
        trace(scene, Settings(samples=2, threads=1, shadow_samples=n)).radiance[..., 0] for n in (1, 4, 64)
    )
    assert np.abs(four - many).mean() < 0.6 * np.abs(one - many).mean()
    assert four.mean() == pytest.approx(many.mean(), rel=0.02)


def test_glass_tints_a_soft_shadow(build):
    light = AreaLight("a", (0, 0, 2), (0, 0, -1), (0.5, 0, 0), (0, 0.5, 0), (9, 9, 9))
    scene = edge_scene(build, light)
    red = Surface(opacity=0.0, ior=1.0, transmission_tint=(1.0, 0.5, 0.0))
    scene = replace(scene, surfaces=(*scene.surfaces, red), instances=(
        scene.instances[0], replace(scene.instances[1], surfaces=(len(scene.surfaces),)),
    ))  # fmt: skip
    got = trace(scene, Settings(samples=SAMPLES, threads=1)).radiance
    column = got[2, -1] / got[2, 0]  # under the glass, beside it
    assert column[1] / column[0] == pytest.approx(0.5, rel=1e-3)
    assert column[2] == 0
    blue = got[2, :, 2] / got[2, :, 0]
    assert ((blue > 0.1) & (blue < 0.9)).sum() > 4  # a penumbra
