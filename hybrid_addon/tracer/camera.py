"""Camera rays: from film positions to float32 rays relative to the scene's centre."""

from __future__ import annotations

import numpy as np

from ..scene import Camera, Float32, Float64


def generate_rays(
    camera: Camera, x: Float64, y: Float64, center: Float64, bounds_radius: float
) -> tuple[Float32, Float32, Float32]:
    """Rays (origin (3, n), unit direction (3, n), t_max (n,)) through film positions in pixels of the full frame.

    The clip planes are planar, as in Blender: rays start on the plane at clip_start and end on the one at clip_end.
    They start even later, on the near side of the ball (center, bounds_radius) that holds the scene: rounding their
    origins to float32 then costs an ulp of the scene's size, not of its distance.
    """
    axis_x, axis_y, axis_z, position = (np.asarray(camera.matrix_world, np.float64)[:3, i] for i in range(4))
    left, right, bottom, top = camera.view_plane
    width, height = camera.resolution
    plane_x = left + (right - left) * (x / width)
    plane_y = bottom + (top - bottom) * (y / height)
    depth_of_center = float(((center - position) * -axis_z).sum())
    start = max(camera.clip_start, depth_of_center - bounds_radius)
    eye = position - center

    direction = np.empty((3, len(x)))
    origin = np.empty((3, len(x)), np.float32)
    if camera.projection == "PERSP":
        for i in range(3):
            direction[i] = plane_x * axis_x[i] + plane_y * axis_y[i] - axis_z[i]
            origin[i] = eye[i] + start * direction[i]
    else:
        for i in range(3):
            direction[i] = -axis_z[i]
            origin[i] = eye[i] + plane_x * axis_x[i] + plane_y * axis_y[i] - start * axis_z[i]
    length = np.sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2])
    t_max = (camera.clip_end - start) * length
    return origin, (direction / length).astype(np.float32), t_max.astype(np.float32)
