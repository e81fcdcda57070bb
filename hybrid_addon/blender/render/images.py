# SPDX-License-Identifier: GPL-3.0-or-later
"""EXR files and Blender's render results to arrays and back. Rows are bottom-up in arrays and top-down in files."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...scene import Float32
from .. import files
from ..errors import HybridError
from ..pipeline import evaluated
from ..view_layers import views
from . import main_thread

_CHANNELS = "RGBA"
RENDER_RESULT = "Render Result"


def read_render_result(
    scene: bpy.types.Scene, check: Callable[[], None] | None = None, wanted: Collection[str] | None = None
) -> dict[str, Float32]:
    """All passes of the scene's finished render as "Layer.Pass" -> (h, w, channels) float32, bottom row first.

    wanted : only those of these names, of which some may be missing; None: all.

    Goes through a multilayer EXR in Blender's temporary folder: the only way that works while the compositor's other
    scenes are still rendering, in the background and in a window. The user's image settings come back unchanged.
    check : is called while the main thread is waited for; raises if nobody wants the passes any more.
    """
    if RENDER_RESULT not in bpy.data.images:
        raise HybridError("Blender keeps no render result in this file: render once with F12 and save it")

    def save() -> None:
        with _multilayer(scene):
            _save_render(name, scene)

    with files.scratch() as name:
        main_thread.call(save, check)
        return read_exr(name, wanted)


def of_view(planes: Mapping[str, Float32], view: str) -> dict[str, Float32]:
    """Of a render's passes, "Layer.Pass.view" where it has several views, those of one, as "Layer.Pass"."""
    tail = f".{view}"
    own = {name.removesuffix(tail): plane for name, plane in planes.items() if view and name.endswith(tail)}
    return own or dict(planes)


def ensure_render_result() -> None:
    """Make sure that the image exists through which a render is read.

    A file made from an empty one has none, and `blender -b FILE -f 1` makes it only after its first frame. The render
    operator makes it before it renders, so here it renders a scene with nothing in it, by our own engine. Not during a
    render.
    """
    if RENDER_RESULT not in bpy.data.images:
        evaluated.render_nothing()


def read_exr(path: str | os.PathLike[str], wanted: Collection[str] | None = None) -> dict[str, Float32]:
    """Read a multilayer EXR: "Layer.Pass" -> (h, w, channels) float32, bottom row first, channels as RGBA or XYZ order.

    wanted : only those of these names, of which some may be missing; None: all.

    Of several views "Layer.Pass.view". Blender 4.5 writes one part with all channels and 5.x one part for each pass and
    view, so only channel names are trusted, and the view that a part says it is of.
    """
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(os.fspath(path))
    if source is None:
        raise HybridError(f"cannot read '{path}': {oiio.geterror()}")
    planes: dict[str, Float32] = {}
    try:
        part = 0
        while source.seek_subimage(part, 0):
            spec = source.spec()
            view = spec.get_string_attribute("view")
            numbers: dict[str, list[int]] = {}
            for number, channel in enumerate(spec.channelnames):
                name = channel.rpartition(".")[0]
                name = f"{name}.{view}" if view else name
                if wanted is None or name in wanted:
                    numbers.setdefault(name, []).append(number)
            if numbers:
                pixels = np.asarray(source.read_image(part, 0, 0, spec.nchannels, "float"))[::-1]
            for name, own in numbers.items():
                own.sort(key=lambda number: ORDER.get(spec.channelnames[number].rpartition(".")[2], len(ORDER)))
                in_a_row = own == list(range(own[0], own[0] + len(own)))
                planes[name] = np.ascontiguousarray(
                    pixels[..., own[0] : own[0] + len(own)]  # a fifth of the time of what follows
                    if in_a_row
                    else np.stack([pixels[..., number] for number in own], axis=-1)
                )
            part += 1
    finally:
        source.close()
    return planes


ORDER = {letter: rank for rank, letter in enumerate("RXVGYBZAW")}
"""Of the channels of a pass."""


def write_exr(path: str | os.PathLike[str], pixels: Float32) -> None:
    """Write (h, w) or (h, w, 3 or 4) float32, bottom row first, as 32-bit EXR. The file appears whole or not at all."""
    import OpenImageIO as oiio

    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, "float")
    spec.channelnames = ("Y",) if channels == 1 else tuple(_CHANNELS[:channels])
    spec.attribute("compression", "zip")
    with files.atomic(path) as temporary:
        output = oiio.ImageOutput.create(temporary)
        written = output and output.open(temporary, spec) and output.write_image(np.ascontiguousarray(pixels[::-1]))
        if not (output and written and output.close()):
            raise HybridError(f"cannot write '{path}': {output.geterror() if output else oiio.geterror()}")


def place(part: Float32, window: tuple[int, int, int, int], size: tuple[int, int]) -> Float32:
    """A window's pixels (h, w, ...) in the full frame of this size (height, width), zero outside."""
    if part.shape[:2] == size:
        return part
    whole = np.zeros((*size, *part.shape[2:]), np.float32)
    x0, y0, x1, y1 = window
    whole[y0:y1, x0:x1] = part
    return whole


def paths_of(path: Path, scene: bpy.types.Scene) -> list[Path]:
    """The files that `write_render_result` makes: one, or with Stereoscopy one of each view, with its suffix."""
    if len(views(scene)) == 1 or scene.render.image_settings.views_format == "STEREO_3D":
        return [path]
    return [with_suffix(path, scene, view) for view in views(scene)]


def with_suffix(path: Path, scene: bpy.types.Scene, view: str) -> Path:
    """The same file of one view."""
    return path.with_stem(path.stem + scene.render.views[view].file_suffix) if view else path


def write_render_result(path: str | os.PathLike[str], scene: bpy.types.Scene) -> None:
    """Save the scene's composite as PNG (view transform applied) or EXR (scene-linear, 32 bit), by the extension.

    With Stereoscopy both views in one picture, or each in one of its own, as the scene's Output has it.
    """
    formats = {
        ".png": ("PNG", "16" if scene.render.image_settings.color_depth == "16" else "8"),
        ".exr": ("OPEN_EXR", "32"),
    }
    file_format, depth = formats[Path(path).suffix.lower()]
    paths = paths_of(Path(path), scene)
    with ExitStack() as stack, image_settings(scene, "IMAGE", file_format, depth):
        temporary = [stack.enter_context(files.atomic(each)) for each in paths]
        _save_render(temporary[0], scene)
        for name, view in zip(temporary, views(scene), strict=False):
            if len(paths) > 1:
                os.replace(with_suffix(Path(temporary[0]), scene, view), name)


def _save_render(path: str, scene: bpy.types.Scene) -> None:
    """Of several views Blender's first picture is one of each, whatever was asked for; and of those it says that they
    could not be saved."""
    parts = [with_suffix(Path(path), scene, view) for view in views(scene)]
    try:
        bpy.data.images[RENDER_RESULT].save_render(path, scene=scene)
    except RuntimeError as error:
        if len(parts) == 1 or not all(part.is_file() for part in parts):
            raise HybridError(f"cannot write '{path}': {str(error).strip()}") from error
        if scene.render.image_settings.views_format != "INDIVIDUAL":
            for part in parts:
                part.unlink()
            _save_render(path, scene)


@contextmanager
def image_settings(
    scene: bpy.types.Scene, media: str, file_format: str, depth: str, codec: str = "ZIP"
) -> Iterator[None]:
    """Change the scene's output format for a moment. Writing to settings is allowed inside a render."""
    settings = scene.render.image_settings
    names = ["media_type", "file_format", "color_mode", "color_depth", "exr_codec", "views_format"]
    before = {name: getattr(settings, name) for name in names if hasattr(settings, name)}
    wanted = {
        "media_type": media,
        "file_format": file_format,
        "color_mode": "RGBA",
        "color_depth": depth,
        "exr_codec": codec,
    }
    if file_format == "OPEN_EXR_MULTILAYER":
        wanted["views_format"] = "MULTIVIEW"  # all in one file
    elif settings.views_format != "STEREO_3D":  # what a multilayer EXR may have, no other file has
        wanted["views_format"] = "INDIVIDUAL"
    try:
        _assign(settings, wanted, before)
        yield
    finally:
        _assign(settings, before, before)


def _assign(settings: bpy.types.ImageFormatSettings, values: Mapping[str, str], known: Mapping[str, str]) -> None:
    for name, value in values.items():  # in this order: a media type limits the formats, a format the depths
        if name in known and not (name == "exr_codec" and not settings.file_format.startswith("OPEN_EXR")):
            try:
                setattr(settings, name, value)
            except TypeError:  # a depth or mode that the restored format does not have was not in use either
                continue


@contextmanager
def _multilayer(scene: bpy.types.Scene) -> Iterator[None]:
    with image_settings(scene, "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32", "NONE"):
        yield
