# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of geometry/aggregate.py: what Embree's hits are, worked out in float64."""

from __future__ import annotations

import numpy as np

from .declare import Array, f4, f8, i4, kernel


@kernel("tracer.geometry.aggregate.refine", [(f8[2], i4[1], f4[2], f4[2])], tables=(0,))
def refine(facets: Array, prim: Array, origin: Array, direction: Array) -> tuple[Array, Array, Array]:
    """See there."""
    n = len(prim)
    t, normal, toward = np.empty(n), np.empty((3, n), np.float32), np.empty(n)
    for i in range(n):
        p = prim[i]
        if p < 0:
            t[i], toward[i] = np.inf, 0.0
            normal[0, i], normal[1, i], normal[2, i] = np.float32(0), np.float32(0), np.float32(0)
            continue
        a, b, c = facets[p, 0], facets[p, 1], facets[p, 2]
        along = a * direction[0, i] + b * direction[1, i] + c * direction[2, i]
        height = a * origin[0, i] + b * origin[1, i] + c * origin[2, i]
        t[i], toward[i] = (facets[p, 3] - height) / along, along
        normal[0, i], normal[1, i], normal[2, i] = a, b, c
    return t, normal, toward
