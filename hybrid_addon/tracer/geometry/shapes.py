# SPDX-License-Identifier: GPL-3.0-or-later
"""Analytic spheres and planes, and the plane equations of triangles: distances along rays in float64."""

from __future__ import annotations

import numpy as np

from ...scene import Float64
from ..core.vectors import Array, dot


def plane_distance(facets: Float64, origin: Array, direction: Array) -> tuple[Float64, Float64]:
    """Distance t (n,) to a plane and n.direction (n,).

    facets : (4, n) or (4, 1) float64, unit normal and distance from the origin. t is inf or NaN for parallel rays.
    """
    # float64 * float32 is exact enough: the operands are widened before the product.
    toward = facets[0] * direction[0]
    toward += facets[1] * direction[1]
    toward += facets[2] * direction[2]
    height = facets[0] * origin[0]
    height += facets[1] * origin[1]
    height += facets[2] * origin[2]
    np.subtract(facets[3], height, out=height)
    with np.errstate(divide="ignore", invalid="ignore"):  # along the plane
        height /= toward
    return height, toward


def sphere_distance(center: Float64, radius: float, origin: Array, direction: Array) -> Float64:
    """Nearest t > 0 (n,) at which rays meet a sphere, inf for none.

    The robust quadratic: q = -(b + sign(b) sqrt(disc)), t = q/a and c/q (Press et al., Numerical Recipes 5.6), with the
    discriminant from the distance of the centre to the ray (Hearn & Baker; Haines et al., Ray Tracing Gems ch. 7).
    """
    f = [origin[i].astype(np.float64) - center[i] for i in range(3)]
    d = [direction[i].astype(np.float64) for i in range(3)]
    a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    b = f[0] * d[0] + f[1] * d[1] + f[2] * d[2]
    c = f[0] * f[0] + f[1] * f[1] + f[2] * f[2] - radius * radius
    s = b / a
    l2 = sum((f[i] - s * d[i]) ** 2 for i in range(3))
    discriminant = a * (radius * radius - l2)
    root = np.sqrt(np.maximum(discriminant, 0))
    q = -(b + np.where(b < 0, -root, root))
    with np.errstate(divide="ignore", invalid="ignore"):
        t0, t1 = q / a, c / q
    near, far = np.minimum(t0, t1), np.maximum(t0, t1)
    t = np.where(near > 0, near, np.where(far > 0, far, np.inf))
    return np.where(discriminant > 0, t, np.inf)


def onto_sphere(center: Float64, radius: Float64, origin: Array, direction: Array, t: Float64) -> Float64:
    """Distances t (n,), each close to where its ray meets its sphere, made exact by a step of Newton's.

    center, radius : (3, n) and (n,).
    """
    arm = origin + direction * t - center
    slope = 2 * dot(arm, direction)
    return t - np.where(slope != 0, (dot(arm, arm) - radius * radius) / np.where(slope != 0, slope, 1), 0)
