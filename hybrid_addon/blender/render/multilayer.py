# SPDX-License-Identifier: GPL-3.0-or-later
"""Multilayer EXR files that Blender writes of a hybrid scene: Combined is the hybrid picture, and no layer is ours.

Blender writes its render's layers as EEVEE drew them, the mask layers among them. No handler and no engine reaches the
pixels of another engine's layers. So a file that has just been written is written again: all of its channels and
attributes as they are, but for Combined, without the mask layers, and with both halves, mask and data passes.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...scene import Float32
from .. import files, session
from ..errors import HybridError
from ..pipeline import scene_setup
from ..session import Frame
from ..view_layers import mask_layers, part_of, source_layers, views
from .images import place, with_suffix
from .passes import CHANNELS, pass_name

CLOCK_STEP = 2.0
"""Seconds: of the coarsest clock that a file system has (FAT)."""


def written(scene: bpy.types.Scene, since: float) -> None:
    """Blender has written a picture of this scene. since : when the frame began, on time.time()'s clock."""
    if scene.render.image_settings.file_format != "OPEN_EXR_MULTILAYER" or not scene_setup.is_active(scene):
        return
    masks = [layer.name for layer in mask_layers(scene)]
    frames, each = session.of(scene.name).frames, views(scene)
    together = scene.render.image_settings.views_format == "MULTIVIEW" and len(each) > 1
    for view in each:
        plain = bpy.path.abspath(scene.render.filepath)  # of a single picture, without a number
        numbered = Path(scene.render.frame_path(frame=scene.frame_current))
        paths = [numbered, Path(plain), Path(f"{plain}.exr")]
        if len(each) > 1 and not together:
            paths = [with_suffix(path.with_suffix(".exr"), scene, view) for path in paths]
        fresh = [path for path in paths if path.is_file() and path.stat().st_mtime >= since - CLOCK_STEP]
        if fresh:
            own = {
                layer.name: frames[name] for layer in source_layers(scene) if (name := part_of(layer, view)) in frames
            }
            path = max(fresh, key=lambda path: path.stat().st_mtime)
            rewrite(path, own, masks, view if together else "")


def rewrite(path: Path, frames: Mapping[str, Frame], masks: list[str], view: str = "") -> None:
    """Put the halves of these frames, by the names of their layers, into a multilayer EXR, without the layers `masks`.

    view : the one that they are of, in a file of several.
    Raises HybridError where the file cannot be read or written; it is whole then, as Blender wrote it.
    """
    ours = tuple(f"{mask}." for mask in masks)
    kept = [
        _without(part, ours)
        for part in _read(path)
        if not ours or not all(n.startswith(ours) for n in part[0].channelnames)
    ]
    if not kept:
        raise HybridError(f"'{path}' has no layer but ours")
    in_names = view and not any(spec.get_string_attribute("view") for spec, _ in kept)  # as 4.5 has it
    own_parts = [part for part in kept if not view or part[0].get_string_attribute("view") in {"", view}]
    there = {channel.rpartition(".")[0] for spec, _ in own_parts for channel in spec.channelnames}
    tail = f".{view}" if in_names else ""
    for layer, frame in frames.items():
        for spec, pixels in own_parts:
            for plane, letter in zip(_picture(frame, pixels.shape[:2]), "RGBA", strict=True):
                name = f"{layer}.Combined{tail}.{letter}"
                if name in spec.channelnames:
                    pixels[..., spec.channelnames.index(name)] = plane
        for name, plane in _planes(frame).items():
            letters = {1: "X", 3: CHANNELS.get(name.upper(), "RGB"), 4: "RGBA"}[plane.shape[-1]]
            own = f"{layer}.{name}{tail}"
            own = f"{layer}.Traced {name}{tail}" if own in there else own
            kept = _add(kept, own, letters, plane, frame.window, "" if in_names else view)
    _write(path, kept)


Part = tuple[Any, Float32]  # a spec of OpenImageIO, and pixels (h, w, channels), top row first


def _picture(frame: Frame, size: tuple[int, int]) -> Float32:
    """(4, h, w) of both halves, top row first."""
    whole = frame.traced if frame.raster is None else frame.raster + frame.traced
    return np.ascontiguousarray(place(whole, frame.window, size)[::-1].transpose(2, 0, 1))


def _planes(frame: Frame) -> dict[str, Float32]:
    """What comes beside the picture, (h, w, channels) each, by name."""
    found = {"Traced": frame.traced, "Mask": frame.mask[..., None]}
    if frame.raster is not None:
        found["Raster"] = frame.raster
    for name, pixels in frame.passes.items():
        found[pass_name(name)] = pixels[..., None] if pixels.ndim == 2 else pixels
    return found


def _add(
    kept: list[Part], name: str, letters: str, pixels: Float32, window: tuple[int, int, int, int], view: str
) -> list[Part]:
    """One more pass: a part of its own where each pass has one, else channels of the only part."""
    spec, first = kept[0]
    plane = np.ascontiguousarray(place(pixels, window, first.shape[:2])[::-1])
    channels = [f"{name}.{letter}" for letter in letters]
    if len(kept) > 1:
        new = spec.copy()
        new.nchannels, new.channelnames, new.channelformats = len(channels), channels, ()
        new.alpha_channel = new.z_channel = -1
        part = f"{name}-{view}" if view else name
        new.attribute("oiio:subimagename", part)
        new.attribute("name", part)
        if view:
            new.attribute("view", view)
        return [*kept, (new, plane)]
    formats = list(spec.channelformats) or [spec.format] * spec.nchannels
    new = spec.copy()
    new.nchannels += len(channels)
    new.channelnames = [*spec.channelnames, *channels]
    new.channelformats = [*formats, *[spec.format] * len(channels)]
    return [(new, np.concatenate([first, plane], axis=-1))]


def _without(part: Part, ours: tuple[str, ...]) -> Part:
    """A part without the channels whose names begin so."""
    spec, pixels = part
    wanted = [i for i, name in enumerate(spec.channelnames) if not ours or not name.startswith(ours)]
    if len(wanted) == spec.nchannels:
        return spec, pixels
    new = spec.copy()
    new.nchannels, new.channelnames = len(wanted), [spec.channelnames[i] for i in wanted]
    new.channelformats = [spec.channelformats[i] for i in wanted] if spec.channelformats else ()
    new.alpha_channel = new.z_channel = -1
    return new, np.ascontiguousarray(pixels[..., wanted])


def _read(path: Path) -> list[Part]:
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(os.fspath(path))
    if source is None:
        raise HybridError(f"cannot read '{path}': {oiio.geterror()}")
    found: list[Part] = []
    try:
        while source.seek_subimage(len(found), 0):
            spec = source.spec()
            pixels = source.read_image(len(found), 0, 0, spec.nchannels, "float")
            if pixels is None:
                raise HybridError(f"cannot read '{path}': {source.geterror()}")
            found.append((spec.copy(), np.asarray(pixels, np.float32)))
    finally:
        source.close()
    return found


def _write(path: Path, parts: list[Part]) -> None:
    import OpenImageIO as oiio

    with files.atomic(path) as temporary:
        output = oiio.ImageOutput.create(temporary)
        if output is None or not output.open(temporary, tuple(spec for spec, _ in parts)):
            raise HybridError(f"cannot write '{path}': {output.geterror() if output else oiio.geterror()}")
        for number, (spec, pixels) in enumerate(parts):
            if number and not output.open(temporary, spec, "AppendSubimage"):
                raise HybridError(f"cannot write '{path}': {output.geterror()}")
            if not output.write_image(pixels):
                raise HybridError(f"cannot write '{path}': {output.geterror()}")
        if not output.close():
            raise HybridError(f"cannot write '{path}': {output.geterror()}")
