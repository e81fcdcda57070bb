# SPDX-License-Identifier: GPL-3.0-or-later
"""The same for elementary functions, the sampler and textures."""

from __future__ import annotations

from typing import Any

import numpy as np

from .inputs import Arguments, Source, arguments_of


def _numbers(dtype: Any, count: int) -> Arguments:
    """Rows of numbers of any size."""

    def make(s: Source) -> tuple[Any, ...]:
        with np.errstate(over="ignore"):
            return tuple((s.numbers(low=-4, high=4) * 10.0 ** s.whole(-3, 7)).astype(dtype) for _ in range(count))

    return make


for dtype in ("float32", "float64"):
    for function in ("exp", "expm1", "log", "log1p", "sincos", "sincos_near_0"):
        arguments_of(f"procedural.elementary.{function}_{dtype}")(_numbers(dtype, 1))
    arguments_of(f"procedural.elementary.arctan2_{dtype}")(_numbers(dtype, 2))
arguments_of("procedural.elementary.power_float64")(_numbers("float64", 2))


@arguments_of("tracer.core.sampler.keyed")
def _(s: Source) -> tuple[Any, ...]:
    pixels = Source(s.rng, 50).whole(0, 2**32, dtype=np.uint32)
    return pixels, 7, 4, s.whole(0, 200), s.whole(0, 2**32, dtype=np.uint32)


@arguments_of("tracer.core.sampler.square_points")
def _(s: Source) -> tuple[Any, ...]:
    parts = 1 if s.n % 2 else 3
    key, number = (s.whole(0, 2**32, dtype=np.uint32) for _ in range(2))
    return key, number, np.uint32(0x9E3779B1), parts - 1, parts


@arguments_of("tracer.core.sampler.disk")
def _(s: Source) -> tuple[Any, ...]:
    return s.numbers(low=0, high=1), s.numbers(low=0, high=1)


def _coordinates(s: Source) -> tuple[Any, ...]:
    """Of either width, far out, too, and the ways in which an image goes on."""
    dtype = np.float64 if s.n % 2 else np.float32
    u, v = (s.numbers(dtype=dtype, low=-2, high=3) for _ in range(2))
    return u, v, int(s.rng.integers(4)), int(s.rng.integers(4))


@arguments_of("tracer.materials.textures.bilinear_of_floats")
def _(s: Source) -> tuple[Any, ...]:
    return np.ascontiguousarray(Source(s.rng, 4, s.stiff).numbers(5, 7)), *_coordinates(s)


@arguments_of("tracer.materials.textures.bilinear_of_bytes")
def _(s: Source) -> tuple[Any, ...]:
    stored = Source(s.rng, 4).whole(0, 256, 3, 6, dtype=np.uint8)
    return stored, Source(s.rng, 256).numbers(low=0, high=1), *_coordinates(s)
