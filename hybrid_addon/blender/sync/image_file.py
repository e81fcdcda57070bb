# SPDX-License-Identifier: GPL-3.0-or-later
"""Image files -> their pixels as they are stored, by OpenImageIO; and from their colour spaces to scene-linear."""

from __future__ import annotations

import functools
import os
import tempfile
from types import ModuleType
from typing import Any

import bpy
import numpy as np

from ... import memory
from ...scene import Float32
from ...scene.texels import LEAST_ALPHA, Stored, as_floats

WIDTHS = ("uint8", "uint16", "half", "float")  # those that are kept; the others are read as float
SRGB_KNEE = np.float32(0.04045)  # below it the sRGB curve is a line
BAND = 1 << 16  # numbers that are worked on at once: they stay in a core's cache


def read_file(path: str, name: str = "") -> Stored | None:
    """(h, w, 1, 2 or 4) as stored (neither linearised nor premultiplied), row 0 at the bottom; RGB with an alpha of 1.

    uint8, uint16, float16 or float32. None where it cannot be read. Raises NotEnoughMemory, with the `name`.
    """
    oiio = _openimageio()
    if oiio is None or not os.path.isfile(path):
        return None
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(path, hints)
    if source is None:
        oiio.geterror()
        return None
    try:
        spec = source.spec()
        width = str(spec.format) if str(spec.format) in WIDTHS else "float"
        # As read, and then in our order.
        size = 2 * spec.width * spec.height * max(spec.nchannels, 4) * oiio.TypeDesc(width).size()
        memory.require({f"image {name or path!r}": size}, SMALLER_IMAGES)
        pixels = source.read_image(0, 0, 0, spec.nchannels, width)
        channels = _picture_channels(spec.channelnames)
    finally:
        source.close()
    if pixels is None:
        return None
    height, width_in_pixels = pixels.shape[:2]
    return in_texels(pixels.reshape(height, width_in_pixels, -1)[::-1], channels)


SMALLER_IMAGES = "use smaller images"


def read_packed(content: bytes, path: str, name: str = "") -> Stored | None:
    """The same of a file's content; the path tells its kind."""
    with tempfile.TemporaryDirectory(prefix="hybrid_image_", dir=bpy.app.tempdir or None) as folder:
        file = os.path.join(folder, "packed" + os.path.splitext(path)[1])
        with open(file, "wb") as out:
            out.write(content)
        return read_file(file, name or path)


def _picture_channels(names: tuple[str, ...]) -> list[int]:
    """Positions of R, G, B and A; of the first up to four channels where they are called something else."""
    last_part = [name.rsplit(".", 1)[-1].upper() for name in names]
    if {"R", "G", "B"} <= set(last_part):
        return [last_part.index(letter) for letter in "RGBA" if letter in last_part]
    return list(range(min(len(names), 4)))


def in_texels(raw: Stored, channels: list[int] | None = None) -> Stored:
    """Some channels of (h, w, channels) as `Texels` stores them: grey, grey and alpha, RGBA with 1 if it is missing."""
    channels = list(range(raw.shape[2])) if channels is None else channels
    if len(channels) == raw.shape[2] != 3:
        in_order = raw if channels == sorted(channels) else raw[..., channels]
        return np.ascontiguousarray(in_order)
    stored = np.empty((*raw.shape[:2], 4 if len(channels) == 3 else len(channels)), raw.dtype)
    for i, channel in enumerate(channels):
        stored[..., i] = raw[..., channel]
    if len(channels) == 3:
        stored[..., 3] = one(raw.dtype)
    return stored


def one(dtype: np.dtype[Any]) -> int:
    """What stands for 1."""
    return 1 if dtype.kind == "f" else int(np.iinfo(dtype).max)


def _openimageio() -> ModuleType | None:
    try:
        import OpenImageIO
    except ImportError:
        return None
    return OpenImageIO


# ------------------------------------------------------------------------------------------------ colour


def srgb_to_linear(encoded: Float32) -> Float32:
    """The piecewise sRGB curve (IEC 61966-2-1), any shape, float32."""
    flat = np.ascontiguousarray(encoded, np.float32).reshape(-1)
    result = np.empty_like(flat)
    for start in range(0, len(flat), BAND):
        band = flat[start : start + BAND]
        above = np.maximum(band, SRGB_KNEE)
        above += np.float32(0.055)
        above /= np.float32(1.055)
        np.power(above, np.float32(2.4), out=above)
        result[start : start + BAND] = np.where(band <= SRGB_KNEE, band / np.float32(12.92), above)
    return result.reshape(encoded.shape)


@functools.cache
def srgb_curve(dtype: str, divides: bool) -> Float32 | None:
    """`Texels.curve` of sRGB numbers of this type, to be divided by alpha before or not; None: there are too many."""
    if dtype == "uint8" and divides:
        values = as_floats(np.arange(256, dtype=np.uint8))
        alpha = values[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            # No more than 1, as Blender does with bytes: files with more colour than alpha there are.
            return srgb_to_linear(np.where(alpha > LEAST_ALPHA, np.minimum(values / alpha, 1), values))
    if dtype not in ("uint8", "uint16", "float16") or divides:
        return None
    bits = np.arange(256 if dtype == "uint8" else 65536, dtype=np.uint8 if dtype == "uint8" else np.uint16)
    with np.errstate(invalid="ignore"):  # halves that are not numbers
        return srgb_to_linear(as_floats(bits.view(dtype)))


def convert_with_ocio(rgba: Float32, space: str, working: str) -> bool:
    """Convert in place by Blender's own OpenColorIO configuration; False where that fails."""
    oiio = _openimageio()
    if oiio is None:
        return False
    config = os.environ.get("OCIO") or os.path.join(
        bpy.utils.system_resource("DATAFILES"), "colormanagement", "config.ocio"
    )
    colors = oiio.ImageBuf(np.ascontiguousarray(rgba[..., :3]))
    converted = oiio.ImageBufAlgo.colorconvert(colors, space, working, False, "", "", config)
    if converted.has_error:
        converted.geterror()
        return False
    rgba[..., :3] = converted.get_pixels(oiio.FLOAT)
    return True
