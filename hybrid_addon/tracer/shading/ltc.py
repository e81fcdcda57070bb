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


@cache
def _table() -> Float64:
    """(4, roughness, cosine): tilt, m11, m22, m13 over alpha; steps of roughness and of sqrt(1 - cosine)."""
    table: Array = np.load(Path(__file__).with_name("ltc.npy"))
    return table.astype(np.float64)


@dataclass(frozen=True, eq=False)
class Lobe:
    """GGX lobes of n hits, as clamped cosines around the axis `z` of a frame, stretched by m11, m22, m13.

    x, y, z : (3, n) float64 unit vectors.   m11, m22, m13 : (n,) float64.
    """

    x: Float64
    y: Float64
    z: Float64
    m11: Float64
    m22: Float64
    m13: Float64

    def untransformed(self, a: Float64) -> Float64:
        """Vectors (3, n) where the lobe is a cosine around +Z."""
        z = dot(self.z, a)
        return np.stack([(dot(self.x, a) - self.m13 * z) / self.m11, dot(self.y, a) / self.m22, z])


def ggx_lobe(wo: Float32, n: Float32, roughness: Float32) -> Lobe:
    """Lobes of surfaces of normals n (3, n) and a roughness (n,) > 0, seen along wo (3, n); from below as edge on."""
    normal, eye = n.astype(np.float64), wo.astype(np.float64)
    cos = np.clip(dot(normal, eye), LEAST_COSINE, 1)
    across = eye - normal * dot(normal, eye)
    sin = np.sqrt(dot(across, across))
    any_tangent, _ = orthonormal_basis(normal)
    tangent = np.where(sin > LEAST_COSINE, across / np.maximum(sin, LEAST_COSINE), any_tangent)
    alpha = roughness.astype(np.float64) ** 2
    tilt, m11, m22, m13 = _look_up(cos, roughness) * alpha
    # From the mirror's direction, which is as far from the normal as the eye, on the other side.
    angle = np.arctan2(sin, cos) + tilt
    sin, cos = np.sin(angle), np.cos(angle)
    return Lobe(-cos * tangent - sin * normal, cross(normal, tangent), cos * normal - sin * tangent, m11, m22, m13)


def _look_up(cos: Float64, roughness: Float32) -> Float64:
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
