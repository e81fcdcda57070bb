"""Lights that cannot reach what could answer to them: out of range of all of it, or turned away from all of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene import AreaLight, Float64, SpotLight, SunLight
from ..core.constants import REACH_MARGIN
from ..core.vectors import select
from ..emitters.lights import CompiledLight
from ..geometry.flatten import Geometry

Bounds = tuple[Float64, Float64]


def bounds_of(geometry: Geometry, members: NDArray[np.bool_]) -> Bounds:
    """Lowest and highest corner of the primitives `members` (np,) bool; infinite if there is a plane among them."""
    nt, ns = geometry.triangle_count, geometry.sphere_count
    if members[nt + ns :].any():
        return np.full(3, -np.inf), np.full(3, np.inf)
    balls = members[nt : nt + ns]
    center, radius = geometry.sphere_center[balls], geometry.sphere_radius[balls, None]
    used = np.zeros(len(geometry.vertices), bool)
    used[geometry.triangles[select(members[:nt])]] = True
    corners = np.ascontiguousarray(geometry.vertices[used].T)  # reductions along rows are the fast ones
    low = np.append(corners.min(axis=1, initial=np.inf)[None], center - radius, axis=0)
    high = np.append(corners.max(axis=1, initial=-np.inf)[None], center + radius, axis=0)
    return low.min(axis=0), high.max(axis=0)


def can_reach(light: CompiledLight, bounds: Bounds) -> bool:
    """Whether a light can bring anything to points within bounds; in doubt it can.

    Exact: where this says no, `illuminate` gives exactly 0 at every such point, rounded as it may be.
    """
    low, high = bounds
    if isinstance(light.light, SunLight) or not np.isfinite([low, high]).all():
        return True
    place = light.position[:, 0].astype(np.float64)
    margin = REACH_MARGIN * float(np.max(np.abs([place, low, high])))
    gap = np.maximum(np.maximum(low - place, place - high), 0.0)
    if float(np.sqrt((gap * gap).sum())) > light.light.range * (1 + REACH_MARGIN) + margin:
        return False
    ahead = _axis(light)
    if ahead is None:
        return True
    furthest = np.where(ahead > 0, high, low) - place  # of all corners, in the direction in which it shines
    return float(ahead @ furthest) > -margin


def _axis(light: CompiledLight) -> Float64 | None:
    """Unit direction (3,) of the half space that a light shines into; None: all directions."""
    if isinstance(light.light, AreaLight):
        axis = np.asarray(light.light.direction, np.float64)
    elif isinstance(light.light, SpotLight):
        axis = -np.asarray(light.light.world_to_light, np.float64)[2]
    else:
        return None
    return np.asarray(axis / np.sqrt((axis * axis).sum()))
