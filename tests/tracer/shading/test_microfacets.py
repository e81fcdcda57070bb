# SPDX-License-Identifier: GPL-3.0-or-later
"""Rough reflection and refraction by microfacets."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Plane, PointLight, Scene, Settings, Sphere, Surface, Texture, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.constants import MICROFACET_TRIES
from hybrid_addon.tracer.core.sampler import Sampler, pixel_keys
from hybrid_addon.tracer.materials.principled import albedos, masking
from hybrid_addon.tracer.shading.microfacets import _microfacets, visible_normal
from hybrid_addon.tracer.shading.scattering import reflect
from tests.tracer.unpruned import without

SETTINGS = Settings(samples=16, camera_sees="RAY_TRACED", threads=1, rough_samples=4, max_depth=12)
WHITE = World((1, 1, 1))


def metal(roughness, **other):
    return Surface(
        layered=True, reflectivity=1.0, reflection_tint=(1, 1, 1), base_color=(1, 1, 1), roughness=roughness, **other
    )


def glass(roughness):
    return Surface(layered=True, opacity=0.0, ior=1.5, roughness=roughness)


def ball(build, surface, world=WHITE):
    camera = build.camera(size=(32, 32), half=0.25)
    return Scene(camera=camera, spheres=(Sphere("ball", (0, 0, 0), 1, 0, True),), surfaces=(surface,), world=world)


def half_bright():
    """A world that is white on the side of +X, black on the other."""
    pixels = np.ones((64, 128, 4), np.float32)
    pixels[:, :32, :3] = pixels[:, 96:, :3] = 0
    return World((1, 1, 1), Texture("half", pixels, interpolation="CLOSEST"))


# ------------------------------------------------------------------------------------------------ microfacets


@pytest.mark.parametrize(("cosine", "alpha"), [(1.0, 0.1), (0.7, 0.25), (0.2, 0.5), (0.5, 1.0)])
def test_visible_normals_are_distributed_as_ggx_says(cosine, alpha):
    """Moments of a sum over all microfacets, int f(h) D(h) max(0, wo.h) dh / int D max(0, wo.h) dh."""
    n = 1 << 16
    rng = np.random.default_rng(1)
    wo = np.array([np.sqrt(1 - cosine**2), 0, cosine], np.float32)[:, None]
    up = np.array([0, 0, 1], np.float32)[:, None]
    square = tuple(rng.random((2, n), np.float32))
    h = visible_normal(np.repeat(wo, n, 1), np.repeat(up, n, 1), np.full(n, alpha, np.float32), square).astype(float)
    np.testing.assert_allclose(np.sqrt((h * h).sum(0)), 1, atol=1e-5)
    cos = (np.arange(2000) + 0.5) / 2000
    phi = (np.arange(256) + 0.5) / 256 * 2 * np.pi
    sin = np.sqrt(1 - cos**2)[:, None]
    d = np.stack([sin * np.cos(phi), sin * np.sin(phi), np.repeat(cos[:, None], 256, 1)])
    t = cos**2 * (alpha**2 - 1) + 1
    weight = (alpha**2 / t**2)[:, None] * np.maximum((d * wo[:, :, None]).sum(0), 0)
    for f in (lambda v: v[2], lambda v: v[0], lambda v: v[0] * v[0], lambda v: v[1] * v[1]):
        assert f(h).mean() == pytest.approx((f(d) * weight).sum() / weight.sum(), abs=0.006)


def test_what_passes_other_microfacets_is_the_albedo_of_the_lobe():
    n, alpha = 1 << 14, 0.25
    u, v = (np.indices((128, 128)).reshape(2, -1) + 0.5) / 128
    wo = np.repeat(np.array([[0.8], [0], [0.6]], np.float32), n, 1)
    up = np.repeat(np.array([[0], [0], [1]], np.float32), n, 1)
    square = (u.astype(np.float32), v.astype(np.float32))
    wi = reflect(wo, visible_normal(wo, up, np.full(n, alpha, np.float32), square))
    passed = np.where(wi[2] > 0, masking(np.maximum(wi[2], 1e-6), np.float32(alpha)), 0).mean()
    assert passed == pytest.approx(albedos(np.array([0.6]), np.array([0.5]))[:2].sum(), abs=0.01)


@pytest.mark.parametrize("drawn_again", [False, True])
@pytest.mark.parametrize(("cosine", "alpha"), [(0.9, 0.25), (0.4, 0.5), (0.3, 0.9)])
def test_a_lobe_is_distributed_as_its_density_says(cosine, alpha, drawn_again):
    """Chi-square of the directions that leave, in cells of cosine and angle.

    The density is D(h) G1(wo) max(0, wo.h) / (wo.n) / (4 wo.h), and times G1(wi), made 1 in all, where what other
    microfacets catch is drawn again, four times at most.
    """
    n, tries = 1 << 17, MICROFACET_TRIES if drawn_again else 1
    wo = np.array([np.sqrt(1 - cosine**2), 0, cosine], np.float32)[:, None]
    up = np.array([0, 0, 1], np.float32)[:, None]
    sampler = Sampler(pixel_keys(np.arange(n), np.zeros(n, int), 0), 0, 1)
    draws = sampler.draws(np.arange(n), np.zeros((1, n), np.uint32))
    ways, ups = np.repeat(wo, n, 1), np.repeat(up, n, 1)
    h = _microfacets(ways, ups, np.full(n, alpha, np.float32), np.full(n, drawn_again), draws, None)
    wi = reflect(ways, h).astype(float)

    def cell(w):
        """One of 12 x 16 cells of the upper half, and one for all below."""
        z, turn = np.clip(w[2], -1, 1 - 1e-9), np.arctan2(w[1], w[0]) / (2 * np.pi) % 1
        return np.where(
            z <= 0, 192, np.minimum(np.maximum(z, 0) * 12, 11).astype(int) * 16 + (turn * 16).astype(int) % 16
        )

    found = np.bincount(cell(wi), minlength=193)
    # The density over directions wi, on a fine grid whose steps divide the cells; what is below is the rest.
    z, turn = (np.arange(12 * 80) + 0.5) / (12 * 80), (np.arange(16 * 80) + 0.5) / (16 * 80) * 2 * np.pi
    sin = np.sqrt(1 - z**2)[:, None]
    fine = np.stack([sin * np.cos(turn), sin * np.sin(turn), np.repeat(z[:, None], len(turn), 1)]).reshape(3, -1)
    half = fine + wo
    half /= np.sqrt((half * half).sum(0))
    t = half[2] ** 2 * (alpha**2 - 1) + 1
    g1 = masking(np.array([cosine]), alpha)[0]
    density = alpha**2 / (np.pi * t * t) * g1 / cosine / 4  # wo.h cancels
    share = density * 2 * np.pi / fine.shape[1]
    passes = share * masking(fine[2], alpha)
    caught = 1 - passes.sum()
    # All but the last try keep what passes; the last keeps everything.
    first = passes * sum(caught**k for k in range(tries - 1))
    expected = np.bincount(cell(fine), first + share * caught ** (tries - 1), minlength=193)
    expected[192] = 1 - expected[:192].sum()
    expected *= n
    used = expected > 20
    chi2 = ((found - expected)[used] ** 2 / expected[used]).sum()
    freedom = np.count_nonzero(used) - 1
    assert freedom > 30
    assert chi2 < freedom + 5 * np.sqrt(2 * freedom), (chi2, freedom)


# ------------------------------------------------------------------------------------------------ energy


@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("kind", [metal, glass])
def test_a_white_furnace_stays_white(build, kind, roughness):
    """Exactly, but for what the depth cuts, which is in the residual."""
    film = trace(ball(build, kind(roughness)), SETTINGS)
    inside = film.coverage == 1
    np.testing.assert_allclose(film.radiance[inside] + film.residual[inside][:, None], 1, atol=2e-5)
    assert film.residual[inside].mean() < (0.03 if kind is glass else 1e-6)
    assert not any(film.invariants.values())


def test_a_coat_over_rough_metal_keeps_all_light_in_the_mean(build):
    surface = metal(0.5, coat=1.0, coat_roughness=0.1)
    rough, sharp = (trace(ball(build, surface), replace(SETTINGS, rough_samples=n)) for n in (8, 0))
    inside = rough.coverage == 1
    assert rough.radiance[inside].mean() == pytest.approx(sharp.radiance[inside].mean(), rel=0.005)


def test_each_lobe_has_its_own_color_and_width(build):
    """A narrow, white coat over wide, red metal under a spot in the zenith: what is not red is the coat's image."""
    pixels = np.zeros((64, 128, 4), np.float32)
    pixels[60:, :, :3] = 1  # 11 degrees around it
    surface = replace(metal(1.0, coat=1.0, coat_roughness=0.1), reflection_tint=(1, 0, 0), edge_tint=(0, 0, 0))
    floor, camera = Plane("floor", (0, 0, 0), (0, 0, 1), 0, True), build.camera(eye=(0, 0, 5), size=(8, 8), half=0.01)
    world = World((1, 1, 1), Texture("spot", pixels))
    plane = Scene(camera=camera, planes=(floor,), surfaces=(surface,), world=world)
    red, green, _ = trace(plane, replace(SETTINGS, samples=256)).radiance.mean(axis=(0, 1))
    assert green == pytest.approx(0.04, rel=0.1)  # F0 of IOR 1.5
    assert green < red < 3 * green


def test_a_lamp_lights_a_rough_coat_beside_what_has_none(build):
    """As it lights the coat alone: two balls in one wave of rays, of which one is coated."""
    coated = Surface(layered=True, base_color=(0.1, 0.2, 0.6), coat=1.0, coat_roughness=0.4)
    lamp = PointLight("lamp", (0, 3, 5), (40, 40, 40))
    balls = tuple(Sphere(f"{x}", (x, 0, 0), 0.4, surface, True) for surface, x in enumerate((-0.5, 0.5)))
    scene = Scene(camera=build.camera(size=(32, 32), half=0.25), spheres=balls, lights=(lamp,), world=World((0, 0, 0)),
                  surfaces=(coated, replace(coated, coat=0.0)))  # fmt: skip
    both = trace(scene, SETTINGS).radiance
    alone = trace(replace(scene, spheres=balls[:1]), SETTINGS).radiance
    assert alone.max() > 0
    np.testing.assert_allclose(both[:, :14], alone[:, :14], rtol=1e-4)


# ------------------------------------------------------------------------------------------------ pictures


def test_a_rough_mirror_blurs_the_edge_of_the_world(build):
    """Straight down onto a plane: a lobe of alpha sees a half white world; all of it, both halves, is half."""
    camera = build.camera(eye=(0, 0, 5), size=(8, 8), half=0.01)
    found = {}
    for roughness in (0.0, 0.3, 0.6):
        plane = Scene(
            camera=camera, planes=(Plane("floor", (0, 0, 0), (0, 0, 1), 0, True),), surfaces=(metal(roughness),),
            world=half_bright(),
        )  # fmt: skip
        found[roughness] = trace(plane, replace(SETTINGS, samples=64)).radiance[..., 0]
    assert found[0.0].std() > 0.4
    for roughness in (0.3, 0.6):
        assert found[roughness].mean() == pytest.approx(0.5, abs=0.02)
        assert found[roughness].std() < 0.15


def test_glass_that_is_rough_blurs_what_is_behind_it(build):
    seen = [trace(ball(build, glass(r), half_bright()), SETTINGS).radiance[10:22, 10:22, 0] for r in (0.0, 0.4)]
    between = [((light > 0.2) & (light < 0.8)).mean() for light in seen]
    assert between[1] > 2 * between[0]


def test_more_rays_have_the_same_mean_and_less_noise(build):
    few, many, most = (
        trace(ball(build, metal(0.4), half_bright()), replace(SETTINGS, samples=4, rough_samples=n)) for n in (1, 4, 64)
    )
    inside = few.coverage == 1
    errors = [np.sqrt(((f.radiance - most.radiance)[inside] ** 2).mean()) for f in (few, many)]
    assert errors[1] < 0.6 * errors[0]
    assert few.radiance[inside].mean() == pytest.approx(most.radiance[inside].mean(), abs=0.01)
    assert many.rays["reflected"] == 4 * few.rays["reflected"]


def test_chunks_and_threads_change_no_bit(build):
    scene = ball(build, metal(0.4, coat=0.5, coat_roughness=0.1), half_bright())
    one = trace(scene, replace(SETTINGS, samples=4))
    other = trace(scene, replace(SETTINGS, samples=4, threads=3, chunk=333))
    np.testing.assert_array_equal(one.radiance, other.radiance)


def test_smooth_surfaces_are_not_touched(build):
    scene = ball(build, metal(0.0), half_bright())
    on, off = (trace(scene, replace(SETTINGS, rough_samples=n)) for n in (4, 0))
    with without("roughness"):
        cache = trace(scene, SETTINGS)
    np.testing.assert_array_equal(on.radiance, off.radiance)
    np.testing.assert_array_equal(cache.radiance, off.radiance)


def test_custom_surfaces_stay_mirrors(build):
    scene = ball(build, Surface(reflectivity=1.0, roughness=0.5), half_bright())
    on, off = (trace(scene, replace(SETTINGS, rough_samples=n)) for n in (4, 0))
    np.testing.assert_array_equal(on.radiance, off.radiance)
