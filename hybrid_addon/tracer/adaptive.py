"""Adaptive supersampling: which pixels need all their samples, and an audit of the decision.

All pixels take FIRST_SAMPLES samples. Those go on whose samples differ among each other, or from a neighbour's, in what
their ray trees met (see `signature`) or in contrast. Mitchell (1987) gives the contrast, Genetti, Gordon and Williams
(1998) the signatures. It is not exact: what four samples and eight neighbours miss is missed. So a random share of the
pixels that were left alone takes all its samples too, and tells how often that happens.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32
from .constants import AUDIT_AT_MOST, AUDIT_PIXELS, AUDIT_SHARE
from .sampler import hash32
from .totals import Totals, contrast

Bools = NDArray[np.bool_]
Pixels = NDArray[np.intp]

AUDIT_SALT = np.uint32(0x51ED270B)


@dataclass(eq=False)
class Audit:
    """Pixels (k,) that could have been left alone, and what four samples made of them (3, k)."""

    pixels: Pixels
    before: Float32
    left_alone: int

    def result(self, totals: Totals, tolerance: float) -> dict[str, float | int]:
        """How wrong the four samples were: mean and largest error, and the share of pixels beyond the tolerance."""
        after = totals.mean(self.pixels)
        error = np.abs(after - self.before).max(axis=0, initial=0.0)
        beyond = int(np.count_nonzero(contrast(after, self.before).max(axis=0, initial=0.0) > tolerance))
        k = len(self.pixels)
        return {
            "pixels": k,
            "left_alone": self.left_alone,
            "error_mean": float(error.mean(dtype=np.float64)) if k else 0.0,
            "error_max": float(error.max(initial=0.0)),
            "tolerance": tolerance,
            "beyond": beyond,
            "beyond_share_upper_95": upper_limit(beyond, k),
        }


def choose(totals: Totals, pixels: Pixels, size: tuple[int, int], weight: Float32 | None, threshold: float) -> Bools:
    """Which of the pixels need more samples: (len(pixels),) bool. size: (height, width).

    weight : (height * width,) share of the picture that is the pixel's, or None for 1.
    """
    assert totals.signature is not None and totals.uneven is not None
    wanted = np.zeros(size, bool)
    wanted.reshape(-1)[pixels] = True
    share = np.ones(size, np.float32) if weight is None else weight.reshape(size)
    spread = totals.spread().reshape(size) * share
    chosen = ((totals.uneven | (totals.seen == 0)).reshape(size) | (spread > threshold)) & wanted
    signature, mean = totals.signature.reshape(size), totals.mean().reshape(3, *size)
    for here, there in _neighbours():
        both = wanted[here] & wanted[there]
        differs = signature[here] != signature[there]
        step = np.zeros(both.shape, np.float32)
        for channel in mean:
            np.maximum(step, contrast(channel[here], channel[there]), out=step)
        for side in (here, there):
            chosen[side] |= both & (differs | (step * share[side] > threshold))
    return np.asarray(chosen.reshape(-1)[pixels])


def _neighbours() -> Iterator[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """Each pair of neighbouring pixels once: to the right, up, and the two diagonals."""
    everything, but_last, but_first = slice(None), slice(None, -1), slice(1, None)
    yield (everything, but_last), (everything, but_first)
    yield (but_last, everything), (but_first, everything)
    yield (but_last, but_last), (but_first, but_first)
    yield (but_last, but_first), (but_first, but_last)


def audit(totals: Totals, left_alone: Pixels, x: NDArray[np.intp], y: NDArray[np.intp], seed: int) -> Audit:
    """Draw pixels to check, keyed by their absolute places x, y and the seed."""
    n = len(left_alone)
    share = min(AUDIT_AT_MOST, max(AUDIT_SHARE, AUDIT_PIXELS / max(n, 1)))
    salt = hash32(np.array([seed & 0xFFFFFFFF], np.uint32) ^ AUDIT_SALT)
    drawn = hash32(x.astype(np.uint32) ^ hash32(y.astype(np.uint32) ^ salt)) < np.uint32(share * 0xFFFFFFFF)
    pixels = left_alone[drawn]
    return Audit(pixels, totals.mean(pixels), n)


def upper_limit(k: int, n: int, confidence: float = 0.95) -> float:
    """Clopper and Pearson's upper limit of a share of which k in n were seen.

    It is the largest p for which k or fewer are as likely as 1 - confidence.
    """
    if k >= n:
        return 1.0
    i = np.arange(1, k + 1)
    log_choose = np.concatenate([[0.0], np.cumsum(np.log((n - i + 1) / i))])
    low, high = 0.0, 1.0
    for _ in range(60):
        p = (low + high) / 2
        terms = log_choose + np.arange(k + 1) * math.log(p) + (n - np.arange(k + 1)) * math.log1p(-p)
        low, high = (p, high) if np.exp(terms).sum() >= 1 - confidence else (low, p)
    return high
