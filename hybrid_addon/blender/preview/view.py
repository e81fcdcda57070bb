# SPDX-License-Identifier: GPL-3.0-or-later
"""A 3D viewport's view -> scene.Camera, at full or reduced resolution."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

from ...scene import Camera

Rect = tuple[int, int, int, int]


@dataclass(frozen=True)
class View:
    """What a region shows; equal views show the same.

    matrix_world : 4 x 4, camera to world.   projection : 4 x 4, Blender's window matrix.
    size         : of the region in pixels.   rect : (x0, y0, x1, y1), half open, the part that the picture fills.
    """

    matrix_world: tuple[tuple[float, ...], ...]
    projection: tuple[tuple[float, ...], ...]
    size: tuple[int, int]
    rect: Rect
    clip: tuple[float, float]

    @classmethod
    def of(cls, region: bpy.types.Region, space: bpy.types.SpaceView3D, scene: bpy.types.Scene) -> View:
        """The view of a 3D viewport's main region."""
        r3d = space.region_3d
        camera = space.camera if r3d.view_perspective == "CAMERA" else None
        clip = (camera.data.clip_start, camera.data.clip_end) if camera else (space.clip_start, space.clip_end)
        return cls(
            tuple(tuple(row) for row in r3d.view_matrix.inverted_safe()),
            tuple(tuple(row) for row in r3d.window_matrix),
            (region.width, region.height),
            _rect(region, space, camera, scene),
            clip,
        )

    def camera(self, step: int) -> Camera:
        """The camera whose pixels are `step` x `step` pixels of the region; the last ones may reach beyond it."""
        p = np.array(self.projection)
        perspective = p[3, 3] == 0
        x0, y0, x1, y1 = self.rect
        width, height = (math.ceil(n / step) for n in self.size)
        planes = []
        for axis, (count, pixels) in enumerate(zip((width, height), self.size, strict=True)):
            offset = p[axis, 2] if perspective else -p[axis, 3]
            low, high = (-1 + offset) / p[axis, axis], (1 + offset) / p[axis, axis]
            planes += [low, low + (high - low) * count * step / pixels]
        return Camera(
            projection="PERSP" if perspective else "ORTHO",
            matrix_world=np.array(self.matrix_world, np.float64),
            view_plane=(planes[0], planes[1], planes[2], planes[3]),
            resolution=(width, height),
            window=(x0 // step, y0 // step, math.ceil(x1 / step), math.ceil(y1 / step)),
            clip_start=self.clip[0] if perspective else -self.clip[1],
            clip_end=self.clip[1],
        )


def _rect(
    region: bpy.types.Region, space: bpy.types.SpaceView3D, camera: bpy.types.Object | None, scene: bpy.types.Scene
) -> Rect:
    """The part of the region that EEVEE draws: the camera's frame or all of it, within the render region (Ctrl B)."""
    frame = (0.0, 0.0, float(region.width), float(region.height))
    if camera is not None:
        frame = _frame(region, space.region_3d, camera, scene) or frame
    x0, y0, x1, y1 = frame
    owner, prefix = (scene.render, "") if camera is not None else (space, "render_")
    if scene.render.use_border if camera is not None else space.use_render_border:
        low_x, low_y, high_x, high_y = (
            getattr(owner, f"{prefix}border_{end}_{axis}") for end in ("min", "max") for axis in "xy"
        )
        x0, x1 = (x0 + share * (x1 - x0) for share in (low_x, high_x))
        y0, y1 = (y0 + share * (y1 - y0) for share in (low_y, high_y))
    left, bottom = max(round(x0), 0), max(round(y0), 0)
    return (left, bottom, max(min(round(x1), region.width), left), max(min(round(y1), region.height), bottom))


def _frame(
    region: bpy.types.Region, r3d: bpy.types.RegionView3D, camera: bpy.types.Object, scene: bpy.types.Scene
) -> tuple[float, float, float, float] | None:
    """Where the camera's frame lies in the region, (x0, y0, x1, y1); it may reach beyond it. None: nowhere."""
    corners = [
        location_3d_to_region_2d(region, r3d, camera.matrix_world @ corner)
        for corner in camera.data.view_frame(scene=scene)
    ]
    if any(corner is None for corner in corners):
        return None
    x, y = ([corner[axis] for corner in corners] for axis in (0, 1))
    return (min(x), min(y), max(x), max(y))
