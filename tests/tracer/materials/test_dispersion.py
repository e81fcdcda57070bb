# SPDX-License-Identifier: GPL-3.0-or-later
"""Dispersion: the law of the index, and pictures against those of single wavelengths."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Closure, Expression, Settings, Surface, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.materials.dispersion import BANDS, ior_at, spectral_ior

SETTINGS = Settings(samples=4, camera_sees="ALL", threads=1, max_depth=16, cutoff=0.0)
LINES = {"F": 486.13, "d": 587.56, "C": 656.27}
"""Fraunhofer's lines in nm."""


def glass(dispersion, **other):
    return Surface(opacity=0.0, ior=1.6, dispersion=dispersion, **other)


def prism_scene(build, surface):
    """A wedge before a striped wall: what is seen through it moves with the index."""
    wedge = build.mesh(
        [(-1, -1, 0), (1, -1, 0), (-1, 1, 0), (1, 1, 0), (-1, -1, 0.9), (-1, 1, 0.9)],
        [(0, 2, 1), (1, 2, 3), (0, 1, 4), (2, 5, 3), (0, 4, 2), (2, 4, 5), (1, 3, 4), (3, 5, 4)],
    )
    stripes = [
        build.quad([(x, -6, -2), (x + 0.4, -6, -2), (x + 0.4, 6, -2), (x, 6, -2)]) for x in np.arange(-6, 6, 0.8)
    ]
    return build.scene(
        (wedge, surface),
        *((stripe, build.emitter(1, 1, 1)) for stripe in stripes),
        camera=build.camera((0, 0, 6), size=(24, 8), half=0.15),
        world=World((0, 0, 0)),
    )


def test_the_index_follows_abbe():
    n, dispersion = np.array([1.5168, 2.417, 1.333]), np.array([20 / 64.17, 20 / 55.3, 20 / 55.7])
    at = {line: ior_at(n, dispersion, np.full(3, wavelength)) for line, wavelength in LINES.items()}
    assert at["d"] == pytest.approx(n, abs=1e-4)
    assert (at["d"] - 1) / (at["F"] - at["C"]) == pytest.approx(20 / dispersion, rel=2e-3)


def test_wavelengths_spread_over_their_bands():
    chance = (np.arange(20000) + 0.5) / 20000
    for band, (center, width) in enumerate(BANDS):
        # n_d - 1 = 20 and dispersion 1 make the index a number that tells the wavelength.
        found = spectral_ior(np.full(len(chance), 21.0), np.ones(len(chance)), np.full(len(chance), band), chance)
        wavelength = np.sqrt(523655 / (found - 21 + 1.5168))
        assert wavelength.mean() == pytest.approx(center, abs=0.1)
        assert wavelength.std() == pytest.approx(width / 6**0.5, rel=1e-3)  # of a tent
        assert wavelength.min() > center - width and wavelength.max() < center + width


def test_a_white_world_stays_white(build):
    ball = build.scene((build.icosphere(3, smooth=True), glass(2.0)), world=World((1, 1, 1)))
    film = trace(ball, replace(SETTINGS, max_depth=64))
    assert film.radiance == pytest.approx(1.0, abs=2e-3)
    assert np.ptp(film.radiance, axis=2).max() < 2e-3  # of every sample, so there is no colour noise


def test_none_is_none_bit_by_bit(build):
    plain = trace(prism_scene(build, Surface(opacity=0.0, ior=1.6)), SETTINGS)
    assert (trace(prism_scene(build, glass(0.0)), SETTINGS).radiance == plain.radiance).all()


MATTE = Closure(0.6, Surface(base_color=(0.5, 0.5, 0.5)))
ONE = Expression("add", (Expression("multiply", (Expression("attribute", (), "backfacing"), 0.0)), 1.0))
"""A weight that is worked out at each hit."""


@pytest.mark.once
@pytest.mark.parametrize("beside", [(), (MATTE,)], ids=["alone", "in a sum"])
def test_each_channel_is_the_mean_of_its_wavelengths(build, beside):
    """Against pictures of single wavelengths, each traced with a plain IOR."""

    def summed(surface, weight=0.4):
        return Surface(closures=(Closure(weight, surface), *beside))

    chance = (np.arange(12) + 0.5) / 12
    expected = np.zeros((8, 24, 3))
    for band in range(3):
        indices = spectral_ior(np.full(12, 1.6), np.full(12, 1.5), np.full(12, band), chance)
        for seed, ior in enumerate(indices.tolist()):
            plain = replace(glass(0.0), ior=ior)
            scene = prism_scene(build, summed(plain) if beside else plain)
            picture = trace(scene, replace(SETTINGS, samples=16, seed=seed)).radiance
            expected[..., band] += picture[..., band] / 12
    forms = [summed(glass(1.5))] if beside else [glass(1.5), summed(glass(1.5), ONE)]
    for dispersive in forms:
        found = trace(prism_scene(build, dispersive), replace(SETTINGS, samples=144)).radiance
        for band in range(3):
            off = found[..., band] - expected[..., band]
            assert np.abs(off).mean() < 0.05 * found.mean(), band
            assert abs(off.mean()) < 0.01 * found.mean(), band
        assert np.ptp(found, axis=2).max() > 0.02  # it splits light at all


def test_a_ray_keeps_its_wavelength(build):
    """After one split a ray is of one channel: three times as many rays at most, not nine and more."""
    plain, split = (trace(prism_scene(build, glass(d)), SETTINGS) for d in (0.0, 1.0))
    assert split.rays["refracted"] <= 3.2 * plain.rays["refracted"]


def test_bad_values_are_refused(build):
    for value in (-1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="dispersion must be finite and not negative"):
            trace(prism_scene(build, glass(value)), SETTINGS)
