# SPDX-License-Identifier: GPL-3.0-or-later
"""Thin films: Airy's formula, limits that need no film, and energy."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.procedural.fresnel import fresnel_dielectric
from hybrid_addon.procedural.spectra import XYZ_TO_REC709, observer
from hybrid_addon.scene import Expression, Surface, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.materials import film
from hybrid_addon.tracer.materials.columns import ROWS
from hybrid_addon.tracer.materials.fields import fields_of
from hybrid_addon.tracer.materials.principled import layered_columns

COSINES = np.linspace(0.05, 1, 20)[None]


def number(value):
    return np.array([[float(value)]])


def by_matrices(cos, thickness, index, base, wavelength):
    """Reflectance of one layer by its characteristic matrix (Born and Wolf, Principles of Optics, 1.6), for each
    wavelength; not the way of the code under test."""
    sin2 = 1 - cos * cos
    inside, below = np.sqrt(1 - sin2 / index**2 + 0j), np.sqrt(1 - sin2 / base**2 + 0j)
    phase = 2 * np.pi * index * thickness * inside / wavelength
    total = 0
    for first, layer, last in ((cos, index * inside, base * below), (1 / cos, index / inside, base / below)):
        m00, m01, m10 = np.cos(phase), -1j * np.sin(phase) / layer, -1j * np.sin(phase) * layer
        b, c = m00 + m01 * last, m10 + m00 * last
        total = total + 0.5 * np.abs((first * b - c) / (first * b + c)) ** 2
    return total


@pytest.mark.parametrize("base", [1.0, 1.5, 2.4, 0.2 + 3j, 2.8 + 3.9j])
@pytest.mark.parametrize("index", [1.33, 1.6, 2.2])
@pytest.mark.parametrize("thickness", [50.0, 300.0, 700.0])
def test_a_colour_is_the_mean_over_what_its_receptors_see(base, index, thickness):
    wavelength = np.linspace(380, 780, 2001)
    weights = XYZ_TO_REC709 @ (observer(wavelength) * film.daylight(wavelength))
    weights /= weights.sum(axis=1, keepdims=True)
    for cos in (1.0, 0.6, 0.2):
        right = weights @ by_matrices(cos, thickness, index, base, wavelength)
        found = film.film_reflectance(
            number(cos), number(thickness), number(index), number(np.real(base)), number(np.imag(base))
        )
        assert found[:, 0] == pytest.approx(np.clip(right, 0, 1), abs=0.012)


def test_a_quarter_wavelength_of_the_roots_index_reflects_nothing_of_it():
    base, wavelength = 1.69, 550.0
    index = base**0.5
    pairs, path = film.amplitudes(number(1), number(wavelength / (4 * index)), number(index), number(base))
    turn = np.exp(2j * np.pi * path / wavelength)
    for upper, lower in pairs:
        assert abs((upper + lower * turn) / (1 + upper * lower * turn)) < 1e-6
        assert abs((upper + lower) / (1 + upper * lower)) == pytest.approx((base - 1) / (base + 1), abs=1e-6)


@pytest.mark.parametrize("index", [1.0, 1.5])
@pytest.mark.parametrize("thickness", [1.0, 400.0, 1e6])
def test_a_film_of_the_index_of_one_of_its_sides_is_not_there(index, thickness):
    found = film.film_reflectance(COSINES, number(thickness), number(index), number(1.5))
    right = fresnel_dielectric(COSINES[0], np.full(20, 1.5))
    assert found == pytest.approx(np.broadcast_to(right, (3, 20)), abs=2e-5)


def test_a_thick_film_is_white_and_reflects_as_a_pane():
    upper = film.film_reflectance(COSINES, number(1e6), number(1.33), number(1.0))
    once = np.stack(
        [np.abs(pair[0]) ** 2 for pair in film.amplitudes(COSINES, number(0), number(1.33), number(1.0))[0]]
    )
    assert upper == pytest.approx(np.broadcast_to((2 * once / (1 + once)).mean(0), (3, 20)), abs=1e-6)


def test_films_of_all_thicknesses_reflect_a_share():
    rng = np.random.default_rng(1)
    n = 20000
    cos, thickness = rng.random((1, n)), 10 ** rng.uniform(-3, 7, (1, n))
    index, base, k = 10 ** rng.uniform(-1, 1, (1, n)), 10 ** rng.uniform(-1, 1, (3, n)), rng.random((3, n)) * 5
    found = film.film_reflectance(cos, thickness, index, base, k * (rng.random((1, n)) < 0.5))
    assert np.isfinite(found).all() and found.min() >= 0 and found.max() <= 1


def test_both_sides_reflect_alike():
    """At angles that belong together by Snell's law, of glass in air."""
    eta, n = 1.5, 20
    cos_out = COSINES[0]
    cos_in = np.sqrt(1 - (1 - cos_out**2) / eta**2)
    nm, index, ior = np.full(n, 350, np.float32), np.full(n, 1.9, np.float32), np.full(n, eta)
    bare = fresnel_dielectric(cos_out, ior).astype(np.float32)
    outside = film.film_fresnel(bare, cos_out, ior, np.ones(n, bool), ior, nm, index)
    inside = film.film_fresnel(bare, cos_in, 1 / ior, np.zeros(n, bool), ior, nm, index)
    assert inside == pytest.approx(outside, abs=1e-5)
    assert np.ptp(outside, axis=0).max() > 0.05  # it has colours


def columns(**fields):
    surface = Surface(layered=True, roughness=0.2, specular=(0.04,) * 3, **fields)
    found = layered_columns(fields_of(surface), np.linspace(0, 1, 9))
    found[ROWS["film"].start : ROWS["film_ior"].stop] = 0
    return found


@pytest.mark.parametrize("body", [{}, {"reflectivity": 1.0, "edge_tint": (1.0, 0.5, 0.5)}, {"opacity": 0.0}])
def test_a_film_of_0_nm_changes_no_bit_and_fades_in(body):
    plain, none = columns(**body), columns(**body, film=0.0, film_ior=2.0)
    assert np.array_equal(plain, none)
    faint, full = (columns(**body, film=nm, film_ior=2.0) for nm in (1e-3, 50.0))
    assert np.abs(faint - plain).max() < 1e-4
    assert np.isfinite(full).all() and (np.abs(full - plain).max() > 0.01 or "opacity" in body)


@pytest.mark.parametrize(
    "surface",
    [
        Surface(layered=True, opacity=0.0, ior=1.5, film=400.0, film_ior=1.9, roughness=0.0),
        Surface(layered=True, opacity=0.0, ior=1 + 2.0**-20, film=500.0, film_ior=1.33, roughness=0.0),
        Surface(layered=True, opacity=0.0, ior=1.5, film=1e6, film_ior=1.33, roughness=0.0),
    ],
)
def test_films_lose_no_light(build, surface):
    cam = build.camera(size=(24, 24), half=0.15)
    scene = build.scene((build.icosphere(3, 1.0, True), surface), camera=cam, world=World((1.0, 1.0, 1.0)))
    found = trace(scene, replace(build.one_ray, max_depth=7))
    assert np.abs(found.radiance.min(axis=2) + found.residual - 1).max() < 0.01
    assert found.radiance.max() < 1 + 1e-5
    assert np.median(np.abs(found.radiance - 1)) < 1e-4


def test_a_film_that_varies_is_the_film_of_each_place(build):
    """Two halves of a mirror, told by an expression, are the two mirrors."""

    def seen(thickness):
        surface = Surface(layered=True, opacity=0.0, ior=1.5, film=thickness, film_ior=1.9, roughness=0.0)
        floor = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
        return trace(build.scene((floor, surface), world=World((1.0, 0.5, 0.25))), build.one_ray).radiance

    place = Expression("channel", (Expression("attribute", (), "position"),), 0)
    varied = seen(Expression("mix", (Expression("greater", (place, 0.0)), 200.0, 500.0)))
    right, left = seen(500.0), seen(200.0)
    half = varied.shape[1] // 2
    assert varied[:, :half] == pytest.approx(left[:, :half], abs=1e-3)
    assert varied[:, half:] == pytest.approx(right[:, half:], abs=1e-3)
