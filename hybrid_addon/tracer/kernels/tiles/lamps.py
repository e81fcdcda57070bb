# SPDX-License-Identifier: GPL-3.0-or-later
"""Of a tile: what lamps send to hits that nothing hides, and where shadow rays go.

Twins of emitters/ and shading/direct.py.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call,assignment,operator,arg-type,call-arg"

from __future__ import annotations

import math

import numpy as np

from ...core import constants
from ...materials.columns import ROWS
from .. import highlights, sampler
from ..declare import clip, dot, helper, largest, stage
from ..elementary import SHORT
from . import records as of
from .highlights import spot_factor

F, D, U = np.float32, np.float64, np.uint32
ZERO, HALF, ONE, TWO, INF = F(0), F(0.5), F(1), F(2), F(np.inf)
LEAST, LEAST2, NEAR_BALL = F(constants.LEAST_COSINE), F(constants.LEAST_COSINE**2), F(constants.NEAR_BALL)
EIGHTH, LEAST_RADIUS = F(math.pi / 4), F(constants.LEAST_RADIUS)
SPECULAR, EXPONENT = ROWS["specular"].start, ROWS["exponent"].start
near_0, phong_of = SHORT.sincos_near_0, highlights.phong_of
ellipse, short_quadrilateral = highlights.ellipse, highlights.short_quadrilateral
hash32, permute = sampler.hash32, sampler.permute
R2_X, R2_Y, SCALE, OTHER = sampler.R2_X, sampler.R2_Y, sampler.SCALE, sampler.OTHER


@helper
def window4(d2, over_range2):
    """located.range_window in float32."""
    x = d2 * over_range2
    w = largest(ONE - x * x, ZERO)
    return w * w


@stage
def illuminate(kind, falloff, numbers, point, normal, nearest):
    """CompiledLight.illuminate: wi (3, m), cosine, diffuse, specular (m,)."""
    m = len(nearest)
    wi, cosine, diffuse, specular = np.empty((3, m), F), np.empty(m, F), np.empty(m, F), np.empty(m, F)
    px, py, pz = F(numbers[of.PLACE]), F(numbers[of.PLACE + 1]), F(numbers[of.PLACE + 2])
    if kind == of.SUN:
        for i in range(m):
            wi[0, i], wi[1, i], wi[2, i] = px, py, pz
            c = largest(dot(px, py, pz, normal[0, i], normal[1, i], normal[2, i]), ZERO)
            cosine[i], diffuse[i], specular[i] = c, c, ONE if c > ZERO else ZERO
        return wi, cosine, diffuse, specular
    if kind > of.SUN:
        of_area(kind, numbers, point, normal, nearest, wi, cosine, diffuse, specular)
        return wi, cosine, diffuse, specular
    radius2, over_range2 = F(numbers[of.RADIUS] * numbers[of.RADIUS]), F(numbers[of.OVER_RANGE2])
    has_range = numbers[of.OVER_RANGE2] > 0
    for i in range(m):
        x, y, z = px - point[0, i], py - point[1, i], pz - point[2, i]
        d2 = largest(dot(x, y, z, x, y, z), nearest[i] * nearest[i])
        scale = ONE / np.sqrt(d2)
        x, y, z = x * scale, y * scale, z * scale
        received = ONE / (d2 + radius2) if falloff else ONE / largest(d2, radius2)
        if has_range:
            received = received * window4(d2, over_range2)
        c = largest(dot(x, y, z, normal[0, i], normal[1, i], normal[2, i]), ZERO)
        wi[0, i], wi[1, i], wi[2, i] = x, y, z
        cosine[i], specular[i] = c, received
    if kind == of.SPOT:
        for i in range(m):
            specular[i] = specular[i] * spot_factor(numbers, point[0, i] - px, point[1, i] - py, point[2, i] - pz)
    for i in range(m):
        specular[i] = specular[i] * (ONE if cosine[i] > ZERO else ZERO)
        diffuse[i] = specular[i] * cosine[i]
    return wi, cosine, diffuse, specular


@stage
def of_area(kind, numbers, point, normal, nearest, wi, cosine, diffuse, specular):
    """CompiledAreaLight.illuminate, into the last four."""
    px, py, pz = F(numbers[of.PLACE]), F(numbers[of.PLACE + 1]), F(numbers[of.PLACE + 2])
    sx, sy, sz = F(numbers[of.AXIS]), F(numbers[of.AXIS + 1]), F(numbers[of.AXIS + 2])
    ux, uy, uz = numbers[of.AXIS_U], numbers[of.AXIS_U + 1], numbers[of.AXIS_U + 2]
    vx, vy, vz = numbers[of.AXIS_V], numbers[of.AXIS_V + 1], numbers[of.AXIS_V + 2]
    area, spread, far2 = F(numbers[of.AREA_SIZE]), F(numbers[of.AREA_SIZE] / (2 * math.pi)), F(numbers[of.FAR2])
    for i in range(len(nearest)):
        tx, ty, tz = px - point[0, i], py - point[1, i], pz - point[2, i]
        d2 = largest(dot(tx, ty, tz, tx, ty, tz), nearest[i] * nearest[i])
        scale = ONE / np.sqrt(d2)
        x, y, z = tx * scale, ty * scale, tz * scale
        n = normal[0, i], normal[1, i], normal[2, i]
        front, c = largest(-dot(sx, sy, sz, x, y, z), ZERO), largest(dot(x, y, z, n[0], n[1], n[2]), ZERO)
        bright, e = area * front / (d2 + spread), area * front * c / d2
        if d2 < far2 and front > ZERO:
            if kind == of.AREA:
                e = F(np.pi) * short_quadrilateral(
                    (tx + F(-ux - vx), ty + F(-uy - vy), tz + F(-uz - vz)),
                    (tx + F(ux - vx), ty + F(uy - vy), tz + F(uz - vz)),
                    (tx + F(ux + vx), ty + F(uy + vy), tz + F(uz + vz)),
                    (tx + F(-ux + vx), ty + F(-uy + vy), tz + F(-uz + vz)), n, ZERO, ONE,
                )  # fmt: skip
            else:
                ax, ay, az, bx, by, bz = basis4(n[0], n[1], n[2])
                e = F(F(np.pi) * ellipse(
                    *in_frame((ax, ay, az), (bx, by, bz), n, tx, ty, tz),
                    *in_frame((ax, ay, az), (bx, by, bz), n, F(ux), F(uy), F(uz)),
                    *in_frame((ax, ay, az), (bx, by, bz), n, F(vx), F(vy), F(vz)),
                ))  # fmt: skip
        if numbers[of.OVER_RANGE2] > 0:
            w = window4(d2, F(numbers[of.OVER_RANGE2]))
            bright, e = bright * w, e * w
        wi[0, i], wi[1, i], wi[2, i] = x, y, z
        cosine[i], diffuse[i], specular[i] = c, e, bright


@helper
def in_frame(a, b, n, x, y, z):
    """A float32 vector along three axes, in float64."""
    return D(dot(a[0], a[1], a[2], x, y, z)), D(dot(b[0], b[1], b[2], x, y, z)), D(dot(n[0], n[1], n[2], x, y, z))


@stage
def add_phong(skins, numbers, surface, place, share, wo, n, cos_o, wi, cosine, received, arriving):
    """direct._add_phong."""
    strength = F(numbers[of.OF_SPECULAR])
    for i in range(len(surface)):
        s = surface[i]
        if (
            not (received[i] > ZERO and cosine[i] > ZERO)
            or not skins.flags[of.SPECULAR, s]
            or skins.flags[of.LAYERED, s]
        ):
            continue
        x, y, z, c_o = wo[0, i], wo[1, i], wo[2, i], cos_o[i]
        nx, ny, nz = n[0, i], n[1, i], n[2, i]
        if c_o < LEAST:
            lift = LEAST - c_o
            x, y, z = x + nx * lift, y + ny * lift, z + nz * lift
            scale = ONE / np.sqrt(dot(x, y, z, x, y, z))
            x, y, z, c_o = x * scale, y * scale, z * scale, largest(c_o, LEAST)
        bx, by, bz = wi[0, i] + x, wi[1, i] + y, wi[2, i] + z
        length2 = largest(dot(bx, by, bz, bx, by, bz), LEAST2)
        ax, ay, az = by * nz - bz * ny, bz * nx - bx * nz, bx * ny - by * nx
        sin2 = dot(ax, ay, az, ax, ay, az) / length2
        sin2, wo_h = (sin2 if sin2 < ONE else ONE), np.sqrt(length2) * HALF
        p = place[i]
        e = skins.values[EXPONENT, p] + skins.more[EXPONENT, p] * share[i]
        lobe = phong_of(sin2, cosine[i], c_o, wo_h, e)
        m = clip(ONE - wo_h, ZERO, ONE)
        m2 = m * m
        m5 = m2 * m2 * m
        light = received[i] * strength
        for c in range(3):
            f0 = skins.values[SPECULAR + c, p] + skins.more[SPECULAR + c, p] * share[i]
            arriving[c, i] += (f0 + (ONE - f0) * m5) * lobe * light


@stage
def shadow_directions(kind, falloff, soft, numbers, origin, normal, u, v):
    """CompiledLight.shadow_rays: wi (3, m), distance (m,)."""
    m = origin.shape[1]
    wi, distance = np.empty((3, m), F), np.empty(m, F)
    px, py, pz = F(numbers[of.PLACE]), F(numbers[of.PLACE + 1]), F(numbers[of.PLACE + 2])
    radius, radius2 = F(numbers[of.RADIUS]), F(numbers[of.RADIUS] * numbers[of.RADIUS])
    is_sun = kind == of.SUN
    for i in range(m):
        x, y, z = px, py, pz
        if not is_sun:
            x, y, z = px - origin[0, i], py - origin[1, i], pz - origin[2, i]
        if soft:
            if kind == of.AREA:
                a, b = TWO * u[i] - ONE, TWO * v[i] - ONE
            else:
                a, b = on_disk(u[i], v[i])
            if kind <= of.SUN:
                d2 = dot(x, y, z, x, y, z)
                r = radius if falloff or is_sun else np.sqrt(radius2 * d2 / largest(d2 - radius2, NEAR_BALL * d2))
                scale = ONE / np.sqrt(d2)
                ux, uy, uz, vx, vy, vz = basis4(x * scale, y * scale, z * scale)
                a, b = a * r, b * r
            else:
                ux, uy, uz = F(numbers[of.AXIS_U]), F(numbers[of.AXIS_U + 1]), F(numbers[of.AXIS_U + 2])
                vx, vy, vz = F(numbers[of.AXIS_V]), F(numbers[of.AXIS_V + 1]), F(numbers[of.AXIS_V + 2])
            ox, oy, oz = ux * a + vx * b, uy * a + vy * b, uz * a + vz * b
            side = dot(x + ox, y + oy, z + oz, normal[0, i], normal[1, i], normal[2, i])
            sign = F(math.copysign(ONE, side))
            x, y, z = x + ox * sign, y + oy * sign, z + oz * sign
        elif is_sun:
            wi[0, i], wi[1, i], wi[2, i], distance[i] = x, y, z, INF
            continue
        d = np.sqrt(dot(x, y, z, x, y, z))
        scale = ONE / d
        wi[0, i], wi[1, i], wi[2, i], distance[i] = x * scale, y * scale, z * scale, INF if is_sun else d
    return wi, distance


@helper
def basis4(x, y, z):
    """vectors.orthonormal_basis of a float32 vector."""
    sign = F(math.copysign(ONE, z))
    a = -ONE / (sign + z)
    b = x * y * a
    return ONE + sign * x * x * a, sign * b, -sign * x, b, sign + y * y * a, -y


@helper
def on_disk(u, v):
    """sampler.disk."""
    a, b = TWO * u - ONE, TWO * v - ONE
    across, up = abs(a), abs(b)
    radius, small = (across, up) if across >= up else (up, across)
    sine, cosine = near_0(EIGHTH * small / largest(radius, LEAST_RADIUS))
    steep = up > across
    s, c = (cosine if steep else sine), (sine if steep else cosine)
    return F(math.copysign(radius * c, a)), F(math.copysign(radius * s, b))


@stage
def square(key, number, dimension, part, parts):
    """sampler.square_points."""
    n = len(key)
    u, v = np.empty(n, F), np.empty(n, F)
    times, more = U(parts), U(part if parts != 1 else 0)
    for i in range(n):
        k = hash32(U(key[i] ^ dimension))
        m = permute(U(U(number[i] * times) + more), hash32(k))
        u[i] = F(U(k + U(m * R2_X))) * SCALE
        v[i] = F(U(hash32(U(k ^ OTHER)) + U(m * R2_Y))) * SCALE
    return u, v
