# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers out of pairs of pictures. Edges are told apart: one ray may flip there, and a mean would hide the rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene import Film, Float32
from ...tracer.core.vectors import Array
from .case import Measured

EDGE_CONTRAST = 0.05
"""A pixel whose 3 x 3 neighbourhood spans more than this share of the picture's range lies on an edge."""

FLIP = 1e-3
"""A pixel on an edge that differs by more has flipped: its ray went to the other side."""

EDGE_FLIPS = 2e-3
"""At most this share of the pixels on edges, and one more, may flip by rounding."""


def largest(a: Array, b: Array | float) -> float:
    """The largest |difference|, NaN if anything is NaN."""
    return float(np.max(np.abs(np.subtract(a, b, dtype=np.float64)), initial=0.0))


def films_differ(a: Film, b: Film) -> float:
    """The largest |difference| of radiance, coverage and residual."""
    return max(largest(getattr(a, f), getattr(b, f)) for f in ("radiance", "coverage", "residual"))


def edges(picture: Float32) -> NDArray[np.bool_]:
    """(h, w): pixels with an edge of the picture (h, w, 3) in their 3 x 3 neighbourhood."""
    padded = np.pad(picture, ((1, 1), (1, 1), (0, 0)), mode="edge")
    h, w = picture.shape[:2]
    around = np.stack([padded[j : j + h, i : i + w] for j in range(3) for i in range(3)])
    span = float(np.max(picture) - np.min(picture))
    return np.asarray((around.max(0) - around.min(0)).max(-1) > EDGE_CONTRAST * span)


def off_edges(a: Float32, reference: Float32) -> Measured:
    """The largest |difference| away from the reference's edges, and how many pixels flipped on them.

    If more flip than rounding explains, edges count like everything else.
    """
    edge = edges(reference)
    difference = np.abs(a.astype(np.float64) - reference).max(-1)
    flipped = int(np.count_nonzero(difference[edge] > FLIP))
    counted = ~edge if flipped <= 1 + EDGE_FLIPS * np.count_nonzero(edge) else np.ones_like(edge)
    share = 100 * float(np.mean(counted))
    value = float(np.max(difference[counted], initial=0.0))
    return Measured(value, f"{share:.0f} % of the pixels compared; on edges {flipped} flipped")


def different_pixels(a: Array, b: Array) -> int:
    """How many pixels differ by any bit."""
    return int(np.count_nonzero((a != b).any(-1)))
