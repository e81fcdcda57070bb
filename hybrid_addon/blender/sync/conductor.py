# SPDX-License-Identifier: GPL-3.0-or-later
"""Metals by their complex index of refraction n + i k, as the Metallic BSDF's *Physical Conductor* has them."""

from __future__ import annotations

import numpy as np

from ...scene import RGB, Float64


def conductor_tints(n: Float64, k: Float64) -> tuple[RGB, RGB]:
    """Reflectance at normal incidence, and the F82 tint, of a metal of complex indices n + i k (rgb,).

    The tint is what Schlick's approximation is multiplied by at a cosine of 1/7 (Kutz et al., Novel aspects of the
    Adobe Standard Material, 2021).
    """
    f0, f82 = conductor_fresnel(1.0, n, k), conductor_fresnel(1.0 / 7.0, n, k)
    red, green, blue = f0.tolist()
    edge_red, edge_green, edge_blue = np.minimum(f82 / (f0 + (1.0 - f0) * (6.0 / 7.0) ** 5), 1.0).tolist()
    return (red, green, blue), (edge_red, edge_green, edge_blue)


def conductor_fresnel(cosine: float, n: Float64, k: Float64) -> Float64:
    """Unpolarised reflectance (rgb,) of a metal of complex indices n + i k (Born and Wolf, Principles of Optics)."""
    c2 = cosine * cosine
    s2 = 1.0 - c2
    inner = n * n - k * k - s2
    length = np.sqrt(inner * inner + 4.0 * n * n * k * k)
    across, twice = length + c2, 2.0 * cosine * np.sqrt(np.maximum(0.5 * (length + inner), 0.0))
    perpendicular = (across - twice) / np.maximum(across + twice, 1e-12)
    up, down = c2 * length + s2 * s2, twice * s2
    parallel = perpendicular * (up - down) / np.maximum(up + down, 1e-12)
    return 0.5 * (perpendicular + parallel)
