# SPDX-License-Identifier: GPL-3.0-or-later
"""Of a tile: highlights of lamps on rough surfaces. Twins of shading/ltc.py and emitters/form_factors.py."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call,assignment,operator,arg-type,call-arg"

from __future__ import annotations

import math

import numpy as np

from ...core import constants
from .. import highlights
from ..declare import clip, dot, helper, largest, stage
from . import records as of

F, D = np.float32, np.float64
LEAST_LAMP, NEAR_BALL, FADE, PI = constants.LEAST_LAMP, constants.NEAR_BALL, constants.LTC_FADE, math.pi
basis, ellipse, long_quadrilateral = highlights.basis, highlights.ellipse, highlights.long_quadrilateral
lobe_frames = stage(highlights.lobe_frames)


@helper
def untransformed(lobe, i, ax, ay, az):
    """Lobe.untransformed of one vector; lobe: x, y, z and stretch of `lobe_frames`."""
    x, y, z, stretch = lobe
    up = dot(z[0, i], z[1, i], z[2, i], ax, ay, az)
    across = (dot(x[0, i], x[1, i], x[2, i], ax, ay, az) - stretch[2, i] * up) / stretch[0, i]
    return across, dot(y[0, i], y[1, i], y[2, i], ax, ay, az) / stretch[1, i], up


@helper
def over_facing_disk(lobe, i, tx, ty, tz, distance, radius):
    """facing_disk.lobe_over_facing_disk."""
    u, v = basis(tx / distance, ty / distance, tz / distance)
    c = untransformed(lobe, i, tx, ty, tz)
    u = untransformed(lobe, i, u[0] * radius, u[1] * radius, u[2] * radius)
    v = untransformed(lobe, i, v[0] * radius, v[1] * radius, v[2] * radius)
    return ellipse(c[0], c[1], c[2], u[0], u[1], u[2], v[0], v[1], v[2])


@helper
def disk_of_ball(r2, d2):
    """point_light.disk_of_ball, of squares."""
    return np.sqrt(r2 * d2 / largest(d2 - r2, NEAR_BALL * d2))


@helper
def window(d2, over_range2):
    """located.range_window in float64."""
    x = d2 * over_range2
    w = largest(1 - x * x, 0.0)
    return w * w


@helper
def spot_factor(numbers, x, y, z):
    """spot_light.spot_factor at an offset from it, float32."""
    a = F(numbers[of.SPOT_ROWS]) * x + F(numbers[of.SPOT_ROWS + 1]) * y + F(numbers[of.SPOT_ROWS + 2]) * z
    b = F(numbers[of.SPOT_ROWS + 3]) * x + F(numbers[of.SPOT_ROWS + 4]) * y + F(numbers[of.SPOT_ROWS + 5]) * z
    c = -(F(numbers[of.SPOT_ROWS + 6]) * x + F(numbers[of.SPOT_ROWS + 7]) * y + F(numbers[of.SPOT_ROWS + 8]) * z)
    if not c > F(0):
        return F(0)
    cosine = F(1) / np.sqrt(F(1) + (a * a + b * b) / (c * c))
    s = clip((cosine - F(numbers[of.CONE])) / F(numbers[of.RIM]), F(0), F(1))
    return s * s * (F(3) - F(2) * s)


@stage
def highlight(kind, is_soft_falloff, numbers, lobe, point, normal, nearest):
    """CompiledLight.highlight: (m,) float32.

    lobe : of `lobe_frames`.   point, normal : (3, m).   nearest : (m,), the points' own uncertainty.
    """
    m = len(nearest)
    result = np.zeros(m, F)
    px, py, pz = D(F(numbers[of.PLACE])), D(F(numbers[of.PLACE + 1])), D(F(numbers[of.PLACE + 2]))
    radius, axis = numbers[of.RADIUS], lobe[2]
    for i in range(m):
        tx, ty, tz = px, py, pz
        if kind != of.SUN:
            tx, ty, tz = px - D(point[0, i]), py - D(point[1, i]), pz - D(point[2, i])
        length2 = dot(tx, ty, tz, tx, ty, tz)
        d2 = length2 if kind == of.SUN else largest(length2, D(nearest[i]) * D(nearest[i]))
        size = numbers[of.HALF_SIZE]
        if kind <= of.SPOT:
            size = radius if is_soft_falloff or radius == 0 else disk_of_ball(radius * radius, length2)
        if dot(axis[0, i], axis[1, i], axis[2, i], tx, ty, tz) <= -size:
            continue
        distance = np.sqrt(d2)
        if kind <= of.SPOT:
            own = largest(radius, LEAST_LAMP * distance)
            size = own
            if is_soft_falloff:
                seen = over_facing_disk(lobe, i, tx, ty, tz, distance, own) / (PI * (own * own))
            else:
                if own < distance:
                    size = disk_of_ball(1.0, d2 / (own * own)) * own
                seen = over_facing_disk(lobe, i, tx, ty, tz, distance, size)
                seen = (seen if own < distance else 1.0) / (PI * (own * own))
        elif kind == of.SUN:
            size = numbers[of.LOBE_RADIUS]
            seen = over_facing_disk(lobe, i, tx, ty, tz, distance, size)
            seen = seen / (PI * (size * size) / (1 + size * size))
        else:
            size = numbers[of.LOBE_RADIUS]
            if dot(numbers[of.AXIS], numbers[of.AXIS + 1], numbers[of.AXIS + 2], tx, ty, tz) >= 0:
                seen = 0.0
            else:
                c = untransformed(lobe, i, tx, ty, tz)
                u = untransformed(lobe, i, numbers[of.AXIS_U], numbers[of.AXIS_U + 1], numbers[of.AXIS_U + 2])
                v = untransformed(lobe, i, numbers[of.AXIS_V], numbers[of.AXIS_V + 1], numbers[of.AXIS_V + 2])
                if kind == of.DISK:
                    seen = ellipse(c[0], c[1], c[2], u[0], u[1], u[2], v[0], v[1], v[2])
                else:
                    seen = long_quadrilateral(
                        (c[0] - u[0] - v[0], c[1] - u[1] - v[1], c[2] - u[2] - v[2]),
                        (c[0] + u[0] - v[0], c[1] + u[1] - v[1], c[2] + u[2] - v[2]),
                        (c[0] + u[0] + v[0], c[1] + u[1] + v[1], c[2] + u[2] + v[2]),
                        (c[0] - u[0] + v[0], c[1] - u[1] + v[1], c[2] - u[2] + v[2]), (0.0, 0.0, 1.0), 0.0, 1.0,
                    )  # fmt: skip
        facing = dot(D(normal[0, i]), D(normal[1, i]), D(normal[2, i]), tx, ty, tz)
        seen = seen * clip((size / distance + facing / distance) / FADE + 1, 0.0, 1.0)
        if kind != of.SUN and numbers[of.OVER_RANGE2] > 0:
            seen = seen * window(d2, D(F(numbers[of.OVER_RANGE2])))
        if kind == of.SPOT:
            x, y, z = (
                point[0, i] - F(numbers[of.PLACE]), point[1, i] - F(numbers[of.PLACE + 1]),
                point[2, i] - F(numbers[of.PLACE + 2]),
            )  # fmt: skip
            seen = seen * spot_factor(numbers, x, y, z)
        result[i] = F(seen)
    return result
