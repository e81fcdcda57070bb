# SPDX-License-Identifier: GPL-3.0-or-later
"""Thin films: the colours of soap bubbles, oil and annealed steel, by interference within a transparent layer.

With a and b the amplitudes that the film's upper and lower face reflect, of one polarisation (b complex over a metal),
and the path difference D = 2 n_f d cos of a film of index n_f and thickness d, Airy's sum of all ways to and fro passes

    T = (1 - a^2) (1 - |b|^2) / (1 + a^2 |b|^2 + 2 a |b| cos(2 pi D / lambda + arg b))

of a wavelength, and 1 - T is reflected (Born and Wolf, Principles of Optics, 7.6). A colour is its mean over what the
colour's receptors see. (Belcour and Barla 2017, A Practical Extension to Microfacet Theory for the Modeling of Varying
Iridescence, take the mean of each term of a series; at grazing angles, where a and b are near 1, that wants too many.)
Beyond FARTHEST_FRINGE light of all phases meets: the mean of T over them is (1 - a^2) (1 - |b|^2) / (1 - a^2 |b|^2).

EEVEE draws no films: the tracer draws them as Cycles does.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ...procedural import elementary
from ...procedural.spectra import XYZ_TO_REC709, observer
from ...scene import Float32, Float64
from ...scene.surfaces import MIN_IOR
from ..core.constants import FAINT

WAVELENGTHS = 32
"""Of them one is 5 nm wide in violet and 20 nm in red. A mean over more differs by 0.002, or by 0.01 in thick films
between faces that reflect nearly all, at grazing angles.
"""
NEAREST_WHITE, FARTHEST_FRINGE = 6000.0, 9000.0
"""nm: path differences from which fringes fade, and are gone. By themselves they have then lost 99 %."""
FULL_FILM = 1.0
"""nm: up to this thickness films fade in, as in Cycles. Waves tell nothing of layers of a few atoms, and at 0 the
surface must be the bare one to the last bit."""
LARGEST_REFLECTANCE = 0.999
"""A metal is no better a mirror at normal incidence: its index would be infinite (Gulbrandsen 2014)."""

Bools = NDArray[np.bool_]
Complex = NDArray[np.complex128]


# ------------------------------------------------------------------------------------------------ colours of light


def daylight(wavelength: Float64) -> Float64:
    """(n,): the relative power of CIE D65, white of the colours that renderers work in, at wavelengths (n,) in nm."""
    known = (
        49.98, 82.75, 93.43, 104.86, 117.81, 115.92, 109.35, 104.79, 104.41, 100.0, 95.79, 90.01, 87.7, 83.7, 80.21,
        78.28, 71.61, 61.6, 75.09, 46.42, 63.38,
    )  # fmt: skip
    return np.asarray(np.interp(wavelength, np.linspace(380, 780, len(known)), known))


@cache
def receptors() -> tuple[Float64, Float64]:
    """Wavelengths (WAVELENGTHS,) in nm, and what red, green and blue make of each, (3, w): rows of sum 1, partly < 0.

    Evenly spaced in wave numbers, as phases are; a weight is that of all light nearer to its wavelength than to others.
    """
    fine = 1 / np.linspace(1 / 380.0, 1 / 780.0, WAVELENGTHS * 32, endpoint=False)
    weights = XYZ_TO_REC709 @ (observer(fine) * daylight(fine) * fine * fine)
    weights = weights.reshape(3, WAVELENGTHS, -1).sum(axis=2)
    middle = 1 / (1 / fine).reshape(WAVELENGTHS, -1).mean(axis=1)
    return middle, weights / weights.sum(axis=1, keepdims=True)


def receptors_by_wavelength() -> tuple[Float64, Float64]:
    """`receptors`, the weights as (w, 3, 1)."""
    wavelengths, weights = receptors()
    return wavelengths, weights.T[:, :, None]


# ------------------------------------------------------------------------------------------------ reflectance


def amplitudes(cos: Float64, thickness: Float64, film: Float64, n: Float64, k: Float64 | float = 0.0) -> tuple[
    list[tuple[Float64, Complex]], Float64
]:  # fmt: skip
    """((a, b) of either polarisation, path difference D in nm): what `film_reflectance` sums. See there."""
    sin2 = 1 - cos * cos
    inside = np.sqrt(np.maximum(1 - sin2 / (film * film), 0))
    base = n + 1j * np.asarray(k)
    below = np.sqrt(1 - sin2 / (base * base))
    across = (cos - film * inside) / np.maximum(cos + film * inside, FAINT)
    parallel = (film * cos - inside) / np.maximum(film * cos + inside, FAINT)
    lower_s = (film * inside - base * below) / (film * inside + base * below + FAINT)
    lower_p = (base * inside - film * below) / (base * inside + film * below + FAINT)
    return [(across, lower_s), (parallel, lower_p)], 2 * film * thickness * inside


def film_reflectance(
    cos: Float64, thickness: Float64, film: Float64, n: Float64, k: Float64 | float = 0.0
) -> Float64:  # fmt: skip
    """(3, n) in 0..1: unpolarised reflectance of a film on a base, for red, green and blue; all (1 or 3, n or 1).

    cos : of the angle of incidence, in 0..1.   thickness : nm, >= 0.   film : its index.   n, k : of the base, the
    complex index n + i k. All indices are over that of the medium that the light comes from.
    """
    pairs, path = amplitudes(cos, thickness, film, n, k)
    far = np.clip((path - NEAREST_WHITE) / (FARTHEST_FRINGE - NEAREST_WHITE), 0, 1)
    radians = 2 * np.pi * np.minimum(path, FARTHEST_FRINGE)
    # Of each polarisation what enters, both faces' a |b|, and 2 a b.
    enter = [(1 - a * a) * np.maximum(1 - np.abs(b) ** 2, 0) for a, b in pairs]
    both = [np.abs(a * b) ** 2 for a, b in pairs]
    wave = [2 * a * b for a, b in pairs]
    is_metal = any(part.imag.any() for part in wave)
    mean: Float64 = np.zeros((1, 1))
    for wavelength, weight in zip(*receptors_by_wavelength(), strict=True):
        phase = radians / wavelength
        sine, cosine = elementary.sincos(phase)
        passed: Float64 = np.zeros((1, 1))
        for entering, square, part in zip(enter, both, wave, strict=True):
            swing = part.real * cosine - part.imag * sine if is_metal else part.real * cosine
            passed = passed + entering / np.maximum(1 + square + swing, FAINT)
        mean = mean + weight * passed
    apart = sum(entering / np.maximum(1 - square, FAINT) for entering, square in zip(enter, both, strict=True))
    passed = 0.5 * (mean + far * (apart - mean))
    total_reflection = film * film <= 1 - cos * cos
    return np.asarray(np.where(total_reflection, 1.0, np.clip(1 - passed, 0, 1)))


def faded_in(thickness: Float64, bare: Float64, filmed: Float64) -> Float64:
    """`bare` where there is no film, `filmed` from FULL_FILM on, between them both; of films thickness nm thick."""
    share = np.clip(thickness / FULL_FILM, 0, 1)
    share = share * share * (3 - 2 * share)
    return np.where(share > 0, bare + share * (filmed - bare), bare)


def film_fresnel(
    bare: Float32, cos_i: Float64, eta: Float64, outside: Bools, ior: Float64, thickness: Float32, film: Float32
) -> Float32:
    """Reflectance (3, n) of n hits on an interface that reflects `bare` (n,) without its film, from either side.

    cos_i, eta : (n,) of the hits, as Fresnel's equations take them.   outside : (n,) bool, light comes from outside.
    ior        : (n,) of the solid, against vacuum.   thickness, film : (n,) nm, and the film's index against vacuum.

    A film loses nothing, so it reflects the same from both sides at angles that belong together by Snell's law: both
    are worked out from without. Indices there are over that of what surrounds the solid.
    """
    around = np.where(outside, ior / eta, ior * eta)
    cos2 = np.where(outside, cos_i * cos_i, 1 - (1 - cos_i * cos_i) / (eta * eta))
    index = np.maximum(film, MIN_IOR) / around
    nm = thickness.astype(np.float64)
    filmed = film_reflectance(np.sqrt(np.maximum(cos2, 0))[None], nm, index, np.where(outside, eta, 1 / eta))
    reached = (cos2 > 0) & (eta != 1)  # else all is reflected, or nothing is there
    return np.where(reached, faded_in(nm, bare.astype(np.float64), filmed), bare).astype(np.float32)


def metal_index(f0: Float64, edge: Float64 | float, index: Float64 | None = None) -> tuple[Float64, Float64]:
    """n and k (3, n) of a metal that reflects f0 at normal incidence (Gulbrandsen 2014, Artist Friendly Metallic
    Fresnel): n lies between its two bounds by the reflectance at the edge, or is given; k follows from both."""
    r = np.clip(f0, 0, LARGEST_REFLECTANCE)
    if index is None:
        root = np.sqrt(r)
        largest, least = (1 + root) / (1 - root), (1 - r) / (1 + r)
        index = largest + (least - largest) * np.clip(edge, 0, 1)
    k2 = (r * (index + 1) ** 2 - (index - 1) ** 2) / (1 - r)
    return index, np.sqrt(np.maximum(k2, 0))


def index_of(f0: Float64) -> Float64:
    """Index of a dielectric that reflects f0 at normal incidence."""
    root = np.sqrt(np.clip(f0, 0, LARGEST_REFLECTANCE))
    return np.asarray((1 + root) / (1 - root))
