# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras. Conventions: see the package."""

from __future__ import annotations

import math
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
class Panorama:
    """How a panoramic camera maps directions to its frame; what a kind does not read is at its default.

    kind          : EQUIRECTANGULAR, EQUIANGULAR_CUBEMAP_FACE, MIRRORBALL, FISHEYE_EQUIDISTANT, FISHEYE_EQUISOLID,
                    FISHEYE_LENS_POLYNOMIAL or CENTRAL_CYLINDRICAL, Blender's names.
    longitude     : radians at the left and the right edge, 0 ahead; of EQUIRECTANGULAR and CENTRAL_CYLINDRICAL.
    latitude      : radians at the lower and the upper edge; of EQUIRECTANGULAR.
    height        : at the lower and the upper edge, of the film of a CENTRAL_CYLINDRICAL one of this `radius`.
    field_of_view : radians, of the fisheyes' circle.
    lens, sensor  : millimetres, focal length and (width, height) of the full frame; of the last two fisheyes.
    polynomial    : of FISHEYE_LENS_POLYNOMIAL: minus the radians off the axis by powers of millimetres, from 0 on.
    """

    kind: str
    longitude: tuple[float, float] = (-math.pi, math.pi)
    latitude: tuple[float, float] = (-math.pi / 2, math.pi / 2)
    height: tuple[float, float] = (-1.0, 1.0)
    radius: float = 1.0
    field_of_view: float = math.pi
    lens: float = 10.5
    sensor: tuple[float, float] = (36.0, 36.0)
    polynomial: tuple[float, float, float, float, float] = (0.0, -0.05, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Camera:
    """A perspective, orthographic or panoramic camera, and the window of its frame that is rendered.

    matrix_world : (4, 4) float64, camera to world, without scale.
    view_plane   : (left, right, bottom, top) of the *full* frame, shift and pixel aspect included: on the plane z = -1
                   for PERSP (so unitless tangents), in metres for ORTHO; (0, 1, 0, 1) is the whole mapping of PANO.
    resolution   : (width, height) of the full frame in pixels.
    window       : (x0, y0, x1, y1), half open, in pixels of the full frame: the render border, or the whole frame.
    clip_start, clip_end : metres along the view axis, of PANO along each ray; they limit camera rays only.
    lens         : None is a pinhole, all is sharp.
    panorama     : of PANO, how it maps directions.
    """

    projection: Literal["PERSP", "ORTHO", "PANO"]
    matrix_world: Float64
    view_plane: tuple[float, float, float, float]
    resolution: tuple[int, int]
    window: tuple[int, int, int, int]
    clip_start: float = 0.1
    clip_end: float = 1000.0
    lens: Lens | None = None
    panorama: Panorama | None = None
