# SPDX-License-Identifier: GPL-3.0-or-later
"""Layered surfaces whose layers are the same all over: their columns, worked out once for each of many view angles.

What such a hit asks for depends on nothing but its cosine; looking it up takes a tenth of the time. Between two cosines
of the table columns are linear: a white world stays white. Where images vary a colour that all of a column is in
proportion to, the table has it for white.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...expressions import expressions_of
from ...scene import WHITE, Expression, Float32, Surface
from ..core.constants import COSINES
from ..core.vectors import flatnonzero
from .columns import ROWS, Columns, HitValues
from .fields import fields_of
from .principled import layered_columns

FACTORS = ("base_color", "emission")
"""Fields that the columns of their names are in proportion to; of a colour under sheen, the rest is not."""


class Tabulated:
    """Of the s surfaces of a scene.

    known   : (s,) bool, which of them are in the table.
    blurs   : (s,) bool, they show the world blurred; of those that are not in the table, unknown and hence True.
    columns : one of each surface, as `plain` says, then COSINES of each that is in the table.
    """

    def __init__(self, surfaces: tuple[Surface, ...], plain: Float32) -> None:
        """plain: (HEIGHT, s), columns of surfaces that are the same all over and from all sides."""
        self.known = np.array([is_tabulated(surface) for surface in surfaces])
        fit = flatnonzero(self.known)
        cos = np.linspace(0, 1, COSINES)
        tables = [layered_columns(fields_of(_white(surfaces[number])), cos) for number in fit]
        self.blurs = np.ones(len(surfaces), bool)
        blurred = slice(ROWS["lobe_blurred"].start, ROWS["coat_blurred"].stop)
        self.blurs[fit] = [bool((values[blurred] != 0).any()) for values in tables]
        values = np.concatenate([plain, *tables], axis=1)
        more = np.zeros_like(values)
        for number in range(len(tables)):
            part = slice(len(surfaces) + number * COSINES, len(surfaces) + (number + 1) * COSINES)
            more[:, part][:, :-1] = np.diff(values[:, part])
        slopes = frozenset(name for name, rows in ROWS.items() if more[rows].any())
        self.columns = Columns(values, more, slopes)
        self._first = np.arange(len(surfaces))
        self._first[fit] = len(surfaces) + np.arange(len(fit)) * COSINES
        self._steps = np.where(self.known, np.float32(COSINES - 1), np.float32(0))

    @property
    def first(self) -> NDArray[np.intp]:
        """(s,) the first column of each."""
        return self._first

    @property
    def steps(self) -> Float32:
        """(s,) how many columns on the last is; 0 of what is not in the table."""
        return self._steps

    def look_up(self, surface: NDArray[np.intp], cos: Float32) -> HitValues:
        """Of hits on surfaces (n,) that are seen at `cos` (n,)."""
        share = np.fmin(np.fmax(cos, 0), 1) * self._steps.take(surface)  # NaN counts as 0
        below = np.minimum(share.astype(np.intp), COSINES - 2)
        share -= below
        below += self._first.take(surface)
        return HitValues(self.columns, below, share)


def is_tabulated(surface: Surface) -> bool:
    """Whether all its columns can be told from the cosine and from factors."""
    if not surface.layered:
        return False
    white = _white(replace(surface, normal=None))
    return not any(True for _ in expressions_of(white))


def factors(surface: Surface) -> list[str]:
    """The fields that vary over a tabulated surface."""
    return [name for name in FACTORS if isinstance(getattr(surface, name), Expression)]


def _white(surface: Surface) -> Surface:
    """The same surface with white for its factors."""
    names = [name for name in factors(surface) if name != "base_color" or surface.sheen == 0.0]
    return replace(surface, **dict.fromkeys(names, WHITE))  # type: ignore[arg-type]
