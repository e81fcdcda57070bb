# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene-linear colours -> what the screen shows, through Blender's own OpenColorIO configuration."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...scene import Float32
from ..errors import HybridError


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
        """(h, w, 3) scene-linear -> (h, w, 3) display values, 0..1. Raises HybridError for a broken configuration."""
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
