# SPDX-License-Identifier: GPL-3.0-or-later
"""Homogeneous participating media. Conventions: see the package."""

from __future__ import annotations

from dataclasses import dataclass

from .numbers import BLACK, RGB


@dataclass(frozen=True)
class Medium:
    """A homogeneous participating medium.

    absorption, scattering : RGB, 1/m, >= 0; together they are its extinction.
    emission   : RGB radiance that it adds per metre, W/(sr m^3), >= 0.
    anisotropy : -1 < g < 1 of the Henyey-Greenstein phase function; above 0 it scatters forward.
    """

    absorption: RGB = BLACK
    scattering: RGB = BLACK
    emission: RGB = BLACK
    anisotropy: float = 0.0

    @property
    def is_nothing(self) -> bool:
        """It changes no light."""
        return not any((*self.absorption, *self.scattering, *self.emission))

    @property
    def dims(self) -> bool:
        """It takes light away."""
        return any((*self.absorption, *self.scattering))
