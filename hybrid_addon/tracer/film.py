"""The film: where samples fall, and how pixels without a sample are filled.

Pixel filter: EEVEE's Gaussian w(d) = exp(-0.5 d^2 / (R 0.284)^2) for d < R (eevee_film.cc), by importance sampling:
every sample counts the same and its position is distributed like w, so the mean over a pixel's samples is the filtered
value.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32, Float64
from .constants import FILTER_SIGMA
from .sampler import pixel_keys, r2


def film_positions(
    x: NDArray[np.int64], y: NDArray[np.int64], first: int, count: int, seed: int, radius: float
) -> tuple[Float64, Float64]:
    """Film positions (m * count,) of samples first .. first + count - 1 of pixels x, y (m,), pixel by pixel.

    The first dimension of the `sampler`: each pixel shifts the R2 sequence.
    """
    key, number = pixel_keys(x, y, seed), np.arange(first, first + count, dtype=np.uint32)
    u, v = r2(key[:, None], number)
    dx, dy = gaussian_disk(u, v, radius)
    return np.repeat(x + 0.5, count) + dx, np.repeat(y + 0.5, count) + dy


def gaussian_disk(u: Float32, v: Float32, radius: float) -> tuple[Float32, Float32]:
    """Map the unit square to the truncated Gaussian: inverse radial CDF, r = sigma sqrt(-2 ln(1 - u K))."""
    mass = np.float32(1 - math.exp(-0.5 / FILTER_SIGMA**2))
    r = np.sqrt(np.log(1 - u * mass) * np.float32(-2 * (FILTER_SIGMA * radius) ** 2))
    angle = v * np.float32(2 * math.pi)
    return r * np.cos(angle), r * np.sin(angle)


def fill_from_neighbours(images: Sequence[Float32], known: NDArray[np.bool_], wanted: NDArray[np.bool_]) -> int:
    """Copy the nearest known pixels of images (h, w) or (h, w, n) into the wanted ones, in place; how many were filled.

    Each round lets the known area grow by one pixel, sideways before diagonally, in a fixed order.
    """
    empty = wanted & ~known
    if not empty.any():
        return 0
    todo, nearest = empty, np.arange(known.size).reshape(known.shape)
    while todo.any() and known.any():
        grown = known.copy()
        for dy, dx in ((0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)):
            source = _shifted(known, dy, dx) & ~grown
            if source.any():
                rows, columns = np.nonzero(source)
                nearest[rows, columns] = nearest[rows + dy, columns + dx]
                grown |= source
        todo, known = todo & ~grown, grown
    filled = empty & ~todo  # unwanted pixels only pass colours on
    for image in images:
        image[filled] = image.reshape(known.size, -1)[nearest[filled]].reshape(-1, *image.shape[2:])
    return int(np.count_nonzero(filled))


def _shifted(known: NDArray[np.bool_], dy: int, dx: int) -> NDArray[np.bool_]:
    """Whether the pixel at (row + dy, column + dx) is known."""
    h, w = known.shape
    result = np.zeros_like(known)
    result[max(0, -dy) : h - max(0, dy), max(0, -dx) : w - max(0, dx)] = known[
        max(0, dy) : h - max(0, -dy), max(0, dx) : w - max(0, -dx)
    ]
    return result
