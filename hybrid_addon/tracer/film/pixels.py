# SPDX-License-Identifier: GPL-3.0-or-later
"""What all passes together found for each pixel, and what it gives to the pixels around it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated
from ...procedural import elementary
from ...scene import Float32, Float64
from ..core.constants import HALVES_TO_ERROR, SAMPLING_SLOPE
from ..core.vectors import Index, as_slice, evenly, flatnonzero, take, write
from ..parallel.pool import Zeros
from .adaptive_stats import AdaptiveStats, contrast
from .filter import Grid, PixelFilter
from .samples import LIGHT_AOVS, UNFILTERED, SampleBuffer

Bools = NDArray[np.bool_]
Pixels = NDArray[np.intp]
Source = tuple[Index, NDArray[np.int32]]

RADIANCE, SEEN, RESIDUAL, OWN = slice(0, 3), 3, 4, slice(0, 4)
"""Rows of `PixelBuffer.given`; those of light passes follow."""

GATHER_CHUNK = 1 << 16
"""Pixels that are gathered at once."""

GIVE_CHUNK = 1 << 13
"""Pixels whose samples are weighed at once: they stay in a core's cache."""

ESTIMATED = 1 << 14
"""An error is estimated from about so many pixels, evenly chosen: to a percent of itself."""


@dataclass(eq=False)
class PixelBuffer:
    """What the samples of the n pixels of a grid add up to so far.

    Every pixel holds what it gives: sums of its own samples under the k weights of the filter. What a pixel gets is
    gathered at the end, when all numbers of samples are known. So no one writes to another's pixel, and pixels with few
    samples count for their neighbours as much as those with many.

    given    : (k, c, n) float32; the rows are RADIANCE, SEEN (samples that count), RESIDUAL (throughput cut off) and
               the light passes. Each is summed sample by sample in their order: however passes cut them up, the bits
               are the same.
    rows     : of the light passes, by name (see `SampleBuffer.aovs`).
    samples  : (n,) int32, camera samples taken.
    variance : (n,) float32, estimate of the squared error of the own mean, over the channels; NaN where unknown.
    adaptive : how the samples differ; None: adaptive sampling does not ask.
    """

    grid: Grid
    filter: PixelFilter
    given: Float32
    rows: dict[str, slice]
    samples: NDArray[np.int32]
    variance: Float32
    adaptive: AdaptiveStats | None

    @classmethod
    def zeros(
        cls, grid: Grid, pixel_filter: PixelFilter, adaptive: bool, aovs: Iterable[str] = (), zeros: Zeros = np.zeros
    ) -> PixelBuffer:
        """Nothing yet.

        adaptive : room for what adaptive sampling asks.   aovs : light passes that are wanted.
        zeros    : of those that fill it, `pool.zeros_for`.
        """
        n, c, rows = len(grid), RESIDUAL + 1, {}
        for name in aovs:
            rows[name] = slice(c, c + LIGHT_AOVS[name])
            c += LIGHT_AOVS[name]
        given = zeros((len(pixel_filter.offsets), c, n), np.float32)
        variance = zeros((n,), np.float32)
        variance.fill(np.nan)
        stats = AdaptiveStats.zeros(n, zeros) if adaptive else None
        return cls(grid, pixel_filter, given, rows, zeros((n,), np.int32), variance, stats)

    # ------------------------------------------------------------------------------------------------ adding

    def add(self, pixels: Pixels, sample_buffer: SampleBuffer, first: int) -> None:
        """Add samples first, first + 1, ... of some pixels (m,), each once."""
        count = sample_buffer.count
        weights = self.filter.weights(first, count)
        for start in range(0, len(pixels), GIVE_CHUNK):
            chunk = pixels[start : start + GIVE_CHUNK]
            of_chunk = slice(start * count, (start + GIVE_CHUNK) * count)
            values = np.empty((self.given.shape[1], len(chunk) * count), np.float32)
            values[RADIANCE] = sample_buffer.radiance[:, of_chunk]
            values[SEEN] = sample_buffer.seen[of_chunk]
            values[RESIDUAL] = sample_buffer.residual[of_chunk]
            for name, rows in self.rows.items():
                values[rows] = sample_buffer.aovs[name][:, of_chunk]
            if self.adaptive is not None and sample_buffer.signatures is not None:
                signature = sample_buffer.signatures.values[of_chunk].reshape(-1, count)
                own, is_first = _by_sample(values[OWN], count), self.samples[chunk] == 0
                self.adaptive.add(chunk, own[:, RADIANCE], own[:, SEEN, None] > 0, signature, is_first)
            self._note(chunk, *give(self.given, chunk, values, weights, first), first, count)
        self.samples[pixels] += count

    def _note(self, pixels: Pixels, half: Float32, second: Float32, first: int, count: int) -> None:
        """See how far the halves of what `give` added differ."""
        where = as_slice(pixels)
        if (first + count) // 2 >= first and first + count > 1:
            self._estimate(where, half, second)
        else:
            self.variance[where] *= np.float32(elementary.power(first / (first + count), -2 * SAMPLING_SLOPE))

    def _estimate(self, where: Pixels | slice, first: Float32, second: Float32) -> None:
        """Estimate the variance of own means from halves (4, m) of radiance and samples seen."""
        a, b = first[RADIANCE] / first[SEEN], second[RADIANCE] / second[SEEN]
        difference = (a - b).astype(np.float64)
        variance = ((difference * difference).mean(axis=0) * HALVES_TO_ERROR).astype(np.float32)
        self.variance[where] = np.where(np.isfinite(variance), variance, self.variance[where])
        if self.adaptive is not None:
            self.adaptive.apart[where] = np.nan_to_num(contrast(a, b).max(axis=0))

    # ------------------------------------------------------------------------------------------------ gathering

    def mean(self, pixels: Pixels) -> Float32:
        """(3, m) radiance of pixels: the filtered mean over the samples that count; 0 where none does."""

        def mean(chunk: Pixels) -> Float32:
            sums = self._gathered(self._sources(chunk), OWN)
            return _quotient(sums[RADIANCE], sums[SEEN])

        return _in_chunks(mean, pixels)

    def own_mean(self, pixels: Pixels) -> Float32:
        """The same of the pixels' own samples alone."""
        own = self.given[0, OWN][:, pixels]
        return _quotient(own[RADIANCE], own[SEEN])

    def resolved(self, pixels: Pixels) -> tuple[Float32, Float32, dict[str, Float32], Float32]:
        """Of pixels (m,), all in the same mean: radiance (3, m), residual (m,), light passes and coverage (m,).

        Light passes are 0 where they are not finite. Coverage is the share of the samples that count.
        """
        sources = self._sources(pixels)
        sums, taken = self._gathered(sources, slice(None)), self._all_seen(sources)
        own = {name: self.rows[name] for name in self.rows.keys() & UNFILTERED}
        seen = _or_one(sums[SEEN])
        with np.errstate(all="ignore"):
            light, lost = sums[RADIANCE] / seen, sums[RESIDUAL] / seen
            aovs = {name: np.nan_to_num(sums[rows] / seen, posinf=0, neginf=0) for name, rows in self.rows.items()}
            aovs |= {UNFILTERED[name]: self._own(rows, pixels) for name, rows in own.items()}
            covered = sums[SEEN] / _or_one(taken)
        in_float32 = {name: aov.astype(np.float32) for name, aov in aovs.items()}
        return light.astype(np.float32), lost.astype(np.float32), in_float32, covered.astype(np.float32)

    def _own(self, rows: slice, pixels: Pixels) -> Float32:
        """Means (k, m) of the pixels' own samples; 0 where none counts, or they are not finite."""
        given = self.given[0][:, as_slice(pixels)]
        return np.nan_to_num(_quotient(given[rows], given[SEEN]), posinf=0, neginf=0)

    def seen(self, pixels: Pixels) -> Bools:
        """Whether any sample counts for pixels (m,)."""
        found = take(self.given[0, SEEN], as_slice(pixels)) > 0
        left = flatnonzero(~found)
        for plane, (source, taken) in zip(self.given, self._sources(pixels[left]), strict=True):
            found[left] |= (take(plane[SEEN], source) > 0) & (taken > 0)
        return found

    def variance_of_mean(self, pixels: Pixels) -> Float32:
        """Squared error (m,) to expect of the means of some pixels (m,); NaN where unknown."""
        total, known = np.zeros(len(pixels)), np.zeros(len(pixels))
        for share, offset in zip(self.filter.shares(), self.filter.offsets, strict=True):
            source = self.grid.neighbours(pixels, offset)
            variance = self.variance.take(source, mode="wrap")
            there = np.isfinite(variance) & (source >= 0)
            variance[~there] = 0
            total += share**2 * variance
            known += share * there
        with np.errstate(all="ignore"):
            return np.asarray((total / known**2).astype(np.float32))

    def beside_neighbours(self, weight: Float32 | None) -> Float32:
        """How far the mean of each of the n pixels is from that of the one beside, above or below it that differs most.

        weight : (n,), the pixel's share of the picture; None: 1.
        """
        everything = np.arange(len(self.grid))
        mean, apart = self.mean(everything), np.zeros(len(self.grid), np.float32)
        for offset in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            there = self.grid.neighbours(everything, offset)
            step = np.abs(mean - mean.take(there, axis=1, mode="wrap")).max(axis=0)
            np.maximum(apart, step, out=apart, where=there >= 0)
        return apart if weight is None else apart * weight

    def _gathered(self, sources: list[Source], rows: slice) -> Float64:
        """(c, m): what pixels get from themselves and from those around them, each weighed by its number of samples."""
        shares = 1 / np.maximum(np.arange(_most(sources) + 1), 1)  # by the number of samples
        shares[0] = 0
        result = np.zeros((len(self.given[0, rows]), len(sources[0][1])))
        for plane, (source, taken) in zip(self.given, sources, strict=True):
            share = shares.take(taken)
            for row, values in zip(result, plane[rows], strict=True):
                # All numbers of pixels are valid: "wrap" need not look for others.
                given = values[source] if isinstance(source, slice) else values.take(source, mode="wrap")
                row += given * share
        return result

    def _all_seen(self, sources: list[Source]) -> Float64:
        """(m,): what SEEN would be if all samples counted."""
        most = _most(sources)
        means = np.zeros((len(self.filter.offsets), most + 1))
        np.cumsum(self.filter.weights(0, most), axis=1, out=means[:, 1:])
        means[:, 1:] /= np.arange(1, most + 1)
        result = np.zeros(len(sources[0][1]))
        for table, (_, taken) in zip(means, sources, strict=True):
            result += table.take(taken)
        return result

    def _sources(self, pixels: Pixels) -> list[Source]:
        """For each offset of the filter, the pixels (m,) that give to `pixels` over it, and how many samples they have:
        0 where there is none."""
        found: list[Source] = []
        for offset in self.filter.offsets:
            number = pixels if offset == (0, 0) else self.grid.neighbours(pixels, offset)
            there = number >= 0
            source = self._consecutive(number, there)
            found.append((source, take(self.samples, source) * there))
        return found

    def _consecutive(self, number: NDArray[Any], there: Bools) -> Index:
        """Numbers (m,) of pixels as a slice if they are consecutive where they are `there` (m,): others do not count.

        So those of a full picture are, but for the ends of its rows.
        """
        if len(number) == 0:
            return number
        first = int(np.argmax(there))
        start = int(number[first]) - first
        if start < 0 or start + len(number) > len(self.samples):
            return number
        wanted = np.arange(start, start + len(number), dtype=number.dtype)
        return slice(start, start + len(number)) if ((number == wanted) | ~there).all() else number


def _by_sample(values: Float32, count: int) -> Float32:
    """(count, c, m) of samples (c, m count)."""
    return np.ascontiguousarray(values.reshape(len(values), values.shape[1] // count, count).transpose(2, 0, 1))


@accelerated
def give(given: Float32, pixels: Pixels, values: Float32, weights: Float32, first: int) -> tuple[Float32, Float32]:
    """Add samples first, first + 1, ... of pixels (m,) to what these give (k, c, n), the first ones to nothing.

    values : (c, m count), pixel by pixel; what is no number stays in its own pixel.   weights : (k, count).
    Returns (4, m) of the own samples: the sums of the first half of all samples so far, 0 if that has passed, and of
    those here that are in the second half.
    """
    where, count = as_slice(pixels), weights.shape[1]
    values = _by_sample(values, count)
    sums = np.zeros((len(given), *values.shape[1:]), np.float32) if first == 0 else given[:, :, where]
    sound = values
    if not np.isfinite(values).all():
        sound = np.where(np.isfinite(values).all(axis=1, keepdims=True), values, np.float32(0))
    middle = (first + count) // 2 - first  # the first sample of the second half
    half, second = np.zeros((4, values.shape[2]), np.float32), np.zeros((4, values.shape[2]), np.float32)
    product = np.empty_like(values[0])
    for s in range(count):
        if s == middle:
            half = sums[0, OWN].copy()
        for k in np.flatnonzero(weights[:, s]).tolist():
            np.multiply(values[s] if k == 0 else sound[s], weights[k, s], out=product)
            sums[k] += product
            if k == 0 and s >= middle:
                second += product[OWN]
    if len(pixels) and (first == 0 or not isinstance(where, slice)):
        write(given.reshape(-1, given.shape[-1]), where, sums.reshape(-1, sums.shape[-1]))
    return half, second


def _in_chunks(work: Callable[[Pixels], NDArray[Any]], pixels: Pixels) -> NDArray[Any]:
    """What `work` gives of pixels (m,), (..., m): some of them after the others, or it would need much memory."""
    return np.concatenate(
        [work(pixels[i : i + GATHER_CHUNK]) for i in range(0, max(len(pixels), 1), GATHER_CHUNK)], axis=-1
    )


def _quotient(sums: NDArray[Any], seen: NDArray[Any]) -> Float32:
    """Sums (..., m) over seen (m,); 0 where that is 0."""
    with np.errstate(all="ignore"):
        return np.asarray((sums / _or_one(seen)).astype(np.float32))


def _most(sources: list[Source]) -> int:
    """Samples of any pixel."""
    return max(int(np.max(taken, initial=0)) for _, taken in sources)


def _or_one(a: NDArray[Any]) -> NDArray[Any]:
    """(m,): what is not positive, 1."""
    return np.where(a > 0, a, 1)


def neighbours_rmse(
    mean: Callable[[Pixels], Float32], grid: Grid, traced: Bools, weight: Float32 | None
) -> float | None:
    """Error to expect of n pixels with one sample or none, from how far neighbours differ; None: nobody knows.

    A sample is half as far, squared, from the mean that it stands for as from its neighbour's; a pixel that copies a
    neighbour is as far as that is. Where a picture has detail of its own this is more than the error.

    mean : gives (3, m) of pixels.   traced : (n,) with a sample.   weight : (n,), the pixel's share; None: 1.
    """
    known, step = evenly(traced, ESTIMATED), 1
    while step < max(grid.size):
        squared, pairs = 0.0, 0
        for offset in ((step, 0), (0, step)):
            there = grid.beside(known, offset)
            both = (there >= 0) & traced[there]
            here, next_to = known[both], there[both].astype(np.intp)
            with np.errstate(all="ignore"):  # of infinities
                apart = np.subtract(mean(here), mean(next_to), dtype=np.float64)
                if weight is not None:
                    apart *= weight[here]
                squared += float((apart * apart).mean(axis=0).sum())
            pairs += len(here)
        if pairs:
            own_share = np.count_nonzero(traced) / len(traced)
            return float(np.sqrt(squared / pairs * (own_share / 2 + 1 - own_share)))
        step *= 2
    return None
