# SPDX-License-Identifier: GPL-3.0-or-later
"""Camera rays: from film positions to float32 rays relative to the scene's centre."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...procedural import elementary
from ...scene import Camera, Float32, Float64, Lens, Panorama
from .constants import NEAR_MARGIN, WIDE_LENS
from .panorama import directions, places
from .sampler import Sampler, disk
from .vectors import Array

NOTHING = -np.inf
"""t_max of rays that nothing is to be seen along."""

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

    The clip planes are planar, as in Blender: rays start on the plane at clip_start and end on the one at clip_end;
    those of a panorama are spheres, as in Cycles. A panorama's places that show nothing have rays of t_max NOTHING.
    Rays start even later, on the near side of the ball (center, bounds_radius) that holds the scene: rounding their
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

    perspective, panorama = camera.projection == "PERSP", camera.panorama
    if panorama is not None:
        return _panoramic_rays(camera, panorama, plane_x, plane_y, eye, bounds_radius, on_lens)
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
    return _from_ball(foot, exact, unit, camera.clip_start * length, camera.clip_end * length, bounds_radius)


def _from_ball(
    foot: Float64, exact: Float64, unit: Array, clip_start: Float64, clip_end: Float64, bounds_radius: float
) -> tuple[Float32, Array, Float32]:
    """Rays from feet (3, 1 or n) along exact directions (3, n) and as they are rounded, between distances (n,)."""
    # Distances along each ray to where it passes the centre, and to where it enters the ball.
    nearest = -(foot[0] * exact[0] + foot[1] * exact[1] + foot[2] * exact[2])
    start = np.maximum(clip_start, nearest - bounds_radius)
    aim = np.maximum(start, nearest)
    # Aimed with the rounded direction: the ray is exact where the scene is, not where the camera is.
    origin = aim * exact
    origin += foot
    origin -= (aim - start) * unit
    return origin.astype(np.float32), unit, (clip_end - start).astype(np.float32)


def _panoramic_rays(
    camera: Camera,
    panorama: Panorama,
    u: Float64,
    v: Float64,
    eye: Float64,
    bounds_radius: float,
    on_lens: tuple[Float64, Float64] | None,
) -> tuple[Float32, Array, Float32]:
    """`generate_rays` of a panoramic camera through places u, v (n,) of its view plane.

    Its lens lies across each ray (Cycles, camera_sample_panorama), turned so that it is level.
    """
    local = directions(panorama, u, v)
    shown = np.isfinite(local[0])
    local = np.where(shown, local, np.array([[0.0], [0.0], [-1.0]]))
    foot = np.zeros((3, 1))
    if on_lens is not None and camera.lens is not None:
        # Level and upright beside the ray; straight up any level direction is across.
        across = np.stack([-local[2], np.zeros_like(u), local[0]])
        across[0] += (across == 0).all(axis=0)
        across /= np.sqrt((across * across).sum(axis=0))
        upright = np.cross(across, local, axis=0)
        foot = on_lens[0] * across + on_lens[1] * upright
        local = local - foot / camera.lens.focus_distance
        local /= np.sqrt((local * local).sum(axis=0))
    matrix = np.asarray(camera.matrix_world, np.float64)[:3, :3]
    exact, foot = (
        np.stack([m[0] * each[0] + m[1] * each[1] + m[2] * each[2] for m in matrix]) for each in (local, foot)
    )
    n = len(u)
    clip_start, clip_end = np.full(n, float(camera.clip_start)), np.full(n, float(camera.clip_end))
    origin, unit, t_max = _from_ball(
        foot + eye[:, None], exact, exact.astype(np.float32), clip_start, clip_end, bounds_radius
    )
    return origin, unit, np.where(shown, t_max, np.float32(NOTHING))


def near_plane(camera: Camera, center: Float64) -> tuple[Float64, Float64]:
    """Lowest and highest corner (3,) of a box around all places where rays start, but for those on the ball that holds
    the scene (`generate_rays`): nothing is around these."""
    axis_x, axis_y, axis_z, position = (np.asarray(camera.matrix_world, np.float64)[:3, i] for i in range(4))
    if camera.panorama is not None:
        reach = camera.clip_start + (0.0 if camera.lens is None else _widest(camera.lens))
        reach += NEAR_MARGIN * (reach + float(np.max(np.abs(position - center))))
        return position - center - reach, position - center + reach
    left, right, bottom, top = camera.view_plane
    size = camera.clip_start if camera.projection == "PERSP" else 1.0
    corners = np.array([x * size * axis_x + y * size * axis_y for x in (left, right) for y in (bottom, top)])
    corners += position - center - camera.clip_start * axis_z
    slack = NEAR_MARGIN * (np.max(np.abs(corners)) + np.max(np.abs(position - center)))
    if camera.lens is not None:
        slack += _widest(camera.lens) * max(1.0, camera.clip_start / camera.lens.focus_distance)
    return corners.min(axis=0) - slack, corners.max(axis=0) + slack


def _widest(lens: Lens) -> float:
    return lens.radius * max(1.0, 1.0 / lens.ratio)


def project(
    camera: Camera, point: Float64, on_lens: tuple[Float64, Float64] | None = None
) -> tuple[Float64, Float64, Float64]:
    """World points (3, n) to film positions x, y (n,) in pixels, and their depth, of a panorama their distance:
    the inverse of `generate_rays`, of a panorama that of its pinhole; NaN where it shows nothing."""
    local = np.linalg.inv(np.asarray(camera.matrix_world, np.float64))
    position = [
        local[i, 0] * point[0] + local[i, 1] * point[1] + local[i, 2] * point[2] + local[i, 3] for i in range(3)
    ]
    depth = -position[2]
    left, right, bottom, top = camera.view_plane
    if camera.panorama is not None:
        depth = np.sqrt(position[0] * position[0] + position[1] * position[1] + position[2] * position[2])
        position, on_lens = [*places(camera.panorama, np.stack(position) / depth), depth], None
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
