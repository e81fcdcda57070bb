# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of materials/textures.py: bilinear look-up in images of four floats or bytes a texel."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np
from numba import types

from ..core.constants import MAX_TEXTURE_COORDINATE
from ..materials.textures import EXTENSIONS
from .declare import ArrayTypes, f4, f8, helper, kernel

REPEAT, EXTEND, CLIP, MIRROR = range(len(EXTENSIONS))
F = np.float32
ONE, HALF, NONE, BYTE = F(1), F(0.5), F(0), F(1) / F(255)
BLOCK = 256
"""Texels are found before they are fetched, so many at once: the processor then waits for several."""
u1 = ArrayTypes(types.uint8)


@helper
def wrapped(i, size, along):
    """textures._wrap."""
    if i >= 0 and i < size:
        return i
    if along == REPEAT:
        return i % size
    if along == MIRROR:
        i = i % (2 * size)
        return i if i < size else 2 * size - 1 - i
    return -1 if along == CLIP else min(max(i, 0), size - 1)


@helper
def cell(a, size, half, nought):
    """Number of the texel below a coordinate, and how far it is from its middle to the next."""
    x = (a if abs(a) < MAX_TEXTURE_COORDINATE else nought) * size - half
    low = math.floor(x)
    return np.int64(low), F(x - low)


@helper
def find(place, share, start, u, v, height, width, along_u, along_v, one):
    """Of one block of coordinates the numbers of the four texels, -1 for none, and how far each is between them."""
    wide, tall, half, nought = u.dtype.type(width), u.dtype.type(height), one * HALF, one * NONE
    for k in range(min(BLOCK, len(u) - start)):
        i, share[0, k] = cell(u[start + k], wide, half, nought)
        j, share[1, k] = cell(v[start + k], tall, half, nought)
        left, right = wrapped(i, width, along_u), wrapped(i + 1, width, along_u)
        bottom, top = wrapped(j, height, along_v), wrapped(j + 1, height, along_v)
        place[0, k] = bottom * width + left if bottom >= 0 and left >= 0 else -1
        place[1, k] = bottom * width + right if bottom >= 0 and right >= 0 else -1
        place[2, k] = top * width + left if top >= 0 and left >= 0 else -1
        place[3, k] = top * width + right if top >= 0 and right >= 0 else -1


@helper
def fetch(texels, flat, place):
    """Copies of those of a block, corner by corner: a loop that does nothing else waits for many at once."""
    for corner in range(4):
        for k in range(BLOCK):
            number = max(place[corner, k], 0)
            for c in range(4):
                texels[corner, k, c] = flat[number, c]


@helper
def mixed(a, b, c, d, ax, ay):
    """Of four corners."""
    bx, by = ONE - ax, ONE - ay
    return (a * bx + b * ax) * by + (c * bx + d * ax) * ay


@kernel(
    "tracer.materials.textures.bilinear_of_floats",
    [(f4[3], row, row, types.int64, types.int64) for row in (f4[1], f8[1])],
    tables=(0,),
)
def bilinear_of_floats(stored, u, v, along_u, along_v):
    """See the twin."""
    height, width, n = stored.shape[0], stored.shape[1], len(u)
    flat, one = stored.reshape(height * width, 4), u.dtype.type(1)
    result = np.empty((4, n), np.float32)
    place, share, t = (
        np.zeros((4, BLOCK), np.int64),
        np.empty((2, BLOCK), np.float32),
        np.empty((4, BLOCK, 4), np.float32),
    )
    for start in range(0, n, BLOCK):
        find(place, share, start, u, v, height, width, along_u, along_v, one)
        fetch(t, flat, place)
        for k in range(min(BLOCK, n - start)):
            p, q, r, s = place[0, k], place[1, k], place[2, k], place[3, k]
            for c in range(4):
                result[c, start + k] = mixed(
                    t[0, k, c] if p >= 0 else NONE, t[1, k, c] if q >= 0 else NONE,
                    t[2, k, c] if r >= 0 else NONE, t[3, k, c] if s >= 0 else NONE, share[0, k], share[1, k],
                )  # fmt: skip
    return result


@helper
def decoded(value, curve, c):
    """Texels._decode."""
    return curve[value] if c < 3 else F(value) * BYTE


@kernel(
    "tracer.materials.textures.bilinear_of_bytes",
    [(u1[3], f4[1], row, row, types.int64, types.int64) for row in (f4[1], f8[1])],
    tables=(0, 1),
)
def bilinear_of_bytes(stored, curve, u, v, along_u, along_v):
    """See the twin."""
    height, width, n = stored.shape[0], stored.shape[1], len(u)
    flat, one = stored.reshape(height * width, 4), u.dtype.type(1)
    result = np.empty((4, n), np.float32)
    place, share, t = (
        np.zeros((4, BLOCK), np.int64),
        np.empty((2, BLOCK), np.float32),
        np.empty((4, BLOCK, 4), np.uint8),
    )
    for start in range(0, n, BLOCK):
        find(place, share, start, u, v, height, width, along_u, along_v, one)
        fetch(t, flat, place)
        for k in range(min(BLOCK, n - start)):
            p, q, r, s = place[0, k], place[1, k], place[2, k], place[3, k]
            for c in range(4):
                result[c, start + k] = mixed(
                    decoded(t[0, k, c], curve, c) if p >= 0 else NONE,
                    decoded(t[1, k, c], curve, c) if q >= 0 else NONE,
                    decoded(t[2, k, c], curve, c) if r >= 0 else NONE,
                    decoded(t[3, k, c], curve, c) if s >= 0 else NONE,
                    share[0, k], share[1, k],
                )  # fmt: skip
    return result
