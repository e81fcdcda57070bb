# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from hybrid_addon.scene import Scene, Settings, Sphere, SunLight, Surface, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.shading.scattering import (
    fresnel_dielectric,
    half_way,
    keep_outside,
    passed,
    phong,
    reflect,
    refract,
    schlick,
)


def F(cos, eta):
    return fresnel_dielectric(np.atleast_1d(np.float64(cos)), np.atleast_1d(np.float64(eta)))


def textbook(cos, eta):
    """Fresnel's equations as in any book, in extended precision."""
    c, n = np.longdouble(cos), np.longdouble(eta)
    ct = np.sqrt(1 - (1 - c * c) / (n * n))
    rs, rp = (c - n * ct) / (c + n * ct), (n * c - ct) / (n * c + ct)
    return (rs * rs + rp * rp) / 2


@pytest.mark.parametrize("eta", [1.5, 1 / 1.5])
def test_normal_incidence_on_glass_is_four_percent_from_both_sides(eta):
    assert F(1.0, eta)[0] == pytest.approx(0.04, abs=1e-15)


@pytest.mark.parametrize("eta", [1.0, 1 + 1e-6, 1.33, 1.5, 2.4])
def test_float32_gives_the_same_to_its_own_precision(eta):
    cos = np.linspace(0, 1, 10_001).astype(np.float32)
    eta = np.full(cos.shape, eta, np.float32)
    got = fresnel_dielectric(cos, eta)
    assert got.dtype == np.float32
    np.testing.assert_allclose(got, fresnel_dielectric(cos.astype(float), eta.astype(float)), atol=1e-6)


def test_grazing_incidence_reflects_all():
    assert F(0.0, 1.5)[0] == pytest.approx(1, abs=1e-15)


def test_brewsters_angle_has_no_parallel_part():
    angle = np.arctan(1.5)
    c, ct = np.cos(angle), np.sqrt(1 - (np.sin(angle) / 1.5) ** 2)
    perpendicular = ((c - 1.5 * ct) / (c + 1.5 * ct)) ** 2
    assert F(c, 1.5)[0] == pytest.approx(perpendicular / 2, abs=1e-15)


def test_total_reflection_begins_at_the_critical_angle():
    critical = np.sqrt(1 - (1 / 1.5) ** 2)
    assert (F(critical * np.array([0.0, 0.5, 0.999, 1 - 1e-15]), 1 / 1.5) == 1).all()
    assert F(critical * 1.01, 1 / 1.5)[0] < 0.75


def test_matched_media_reflect_exactly_nothing():
    assert (F(np.linspace(0, 1, 1001), 1.0) == 0).all()


@pytest.mark.parametrize("eta", [1e-3, 0.3, 1 / 1.5, 1 - 1e-6, 1 + 1e-6, 1.0003, 1.33, 2.42, 10, 1e3])
def test_fresnel_agrees_with_the_textbook_and_stays_within_bounds(eta):
    cos = np.linspace(0, 1, 10001)
    got = F(cos, np.full_like(cos, eta))
    assert (got >= 0).all() and (got <= 1).all()
    below = 1 - cos**2 < eta**2 * (1 - 1e-9)
    np.testing.assert_allclose(got[below], textbook(cos[below], eta).astype(float), atol=1e-12)


def random_directions(n, seed=0):
    w = np.random.default_rng(seed).normal(size=(3, n))
    return w / np.sqrt((w * w).sum(0))


def test_reflection_mirrors_at_the_normal():
    wo, n = random_directions(1000), random_directions(1000, 1)
    r = reflect(wo, n)
    np.testing.assert_allclose((r * n).sum(0), (wo * n).sum(0), atol=1e-14)
    np.testing.assert_allclose(np.cross(r, n, axis=0), -np.cross(wo, n, axis=0), atol=1e-14)


@pytest.mark.parametrize("eta", [1 / 1.5, 1.0, 1.33, 2.42])
def test_refraction_obeys_snell(eta):
    wo, n = random_directions(1000), random_directions(1000, 1)
    n *= np.sign((wo * n).sum(0))
    cos = (wo * n).sum(0)
    passes = 1 - cos**2 < eta**2
    wo, n, cos = wo[:, passes], n[:, passes], cos[passes]
    wt = refract(wo, n, cos, np.full(cos.shape, eta))
    np.testing.assert_allclose((wt * wt).sum(0), 1, atol=1e-12)
    np.testing.assert_allclose(np.cross(wt, n, axis=0) * eta, -np.cross(wo, n, axis=0), atol=1e-12)
    assert ((wt * n).sum(0) < 0).all()


def test_a_reflection_below_the_surface_is_lifted_and_others_are_left_alone():
    n = np.float32([[0, 0], [0, 0], [1, 1]])
    wo = np.float32([[0.6, 0.6], [0, 0], [0.8, 0.8]])
    w = np.float32([[0.8, -0.6], [0, 0], [-0.6, 0.8]])
    lifted = keep_outside(w, n, wo)
    assert lifted[2, 0] > 0
    assert np.linalg.norm(lifted[:, 0]) == pytest.approx(1, abs=1e-6)
    np.testing.assert_array_equal(lifted[:, 1], w[:, 1])


@pytest.mark.parametrize("exponent", [0.0, 10.0, 1000.0])
@pytest.mark.parametrize("cos_o", [1.0, 0.7, 0.2, 0.02])
def test_the_highlight_never_reflects_more_than_it_receives(exponent, cos_o):
    # Integrate over half vectors, dwi = 4 (wo.h) dh, with a grid made dense at the pole by its power law.
    m = 400
    u, v = np.meshgrid((np.arange(m) + 0.5) / m, (np.arange(m) + 0.5) / m)
    cos_h = u.ravel() ** (1 / (exponent + 2))
    density = (exponent + 2) / (2 * np.pi) * cos_h ** (exponent + 1)
    s = np.sqrt(1 - cos_h**2)
    h = np.stack([s * np.cos(2 * np.pi * v.ravel()), s * np.sin(2 * np.pi * v.ravel()), cos_h])
    wo = np.array([np.sqrt(1 - cos_o**2), 0, cos_o])
    wo_h = wo @ h
    cos_i = 2 * wo_h * h[2] - wo[2]
    valid = (wo_h > 0) & (cos_i > 0)
    f32 = [np.float32(a[valid]) for a in (1 - cos_h**2, cos_i, np.full(len(cos_h), cos_o), wo_h)]
    lobe = phong(*f32, np.float32(exponent))
    albedo = (lobe * 4 * wo_h[valid] / density[valid]).sum() / len(cos_h)
    assert albedo <= 1 + 1e-3
    if exponent == 1000.0 and cos_o == 1.0:
        assert albedo > 0.99  # a narrow lobe seen from above loses nothing


def test_float32_resolves_the_sharpest_highlight():
    """Within 1e-3 of its peak (measured: 5e-4), against float64: GGX of roughness 0.05, and Blinn-Phong's power."""
    rng, n, alpha2 = np.random.default_rng(1), 100_000, 0.05**4

    def unit(a):
        return a / np.sqrt((a * a).sum(0))

    normal, wo = unit(rng.normal(size=(3, n))), unit(rng.normal(size=(3, n)))
    h = unit(normal + 3 * alpha2**0.5 * rng.random(n) * unit(rng.normal(size=(3, n))))
    wo *= np.sign((wo * h).sum(0))
    wi = 2 * (wo * h).sum(0) * h - wo
    f32 = [a[:, (wi * normal).sum(0) > 0.02].astype(np.float32) for a in (wi, wo, normal)]
    wi, wo, normal = (unit(a.astype(float)) for a in f32)
    exact = (np.cross(unit(wi + wo).T, normal.T) ** 2).sum(1)
    sin2_h, wo_h = half_way(*f32)
    peak, lobe = (alpha2 / (sin2 + alpha2 * (1 - sin2)) ** 2 for sin2 in (exact, sin2_h.astype(float)))
    np.testing.assert_allclose(lobe * alpha2, peak * alpha2, atol=1e-3)
    np.testing.assert_allclose(wo_h, (unit(wi + wo) * wo).sum(0), atol=1e-5)
    exponent = 2 / alpha2 - 2
    ones = np.ones_like(sin2_h)
    lobe, peak = (phong(sin2, ones, ones, ones, np.float32(exponent)) for sin2 in (sin2_h, 0 * ones))
    np.testing.assert_allclose(lobe / peak, np.exp(exponent / 2 * np.log1p(-exact)), atol=1e-3)


def test_schlick_has_the_right_ends():
    f0 = np.float32([[0.04], [0.5], [1.0]])
    np.testing.assert_allclose(schlick(f0, np.float32([1.0])), f0)
    np.testing.assert_allclose(schlick(f0, np.float32([0.0])), 1)


@pytest.mark.parametrize("ior", [1.1, 1.5, 2.4])
def test_a_ball_that_only_refracts_passes_all_light(build, ior):
    """No ray that enters a ball is reflected totally inside it."""
    pure = Surface(layered=True, opacity=0.0, roughness=0.0, ior=ior, interface_tint=(0, 0, 0))
    camera, white = build.camera(size=(24, 24), half=0.3), World((1, 1, 1))
    scene = Scene(camera=camera, spheres=(Sphere("ball", (0, 0, 0), 1, 0, True),), surfaces=(pure,), world=white)
    film = trace(scene, Settings(samples=4, camera_sees="RAY_TRACED", threads=1))
    inside = film.coverage == 1
    assert inside.sum() > 100
    np.testing.assert_allclose(film.radiance[inside], 1, atol=1e-5)
    assert film.rays["reflected"] == 0


def test_a_pane_that_only_refracts_dims_no_shadow(build):
    """A lamp on a floor below it, at right angles, is as bright as without it; total reflection stays black."""
    pure = Surface(layered=True, opacity=0.0, roughness=0.0, ior=1.5, interface_tint=(0, 0, 0))
    np.testing.assert_array_equal(passed(np.float32([0.04, 1.0, 0.04]), np.array([False, False, True])),
                                  np.float32([1, 0, 1 - np.float32(0.04)]))  # fmt: skip
    lamp, floor = SunLight("sun", (0, 0, 1), (3, 3, 3)), (build.box((-9, -9, -2), (9, 9, -1)), Surface())
    camera, black = build.camera(eye=(0, 0, 9), size=(8, 8), half=0.1), World((0, 0, 0))
    found = [
        trace(
            build.scene(floor, *pane, camera=camera, lights=(lamp,), world=black),
            Settings(samples=1, threads=1, camera_sees="ALL"),
        ).radiance
        for pane in ([], [(build.box((-9, -9, 1), (9, 9, 1.2)), pure)])
    ]
    assert found[0].min() > 0.1
    np.testing.assert_allclose(found[1], found[0], rtol=1e-4)
