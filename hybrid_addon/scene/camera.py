# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras. Conventions: see the package."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .numbers import Float64


@dataclass(frozen=True, eq=False)
class Lens:
    """A thin lens: what is not at the distance of focus is blurred.

    radius         : metres, of its opening across the axis; > 0.
    focus_distance : metres along the view axis to the plane that is sharp; > 0.
    blades         : corners of the opening, which lie on that radius; less than 3: it is round.
    rotation       : radians, counter-clockwise as the camera looks, of the middle of its first edge from local +X.
    ratio          : how much narrower than high the opening is (2 = anamorphic bokeh).
    """

    radius: float
    focus_distance: float
    blades: int = 0
    rotation: float = 0.0
    ratio: float = 1.0


@dataclass(frozen=True, eq=False)
class Camera:
    """A perspective or orthographic camera, and the window of its frame that is rendered.

    matrix_world : (4, 4) float64, camera to world, without scale.
    view_plane   : (left, right, bottom, top) of the *full* frame, shift and pixel aspect included: on the plane z = -1
                   for PERSP (so unitless tangents), in metres for ORTHO.
    resolution   : (width, height) of the full frame in pixels.
    window       : (x0, y0, x1, y1), half open, in pixels of the full frame: the render border, or the whole frame.
    clip_start, clip_end : metres along the view axis; they limit camera rays only.
    lens         : None is a pinhole, all is sharp.
    """

    projection: Literal["PERSP", "ORTHO"]
    matrix_world: Float64
    view_plane: tuple[float, float, float, float]
    resolution: tuple[int, int]
    window: tuple[int, int, int, int]
    clip_start: float = 0.1
    clip_end: float = 1000.0
    lens: Lens | None = None
