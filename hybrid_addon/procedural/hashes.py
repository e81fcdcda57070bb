# SPDX-License-Identifier: GPL-3.0-or-later
"""Hashes that noise is made of: Bob Jenkins' lookup3 (2006), and PCG in 2 to 4 dimensions (Jarzynski & Olano 2020).

All work on arrays of n numbers and wrap around at 32 bits.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

UInt32 = NDArray[np.uint32]
Int32 = NDArray[np.int32]
Array = NDArray[Any]  # of float32

_START = 0xDEADBEEF + 13
_LARGEST = np.float32(0xFFFFFFFF)
_PCG_FACTOR, _PCG_STEP = np.int32(1664525), np.int32(1013904223)
_PCG_MASK, _PCG_LARGEST = np.int32(0x7FFFFFFF), np.float32(0x7FFFFFFF)


def _turned(x: UInt32, bits: int) -> UInt32:
    return (x << np.uint32(bits)) | (x >> np.uint32(32 - bits))


def _mixed(a: UInt32, b: UInt32, c: UInt32) -> tuple[UInt32, UInt32, UInt32]:
    """lookup3's mixing of three words into each other, between one group of them and the next."""
    for bits in (4, 6, 8, 16, 19, 4):
        a = (a - c) ^ _turned(c, bits)
        c = c + b
        a, b, c = b, c, a
    return a, b, c


def jenkins(*words: UInt32) -> UInt32:
    """(n,) uint32 of 1 to 4 words (n,): lookup3's hashword."""
    start = np.uint32((_START + (len(words) << 2)) & 0xFFFFFFFF)
    a, b, c = ((words[i] + start) if i < len(words) else np.full_like(words[0], start) for i in range(3))
    if len(words) == 4:
        a, b, c = _mixed(a, b, c)
        a = a + words[3]
    for bits in (14, 11, 25, 16, 4, 14, 24):
        c = (c ^ b) - _turned(b, bits)
        a, b, c = b, c, a
    return b


def words(*integers: Int32) -> list[UInt32]:
    """Signed integers as the words that `jenkins` takes."""
    return [i.view(np.uint32) for i in integers]


def of_floats(*values: Array) -> Array:
    """(n,) in 0..1 of 1 to 4 floats (n,), by their bits."""
    wide = np.broadcast_arrays(*(np.asarray(value, np.float32) for value in values))
    return jenkins(*(np.ascontiguousarray(value).view(np.uint32) for value in wide)).astype(np.float32) / _LARGEST


def place_of_floats(p: Array) -> Array:
    """(d, n) in 0..1 of points (d, n)."""
    if len(p) == 4:
        return np.stack([of_floats(*np.roll(p, turn, axis=0)) for turn in range(4)])
    return np.stack([of_floats(*p), *(of_floats(*p, np.full_like(p[0], i)) for i in range(1, len(p)))])


def color_of_floats(p: Array) -> Array:
    """(3, n) in 0..1 of points (d, n)."""
    if len(p) < 4:
        return np.stack([of_floats(*p), *(of_floats(*p, np.full_like(p[0], i)) for i in (1, 2))])
    x, y, z, w = p
    return np.stack([of_floats(x, y, z, w), of_floats(z, x, w, y), of_floats(w, z, y, x)])


@functools.cache
def of_numbers(*values: float) -> float:
    """The same of single numbers."""
    return float(of_floats(*(np.full(1, value, np.float32) for value in values))[0])


def pcg(cell: Int32) -> Int32:
    """(d, n) random int32 of cells (d, n), d = 2, 3 or 4; with signed shifts, as Blender has it."""
    v = cell * _PCG_FACTOR + _PCG_STEP
    _pcg_round(v)
    v ^= v >> 16
    _pcg_round(v)
    return v


def _pcg_round(v: Int32) -> None:
    if len(v) == 2:
        v[0] += v[1] * _PCG_FACTOR
        v[1] += v[0] * _PCG_FACTOR
        return
    last = len(v) - 1
    v[0] += v[1] * v[last]
    v[1] += v[2] * v[0]
    v[2] += v[0] * v[1]
    if last == 3:
        v[3] += v[1] * v[2]


def to_unit(bits: Int32) -> Array:
    """Those random numbers in 0..1."""
    return (bits & _PCG_MASK).astype(np.float32) / _PCG_LARGEST
