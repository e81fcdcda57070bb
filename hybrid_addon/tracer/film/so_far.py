# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture that is not done yet, to look at: what the samples so far say, and a coarser picture where there are none.

It takes nothing of the film and leaves nothing there: the picture at the end has the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32
from .picture import ResolvedImage
from .pixels import OWN, RADIANCE, SEEN, PixelBuffer

Bools = NDArray[np.bool_]


class SoFar(Protocol):
    """Makes the picture so far, (h, w, 3) radiance over the window, when it is asked for: that takes a moment."""

    def __call__(self, step: int = 1) -> Float32:
        """step: so many of the window's pixels either way are one of the picture."""


Show = Callable[[SoFar], None]
"""Is told often that there is more to show, on the thread that called the tracer."""


def so_far(image: ResolvedImage, pixel_buffer: PixelBuffer, shape: tuple[int, int], step: int = 1) -> Float32:
    """(h, w, 3) radiance of a window: strips that are done, and of the one in work the pixels' own samples.

    shape : of the window.   step : so many of its pixels either way become one, so that a large picture costs no more.

    Workers may be adding samples meanwhile: a pixel that is just being written to may be wrong until the next time.
    """
    radiance = image.radiance.reshape(*shape, 3)[::step, ::step].copy()
    known = image.known.reshape(shape)[::step, ::step].copy()
    place = pixel_buffer.grid.window
    inside = np.flatnonzero(place >= 0).astype(np.int32)
    sums, counts = np.zeros((3, known.size), np.float32), np.zeros(known.size, np.float32)
    for start in range(0, len(inside), AT_ONCE):
        chosen = inside[start : start + AT_ONCE]
        own = pixel_buffer.given[0, OWN][:, chosen]
        with np.errstate(all="ignore"):
            mean = own[RADIANCE] / own[SEEN]
        there = (own[SEEN] > 0) & np.isfinite(mean).all(axis=0)
        row, column = np.divmod(place[chosen[there]], shape[1])
        block = row // step * known.shape[1] + column // step
        counts += np.bincount(block, minlength=known.size)
        for channel in range(3):
            sums[channel] += np.bincount(block, mean[channel, there], minlength=known.size)
    new = counts > 0
    if step > 1:  # a block in two strips: what is done counts
        new &= ~known.ravel()
    radiance.reshape(-1, 3)[new] = (sums[:, new] / counts[new]).T
    known.reshape(-1)[new] = True
    return fill_coarse(radiance, known)


AT_ONCE = 1 << 17
"""So many pixels in work are looked at together: each takes a hundred bytes meanwhile."""


def fill_coarse(picture: Float32, known: Bools) -> Float32:
    """(h, w, 3), with what is not `known` (h, w) taken from means of larger and larger squares in which anything is."""
    if known.all() or not known.any():
        return picture
    height, width = known.shape
    padding = (0, height % 2), (0, width % 2)
    sums = np.pad(np.where(known[..., None], picture, np.float32(0)), (*padding, (0, 0)))
    counts = np.pad(known.astype(np.float32), padding)
    half = sums.shape[0] // 2, sums.shape[1] // 2
    sums = sums.reshape(half[0], 2, half[1], 2, 3).sum(axis=(1, 3))
    counts = counts.reshape(half[0], 2, half[1], 2).sum(axis=(1, 3))
    coarse = fill_coarse((sums / np.maximum(counts, 1)[..., None]).astype(np.float32), counts > 0)
    shown = coarse.repeat(2, axis=0).repeat(2, axis=1)[:height, :width]
    result: Float32 = np.where(known[..., None], picture, shown)
    return result
