# SPDX-License-Identifier: GPL-3.0-or-later
"""Brushed surfaces: the distribution of their microfacets, and their highlights against the closed form."""

import numpy as np
import pytest

from hybrid_addon.scene import Expression, PointLight, Settings, Surface, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.vectors import dot, normalize
from hybrid_addon.tracer.materials.principled import correlated_albedo
from hybrid_addon.tracer.shading.ltc import BrushedLobe
from hybrid_addon.tracer.shading.microfacets import brushed_share, visible_normal


def alike(vector, n):
    return np.repeat(np.array(vector, np.float32).reshape(3, 1), n, axis=1)


def test_slopes_are_spread_along_the_tangent_and_across_as_wide_as_each_alpha():
    """Half of GGX's slopes along an axis lie within alpha / sqrt(3)."""
    n = 200_000
    rng = np.random.default_rng(1)
    square = rng.random(n, np.float32), rng.random(n, np.float32)
    tangent = alike((0.6, 0.8, 0), n)
    ways = tangent, np.full(n, 0.5, np.float32)
    h = visible_normal(alike((0, 0, 1), n), alike((0, 0, 1), n), np.full(n, 0.1, np.float32), square, ways)
    along, across = dot(h, tangent) / h[2], (h[1] * 0.6 - h[0] * 0.8) / h[2]
    assert np.median(np.abs(along)) == pytest.approx(0.2 / 3**0.5, rel=0.02)
    assert np.median(np.abs(across)) == pytest.approx(0.05 / 3**0.5, rel=0.02)


def ggx(wo, wi, along, across):
    """D G2 / (4 cos wo) of a surface in the plane z = 0 brushed along x, in float64; G2 with correlated heights."""
    h = normalize(wo + wi)
    slopes = (h[0] / along) ** 2 + (h[1] / across) ** 2 + h[2] ** 2
    d = 1 / (np.pi * along * across * slopes**2)

    def hidden(w):
        return (np.sqrt(1 + ((along * w[0]) ** 2 + (across * w[1]) ** 2) / w[2] ** 2) - 1) / 2

    return d / (1 + hidden(wo) + hidden(wi)) / (4 * wo[2])


@pytest.mark.parametrize(("roughness", "stretch"), [(0.3, 0.5), (0.5, 0.316), (0.3, 2.5), (0.4, 1.0)])
def test_a_lobe_is_the_closed_form_where_the_lamp_is(roughness, stretch):
    n = 500
    rng = np.random.default_rng(2)
    wo, wi = (normalize(np.stack([*rng.normal(size=(2, n)), rng.uniform(0.2, 2, n)])) for _ in range(2))
    rough = np.full(n, roughness, np.float32)
    ways = alike((1, 0, 0), n), np.full(n, stretch, np.float32)
    lobe = BrushedLobe(wo.astype(np.float32), alike((0, 0, 1), n), rough, ways).towards(wi.astype(np.float32))
    inside = lobe.untransformed(wi)
    volume = np.abs(dot(lobe.rows[0], np.cross(lobe.rows[1], lobe.rows[2], axis=0)))
    length2 = dot(inside, inside)
    density = inside[2] / np.sqrt(length2) / np.pi * volume / length2**1.5
    right = ggx(wo, wi, roughness**2 / stretch, roughness**2 * stretch) / correlated_albedo(wo[2], rough)
    assert density * lobe.weight == pytest.approx(right, rel=2e-3)
    assert (inside[2] > 0).all()


def test_grooves_reflect_no_more_than_round_facets_and_as_much_if_they_are_round():
    n = 400
    wo = normalize(np.stack([*np.random.default_rng(3).normal(size=(2, n)), np.linspace(0.05, 2, n)]))
    wo, rough = wo.astype(np.float32), np.full(n, 0.6, np.float32)
    ways = alike((1, 0, 0), n)
    round_ = brushed_share(wo, alike((0, 0, 1), n), rough, (ways, np.ones(n, np.float32)))
    grooved = brushed_share(wo, alike((0, 0, 1), n), rough, (ways, np.full(n, 0.316, np.float32)))
    assert round_.min() > 0.94 and round_.mean() > 0.98
    assert grooved.max() <= 1 and grooved.mean() < round_.mean() - 0.02


def seen(build, **fields):
    """A brushed floor from above, a lamp above it off to the side of +x and +y."""
    surface = Surface(layered=True, reflectivity=1.0, roughness=0.4, **fields)
    floor = build.quad([(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)])
    lamp = PointLight("lamp", (0, 0, 3), (50, 50, 50), radius=0.05)
    cam = build.camera(eye=(0, 0, 6), size=(33, 33), half=0.4)
    scene = build.scene((floor, surface), camera=cam, lights=(lamp,), world=World((0, 0, 0)))
    return trace(scene, Settings(samples=1, filter_radius=0.0, camera_sees="ALL")).radiance[..., 0]


def test_a_highlight_is_longer_along_the_tangent(build):
    tangent = Expression("add", (Expression("multiply", (Expression("attribute", (), "normal"), 0.0)), (1.0, 0, 0)))
    picture = seen(build, stretch=0.4, tangent=tangent)
    along, across = picture[16, 30], picture[30, 16]
    assert along > 2 * across
    turned = seen(build, stretch=2.5, tangent=tangent)
    assert turned[30, 16] == pytest.approx(along, rel=0.01)


def test_a_stretch_of_1_is_as_bright_as_no_tangent(build):
    tangent = Expression("add", (Expression("multiply", (Expression("attribute", (), "normal"), 0.0)), (1.0, 0, 0)))
    assert seen(build, stretch=1.0, tangent=tangent).sum() == pytest.approx(seen(build).sum(), rel=0.1)


def test_a_coat_on_grooves_reflects_what_it_does_on_round_facets(build):
    tangent = Expression("add", (Expression("multiply", (Expression("attribute", (), "normal"), 0.0)), (1.0, 0, 0)))
    floor = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])
    cam = build.camera(eye=(0, -6, 3), up=(0, 0, 1), size=(4, 4), half=0.1)

    def seen(stretch, **fields):
        surface = Surface(layered=True, reflectivity=1.0, roughness=0.6, stretch=stretch, tangent=tangent, **fields)
        scene = build.scene((floor, surface), camera=cam, world=World((1, 1, 1)))
        return trace(scene, Settings(samples=16, filter_radius=0.0, camera_sees="ALL")).radiance.mean()

    coat = {"coat": 1.0, "coat_roughness": 0.0, "coat_ior": 2.0}
    black = {"reflection_tint": (0.0, 0.0, 0.0), **coat}
    assert seen(3.16, **black) == pytest.approx(seen(1.0, **black), rel=1e-5)
    # Of a metal below the coat grooves keep their share of what the coat leaves, and no more is lost.
    lost, coated = 1 - seen(3.16) / seen(1.0), seen(1.0, **coat)
    assert lost > 0.01
    below = 1 - seen(1.0, **black)
    assert coated - seen(3.16, **coat) == pytest.approx(lost * below, rel=0.1)
