# SPDX-License-Identifier: GPL-3.0-or-later
"""The passes of the trace scene: what they are called, and what a frame fills them with."""

from __future__ import annotations

import bpy
import numpy as np

from ...scene import Film, Float32
from ..session import Frame
from . import retrace

CHANNELS = {"NORMAL": "XYZ", "SHADOW": "RGB", "REFLECTION": "RGB", "REFRACTION": "RGB"}
"""Of the data passes that have more than one."""

PASS_TYPES = {"X": "VALUE", "XYZ": "VECTOR", "RGB": "COLOR", "RGBA": "COLOR"}


def names(scene: bpy.types.Scene | None) -> dict[str, str]:
    """Names and channels of the trace scene's passes beside the picture: four always, others if they are wanted."""
    wanted = sorted(scene.hybrid.passes) if scene else []
    data = {pass_name(name): CHANNELS.get(name, "X") for name in wanted}
    return {"Mask": "X", "Residual": "X", retrace.PASS: "RGBA", "Traced": "RGBA", **data}


def pass_name(name: str) -> str:
    """What Blender calls a pass that the settings or the tracer call `name`."""
    return name.title().replace("_", "-")


def deliver(target: bpy.types.RenderResult, frame: Frame, film: Film) -> None:
    """Fill the passes of a render result with those of a frame."""
    passes = target.layers[0].passes
    if frame.raster is not None:
        passes[retrace.PASS].rect.foreach_set(frame.raster.ravel())
    # Not `rect = pixels`: that makes a Python number of each, 190 times slower.
    for name in ("Combined", "Traced"):
        passes[name].rect.foreach_set(frame.traced.ravel())
    passes["Mask"].rect.foreach_set(frame.mask.ravel())
    passes["Residual"].rect.foreach_set(residual(film, frame.mask).ravel())
    for name, pixels in frame.passes.items():
        passes[pass_name(name)].rect.foreach_set(pixels.ravel())


def residual(film: Film, mask: Float32) -> Float32:
    """(h, w) throughput that was cut off, of the traced layer."""
    return film.residual * mask


def data_passes(scene: bpy.types.Scene, film: Film, mask: Float32) -> dict[str, Float32]:
    """The scene's data passes, by name in small letters: (h, w) or (h, w, 3) float32."""
    from ...tracer.film.samples import LIGHT_AOVS  # they add up with the picture: its coverage multiplies them

    found = {name: values for name, values in film.passes.items() if name not in ("background", "passed")}
    for name in found.keys() & LIGHT_AOVS:
        found[name] = found[name] * (mask if found[name].ndim == 2 else mask[..., None])
    if "RESIDUAL" in scene.hybrid.passes:
        found["residual"] = residual(film, mask)
    if "SHADOW" in scene.hybrid.passes:
        found["shadow"] = np.ones((*mask.shape, 3), np.float32) if film.shadow is None else film.shadow
    return found
