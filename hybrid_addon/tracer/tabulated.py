"""Layered surfaces whose layers are the same all over: their columns, worked out once for each of many view angles.

What such a hit asks for depends on nothing but its cosine; looking it up takes a tenth of the time. Between two cosines
of the table columns are linear: a white world stays white. Where images vary a colour that all of a column is in
proportion to, the table has it for white.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..expressions import expressions_of
from ..scene import WHITE, Expression, Float32, Float64, Surface
from .columns import CROSSING, HEIGHT, ROWS
from .constants import COSINES
from .fields import fields_of
from .layers import layered_columns

Numbers = NDArray[np.intp]

FACTORS = ("base_color", "emission")
"""Fields that the columns of their names are in proportion to; of a colour under sheen, the rest is not."""


class Tabulated:
    """Of the s surfaces of a scene.

    row   : (s,) intp, the place of each in the table; negative: it is not there.
    blurs : (s,) bool, it shows the world blurred; of those that are not there, unknown and hence True.
    """

    def __init__(self, surfaces: tuple[Surface, ...]) -> None:
        self.row = np.full(len(surfaces), -1, np.intp)
        fit = [number for number, surface in enumerate(surfaces) if is_tabulated(surface)]
        self.row[fit] = np.arange(len(fit))
        cos = np.linspace(0, 1, COSINES)
        columns = [layered_columns(fields_of(_white(surfaces[number])), cos) for number in fit]
        values = np.stack(columns) if columns else np.zeros((0, HEIGHT, COSINES), np.float32)
        self.blurs = np.ones(len(surfaces), bool)
        self.blurs[fit] = (values[:, ROWS["lobe_blurred"].start : ROWS["coat_blurred"].stop] != 0).any(axis=(1, 2))
        self._used = np.flatnonzero((values != 0).any(axis=(0, 2)))
        self._all, self._crossing = _steps(values[:, self._used]), _steps(values[:, CROSSING])

    def columns(self, row: Numbers, cos: Float64, crossing: bool = False) -> Float32:
        """(HEIGHT, n) of hits seen at `cos` (n,), by their surfaces' rows (n,); crossing: the rows CROSSING alone."""
        if crossing:
            return np.ascontiguousarray(_look_up(self._crossing, row, cos).T)
        found = _look_up(self._all, row, cos)
        result = np.zeros((HEIGHT, len(cos)), np.float32)
        for place, values in zip(self._used.tolist(), found.T, strict=True):
            result[place] = values
        return result


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


def _steps(values: Float32) -> Float32:
    """(t, rows, COSINES) as (t COSINES, 2 rows): what there is at a cosine, and how much more at the next."""
    there = np.concatenate([values[..., 1:], values[..., -1:]], axis=-1)
    both = np.concatenate([values, there - values], axis=1)
    return np.ascontiguousarray(both.transpose(0, 2, 1)).reshape(len(values) * COSINES, both.shape[1])


def _look_up(table: Float32, row: Numbers, cos: Float64) -> Float32:
    """(n, rows) at cosines (n,)."""
    if len(row) == 0:
        return np.zeros((0, table.shape[1] // 2), np.float32)
    place = np.clip(cos, 0, 1) * (COSINES - 1)
    below = np.minimum(place.astype(np.intp), COSINES - 2)
    found = table.take(row * COSINES + below, axis=0, mode="clip")
    half = found.shape[1] // 2
    result = found[:, half:]
    result *= (place - below).astype(np.float32)[:, None]
    result += found[:, :half]
    return result
