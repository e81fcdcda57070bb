# SPDX-License-Identifier: GPL-3.0-or-later
"""What adaptive sampling asks of the samples of each pixel: whether they differ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32
from ..parallel.pool import Zeros

Bools = NDArray[np.bool_]
Pixels = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class AdaptiveStats:
    """Of n pixels. All but `apart` are of the samples of signed passes.

    apart     : (n,) float32, contrast between the means of the first and the second half of the own samples.
    signature : (n,) uint32, the signature of the first sample.   uneven : (n,) bool, others differ from it.
    low, high : (3, n) float32, the extremes of those that count.
    """

    apart: Float32
    signature: NDArray[np.uint32]
    uneven: Bools
    low: Float32
    high: Float32

    @classmethod
    def zeros(cls, n: int, zeros: Zeros) -> AdaptiveStats:
        """Nothing yet. zeros: of those that fill it, `pool.zeros_for`."""
        low = zeros((3, n), np.float32)
        low.fill(np.inf)
        high, apart = zeros((3, n), np.float32), zeros((n,), np.float32)
        return cls(apart, zeros((n,), np.uint32), zeros((n,), bool), low, high)

    def add(
        self, pixels: Pixels, radiance: Float32, counts: Bools, signature: NDArray[np.uint32], is_first: Bools
    ) -> None:
        """Note where signatures (m, count) differ among all samples so far, and how far radiances spread.

        radiance : (count, 3, m).   counts : (count, 1, m), samples that count.
        is_first : (m,) none were taken before.
        """
        first = np.where(is_first, signature[:, 0], self.signature[pixels])
        self.signature[pixels] = first
        self.uneven[pixels] |= (signature != first[:, None]).any(axis=1)
        low = np.where(counts, radiance, np.float32(np.inf)).min(axis=0)
        high = np.where(counts, radiance, np.float32(0)).max(axis=0)
        self.low[:, pixels] = np.minimum(self.low[:, pixels], low)
        self.high[:, pixels] = np.maximum(self.high[:, pixels], high)

    def spread(self) -> Float32:
        """Largest contrast (n,) over the channels among the samples that count."""
        return contrast(np.minimum(self.low, self.high), self.high).max(axis=0)


def contrast(a: Float32, b: Float32) -> Float32:
    """|a - b| / (a + b), Michelson's; 0 between blacks."""
    both = a + b
    return np.asarray(np.abs(a - b) / np.where(both > 0, both, np.float32(1)))
