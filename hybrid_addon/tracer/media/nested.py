# SPDX-License-Identifier: GPL-3.0-or-later
"""Which medium lies on either side of a hit: the one place that decides the relative index of refraction.

A *solid* is a closed body that transmits: a part of a mesh whose every edge joins two triangles of like winding, facing
outward, or an analytic sphere. Every ray carries the solids that it is inside of (nested dielectrics, Schmidt & Budge
2002), in rows, in no order: the rank of each, and how often the ray is inside of it, for a body may go through itself
and the parts of one mesh may overlap. Where it is turned inside out that counts backwards, below 0 too: what is left
there is in no medium, and no fault. Where solids overlap, the one of the *lowest rank*, the smallest in size, displaces
the others: the bubble the water, the water the glass. That is the same from whichever side a ray comes. The rules:

* An IOR is that of the solid itself, against vacuum: a bubble in water is a solid of IOR 1.
* An interface of a solid that another one displaces there is none: rays pass it unbent and unreflected, only tinted.
  Likewise an interface within the solid itself, where the ray is inside of it before and after.
* What is no solid - an open sheet, a body turned inside out - bounds its own medium against whatever it lies in, and
  nobody tracks it: coming from outside eta = ior, from inside 1 / ior.
* A body thinner than float32 resolves is a thin wall: both of its faces at once, T = (1 - R) / (1 + R), without bend.
* Light on its way through a solid is absorbed as the innermost one says, exp(-absorption distance) (Beer-Lambert).
* Radiance is not scaled by n^2 when it changes media (Cycles' convention): a white world is white from within glass.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...procedural import elementary
from ...scene import Float32, Float64
from ..core.constants import MAX_PROBE_CROSSINGS, RANK_BITS
from ..core.rays import Rays, offset_origin, origin_offset, traceable
from ..core.stats import Stats
from ..core.vectors import flatnonzero, signs
from ..geometry.aggregate import PrimitiveSet
from .near import Near

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]
Stack = NDArray[np.int32]
"""(rows, n). Each row holds the rank of a solid that a ray is inside of, or `count`. More than once inside of it, each
time more adds AGAIN; as often outside of it as inside leaves no row, and once more than that a negative one."""

AGAIN = np.int32(1 << RANK_BITS)
RANKS = AGAIN - np.int32(1)
DEEPEST = (1 << 31 - RANK_BITS) - 1


def innermost(stack: Stack, vacuum: int) -> Stack:
    """The rank (n,) of the medium of each stack (rows, n): the lowest; that of vacuum if there is none."""
    return np.asarray(np.where(stack < 0, np.int32(vacuum), stack & RANKS).min(axis=0, initial=vacuum))


def relative_ior(ior: Float64, entering: Bools) -> Float64:
    """eta (n,), transmitted over incident, of surfaces of index `ior` (n,) inside over outside."""
    return np.where(entering, ior, 1 / ior)


def transmittance(absorption: Float64, stack: Stack, distance: Float64) -> Float64:
    """exp(-absorption distance), (3, n), in the innermost of the solids of each stack (rows, n): Beer-Lambert."""
    sigma = absorption.take(innermost(stack, absorption.shape[1] - 1), axis=1)
    result = np.ones(sigma.shape)
    for channel in range(3):
        within = flatnonzero(sigma[channel])  # nowhere else: 0 times an infinite distance is no number
        result[channel, within] = elementary.exp(-sigma[channel, within] * distance[within])
    return result


@dataclass(frozen=True, eq=False)
class Media:
    """The solids of a scene by rank, the smallest first; `count` stands for none, and for vacuum.

    rank      : (np,) int32, the solid that each primitive bounds.
    ior       : (count + 1,) float64 of the solids, then of vacuum, 1.
    rows      : how many solids a ray can be inside of at once; 0: media are not tracked.
    thin      : (np,) bool, primitives of thin walls; None: there are none.
    low, high : (count, 3) float64, bounds of the solids.
    absorption, shadow_absorption : (3, count + 1) float64, 1/m, for all rays and for shadow rays; None: none absorbs.
    near      : the triangles of different parts that come near one another; None: none do.
    """

    rank: Stack = field(default_factory=lambda: np.zeros(0, np.int32))
    ior: Float64 = field(default_factory=lambda: np.ones(1))
    rows: int = 0
    thin: Bools | None = None
    low: Float64 = field(default_factory=lambda: np.zeros((0, 3)))
    high: Float64 = field(default_factory=lambda: np.zeros((0, 3)))
    absorption: Float64 | None = None
    shadow_absorption: Float64 | None = None
    near: Near | None = None

    @property
    def count(self) -> int:
        """Number of solids."""
        return len(self.ior) - 1

    def empty(self, n: int) -> Stack:
        """(rows, n): n rays in vacuum."""
        return np.full((self.rows, n), self.count, np.int32)

    def meet(self, low: Float64, high: Float64) -> bool:
        """Whether the bounds of any solid meet the box from `low` to `high` (3,)."""
        return bool(((self.low <= high) & (self.high >= low)).all(axis=1).any())

    def bounded_by(self, members: Bools) -> Bools:
        """Which solids (count + 1,) are those that the primitives `members` (np,) bound; never vacuum."""
        found = np.zeros(self.count + 1, bool)
        if len(self.rank):
            found[self.rank[members]] = True
            found[self.count] = False
        return found

    def without(self, stack: Stack, gone: Bools) -> Stack:
        """Stacks (rows, n) in which the solids `gone` (count + 1,) are no longer."""
        return np.where(gone.take(stack & RANKS), np.int32(self.count), stack) if gone.any() else stack

    def is_thin(self, prim: Numbers) -> Bools | None:
        """(n,) whether hits are on thin walls; None: no primitive is one."""
        return None if self.thin is None else self.thin.take(prim)

    def eta(self, stack: Stack, prim: Numbers, ior: Float64, entering: Bools) -> Float64:
        """Transmitted over incident index (n,) at primitives of index `ior` (n,); exactly 1 where nothing bends."""
        if self.rows == 0:
            return relative_ior(ior, entering)
        own = self.rank.take(prim)
        around, hidden = self._around(stack, own, entering)
        outer = self.ior.take(around)
        unknown = flatnonzero(own == self.count)  # no solids: against whatever they lie in
        outer[unknown], hidden[unknown] = 1.0, False
        result = np.where(entering, ior, outer)
        result /= np.where(entering, outer, ior)
        result[hidden] = 1.0
        return result

    def _around(self, stack: Stack, own: Stack, entering: Bools) -> tuple[Stack, Bools]:
        """Rank (n,) of the medium outside an interface of solid `own`, and whether (n,) nothing changes there."""
        leaving, vacuum = ~entering, np.int32(self.count)
        lowest, within = np.full(stack.shape[1], vacuum), np.zeros(stack.shape[1], bool)
        for row in stack:
            rank, backwards = row & RANKS, row < 0
            out = (row == own) & leaving
            if backwards.any():
                within |= backwards & (rank == own) & (leaving | (row < -AGAIN - AGAIN))
                out |= backwards
            np.minimum(lowest, np.where(out, vacuum, rank) if out.any() else rank, out=lowest)
        return lowest, (own >= lowest) | within

    def cross(self, stack: Stack, prim: Numbers, entering: Bools, stats: Stats) -> Stack:
        """The stack behind an interface. What finds no room, or is too deep in one solid, loses its medium."""
        if self.rows == 0:
            return stack
        own, nothing = self.rank.take(prim), np.int32(self.count)
        step = AGAIN * signs(entering).astype(np.int32)
        pending = own < self.count
        result = stack.copy()
        for row in result:
            here = pending & (row & RANKS == own)
            pending &= ~here
            lost = here & (np.abs((row >> RANK_BITS) + 1) >= DEEPEST)
            new = row + np.where(lost, np.int32(0), step)
            np.copyto(row, np.where(new >> RANK_BITS == -1, nothing, new), where=here)
            stats.add("lost_media", np.count_nonzero(lost))
        new = np.where(entering, own, own - AGAIN - AGAIN)
        for row in result:
            here = pending & (row == nothing)
            np.copyto(row, new, where=here)
            pending &= ~here
        stats.add("lost_media", np.count_nonzero(pending))
        return result

    def absorbed(self, rays: Rays, t: Float64, hit: Bools) -> Rays:
        """The rays (n,) with what is left of their throughput after distances t (n,), where they hit something."""
        if self.absorption is None:
            return rays
        left = transmittance(self.absorption, rays.media, np.where(hit, t, 0.0))
        return replace(rays, throughput=(rays.throughput * left).astype(np.float32))

    def count_lost(self, stack: Stack, stats: Stats) -> None:
        """Count rays that leave the scene from within a solid."""
        if self.rows:
            stats.add("lost_media", np.count_nonzero((stack != self.count).any(axis=0)))

    def around_camera(
        self, origin: Float32, direction: Float32, solids: Callable[[], PrimitiveSet], stats: Stats
    ) -> Stack:
        """The stack (rows, n) at the start of camera rays: signed crossings along the ray backwards, solid by solid.

        Nothing is traced unless some ray starts within the bounds of a solid.
        """
        n = origin.shape[1]
        stack = self.empty(n)
        if self.rows == 0 or n == 0:
            return stack
        sound = flatnonzero(traceable(origin, direction))
        start = origin[:, sound].astype(np.float64)
        low, high = start.min(axis=1, initial=np.inf), start.max(axis=1, initial=-np.inf)
        if not self.meet(low, high):
            return stack
        ray, solid, sign = self._crossings(origin[:, sound], -direction[:, sound], solids(), stats)
        ray = sound[ray]
        pairs, inverse = np.unique(ray * (self.count + 1) + solid, return_inverse=True)
        depth = np.bincount(inverse.reshape(-1), sign, minlength=len(pairs)).astype(np.intp)
        pairs, depth = pairs[depth != 0], depth[depth != 0]
        self._fill(stack, pairs // (self.count + 1), pairs % (self.count + 1) + (depth - 1) * int(AGAIN))
        return stack

    def _fill(self, stack: Stack, ray: Numbers, rows: Numbers) -> None:
        """Put rows (n,) into the stacks of rays (n,), sorted by ray."""
        first = np.searchsorted(ray, ray)
        row = np.arange(len(ray)) - first
        fits = row < self.rows
        stack[row[fits], ray[fits]] = rows[fits]

    def _crossings(
        self, origin: Float32, direction: Float32, solids: PrimitiveSet, stats: Stats
    ) -> tuple[Numbers, Numbers, Float64]:
        """Every crossing of rays with solids: the ray, the rank of the solid, +1 for leaving and -1 for entering."""
        rays, ranks, signs = [np.zeros(0, np.intp)], [np.zeros(0, np.intp)], [np.zeros(0)]
        active = np.arange(origin.shape[1])
        for _ in range(MAX_PROBE_CROSSINGS):
            hits = solids.nearest(origin, direction, stats)
            chosen = flatnonzero(hits.prim >= 0)
            if len(chosen) == 0:
                break
            active, prim, toward = active[chosen], hits.prim[chosen].astype(np.intp), hits.toward[chosen]
            rays.append(active)
            ranks.append(self.rank.take(prim).astype(np.intp))
            signs.append(np.where(toward > 0, 1.0, -1.0))
            point = origin[:, chosen] + direction[:, chosen] * hits.t[chosen]
            onward = hits.normal[:, chosen] * np.sign(toward)
            extent = solids.geometry.extent.take(prim)
            origin = offset_origin(point, onward, origin_offset(point.astype(np.float32), extent))
            direction = direction[:, chosen]
        return np.concatenate(rays), np.concatenate(ranks), np.concatenate(signs)
