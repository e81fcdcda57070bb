# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that cannot reach what could answer to them: out of range of all of it, or turned away from all of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..core.vectors import select
from ..emitters.light import Bounds, CompiledLight
from ..geometry.flatten import Geometry


def bounds_of(geometry: Geometry, members: NDArray[np.bool_]) -> Bounds:
    """Lowest and highest corner of the primitives `members` (np,) bool; infinite if there is a plane among them."""
    nt, ns = geometry.triangle_count, geometry.sphere_count
    flattened = geometry.flattened_count
    if members[nt + ns : flattened].any():
        return np.full(3, -np.inf), np.full(3, np.inf)
    balls = members[nt : nt + ns]
    center, radius = geometry.sphere_center[balls], geometry.sphere_radius[balls, None]
    used = np.zeros(len(geometry.vertices), bool)
    used[geometry.triangles[select(members[:nt])]] = True
    corners = np.ascontiguousarray(geometry.vertices[used].T)  # reductions along rows are the fast ones
    low = np.append(corners.min(axis=1, initial=np.inf)[None], center - radius, axis=0)
    high = np.append(corners.max(axis=1, initial=-np.inf)[None], center + radius, axis=0)
    if geometry.instanced is not None:
        boxes = geometry.instanced.bounds(members[flattened:])
        low, high = np.append(low, boxes[:, 0], axis=0), np.append(high, boxes[:, 1], axis=0)
    return low.min(axis=0), high.max(axis=0)


def can_reach(light: CompiledLight, bounds: Bounds) -> bool:
    """Whether a light can bring anything to points within bounds; in doubt it can. Exact: see `CompiledLight`."""
    return not np.isfinite(bounds).all() or light.can_reach(bounds)
