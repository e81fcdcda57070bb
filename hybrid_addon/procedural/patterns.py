# SPDX-License-Identifier: GPL-3.0-or-later
"""Checker, Gradient, Wave, Magic, Brick and White Noise. Sources: the nodes' GLSL, gpu_shader_material_tex_*."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import elementary
from .hashes import Array, color_of_floats, of_floats
from .noise import Octaves, fbm, points

TURN = np.float32(2 * np.pi)
NUDGE, SHRINK = np.float32(0.000001), np.float32(0.999999)  # off the borders that lie at whole numbers


def _three(vector: Array) -> Array:
    return np.broadcast_to(np.asarray(vector, np.float32), (3, vector.shape[1]))


# ------------------------------------------------------------------------------------------------ waves


def wave(*inputs: Any) -> Array:
    """(1, n). Inputs: vector, scale, distortion, detail, detail scale, detail roughness, phase;
    data: (type, direction, profile)."""
    vector, scale, distortion, detail, detail_scale, roughness, phase = (np.asarray(a, np.float32) for a in inputs[:-1])
    kind, direction, profile = inputs[-1]
    p = (_three(vector) * scale + NUDGE) * SHRINK
    n = (_bands if kind == "BANDS" else _rings)(p, direction) + phase[0]
    if distortion.any():
        two, none = np.full(1, 2, np.float32), np.zeros(1, np.float32)
        octaves = Octaves(detail[0], roughness[0], two, none, none, True)
        n = n + distortion[0] * (fbm(p * detail_scale, octaves) * 2 - 1)
    if profile == "SIN":
        return np.asarray(0.5 + 0.5 * elementary.sin(n - TURN / 4))[None]
    n = n / TURN
    return np.asarray(n - np.floor(n) if profile == "SAW" else np.abs(n - np.floor(n + 0.5)) * 2)[None]


def _bands(p: Array, direction: str) -> Array:
    return np.asarray(p.sum(axis=0) * 10 if direction == "DIAGONAL" else p["XYZ".index(direction)] * 20)


def _rings(p: Array, direction: str) -> Array:
    rows = [row for row, axis in zip(p, "XYZ", strict=True) if axis != direction]
    return np.sqrt(np.sum([row * row for row in rows], axis=0)) * 20


# ------------------------------------------------------------------------------------------------ magic

Step = tuple[str, Callable[..., Array]]
TURBULENCE: tuple[Step, ...] = (
    ("y", lambda x, y, z: -elementary.cos(x - y + z)),
    ("x", lambda x, y, z: elementary.cos(x - y - z)),
    ("z", lambda x, y, z: elementary.sin(-x - y - z)),
    ("x", lambda x, y, z: -elementary.cos(-x + y - z)),
    ("y", lambda x, y, z: -elementary.sin(-x + y + z)),
    ("y", lambda x, y, z: -elementary.cos(-x + y + z)),
    ("x", lambda x, y, z: elementary.cos(x + y + z)),
    ("z", lambda x, y, z: elementary.sin(x + y - z)),
    ("x", lambda x, y, z: -elementary.cos(-x - y + z)),
    ("y", lambda x, y, z: -elementary.sin(x - y + z)),
)
"""What each further step of the depth makes of one of the three waves."""


def magic(vector: Array, scale: Array, distortion: Array, depth: int) -> Array:
    """(3, n) Color; Fac is its mean."""
    distortion = np.asarray(distortion, np.float32)[0]
    p = np.mod(_three(vector) * scale.astype(np.float32), TURN)
    waves = {
        "x": elementary.sin((p[0] + p[1] + p[2]) * 5),
        "y": elementary.cos((-p[0] + p[1] - p[2]) * 5),
        "z": -elementary.cos((-p[0] - p[1] + p[2]) * 5),
    }
    if depth > 0:
        waves = {name: value * distortion for name, value in waves.items()}
    for name, step in TURBULENCE[:depth]:
        waves[name] = step(**waves) * distortion
    share = np.where(distortion != 0, 2 * distortion, 1)
    return np.stack(np.broadcast_arrays(*(0.5 - waves[name] / share for name in "xyz")))


# ------------------------------------------------------------------------------------------------ bricks


def _bricks(*inputs: Any) -> tuple[Array, Array]:
    """(tint, mortar), (n,) each. Inputs: vector, scale, mortar size, mortar smooth, bias, brick width, row height;
    data: (offset, its frequency, squash, its frequency)."""
    vector, scale, size, smooth, bias, width, height = (np.asarray(a, np.float32) for a in inputs[:-1])
    size, smooth, bias, width, height = size[0], smooth[0], bias[0], width[0], height[0]
    offset, every, squash, squashed = inputs[-1]
    x, y, _ = _three(vector) * scale
    with np.errstate(all="ignore"):
        row = _whole(y / height)
        shift = np.zeros(1, np.float32)
        if every and squashed:
            width = np.where(np.fmod(row, squashed) != 0, width, width * np.float32(squash))
            shift = np.where(np.fmod(row, every) != 0, np.float32(0), width * np.float32(offset))
        number = _whole((x + shift) / width)
    x, y = x + shift - width * number, y - height * row
    tint = np.clip(_integer_noise((row << 16) + (number & 0xFFFF)) + bias, 0, 1)
    edge = np.minimum(np.minimum(x, y), np.minimum(width - x, height - y))
    depth = 1 - edge / np.where(size != 0, size, 1)
    t = np.clip(depth / np.where(smooth != 0, smooth, 1), 0, 1)
    mortar = np.where(edge >= size, 0, np.where(smooth == 0, 1, t * t * (3 - 2 * t)))
    return tint.astype(np.float32), mortar.astype(np.float32)


def _whole(x: Array) -> NDArray[np.int32]:
    return np.clip(np.floor(np.nan_to_num(x)), -(2.0**31), 2.0**31 - 256).astype(np.int32)


def _integer_noise(n: NDArray[np.int32]) -> Array:
    """(n,) in 0..1: Perlin's old one-dimensional noise."""
    word = (n.view(np.uint32) + np.uint32(1013)) & np.uint32(0x7FFFFFFF)
    word = (word >> np.uint32(13)) ^ word
    word = word * (word * word * np.uint32(60493) + np.uint32(19990303)) + np.uint32(1376312589)
    return np.float32(0.5) * ((word & np.uint32(0x7FFFFFFF)).astype(np.float32) / np.float32(1073741824))


def brick(first: Array, second: Array, mortar: Array, *inputs: Any) -> Array:
    """(3, n) Color. Inputs: the three colours, then those of `_bricks`."""
    tint, share = _bricks(*inputs)
    color = _three(first) + (_three(second) - _three(first)) * tint
    return np.asarray(color + (_three(mortar) - color) * share, np.float32)


def brick_factor(*inputs: Any) -> Array:
    """(1, n) Fac: 1 in the mortar."""
    return _bricks(*inputs)[1][None]


# ------------------------------------------------------------------------------------------------ white noise


def white_noise(vector: Array, w: Array, dimensions: int) -> Array:
    """(1, n) Value."""
    return of_floats(*points(vector, w, dimensions))[None]


def white_noise_color(vector: Array, w: Array, dimensions: int) -> Array:
    """(3, n) Color."""
    return color_of_floats(points(vector, w, dimensions))


# ------------------------------------------------------------------------------------------------ checks, gradients


def checker(p: Array, a: Array, b: Array, scale: Array) -> Array:
    """Checker Texture; the shift keeps faces of a unit cube off the boundaries of cells."""
    q = np.floor((p * scale + 1e-6) * 0.9999990).astype(np.int64)
    return np.where(((q[0] + q[1] + q[2]) % 2 == 1)[None], _three(a), _three(b))


def checker_factor(p: Array, scale: Array) -> Array:
    """Fac of Checker Texture."""
    one, nought = np.ones((1, 1), p.dtype), np.zeros((1, 1), p.dtype)
    return checker(p, one, nought, scale)[:1]


def gradient(p: Array, kind: str) -> Array:
    """Gradient Texture."""
    x, y, z = p
    ball = np.maximum(0.999999 - np.sqrt(x * x + y * y + z * z), 0)
    kinds: dict[str, Callable[[], Array]] = {
        "LINEAR": lambda: x,
        "QUADRATIC": lambda: np.maximum(x, 0) ** 2,
        "EASING": lambda: np.clip(x, 0, 1) ** 2 * (3 - 2 * np.clip(x, 0, 1)),
        "DIAGONAL": lambda: (x + y) * 0.5,
        "RADIAL": lambda: elementary.arctan2(y, x) / (2 * np.pi) + 0.5,
        "QUADRATIC_SPHERE": lambda: ball * ball,
        "SPHERICAL": lambda: ball,
    }
    return np.clip(kinds[kind]()[None], 0, 1)
