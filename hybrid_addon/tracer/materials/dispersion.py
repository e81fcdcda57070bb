# SPDX-License-Identifier: GPL-3.0-or-later
"""Dispersion: the IOR of glass grows towards blue, so white light leaves it in colours.

A closure that refracts becomes three, one for each channel of the picture, each with the IOR of a wavelength that the
channel sees. Every sample has wavelengths of its own, in a stratified order, and keeps them on all its way: the mean is
that of the whole spectrum. White stays white in each sample where nothing splits it, so there is no colour noise there.

Sources: KHR_materials_dispersion of glTF for the IOR, n(l) = n_d + (n_d - 1) / V (523655 / l^2 - 1.5168) with l in nm
(Cauchy's law through the Fraunhofer lines F, d and C), V = 20 / dispersion the Abbe number.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...scene import RGB, Closure, Expression, Float64, Surface
from ...scene.surfaces import MIN_IOR

BANDS = ((605.0, 65.0), (545.0, 65.0), (455.0, 55.0))
"""Centre and half width in nm of what red, green and blue see: tents over the positive parts of the colour matching
functions of linear Rec. 709 (from CIE 1931). They overlap, so that there is yellow between red and green."""
CHANNELS: tuple[RGB, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def is_dispersive(surface: Surface) -> bool:
    """Whether a single closure splits light: it has a dispersion, and refracts."""
    bends = isinstance(surface.ior, Expression) or surface.ior != 1.0
    return surface.dispersion > 0 and bends and not surface.thin and not (surface.opacity == 1.0)


def dispersed(surface: Surface) -> Surface:
    """The surface as a sum in which each closure that disperses stands three times, once for each channel."""
    closures = surface.closures or (Closure(1.0, surface),)
    if not any(is_dispersive(closure.surface) for closure in closures):
        return surface
    found: list[Closure] = []
    for closure in closures:
        if is_dispersive(closure.surface):
            found += [Closure(_of_channel(closure.weight, channel), closure.surface) for channel in CHANNELS]
        else:
            found.append(closure)
    return replace(surface, closures=tuple(found))


def _of_channel(weight: object, channel: RGB) -> Expression | RGB:
    if isinstance(weight, Expression):
        return Expression("multiply", (weight, channel))
    of_all = np.broadcast_to(np.asarray(weight, np.float64), 3)
    red, green, blue = (of_all * channel).tolist()
    return red, green, blue


def spectral_ior(ior: Float64, dispersion: Float64, band: NDArray[np.intp], chance: Float64) -> Float64:
    """(n,) float64: the index of a wavelength that a channel sees.

    ior, dispersion : (n,) at 587.6 nm, and 20 / Abbe number.   band : (n,) channels 0..2.
    chance : (n,) 0..1, random numbers of the samples.
    """
    center, width = np.array(BANDS).T
    low, high = np.sqrt(2 * np.minimum(chance, 0.5)), np.sqrt(2 * np.minimum(1 - chance, 0.5))
    tent = np.where(chance < 0.5, low - 1, 1 - high)
    return ior_at(ior, dispersion, center.take(band) + width.take(band) * tent)


def ior_at(ior: Float64, dispersion: Float64, wavelength: Float64) -> Float64:
    """(n,) the index at a wavelength in nm, by Cauchy's law. ior, dispersion: at 587.6 nm, and 20 / Abbe number."""
    shift: Float64 = (ior - 1) * (dispersion / 20) * (523655 / wavelength**2 - 1.5168)
    return np.maximum(ior + shift, MIN_IOR)
