# SPDX-License-Identifier: GPL-3.0-or-later
"""The environment as rough reflections see it: blurred by the GGX lobe, once for each of a few roughnesses.

The lobe is that of a surface seen from straight above (n = v = r), as in split-sum shading (Karis 2013): radiance from
l weighs D(h) n.l, with h half way between n and l. Over longitude this is a convolution, done by Fourier transform;
over latitude it is summed.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from ...procedural import elementary
from ...scene import Float32, Float64
from ..core.vectors import Array

BLUR_ROUGHNESS = (0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0)
"""Steps even in roughness; between them it is interpolated."""
BLUR_ROWS = 64
"""Rows of the blurred images: 2.8 degrees each, the narrowest lobe is 7 wide."""


Rows = Callable[[slice], Float32]
"""Some rows (h, w, channels) of an environment, of which three are colours; those behind them are worked on, too."""

Images = dict[int, Float32]


def levels(roughness: Array) -> Array:
    """Where roughnesses (n,) lie among BLUR_ROUGHNESS, as numbers from 0 to the last."""
    step = BLUR_ROUGHNESS[1] - BLUR_ROUGHNESS[0]
    return np.clip((roughness - BLUR_ROUGHNESS[0]) / step, 0, len(BLUR_ROUGHNESS) - 1)


def needed_levels(low: float, high: float) -> range:
    """Those that roughnesses from `low` to `high` lie between."""
    first, last = levels(np.array([low, high]))
    return range(min(int(first), len(BLUR_ROUGHNESS) - 2), min(int(last) + 2, len(BLUR_ROUGHNESS)))


def blurred(pixels: Rows, size: tuple[int, int], needed: Iterable[int] = range(len(BLUR_ROUGHNESS))) -> Images:
    """One equirectangular image (h, w, 4) for each of some levels, of an environment of that size (h, w)."""
    small = reduced(pixels, size, BLUR_ROWS)
    spectrum = np.fft.rfft(small * _areas(BLUR_ROWS)[:, None, None], axis=1).transpose(1, 0, 2)
    return {i: _lobe_sums(np.ascontiguousarray(spectrum), BLUR_ROUGHNESS[i]) for i in needed}


def reduced(pixels: Rows, size: tuple[int, int], rows: int) -> Float64:
    """Means (rows, 2 rows, 3) over the texels of an equirectangular image in even fields, weighted by solid angle."""
    height, width = size
    tall, wide = _overlaps(height, rows) * _areas(height), _overlaps(width, 2 * rows)
    result = []
    for weights in tall / tall.sum(axis=1, keepdims=True):
        used = np.flatnonzero(weights)
        band = slice(int(used[0]), int(used[-1]) + 1)
        result.append(np.tensordot(weights[band].astype(np.float32), pixels(band), 1)[:, :3])
    # All rows in one product: one for each, of four columns, takes ten times as long.
    across = np.stack(result, axis=1).astype(np.float64).reshape(width, -1)
    return ((wide / wide.sum(axis=1, keepdims=True)) @ across).reshape(2 * rows, rows, -1).transpose(1, 0, 2)


def _overlaps(fine: int, coarse: int) -> Float64:
    """(coarse, fine): share of each of `fine` even parts of a line in each of `coarse` ones."""
    low, high = np.arange(coarse)[:, None] / coarse, np.arange(1, coarse + 1)[:, None] / coarse
    start, end = np.arange(fine)[None] / fine, np.arange(1, fine + 1)[None] / fine
    result: Float64 = np.maximum(np.minimum(high, end) - np.maximum(low, start), 0) * fine
    return result


def _lobe_sums(spectrum: NDArray[np.complex128], roughness: float) -> Float32:
    """(rows, 2 rows, 4): an image under the lobe, at each of its own directions, from its spectrum (k, rows, 3)."""
    rows, columns = spectrum.shape[1], 2 * spectrum.shape[1]
    kernel, weight = _lobe(rows, roughness)
    result = np.ones((rows, columns, 4), np.float32)
    # Real times complex numbers, as pairs: numpy would make the kernel complex, too.
    product = np.matmul(kernel, spectrum.view(np.float64)).view(np.complex128)
    total = np.fft.irfft(product, columns, axis=0).transpose(1, 0, 2)
    result[..., :3] = np.maximum(total / weight[:, None, None], 0)
    return result


@functools.cache
def _lobe(rows: int, roughness: float) -> tuple[Float64, Float64]:
    """The lobe around rows i, in rows j: its spectrum over longitude (k, i, j), real as it is even; its weight (i,)."""
    latitude = (np.arange(rows) + 0.5) / rows * np.pi - np.pi / 2
    turn = np.arange(2 * rows) / rows * np.pi
    level, flat = elementary.sincos(latitude)
    cos = np.multiply.outer(level, level)[..., None] + np.multiply.outer(flat, flat)[..., None] * elementary.cos(turn)
    a2 = roughness * roughness * roughness * roughness
    lobe = np.maximum(cos, 0) * (a2 / ((1 + cos) / 2 * (a2 - 1) + 1)) ** 2
    kernel = np.fft.rfft(lobe, axis=2).real.transpose(2, 0, 1)
    return np.ascontiguousarray(kernel), kernel[0] @ _areas(rows)


def _areas(rows: int) -> Float64:
    """(rows,) solid angles of the rows' fields, but for a factor."""
    return np.diff(elementary.sin(np.linspace(-np.pi / 2, np.pi / 2, rows + 1)))
