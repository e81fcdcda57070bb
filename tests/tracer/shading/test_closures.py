# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that are sums: light is linear in their closures' weights, and what was one closure stays it."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Closure, Expression, PointLight, Settings, SunLight, Surface, Visibility, World
from hybrid_addon.tracer import trace

SETTINGS = Settings(samples=4, camera_sees="ALL", threads=1, max_depth=4, cutoff=0.0, shadow_samples=0)
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

CLOSURES = {
    "matte": Surface(base_color=(0.7, 0.3, 0.2)),
    "mirror": Surface(reflectivity=1.0, reflection_tint=(0.9, 0.8, 0.5)),
    "pane": Surface(opacity=0.0, ior=1.5),
    "clear": Surface(opacity=0.0, ior=1.0, transmission_tint=(0.5, 0.9, 1.0)),
    "glow": Surface(base_color=(0, 0, 0), emission=(0.5, 2.0, 1.0)),
    "coated": Surface(layered=True, base_color=(0.1, 0.2, 0.7), specular=(0.04,) * 3, roughness=0.4, coat=1.0),
}


def total(*parts):
    return Surface(closures=tuple(Closure(weight, surface) for weight, surface in parts))


def pane_over_floor(build, surface, shadow=False):
    """A pane above a lit floor. Without its shadow each path meets it once at most."""
    pane = build.quad([(-1, -1, 0.5), (1, -1, 0.5), (1, 1, 0.5), (-1, 1, 0.5)])
    floor = build.quad([(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)])
    wall = build.quad([(-3, 3, 0), (3, 3, 0), (3, 3, 4), (-3, 3, 4)])
    return build.scene(
        (pane, surface, {"visibility": Visibility(shadow=shadow)}),
        (floor, Surface(base_color=(0.5, 0.4, 0.3)), {"ray_traced": False}),
        (wall, Surface(base_color=(0, 0, 0), emission=(0.2, 0.5, 0.9)), {"ray_traced": False}),
        camera=build.camera((0, -4, 3), up=(0, 0, 1), size=(20, 16)),
        lights=(PointLight("point", (0.5, -1, 2), (5, 5, 5), radius=0.1), SunLight("sun", (0, 0.3, 1), (1, 1, 1))),
        world=World((0.2, 0.3, 0.4)),
    )


def film(build, surface, shadow=False, **other):
    return trace(pane_over_floor(build, surface, shadow), replace(SETTINGS, **other))


@pytest.mark.parametrize(
    "names", [("matte", "mirror"), ("pane", "glow", "coated"), ("clear", "matte"), ("mirror", "pane", "clear")]
)
def test_light_is_linear_in_the_weights(build, names):
    """A pane is met once by each path, so its light is the weighted sum of what it is with each closure alone."""
    weights = (0.3, 1.7, 0.6)[: len(names)]
    black = film(build, Surface(base_color=(0, 0, 0))).radiance
    alone = [film(build, CLOSURES[name]).radiance for name in names]
    expected = black + sum(w * (a - black) for w, a in zip(weights, alone, strict=True))
    found = film(build, total(*((w, CLOSURES[n]) for w, n in zip(weights, names, strict=True))))
    assert found.radiance == pytest.approx(expected, abs=2e-5)
    assert not any(found.invariants.values())


def test_colored_weights(build):
    colored = film(build, total((RED, CLOSURES["mirror"]), (BLUE, CLOSURES["matte"]))).radiance
    mirror = film(build, CLOSURES["mirror"]).radiance
    pane = np.abs(mirror - film(build, Surface(base_color=(0, 0, 0))).radiance).max(axis=2) > 0.05
    assert colored[pane][:, 0] == pytest.approx(mirror[pane][:, 0], abs=1e-5)


def test_a_sum_of_one_is_that_one_bit_by_bit(build):
    for surface in CLOSURES.values():
        alone, summed = film(build, surface), film(build, total((1.0, surface)))
        assert (alone.radiance == summed.radiance).all()
        with_nothing = film(build, total((0.0, CLOSURES["mirror"]), (1.0, surface)))
        assert with_nothing.radiance == pytest.approx(alone.radiance, abs=1e-6)


def test_a_weight_that_is_no_number_is_nothing(build):
    nan = Expression("divide", (Expression("attribute", (), "backfacing"), float("nan")))
    found = film(build, total((nan, CLOSURES["mirror"]), (1.0, CLOSURES["matte"])))
    assert np.isfinite(found.radiance).all()
    assert found.radiance == pytest.approx(film(build, CLOSURES["matte"]).radiance, abs=1e-6)


def test_weights_vary(build):
    """Half of a pane mirrors: each half is as it is alone."""
    place = Expression("channel", (Expression("attribute", (), "position"),), 0)
    left = Expression("less", (place, 0.0))
    right = Expression("subtract", (1.0, left))
    both = film(build, total((left, CLOSURES["mirror"]), (right, CLOSURES["matte"]))).radiance
    mirror, matte = film(build, CLOSURES["mirror"]).radiance, film(build, CLOSURES["matte"]).radiance
    off_left = np.abs(both - mirror).max(axis=2)[:, :9]
    off_right = np.abs(both - matte).max(axis=2)[:, 11:]
    pane = np.abs(mirror - matte).max(axis=2) > 0.02
    assert np.count_nonzero(off_left[pane[:, :9]] > 1e-3) <= 12  # the floor sees the other half's shadow and light
    assert np.count_nonzero(off_right[pane[:, 11:]] > 1e-3) <= 12


def test_glasses_of_a_solid_are_not_mixed_on_the_way(build):
    """A ball of two glasses shows the mean of both balls."""

    def ball(surface):
        sky = build.quad([(-4, -4, -3), (4, -4, -3), (4, 4, -3), (-4, 4, -3)])
        return build.scene(
            (build.icosphere(3, smooth=True), surface),
            (sky, build.emitter(1, 0.5, 0.1)),
            camera=build.camera(size=(24, 24)),
            world=World((0.2, 0.3, 0.4)),
        )

    thin, dense = Surface(opacity=0.0, ior=1.2), Surface(opacity=0.0, ior=1.8)
    deep = replace(SETTINGS, max_depth=12)
    pictures = [trace(ball(s), deep) for s in (thin, dense, total((0.5, thin), (0.5, dense)))]
    one, other, both = (p.radiance for p in pictures)
    assert both == pytest.approx((one + other) / 2, abs=2e-3)
    assert not any(pictures[2].invariants.values())


def test_three_colored_refractions_keep_their_light(build):
    """Dispersion as artists build it: red, green and blue glass of three indices, added."""
    glass = [Surface(opacity=0.0, ior=1.5, transmission_tint=c, interface_tint=c) for c in (RED, GREEN, BLUE)]
    white = film(build, Surface(opacity=0.0, ior=1.5)).radiance
    assert film(build, total(*((1.0, g) for g in glass))).radiance == pytest.approx(white, abs=1e-5)


def test_many_closures_cost_no_more_than_some(build):
    """64 mirrors of random colours: drawn, their mean is right, and what was left out is in the bound."""
    rng = np.random.default_rng(3)
    colors = rng.random((64, 3))
    many = total(*((1 / 64, Surface(reflectivity=1.0, reflection_tint=tuple(c))) for c in colors.tolist()))
    one = Surface(reflectivity=1.0, reflection_tint=tuple(colors.mean(axis=0).tolist()))
    found, expected = film(build, many, samples=64), film(build, one, samples=64)
    assert found.rays["reflected"] <= 16 * expected.rays["reflected"]
    assert found.radiance.mean(axis=(0, 1)) == pytest.approx(expected.radiance.mean(axis=(0, 1)), rel=0.01)


def test_shadows_through_a_sum(build):
    """What a shadow ray keeps is the weighted sum of what its closures let pass."""
    dark = total((0.5, Surface(opacity=0.0, ior=1.0, transmission_tint=RED)), (0.25, Surface(opacity=0.0, ior=1.0)))
    plain = Surface(opacity=0.0, ior=1.0, transmission_tint=(0.75, 0.25, 0.25))
    assert film(build, dark, True).radiance == pytest.approx(film(build, plain, True).radiance, abs=1e-5)


def test_an_ior_that_varies_by_nothing_is_the_constant(build):
    """And where it is 1 the pane is not there."""
    of_one = Expression("add", (Expression("attribute", (), "backfacing"), 1.5))
    for layered in (False, True):
        constant = Surface(layered=layered, opacity=0.0, ior=1.5)
        found = film(build, replace(constant, ior=of_one))
        assert found.radiance == pytest.approx(film(build, constant).radiance, abs=1e-5)
    gone = Expression("subtract", (of_one, 0.5))
    clear = film(build, Surface(opacity=0.0, ior=1.0)).radiance
    assert film(build, Surface(opacity=0.0, ior=gone)).radiance == pytest.approx(clear, abs=1e-5)


def test_a_sum_within_a_sum_is_refused(build):
    inner = total((1.0, CLOSURES["matte"]))
    with pytest.raises(ValueError, match="is a sum of closures itself"):
        film(build, total((1.0, inner)))
    with pytest.raises(ValueError, match="must not be negative"):
        film(build, total((-1.0, CLOSURES["matte"])))
