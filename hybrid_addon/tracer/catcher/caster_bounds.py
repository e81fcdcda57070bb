# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the objects are that cast shadows and caustics on the raster: a few balls around the ray traced ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene import Float64
from ..core.constants import CASTER_BALLS
from ..geometry.triangles import corner_bounds
from ..prepare.compiled import CompiledScene

Numbers = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class BoundingBalls:
    """Ray traced primitives that cast shadows, and a ball around them: center (3,), radius, members (m,)."""

    center: Float64
    radius: float
    members: Numbers


def find_caster_bounds(scene: CompiledScene) -> list[BoundingBalls]:
    """At most CASTER_BALLS groups that hold every ray traced primitive that casts a shadow, each once.

    The largest is halved along its longest side, again and again, where two balls fill less of a light's view than the
    one. A plane's ball is infinite.
    """
    g = scene.geometry
    members = np.flatnonzero(g.shadow & g.ray_traced & ~scene.surfaces.shadow_clear[g.surface])
    nt, ns = g.triangle_count, g.sphere_count
    is_plane = (members >= nt + ns) & (members < g.flattened_count)
    planes, members = members[is_plane], members[~is_plane]
    low, high = np.empty((len(members), 3)), np.empty((len(members), 3))
    flat, round_ = members < nt, (members >= nt) & (members < nt + ns)
    low[flat], high[flat] = corner_bounds(g.vertices, g.triangles[members[flat]])
    ball = members[round_] - nt
    low[round_] = g.sphere_center[ball] - g.sphere_radius[ball, None]
    high[round_] = g.sphere_center[ball] + g.sphere_radius[ball, None]
    if g.instanced is not None:
        row = members[~flat & ~round_] - g.flattened_count
        low[~flat & ~round_], high[~flat & ~round_] = g.instanced.boxes[g.instanced.instance[row]].transpose(1, 0, 2)
    open_, found = [_Boxes(low, high, members)] if len(members) else [], list[_Boxes]()
    while open_ and len(open_) + len(found) < CASTER_BALLS:
        largest = open_.pop(int(np.argmax([boxes.radius for boxes in open_])))
        halves = largest.halves()
        if sum(half.radius**2 for half in halves) < largest.radius**2:
            open_ += halves
        else:
            found.append(largest)
    caster_bounds = [BoundingBalls(boxes.center, boxes.radius, boxes.members) for boxes in (*found, *open_)]
    return caster_bounds + ([BoundingBalls(np.zeros(3), np.inf, planes)] if len(planes) else [])


class _Boxes:
    """Boxes low, high (m, 3) of primitives, and the ball around them all."""

    def __init__(self, low: Float64, high: Float64, members: Numbers) -> None:
        self.low, self.high, self.members = low, high, members
        self.bottom, self.top = low.min(axis=0), high.max(axis=0)
        self.center, self.radius = (self.bottom + self.top) / 2, float(np.linalg.norm(self.top - self.bottom) / 2)

    def halves(self) -> list[_Boxes]:
        """By the middles of the boxes along the longest side, as many in either; a single box stays whole."""
        if len(self.members) < 2:
            return [self]
        axis = int(np.argmax(self.top - self.bottom))
        order = np.argsort(self.low[:, axis] + self.high[:, axis], kind="stable")
        parts = (order[: len(order) // 2], order[len(order) // 2 :])
        return [_Boxes(self.low[part], self.high[part], self.members[part]) for part in parts]
