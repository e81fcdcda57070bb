# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a half space shapes fill, weighted by the cosine: irradiance over pi times radiance, cut off at the horizon.

Exact for polygons (Lambert 1760), and for ellipses that the horizon does not cut; one that it cuts counts as the ball
of the same form factor.
"""

from __future__ import annotations

import numpy as np

from ...accelerated import accelerated
from ...procedural import elementary
from ...scene import Float32, Float64
from ..core.constants import LEAST_COSINE
from ..core.vectors import Array, cross, dot, flatnonzero


@accelerated
def form_factor_float32(a: Float32, b: Float32, c: Float32, d: Float32, normal: Float32) -> Float32:
    """`form_factor` of corners a, b, c, d (3, n)."""
    return form_factor([a, b, c, d], normal)


@accelerated
def form_factor_above(center: Float64, u: Float64, v: Float64) -> Float64:
    """`form_factor` (n,) of parallelograms with half edges u, v (3, n), for the normal +Z."""
    corners = [center - u - v, center + u - v, center + u + v, center - u + v]
    return form_factor(corners, np.array([[0.0], [0.0], [1.0]]))


def form_factor(corners: list[Array], normal: Array) -> Array:
    """Irradiance over pi radiance (n,) from a quadrilateral of either winding, clipped at the horizon: Lambert 1760.

    E / L = 1/2 sum over edges of angle(a, b) n.(a x b)/|a x b| (Arvo 1994, sec. 4), over the part above the horizon.
    What clipping opens is closed along the horizon, from where the outline goes down to where it comes up again.

    corners : four (3, n) arrays, relative to the point.
    """
    heights = [dot(c, normal) for c in corners]
    total = np.zeros_like(heights[0])
    down, up = np.zeros_like(corners[0]), np.zeros_like(corners[0])
    clipped = np.zeros(len(total), bool)
    for i, j in ((0, 1), (1, 2), (2, 3), (3, 0)):
        a, b, ha, hb = corners[i], corners[j], heights[i], heights[j]
        above_a, above_b = ha > 0, hb > 0
        crossing = above_a != above_b
        if crossing.any():
            s = ha / np.where(crossing, ha - hb, np.float32(1))
            horizon = a + (b - a) * s
            sinks, rises = crossing & above_a, crossing & above_b
            down, up = np.where(sinks, horizon, down), np.where(rises, horizon, up)
            a, b = np.where(rises, horizon, a), np.where(sinks, horizon, b)
            clipped |= crossing
        total += np.where(above_a | above_b, _edge_term(a, b, normal), np.float32(0))
    if clipped.any():
        total += np.where(clipped, _edge_term(down, up, normal), np.float32(0))
    return np.asarray(np.abs(total) * np.float32(0.5 / np.pi))


def _edge_term(a: Array, b: Array, normal: Array) -> Array:
    """angle(a, b) n.(a x b) / |a x b|, 0 for edges that point at the receiver."""
    c = cross(a, b)
    length = np.sqrt(dot(c, c))
    angle = elementary.arctan2(length, dot(a, b))
    return angle * dot(c, normal) / np.where(length > 0, length, np.float32(1))


@accelerated
def ellipse_form_factor(center: Float64, u: Float64, v: Float64) -> Float64:
    """Irradiance over pi radiance (n,), of the normal +Z, from ellipses with conjugate half axes u, v (3, n).

    Of an ellipse whose centre is at c the cone is dual to D = u u' + v v' - c c'. The eigenvector of D's only negative
    eigenvalue, -m, is its axis, and the vector irradiance lies along it and is

        F = pi L1 L2 / sqrt((1 + L1^2) (1 + L2^2)),  L1, L2 the tangents of the cone's half angles,

    with (L1 L2)^2 = -det D / m^3 = ((u x v).c)^2 / m^3 and L1^2 + L2^2 = (tr D + m) / m. The axis is
    (u u' + v v' + m)^-1 c.
    """
    with np.errstate(all="ignore"):
        across = cross(u, v)
        uu, vv, uv, cc = dot(u, u), dot(v, v), dot(u, v), dot(center, center)
        uc, vc, trace = dot(u, center), dot(v, center), uu + vv - cc
        minors = dot(across, across) - (uu * cc - uc * uc) - (vv * cc - vc * vc)
        volume2 = dot(across, center) ** 2
        m = -_least_eigenvalue(trace, minors, -volume2)
        product, total = volume2 / (m * m * m), np.maximum((trace + m) / m, 0)
        form = np.sqrt(product / (1 + total + product))
        s, t = (vv + m) * uc - uv * vc, (uu + m) * vc - uv * uc
        axis = center * ((uu + m) * (vv + m) - uv * uv) - u * s - v * t
        seen = ball_form_factor(form, axis[2] / np.sqrt(dot(axis, axis)))
    return np.where(np.isfinite(seen), seen, 0.0)


def _least_eigenvalue(trace: Float64, minors: Float64, det: Float64) -> Float64:
    """(n,) of symmetric 3 x 3 matrices, by their trace, the sum of their principal minors, and determinant (Smith
    1961)."""
    mean = trace / 3
    p2 = mean * mean - minors / 3
    p = np.sqrt(p2)
    phi = elementary.arccos(np.clip((det - mean * (minors - 2 * mean * mean)) / (2 * p2 * p), -1, 1)) / 3
    return np.asarray(mean + 2 * p * elementary.cos(phi + 2 * np.pi / 3))


def ball_form_factor(form: Float64, cos: Float64) -> Float64:
    """Irradiance over pi radiance (n,) from balls cut by the horizon: (Snyder 1996, Area light sources, sec. 2).

    form : (n,), the squared sine of half the angle that they take up, what they bring from right above.
    cos  : (n,), of the angle between the normal and their centres.
    """
    sin_s = np.sqrt(np.minimum(form, 1))
    cut = flatnonzero(np.abs(cos) < sin_s)
    result = np.where(cos > 0, form * cos, 0.0)
    if len(cut) == 0:
        return result
    form, cos, sin_s = form.take(cut), cos.take(cut), sin_s.take(cut)
    cos_s, sin_w = np.sqrt(np.maximum(1 - form, 0)), np.sqrt(np.maximum(1 - cos * cos, LEAST_COSINE**2))
    sin_g = np.clip(cos_s / sin_w, 0, 1)
    gamma = elementary.arcsin(sin_g)
    cos_g = elementary.cos(gamma)
    g = -2 * sin_w * cos_s * cos_g + np.pi / 2 - gamma + sin_g * cos_g
    h = cos * (cos_g * np.sqrt(np.maximum(form - cos_g**2, 0)) + form * elementary.arcsin(np.clip(cos_g / sin_s, 0, 1)))
    part = np.where(cos > 0, np.pi * form * cos + g - h, g + h) / np.pi
    result[cut] = np.maximum(part, 0)
    return result
