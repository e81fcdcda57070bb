# SPDX-License-Identifier: GPL-3.0-or-later
"""The texels of an image in the width that they are stored in, made scene-linear where they are looked up.

An 8-bit image of 4096 x 4096 takes 64 MB so, a grey one 16 MB; as four float32 of each texel it would be 256 MB.
RGB is stored with an alpha of 1, as EEVEE and Cycles do: three numbers that lie together take twice the time to fetch.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .numbers import Float32

Stored = NDArray[Any]

LEAST_ALPHA = np.float32(1e-8)
"""Colour is not divided by less: under an associated alpha of nearly 0 nothing of it is left to be found."""

BAND = 1 << 20
"""Texels that are decoded at once where all of an image is asked for: 16 MB."""


@dataclass(frozen=True, eq=False)
class Texels:
    """An image: (height, width) texels that stand for RGBA, scene-linear, straight alpha, row 0 at the bottom.

    stored   : (height, width, channels) uint8, uint16, float16 or float32: grey, grey and alpha, or RGBA. Whole
               numbers stand for 0..1.
    curve    : scene-linear values of the colour channels by their bits, float32: (256,) of uint8, (65536,) of uint16
               and float16. (256, 256) of uint8 by alpha and value. None: they are linear.
    divides  : colour is stored multiplied by alpha (associated), and divided by it after `curve`.
    multiplies : last of all it is multiplied by alpha, which then counts as 1.
    """

    stored: Stored
    curve: Float32 | None = None
    divides: bool = False
    multiplies: bool = False

    @property
    def shape(self) -> tuple[int, int, int]:
        """(height, width, 4), as of the array that it stands for."""
        height, width = self.stored.shape[:2]
        return height, width, 4

    @property
    def nbytes(self) -> int:
        """Bytes of what is stored."""
        return self.stored.nbytes

    @property
    def has_alpha(self) -> bool:
        """Whether alpha is stored."""
        return self.stored.shape[2] in (2, 4)

    @cached_property
    def is_opaque(self) -> bool:
        """Whether alpha is 1 everywhere."""
        one = 1 if self.stored.dtype.kind == "f" else np.iinfo(self.stored.dtype).max
        return self.multiplies or not self.has_alpha or bool((self.stored[..., -1] == one).all())

    def multiplied(self) -> Texels:
        """The same texels multiplied by alpha, which then is 1."""
        return self if self.is_opaque else replace(self, multiplies=True)

    def rgba(self, rows: slice = slice(None)) -> Float32:
        """(rows, width, 4) float32 of some rows, all of them if none are named; not to be written to."""
        stored = self.stored[rows]
        if self.is_plain:
            return stored
        result = np.empty((*stored.shape[:2], 4), np.float32)
        self._decode([stored[..., i] for i in range(stored.shape[2])], [result[..., i] for i in range(4)])
        return result

    def bands(self) -> Iterator[Float32]:
        """All of it as `rgba` gives it, some rows at a time."""
        height, width, _ = self.shape
        step = max(1, BAND // max(1, width))
        for start in range(0, height, step):
            yield self.rgba(slice(start, start + step))

    def take(self, index: NDArray[np.int64]) -> Float32:
        """RGBA (4, n) float32 of texels by number (n,): row times width plus column. Others are wrapped into them."""
        channels = self.stored.shape[2]
        flat = self.stored.reshape(-1, channels)
        found = flat.take(index, axis=0, mode="wrap")
        if self.is_plain:
            return np.ascontiguousarray(found.T)
        result = np.empty((4, len(index)), np.float32)
        self._decode(list(found.T), list(result))
        return result

    @property
    def is_plain(self) -> bool:
        """Whether RGBA is stored as it is."""
        stands = self.curve is None and not self.divides and not self.multiplies
        return stands and self.stored.dtype == np.float32 and self.stored.shape[2] == 4

    @property
    def only_curve(self) -> Float32 | None:
        """The curve of one argument that is all that makes colours of what is stored, if it is."""
        curve = self.curve
        return None if curve is None or curve.ndim != 1 or self.divides or self.multiplies else curve

    def _decode(self, stored: Sequence[Stored], rgba: Sequence[Float32]) -> None:
        """Fill four arrays from those of the stored channels, of the same shape."""
        alpha = stored[-1] if self.has_alpha else None
        colors = stored[:-1] if self.has_alpha else stored
        for channel, result in zip(colors, rgba, strict=False):
            self._color(channel, alpha, result)
        if alpha is None:
            rgba[3][...] = 1
        else:
            _linear(alpha, rgba[3])
        for result in rgba[: len(colors)] if alpha is not None else ():
            if self.divides:
                np.divide(result, rgba[3], out=result, where=rgba[3] > LEAST_ALPHA)
            if self.multiplies:
                np.multiply(result, rgba[3], out=result)
        if self.multiplies:
            rgba[3][...] = 1
        for result in rgba[len(colors) : 3]:
            result[...] = rgba[0]

    def _color(self, channel: Stored, alpha: Stored | None, result: Float32) -> None:
        if self.curve is None:
            _linear(channel, result)
        elif self.curve.ndim == 2:
            assert alpha is not None
            self.curve.reshape(-1).take(alpha.astype(np.intp) * 256 + channel, mode="clip", out=result)
        else:
            bits = channel.view(np.uint16) if channel.dtype == np.float16 else channel
            self.curve.take(bits, mode="clip", out=result)  # nothing to clip: not to be checked takes half the time


def texels_of(pixels: Float32 | Texels) -> Texels:
    """A plain array (height, width, 4) float32 as the texels that it is."""
    return pixels if isinstance(pixels, Texels) else Texels(pixels)


def as_floats(stored: Stored) -> Float32:
    """What numbers stand for, of any shape: whole numbers for 0..1."""
    result = np.empty(stored.shape, np.float32)
    _linear(stored, result)
    return result


def _linear(stored: Stored, result: Float32) -> None:
    """As OpenImageIO and Blender do it: times 1 / 255, rounded to float32, not divided by 255."""
    if stored.dtype.kind == "u":
        np.multiply(stored, np.float32(1) / np.float32(np.iinfo(stored.dtype).max), out=result, dtype=np.float32)
    else:
        result[...] = stored
