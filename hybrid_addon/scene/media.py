# SPDX-License-Identifier: GPL-3.0-or-later
"""Participating media. Conventions: see the package."""

from __future__ import annotations

from dataclasses import dataclass

from .numbers import BLACK
from .values import Color, Expression, Number, Value


@dataclass(frozen=True)
class Medium:
    """A participating medium. Each of its values is the same everywhere, or an `Expression` of the place.

    absorption, scattering : RGB, 1/m, >= 0; together they are its extinction.
    emission   : RGB radiance that it adds per metre, W/(sr m^3), >= 0.
    anisotropy : -1 < g < 1 of the Henyey-Greenstein phase function; above 0 it scatters forward.
    """

    absorption: Color = BLACK
    scattering: Color = BLACK
    emission: Color = BLACK
    anisotropy: Number = 0.0

    @property
    def is_nothing(self) -> bool:
        """It changes no light."""
        return not (self.dims or _counts(self.emission))

    @property
    def dims(self) -> bool:
        """It takes light away, at least somewhere."""
        return _counts(self.absorption) or _counts(self.scattering)

    @property
    def scatters(self) -> bool:
        """It scatters light, at least somewhere."""
        return _counts(self.scattering)

    @property
    def glows(self) -> bool:
        """It sends light into rays, at least somewhere: its own, or what it scatters."""
        return _counts(self.emission) or _counts(self.scattering)

    @property
    def values(self) -> tuple[Value, ...]:
        """All of them."""
        return self.absorption, self.scattering, self.emission, self.anisotropy

    @property
    def varies(self) -> bool:
        """It is not the same everywhere."""
        return any(isinstance(value, Expression) for value in self.values)


def _counts(color: Color) -> bool:
    """Whether a colour is anything but black."""
    return isinstance(color, Expression) or any(color)
