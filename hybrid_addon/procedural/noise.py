# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise Texture: Perlin's improved gradient noise (2002) in 1 to 4 dimensions, and the fractals made of it.

Sources: Perlin 2002; Musgrave, in Ebert et al., Texturing and Modeling (multifractals); gpu_shader_material_noise and
_fractal_noise (scales, offsets, the share of a last octave that is not whole).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .hashes import Array, Int32, jenkins, of_numbers, words

Bools = NDArray[np.bool_]

SCALES = (0.25, 0.6616, 0.982, 0.8344)  # that bring Perlin noise of 1 to 4 dimensions to -1..1
PERIOD = np.float32(100000.0)  # the lattice repeats there, before float32 loses the fraction
IMPRECISE = np.float32(1000000.0)  # coordinates beyond have no fraction left: they are taken half way between
MAX_DETAIL = 15.0
FAINT = np.float32(0.001)  # weight below which a hybrid multifractal gets no further octave


def perlin(p: Array) -> Array:
    """(n,) signed noise, about -1..1, at points (d, n)."""
    beyond = np.where(np.abs(p) >= IMPRECISE, np.float32(0.5), np.float32(0))
    p = np.fmod(p, PERIOD) + beyond
    low = np.floor(p)
    fraction, corner = p - low, low.astype(np.int32)
    fade = fraction * fraction * fraction * (fraction * (fraction * 6 - 15) + 10)
    values = [_gradient(corner, fraction, at) for at in product((0, 1), repeat=len(p))]  # the last axis runs fastest
    for axis in reversed(range(len(p))):
        t = fade[axis]
        values = [a + t * (b - a) for a, b in zip(values[::2], values[1::2], strict=True)]
    return np.asarray(values[0] * np.float32(SCALES[len(p) - 1]))


def _gradient(corner: Int32, fraction: Array, at: tuple[int, ...]) -> Array:
    """What the gradient of one corner of the cell adds."""
    h: Array = jenkins(*words(*(corner[i] + np.int32(at[i]) for i in range(len(at)))))
    x = [fraction[i] - np.float32(at[i]) if at[i] else fraction[i] for i in range(len(at))]
    if len(at) == 1:
        return _signed((1 + (h & 7)).astype(np.float32) * x[0], h, 8)
    if len(at) == 2:
        h, first = h & 7, (h & 7) < 4
        return _signed(np.where(first, x[0], x[1]), h, 1) + _signed(2 * np.where(first, x[1], x[0]), h, 2)
    if len(at) == 3:
        h = h & 15
        v = np.where(h < 4, x[1], np.where((h == 12) | (h == 14), x[0], x[2]))
        return _signed(np.where(h < 8, x[0], x[1]), h, 1) + _signed(v, h, 2)
    h = h & 31
    u, v, s = np.where(h < 24, x[0], x[1]), np.where(h < 16, x[1], x[2]), np.where(h < 8, x[2], x[3])
    return _signed(u, h, 1) + _signed(v, h, 2) + _signed(s, h, 4)


def _signed(value: Array, h: Array, bit: int) -> Array:
    """-value where that bit is set."""
    return np.where(h & np.uint32(bit), -value, value)


# ------------------------------------------------------------------------------------------------ fractals


class Octaves:
    """What all fractals are given: detail (1 or n,), roughness, lacunarity, offset, gain, and whether to normalize."""

    def __init__(
        self, detail: Array, roughness: Array, lacunarity: Array, offset: Array, gain: Array, normalize: bool
    ) -> None:
        self.detail = np.clip(np.nan_to_num(detail), 0, MAX_DETAIL).astype(np.float32)
        self.roughness = np.maximum(roughness, 0).astype(np.float32)
        self.lacunarity, self.offset, self.gain, self.normalize = lacunarity, offset, gain, normalize
        self.whole = self.detail.astype(np.int32)
        self.rest = self.detail - self.whole
        self.count = int(np.max(self.whole)) + 1

    def on(self, octave: int) -> Bools:
        """Where that octave counts in full."""
        return np.asarray(octave <= self.whole)


def fbm(p: Array, o: Octaves) -> Array:
    """Fractional Brownian motion: the plain sum of octaves."""
    scale, amplitude, total, result = (np.full(1, x, np.float32) for x in (1, 1, 0, 0))
    for i in range(o.count):
        on = o.on(i)
        result = np.where(on, result + perlin(p * scale) * amplitude, result)
        total = np.where(on, total + amplitude, total)
        amplitude, scale = np.where(on, amplitude * o.roughness, amplitude), np.where(on, scale * o.lacunarity, scale)
    whole = 0.5 * result / total + 0.5 if o.normalize else result
    if not o.rest.any():
        return np.asarray(whole, np.float32)
    more = result + perlin(p * scale) * amplitude
    more = 0.5 * more / (total + amplitude) + 0.5 if o.normalize else more
    return np.asarray(np.where(o.rest > 0, whole + (more - whole) * o.rest, whole), np.float32)


def multifractal(p: Array, o: Octaves) -> Array:
    """The product of octaves."""
    power, value = np.ones(1, np.float32), np.ones(1, np.float32)
    for i in range(o.count):
        on = o.on(i)
        value = np.where(on, value * (power * perlin(p) + 1), value)
        power, p = np.where(on, power * o.roughness, power), np.where(on, p * o.lacunarity, p)
    return np.asarray(value * (o.rest * power * perlin(p) + 1) if o.rest.any() else value)


def hetero_terrain(p: Array, o: Octaves) -> Array:
    """Heterogeneous terrain: octaves weighed by the height so far."""
    power, value = o.roughness, o.offset + perlin(p)
    p = p * o.lacunarity
    for i in range(1, o.count):
        on = o.on(i)
        value = np.where(on, value + (perlin(p) + o.offset) * power * value, value)
        power, p = np.where(on, power * o.roughness, power), np.where(on, p * o.lacunarity, p)
    return np.asarray(value + o.rest * (perlin(p) + o.offset) * power * value if o.rest.any() else value)


def hybrid_multifractal(p: Array, o: Octaves) -> Array:
    """Hybrid multifractal: octaves weighed by all before them, until that weight is faint."""
    power, value = np.ones(1, np.float32), np.zeros(p.shape[1], np.float32)
    weight = np.ones(p.shape[1], np.float32)
    for i in range(o.count):
        on = o.on(i) & (weight > FAINT)
        bounded = np.minimum(weight, 1)
        signal = (perlin(p) + o.offset) * power
        value = np.where(on, value + bounded * signal, value)
        weight = np.where(on, bounded * o.gain * signal, weight)
        power, p = np.where(on, power * o.roughness, power), np.where(on, p * o.lacunarity, p)
    if not o.rest.any():
        return np.asarray(value)
    more = o.rest * np.minimum(weight, 1) * (perlin(p) + o.offset) * power
    return np.asarray(np.where(weight > FAINT, value + more, value))


def ridged_multifractal(p: Array, o: Octaves) -> Array:
    """Ridged multifractal: sharp crests where the noise is 0. Only whole octaves count."""
    signal = (o.offset - np.abs(perlin(p))) ** 2
    value, power = signal, o.roughness
    for i in range(1, o.count):
        on = o.on(i)
        p = p * o.lacunarity
        weight = np.clip(signal * o.gain, 0, 1)
        signal = (o.offset - np.abs(perlin(p))) ** 2 * weight
        value = np.where(on, value + signal * power, value)
        power = power * o.roughness
    return np.asarray(value)


FRACTALS: dict[str, Callable[[Array, Octaves], Array]] = {
    "FBM": fbm,
    "MULTIFRACTAL": multifractal,
    "HETERO_TERRAIN": hetero_terrain,
    "HYBRID_MULTIFRACTAL": hybrid_multifractal,
    "RIDGED_MULTIFRACTAL": ridged_multifractal,
}


# ------------------------------------------------------------------------------------------------ the node


def points(vector: Array, w: Array, dimensions: int) -> Array:
    """(d, n) float32: W alone in one dimension, else the vector's first numbers, and W as the fourth."""
    if dimensions == 1:
        return np.asarray(w[:1], np.float32)
    rows = np.broadcast_to(vector, (3, vector.shape[1])) if len(vector) == 1 else vector[:3]
    if dimensions < 4:
        return np.ascontiguousarray(rows[:dimensions], np.float32)
    return np.concatenate(np.broadcast_arrays(*(row[None] for row in rows), w[:1])).astype(np.float32)


def _offset(seed: int, dimensions: int) -> Array:
    """(d, 1): a place 100 to 200 away on each axis, other noise for each seed."""
    if dimensions == 1:
        places = [of_numbers(float(seed))]
    else:
        places = [of_numbers(float(seed), float(axis)) for axis in range(dimensions)]
    return np.array([[100 + 100 * place] for place in places], np.float32)


def _distorted(p: Array, distortion: Array) -> Array:
    if not distortion.any():
        return p
    moves = np.stack([perlin(p + _offset(seed, len(p))) for seed in range(len(p))])
    return np.asarray(p + moves * distortion)


def _fractal(inputs: tuple[Array, ...], data: tuple[int, str, bool]) -> tuple[Array, Callable[[Array], Array]]:
    vector, w, scale, detail, roughness, lacunarity, offset, gain, distortion = (
        np.asarray(a, np.float32) for a in inputs
    )
    dimensions, kind, normalize = data
    octaves = Octaves(detail[0], roughness[0], lacunarity[0], offset[0], gain[0], normalize)
    p = points(vector, w, dimensions) * scale
    n = max(a.shape[1] for a in (p, distortion, detail, roughness, lacunarity, offset, gain))
    p = np.broadcast_to(p, (dimensions, n))
    return _distorted(p, distortion), lambda place: FRACTALS[kind](place, octaves)


def noise_factor(*inputs: Any) -> Array:
    """(1, n) Fac. Inputs: vector, w, scale, detail, roughness, lacunarity, offset, gain, distortion;
    data: (dimensions, type, normalize)."""
    p, fractal = _fractal(inputs[:-1], inputs[-1])
    return fractal(p)[None]


def noise_color(*inputs: Any) -> Array:
    """(3, n) Color: Fac and the same noise at two other places. Inputs as `noise_factor`."""
    p, fractal = _fractal(inputs[:-1], inputs[-1])
    places = (p, p + _offset(len(p), len(p)), p + _offset(len(p) + 1, len(p)))
    return np.stack([fractal(place) for place in places])
