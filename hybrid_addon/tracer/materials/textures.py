# SPDX-License-Identifier: GPL-3.0-or-later
"""Image textures: bilinear look-up with Blender's extension modes, and the equirectangular environment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated
from ...procedural import elementary
from ...scene import Float32, Texels, Texture
from ...scene.texels import texels_of
from ..core.constants import MAX_TEXTURE_COORDINATE
from ..core.vectors import Array, flatnonzero

Indices = NDArray[np.int64]

EXTENSIONS = ("REPEAT", "EXTEND", "CLIP", "MIRROR")
"""How an image goes on beyond its edges, by the numbers that kernels know them by."""


def sample_texture(texture: Texture, u: Array, v: Array) -> Float32:
    """RGBA (4, n) of a texture at texture coordinates (n,); its Mapping is applied here."""
    m = texture.uv_transform
    x, y = m[0, 0] * u + m[0, 1] * v + m[0, 2], m[1, 0] * u + m[1, 1] * v + m[1, 2]
    closest = texture.interpolation == "CLOSEST"
    along_u, along_v = ("REPEAT", "EXTEND") if texture.extension == "SPHERE" else (texture.extension,) * 2
    found = lookup(texture.pixels, x, y, along_u, along_v, closest)
    if texture.tiles:
        column, row = np.floor(x), np.floor(y)
        for (i, j), pixels in texture.tiles.items():
            here = flatnonzero((column == i) & (row == j))
            if len(here):
                found[:, here] = lookup(pixels, x[here] - i, y[here] - j, "EXTEND", "EXTEND", closest)
    return found


def sample_equirect(texture: Texture, direction: Array) -> Float32:
    """Colours (3, n) of an environment image in directions (3, n), any length."""
    u, v = equirect_coordinates(direction)
    return lookup(texture.pixels, u, v, "REPEAT", "EXTEND", texture.interpolation == "CLOSEST")[:3]


def equirect_coordinates(direction: Array) -> tuple[Float32, Float32]:
    """u, v (n,) of directions (3, n), in float32 as in EEVEE: 1/2000 of a texel of an image 8192 wide.

    u = 0.5 - atan2(y, x) / 2 pi, v = 0.5 + atan2(z, hypot(x, y)) / pi (gpu_shader_material_tex_environment.glsl).
    """
    x, y, z = direction.astype(np.float32, copy=False)
    u = np.float32(0.5) - elementary.arctan2(y, x) * np.float32(0.5 / np.pi)
    return u, np.float32(0.5) + elementary.arctan2(z, np.sqrt(x * x + y * y)) * np.float32(1 / np.pi)


def lookup(
    pixels: Float32 | Texels, u: Array, v: Array, extend_u: str, extend_v: str, closest: bool = False
) -> Float32:
    """RGBA (4, n) of texels, or of pixels (height, width, 4), at u, v (n,) in 0..1; centres at (i + .5).

    Texels are made linear before they are interpolated.
    """
    texels = texels_of(pixels)
    height, width, _ = texels.shape
    clips = "CLIP" in (extend_u, extend_v)
    if closest:
        x, y = _usable(u) * width, _usable(v) * height
        left, bottom = (np.floor(a).astype(np.int64) for a in (x, y))
        return _texel(texels, _wrap(left, width, extend_u), _wrap(bottom, height, extend_v) * width, clips)
    along = EXTENSIONS.index(extend_u), EXTENSIONS.index(extend_v)
    stored, is_rgba = texels.stored, texels.stored.shape[2] == 4 and texels.stored.flags.c_contiguous
    if is_rgba and texels.is_plain:
        return bilinear_of_floats(stored, u, v, *along)
    if is_rgba and stored.dtype == np.uint8 and (curve := texels.only_curve) is not None:
        return bilinear_of_bytes(stored, curve, u, v, *along)
    return _bilinear(texels, u, v, extend_u, extend_v)


@accelerated
def bilinear_of_floats(stored: Float32, u: Array, v: Array, along_u: int, along_v: int) -> Float32:
    """`lookup` in (height, width, 4) float32, which stand for themselves. along_u, along_v: of EXTENSIONS."""
    return _bilinear(Texels(stored), u, v, EXTENSIONS[along_u], EXTENSIONS[along_v])


@accelerated
def bilinear_of_bytes(
    stored: NDArray[np.uint8], curve: Float32, u: Array, v: Array, along_u: int, along_v: int
) -> Float32:  # fmt: skip
    """`lookup` in (height, width, 4) bytes, whose colours stand for what a curve (256,) has."""
    return _bilinear(Texels(stored, curve), u, v, EXTENSIONS[along_u], EXTENSIONS[along_v])


def _bilinear(texels: Texels, u: Array, v: Array, extend_u: str, extend_v: str) -> Float32:
    height, width, _ = texels.shape
    clips = "CLIP" in (extend_u, extend_v)
    x, y = _usable(u) * width, _usable(v) * height
    x -= x.dtype.type(0.5)
    y -= y.dtype.type(0.5)
    fx, fy = np.floor(x), np.floor(y)
    ix, jy = fx.astype(np.int64), fy.astype(np.int64)
    ax, ay = (x - fx).astype(np.float32), (y - fy).astype(np.float32)
    bx, by = 1 - ax, 1 - ay
    left, right = _wrap(ix, width, extend_u), _wrap(ix + 1, width, extend_u)
    bottom, top = _wrap(jy, height, extend_v) * width, _wrap(jy + 1, height, extend_v) * width
    low = _mix(_texel(texels, left, bottom, clips), _texel(texels, right, bottom, clips), bx, ax)
    high = _mix(_texel(texels, left, top, clips), _texel(texels, right, top, clips), bx, ax)
    return _mix(low, high, by, ay)


def _usable(a: Array) -> Array:
    """Coordinates (n,), 0 for those that tell nothing."""
    usable = np.abs(a) < MAX_TEXTURE_COORDINATE  # False for NaN
    return a if usable.all() else np.where(usable, a, a.dtype.type(0))


def _mix(a: Float32, b: Float32, s: Float32, t: Float32) -> Float32:
    """a s + b t, in place of both."""
    a *= s
    b *= t
    a += b
    return a


def _texel(texels: Texels, i: Indices, row: Indices, clips: bool) -> Float32:
    """Texels (4, n), their rows times the width; 0 outside of an image that clips, where a number is negative."""
    color = texels.take(row + i)
    if clips:
        outside = flatnonzero((i < 0) | (row < 0))
        for channel in color:
            channel[outside] = 0
    return color


def _wrap(i: Indices, size: int, extension: str) -> Indices:
    """Texel numbers brought into 0 .. size - 1; -1 outside of a CLIP image."""
    outside = flatnonzero((i < 0) | (i >= size))
    if len(outside) == 0:
        return i
    i, strays = i.copy(), i[outside]
    if extension == "REPEAT":
        strays %= size
    elif extension == "MIRROR":
        strays %= 2 * size
        strays = np.where(strays < size, strays, 2 * size - 1 - strays)
    else:
        strays = np.full_like(strays, -1) if extension == "CLIP" else np.clip(strays, 0, size - 1)
    i[outside] = strays
    return i
