"""What all passes together found for each pixel."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32, Float64
from .constants import HALVES_TO_ERROR, SAMPLING_SLOPE
from .forks import shared_zeros
from .sums import LIGHT_PASSES, Sums

Bools = NDArray[np.bool_]
Pixels = NDArray[np.intp]


@dataclass(eq=False)
class Totals:
    """Sums over the samples of n pixels so far.

    radiance : (3, n) float64   seen : (n,) float64 samples that count   residual : (n,) float64 throughput cut off
    samples  : (n,) int32, camera samples taken.
    variance : (n,) float32, estimate of the squared error of the mean, over the channels; NaN where unknown.
    shared   : forked processes may add to them.
    signature, uneven, low, high : of the samples of signed passes, where adaptive sampling asks: the signature (n,) of
               the first, whether others differ from it (n,), and the extremes (3, n) float32 of those that count.
    parts    : light passes, by name: (channels, n) float64 (see `Sums.parts`).
    """

    radiance: Float64
    seen: Float64
    residual: Float64
    samples: NDArray[np.int32]
    variance: Float32
    signature: NDArray[np.uint32] | None
    uneven: Bools | None
    low: Float32 | None
    high: Float32 | None
    parts: dict[str, Float64] = field(default_factory=dict)
    shared: bool = False

    @classmethod
    def zeros(cls, n: int, signed: bool, parts: Iterable[str] = (), shared: bool = False) -> Totals:
        """Nothing yet.

        signed : room for what adaptive sampling asks.   parts : light passes that are wanted.
        shared : with the forked processes that fill it.
        """
        zeros: Callable[..., NDArray[Any]] = shared_zeros if shared else np.zeros
        totals = cls(
            zeros((3, n), np.float64),
            zeros((n,), np.float64),
            zeros((n,), np.float64),
            zeros((n,), np.int32),
            zeros((n,), np.float32),
            zeros((n,), np.uint32) if signed else None,
            zeros((n,), bool) if signed else None,
            zeros((3, n), np.float32) if signed else None,
            zeros((3, n), np.float32) if signed else None,
            {name: zeros((LIGHT_PASSES[name], n), np.float64) for name in parts},
            shared,
        )
        totals.variance.fill(np.nan)
        if totals.low is not None:
            totals.low.fill(np.inf)
        return totals

    def add(self, pixels: Pixels, sums: Sums) -> None:
        """Add a pass over some pixels (each once)."""
        m, g = len(pixels), sums.groups
        radiance, seen = sums.radiance.reshape(3, m, g), sums.seen.reshape(m, g)
        self._estimate(pixels, radiance, seen, sums.count)
        if sums.signatures is not None:
            self._compare(pixels, radiance, seen, sums.signatures.values.reshape(m, g))
        self.radiance[:, pixels] += _sum(radiance)
        self.seen[pixels] += _sum(seen)
        self.residual[pixels] += _sum(sums.residual.reshape(m, g))
        self.samples[pixels] += sums.count
        for name, part in sums.parts.items():
            self.parts[name][:, pixels] += _sum(part.reshape(len(part), m, g))

    def _estimate(self, pixels: Pixels, radiance: Float64, seen: Float64, count: int) -> None:
        """Estimate the variance from the two halves of a pass, or from it and an equal number of samples before it."""
        before = self.samples[pixels]
        if seen.shape[1] > 1:
            variance = mean_variance(radiance, seen)
            variance *= (count / (before + count)) ** (-2 * SAMPLING_SLOPE)
        elif (before == count).all():
            halves = np.stack([self.radiance[:, pixels], radiance[..., 0]], -1)
            variance = mean_variance(halves, np.stack([self.seen[pixels], seen[:, 0]], -1))
        else:
            return
        self.variance[pixels] = np.where(np.isfinite(variance), variance, self.variance[pixels])

    def _compare(self, pixels: Pixels, radiance: Float64, seen: Float64, signature: NDArray[np.uint32]) -> None:
        """Note where signatures (m, g) differ among all samples so far, and how far the samples (3, m, g) spread."""
        assert self.signature is not None
        assert self.uneven is not None
        assert self.low is not None
        assert self.high is not None
        first = np.where(self.samples[pixels] == 0, signature[:, 0], self.signature[pixels])
        self.signature[pixels] = first
        self.uneven[pixels] |= (signature != first[:, None]).any(axis=1)
        counts = seen > 0
        low = np.where(counts, radiance, np.inf).min(axis=-1).astype(np.float32)
        high = np.where(counts, radiance, 0.0).max(axis=-1).astype(np.float32)
        self.low[:, pixels] = np.minimum(self.low[:, pixels], low)
        self.high[:, pixels] = np.maximum(self.high[:, pixels], high)

    def spread(self) -> Float32:
        """Largest contrast (n,) over the channels among the samples of signed passes that count."""
        assert self.low is not None
        assert self.high is not None
        return contrast(np.minimum(self.low, self.high), self.high).max(axis=0)

    def mean(self, pixels: Pixels | slice = slice(None)) -> Float32:
        """(3, m) radiance of pixels: the mean over the samples that count; 0 where none does."""
        return self._over_seen(self.radiance, pixels)

    def mean_residual(self, pixels: Pixels | slice = slice(None)) -> Float32:
        """(m,) throughput that was cut off, in the same mean."""
        return self._over_seen(self.residual, pixels)

    def mean_part(self, name: str) -> Float32:
        """(channels, n) of a light pass, in the same mean; 0 where it is not finite."""
        return np.nan_to_num(self._over_seen(self.parts[name], slice(None)), nan=0.0, posinf=0.0, neginf=0.0)

    def _over_seen(self, sums: Float64, pixels: Pixels | slice) -> Float32:
        seen = self.seen[pixels]
        with np.errstate(all="ignore"):
            return np.asarray((sums[..., pixels] / np.where(seen > 0, seen, 1.0)).astype(np.float32))


NEIGHBOUR_BAND = 1 << 15
"""Pixels whose neighbours are looked at at once."""


def _sum(groups: Float64) -> Float64:
    """Sum over the last axis, one after the other."""
    result: Float64 = groups[..., 0].copy()
    for i in range(1, groups.shape[-1]):
        result += groups[..., i]
    return result


def mean_variance(radiance: Float64, seen: Float64) -> Float32:
    """Squared error (m,) to expect of the mean over the groups (3, m, g), seen (m, g), from how far its halves differ.

    NaN where one half has no sample that counts.
    """
    middle = radiance.shape[-1] // 2
    difference = _sum(radiance[..., :middle]) / _sum(seen[..., :middle])
    difference -= _sum(radiance[..., middle:]) / _sum(seen[..., middle:])
    difference *= difference
    return np.asarray((difference.mean(axis=0) * HALVES_TO_ERROR).astype(np.float32))


def neighbours_rmse(
    mean: Callable[[slice], Float32], traced: NDArray[np.bool_], weight: Float32, wanted: int
) -> float | None:
    """Error to expect of `wanted` pixels with one sample or none, from how far neighbours differ; None: nobody knows.

    A sample is half as far, squared, from the mean that it stands for as from its neighbour's; a pixel that copies a
    neighbour is as far as that is. Where a picture has detail of its own this is more than the error.

    mean : gives (3, m) of a run of pixels.   traced : (h, w) with a sample.   weight : (h, w), the pixel's share.
    """
    squared, pairs, step = 0.0, 0, 1
    height, width = traced.shape
    while pairs == 0 and step < max(traced.shape):
        rows = max(step, NEIGHBOUR_BAND // width)
        for start in range(0, height, rows):  # in bands, or a large picture would need much memory for this
            stop = min(start + rows + step, height)
            part = mean(slice(start * width, stop * width)).reshape(3, stop - start, width)
            known, share = traced[start:stop], weight[start:stop]
            own, below = min(rows, height - start), max(min(rows, height - start - step), 0)
            right = known[:own, :-step] & known[:own, step:], part[:, :own, step:] - part[:, :own, :-step]
            above = slice(step, step + below)
            up = known[:below] & known[above], part[:, above] - part[:, :below]
            for (both, apart), size in ((right, share[:own, :-step]), (up, share[:below])):
                apart *= size
                apart *= apart
                squared += float(apart.mean(axis=0)[both].sum(dtype=np.float64))
                pairs += int(np.count_nonzero(both))
        step *= 2
    if pairs == 0:
        return None
    own_share = np.count_nonzero(traced) / max(wanted, 1)
    return float(np.sqrt(squared / pairs * (own_share / 2 + 1 - own_share)))


def contrast(a: Float32, b: Float32) -> Float32:
    """|a - b| / (a + b), Michelson's; 0 between blacks."""
    both = a + b
    return np.asarray(np.abs(a - b) / np.where(both > 0, both, np.float32(1)))
