"""Image textures: bilinear look-up with Blender's extension modes, and the equirectangular environment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32, Float64, Texture
from .constants import MAX_TEXTURE_COORDINATE
from .vectors import Array

Indices = NDArray[np.int64]


def sample_texture(texture: Texture, u: Array, v: Array) -> Float32:
    """RGBA (4, n) of a texture at texture coordinates (n,); its Mapping is applied here."""
    m = texture.uv_transform
    x, y = m[0, 0] * u + m[0, 1] * v + m[0, 2], m[1, 0] * u + m[1, 1] * v + m[1, 2]
    closest = texture.interpolation == "CLOSEST"
    return lookup(texture.pixels, x, y, texture.extension, texture.extension, closest)


def sample_equirect(texture: Texture, direction: Array) -> Float32:
    """Colours (3, n) of an environment image in directions (3, n), any length.

    u = 0.5 - atan2(y, x) / 2 pi, v = 0.5 + atan2(z, hypot(x, y)) / pi (gpu_shader_material_tex_environment.glsl).
    """
    x, y, z = (direction[i].astype(np.float64) for i in range(3))
    u = 0.5 - np.arctan2(y, x) * (0.5 / np.pi)
    v = 0.5 + np.arctan2(z, np.sqrt(x * x + y * y)) * (1 / np.pi)
    return lookup(texture.pixels, u, v, "REPEAT", "EXTEND", texture.interpolation == "CLOSEST")[:3]


def lookup(pixels: Float32, u: Float64, v: Float64, extend_u: str, extend_v: str, closest: bool = False) -> Float32:
    """RGBA (4, n) of pixels (height, width, 4), row 0 at the bottom, at u, v (n,) in 0..1; centres at (i + .5)."""
    height, width = pixels.shape[:2]
    flat = pixels.reshape(-1, 4)
    inside = (np.abs(u) < MAX_TEXTURE_COORDINATE) & (np.abs(v) < MAX_TEXTURE_COORDINATE)  # False for NaN
    x, y = np.where(inside, u, 0.0) * width, np.where(inside, v, 0.0) * height
    if closest:
        ix, jy = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        return _texel(flat, ix, jy, width, height, extend_u, extend_v)
    x, y = x - 0.5, y - 0.5
    fx, fy = np.floor(x), np.floor(y)
    ix, jy = fx.astype(np.int64), fy.astype(np.int64)
    ax, ay = (x - fx).astype(np.float32), (y - fy).astype(np.float32)
    low = _mix(
        _texel(flat, ix, jy, width, height, extend_u, extend_v),
        _texel(flat, ix + 1, jy, width, height, extend_u, extend_v),
        ax,
    )
    high = _mix(
        _texel(flat, ix, jy + 1, width, height, extend_u, extend_v),
        _texel(flat, ix + 1, jy + 1, width, height, extend_u, extend_v),
        ax,
    )
    return _mix(low, high, ay)


def _mix(a: Float32, b: Float32, t: Float32) -> Float32:
    return a * (1 - t) + b * t


def _texel(flat: Float32, i: Indices, j: Indices, width: int, height: int, extend_u: str, extend_v: str) -> Float32:
    """Texels (4, n); outside of a CLIP image they are 0."""
    i, in_u = _wrap(i, width, extend_u)
    j, in_v = _wrap(j, height, extend_v)
    color = np.ascontiguousarray(flat.take(j * width + i, axis=0).T)
    if "CLIP" in (extend_u, extend_v):
        color[:, ~(in_u & in_v)] = 0
    return color


def _wrap(i: Indices, size: int, extension: str) -> tuple[Indices, NDArray[np.bool_]]:
    """Texel numbers brought into 0 .. size - 1, and whether they were there."""
    inside = (i >= 0) & (i < size)
    if extension == "REPEAT":
        return i % size, inside
    if extension == "MIRROR":
        i = i % (2 * size)
        return np.where(i < size, i, 2 * size - 1 - i), inside
    return np.clip(i, 0, size - 1), inside
