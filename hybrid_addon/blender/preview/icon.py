# SPDX-License-Identifier: GPL-3.0-or-later
"""The icon of the preview's button: a glass ball, which shows the horizon upside down. Made of a formula: no file."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...scene import Float32

SIZE = 32
COLOR = (0.4, 0.66, 1.0)
_previews: Any = None


def pixels() -> Float32:
    """(SIZE, SIZE, 4) premultiplied, bottom row first: of a blue that is seen on dark and on light themes."""
    y, x = (np.mgrid[:SIZE, :SIZE] + 0.5) / SIZE * 2 - 1
    radius = np.hypot(x, y)
    width = 2.0 / SIZE

    def inside(distance: Float32) -> Float32:
        """Coverage of where a distance is negative, with a soft edge of a pixel."""
        return np.asarray(np.clip(0.5 - distance / width, 0, 1), np.float32)

    ring = inside(np.abs(radius - 0.78) - 0.08)
    ground = inside(radius - 0.62) * inside(-(y - 0.1 - 0.25 * x * x))
    glint = inside(np.hypot(x + 0.22, y + 0.3) - 0.13)
    alpha = np.clip(ring + 0.75 * ground + glint, 0, 1)
    return (np.append(COLOR, 1) * alpha[..., None]).astype(np.float32)


def icon_id() -> int:
    """For `icon_value`; 0 without a window."""
    return 0 if _previews is None else int(_previews["hybrid"].icon_id)


def register() -> None:
    """Make it."""
    global _previews
    from bpy.utils import previews

    _previews = previews.new()
    icon = _previews.new("hybrid")
    icon.icon_size = (SIZE, SIZE)
    icon.icon_pixels_float = pixels().ravel().tolist()


def unregister() -> None:
    """Let go of it."""
    global _previews
    if _previews is not None:
        bpy.utils.previews.remove(_previews)
        _previews = None
