# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture that the samples give: filtered means over the samples that count, failures in pink."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32
from ..core.constants import FAILED_PIXEL
from ..core.stats import Stats
from ..core.vectors import as_slice
from ..parallel.pool import Zeros
from .filter import fill_from_neighbours
from .pixels import PixelBuffer
from .samples import LIGHT_AOVS


@dataclass(eq=False)
class ResolvedImage:
    """Of the n pixels of a window, those that were traced; threads and processes fill it chunk by chunk.

    only_ray_traced : a pixel has a colour only where a sample counts.
    radiance : (n, 3).   residual, coverage : (n,).   aovs : the light passes (n, k), by name.
    samples  : (n,), how many each took; (0,): nobody asks.
    wanted   : (n,) bool, what was traced.   known : (n,) bool, of these that have a colour.
    """

    only_ray_traced: bool
    radiance: Float32
    residual: Float32
    coverage: Float32
    aovs: dict[str, Float32]
    samples: Float32
    wanted: NDArray[np.bool_]
    known: NDArray[np.bool_]

    @classmethod
    def zeros(
        cls, n: int, only_ray_traced: bool, names: Iterable[str], asks_samples: bool, zeros: Zeros
    ) -> ResolvedImage:
        """Nothing yet. names: of the light passes. zeros: of those that fill it, `pool.zeros_for`."""
        aovs = {name: zeros((n, LIGHT_AOVS[name]), np.float32) for name in names}
        radiance, residual, coverage = (zeros(shape, np.float32) for shape in ((n, 3), (n,), (n,)))
        samples, wanted, known = zeros((n * asks_samples,), np.float32), zeros((n,), np.bool_), zeros((n,), np.bool_)
        return cls(only_ray_traced, radiance, residual, coverage, aovs, samples, wanted, known)

    def develop(self, pixel_buffer: PixelBuffer, start: int, stop: int) -> Stats:
        """Fill in the pixels `start` to `stop` of the buffer's grid; counts those that failed, or are negative."""
        stats, window = Stats(), pixel_buffer.grid.window
        with stats.phase("develop"), np.errstate(all="ignore"):
            # Of the pixels just outside the window nobody asks.
            chunk = start + np.flatnonzero(window[start:stop] >= 0)
            light, lost, aovs, covered = pixel_buffer.resolved(chunk)
            failed = ~np.isfinite(light).all(axis=0) | ~np.isfinite(lost)
            stats.add("nan_pixels", np.count_nonzero(failed))
            stats.add("negative_radiance", np.count_nonzero((light < 0).any(axis=0)))
            if failed.any():
                light[:, failed] = np.array(FAILED_PIXEL)[:, None]
                lost[failed] = 1
            place = as_slice(window[chunk])
            self.known[place] = covered > 0 if self.only_ray_traced else pixel_buffer.samples[chunk] > 0
            self.residual[place], self.coverage[place] = lost, covered
            for channel, values in enumerate(light):
                self.radiance[place, channel] = values
            for name, aov in aovs.items():
                self.aovs[name][place] = aov.T
            if len(self.samples):
                self.samples[place] = pixel_buffer.samples[chunk]
            self.wanted[place] = True
        return stats

    def fill(self, shape: tuple[int, int]) -> int:
        """Let pixels that have no colour copy the nearest that has; how many there are. shape: (h, w) of the window."""
        radiance, aovs = self.radiance.reshape(*shape, 3), [aov.reshape(*shape, -1) for aov in self.aovs.values()]
        residual, coverage = self.residual.reshape(shape), self.coverage.reshape(shape)
        images = (radiance, residual, *aovs, *(() if self.only_ray_traced else (coverage,)))
        return fill_from_neighbours(images, self.known.reshape(shape), self.wanted.reshape(shape))
