# SPDX-License-Identifier: GPL-3.0-or-later
"""Gabor Texture: sparse convolution with Gabor kernels.

Sources: Lagae et al. 2009 (the noise), Tavernier et al. 2019 (weights +-1, the sine part), Tricard et al. 2019 (phase
and intensity by complex kernels); gpu_shader_material_tex_gabor (hashes, the window, what normalizes it).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from . import elementary
from .hashes import Array, color_of_floats, of_floats
from .noise import points

IMPULSES = 8  # of each cell
SECOND_MOMENT = 0.5  # of weights +-1, as Blender counts it
ENERGY = {2: 0.25, 3: 1 / (4 * np.sqrt(2))}  # integral of a squared kernel, for high frequencies
SPREAD = 6.0  # standard deviations that are 1
LOWEST_FREQUENCY = 0.001
VALUE, PHASE, INTENSITY = (0, 1), (1, 2), (2, 3)
"""Rows of the outputs in what `gabor_rows` gives."""


def gabor_rows(*inputs: Any) -> Array:
    """(3, n): value, phase, intensity. Inputs: vector, scale, frequency, anisotropy, angle (2D), direction (3D);
    data: dimensions, 2 or 3."""
    vector, scale, frequency, anisotropy, angle, direction = (np.asarray(a, np.float32) for a in inputs[:-1])
    dimensions = inputs[-1]
    p = points(vector, scale, dimensions) * scale
    isotropy = 1 - np.clip(anisotropy[0], 0, 1)
    frequency = np.maximum(frequency[0], np.float32(LOWEST_FREQUENCY))
    base = angle[:1] if dimensions == 2 else _unit(np.broadcast_to(direction, (3, direction.shape[1])))
    real: Array = np.zeros(p.shape[1], np.float32)
    imaginary: Array = np.zeros(p.shape[1], np.float32)
    for away, weight, turned in _impulses(p, isotropy, base):
        squared = (away * away).sum(axis=0)
        envelope = elementary.exp(-np.pi * squared) * (0.5 + 0.5 * elementary.cos(np.pi * squared)) * weight
        envelope = np.where(squared < 1, envelope, 0).astype(np.float32)
        phase = np.float32(2 * np.pi) * frequency * (away * turned).sum(axis=0)
        sine, cosine = elementary.sincos(phase)
        real, imaginary = real + envelope * cosine, imaginary + envelope * sine
    scale_of_one = np.float32(SPREAD * np.sqrt(IMPULSES * SECOND_MOMENT * ENERGY[dimensions]))
    value, length = imaginary / scale_of_one * 0.5 + 0.5, np.sqrt(real * real + imaginary * imaginary)
    return np.stack([value, (elementary.arctan2(imaginary, real) + np.pi) / (2 * np.pi), length / scale_of_one]).astype(
        np.float32
    )


def _impulses(p: Array, isotropy: Array, base: Array) -> Iterator[tuple[Array, Array, Array]]:
    """Of every kernel near the points: the way from its centre (d, n), its weight +-1 (n,), its direction (d, n)."""
    d, low = len(p), np.floor(p)
    local = p - low
    turn = _turned_2d if d == 2 else _turned_3d
    for reversed_offset in product((-1, 0, 1), repeat=d):
        offset = np.array(reversed_offset[::-1], np.float32)[:, None]
        cell = low + offset
        for i in range(IMPULSES):
            direction_seed, place_seed, sign_seed = ((*cell, np.float32(3 * i + j)) for j in range(3))
            weight = np.where(of_floats(*sign_seed) < 0.5, np.float32(-1), np.float32(1))
            yield local - offset - _place(*place_seed), weight, turn(base, isotropy, direction_seed)


def _place(*seed: Array) -> Array:
    """(d, n) random place in a cell."""
    if len(seed) == 3:
        x, y, z = seed
        return np.stack([of_floats(x, y, z), of_floats(z, x, y)])
    return color_of_floats(np.stack(np.broadcast_arrays(*seed)))


def _turned_2d(angle: Array, isotropy: Array, seed: tuple[Array, ...]) -> Array:
    turn = angle[0] + (of_floats(*seed) - np.float32(0.5)) * np.float32(np.pi) * isotropy
    return np.stack(elementary.sincos(turn)[::-1])


def _turned_3d(base: Array, isotropy: Array, seed: tuple[Array, ...]) -> Array:
    """The direction turned by random angles in spherical coordinates."""
    if not isotropy.any():
        return base
    x, y, z, w = seed
    flat = np.sqrt(base[0] ** 2 + base[1] ** 2)
    azimuth = np.sign(base[1]) * elementary.arccos(np.clip(base[0] / np.where(flat > 0, flat, 1), -1, 1))
    inclination = elementary.arccos(np.clip(base[2], -1, 1)) + of_floats(x, y, z, w) * np.float32(np.pi) * isotropy
    azimuth = azimuth + of_floats(z, x, w, y) * np.float32(np.pi) * isotropy
    sine, cosine = elementary.sincos(inclination)
    across, along = elementary.sincos(azimuth)
    turned = np.stack(np.broadcast_arrays(sine * along, sine * across, cosine))
    return np.asarray(np.where(isotropy == 0, base, turned), np.float32)


def _unit(v: Array) -> Array:
    length = np.sqrt((v * v).sum(axis=0, keepdims=True))
    return np.asarray(v / np.where(length > 0, length, 1), np.float32)
