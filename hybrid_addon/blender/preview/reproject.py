# SPDX-License-Identifier: GPL-3.0-or-later
"""The last picture of a view that has moved: on the surfaces that it showed, as they are seen from where one is now.

What was hidden from the old view is missing, and highlights stay where they were. It is only to look at while the view
moves; at rest the next picture is traced.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene import Camera, Float32, Float64

RINGS = 1
"""So many coarse pixels around what was met lie as deep as what is beside them: there the picture's own edge is."""


@dataclass(frozen=True, eq=False)
class Surface:
    """The surfaces that a view showed, as a coarse mesh.

    points    : (n, 3) float32 in the world, row by row, as the graphics card reads them.
    pixels    : (n, 2) float32, where the view showed them, in its own pixels.
    triangles : (m, 3) int32.
    """

    points: Float32
    pixels: Float32
    triangles: NDArray[np.int32]


def surface_of(camera: Camera, depth: Float32, coverage: Float32, step: int) -> Surface | None:
    """The mesh of a coarse picture; None where nothing was met.

    depth, coverage : (h, w) over the camera's window: distance along the view axis, and where anything was met.
    step            : pixels of the region across one of the camera's.
    """
    known = (coverage > 0) & (depth < 1e9)
    if not known.any():
        return None
    deep, known = _widened(np.asarray(depth, np.float64), known)
    number = np.full(known.shape, -1, np.int32)
    number[known] = np.arange(np.count_nonzero(known))
    row, column = np.nonzero(known)
    x0, y0 = camera.window[:2]
    film_x, film_y = (np.asarray(place + 0.5, np.float64) for place in (column + x0, row + y0))
    points = _placed(camera, film_x, film_y, deep[known])
    corners = [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]]
    whole = np.stack([corner >= 0 for corner in corners]).all(axis=0)
    a, b, c, d = (corner[whole] for corner in corners)
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]).astype(np.int32)
    if len(triangles) == 0:
        return None
    pixels = np.stack([film_x, film_y], axis=1) * step
    return Surface(np.array(points, np.float32, order="C"), np.array(pixels, np.float32, order="C"), triangles)


def _placed(camera: Camera, x: Float64, y: Float64, depth: Float64) -> Float64:
    """(n, 3) places in the world of points of a film, in pixels, at depths (n,)."""
    width, height = camera.resolution
    left, right, bottom, top = camera.view_plane
    across, up = left + (right - left) * x / width, bottom + (top - bottom) * y / height
    scale = depth if camera.projection == "PERSP" else 1.0
    seen = np.stack([across * scale, up * scale, -depth, np.ones_like(depth)])
    placed: Float64 = (np.asarray(camera.matrix_world, np.float64) @ seen)[:3].T
    return placed


def _widened(depth: Float64, known: NDArray[np.bool_]) -> tuple[Float64, NDArray[np.bool_]]:
    """The same with RINGS more pixels around it, as deep as those beside them."""
    for _ in range(RINGS):
        around, total = np.pad(known, 1), np.pad(np.where(known, depth, 0.0), 1)
        count, sums = np.zeros(known.shape), np.zeros(known.shape)
        height, width = known.shape
        for down in range(3):
            for right in range(3):
                count += around[down : down + height, right : right + width]
                sums += total[down : down + height, right : right + width]
        depth = np.where(known, depth, sums / np.maximum(count, 1))
        known = known | (count > 0)
    return depth, known
