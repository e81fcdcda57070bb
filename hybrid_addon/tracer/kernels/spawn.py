# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of shading/spawn.py and scattering.py: Fresnel, what rays carry on, and where to."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.constants import LEAST_COSINE, MIN_OUTER_COSINE, OUTER_COSINE_SHARE
from .declare import Array, b1, boolean, clip, dot, f4, f8, helper, kernel, largest, least

ONE, TWO, ZERO = np.float32(1), np.float32(2), np.float32(0)
SHARE, MOST = np.float32(OUTER_COSINE_SHARE), np.float32(MIN_OUTER_COSINE)
LEAST, LEAST2 = np.float64(LEAST_COSINE), np.float64(LEAST_COSINE**2)


@helper
def leaving(wo: Any, normal: Any) -> Any:
    """scattering._least_cosine, of two vectors."""
    return least(SHARE * np.abs(dot(wo[0], wo[1], wo[2], normal[0], normal[1], normal[2])), MOST)


@helper
def unit(x: Any, y: Any, z: Any, one: Any) -> Any:
    """vectors.normalize, of one vector."""
    scale = one / np.sqrt(dot(x, y, z, x, y, z))
    return x * scale, y * scale, z * scale


@helper
def fresnel_of(cosine: Any, eta: Any, zero: Any, half: Any, one: Any) -> Any:
    """fresnel.fresnel_dielectric, of one hit; the constants have its type."""
    c = clip(cosine, zero, one)
    k = (eta - one) * (eta + one)
    g = np.sqrt(largest(c * c + k, zero))
    s2, cg = (one - c) * (one + c), c * g
    g += c
    g *= g
    rs = k / g
    rp = rs * (cg - s2) / (cg + s2)
    reflectance = half * (rs * rs + rp * rp)
    reflectance = reflectance if reflectance > zero else zero
    return reflectance if reflectance < one else one


@kernel("procedural.fresnel.fresnel_dielectric", [(f4[1], f4[1]), (f8[1], f8[1])])
def fresnel_dielectric(cos_i: Array, eta: Array) -> Array:
    """See there."""
    zero, half, one = cos_i.dtype.type(0), cos_i.dtype.type(0.5), cos_i.dtype.type(1)
    result = np.empty(len(cos_i), cos_i.dtype)
    for i in range(len(cos_i)):
        result[i] = fresnel_of(cos_i[i], eta[i], zero, half, one)
    return result


@kernel("tracer.shading.scattering.shares", [(f4[2], f4[2], f4[2], f4[2], f4[1], f4[1], b1[1])])
def shares(
    throughput: Array, mirror: Array, interface_tint: Array, tint: Array, interface: Array, fresnel: Array,
    reflects: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """See there."""
    n = len(fresnel)
    reflected, transmitted = np.empty((3, n), np.float32), np.empty((3, n), np.float32)
    for i in range(n):
        f, open_share = fresnel[i], interface[i]
        back = open_share * f
        on = open_share * (ONE - f if reflects[i] or f >= ONE else ONE)
        for c in range(3):
            reflected[c, i] = throughput[c, i] * (mirror[c, i] + interface_tint[c, i] * back)
            transmitted[c, i] = throughput[c, i] * (tint[c, i] * on)
    return reflected, transmitted


@kernel("tracer.shading.scattering.mirror_directions", [(f4[2], f4[2], f4[2], boolean)])
def mirror_directions(wo: Array, n_shading: Array, n_geometric: Array, curved: bool) -> Array:
    """See there."""
    n = wo.shape[1]
    result = np.empty((3, n), np.float32)
    for i in range(n):
        w = wo[0, i], wo[1, i], wo[2, i]
        x, y, z = n_shading[0, i], n_shading[1, i], n_shading[2, i]
        twice = TWO * dot(w[0], w[1], w[2], x, y, z)
        rx, ry, rz = x * twice - w[0], y * twice - w[1], z * twice - w[2]
        if curved:
            up = n_geometric[0, i], n_geometric[1, i], n_geometric[2, i]
            lowest = leaving(w, up)
            if dot(rx, ry, rz, up[0], up[1], up[2]) < lowest:
                x, y, z = turned(w, (x, y, z), up, lowest)
                twice = TWO * dot(w[0], w[1], w[2], x, y, z)
                rx, ry, rz = x * twice - w[0], y * twice - w[1], z * twice - w[2]
        result[0, i], result[1, i], result[2, i] = unit(rx, ry, rz, ONE)
    return result


@helper
def turned(wo: Any, n: Any, n_geometric: Any, lowest: Any) -> Any:
    """The part of scattering.reflecting_normal where the mirror direction would go into the surface."""
    ux, uy, uz = np.float64(n_geometric[0]), np.float64(n_geometric[1]), np.float64(n_geometric[2])
    ex, ey, ez = np.float64(wo[0]), np.float64(wo[1]), np.float64(wo[2])
    ax, ay, az = np.float64(n[0]), np.float64(n[1]), np.float64(n[2])
    height = dot(ax, ay, az, ux, uy, uz)
    ax, ay, az = ax - ux * height, ay - uy * height, az - uz * height
    length = largest(np.sqrt(dot(ax, ay, az, ax, ay, az)), LEAST)
    ax, ay, az = ax / length, ay / length, az / length
    t, x, z = np.float64(lowest), dot(ex, ey, ez, ax, ay, az), largest(dot(ex, ey, ez, ux, uy, uz), 0.0)
    a = largest(x * x + z * z, LEAST2)
    b = 2 * (a + z * t)
    s = t + z
    root = np.sqrt(largest(b * b - 4 * a * (s * s), 0.0))
    steep2 = clip((b + (root if x < 0 else -root)) / (4 * a), 0.0, 1.0)
    flat, steep = np.sqrt(1 - steep2), np.sqrt(steep2)
    x, y, z = unit(ax * flat + ux * steep, ay * flat + uy * steep, az * flat + uz * steep, 1.0)
    return np.float32(x), np.float32(y), np.float32(z)


@kernel("tracer.shading.scattering.refracted_directions", [(f4[2], f4[2], f4[2], f8[1], f8[1], boolean)])
def refracted_directions(
    wo: Array, n_shading: Array, n_geometric: Array, cos_i: Array, eta: Array, curved: bool
) -> Array:
    """See there."""
    n = wo.shape[1]
    result = np.empty((3, n), np.float32)
    for i in range(n):
        c, e = cos_i[i], eta[i]
        along = c - np.sqrt((e - 1) * (e + 1) + c * c)
        bx = (np.float64(n_shading[0, i]) * along - np.float64(wo[0, i])) / e
        by = (np.float64(n_shading[1, i]) * along - np.float64(wo[1, i])) / e
        bz = (np.float64(n_shading[2, i]) * along - np.float64(wo[2, i])) / e
        bx, by, bz = unit(bx, by, bz, 1.0)
        x, y, z = np.float32(bx), np.float32(by), np.float32(bz)
        if curved:
            down = -n_geometric[0, i], -n_geometric[1, i], -n_geometric[2, i]
            lift = leaving((wo[0, i], wo[1, i], wo[2, i]), down) - dot(x, y, z, down[0], down[1], down[2])
            if lift > ZERO:
                x, y, z = unit(x + down[0] * lift, y + down[1] * lift, z + down[2] * lift, ONE)
        result[0, i], result[1, i], result[2, i] = x, y, z
    return result
