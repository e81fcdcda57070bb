# SPDX-License-Identifier: GPL-3.0-or-later
"""Columns: the numbers of the surface model, packed into one float32 array, and which of them each hit has.

A surface has one column; one with layers has many, for as many view angles (see `tabulated`); where expressions tell,
a hit has one of its own (see `varying`). Rows that stand together are gathered together, when somebody asks for them,
of the hits that are asked for: nobody ever asks for all. IORs are not among them: they are float64.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64
from ..core.constants import MIN_ROUGHNESS
from ..core.vectors import Array, Index, take
from .fields import Fields

WIDTHS = {
    "interface": 1,  # (1 - r) (1 - o): what Fresnel shares out
    "tint": 3,  # transmission_tint
    "film": 1,  # thickness of a thin film in nm,
    "film_ior": 1,  # and its index
    "interface_tint": 3,  # of what Fresnel reflects
    "mirror": 3,  # r reflection_tint
    "base_color": 3,  # albedo
    "local": 1,  # (1 - r) o
    "ambient": 1,  # weight of the world's diffuse light
    "diffuse": 1,  # weight of the lights' diffuse light
    "specular": 3,  # F0 of the Phong highlight
    "exponent": 1,  # of the Phong highlight
    "emission": 3,  # Le
    "lobe": 3,  # of layered surfaces: colour of the base's reflection, for lights
    "coat": 1,  # and of the coat's
    "lobe_blurred": 3,  # the same of what no ray follows, for the world
    "coat_blurred": 1,
    "lobe_roughness": 1,
    "stretch": 1,  # of a brushed base
    "coat_roughness": 1,
    "scatter": 1,  # share of the diffuse light that is scattered below the surface,
    "scatter_radius": 3,  # and how far, in metres
}
"""What there is, in the order of the rows, and how many rows each takes. What rays cross stands first."""


def _rows() -> dict[str, slice]:
    found, start = {}, 0
    for name, width in WIDTHS.items():
        found[name] = slice(start, start + width)
        start += width
    return found


ROWS = _rows()
HEIGHT = sum(WIDTHS.values())
CROSSING = slice(0, ROWS["film_ior"].stop)
"""What a shadow ray asks of a surface that it crosses."""
NOT_CROSSED = frozenset(
    ("base_color", "specular", "emission", "reflection_tint", "edge_tint", "metal_ior", "scatter_radius")
)
"""Fields that change nothing of it."""


@dataclass(frozen=True, eq=False)
class Columns:
    """Columns, and what is between them.

    values : (rows, c) float32, all rows or those CROSSING.
    more   : (rows, t) float32, how much more the next column has, of the first t; of the others none is asked.
    slopes : names of what is not the same at all view angles.
    """

    values: Float32
    more: Float32
    slopes: frozenset[str]


@dataclass(frozen=True, eq=False)
class HitValues:
    """The numbers of n hits.

    place   : (n,) intp, their columns.
    share   : (n,) float32, how far each is on its way to the next column; None: nowhere.
    factors : by name, (3, n) float32, what columns are to be multiplied by; of some names, if any.
    ior     : (n,) float64, where it varies; None: that of the surfaces.
    """

    columns: Columns
    place: NDArray[np.intp]
    share: Float32 | None = None
    factors: Mapping[str, Float32] = field(default_factory=dict)
    ior: Float64 | None = None

    def value(self, name: str, index: Index) -> Float32:
        """(m,) or (3, m) float32 of the hits `index`."""
        columns, rows, place = self.columns, ROWS[name], take(self.place, index)
        one_row = WIDTHS[name] == 1
        values = columns.values[rows.start] if one_row else columns.values[rows]
        result: Float32 = values.take(place, axis=-1, mode="clip")
        if self.share is not None and name in columns.slopes:
            more = columns.more[rows.start] if one_row else columns.more[rows]
            step: Float32 = more.take(place, axis=-1, mode="clip")  # columns of hits come last, and have no next
            step *= take(self.share, index)
            result += step
        if name in self.factors:
            result *= take(self.factors[name], index)
        return result

    def take(self, index: Index) -> HitValues:
        """Those of the hits `index`, in that order."""
        share = None if self.share is None else take(self.share, index)
        factors = {name: take(factor, index) for name, factor in self.factors.items()}
        ior = None if self.ior is None else take(self.ior, index)
        return HitValues(self.columns, take(self.place, index), share, factors, ior)


def pack(numbers: Mapping[str, Array], n: int) -> Float32:
    """(HEIGHT, n) float32 of (n,), (1, n) or (3, n) float64 by name, n or 1 of each; 0 for what is not there."""
    values = np.zeros((HEIGHT, n), np.float32)
    for name, value in numbers.items():
        values[ROWS[name]] = value
    return values


def plain_columns(f: Fields, n: int) -> Float32:
    """(HEIGHT, n): the numbers of the surface model, without layers."""
    r, o = f["reflectivity"], f["opacity"]
    return pack(
        {
            "interface": (1 - r) * (1 - o),
            "tint": f["transmission_tint"],
            "interface_tint": f["interface_tint"],
            "mirror": r * f["reflection_tint"],
            "base_color": f["base_color"],
            "local": (1 - r) * o,
            "ambient": f["ambient"],
            "diffuse": f["diffuse"],
            "specular": f["specular"],
            "exponent": phong_exponent(f["roughness"]),
            "emission": f["emission"],
            "scatter": f["scatter"],
            "scatter_radius": f["scatter_radius"],
        },
        n,
    )


def phong_exponent(roughness: Float64) -> Float64:
    """Blinn-Phong exponent 2 / alpha^2 - 2 of the same width as a microfacet lobe of alpha = roughness^2."""
    alpha = np.maximum(roughness, MIN_ROUGHNESS) ** 2
    return np.maximum(2 / alpha**2 - 2, 0.0)
