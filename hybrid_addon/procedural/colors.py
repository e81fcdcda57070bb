# SPDX-License-Identifier: GPL-3.0-or-later
"""Arithmetic of colours: hue, saturation and value, and the blend types of Mix Color that need more than one step."""

from __future__ import annotations

import numpy as np

from .coordinates import three
from .hashes import Array


def rgb_to_hsv(color: Array) -> Array:
    """Hue, saturation and value, all 0..1."""
    color = three(color)
    high, low = color.max(axis=0), color.min(axis=0)
    spread = high - low
    safe = np.where(spread > 0, spread, 1)
    r, g, b = (high - color) / safe
    hue = np.where(color[0] == high, b - g, np.where(color[1] == high, 2 + r - b, 4 + g - r)) / 6 % 1
    return np.stack([np.where(spread > 0, hue, 0), np.where(high > 0, spread / np.where(high > 0, high, 1), 0), high])


def hsv_to_rgb(hsv: Array) -> Array:
    """Back again."""
    h, s, v = hsv
    ramps = np.stack([np.abs(h * 6 - 3) - 1, 2 - np.abs(h * 6 - 2), 2 - np.abs(h * 6 - 4)])
    result: Array = ((np.clip(ramps, 0, 1) - 1) * s + 1) * v
    return result


def hue_saturation(hue: Array, saturation: Array, value: Array, factor: Array, color: Array) -> Array:
    """Hue/Saturation/Value."""
    h, s, v = rgb_to_hsv(color)
    shifted = np.stack([(h + hue[0] + 0.5) % 1, np.clip(s * saturation[0], 0, 1), v * value[0]])
    result: Array = three(color) + (np.maximum(hsv_to_rgb(shifted), 0) - three(color)) * factor
    return result


def screen(a: Array, b: Array) -> Array:
    """Screen."""
    result: Array = 1 - (1 - a) * (1 - b)
    return result


def overlay(a: Array, b: Array) -> Array:
    """Overlay."""
    return np.where(a < 0.5, 2 * a * b, 1 - 2 * (1 - a) * (1 - b))


def soft_light(a: Array, b: Array) -> Array:
    """Soft Light."""
    result: Array = (1 - a) * b * a + a * screen(a, b)
    return result


def dodge(a: Array, b: Array) -> Array:
    """Color Dodge."""
    return np.where(a == 0, 0, np.where(b >= 1, 1, np.minimum(a / np.where(b < 1, 1 - b, 1), 1)))


def burn(a: Array, b: Array) -> Array:
    """Color Burn."""
    return np.clip(1 - (1 - a) / np.where(b > 0, b, 1e-30), 0, 1)


def ramp(t: Array, table: Array) -> Array:
    """A table (k, 1 or 3) over 0..1, linearly interpolated: what EEVEE does with ColorRamp and curves."""
    x = np.clip(t[0], 0, 1) * (len(table) - 1)
    i = np.minimum(x.astype(np.intp), len(table) - 2)
    f = (x - i).astype(t.dtype)
    low, high = table.take(i, axis=0).T.astype(t.dtype), table.take(i + 1, axis=0).T.astype(t.dtype)
    result: Array = low + (high - low) * f
    return result


def curves_beyond(vector: Array, table: tuple[Array, Array, Array, Array]) -> Array:
    """Curves of Vector Curves: a table (k, 3) from `low` (3,) to `high` (3,), and the slopes (2, 3) that go on beyond.

    table : those four. After gpu_shader_material_curves.glsl (curves_vector).
    """
    values, low, high, slopes = (np.asarray(part, vector.dtype) for part in table)
    v, low, high = three(vector), low[:, None], high[:, None]
    t = (v - low) / (high - low)
    result = curves(t, values)
    result += np.minimum(v - low, 0) * slopes[0][:, None]
    result += np.maximum(v - high, 0) * slopes[1][:, None]
    return result


def curves(color: Array, table: Array) -> Array:
    """Three tables (k, 3), one for each channel."""
    return np.concatenate([ramp(three(color)[i : i + 1], table[:, i : i + 1]) for i in range(3)])
