"""The picture that the totals give: filtered means over the samples that count, failures in pink."""

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
from .pixels import PixelBuffer
from .samples import LIGHT_PASSES


@dataclass(eq=False)
class ResolvedImage:
    """Of the n pixels of a window, those that were traced; threads and processes work on bands of them.

    only_flagged : a pixel has a colour only where a sample counts.
    radiance : (n, 3).   residual, coverage : (n,).   parts : the light passes (n, k), by name.
    wanted   : (n,) bool, what was traced.   known : (n,) bool, of these that have a colour.
    """

    only_ray_traced: bool
    radiance: Float32
    residual: Float32
    coverage: Float32
    parts: dict[str, Float32]
    wanted: NDArray[np.bool_]
    known: NDArray[np.bool_]

    @classmethod
    def zeros(cls, n: int, only_ray_traced: bool, names: Iterable[str], zeros: Zeros) -> ResolvedImage:
        """Nothing yet. names: of the light passes. zeros: of those that fill it, `crew.zeros_for`."""
        parts = {name: zeros((n, LIGHT_PASSES[name]), np.float32) for name in names}
        radiance, residual, coverage = (zeros(shape, np.float32) for shape in ((n, 3), (n,), (n,)))
        return cls(only_ray_traced, radiance, residual, coverage, parts, zeros((n,), np.bool_), zeros((n,), np.bool_))

    def develop(self, pixel_buffer: PixelBuffer, start: int, stop: int) -> Stats:
        """The pixels `start` to `stop` of the totals' grid; how many failed, and how many are negative."""
        stats, window = Stats(), pixel_buffer.grid.window
        with stats.phase("develop"), np.errstate(all="ignore"):
            band = start + np.flatnonzero(window[start:stop] >= 0)
            light, lost, parts, covered = pixel_buffer.resolved(band)
            failed = ~np.isfinite(light).all(axis=0) | ~np.isfinite(lost)
            stats.add("nan_pixels", np.count_nonzero(failed))
            stats.add("negative_radiance", np.count_nonzero((light < 0).any(axis=0)))
            if failed.any():
                light[:, failed] = np.array(FAILED_PIXEL)[:, None]
                lost[failed] = 1
            place = as_slice(window[band])
            self.known[place] = covered > 0 if self.only_ray_traced else pixel_buffer.samples[band] > 0
            self.residual[place], self.coverage[place] = lost, covered
            for channel, values in enumerate(light):
                self.radiance[place, channel] = values
            for name, part in parts.items():
                self.parts[name][place] = part.T
            self.wanted[place] = True
        return stats
