# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways of texture coordinates: mapping, and projections of images onto spheres, tubes and boxes."""

from __future__ import annotations

import numpy as np

from . import elementary
from .hashes import Array


def three(a: Array) -> Array:
    """(3, n) of a number or a vector."""
    return np.broadcast_to(a, (3, a.shape[1])) if len(a) == 1 else a[:3]


def affine(p: Array, matrix: Array) -> Array:
    """A (3, 4) matrix, as of a Mapping node, on points of 2 or 3 rows."""
    rows = [*p, *[np.zeros_like(p[0])] * (3 - len(p))]
    return np.stack([m[0] * rows[0] + m[1] * rows[1] + m[2] * rows[2] + m[3] for m in matrix])


def transformed(v: Array, matrix: Array, kind: str) -> Array:
    """A POINT, a VECTOR, or a NORMAL by the inverse matrix (12, n), whose rows of four stand one after the other."""
    v, rows = three(v), matrix.reshape(3, 4, -1)
    turned = (rows[:, :3] * v[:, None]).sum(axis=0) if kind == "NORMAL" else (rows[:, :3] * v).sum(axis=1)
    return turned + rows[:, 3] if kind == "POINT" else turned


def _rotated(p: Array, angles: Array, back: bool = False) -> Array:
    """Turned about X, then Y, then Z (3, n); or back again."""
    for axis in (2, 1, 0) if back else (0, 1, 2):
        s, c = elementary.sincos(-angles[axis] if back else angles[axis])
        rows, (i, j) = list(p), ((axis + 1) % 3, (axis + 2) % 3)
        rows[i], rows[j] = c * p[i] - s * p[j], s * p[i] + c * p[j]
        p = np.stack(np.broadcast_arrays(*rows))
    return p


def mapping(p: Array, location: Array, rotation: Array, scale: Array, kind: str) -> Array:
    """Mapping node, where its settings vary."""
    p, location, rotation, scale = (three(a) for a in (p, location, rotation, scale))
    safe = np.where(scale != 0, scale, 1)
    if kind == "TEXTURE":
        turned = _rotated(p - location, rotation, back=True)
        return np.where(scale != 0, turned / safe, 0)
    turned = _rotated(np.where(scale != 0, p / safe, 0) if kind == "NORMAL" else p * scale, rotation)
    return turned + location if kind == "POINT" else turned


def turned(p: Array, center: Array, rotation: Array, back: bool) -> Array:
    """Vector Rotate by Euler angles."""
    return three(center) + _rotated(three(p) - three(center), three(rotation), back)


def turned_about(p: Array, center: Array, axis: Array, angle: Array) -> Array:
    """Vector Rotate about an axis (Rodrigues); nothing turns about one without length."""
    k, v = _unit(three(axis)), three(p) - three(center)
    s, c = elementary.sincos(angle)
    across = np.stack([k[1] * v[2] - k[2] * v[1], k[2] * v[0] - k[0] * v[2], k[0] * v[1] - k[1] * v[0]])
    rotated = v * c + across * s + k * (k * v).sum(axis=0) * (1 - c)
    return three(center) + np.where((k != 0).any(axis=0), rotated, v)


def wrap_sphere(p: Array) -> Array:
    """Texture coordinates of a sphere in the unit cube."""
    x, y, z = 2 * three(p) - 1
    length = np.maximum(np.sqrt(x * x + y * y + z * z), 1e-30)
    u = np.where((x == 0) & (y == 0), 0, (1 - elementary.arctan2(x, y) / np.pi) / 2)
    return np.stack([u, 1 - elementary.arccos(np.clip(z / length, -1, 1)) / np.pi, np.zeros_like(u)])


def wrap_tube(p: Array) -> Array:
    """Texture coordinates of a tube in the unit cube."""
    x, y, z = 2 * three(p) - 1
    u = np.where((x == 0) & (y == 0), 0, (1 - elementary.arctan2(x, y) / np.pi) / 2)
    return np.stack([u, (z + 1) / 2, np.zeros_like(u)])


def equirect(d: Array) -> Array:
    """Texture coordinates in an equirectangular image: centre +X, u = 0.25 is +Y, v up."""
    x, y, z = three(d).astype(np.float64)
    u, v = 0.5 - elementary.arctan2(y, x) / (2 * np.pi), 0.5 + elementary.arctan2(z, np.sqrt(x * x + y * y)) / np.pi
    return np.stack([u, v, np.zeros_like(u)])


def mirror_ball(d: Array) -> Array:
    """Texture coordinates in the picture of a mirror ball, seen along +Y."""
    x, y, z = _unit(three(d).astype(np.float64))
    share = np.maximum(2 * np.sqrt(np.maximum((1 - y) / 2, 0)), 1e-8)
    return np.stack([x / share / 2 + 0.5, z / share / 2 + 0.5, np.zeros_like(x)])


def box_view(p: Array, normal: Array, axis: int) -> Array:
    """Texture coordinates of a box projection along an axis, mirrored so that no side is inside out."""
    x, y, z = three(p)
    turned = normal[axis] < 0
    u, v = ((y, z), (x, z), (y, x))[axis]
    u = np.where(turned != (axis == 1), 1 - u, u)
    return np.stack([u, v, np.zeros_like(u)])


def box_weights(normal: Array, blend: float) -> Array:
    """Shares of the three views: one for each side, with `blend` a soft change between them."""
    n = np.abs(normal) / np.maximum(np.abs(normal).sum(axis=0, keepdims=True), 1e-30)
    limit = 0.5 * (1 - blend)
    first = np.eye(3)[np.argmax(n, axis=0)].T
    if blend <= 0:
        return first
    two = [np.clip((n[i] / np.maximum(n[i] + n[j], 1e-30) - limit) / blend, 0, 1) for i, j in ((0, 1), (0, 2), (1, 2))]
    soft = np.stack([two[0] * two[1], (1 - two[0]) * two[2], (1 - two[1]) * (1 - two[2])])
    total = soft.sum(axis=0, keepdims=True)
    return np.where(total > 0, soft / np.where(total > 0, total, 1), first)


def _unit(v: Array) -> Array:
    length = np.sqrt((v * v).sum(axis=0, keepdims=True))
    return np.asarray(v / np.where(length > 0, length, 1))
