# SPDX-License-Identifier: GPL-3.0-or-later
"""How bright the inside of a closed body is whose walls let some light through and scatter the rest.

It is an integrating sphere: of diffuse light on the wall from outside a share T gets in, and of what falls on it from
within a share R stays, so the inside has T / (1 - R) of the light outside. Glass keeps 1 - (1 - F) / ior^2 of diffuse
light within, F being its mean reflectance outside: a body of nothing but glass is as bright within as the world.

Lamps light it by shadow rays that go straight through glass. Bent ones would see a lamp as 1 / ior^2 of its solid
angle, and radiance is not scaled by that (see docs/reference/surface-model.md), so that share of their light gets in.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...scene import Closure, Expression, Float64
from ..core.constants import FAINT


def let_in(closures: Sequence[Closure]) -> Float64:
    """(2, 3) of the world's light T / (1 - R), at most 1, and of lamps' the mean of 1 / ior^2; 1 where an expression
    tells of it, or nothing gets in."""
    passes, stays, crossed, bent, shown = np.zeros((5, 3))
    for closure in closures:
        s = closure.surface
        asked = (closure.weight, s.reflectivity, s.opacity, s.base_color, s.reflection_tint, s.transmission_tint, s.ior)
        if any(isinstance(value, Expression) for value in asked):
            return np.ones((2, 3))
        weight, mirrored, opacity, color, reflected, tint, ior = (np.asarray(value, np.float64) for value in asked)
        f0 = ((ior - 1) / (ior + 1)) ** 2
        outside = f0 + (1 - f0) / 21 if ior != 1 else 0.0  # Schlick's mean over the hemisphere
        within = np.clip(1 - (1 - outside) / ior**2, 0, 1) if not s.thin else outside
        rest = weight * (1 - mirrored)
        passes += rest * (1 - opacity) * (1 - within) * tint
        crossed += rest * (1 - opacity) * (1 - outside) * tint
        bent += rest * (1 - opacity) * (1 - outside) * tint / (1 if s.thin else np.maximum(ior, 1) ** 2)
        shown += rest * opacity * color
        stays += weight * mirrored * reflected + rest * (opacity * color + (1 - opacity) * within)
    if not passes.any() or not shown.any():
        return np.ones((2, 3))
    lamps = np.where(crossed > 0, bent / np.where(crossed > 0, crossed, 1), 1)
    return np.stack([np.minimum(passes / np.maximum(1 - stays, FAINT), 1), lamps])
