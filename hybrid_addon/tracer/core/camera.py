# SPDX-License-Identifier: GPL-3.0-or-later
"""Camera rays: from film positions to float32 rays relative to the scene's centre."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...procedural import elementary
from ...scene import Camera, Float32, Float64, Lens
from .constants import NEAR_MARGIN, WIDE_LENS
from .sampler import Sampler, disk
from .vectors import Array

LENS = np.uint32(0x4C454E53)
"""The lens's dimension of the sampler."""


def generate_rays(
    camera: Camera,
    x: Float64,
    y: Float64,
    center: Float64,
    bounds_radius: float,
    on_lens: tuple[Float64, Float64] | None = None,
) -> tuple[Float32, Array, Float32]:
    """Rays (origin (3, n), unit direction (3, n), t_max (n,)) through film positions in pixels of the full frame.

    All float32, but for the directions of a very wide lens, which are float64 (see WIDE_LENS).

    The clip planes are planar, as in Blender: rays start on the plane at clip_start and end on the one at clip_end.
    They start even later, on the near side of the ball (center, bounds_radius) that holds the scene: rounding their
    origins to float32 then costs an ulp of the scene's size, not of its distance.

    on_lens : local x, y (n,) in metres of where rays leave the camera's lens, all towards what is sharp at their film
              position; None: its middle, as through a pinhole.
    """
    axis_x, axis_y, axis_z, position = (np.asarray(camera.matrix_world, np.float64)[:3, i] for i in range(4))
    left, right, bottom, top = camera.view_plane
    width, height = camera.resolution
    plane_x = left + (right - left) * (x / width)
    plane_y = bottom + (top - bottom) * (y / height)
    eye = position - center

    perspective = camera.projection == "PERSP"
    direction = np.empty((3, len(x)))
    foot = np.empty((3, 1 if perspective and on_lens is None else len(x)))  # of a pinhole all rays start in one place
    for i in range(3):
        if perspective:
            direction[i] = plane_x * axis_x[i] + plane_y * axis_y[i] - axis_z[i]
            foot[i] = eye[i]
        else:
            direction[i] = -axis_z[i]
            foot[i] = eye[i] + plane_x * axis_x[i] + plane_y * axis_y[i]
        if on_lens is not None and camera.lens is not None:
            offset = on_lens[0] * axis_x[i] + on_lens[1] * axis_y[i]
            foot[i] += offset
            direction[i] -= offset / camera.lens.focus_distance
    length = np.sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2])
    exact = np.divide(direction, length, out=direction)
    unit = exact if is_wide(camera) else exact.astype(np.float32)
    clip_start, clip_end = camera.clip_start * length, camera.clip_end * length
    # Distances along each ray to where it passes the centre, and to where it enters the ball.
    nearest = -(foot[0] * exact[0] + foot[1] * exact[1] + foot[2] * exact[2])
    start = np.maximum(clip_start, nearest - bounds_radius)
    aim = np.maximum(start, nearest)
    # Aimed with the rounded direction: the ray is exact where the scene is, not where the camera is.
    origin = aim * exact
    origin += foot
    origin -= (aim - start) * unit
    return origin.astype(np.float32), unit, (clip_end - start).astype(np.float32)


def near_plane(camera: Camera, center: Float64) -> tuple[Float64, Float64]:
    """Lowest and highest corner (3,) of a box around all places where rays start, but for those on the ball that holds
    the scene (`generate_rays`): nothing is around these."""
    axis_x, axis_y, axis_z, position = (np.asarray(camera.matrix_world, np.float64)[:3, i] for i in range(4))
    left, right, bottom, top = camera.view_plane
    size = camera.clip_start if camera.projection == "PERSP" else 1.0
    corners = np.array([x * size * axis_x + y * size * axis_y for x in (left, right) for y in (bottom, top)])
    corners += position - center - camera.clip_start * axis_z
    slack = NEAR_MARGIN * (np.max(np.abs(corners)) + np.max(np.abs(position - center)))
    if camera.lens is not None:
        widest = camera.lens.radius * max(1.0, 1.0 / camera.lens.ratio)
        slack += widest * max(1.0, camera.clip_start / camera.lens.focus_distance)
    return corners.min(axis=0) - slack, corners.max(axis=0) + slack


def project(
    camera: Camera, point: Float64, on_lens: tuple[Float64, Float64] | None = None
) -> tuple[Float64, Float64, Float64]:
    """World points (3, n) to film positions x, y (n,) in pixels, and their depth: the inverse of `generate_rays`."""
    local = np.linalg.inv(np.asarray(camera.matrix_world, np.float64))
    position = [
        local[i, 0] * point[0] + local[i, 1] * point[1] + local[i, 2] * point[2] + local[i, 3] for i in range(3)
    ]
    depth = -position[2]
    left, right, bottom, top = camera.view_plane
    with np.errstate(all="ignore"):
        scale = 1 / np.where(depth > 0, depth, np.inf) if camera.projection == "PERSP" else np.ones_like(depth)
    if on_lens is not None and camera.lens is not None:
        for i in (0, 1):  # the ray from there through the point meets the plane of focus there
            position[i] = position[i] - on_lens[i] * (1 - depth / camera.lens.focus_distance)
    x = (position[0] * scale - left) / (right - left) * camera.resolution[0]
    y = (position[1] * scale - bottom) / (top - bottom) * camera.resolution[1]
    return x, y, depth


def points_on_lens(lens: Lens, sampler: Sampler, sample: NDArray[np.intp]) -> tuple[Float64, Float64]:
    """Local x, y (n,) in metres of points spread evenly over a lens's opening: one for each of these samples (n,)."""
    return spread_on_lens(lens, *sampler.draws(sample, np.zeros((1, len(sample)), np.uint32)).square(LENS))


def spread_on_lens(lens: Lens, u: Array, v: Array) -> tuple[Float64, Float64]:
    """Local x, y (n,) in metres: the unit square mapped to a lens's opening, keeping shares of the area."""
    x, y = disk(u, v) if lens.blades < 3 else polygon(u, v, lens.blades)
    sin, cos = elementary.sincos(lens.rotation)
    radius = np.float64(lens.radius)
    return radius / lens.ratio * (x * cos - y * sin), radius * (x * sin + y * cos)


def polygon(u: Array, v: Array, corners: int) -> tuple[Array, Array]:
    """Map the unit square to the regular polygon in the unit circle, keeping areas: x, y (n,).

    Each of its triangles takes a strip of u; the middle of the first edge lies at +X.
    """
    strip = np.floor(np.minimum(u * corners, np.float32(corners - 0.5)))
    share, radius = u * corners - strip, np.sqrt(v)
    (y0, x0), (y1, x1) = (elementary.sincos((2 * strip + side) * np.float32(np.pi / corners)) for side in (-1, 1))
    return radius * ((1 - share) * x0 + share * x1), radius * ((1 - share) * y0 + share * y1)


def is_wide(camera: Camera) -> bool:
    """Whether the directions of its rays are float64: see WIDE_LENS."""
    left, right, bottom, top = camera.view_plane
    tangent2 = max(left * left, right * right) + max(bottom * bottom, top * top)
    return camera.projection == "PERSP" and 1 + tangent2 > WIDE_LENS**2
