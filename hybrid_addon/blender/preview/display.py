# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene-linear colours -> what the screen shows, through Blender's own OpenColorIO configuration."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import bpy
import numpy as np

from ...scene import Float32
from ..errors import HybridError

NODES = 81
"""Nodes of the table along each channel: four to a stop, for which AgX and Filmic are 0.1 / 255 off on average."""

STOPS = 20
"""Powers of two that the table spans."""

DARKEST = 2.0**-10
"""Radiance below which nodes of the table are evenly spaced. White, 1, lies 0.001 from a node, for transforms clip
there, and the last node is at 1023: Filmic still bleaches a saturated lamp of 100."""

AT_ONCE = 1 << 14
"""Colours that are looked up at a time: their columns stay in the cache."""


@dataclass(frozen=True)
class Display:
    """A scene's colour management. Its curves and white balance are left out."""

    config: str
    space: str
    device: str
    view: str
    look: str
    exposure: float
    gamma: float

    @classmethod
    def of(cls, scene: bpy.types.Scene) -> Display:
        """As the scene's panel Color Management has it."""
        own = Path(bpy.utils.resource_path("LOCAL"), "datafiles", "colormanagement", "config.ocio")
        settings = scene.view_settings
        look = settings.look
        return cls(
            os.environ.get("OCIO") or os.fspath(own),
            getattr(getattr(bpy.data, "colorspace", None), "working_space", "scene_linear"),
            scene.display_settings.display_device,
            settings.view_transform,
            "" if look == "None" else look,
            settings.exposure,
            settings.gamma,
        )

    def encode(self, radiance: Float32) -> Float32:
        """(h, w, 3) scene-linear -> (h, w, 3) display values, 0..1. Raises HybridError for a broken configuration.

        OpenImageIO builds the transform anew for each call, tenths of a second for AgX: what is shown while it changes
        takes `encode_by_table`.
        """
        import OpenImageIO as oiio

        height, width = radiance.shape[:2]
        source = oiio.ImageBuf(oiio.ImageSpec(width, height, 3, "float"))
        source.set_pixels(source.roi, np.ascontiguousarray(radiance * np.float32(2.0**self.exposure)))
        if self.look:  # by itself: OpenImageIO 3.0 forgets it in a display transform
            source = oiio.ImageBufAlgo.ociolook(
                source, self.look, self.space, self.space, unpremult=False, colorconfig=self.config
            )
        result = oiio.ImageBufAlgo.ociodisplay(
            source, self.device, self.view, self.space, unpremult=False, colorconfig=self.config
        )
        if result.has_error:
            raise HybridError(f"the view transform '{self.view}' cannot be shown: {result.geterror()}")
        encoded = np.clip(np.asarray(result.get_pixels("float"), np.float32).reshape(height, width, 3), 0, 1)
        return encoded if self.gamma == 1 else encoded ** np.float32(1 / self.gamma)

    def encode_by_table(self, radiance: Float32) -> Float32:
        """What `encode` gives, to 2/255 but for one colour in a hundred and the edges of False Color; the transform is
        built once. NaN and what lies below 0 are shown as 0, what lies above 1023 after the exposure as 1023."""
        table = _table(replace(self, exposure=0.0, gamma=1.0))
        flat = radiance.reshape(-1, 3)
        result = np.empty_like(flat, np.float32)
        for start in range(0, len(flat), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            result[part] = _look_up(table, flat[part] * np.float32(2.0**self.exposure))
        return (result if self.gamma == 1 else result ** np.float32(1 / self.gamma)).reshape(radiance.shape)


@lru_cache(maxsize=4)
def _table(display: Display) -> Float32:
    """(NODES^3, 3) display values of the nodes, red slowest."""
    places = np.arange(NODES) * (STOPS / (NODES - 1))
    nodes = ((np.exp2(places) - 1) * DARKEST).astype(np.float32)
    grid = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1)
    return display.encode(grid.reshape(NODES, NODES * NODES, 3)).reshape(-1, 3)


def _look_up(table: Float32, colors: Float32) -> Float32:
    """Trilinear interpolation of the table at linear colours (n, 3)."""
    place = np.log2(1 + np.fmax(colors, 0) * np.float32(1 / DARKEST)) * np.float32((NODES - 1) / STOPS)
    place = np.fmin(place, np.float32(NODES - 1))
    low = np.fmin(place.astype(np.int32), NODES - 2)
    share = (place - low).astype(np.float32)
    corner = (low[:, 0] * NODES + low[:, 1]) * NODES + low[:, 2]
    result = np.zeros_like(colors, np.float32)
    for red in (0, 1):
        for green in (0, 1):
            for blue in (0, 1):
                weight = np.ones(len(colors), np.float32)
                for channel, upper in enumerate((red, green, blue)):
                    weight *= share[:, channel] if upper else 1 - share[:, channel]
                result += weight[:, None] * table.take(corner + ((red * NODES + green) * NODES + blue), axis=0)
    return result
