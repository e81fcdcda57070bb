# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of core/vectors.py."""

from __future__ import annotations

import numpy as np

from .declare import Array, f4, f8, kernel, largest_component
from .declare import dot as dot_of


@kernel("tracer.core.vectors.dot", [(f4[2], f4[2]), (f8[2], f8[2]), (f4[2], f8[2]), (f8[2], f4[2])])
def dot(a: Array, b: Array) -> Array:
    """See there. Sums of float32 and float64 products are float64."""
    n = a.shape[1]
    one = a[0, :1] * b[0, :1]  # for its type
    result = np.empty(n, one.dtype)
    for i in range(n):
        result[i] = dot_of(a[0, i], a[1, i], a[2, i], b[0, i], b[1, i], b[2, i])
    return result


@kernel("tracer.core.vectors.largest_component", [(f4[2],)])
def largest(a: Array) -> Array:
    """See there."""
    n = a.shape[1]
    result = np.empty(n, np.float32)
    for i in range(n):
        result[i] = largest_component(a[0, i], a[1, i], a[2, i])
    return result


@kernel("tracer.core.vectors.normalize", [(f4[2],), (f8[2],)])
def normalize(a: Array) -> Array:
    """See there."""
    n = a.shape[1]
    one = a.dtype.type(1)
    result = np.empty((3, n), a.dtype)
    for i in range(n):
        x, y, z = a[0, i], a[1, i], a[2, i]
        scale = one / np.sqrt(dot_of(x, y, z, x, y, z))
        result[0, i], result[1, i], result[2, i] = x * scale, y * scale, z * scale
    return result


@kernel("tracer.core.vectors.orthonormal_basis", [(f4[2],), (f8[2],)])
def orthonormal_basis(normal: Array) -> tuple[Array, Array]:
    """See there."""
    n = normal.shape[1]
    one = normal.dtype.type(1)
    first, second = np.empty((3, n), normal.dtype), np.empty((3, n), normal.dtype)
    for i in range(n):
        x, y, z = normal[0, i], normal[1, i], normal[2, i]
        sign = np.copysign(one, z)
        a = -one / (sign + z)
        b = x * y * a
        first[0, i], first[1, i], first[2, i] = one + sign * x * x * a, sign * b, -sign * x
        second[0, i], second[1, i], second[2, i] = b, sign + y * y * a, -y
    return first, second


@kernel("tracer.core.rays.traceable", [(f4[2], f4[2])])
def traceable(origin: Array, direction: Array) -> Array:
    """See there."""
    n = origin.shape[1]
    zero, limit = np.float32(0), np.float32(np.inf)
    result = np.empty(n, np.bool_)
    for i in range(n):
        probe = (origin[0, i] + origin[1, i] + origin[2, i]) * zero
        x, y, z = direction[0, i], direction[1, i], direction[2, i]
        probe += dot_of(x, y, z, x, y, z)
        result[i] = (probe > zero) & (probe < limit)
    return result
