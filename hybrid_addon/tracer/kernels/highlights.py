# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of highlights: form factors of lamps (emitters/form_factors.py), lobes (shading/ltc.py), Phong's lobe."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..core.constants import LEAST_COSINE, LTC_FADE
from .declare import clip, dot, f4, f8, helper, kernel, largest, least
from .elementary import LONG, SHORT

OVER_TWO_PI4, OVER_TWO_PI4_PHONG = np.float32(0.5 / np.pi), np.float32(1 / (2 * np.pi))
ZERO4, QUARTER4, HALF4, ONE4, TWO4 = (np.float32(v) for v in (0, 0.25, 0.5, 1, 2))
LEAST8, LEAST8_SQUARED, FADE = np.float64(LEAST_COSINE), np.float64(LEAST_COSINE**2), np.float64(LTC_FADE)
LEAST4, LEAST4_SQUARED = np.float32(LEAST_COSINE), np.float32(LEAST_COSINE**2)
LEAST4_BELOW_1 = np.float32(LEAST_COSINE - 1)
PI, HALF_PI, THIRD = math.pi, math.pi / 2, 2 * math.pi / 3

short_arctan2, arctan2, sincos = SHORT.arctan2, LONG.arctan2, LONG.sincos
short_exp, short_log1p = SHORT.exp, SHORT.log1p


# ------------------------------------------------------------------------------------------------ form factors


@helper
def cross(ax, ay, az, bx, by, bz):
    """vectors.cross, of two vectors."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def _quadrilateral(angle_of: Any) -> Any:
    """The form factor of one quadrilateral with numbers of one width. angle_of: its arctan2."""

    @helper
    def edge_term(ax, ay, az, bx, by, bz, nx, ny, nz, zero, one):
        x, y, z = cross(ax, ay, az, bx, by, bz)
        length = np.sqrt(dot(x, y, z, x, y, z))
        angle = angle_of(length, dot(ax, ay, az, bx, by, bz))
        return angle * dot(x, y, z, nx, ny, nz) / (length if length > zero else one)

    @helper
    def edge(ax, ay, az, bx, by, bz, ha, hb, down, up, nx, ny, nz, zero, one):
        """What one edge adds, where the outline goes down and comes up so far, and whether it crosses the horizon."""
        above_a, above_b = ha > zero, hb > zero
        crossing = above_a != above_b
        if crossing:
            s = ha / (ha - hb)
            x, y, z = ax + (bx - ax) * s, ay + (by - ay) * s, az + (bz - az) * s
            if above_a:
                down = x, y, z
                bx, by, bz = x, y, z
            else:
                up = x, y, z
                ax, ay, az = x, y, z
        term = edge_term(ax, ay, az, bx, by, bz, nx, ny, nz, zero, one) if above_a or above_b else zero
        return term, down, up, crossing

    @helper
    def quadrilateral(a, b, c, d, n, zero, one):
        """form_factors.form_factor, of corners and a normal as triples."""
        nx, ny, nz = n
        ha, hb = dot(a[0], a[1], a[2], nx, ny, nz), dot(b[0], b[1], b[2], nx, ny, nz)
        hc, hd = dot(c[0], c[1], c[2], nx, ny, nz), dot(d[0], d[1], d[2], nx, ny, nz)
        down, up = (zero, zero, zero), (zero, zero, zero)
        total, down, up, first = edge(a[0], a[1], a[2], b[0], b[1], b[2], ha, hb, down, up, nx, ny, nz, zero, one)
        more, down, up, second = edge(b[0], b[1], b[2], c[0], c[1], c[2], hb, hc, down, up, nx, ny, nz, zero, one)
        total += more
        more, down, up, third = edge(c[0], c[1], c[2], d[0], d[1], d[2], hc, hd, down, up, nx, ny, nz, zero, one)
        total += more
        more, down, up, fourth = edge(d[0], d[1], d[2], a[0], a[1], a[2], hd, ha, down, up, nx, ny, nz, zero, one)
        total += more
        if first or second or third or fourth:
            total += edge_term(down[0], down[1], down[2], up[0], up[1], up[2], nx, ny, nz, zero, one)
        return abs(total) * OVER_TWO_PI4

    return quadrilateral


short_quadrilateral, long_quadrilateral = _quadrilateral(short_arctan2), _quadrilateral(arctan2)


@kernel("tracer.emitters.form_factors.form_factor_float32", [(f4[2],) * 5])
def form_factor_float32(a, b, c, d, normal):
    """See `form_factor`."""
    n = a.shape[1]
    result = np.empty(n, np.float32)
    for i in range(n):
        result[i] = short_quadrilateral(
            (a[0, i], a[1, i], a[2, i]), (b[0, i], b[1, i], b[2, i]), (c[0, i], c[1, i], c[2, i]),
            (d[0, i], d[1, i], d[2, i]), (normal[0, i], normal[1, i], normal[2, i]), ZERO4, ONE4,
        )  # fmt: skip
    return result


@kernel("tracer.emitters.form_factors.form_factor_above", [(f8[2],) * 3])
def form_factor_above(center, u, v):
    """See the twin."""
    n = center.shape[1]
    result = np.empty(n, np.float64)
    for i in range(n):
        x, y, z = center[0, i], center[1, i], center[2, i]
        ux, uy, uz, vx, vy, vz = u[0, i], u[1, i], u[2, i], v[0, i], v[1, i], v[2, i]
        result[i] = long_quadrilateral(
            (x - ux - vx, y - uy - vy, z - uz - vz), (x + ux - vx, y + uy - vy, z + uz - vz),
            (x + ux + vx, y + uy + vy, z + uz + vz), (x - ux + vx, y - uy + vy, z - uz + vz), (0.0, 0.0, 1.0), 0.0, 1.0,
        )  # fmt: skip
    return result


@helper
def leg(x):
    """elementary._leg."""
    return np.sqrt((1.0 - x) * (1.0 + x))


@helper
def ball(form, cos):
    """form_factors.ball_form_factor, of one ball."""
    sin_s = np.sqrt(least(form, 1.0))
    if not abs(cos) < sin_s:
        return form * cos if cos > 0 else 0.0
    cos_s, sin_w = np.sqrt(largest(1.0 - form, 0.0)), np.sqrt(largest(1.0 - cos * cos, LEAST8_SQUARED))
    sin_g = clip(cos_s / sin_w, 0.0, 1.0)
    gamma = arctan2(sin_g, leg(sin_g))
    _, cos_g = sincos(gamma)
    g = -2.0 * sin_w * cos_s * cos_g + HALF_PI - gamma + sin_g * cos_g
    rim = clip(cos_g / sin_s, 0.0, 1.0)
    h = cos * (cos_g * np.sqrt(largest(form - cos_g * cos_g, 0.0)) + form * arctan2(rim, leg(rim)))
    return largest((PI * form * cos + g - h if cos > 0 else g + h) / PI, 0.0)


@helper
def least_eigenvalue(trace, minors, det):
    """form_factors._least_eigenvalue, of one matrix."""
    mean = trace / 3.0
    p2 = mean * mean - minors / 3.0
    p = np.sqrt(p2)
    x = clip((det - mean * (minors - 2.0 * mean * mean)) / (2.0 * p2 * p), -1.0, 1.0)
    _, cosine = sincos(arctan2(leg(x), x) / 3.0 + THIRD)
    return mean + 2.0 * p * cosine


@helper
def ellipse(cx, cy, cz, ux, uy, uz, vx, vy, vz):
    """form_factors.ellipse_form_factor, of one ellipse."""
    ax, ay, az = cross(ux, uy, uz, vx, vy, vz)
    uu, vv, uv = dot(ux, uy, uz, ux, uy, uz), dot(vx, vy, vz, vx, vy, vz), dot(ux, uy, uz, vx, vy, vz)
    cc, uc, vc = dot(cx, cy, cz, cx, cy, cz), dot(ux, uy, uz, cx, cy, cz), dot(vx, vy, vz, cx, cy, cz)
    trace = uu + vv - cc
    minors = dot(ax, ay, az, ax, ay, az) - (uu * cc - uc * uc) - (vv * cc - vc * vc)
    volume = dot(ax, ay, az, cx, cy, cz)
    volume2 = volume * volume
    m = -least_eigenvalue(trace, minors, -volume2)
    product, total = volume2 / (m * m * m), largest((trace + m) / m, 0.0)
    form = np.sqrt(product / (1.0 + total + product))
    s, t = (vv + m) * uc - uv * vc, (uu + m) * vc - uv * uc
    along = (uu + m) * (vv + m) - uv * uv
    x, y, z = cx * along - ux * s - vx * t, cy * along - uy * s - vy * t, cz * along - uz * s - vz * t
    seen = ball(form, z / np.sqrt(dot(x, y, z, x, y, z)))
    return seen if abs(seen) < np.inf else 0.0


@kernel("tracer.emitters.form_factors.ellipse_form_factor", [(f8[2],) * 3])
def ellipse_form_factor(center, u, v):
    """See there."""
    n = center.shape[1]
    result = np.empty(n, np.float64)
    for i in range(n):
        result[i] = ellipse(
            center[0, i], center[1, i], center[2, i], u[0, i], u[1, i], u[2, i], v[0, i], v[1, i], v[2, i]
        )
    return result


# ------------------------------------------------------------------------------------------------ lobes


@helper
def basis(x, y, z):
    """vectors.orthonormal_basis, of one float64 vector."""
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    return (1.0 + sign * x * x * a, sign * b, -sign * x), (b, sign + y * y * a, -y)


@kernel("tracer.shading.ltc.lobe_frames", [(f4[2], f4[2], f4[1], f8[3])], tables=(3,))
def lobe_frames(wo, n, roughness, table):
    """See there."""
    count, last = n.shape[1], table.shape[1] - 1
    x, y, z = np.empty((3, count), np.float64), np.empty((3, count), np.float64), np.empty((3, count), np.float64)
    stretch = np.empty((3, count), np.float64)
    for k in range(count):
        nx, ny, nz = np.float64(n[0, k]), np.float64(n[1, k]), np.float64(n[2, k])
        ex, ey, ez = np.float64(wo[0, k]), np.float64(wo[1, k]), np.float64(wo[2, k])
        up = dot(nx, ny, nz, ex, ey, ez)
        cos = clip(up, LEAST8, 1.0)
        ax, ay, az = ex - nx * up, ey - ny * up, ez - nz * up
        sin = np.sqrt(dot(ax, ay, az, ax, ay, az))
        if sin > LEAST8:
            ax, ay, az = ax / sin, ay / sin, az / sin
        else:
            (ax, ay, az), _ = basis(nx, ny, nz)
        rough = np.float64(roughness[k])
        alpha = rough * rough
        along, over = np.sqrt(1.0 - cos) * last, clip(rough, 0.0, 1.0) * last
        i, j = max(min(np.int64(along), last - 1), 0), max(min(np.int64(over), last - 1), 0)
        s, t = along - i, over - j
        tilt = mixed(table, 0, i, j, s, t) * alpha
        for row in range(3):
            stretch[row, k] = mixed(table, row + 1, i, j, s, t) * alpha
        sine, cosine = sincos(arctan2(sin, cos) + tilt)
        x[0, k], x[1, k], x[2, k] = -cosine * ax - sine * nx, -cosine * ay - sine * ny, -cosine * az - sine * nz
        y[0, k], y[1, k], y[2, k] = cross(nx, ny, nz, ax, ay, az)
        z[0, k], z[1, k], z[2, k] = cosine * nx - sine * ax, cosine * ny - sine * ay, cosine * nz - sine * az
    return x, y, z, stretch


@helper
def mixed(table, row, i, j, s, t):
    """Bilinear, of four numbers of a table."""
    low = table[row, j, i] * (1.0 - s) + table[row, j, i + 1] * s
    high = table[row, j + 1, i] * (1.0 - s) + table[row, j + 1, i + 1] * s
    return low * (1.0 - t) + high * t


@kernel("tracer.shading.ltc.untransformed", [(f8[2],) * 5])
def untransformed(x, y, z, stretch, a):
    """See there."""
    n = a.shape[1]
    result = np.empty((3, n), np.float64)
    for i in range(n):
        ax, ay, az = a[0, i], a[1, i], a[2, i]
        up = dot(z[0, i], z[1, i], z[2, i], ax, ay, az)
        result[0, i] = (dot(x[0, i], x[1, i], x[2, i], ax, ay, az) - stretch[2, i] * up) / stretch[0, i]
        result[1, i] = dot(y[0, i], y[1, i], y[2, i], ax, ay, az) / stretch[1, i]
        result[2, i] = up
    return result


@kernel("tracer.emitters.light.above_horizon", [(f8[2], f8[1], f8[1], f4[2])])
def above_horizon(toward, d2, radius, n):
    """See there."""
    count = len(d2)
    result = np.empty(count, np.float64)
    for i in range(count):
        d = np.sqrt(d2[i])
        up = dot(n[0, i], n[1, i], n[2, i], toward[0, i], toward[1, i], toward[2, i])
        result[i] = clip((radius[i] / d + up / d) / FADE + 1.0, 0.0, 1.0)
    return result


# ------------------------------------------------------------------------------------------------ Phong


@helper
def phong_of(sin2_h, cos_i, cos_o, wo_h, exponent):
    """scattering.phong, of one highlight."""
    cos2_h = largest(ONE4 - sin2_h, LEAST4)
    power = short_exp(exponent * HALF4 * short_log1p(largest(-sin2_h, LEAST4_BELOW_1)))
    d = (exponent + TWO4) * OVER_TWO_PI4_PHONG * power
    valley = TWO4 * np.sqrt(cos2_h) / wo_h
    visible = least(ONE4 / cos_o, valley * least(ONE4, cos_i / cos_o))
    return d * QUARTER4 * visible


@kernel("tracer.shading.scattering.phong_light", [(f4[2], f4[2], f4[2], f4[1], f4[1], f4[1], f4[2], f4[1])])
def phong_light(wi, wo, n, cos_i, cos_o, exponent, f0, light):
    """See there."""
    count = len(light)
    result = np.empty((3, count), np.float32)
    for i in range(count):
        x, y, z = wi[0, i] + wo[0, i], wi[1, i] + wo[1, i], wi[2, i] + wo[2, i]
        length2 = largest(dot(x, y, z, x, y, z), LEAST4_SQUARED)
        ax, ay, az = cross(x, y, z, n[0, i], n[1, i], n[2, i])
        sin2_h = least(dot(ax, ay, az, ax, ay, az) / length2, ONE4)
        wo_h = np.sqrt(length2) * HALF4
        lobe = phong_of(sin2_h, cos_i[i], cos_o[i], wo_h, exponent[i])
        m = clip(ONE4 - wo_h, ZERO4, ONE4)
        m2 = m * m
        m5 = m2 * m2 * m
        for c in range(3):
            result[c, i] = (f0[c, i] + (ONE4 - f0[c, i]) * m5) * lobe * light[i]
    return result
