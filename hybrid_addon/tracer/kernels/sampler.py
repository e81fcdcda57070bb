# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of core/sampler.py: random numbers, and points of a disk."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np
from numba import types

from ..core import sampler
from ..core.constants import LEAST_RADIUS
from .declare import f4, helper, i8, kernel, largest, least, u4
from .elementary import SHORT

U = np.uint32  # operations on uint32 are of uint64 here: each is cut
R2_X, R2_Y, SCALE, OTHER = sampler._R2_X, sampler._R2_Y, np.float32(2.0**-32), U(0x9E3779B9)
FIRST, SECOND = U(0x7FEB352D), U(0x846CA68B)
MIXES = U(0x3D20ADEA), U(0x05526C56), U(0x53A22864)
HALVES, QUARTERS, NIBBLES, BYTES = U(0x55555555), U(0x33333333), U(0x0F0F0F0F), U(0x00FF00FF)
EIGHTH4, TWO4, ONE4 = np.float32(math.pi / 4), np.float32(2), np.float32(1)
LEAST4 = np.float32(LEAST_RADIUS)


@helper
def hash32(v):
    """sampler.hash32."""
    v = U(U(v ^ (v >> U(16))) * FIRST)
    v = U(U(v ^ (v >> U(15))) * SECOND)
    return U(v ^ (v >> U(16)))


@helper
def reverse(v):
    """The 32 bits the other way around."""
    v = U(((v >> U(1)) & HALVES) | U((v & HALVES) << U(1)))
    v = U(((v >> U(2)) & QUARTERS) | U((v & QUARTERS) << U(2)))
    v = U(((v >> U(4)) & NIBBLES) | U((v & NIBBLES) << U(4)))
    v = U(((v >> U(8)) & BYTES) | U((v & BYTES) << U(8)))
    return U((v >> U(16)) | U(v << U(16)))


@helper
def permute(number, key):
    """sampler.permute."""
    v = reverse(number)
    v = U(v ^ U(v * MIXES[0]))
    v = U(v + key)
    v = U(v * U((key >> U(16)) | U(1)))
    v = U(v ^ U(v * MIXES[1]))
    v = U(v ^ U(v * MIXES[2]))
    return reverse(v)


@kernel("tracer.core.sampler.keyed", [(u4[1], types.int64, types.int64, i8[1], u4[1])], tables=(0,))
def keyed(pixels, first, count, sample, path):
    """See the twin."""
    n = len(sample)
    key, number = np.empty(n, np.uint32), np.empty(n, np.uint32)
    for i in range(n):
        pixel = sample[i] // count
        key[i] = hash32(U(pixels[pixel] ^ hash32(path[i])))
        number[i] = U(first + sample[i] - pixel * count)
    return key, number


@kernel("tracer.core.sampler.square_points", [(u4[1], u4[1], types.uint32, types.int64, types.int64)])
def square_points(key, number, dimension, part, parts):
    """See the twin."""
    n = len(key)
    u, v = np.empty(n, np.float32), np.empty(n, np.float32)
    times, more = U(parts), U(part if parts != 1 else 0)
    for i in range(n):
        k = hash32(U(key[i] ^ dimension))
        m = permute(U(U(number[i] * times) + more), hash32(k))
        u[i] = np.float32(U(k + U(m * R2_X))) * SCALE
        v[i] = np.float32(U(hash32(U(k ^ OTHER)) + U(m * R2_Y))) * SCALE
    return u, v


near_0 = SHORT.sincos_near_0


@kernel("tracer.core.sampler.disk", [(f4[1], f4[1])])
def disk(u, v):
    """See the twin."""
    n = len(u)
    x, y = np.empty(n, np.float32), np.empty(n, np.float32)
    for i in range(n):
        a, b = TWO4 * u[i] - ONE4, TWO4 * v[i] - ONE4
        across, up = abs(a), abs(b)
        radius, small = largest(across, up), least(across, up)
        sine, cosine = near_0(EIGHTH4 * small / largest(radius, LEAST4))
        steep = up > across
        s, c = (cosine if steep else sine), (sine if steep else cosine)
        x[i], y[i] = np.copysign(radius * c, a), np.copysign(radius * s, b)
    return x, y
