# SPDX-License-Identifier: GPL-3.0-or-later
"""Where samples fall: one low-discrepancy sequence for the film and the lights.

A point of the unit square is a pure function of (seed, absolute pixel, sample, dimension): tiles and threads do not
matter. All dimensions use the R2 sequence (Roberts 2018), shifted by a hash of the pixel and the dimension (Cranley &
Patterson 1976). But for the film's, each takes it in an order of its own, or light samples would follow film samples
around: by an Owen permutation of the sample's number (Laine & Karras 2011; Burley 2020), which maps each block of 2^k
samples onto a block of 2^k.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated
from ...procedural import elementary
from ...procedural.elementary_core import swap
from ...scene import Float32
from .constants import LEAST_RADIUS
from .vectors import Array, Index, take

UInt32 = NDArray[np.uint32]

# R2: fractional parts of n / g and n / g^2, g^3 = g + 1, as 32 bit fixed point numbers.
_G = 1.32471795724474602596
_R2_X = np.uint32(round(2**32 / _G))
_R2_Y = np.uint32(round(2**32 / (_G * _G)))

FACET, LOBE, TRY = np.uint32(0x52D3F1A7), np.uint32(0x1B56C4E9), np.uint32(0x9D2C5681)
"""Dimensions of microfacets (`shading.microfacets`); each try has one of its own."""


def hash32(v: UInt32) -> UInt32:
    """A good mix of 32 bits (Wellons 2018, lowbias32), wrapping."""
    v = v ^ (v >> np.uint32(16))
    v = v * np.uint32(0x7FEB352D)
    v = v ^ (v >> np.uint32(15))
    v = v * np.uint32(0x846CA68B)
    return v ^ (v >> np.uint32(16))


def pixel_keys(x: NDArray[np.int64], y: NDArray[np.int64], seed: int) -> UInt32:
    """What tells the pixels x, y (m,) of the full frame apart: (m,)."""
    salt = hash32(np.array([seed & 0xFFFFFFFF], np.uint32))
    return hash32(x.astype(np.uint32) ^ hash32(y.astype(np.uint32) ^ salt))


def r2(key: UInt32, number: UInt32) -> tuple[Float32, Float32]:
    """Points (n,) of the unit square, 0..1: `number` of the sequence that is shifted by `key`; they broadcast."""
    # float32 is enough from here on: an offset of a pixel is good to 1e-7 of it.
    u = (key + number * _R2_X).ravel().astype(np.float32) * np.float32(2.0**-32)
    v = (hash32(key ^ np.uint32(0x9E3779B9)) + number * _R2_Y).ravel().astype(np.float32) * np.float32(2.0**-32)
    return u, v


def permute(number: UInt32, key: UInt32) -> UInt32:
    """An Owen permutation of the numbers (n,) by keys (n,): each bit is flipped by a hash of the bits above it."""
    v = _reverse(number)
    v = v ^ (v * np.uint32(0x3D20ADEA))
    v = v + key
    v = v * ((key >> np.uint32(16)) | np.uint32(1))
    v = v ^ (v * np.uint32(0x05526C56))
    v = v ^ (v * np.uint32(0x53A22864))
    return _reverse(v)


def _reverse(v: UInt32) -> UInt32:
    """The bits of v (n,) in reverse order."""
    for shift, mask in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F)):
        v = ((v >> np.uint32(shift)) & np.uint32(mask)) | ((v & np.uint32(mask)) << np.uint32(shift))
    return v.byteswap()


@accelerated
def keyed(
    pixels: UInt32, first: int, count: int, sample: NDArray[np.intp], path: UInt32
) -> tuple[UInt32, UInt32]:  # fmt: skip
    """Of samples (n,) of a tile, and the ways (n,) through their trees: keys, and numbers within the pixel, (n,) each.

    pixels, first, count : see `Sampler`.
    """
    pixel = sample // count
    return hash32(pixels.take(pixel) ^ hash32(path)), (first + sample - pixel * count).astype(np.uint32)


@accelerated
def square_points(
    key: UInt32, number: UInt32, dimension: np.uint32, part: int, parts: int
) -> tuple[Float32, Float32]:  # fmt: skip
    """Points (n,) of the unit square: part `part` of the `parts` of samples `number` (n,), in a dimension."""
    key = hash32(key ^ dimension)
    number = number if parts == 1 else number * np.uint32(parts) + np.uint32(part)
    return r2(key, permute(number, hash32(key)))


@dataclass(eq=False)
class Draws:
    """The random numbers of n places in ray trees: worked out for those that ask for some.

    sample : (n,) intp, of the sampler's tile.
    path   : (n,) uint32, the way through the tree.
    parts  : (2, n) uint32, how many parts of a place there are, and which of them this is; None: it is whole.
    """

    sampler: Sampler
    sample: NDArray[np.intp]
    path: UInt32
    parts: UInt32 | None = None

    @property
    def key(self) -> UInt32:
        """(n,) of the pixel and of the way through the tree."""
        return self._keyed[0]

    @cached_property
    def _keyed(self) -> tuple[UInt32, UInt32]:
        return keyed(self.sampler.pixels, self.sampler.first, self.sampler.count, self.sample, self.path)

    @cached_property
    def number(self) -> UInt32:
        """(n,) of the sample within its pixel."""
        number = self._keyed[1]
        return number if self.parts is None else number * self.parts[0] + self.parts[1]

    def take(self, index: Index) -> Draws:
        """Those of the places `index`, in that order."""
        parts = None if self.parts is None else take(self.parts, index)
        return Draws(self.sampler, take(self.sample, index), take(self.path, index), parts)

    def square(self, dimension: np.uint32, part: int = 0, parts: int = 1) -> tuple[Float32, Float32]:
        """Point `part` of the `parts` (n,) that each sample takes of the unit square in a dimension."""
        return square_points(self.key, self.number, np.uint32(dimension), part, parts)


@dataclass(frozen=True, eq=False)
class Sampler:
    """The random numbers of a tile: samples first .. first + count - 1 of pixels, pixel by pixel.

    pixels : (m,) uint32, see `pixel_keys`.
    """

    pixels: UInt32
    first: int
    count: int

    def draws(self, sample: NDArray[np.intp], path: UInt32) -> Draws:
        """Of rays (n,) that belong to samples (n,) of the tile and came on paths (1, n)."""
        return Draws(self, sample, path[0])


@accelerated
def disk(u: Array, v: Array) -> tuple[Array, Array]:
    """Map the unit square to the unit disk, keeping areas: x, y (n,) (Shirley & Chiu 1997)."""
    a, b = 2 * u - 1, 2 * v - 1
    x, y = np.abs(a), np.abs(b)
    # Of one eighth of the square, and its mirror image: there the two change places.
    radius, steep = np.maximum(x, y), y > x
    angle = np.float32(math.pi / 4) * np.minimum(x, y) / np.maximum(radius, np.float32(LEAST_RADIUS))
    sine, cosine = elementary.sincos_near_0(angle)
    swap(steep, sine, cosine)
    return np.copysign(radius * cosine, a), np.copysign(radius * sine, b)
