# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights of rough surfaces: GGX lobes over lamps that have a shape, by linearly transformed cosines.

A lobe is a clamped cosine that a matrix has stretched and turned (Heitz, Dupuy, Hill and Neubelt 2016, Real-Time
Polygonal-Light Shading with Linearly Transformed Cosines), and what it sees of a lamp is what the cosine sees of the
lamp under the inverse matrix (`form_factors`). EEVEE does the same, so both halves of a picture agree.

The table is our own (tools/fit_ltc.py): the lobe's mean direction as an angle off the mirror's, and the matrix, all
over alpha.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from ...scene import Float32, Float64
from ..core.constants import LEAST_COSINE
from ..core.vectors import Array, cross, dot, orthonormal_basis

LEAST_LOBE = 1e-6
"""A stretched lobe is at least this thin, squared: of stretches of a thousand rounding leaves nothing."""


@cache
def _table() -> Float64:
    """(4, roughness, cosine): tilt, m11, m22, m13 over alpha; steps of roughness and of sqrt(1 - cosine)."""
    table: Array = np.load(Path(__file__).with_name("ltc.npy"))
    return table.astype(np.float64)


@dataclass(frozen=True, eq=False)
class Lobe:
    """GGX lobes of n hits, as clamped cosines around the axis `z` of a frame, stretched by m11, m22, m13.

    x, y, z : (3, n) float64 unit vectors.   m11, m22, m13, m23 : (n,) float64; m23 None: 0 everywhere.
    """

    x: Float64
    y: Float64
    z: Float64
    m11: Float64
    m22: Float64
    m13: Float64
    m23: Float64 | None = None

    def untransformed(self, a: Float64) -> Float64:
        """Vectors (3, n) where the lobe is a cosine around +Z."""
        z = dot(self.z, a)
        y = dot(self.y, a) if self.m23 is None else dot(self.y, a) - self.m23 * z
        return np.stack([(dot(self.x, a) - self.m13 * z) / self.m11, y / self.m22, z])


def ggx_lobe(wo: Float32, n: Float32, roughness: Float32, brushed: tuple[Float32, Float32] | None = None) -> Lobe:
    """Lobes of surfaces of normals n (3, n) and a roughness (n,) > 0, seen along wo (3, n); from below as edge on.

    brushed : tangents (3, n) of unit length along the surface, or 0, and stretches (n,) (scene.Surface); None: all are
    round. There is no table of such lobes. A microfacet that tilts by p towards the eye and q across turns the mirror's
    direction by m11 / alpha and m22 / alpha times that, as far as it is linear; so a round lobe is stretched as the
    tilts of its microfacets are, each axis with the round lobe's numbers at its own width.
    """
    normal, eye = n.astype(np.float64), wo.astype(np.float64)
    cos = np.clip(dot(normal, eye), LEAST_COSINE, 1)
    across = eye - normal * dot(normal, eye)
    sin = np.sqrt(dot(across, across))
    any_tangent, _ = orthonormal_basis(normal)
    tangent = np.where(sin > LEAST_COSINE, across / np.maximum(sin, LEAST_COSINE), any_tangent)
    alpha = roughness.astype(np.float64) ** 2
    spread = None if brushed is None else _spread(alpha, brushed, tangent, cross(normal, tangent))
    if spread is None:
        tilt, m11, m22, m13 = _look_up(cos, roughness) * alpha
    else:
        along, across = np.sqrt(spread[0]), np.sqrt(spread[2])
        tilt, m11, _, m13 = _look_up(cos, np.sqrt(along)) * along
        m22 = _look_up(cos, np.sqrt(across))[2] * across
    # From the mirror's direction, which is as far from the normal as the eye, on the other side.
    angle = np.arctan2(sin, cos) + tilt
    sin, cos = np.sin(angle), np.cos(angle)
    x, y, z = -cos * tangent - sin * normal, cross(normal, tangent), cos * normal - sin * tangent
    if spread is None:
        return Lobe(x, y, z, m11, m22, m13)
    return _turned(Lobe(x, y, z, m11, m22, m13), spread)


def _spread(
    alpha: Float64, brushed: tuple[Float32, Float32], towards: Float64, aside: Float64
) -> tuple[Float64, Float64, Float64]:
    """Variances (n,) of the tilts of microfacets towards the eye and aside, and between them their covariance."""
    tangent, stretch = (a.astype(np.float64) for a in brushed)
    along, across = (alpha / stretch) ** 2, (alpha * stretch) ** 2
    c, s = dot(tangent, towards), dot(tangent, aside)
    round_ = c * c + s * s == 0  # no tangent: nothing is stretched
    c, along, across = (np.where(round_, a, b) for a, b in ((1.0, c), (alpha**2, along), (alpha**2, across)))
    return along * c * c + across * s * s, (along - across) * c * s, along * s * s + across * c * c


def _turned(lobe: Lobe, spread: tuple[Float64, Float64, Float64]) -> Lobe:
    """The lobe with its axes turned about z to those of the covariance of directions: a tilt to the eye is along -x."""
    shared = -spread[1] / np.sqrt(spread[0] * spread[2]) * lobe.m11 * lobe.m22
    first, last = lobe.m11**2, lobe.m22**2
    middle, half = 0.5 * (first + last), 0.5 * (first - last)
    apart = np.sqrt(half * half + shared * shared)
    angle = 0.5 * np.arctan2(shared, half)
    c, s = np.cos(angle), np.sin(angle)
    least = LEAST_LOBE * middle  # of a lobe that is a line
    m11, m22 = np.sqrt(middle + apart), np.sqrt(np.maximum(middle - apart, least))
    return Lobe(c * lobe.x + s * lobe.y, c * lobe.y - s * lobe.x, lobe.z, m11, m22, c * lobe.m13, -s * lobe.m13)


def _look_up(cos: Float64, roughness: Float32 | Float64) -> Float64:
    """(4, n) of the table, bilinear."""
    table = _table()
    last = table.shape[1] - 1
    x, y = np.sqrt(1 - cos) * last, np.clip(roughness, 0, 1).astype(np.float64) * last
    i, j = np.minimum(x.astype(np.intp), last - 1), np.minimum(y.astype(np.intp), last - 1)
    u, v = x - i, y - j
    flat, place = table.reshape(4, -1), j * (last + 1) + i
    low = flat.take(place, axis=1) * (1 - u) + flat.take(place + 1, axis=1) * u
    high = flat.take(place + last + 1, axis=1) * (1 - u) + flat.take(place + last + 2, axis=1) * u
    return np.asarray(low * (1 - v) + high * v)
