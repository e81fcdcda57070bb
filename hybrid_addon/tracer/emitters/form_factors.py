# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a half space shapes fill, weighted by the cosine: irradiance over pi times radiance, cut off at the horizon.

Exact for polygons (Lambert 1760), and for ellipses that the horizon does not cut; one that it cuts counts as the ball
of the same form factor.
"""

from __future__ import annotations

import numpy as np

from ...scene import Float64
from ..core.constants import LEAST_COSINE
from ..core.vectors import Array, cross, dot


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
    angle = np.arctan2(length, dot(a, b))
    return angle * dot(c, normal) / np.where(length > 0, length, np.float32(1))


def ellipse_form_factor(center: Float64, u: Float64, v: Float64) -> Float64:
    """Irradiance over pi radiance (n,), of the normal +Z, from ellipses with conjugate half axes u, v (3, n).

    With unit half axes e1, e2 of lengths a, b, e3 normal to both and the centre at (X, Y, 1) times its distance L to
    the plane, the cone of the ellipse is dual to D = A^2 e1 e1' + B^2 e2 e2' - C C', A = a / L, B = b / L. The
    eigenvector of D's only negative eigenvalue, -m, is its axis, and the vector irradiance lies along it and is

        F = pi L1 L2 / sqrt((1 + L1^2) (1 + L2^2)),  L1, L2 the tangents of the cone's half angles,

    with (L1 L2)^2 = (A B)^2 / m^3 and L1^2 + L2^2 = (A^2 + B^2 - |C|^2 + m) / m.
    """
    with np.errstate(all="ignore"):
        e1, e2, a, b = _principal_axes(u, v)
        e3 = cross(e1, e2)
        plane = dot(e3, center)
        e3 *= np.sign(plane)
        plane = np.abs(plane)
        x, y = dot(e1, center) / plane, dot(e2, center) / plane
        aa, bb = (a / plane) ** 2, (b / plane) ** 2
        m = _negative_eigenvalue(aa, bb, x, y)
        product = aa * bb / m**3
        total = np.maximum((aa + bb - (x * x + y * y + 1) + m) / m, 0)
        form = np.sqrt(product / (1 + total + product))
        axis = e1 * (x / (aa + m)) + e2 * (y / (bb + m)) + e3 / m
        axis_z = axis[2] / np.sqrt(dot(axis, axis))
        seen = ball_form_factor(form, axis_z)
    return np.where(np.isfinite(seen), seen, 0.0)


def _principal_axes(u: Float64, v: Float64) -> tuple[Float64, Float64, Float64, Float64]:
    """Unit half axes (3, n) of ellipses with conjugate half axes u, v, and their lengths (n,), the longer first.

    They are the eigenvectors of u u' + v v' in the plane of both.
    """
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    angle = 0.5 * np.arctan2(2 * uv, uu - vv)
    cos, sin = np.cos(angle), np.sin(angle)
    first, second = u * cos + v * sin, v * cos - u * sin
    a, b = np.sqrt(dot(first, first)), np.sqrt(dot(second, second))
    return first / a, second / b, a, b


def _negative_eigenvalue(aa: Float64, bb: Float64, x: Float64, y: Float64) -> Float64:
    """m > 0, -m the negative eigenvalue of diag(aa, bb, 0) - c c', c = (x, y, 1): (n,) (Smith 1961)."""
    d11, d22, d33 = aa - x * x, bb - y * y, -1.0
    mean = (d11 + d22 + d33) / 3
    off = x * x * y * y + x * x + y * y
    p2 = ((d11 - mean) ** 2 + (d22 - mean) ** 2 + (d33 - mean) ** 2 + 2 * off) / 6
    p = np.sqrt(p2)
    k11, k22, k33 = (d11 - mean) / p, (d22 - mean) / p, (d33 - mean) / p
    k12, k13, k23 = -x * y / p, -x / p, -y / p
    det = k11 * (k22 * k33 - k23 * k23) - k12 * (k12 * k33 - k23 * k13) + k13 * (k12 * k23 - k22 * k13)
    phi = np.arccos(np.clip(det / 2, -1, 1)) / 3
    result: Float64 = -(mean + 2 * p * np.cos(phi + 2 * np.pi / 3))
    return result


def ball_form_factor(form: Float64, cos: Float64) -> Float64:
    """Irradiance over pi radiance (n,) from balls cut by the horizon: (Snyder 1996, Area light sources, sec. 2).

    form : (n,), the squared sine of half the angle that they take up, what they bring from right above.
    cos  : (n,), of the angle between the normal and their centres.
    """
    sin_s = np.sqrt(np.minimum(form, 1))
    cut = np.abs(cos) < sin_s
    result = np.where(cos > 0, form * cos, 0.0)
    if not cut.any():
        return result
    cos_s, sin_w = np.sqrt(np.maximum(1 - form, 0)), np.sqrt(np.maximum(1 - cos * cos, LEAST_COSINE**2))
    sin_g = np.clip(cos_s / sin_w, 0, 1)
    gamma = np.arcsin(sin_g)
    cos_g = np.cos(gamma)
    g = -2 * sin_w * cos_s * cos_g + np.pi / 2 - gamma + sin_g * cos_g
    h = cos * (cos_g * np.sqrt(np.maximum(form - cos_g**2, 0)) + form * np.arcsin(np.clip(cos_g / sin_s, 0, 1)))
    part = np.where(cos > 0, np.pi * form * cos + g - h, g + h) / np.pi
    return np.where(cut, np.maximum(part, 0), result)
