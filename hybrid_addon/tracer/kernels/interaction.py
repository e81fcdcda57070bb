# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of shading/interaction.py: points, normals and origins of hits."""

from __future__ import annotations

import numpy as np

from ..core.constants import ORIGIN_OFFSET
from .declare import Array, b1, clip, dot, f4, f8, i4, i8, kernel, largest, largest_component

OFFSET = np.float32(ORIGIN_OFFSET)
ONE, MINUS_ONE, ZERO = np.float32(1), np.float32(-1), np.float32(0)
CHUNK = 512
TINY = np.finfo(np.float32).tiny


@kernel(
    "tracer.shading.interaction.hit_points", [(i8[1], f4[1], i4[1], f8[1], f4[2], f8[1], f4[2], f4[2])], tables=(0, 1)
)
def hit_points(
    surfaces: Array, extents: Array, prim: Array, t: Array, normal: Array, toward: Array, origin: Array,
    direction: Array,
) -> tuple[Array, ...]:  # fmt: skip
    """See there."""
    n = len(prim)
    numbers, surface, entering = np.empty(n, np.int64), np.empty(n, surfaces.dtype), np.empty(n, np.bool_)
    point, offset = np.empty((3, n)), np.empty(n, np.float32)
    facing, wo, outer = np.empty((3, n), np.float32), np.empty((3, n), np.float32), np.empty((3, n), np.float32)
    # Row by row, some hits at a time: of the 30 rows here each is as far from the next as the wave is long, often a
    # power of two, so they would drive one another out of the cache.
    for start in range(0, n, CHUNK):
        stop = min(start + CHUNK, n)
        for i in range(start, stop):
            p = prim[i]
            numbers[i], surface[i], offset[i] = p, surfaces[p], extents[p]
        for i in range(start, stop):
            entering[i] = toward[i] < 0
        for c in range(3):
            for i in range(start, stop):
                point[c, i] = direction[c, i] * t[i] + origin[c, i]
            for i in range(start, stop):
                facing[c, i] = normal[c, i] * (ONE if toward[i] < 0 else MINUS_ONE)
            for i in range(start, stop):
                wo[c, i] = -direction[c, i]
        for i in range(start, stop):
            x, y, z = np.float32(point[0, i]), np.float32(point[1, i]), np.float32(point[2, i])
            offset[i] = OFFSET * largest(offset[i], largest_component(x, y, z))
        for c in range(3):
            for i in range(start, stop):
                outer[c, i] = facing[c, i] * offset[i] + point[c, i]
    return numbers, surface, entering, point, facing, offset, wo, outer


@kernel("tracer.core.rays.offset_origin", [(f8[2], f4[2], f4[1])])
def offset_origin(point: Array, normal: Array, offset: Array) -> Array:
    """See there."""
    n = len(offset)
    result = np.empty((3, n), np.float32)
    for c in range(3):
        for i in range(n):
            result[c, i] = normal[c, i] * offset[i] + point[c, i]
    return result


@kernel(
    "tracer.shading.interaction.smooth_normals", [(b1[1], f4[2], f8[2], i8[1], f8[2], f4[2], b1[1])], tables=(0, 1, 2)
)
def smooth_normals(
    smooth: Array, normals: Array, planes: Array, prim: Array, point: Array, n_geometric: Array, entering: Array
) -> tuple[int, Array, Array]:
    """See there."""
    n, count = len(prim), 0
    result, weights = np.empty((3, n), np.float32), np.empty((2, n))
    for i in range(n):
        p = prim[i]
        gx, gy, gz = n_geometric[0, i], n_geometric[1, i], n_geometric[2, i]
        result[0, i], result[1, i], result[2, i] = gx, gy, gz
        weights[0, i], weights[1, i] = 0.0, 0.0
        if not smooth[p]:
            continue
        count += 1
        x, y, z = point[0, i], point[1, i], point[2, i]
        u = clip(planes[p, 0] * x + planes[p, 1] * y + planes[p, 2] * z + planes[p, 3], 0.0, 1.0)
        v = clip(planes[p, 4] * x + planes[p, 5] * y + planes[p, 6] * z + planes[p, 7], 0.0, 1 - u)
        weights[0, i], weights[1, i] = u, v
        w0, w1, w2 = np.float32(1 - u - v), np.float32(u), np.float32(v)
        nx = normals[p, 0] * w0 + normals[p, 3] * w1 + normals[p, 6] * w2
        ny = normals[p, 1] * w0 + normals[p, 4] * w1 + normals[p, 7] * w2
        nz = normals[p, 2] * w0 + normals[p, 5] * w1 + normals[p, 8] * w2
        scale = (ONE if entering[i] else MINUS_ONE) / largest(np.sqrt(dot(nx, ny, nz, nx, ny, nz)), TINY)
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        if dot(nx, ny, nz, gx, gy, gz) > ZERO:
            result[0, i], result[1, i], result[2, i] = nx, ny, nz
    return count, result, weights


@kernel("tracer.geometry.aggregate.barycentric_weights", [(f8[2], i8[1], f8[2]), (f8[2], i4[1], f8[2])], tables=(0,))
def barycentric_weights(planes: Array, prim: Array, point: Array) -> Array:
    """See there."""
    n, last = len(prim), len(planes) // 2 - 1
    result = np.empty((2, n))
    for i in range(n):
        x, y, z = point[0, i], point[1, i], point[2, i]
        p = min(max(prim[i], 0), last)
        for k in range(2):
            row = 2 * p + k
            result[k, i] = planes[row, 0] * x + planes[row, 1] * y + planes[row, 2] * z + planes[row, 3]
    return result
