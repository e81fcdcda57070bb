# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive supersampling: which pixels need more samples, and an audit of the decision.

All pixels take FIRST_SAMPLES samples. Those go on whose samples differ among each other, or from a neighbour's, in what
their ray trees met (see `path_hash`) or in contrast. Mitchell (1987) gives the contrast, Genetti, Gordon and Williams
(1998) the signatures. From SECOND_LOOK samples on they stop, at every doubling, if the two halves of their samples
agree and so do those of the pixels around them. It is not exact: what a few samples and eight neighbours miss is
missed. So a random share of the pixels that could stop takes all its samples, and tells how often that happens.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...procedural import elementary
from ...scene import Float32
from ..core.constants import AUDIT_AT_MOST, AUDIT_PIXELS, AUDIT_SHARE, FIRST_SAMPLES, SECOND_LOOK
from ..core.sampler import hash32
from ..film.adaptive_stats import contrast
from ..film.filter import grow
from ..film.pixels import PixelBuffer

Bools = NDArray[np.bool_]
Pixels = NDArray[np.intp]

AUDIT_SALT = np.uint32(0x51ED270B)


def looks(samples: int) -> list[int]:
    """After how many samples of a pixel, below `samples`, it is asked whether it needs more."""
    first = [FIRST_SAMPLES] if samples > FIRST_SAMPLES else []
    doublings = range((max(samples - 1, SECOND_LOOK) // SECOND_LOOK).bit_length())
    return first + [SECOND_LOOK << k for k in doublings if SECOND_LOOK << k < samples]


class Audit:
    """Pixels that could have stopped and go on nevertheless, to see what would have been missed.

    going_on : (n,) bool, which they are so far.
    """

    def __init__(self, pixel_buffer: PixelBuffer, seed: int) -> None:
        """Draw them from all pixels of the buffer, keyed by their absolute places and the seed."""
        n = len(pixel_buffer.grid)
        x, y = pixel_buffer.grid.at(np.arange(n))
        share = min(AUDIT_AT_MOST, max(AUDIT_SHARE, AUDIT_PIXELS / max(n, 1)))
        salt = hash32(np.array([seed & 0xFFFFFFFF], np.uint32) ^ AUDIT_SALT)
        drawn = hash32(x.astype(np.uint32) ^ hash32(y.astype(np.uint32) ^ salt)) < np.uint32(share * 0xFFFFFFFF)
        self.drawn: Bools = drawn
        self.going_on = np.zeros(n, bool)
        self.left_alone = 0
        self._pixels: list[Pixels] = []
        self._before: list[Float32] = []
        self._taken: list[NDArray[np.int32]] = []

    def keep(self, pixel_buffer: PixelBuffer, stopping: Pixels) -> Pixels:
        """Those of the pixels that could stop which are to go on; each is asked for once."""
        kept = stopping[self.drawn[stopping]]
        self.going_on[kept] = True
        self.left_alone += len(stopping)
        self._pixels.append(kept)
        self._before.append(pixel_buffer.own_mean(kept))
        self._taken.append(pixel_buffer.samples[kept])
        return kept

    def result(self, pixel_buffer: PixelBuffer, tolerance: float) -> dict[str, float | int]:
        """How wrong their first samples were: mean and largest error, and the share of pixels beyond the tolerance.

        A time budget may end the picture before they were looked at: only those count that took as many samples again.
        """
        pixels, before = np.concatenate(self._pixels), np.concatenate(self._before, axis=1)
        checked = pixel_buffer.samples[pixels] >= 2 * np.concatenate(self._taken)
        pixels, before = pixels[checked], before[:, checked]
        after = pixel_buffer.own_mean(pixels)
        error = np.abs(after - before).max(axis=0, initial=0.0)
        beyond = int(np.count_nonzero(contrast(after, before).max(axis=0, initial=0.0) > tolerance))
        k = len(pixels)
        return {
            "pixels": k,
            "left_alone": self.left_alone,
            "error_mean": float(error.mean(dtype=np.float64)) if k else 0.0,
            "error_max": float(error.max(initial=0.0)),
            "tolerance": tolerance,
            "beyond": beyond,
            "beyond_share_upper_95": upper_limit(beyond, k),
        }


def choose(pixel_buffer: PixelBuffer, pixels: Pixels, weight: Float32 | None, threshold: float) -> Bools:
    """Which of the pixels (m,) need more than their first samples: (m,) bool.

    weight : (n,) share of the picture that is the pixel's, or None for 1.
    """
    stats = pixel_buffer.adaptive
    assert stats is not None
    grid, everything = pixel_buffer.grid, np.arange(len(pixel_buffer.grid))
    mean = pixel_buffer.mean(everything)
    share = np.ones(len(grid), np.float32) if weight is None else weight
    chosen = stats.uneven | ~pixel_buffer.seen(everything) | (stats.spread() * share > threshold)
    wanted, chosen = grid.picture(np.ones(len(grid), bool)), grid.picture(chosen)
    signature, mean, share = grid.picture(stats.signature), grid.picture(mean), grid.picture(share)
    for here, there in _neighbours():
        both = wanted[here] & wanted[there]
        differs = signature[here] != signature[there]
        step = np.zeros(both.shape, np.float32)
        for channel in mean:
            np.maximum(step, contrast(channel[here], channel[there]), out=step)
        for side in (here, there):
            chosen[side] |= both & (differs | (step * share[side] > threshold))
    return np.asarray(chosen.reshape(-1)[grid.place[pixels]])


def unsettled(pixel_buffer: PixelBuffer, pixels: Pixels, weight: Float32 | None, threshold: float) -> Bools:
    """Which of the pixels (m,) need more samples: they, or one beside them, have halves that differ. (m,) bool."""
    assert pixel_buffer.adaptive is not None
    grid = pixel_buffer.grid
    apart = np.zeros(len(grid), bool)
    share = np.float32(1) if weight is None else weight[pixels]
    apart[pixels] = pixel_buffer.adaptive.apart[pixels] * share > threshold
    return np.asarray(grow(grid.picture(apart), 1).reshape(-1)[grid.place[pixels]])


def _neighbours() -> Iterator[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """Each pair of neighbouring pixels once: to the right, up, and the two diagonals."""
    everything, but_last, but_first = slice(None), slice(None, -1), slice(1, None)
    yield (everything, but_last), (everything, but_first)
    yield (but_last, everything), (but_first, everything)
    yield (but_last, but_last), (but_first, but_first)
    yield (but_last, but_first), (but_first, but_last)


def upper_limit(k: int, n: int, confidence: float = 0.95) -> float:
    """Clopper and Pearson's upper limit of a share of which k in n were seen.

    It is the largest p for which k or fewer are as likely as 1 - confidence.
    """
    if k >= n:
        return 1.0
    i = np.arange(1, k + 1)
    log_choose = np.concatenate([[0.0], np.cumsum(elementary.log((n - i + 1) / i))])
    low, high = 0.0, 1.0
    for _ in range(60):
        p = (low + high) / 2
        terms = log_choose + np.arange(k + 1) * elementary.log(p) + (n - np.arange(k + 1)) * elementary.log1p(-p)
        low, high = (p, high) if elementary.exp(terms).sum() >= 1 - confidence else (low, p)
    return high
