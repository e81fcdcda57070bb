# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's images -> `Texels`, in the width that they have: scene-linear, straight alpha, row 0 at the bottom.

Files, packed ones too, are read with OpenImageIO, at their own precision. What exists only inside Blender (generated or
painted images) and what OpenImageIO cannot read comes from `Image.pixels`. Wider than it is stored becomes only what
no curve of single channels makes linear: another colour space than sRGB, or sRGB multiplied by alpha in 16 bits.
"""

from __future__ import annotations

import contextlib
import os
import re
import tempfile
from collections.abc import Iterator
from hashlib import blake2b
from typing import Any

import bpy
import numpy as np

from ... import memory
from ...scene import Float32, Texels
from ...scene.texels import Stored
from .cache import MeshCache
from .coverage.status import FIRST
from .image_file import (
    BAND,
    SMALLER_IMAGES,
    convert_with_ocio,
    in_texels,
    one,
    read_file,
    read_packed,
    srgb_curve,
    srgb_to_linear,
)
from .messages import Warnings

MISSING_COLOR = (1.0, 0.0, 1.0, 1.0)  # the pink that Blender shows for a missing image
MISSING = Texels(np.full((1, 1, 4), MISSING_COLOR, np.float32))
FIRST_TILE = 1001  # of a tiled image: column 0, row 0; ten columns a row
NO_CONVERSION = ("", "Raw", "Non-Color", "scene_linear")
SRGB_WORKING_SPACES = ("Linear Rec.709", "scene_linear")  # those to which the sRGB curve alone leads
SRGB = "sRGB by its curve"


class Images:
    """Reads each image once.

    looked_at : somebody will look at the pixels, so that a sky is worth drawing.
    """

    looked_at = True

    def __init__(self, warn: Warnings, kept: MeshCache | None = None) -> None:
        self._warn = warn
        self._kept = MeshCache() if kept is None else kept
        self._pixels: dict[tuple[str, str], Texels] = {}
        self._tiles: dict[str, dict[tuple[int, int], Texels]] = {}

    def pixels(self, b_image: bpy.types.Image, b_image_user: bpy.types.ImageUser | None = None) -> Texels:
        """Its texels; a single pink one, and a warning, where the image cannot be read. Raises NotEnoughMemory."""
        path = _file_of(b_image, b_image_user)
        key = (b_image.name_full, path)
        if key not in self._pixels:
            self._pixels[key] = self._read(b_image, path)
        return self._pixels[key]

    def tiles(self, b_image: bpy.types.Image) -> dict[tuple[int, int], Texels]:
        """The tiles of a tiled image, by column and row; a warning for each that cannot be read, which is left out."""
        found = self._tiles.setdefault(b_image.name_full, {})
        if found:
            return found
        with _saved(b_image) as path:
            packed = {b_packed.tile_number: b_packed.packed_file for b_packed in b_image.packed_files}
            for number in sorted(b_tile.number for b_tile in b_image.tiles):
                tile = tile_path(path, number)
                if packed and not b_image.is_dirty:
                    texels = self._of_packed(b_image, packed.get(number), tile)
                else:
                    texels = self._of_file(b_image, tile, by_content=b_image.is_dirty)
                if texels is None:
                    self._warn.add(f"image {b_image.name!r}: cannot read its tile {number}; it is drawn pink")
                else:
                    found[(number - FIRST_TILE) % 10, (number - FIRST_TILE) // 10] = texels
        return found

    def _read(self, b_image: bpy.types.Image, path: str) -> Texels:
        if b_image.source == "MOVIE":
            self._warn.add(f"image {b_image.name!r}: only the current frame of it is used")
        if b_image.is_dirty or b_image.source in ("GENERATED", "VIEWER", "MOVIE"):
            texels = None
        elif b_image.packed_file:
            texels = self._of_packed(b_image, b_image.packed_file, path)
        else:
            texels = self._of_file(b_image, path)
        if texels is None:
            texels = self._of_blender(b_image)
        if texels is not None:
            return texels
        self._warn.add(f"image {b_image.name!r}: cannot read {repr(path) if path else 'it'}; it is drawn pink", FIRST)
        return MISSING

    def _of_file(self, b_image: bpy.types.Image, path: str, by_content: bool = False) -> Texels | None:
        """Its texels in that file, the last frame's if nothing has changed; None where it cannot be read.

        by_content: it is written anew each time, so only what is in it tells.
        """
        if not os.path.isfile(path):
            return None
        if by_content:
            with open(path, "rb") as file:
                return self._of_content(b_image, file.read(), path)
        state = (*_file_state(path), *_state_of(b_image))
        return self._kept.image(state) or self._stored(b_image, read_file(path, b_image.name), state)

    def _of_packed(self, b_image: bpy.types.Image, b_packed: bpy.types.PackedFile | None, path: str) -> Texels | None:
        return None if b_packed is None else self._of_content(b_image, b_packed.data, path)

    def _of_content(self, b_image: bpy.types.Image, content: bytes, path: str) -> Texels | None:
        state = (_digest(content), *_state_of(b_image))
        return self._kept.image(state) or self._stored(b_image, read_packed(content, path, b_image.name), state)

    def _stored(self, b_image: bpy.types.Image, raw: Stored | None, state: tuple[object, ...]) -> Texels | None:
        """What a file holds, as texels."""
        if raw is None:
            return None
        return self._finished(b_image, raw, state, premultiplied=b_image.alpha_mode == "PREMUL", encoded=True)

    def _of_blender(self, b_image: bpy.types.Image) -> Texels | None:
        """Its texels as Blender has them, the last frame's if they were made of the same."""
        if b_image.source == "VIEWER":  # locked while Blender draws (main_thread.py), and EEVEE draws none of them
            return None
        # What nobody has painted over is what its settings say, and need not be read.
        settings = _generated(b_image) if b_image.source == "GENERATED" and not b_image.is_dirty else None
        texels = None if settings is None else self._kept.image((settings, *_state_of(b_image)))
        raw = None if texels is not None else _read_blender_pixels(b_image)
        if raw is None:
            return texels
        state = (settings or _digest(raw), *_state_of(b_image))  # the digest says floats or bytes
        how = {"premultiplied": _float_is_premultiplied(b_image), "encoded": not b_image.is_float}
        return self._kept.image(state) or self._finished(b_image, raw, state, **how)

    def _finished(
        self,
        b_image: bpy.types.Image,
        raw: Stored,
        state: tuple[object, ...],
        *,
        premultiplied: bool,
        encoded: bool,
    ) -> Texels:
        """`raw` (h, w, 1, 2 or 4) as texels, in the same width where that can be; it may be written to.

        Kept for the next frame by `state`, unless something has to be said of it each time.
        """
        if b_image.alpha_mode == "NONE" and raw.shape[2] > 1:
            raw[..., -1] = one(raw.dtype)
        texels = Texels(raw)
        if premultiplied and not texels.is_opaque:
            texels = Texels(raw, divides=True)
        space, succeeded = _conversion(b_image) if encoded else "", True
        if space:
            curve = srgb_curve(raw.dtype.name, texels.divides) if space == SRGB else None
            if curve is not None:
                texels = Texels(raw, curve)
            else:
                rgba, succeeded = self._converted(b_image, texels, space)
                texels = Texels(rgba)
        if succeeded:
            self._kept.keep_image(state, texels)
        return texels

    def _converted(self, b_image: bpy.types.Image, texels: Texels, space: str) -> tuple[Float32, bool]:
        """(h, w, 4) float32, from the image's colour space to the file's, where no curve of one channel leads there;
        and whether they could be converted."""
        height, width, _ = texels.shape
        size = height * width * 16 * (2 if space == SRGB else 4)  # and the copies that OpenColorIO takes
        memory.require({f"image {b_image.name!r}": size}, SMALLER_IMAGES)
        rgba = texels.rgba()
        if space == SRGB:
            result = srgb_to_linear(rgba)
            result[..., 3] = rgba[..., 3]
            return result, True
        succeeded = convert_with_ocio(rgba, space, working_space())
        if not succeeded:
            self._warn.add(
                f"image {b_image.name!r}: colour space {space!r} cannot be converted; its values are used as is"
            )
        return rgba, succeeded


# ------------------------------------------------------------------------------------------------ where it is


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
    none, or has changes that are not in its files."""
    path = bpy.path.abspath(b_image.filepath, library=b_image.library)
    if path and not b_image.is_dirty:
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
    """All that the pixels of an image depend on, beside what is read.

    Not `is_float`: Blender loads the image to tell, which takes as much again where EEVEE does not draw it.
    """
    colors = b_image.colorspace_settings
    return (
        b_image.name_full,
        b_image.alpha_mode,
        colors.name,
        colors.is_data,
        working_space(),
    )


def _generated(b_image: bpy.types.Image) -> tuple[object, ...]:
    """All that a generated image depends on."""
    return (b_image.generated_type, *b_image.generated_color, *b_image.size, b_image.use_generated_float)


def _digest(content: bytes | Stored) -> bytes:
    if isinstance(content, bytes):
        return blake2b(content, digest_size=16).digest()
    shape = f"{content.dtype.str}{content.shape}".encode()
    return blake2b(content.reshape(-1).view(np.uint8), digest_size=16, key=shape).digest()


def frame_path(path: str, frame: int) -> str:
    """`path` with the last number of its file name replaced by `frame`, as many digits wide."""
    folder, name = os.path.split(path)
    numbers = list(re.finditer(r"\d+", os.path.splitext(name)[0]))
    if not numbers:
        return path
    start, end = numbers[-1].span()
    return os.path.join(folder, f"{name[:start]}{frame:0{end - start}d}{name[end:]}")


# ------------------------------------------------------------------------------------------------ reading


def _read_blender_pixels(b_image: bpy.types.Image) -> Stored | None:
    """(h, w, 1, 2 or 4) from Blender's own buffer: uint8, encoded and straight, or float32, linear."""
    width, height = b_image.size
    if not width or not height:
        return None
    count = len(b_image.pixels)
    memory.require({f"image {b_image.name!r}": count * (5 if not b_image.is_float else 4)}, SMALLER_IMAGES)
    values = np.zeros(count, np.float32)
    b_image.pixels.foreach_get(values)  # floats only, whatever it holds
    return in_texels((values if b_image.is_float else _bytes(values)).reshape(height, width, -1))


def _bytes(values: Float32) -> Stored:
    """The bytes that stand for these numbers."""
    result = np.empty(len(values), np.uint8)
    for start in range(0, len(values), BAND):
        result[start : start + BAND] = np.rint(values[start : start + BAND] * np.float32(255))
    return result


def _float_is_premultiplied(b_image: bpy.types.Image) -> bool:
    return b_image.is_float and b_image.alpha_mode in ("STRAIGHT", "PREMUL")


# ------------------------------------------------------------------------------------------------ colour


def _conversion(b_image: bpy.types.Image) -> str:
    """The colour space from which its colours are to be converted; "": they are scene-linear, or no colours."""
    space, working = b_image.colorspace_settings.name, working_space()
    if b_image.colorspace_settings.is_data or space in (*NO_CONVERSION, working):
        return ""
    # Where the working space has other primaries than sRGB, a curve does not lead there.
    return SRGB if space == "sRGB" and working in SRGB_WORKING_SPACES else space


def working_space() -> str:
    """Name of the file's scene-linear colour space (Blender 5 has a choice, 4.5 has its configuration's)."""
    b_colorspace: Any = getattr(bpy.data, "colorspace", None)
    return b_colorspace.working_space if b_colorspace else "scene_linear"
