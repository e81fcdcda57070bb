# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights of rough surfaces: GGX lobes over lamps that have a shape, by linearly transformed cosines.

A lobe is a clamped cosine that a matrix has stretched and turned (Heitz, Dupuy, Hill and Neubelt 2016, Real-Time
Polygonal-Light Shading with Linearly Transformed Cosines), and what it sees of a lamp is what the cosine sees of the
lamp under the inverse matrix (`form_factors`). EEVEE does the same, so both halves of a picture agree.

The table is our own (tools/fit_ltc.py): the lobe's mean direction as an angle off the mirror's, and the matrix, all
over alpha.

Of brushed surfaces there is no table, nor does EEVEE draw them. Slopes p, q of GGX's microfacets over their alphas are
distributed as a clamped cosine is over its tangent plane, 1 / (pi (1 + p^2 + q^2)^2), and the half vector (p, q, 1)
reflects the eye to 2 (wo.h) h - (h.h) wo. Its tangent where h leads to the middle of a lamp makes a linearly
transformed cosine for this lamp alone: exact for small ones, wherever in the lobe they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated
from ...procedural import elementary
from ...scene import Float32, Float64
from ..core.constants import LEAST_COSINE
from ..core.vectors import Array, cross, dot, orthonormal_basis, take
from ..materials.principled import correlated, correlated_albedo, masking

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]


@cache
def ltc_table() -> Float64:
    """(4, roughness, cosine): tilt, m11, m22, m13 over alpha; steps of roughness and of sqrt(1 - cosine)."""
    table: Array = np.load(Path(__file__).with_name("ltc.npy"))
    return table.astype(np.float64)


@dataclass(frozen=True, eq=False)
class Lobe:
    """GGX lobes of n hits, as clamped cosines around the axis `z` of a frame, stretched by m11, m22, m13.

    x, y, z : (3, n) float64 unit vectors.   stretch : (3, n) float64, m11, m22 and m13.
    """

    x: Float64
    y: Float64
    z: Float64
    stretch: Float64

    def untransformed(self, a: Float64) -> Float64:
        """Vectors (3, n) where the lobe is a cosine around +Z."""
        return untransformed(self.x, self.y, self.z, self.stretch, a)

    def reaches(self, toward: Float64, size: Array | float) -> Bools:
        """See `emitters.light.Lobe`."""
        return np.asarray(~(dot(self.z, toward) <= -np.asarray(size)))

    def take(self, index: Numbers) -> Lobe:
        """Those of the hits `index`."""
        return Lobe(*(take(part, index) for part in (self.x, self.y, self.z, self.stretch)))


@accelerated
def untransformed(x: Float64, y: Float64, z: Float64, stretch: Float64, a: Float64) -> Float64:
    """Vectors a (3, n) where lobes (see `Lobe`) are cosines around +Z."""
    m11, m22, m13 = stretch
    up = dot(z, a)
    return np.stack([(dot(x, a) - m13 * up) / m11, dot(y, a) / m22, up])


LEAST_RISE = 0.05
"""Cosine of the steepest microfacets (87 degrees) that lobes are made around: those that would have to be steeper to
show a lamp, which is below the horizon then, would make spikes of rounding."""

Brushed = tuple[Float32, Float32]
"""Tangents (3, n) along surfaces, unit vectors or 0, and how their reflections are stretched (n,) (scene.Surface)."""


def groove_frame(n: Float32, alpha: Float32, brushed: Brushed | None) -> tuple[Float32, Float32, Float32, Float32]:
    """Tangents and bitangents (3, n), and GGX's alpha (n,) along each, at most 1 (as in Cycles); None: any, and the
    same."""
    tangent, bitangent = orthonormal_basis(n)
    if brushed is None:
        return tangent, bitangent, alpha, alpha
    grooves = brushed[0].any(axis=0)
    tangent, bitangent = np.where(grooves, brushed[0], tangent), np.where(grooves, cross(n, brushed[0]), bitangent)
    stretch: Float32 = np.where(grooves, brushed[1], np.float32(1))
    along, across = (np.minimum(a, np.float32(1)) for a in (alpha / stretch, alpha * stretch))
    return tangent, bitangent, along.astype(np.float32), across.astype(np.float32)


def alpha_from(w: Array, frame: tuple[Array, Array, Array, Array]) -> Array:
    """GGX's alpha (n,) as Smith's masking sees it from directions w (3, n), in a `groove_frame`."""
    tangent, bitangent, along, across = frame
    x, y = dot(w, tangent), dot(w, bitangent)
    sin2 = np.maximum(x * x + y * y, w.dtype.type(LEAST_COSINE**2))
    return np.asarray(np.sqrt(((along * x) ** 2 + (across * y) ** 2) / sin2))


@dataclass(frozen=True, eq=False)
class LampLobe:
    """Lobes of n brushed hits as clamped cosines, for one lamp.

    rows : three of (3, n) float64, the inverse of the matrix.   weight : (n,) float64, of the cosine.
    """

    rows: tuple[Float64, Float64, Float64]
    weight: Float64

    def untransformed(self, a: Float64) -> Float64:
        """Vectors (3, n) where the lobe is a cosine around +Z."""
        return np.stack([dot(row, a) for row in self.rows])

    def reaches(self, toward: Float64, size: Array | float) -> Bools:
        """See `emitters.light.Lobe`."""
        up = self.rows[2]
        return np.asarray(~(dot(up, toward) <= -np.asarray(size) * np.sqrt(dot(up, up))))

    def take(self, index: Numbers) -> LampLobe:
        """Those of the hits `index`."""
        first, second, third = (take(row, index) for row in self.rows)
        return LampLobe((first, second, third), take(self.weight, index))


@dataclass(frozen=True, eq=False)
class BrushedLobe:
    """n brushed hits: wo, n (3, n), roughness (n,), float32, and how they are brushed."""

    wo: Float32
    n: Float32
    roughness: Float32
    brushed: Brushed

    def towards(self, wi: Float32) -> LampLobe:
        """Their lobes for lamps whose middles lie along wi (3, n)."""
        tangent, bitangent, along, across = (
            a.astype(np.float64) for a in groove_frame(self.n, self.roughness**2, self.brushed)
        )
        frame = tangent, bitangent, along, across
        eye, n, lamp = (a.astype(np.float64) for a in (self.wo, self.n, wi))
        half = eye + lamp
        up = np.maximum(dot(half, n), LEAST_RISE * np.maximum(np.sqrt(dot(half, half)), LEAST_COSINE))
        p, q = dot(half, tangent) / up, dot(half, bitangent) / up
        half = p * tangent + q * bitangent + n
        facing, length2 = dot(eye, half), 1 + p * p + q * q
        by_p, by_q = (
            2 * (dot(eye, way) * half + facing * way - slope * eye) for way, slope in ((tangent, p), (bitangent, q))
        )
        third = 2 * facing * half - length2 * eye - p * by_p - q * by_q
        first, second = along * by_p, across * by_q
        rows = cross(second, third), cross(third, first), cross(first, second)
        volume = dot(first, rows[0])
        # A cosine is the same mirrored: what turns around as a mirror does is mirrored back.
        turned = (rows[0] * np.sign(volume), rows[1], rows[2] * np.sign(volume))
        size = np.where(volume != 0, 1 / np.where(volume != 0, np.abs(volume), 1), 0)
        cos_o, cos_i = (np.maximum(dot(a, n), LEAST_COSINE) for a in (eye, lamp))
        seen = [masking(cos, alpha_from(w, frame)) for cos, w in ((cos_o, eye), (cos_i, lamp))]
        both = seen[0] * correlated(seen[0], seen[1])
        weight = both * facing / (cos_o * np.maximum(correlated_albedo(cos_o, self.roughness), LEAST_COSINE))
        return LampLobe((turned[0] * size, turned[1] * size, turned[2] * size), weight)


def ggx_lobe(wo: Float32, n: Float32, roughness: Float32) -> Lobe:
    """Lobes of surfaces of normals n (3, n) and a roughness (n,) > 0, seen along wo (3, n); from below as edge on."""
    return Lobe(*lobe_frames(wo, n, roughness, ltc_table()))


@accelerated
def lobe_frames(
    wo: Float32, n: Float32, roughness: Float32, table: Float64
) -> tuple[Float64, Float64, Float64, Float64]:
    """x, y, z and stretch of `ggx_lobe`. table: see `_table`."""
    normal, eye = n.astype(np.float64), wo.astype(np.float64)
    cos = np.clip(dot(normal, eye), LEAST_COSINE, 1)
    across = eye - normal * dot(normal, eye)
    sin = np.sqrt(dot(across, across))
    any_tangent, _ = orthonormal_basis(normal)
    tangent = np.where(sin > LEAST_COSINE, across / np.maximum(sin, LEAST_COSINE), any_tangent)
    alpha = roughness.astype(np.float64) ** 2
    tilt, *stretch = _look_up(cos, roughness, table) * alpha
    # From the mirror's direction, which is as far from the normal as the eye, on the other side.
    angle = elementary.arctan2(sin, cos) + tilt
    sin, cos = elementary.sincos(angle)
    x, z = -cos * tangent - sin * normal, cos * normal - sin * tangent
    return x, cross(normal, tangent), z, np.stack(stretch)


def _look_up(cos: Float64, roughness: Float32, table: Float64) -> Float64:
    """(4, n) of the table, bilinear."""
    last = table.shape[1] - 1
    x, y = np.sqrt(1 - cos) * last, np.clip(roughness, 0, 1).astype(np.float64) * last
    i, j = np.minimum(x.astype(np.intp), last - 1), np.minimum(y.astype(np.intp), last - 1)
    u, v = x - i, y - j
    flat, place = table.reshape(4, -1), j * (last + 1) + i
    low = flat.take(place, axis=1) * (1 - u) + flat.take(place + 1, axis=1) * u
    high = flat.take(place + last + 1, axis=1) * (1 - u) + flat.take(place + last + 2, axis=1) * u
    return np.asarray(low * (1 - v) + high * v)
