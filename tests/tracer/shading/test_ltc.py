# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights by linearly transformed cosines, against integrals over GGX and over shapes, and against a mirror."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hybrid_addon.scene import AreaLight, PointLight, SunLight
from hybrid_addon.tracer.core.constants import MIRROR_ROUGHNESS
from hybrid_addon.tracer.core.vectors import dot, normalize
from hybrid_addon.tracer.emitters.form_factors import ball_form_factor, ellipse_form_factor
from hybrid_addon.tracer.emitters.lights import compile_lights
from hybrid_addon.tracer.materials.principled import masking
from hybrid_addon.tracer.shading.ltc import BrushedLobe, Lobe, ggx_lobe
from hybrid_addon.tracer.shading.scattering import reflect

UP = np.array([[0.0], [0.0], [1.0]], np.float32)


def columns(*values):
    return np.array(values, np.float64).reshape(-1, 3).T


def eye(cosine):
    return np.array([[np.sqrt(1 - cosine**2)], [0.0], [cosine]], np.float32)


def lit(lamp, roughness, cosine, point=(0.0, 0.0, 0.0)):
    """What a surface of normal +Z reflects of a lamp of colour 1, seen at a cosine from +X."""
    (light,) = compile_lights([lamp], np.zeros(3), np.zeros(1, np.intp))
    lobe = ggx_lobe(eye(cosine), UP, np.array([roughness], np.float32))
    place = np.array(point, np.float32)[:, None]
    return float(light.highlight(place, UP, lobe, np.zeros(1, np.float32))[0])


def square(center, toward, half, **more):
    """An area light of radiance 1."""
    direction = np.array(toward, float) - center
    direction /= np.linalg.norm(direction)
    u = np.cross(direction, (0.3, 1.0, 0.1))
    u /= np.linalg.norm(u)
    v = np.cross(direction, u)
    return AreaLight("a", tuple(center), tuple(direction), tuple(u * half), tuple(v * half), (1, 1, 1), **more)


def ggx_over(lamp, roughness, cosine, n=300):
    """The same by summing a GGX lobe, normalised, over the lamp: height-correlated Smith masking."""
    steps = (np.arange(n) + 0.5) / n * 2 - 1
    x, y = (a.ravel() for a in np.meshgrid(steps, steps))
    place = np.array(lamp.position)[:, None] + np.outer(lamp.axis_u, x) + np.outer(lamp.axis_v, y)
    area = 4 * np.linalg.norm(np.cross(lamp.axis_u, lamp.axis_v))
    d2 = (place**2).sum(axis=0)
    wi = place / np.sqrt(d2)
    solid = np.abs(np.array(lamp.direction) @ wi) / d2 * area / len(x)
    return (lobe_of(wi, roughness, cosine) * solid).sum() / albedo(roughness, cosine)


def lobe_of(wi, roughness, cosine):
    alpha = roughness**2
    wo = eye(cosine).astype(np.float64)
    h = wi + wo
    h /= np.linalg.norm(h, axis=0)
    sin2 = h[0] ** 2 + h[1] ** 2
    d = alpha**2 / (np.pi * (sin2 + alpha**2 * (1 - sin2)) ** 2)
    g_i, g_o = masking(np.maximum(wi[2], 1e-6), alpha), masking(np.array([cosine]), alpha)
    both = g_i * g_o / (g_i + g_o - g_i * g_o)
    return np.where(wi[2] > 0, d * both / (4 * cosine), 0)


@cache
def albedo(roughness, cosine, n=500):
    """Over the half space, with more directions around the mirror's."""
    steps = (np.arange(n) + 0.5) / n
    phi, r = np.meshgrid(2 * np.pi * steps, steps)
    theta = np.pi * r**3  # off the mirror's direction
    weight = 2 * np.pi * np.sin(theta) * 3 * np.pi * r**2 / n**2
    z = np.array([-np.sqrt(1 - cosine**2), 0, cosine])
    x = np.array([cosine, 0, np.sqrt(1 - cosine**2)])
    wi = (
        np.outer(z, np.cos(theta).ravel())
        + np.outer(x, (np.sin(theta) * np.cos(phi)).ravel())
        + np.outer((0, 1, 0), (np.sin(theta) * np.sin(phi)).ravel())
    )
    return (lobe_of(wi, roughness, cosine) * weight.ravel()).sum()


@pytest.mark.parametrize("roughness", [0.1, 0.2, 0.3, 0.5, 0.8])
@pytest.mark.parametrize("cosine", [1.0, 0.8, 0.5])
def test_highlights_are_ggx_over_the_lamp(roughness, cosine):
    """In the mirror's direction and around it, as near as a transformed cosine comes: to 12 % of the brightest."""
    sin = np.sqrt(1 - cosine**2)
    ours, exact = [], []
    for turn in (0.0, 0.15, -0.15, 0.4):
        angle = np.arctan2(sin, cosine) + turn
        lamp = square(3 * np.array([-np.sin(angle), 0.1, np.cos(angle)]), (0, 0, 0), 0.5)
        ours.append(lit(lamp, roughness, cosine))
        exact.append(ggx_over(lamp, roughness, cosine))
    assert ours == pytest.approx(exact, abs=0.12 * max(exact))


@pytest.mark.parametrize("cosine", [1.0, 0.6, 0.2])
@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
def test_as_smooth_as_can_be_it_is_the_mirror_image(cosine, shape):
    """So nothing jumps where lamps are met by rays instead: 1 within the lamp's image, 0 outside."""
    wo = eye(cosine)
    middle = 2 * reflect(wo, UP)[:, 0].astype(float)
    lamp = square(middle, (0, 0, 0), 0.2, shape=shape)
    across, up = np.array(lamp.axis_u), np.array(lamp.axis_v)
    for place, expected in ((0.0, 1), (0.9, 1), (-0.9, 1), (1.1, 0), (-1.1, 0)):
        for axis in (across, up):
            moved = replace(lamp, position=tuple(middle - axis * place))
            assert lit(moved, MIRROR_ROUGHNESS * 1.01, cosine) == pytest.approx(expected, abs=0.04)


@pytest.mark.parametrize("roughness", [0.05, 0.3, 1.0])
def test_a_lamp_all_around_is_all_that_a_lobe_sees(roughness):
    lamp = square((0, 0, 1), (0, 0, 0), 1e4)
    assert lit(lamp, roughness, 0.9) == pytest.approx(1, abs=0.02)
    inside = PointLight("p", (0, 0, 0.5), (1, 1, 1), radius=1.0, soft_falloff=False)
    assert lit(inside, roughness, 0.9) == pytest.approx(1 / np.pi)  # the radiance of a ball of intensity and radius 1


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.6])
def test_small_lamps_of_every_kind_are_one_another(roughness):
    """Of the same power a point, a ball, a small square and a sun in the same place light the same."""
    place, d = np.array((-1.2, 0.3, 1.7)), np.linalg.norm((-1.2, 0.3, 1.7))
    expected = lit(PointLight("p", tuple(place), (1, 1, 1), radius=0.0), roughness, 0.8)
    assert expected > 0.01
    half = 0.01
    area = square(place, (0, 0, 0), half)
    found = [
        lit(PointLight("p", tuple(place), (1, 1, 1), radius=0.02), roughness, 0.8),
        lit(PointLight("p", tuple(place), (1, 1, 1), radius=0.02, soft_falloff=False), roughness, 0.8),
        lit(area, roughness, 0.8) / (4 * half**2),
        lit(replace(area, shape="ELLIPSE"), roughness, 0.8) / (np.pi * half**2),
        lit(SunLight("s", tuple(place / d), (1, 1, 1), angle=0.01), roughness, 0.8) / d**2,
        lit(SunLight("s", tuple(place / d), (1, 1, 1)), roughness, 0.8) / d**2,
    ]
    assert found == pytest.approx([expected] * len(found), rel=0.01)


def test_nothing_shines_to_the_back_or_from_below():
    lamp = square((0, 0, 2), (0, 0, 0), 0.5)
    assert lit(lamp, 0.3, 1.0) > 0.1
    assert lit(replace(lamp, direction=(0, 0, 1)), 0.3, 1.0) == 0
    assert lit(square((0, 0, -2), (0, 0, 0), 0.5), 0.3, 1.0) == 0


# ------------------------------------------------------------------------------------------------ form factors


def form_factor_by_points(center, u, v, n=500):
    steps = (np.arange(n) + 0.5) / n
    r, phi = (a.ravel() for a in np.meshgrid(np.sqrt(steps), 2 * np.pi * steps))
    place = center[:, None] + np.outer(u, r * np.cos(phi)) + np.outer(v, r * np.sin(phi))
    normal = np.cross(u, v)
    d2 = (place**2).sum(axis=0)
    return (np.maximum(place[2], 0) * np.abs(normal @ place) / d2**2).mean()


@pytest.mark.parametrize("seed", range(8))
def test_ellipses_above_the_horizon_are_exact(seed):
    rng = np.random.default_rng(seed)
    center, u, v = rng.normal(size=3), rng.normal(size=3) * 0.5, rng.normal(size=3) * 0.3
    center[2] = 2 + abs(center[2])
    ours = ellipse_form_factor(*(columns(a) for a in (center, u, v)))[0]
    assert ours == pytest.approx(form_factor_by_points(center, u, v), rel=1e-4)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_tiny_and_huge_disks(scale):
    """A disk straight above at distance 1: r^2 / (1 + r^2)."""
    ours = ellipse_form_factor(columns((0, 0, 1)), columns((scale, 0, 0)), columns((0, scale, 0)))[0]
    assert ours == pytest.approx(scale**2 / (1 + scale**2), rel=1e-6)


@pytest.mark.parametrize("cosine", [0.9, 0.4, 0.1, 0.0, -0.1, -0.4, -0.9])
def test_balls_cut_by_the_horizon(cosine):
    sin_s = 0.6
    u, v = (np.arange(600) + 0.5) / 600, (np.arange(600) + 0.5) / 600
    z, phi = np.meshgrid(1 - u * (1 - np.sqrt(1 - sin_s**2)), 2 * np.pi * v)
    height = z * cosine + np.sqrt(1 - z * z) * np.cos(phi) * np.sqrt(1 - cosine**2)
    exact = np.maximum(height, 0).mean() * 2 * (1 - np.sqrt(1 - sin_s**2))
    assert ball_form_factor(np.array([sin_s**2]), np.array([cosine]))[0] == pytest.approx(exact, abs=1e-4)


def test_a_sun_does_not_come_nearer_in_a_large_scene():
    """A point's own uncertainty is a length; a sun is at none."""
    (sun,) = compile_lights([SunLight("s", (0.6, 0, 0.8), (1, 1, 1), angle=0.1)], np.zeros(3), np.zeros(1, np.intp))
    lobe = ggx_lobe(eye(0.8), UP, np.array([0.3], np.float32))
    near, far = (sun.highlight(np.zeros((3, 1), np.float32), UP, lobe, np.float32([d]))[0] for d in (0, 50))
    assert near == far > 0


def lobes(n, rng):
    """Round and brushed ones of surfaces of normal +Z, seen from all sides."""
    wo = normalize(np.stack([*rng.normal(size=(2, n)), rng.uniform(0.05, 2, n)])).astype(np.float32)
    normals, roughness = np.repeat(UP, n, axis=1), rng.uniform(0.1, 1, n).astype(np.float32)
    ways = np.repeat(np.float32([[1], [0], [0]]), n, axis=1), np.full(n, 2.0, np.float32)
    yield ggx_lobe(wo, normals, roughness)
    yield BrushedLobe(wo, normals, roughness, ways).towards(np.repeat(np.float32([[0.6], [0.0], [0.8]]), n, axis=1))


def test_lamps_below_the_horizon_of_a_lobe_are_not_asked_and_bring_nothing():
    """An exact one: a square, clipped at the horizon."""
    n = 500
    lamp = square((2.4, 0.6, 0.5), (0, 0, 0), 0.1)
    (light,) = compile_lights([lamp], np.zeros(3), np.zeros(1, np.intp))
    toward = np.repeat(light.position.astype(np.float64), n, axis=1)
    for lobe in lobes(n, np.random.default_rng(5)):
        seen, _ = light.lobe_share(lobe, toward, dot(toward, toward))
        reached = lobe.reaches(toward, light.half_size(toward))
        assert (20 if isinstance(lobe, Lobe) else -1) < np.count_nonzero(~reached) < n - 20
        assert not seen[~reached].any()
        found = light.highlight(np.zeros((3, n), np.float32), np.repeat(UP, n, axis=1), lobe, np.zeros(n, np.float32))
        np.testing.assert_allclose(found, seen, rtol=1e-5)
        some = np.array([7, 3, 400])
        np.testing.assert_array_equal(
            lobe.take(some).untransformed(toward[:, some]), lobe.untransformed(toward)[:, some]
        )


def test_an_ellipse_that_stands_edge_on_or_around_its_beholder_fills_nothing_or_all():
    center, axis = columns((0, 0, 2)), columns((1, 0, 0))
    assert ellipse_form_factor(center, axis, columns((0, 0, 1)))[0] == 0
    assert ellipse_form_factor(center, 1e6 * axis, columns((0, 1e6, 0)))[0] == pytest.approx(1)
    # Above the middle of a circle: the squared sine of half its angle, whatever its conjugate axes.
    turned = columns((0.6, 0.8, 0)), columns((-0.8, 0.6, 0))
    assert ellipse_form_factor(center, *turned)[0] == pytest.approx(1 / 5)
