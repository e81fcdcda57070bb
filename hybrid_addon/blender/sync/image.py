# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's images -> (height, width, 4) float32 pixels: scene-linear, straight alpha, row 0 at the bottom.

Files are read with OpenImageIO, at their own precision. What exists only inside Blender (packed, generated or painted
images) and what OpenImageIO cannot read comes from `Image.pixels`.
"""

from __future__ import annotations

import contextlib
import os
import re
import tempfile
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import bpy
import numpy as np

from ...scene import Float32
from .cache import MeshCache
from .coverage.status import FIRST
from .messages import Warnings

MISSING_COLOR = (1.0, 0.0, 1.0, 1.0)  # the pink that Blender shows for a missing image
FIRST_TILE = 1001  # of a tiled image: column 0, row 0; ten columns a row
FLOAT_ALPHA_MIN = 1e-8  # below it the colour under a premultiplied alpha cannot be recovered
NO_CONVERSION = ("", "Raw", "Non-Color", "scene_linear")
SRGB_KNEE = np.float32(0.04045)  # below it the sRGB curve is a line
BAND = 1 << 16  # numbers that are worked on at once: they stay in a core's cache
SRGB_WORKING_SPACES = ("Linear Rec.709", "scene_linear")  # those to which the sRGB curve alone leads


class Images:
    """Reads each image once. `None` in the cache stands for one that is missing."""

    def __init__(self, warn: Warnings, kept: MeshCache | None = None) -> None:
        self._warn = warn
        self._kept = MeshCache() if kept is None else kept
        self._pixels: dict[tuple[str, str], Float32] = {}
        self._tiles: dict[str, dict[tuple[int, int], Float32]] = {}

    def pixels(self, b_image: bpy.types.Image, b_image_user: bpy.types.ImageUser | None = None) -> Float32:
        """(height, width, 4) float32; a single pink pixel, and a warning, where the image cannot be read."""
        path = _file_of(b_image, b_image_user)
        key = (b_image.name_full, path)
        if key not in self._pixels:
            self._pixels[key] = self._read(b_image, path)
        return self._pixels[key]

    def tiles(self, b_image: bpy.types.Image) -> dict[tuple[int, int], Float32]:
        """The tiles of a tiled image, by column and row; a warning for each that cannot be read, which is left out."""
        found = self._tiles.setdefault(b_image.name_full, {})
        if found:
            return found
        with _saved(b_image) as path:
            for number in sorted(b_tile.number for b_tile in b_image.tiles):
                tile = tile_path(path, number)
                pixels = self._of_file(b_image, tile)
                if pixels is None:
                    self._warn.add(f"image {b_image.name!r}: cannot read its tile {number}; it is drawn pink")
                else:
                    found[(number - FIRST_TILE) % 10, (number - FIRST_TILE) // 10] = pixels
        return found

    def _read(self, b_image: bpy.types.Image, path: str) -> Float32:
        if b_image.source == "MOVIE":
            self._warn.add(f"image {b_image.name!r}: only the current frame of it is used")
        pixels = None if _lives_in_blender(b_image) else self._of_file(b_image, path)
        if pixels is None:
            pixels = self._of_blender(b_image)
        if pixels is not None:
            return pixels
        self._warn.add(f"image {b_image.name!r}: cannot read {repr(path) if path else 'it'}; it is drawn pink", FIRST)
        return np.full((1, 1, 4), MISSING_COLOR, np.float32)

    def _of_file(self, b_image: bpy.types.Image, path: str) -> Float32 | None:
        """Its pixels in that file, the last frame's if nothing has changed; None where it cannot be read."""
        if not os.path.isfile(path):
            return None
        state = (*_file_state(path), *_state_of(b_image))
        pixels = self._kept.image(state)
        raw = read_file(path) if pixels is None else None
        if raw is not None:
            premultiplied = b_image.alpha_mode == "PREMUL"
            pixels = self._finished(b_image, raw, state, premultiplied=premultiplied, encoded=True)
        return pixels

    def _of_blender(self, b_image: bpy.types.Image) -> Float32 | None:
        """Its pixels as Blender has them, the last frame's if they were made of the same."""
        # Blender's own pictures are locked while it draws them (main_thread.py), and EEVEE draws none of them.
        raw = None if b_image.source == "VIEWER" else _read_blender_pixels(b_image)
        if raw is None:
            return None
        state = _state_of(b_image)
        pixels = self._kept.image(state, raw)
        if pixels is None:
            how = {"premultiplied": _float_is_premultiplied(b_image), "encoded": not b_image.is_float}
            pixels = self._finished(b_image, raw, state, raw, **how)
        return pixels

    def _finished(
        self,
        b_image: bpy.types.Image,
        raw: Float32,
        state: tuple[object, ...],
        compared: Float32 | None = None,
        *,
        premultiplied: bool,
        encoded: bool,
    ) -> Float32:
        """`raw` (h, w, channels) with four channels, straight alpha and linear colour.

        Kept for the next frame by `state` and what is `compared`, unless something has to be said of it each time.
        """
        rgba, said = four_channels(raw), len(tuple(self._warn))
        if b_image.alpha_mode == "NONE":
            rgba[..., 3] = 1.0
        elif premultiplied:
            _unpremultiply(rgba)
        if encoded:
            self._linearise(b_image, rgba)
        if len(tuple(self._warn)) == said:
            self._kept.keep_image(state, rgba, compared)
        return rgba

    def _linearise(self, b_image: bpy.types.Image, rgba: Float32) -> None:
        """Take the colour channels from the image's colour space to the file's working space, in place."""
        space, working = b_image.colorspace_settings.name, working_space()
        if b_image.colorspace_settings.is_data or space in (*NO_CONVERSION, working):
            return
        if space == "sRGB" and working in SRGB_WORKING_SPACES:
            alpha = rgba[..., 3].copy()
            rgba[...] = srgb_to_linear(rgba)  # with alpha: numbers that lie together take half the time
            rgba[..., 3] = alpha
        elif not _convert_with_ocio(rgba, space, working):
            self._warn.add(
                f"image {b_image.name!r}: colour space {space!r} cannot be converted; its values are used as is"
            )


# ------------------------------------------------------------------------------------------------ where it is


def _lives_in_blender(b_image: bpy.types.Image) -> bool:
    return bool(b_image.packed_file or b_image.is_dirty or b_image.source in ("GENERATED", "VIEWER", "MOVIE"))


def _file_of(b_image: bpy.types.Image, b_image_user: bpy.types.ImageUser | None) -> str:
    """The absolute path of the picture to read: of the frame in a sequence."""
    path = bpy.path.abspath(b_image.filepath, library=b_image.library)
    if b_image.source == "SEQUENCE" and b_image_user:
        return frame_path(path, b_image_user.frame_current)
    return path


def tile_path(path: str, number: int) -> str:
    """The file of one tile."""
    column, row = (number - FIRST_TILE) % 10, (number - FIRST_TILE) // 10
    return path.replace("<UDIM>", str(number)).replace("<UVTILE>", f"u{column + 1}_v{row + 1}")


@contextlib.contextmanager
def _saved(b_image: bpy.types.Image) -> Iterator[str]:
    """The path of a tiled image, with a token in it for the tile; of a copy in Blender's temporary folder where it has
    none, is packed, or has changes that are not in its files."""
    path = bpy.path.abspath(b_image.filepath, library=b_image.library)
    if path and not b_image.is_dirty and not len(b_image.packed_files):
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="hybrid_tiles_", dir=bpy.app.tempdir or None) as folder:
        path = os.path.join(folder, "tile.<UDIM>" + (".exr" if b_image.is_float else ".png"))
        with contextlib.suppress(RuntimeError):
            b_image.original.save(filepath=path, save_copy=True)
        yield path


def _file_state(path: str) -> tuple[object, ...]:
    """All that what is in a file depends on, short of reading it."""
    status = os.stat(path)
    return (path, status.st_mtime_ns, status.st_size, status.st_ino)


def _state_of(b_image: bpy.types.Image) -> tuple[object, ...]:
    """All that the pixels of an image depend on, beside what is read."""
    colors = b_image.colorspace_settings
    return (
        b_image.name_full,
        b_image.alpha_mode,
        colors.name,
        colors.is_data,
        b_image.is_float,
        working_space(),
    )


def frame_path(path: str, frame: int) -> str:
    """`path` with the last number of its file name replaced by `frame`, as many digits wide."""
    folder, name = os.path.split(path)
    numbers = list(re.finditer(r"\d+", os.path.splitext(name)[0]))
    if not numbers:
        return path
    start, end = numbers[-1].span()
    return os.path.join(folder, f"{name[:start]}{frame:0{end - start}d}{name[end:]}")


# ------------------------------------------------------------------------------------------------ reading


def read_file(path: str) -> Float32 | None:
    """(h, w, channels) float32 as stored (neither linearised nor premultiplied), row 0 at the bottom."""
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
        pixels = source.read_image(0, 0, 0, source.spec().nchannels, oiio.FLOAT)
        channels = _picture_channels(source.spec().channelnames)
    finally:
        source.close()
    if pixels is None:
        return None
    height, width = pixels.shape[:2]
    return np.ascontiguousarray(pixels.reshape(height, width, -1)[::-1, :, channels], dtype=np.float32)


def _picture_channels(names: tuple[str, ...]) -> list[int]:
    """Positions of R, G, B and A; of the first up to four channels where they are called something else."""
    last_part = [name.rsplit(".", 1)[-1].upper() for name in names]
    if {"R", "G", "B"} <= set(last_part):
        return [last_part.index(letter) for letter in "RGBA" if letter in last_part]
    return list(range(min(len(names), 4)))


def _read_blender_pixels(b_image: bpy.types.Image) -> Float32 | None:
    """(h, w, channels) float32 from Blender's own buffer: encoded and straight for bytes, linear for floats."""
    width, height = b_image.size
    if not width or not height:
        return None
    values = np.zeros(len(b_image.pixels), np.float32)
    b_image.pixels.foreach_get(values)
    return values.reshape(height, width, -1)


def _float_is_premultiplied(b_image: bpy.types.Image) -> bool:
    return b_image.is_float and b_image.alpha_mode in ("STRAIGHT", "PREMUL")


def _openimageio() -> ModuleType | None:
    try:
        import OpenImageIO
    except ImportError:
        return None
    return OpenImageIO


# ------------------------------------------------------------------------------------------------ channels and colour


def four_channels(raw: Float32) -> Float32:
    """(h, w, 4) from grey, grey + alpha, RGB or RGBA; alpha is 1 where there is none."""
    height, width, channels = raw.shape
    rgba = np.ones((height, width, 4), np.float32)
    if channels <= 2:
        rgba[..., :3] = raw[..., :1]
        rgba[..., 3:] = raw[..., 1:2] if channels == 2 else 1.0
    else:
        rgba[..., :channels] = raw[..., :4]
    return rgba


def _unpremultiply(rgba: Float32) -> None:
    alpha = rgba[..., 3:]
    np.divide(rgba[..., :3], alpha, out=rgba[..., :3], where=alpha > FLOAT_ALPHA_MIN)


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


def working_space() -> str:
    """Name of the file's scene-linear colour space (Blender 5 has a choice, 4.5 has its configuration's)."""
    b_colorspace: Any = getattr(bpy.data, "colorspace", None)
    return b_colorspace.working_space if b_colorspace else "scene_linear"


def _convert_with_ocio(rgba: Float32, space: str, working: str) -> bool:
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
