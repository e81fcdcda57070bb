# SPDX-License-Identifier: GPL-3.0-or-later
"""Fresnel's equations: the one place for the nodes that ask for them and for the tracer's interfaces."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..accelerated import accelerated

Array = NDArray[Any]


@accelerated
def fresnel_dielectric(cos_i: Array, eta: Array) -> Array:
    """Exact unpolarised reflectance (n,) of a dielectric; 1 beyond the critical angle, exactly 0 for eta = 1.

    Fresnel's equations with g^2 = eta^2 - 1 + c^2 (Cook & Torrance 1982), arranged so that nothing cancels near
    eta = 1:
    r_s = (g - c) / (g + c) = k / (c + g)^2 with k = eta^2 - 1, and, as c (c + g) - 1 = c g - s^2 with s^2 = 1 - c^2,
    r_p = r_s (c (g + c) - 1) / (c (g - c) + 1) = r_s (c g - s^2) / (c g + s^2).

    cos_i : (n,) float64, clamped to 0..1.  eta : (n,) float64 > 0. Both float32 give float32, good to 1e-6 away from
    the critical angle.
    """
    c = np.clip(cos_i, 0.0, 1.0)
    k = (eta - 1) * (eta + 1)
    g = np.sqrt(np.maximum(c * c + k, 0.0))  # 0 beyond the critical angle: then r_s^2 and r_p^2 are at least 1
    s2, cg = (1 - c) * (1 + c), c * g
    g += c
    g *= g
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        rs = k / g
        rp = rs * (cg - s2) / (cg + s2)
        reflectance = 0.5 * (rs * rs + rp * rp)
    # Along a surface of IOR 1 that is 0 / 0, which fmax makes 0: there is nothing that could reflect.
    result: Array = np.fmin(np.fmax(reflectance, 0.0), 1.0)
    return result
