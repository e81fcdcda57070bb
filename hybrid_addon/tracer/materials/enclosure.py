# SPDX-License-Identifier: GPL-3.0-or-later
"""How bright the inside of a closed body is whose walls let some light through and scatter the rest.

It is an integrating sphere: of diffuse light on the wall from outside a share T gets in, and of what falls on it from
within a share A is absorbed or gets lost, so the inside has T / (T + A) of the light outside. Glass keeps
1 - (1 - F) / ior^2 of diffuse light within, F being its mean reflectance outside: a body of nothing but glass is as
bright within as the world.
"""

from __future__ import annotations

import numpy as np

from ...scene import Float64
from .fields import Fields


def wall_shares(fields: Fields) -> tuple[Float64, Float64]:
    """Of diffuse light on a closure's inner side the shares (3, n) that it lets pass, and that it absorbs.

    Layers above the base are left out. Numbers are rounded to float32 first: a constant and an expression that gives it
    are the same.
    """
    names = ("reflectivity", "opacity", "base_color", "reflection_tint", "transmission_tint", "ior", "pane_ior")
    mirrored, opacity, color, reflected, tint, ior, pane = (
        fields[name].astype(np.float32).astype(np.float64) for name in names
    )
    f0 = ((ior * pane - 1) / (ior * pane + 1)) ** 2  # one of them is 1
    outside = np.where(f0 > 0, f0 + (1 - f0) / 21, 0)  # Schlick's mean over the hemisphere
    within = np.where(pane != 1, outside, np.clip(1 - (1 - outside) / ior**2, 0, 1))
    rest = 1 - mirrored
    passed = rest * (1 - opacity) * (1 - within)
    lost = mirrored * (1 - reflected) + rest * opacity * (1 - color) + passed * (1 - tint)
    return passed * tint, np.maximum(lost, 0)
