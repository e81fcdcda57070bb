# SPDX-License-Identifier: GPL-3.0-or-later
"""The film: where samples fall, what each gives to the pixels around it, and how pixels without a sample are filled.

Pixel filter: EEVEE's Gaussian w(d) = exp(-0.5 d^2 / (R 0.284)^2) for d < R (eevee_film.cc). A sample counts for every
pixel that its place is within R of, so each pixel is a weighted mean of its own samples and its neighbours': half to a
third of the samples give the same error as with each pixel's own alone. As in EEVEE all pixels are sampled at the same
places within them: their errors then go together, which shows as a smooth edge that is a little off, not as noise; and
the weights are those of the sample's number alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...procedural import elementary
from ...scene import Float32, Float64
from ..core.constants import FILTER_SIGMA
from ..core.sampler import hash32, r2
from ..core.vectors import as_slice, take

Numbers = NDArray[np.intp]

WEIGHT_STEPS = np.float32(2**10)
"""Weights are multiples of 1 / 1024: products with plain colours, and their sums, are then exact in float32."""


class PixelFilter:
    """The filter of one picture: k weights of each sample, for its own pixel first and then for those around it.

    offsets : k pairs (dx, dy), the pixels that a sample of pixel (0, 0) counts for.
    """

    def __init__(self, radius: float, seed: int, spread: bool = True, start: int = 0) -> None:
        """radius: in pixels. spread: False for samples that go through the pixels' centres and count there alone.
        start: where in the pattern the picture's samples begin."""
        self.radius, self.spread, self.start = radius, spread and radius > 0, start
        self._shift = hash32(np.array([seed & 0xFFFFFFFF], np.uint32))
        reach = range(-self.reach, self.reach + 1)
        self.offsets = sorted(((dx, dy) for dy in reach for dx in reach), key=lambda o: (o != (0, 0), o))

    @property
    def reach(self) -> int:
        """So many pixels further, across and up, a sample still counts."""
        return max(0, math.ceil(self.radius - 0.5)) if self.spread else 0

    def places(self, first: int, count: int, spread: bool = True) -> tuple[Float32, Float32]:
        """Where in every pixel, x and y (count,) from its centre, samples first .. first + count - 1 fall.

        The R2 sequence, over the pixel or, if the filter is narrower, over what it covers.
        """
        if not spread:
            return np.zeros(count, np.float32), np.zeros(count, np.float32)
        u, v = r2(self._shift, np.arange(count, dtype=np.uint32) + np.uint32(self.start + first))
        size = np.float32(2 * min(0.5, self.radius))
        return (u - np.float32(0.5)) * size, (v - np.float32(0.5)) * size

    def weights(self, first: int, count: int) -> Float32:
        """(k, count) of samples first .. first + count - 1; in its own pixel a sample always has one."""
        if not self.spread:
            return np.ones((1, count), np.float32)
        x, y = self.places(first, count)
        dx, dy = np.array(self.offsets, np.float32).T[..., None]
        d2 = ((x - dx) ** 2 + (y - dy) ** 2) / np.float32(self.radius) ** 2
        result = np.round(elementary.exp(d2 * np.float32(-0.5 / FILTER_SIGMA**2)) * WEIGHT_STEPS)
        result[1:][d2[1:] >= 1] = 0
        return np.asarray(np.maximum(result, [[1]] + [[0]] * (len(result) - 1)) / WEIGHT_STEPS, np.float32)

    def shares(self) -> Float64:
        """(k,) of a pixel's value that is that of each pixel around it; their sum is 1."""
        if not self.spread:
            return np.ones(1)
        mean = self.weights(0, 1 << 12).mean(axis=1, dtype=np.float64)
        return np.asarray(mean / mean.sum())


@dataclass(frozen=True, eq=False)
class Grid:
    """The n pixels that are traced: those wanted of a window, and those just outside that share samples with them.

    Around them lies a margin, at least as wide as the filter reaches, in which nothing is traced.

    corner : absolute x and y of the lower left place, margin included.   size : (height, width), likewise.
    place  : (n,) where in the grid each pixel is, ascending flat places.
    number : (height width,) which of the n pixels is at each place, -1 for none.
    window : (n,) flat places in the window; -1: just outside.
    """

    corner: tuple[int, int]
    size: tuple[int, int]
    place: NDArray[np.int32]
    number: NDArray[np.int32]
    window: NDArray[np.int32]

    @classmethod
    def of(
        cls,
        window: tuple[int, int, int, int],
        resolution: tuple[int, int],
        wanted: NDArray[np.bool_] | None,
        reach: int,
        rows: slice | None = None,
    ) -> Grid:
        """Of a window (x0, y0, x1, y1) in a frame. wanted: (h, w) bool, or None: all of it. reach: of the filter.
        rows: of the window that the pixels are to lie in; None: all.

        The pixels just outside are those of the frame around the window, and of its other rows those wanted, that
        wanted ones reach: a part then looks as in the whole frame.
        """
        x0, y0, x1, y1 = window
        width, height = x1 - x0, y1 - y0
        start, stop = (0, height) if rows is None else (rows.start, rows.stop)
        margin = 2 * reach  # the pixels just outside, and around them nothing
        below, above = max(start - margin, 0), min(stop + margin, height)  # rows of the window that are in the grid
        inner, columns = slice(margin, margin + stop - start), slice(margin, margin + width)
        whole = slice(margin - (start - below), inner.stop + (above - stop)), columns
        y, x = np.ogrid[y0 + start - margin : y0 + stop + margin, x0 - margin : x1 + margin]
        may = (x >= 0) & (x < resolution[0]) & (y >= 0) & (y < resolution[1])
        may[whole] = True if wanted is None else wanted[below:above]
        inside = np.zeros_like(may)
        inside[inner, columns] = may[inner, columns]
        in_window = np.full(may.shape, -1, np.int32)
        in_window[inner, columns] = np.arange(start * width, stop * width, dtype=np.int32).reshape(stop - start, width)
        traced = inside | (may & grow(inside, reach))
        place = np.flatnonzero(traced).astype(np.int32)
        number = np.full(traced.shape, -1, np.int32)
        number[traced] = np.arange(len(place), dtype=np.int32)
        return cls((x0 - margin, y0 + start - margin), traced.shape, place, number.reshape(-1), in_window[traced])

    def __len__(self) -> int:
        return len(self.place)

    def inside(self) -> Numbers:
        """The numbers of the pixels in the window."""
        return np.flatnonzero(self.window >= 0)

    def at(self, pixels: Numbers) -> tuple[Numbers, Numbers]:
        """Absolute x and y (m,) of pixels (m,), given by their numbers."""
        row, column = np.divmod(self.place[pixels].astype(np.intp), self.size[1])
        return self.corner[0] + column, self.corner[1] + row

    def neighbours(self, pixels: Numbers, offset: tuple[int, int]) -> Numbers:
        """The numbers (m,) of the pixels from which these (m,) are `offset` (dx, dy) away; -1 where none is traced."""
        place = take(self.place, as_slice(pixels)) - np.intp(offset[0] + offset[1] * self.size[1])
        return self.number.take(place, mode="wrap").astype(np.intp)  # none is outside: "wrap" looks for none

    def beside(self, pixels: Numbers, offset: tuple[int, int]) -> NDArray[np.int32]:
        """The numbers (m,) of the pixels that are `offset` (dx, dy) away from these (m,), however far; -1 for none."""
        row, column = np.divmod(self.place[pixels], self.size[1])
        row, column = row + offset[1], column + offset[0]
        there = (row >= 0) & (row < self.size[0]) & (column >= 0) & (column < self.size[1])
        return np.where(there, self.number[np.where(there, row * self.size[1] + column, 0)], np.int32(-1))

    def picture(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (..., n) of the pixels as (..., height, width) of the grid; 0 elsewhere."""
        result = np.zeros((*values.shape[:-1], self.size[0] * self.size[1]), values.dtype)
        result[..., self.place] = values
        return result.reshape(*values.shape[:-1], *self.size)


def reach_of_centres(radius: float) -> int:
    """So many pixels around one whose centre shows a thing, samples that show it may count.

    As far as the filter's radius, in pixels, and one more for what begins between two centres. `PixelFilter.reach` is
    less: it is that of samples, which are known to lie in their own pixel. Over EEVEE's pixels see FILTER_SPILL.
    """
    return math.ceil(radius) + 1


def grow(chosen: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    """Let chosen pixels (h, w) grow by so many in all directions."""
    for axis in (0, 1):
        grown = chosen.copy()
        for shift in range(1, by + 1):
            there, back = [slice(None)] * 2, [slice(None)] * 2
            there[axis], back[axis] = slice(shift, None), slice(None, -shift)
            grown[tuple(there)] |= chosen[tuple(back)]
            grown[tuple(back)] |= chosen[tuple(there)]
        chosen = grown
    return chosen


def fill_from_neighbours(images: Sequence[Float32], known: NDArray[np.bool_], wanted: NDArray[np.bool_]) -> int:
    """Copy the nearest known pixels of images (h, w) or (h, w, n) into the wanted ones, in place; how many were filled.

    Each round lets the known area grow by one pixel, sideways before diagonally, in a fixed order. Only its rim is
    looked at: what is wanted may be far from all that is known.
    """
    height, width = known.shape
    empty = wanted & ~known
    left = int(np.count_nonzero(empty))
    if left == 0:
        return 0
    # Numbers of pixels in a picture with a border of one, which counts as reached and passes nothing on.
    reached = np.ones((height + 2, width + 2), bool)
    reached[1:-1, 1:-1] = known
    row, column = np.nonzero(known & grow(~known, 1))
    rim, across = (row + 1) * (width + 2) + column + 1, width + 2
    reached, asked = reached.reshape(-1), np.pad(empty, 1).reshape(-1)
    nearest = np.arange(reached.size)
    while left and len(rim):
        found = []
        for dy, dx in ((0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)):
            there = rim - (dy * across + dx)
            is_new = ~reached[there]
            there = there[is_new]
            nearest[there], reached[there] = nearest[rim[is_new]], True
            found.append(there)
        rim = np.concatenate(found)
        left -= int(np.count_nonzero(asked[rim]))
    row, column = np.nonzero(empty & reached.reshape(height + 2, -1)[1:-1, 1:-1])
    source = np.unravel_index(nearest[(row + 1) * across + column + 1], (height + 2, width + 2))
    for image in images:
        image[row, column] = image[source[0] - 1, source[1] - 1]
    return len(row)
