"""What the samples of a portion add up to, and how much of its error budget each of them has spent.

Contributions are float32 and sums float64: they are exact, in any order, as long as what counts lies within 2^29 of the
largest.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64, Settings
from ..core.constants import BUDGET_BITS, BUDGET_UNIT, FAINT_LIGHT, LIGHT_BUDGET, MAX_BRANCHES, MOST_RAYS, RAYS_AHEAD
from ..core.rays import REFLECTION, REFRACTION
from ..core.sampler import Draws, Sampler
from ..core.vectors import flatnonzero, largest_component
from .branch_selection import draw
from .path_hash import Signatures

Numbers = NDArray[np.intp]

LOT = np.uint32(0x51ED270B)
"""The dimension of the random numbers that choose among branches."""

HEAVIEST_KEY = np.iinfo(np.int64).max

LIGHT_PASSES = {"reflection": 3, "refraction": 3, "raster_backed": 1}
"""Passes that add up with the picture, and their channels."""

BRANCHES = {"reflection": REFLECTION, "refraction": REFRACTION}


def wanted_parts(settings: Settings) -> list[str]:
    """The light passes that are wanted."""
    return sorted(LIGHT_PASSES.keys() & settings.passes)


@dataclass(eq=False)
class SampleBuffer:
    """What each of the n samples of m pixels, `count` consecutive ones each, adds up to: float64, in a fixed order.

    radiance : (3, n)   seen : (n,) 1 if it counts   residual : (n,) throughput that was cut off
    signatures : of the samples' ray trees, or None where nobody asks (see `signature`).
    parts    : the light passes that are wanted, by name: "reflection" and "refraction" (3, n), the radiance that came
               by way of such a ray from the first surface; "raster_backed" (1, n), the throughput that ended at
               raster-backed hits.
    limit    : throughput, in units of BUDGET_UNIT, that each sample may lose to the cutoff; 0: none.
    generation : (n,) int16, bounces of each sample's rays that are being followed.
    depth    : most bounces, over which the limit is released (see `allowed`).
    first    : how many rays a camera ray may become at once, where it hits what is rough.
    sampler  : of the portion; None: samples are told apart by their numbers alone.
    followed : (n,) int64, how many rays each sample has become.   most_rays : the most that it may; 0: no limit.
    stood_for : (n,) the part of the residual that other rays stand for (see `drawn`).
    light_limit, unlit : the same for light that is not asked for (see `cut_light`).
    spent    : (n,) int64, throughput that each sample has lost so far, in the same units; None without a limit.
    scratch  : (n,) int64, working space: zeros between calls.
    """

    radiance: Float64
    seen: Float64
    residual: Float64
    scratch: NDArray[np.int64]
    followed: NDArray[np.int64]
    stood_for: Float64
    count: int = 1
    most_rays: int = 0
    limit: int = 0
    spent: NDArray[np.int64] | None = None
    light_limit: int = 0
    unlit: NDArray[np.int64] | None = None
    signatures: Signatures | None = None
    parts: dict[str, Float64] = field(default_factory=dict)
    depth: int = 0
    first: int = 1
    sampler: Sampler | None = None

    def __post_init__(self) -> None:
        """What follows from the others."""
        self.generation = np.zeros(len(self.seen), np.int16)
        self._released = np.array([self.limit * (k + 1) // (self.depth + 1) for k in range(self.depth + 1)], np.int64)

    @classmethod
    def zeros(
        cls,
        m: int,
        count: int = 1,
        cutoff: float = 0.0,
        parts: Iterable[str] = (),
        depth: int = 0,
        first: int = 1,
        sampler: Sampler | None = None,
    ) -> SampleBuffer:
        """Nothing yet.

        cutoff : throughput that each sample may lose.   parts : light passes that are wanted.   depth, first, sampler :
        of the class.
        """
        light_limit = int(cutoff * LIGHT_BUDGET / BUDGET_UNIT)
        limit = int(cutoff / BUDGET_UNIT) - light_limit
        names = list(parts)
        # One array: large ones are given in pages of 2 MB, five hundred times as few.
        rows = np.zeros((10 + sum(LIGHT_PASSES[name] for name in names), m * count))
        spent, unlit, scratch, followed = rows[5:9].view(np.int64)
        place = 10 + np.cumsum([LIGHT_PASSES[name] for name in names])
        return cls(
            rows[:3],
            rows[3],
            rows[4],
            scratch,
            followed,
            rows[9],
            count,
            max(MOST_RAYS, int(1 / cutoff)) * first if limit else 0,
            limit,
            spent if limit else None,
            light_limit=light_limit,
            unlit=unlit if light_limit else None,
            parts={name: rows[end - LIGHT_PASSES[name] : end] for name, end in zip(names, place.tolist(), strict=True)},
            depth=depth,
            first=first,
            sampler=sampler,
        )

    def next_generation(self, sample: Numbers) -> None:
        """The rays that samples (n,) follow next are one bounce further."""
        self.generation[sample] = self.generation.take(sample) + np.int16(1)

    def allowed(self, sample: Numbers) -> NDArray[np.int64]:
        """How much samples (n,) may have spent of their budgets by now: these are released in equal parts, by bounces.

        Spent at once it would go to the first small branches, and nothing would be left to prune the many, tinier ones
        that grow from the others.
        """
        return self._released.take(self.generation.take(sample), mode="clip")

    def add_radiance(self, sample: Numbers, contribution: Float32, branch: NDArray[np.uint8] | None = None) -> None:
        """Add (3, n) to samples (n,), one after the other, in the order of the arrays.

        branch : (rows, n) of the rays (see `Rays`); no rows, or None: no light pass asks.
        """
        self._add(self.radiance, sample, contribution)
        if branch is None or len(branch) == 0:
            return
        for name, number in BRANCHES.items():
            if name in self.parts:
                members = flatnonzero(branch[0] == number)
                self._add(self.parts[name], sample[members], contribution[:, members])

    def add_backed(self, sample: Numbers, throughput: Float32) -> None:
        """Note throughput (3, n) that raster-backed hits ended: its largest channel."""
        if "raster_backed" in self.parts:
            self._add(self.parts["raster_backed"], sample, largest_component(throughput)[None])

    def _add(self, to: Float64, sample: Numbers, values: Float32) -> None:
        for channel, row in zip(to, values.astype(np.float64), strict=True):
            np.add.at(channel, sample, row)  # of the sums' own type: thirty times as fast as with another

    def add_residual(self, sample: Numbers, lost: Float32) -> None:
        """Note throughput that was cut off: its largest channel (n,), so that L_max times it bounds the error."""
        np.add.at(self.residual, sample, lost.astype(np.float64))
        if self.spent is not None:
            np.add.at(self.spent, sample, budget_units(np.nan_to_num(lost, posinf=0.0)))

    def add_seen(self, sample: Numbers, share: Float32 | float = 1.0) -> None:
        """Count samples (n,), or take them back (share (n,) < 0)."""
        np.add.at(self.seen, sample, np.broadcast_to(np.float64(share), sample.shape))

    def cuttable(self, sample: Numbers, weight: Float32) -> NDArray[np.bool_]:
        """Which branches of weight (n,) of samples (n,) the budgets allow to be cut: the smallest of a sample first.

        Of those that weigh the same all or none. Sums are of integers, hence exact: what else is in the wave cannot
        change the answer.
        """
        result = np.zeros(len(weight), bool)
        if self.spent is None:
            return result
        candidates = flatnonzero((weight > 0) & (weight <= np.float32(self.limit * BUDGET_UNIT)))
        cost, owner = budget_units(weight.take(candidates)), sample.take(candidates)
        possible = flatnonzero(cost <= self.allowed(owner) - self.spent.take(owner))  # what alone is too much is out
        key = (owner.take(possible) << BUDGET_BITS) | cost.take(possible)
        ordered = np.sort(key)
        owner, cost = ordered >> BUDGET_BITS, ordered & ((1 << BUDGET_BITS) - 1)
        starts = flatnonzero(np.diff(owner, prepend=-1))
        first, number = owner.take(starts), np.diff(starts, append=len(owner))
        total = np.cumsum(cost)
        until = (total - cost).take(starts) + self.allowed(first) - self.spent.take(first)
        # Of each sample the first that is too much, and all of its weight: where the sums go beyond what is left.
        beyond = np.searchsorted(total, until, side="right")
        self.scratch[first] = np.where(beyond < starts + number, ordered.take(beyond, mode="clip"), HEAVIEST_KEY)
        result[candidates.take(possible[key < self.scratch.take(key >> BUDGET_BITS)])] = True
        self.scratch[first] = 0
        return result

    def cut_light(self, sample: Numbers, share: Float32) -> Numbers:
        """Which of n samples do without a light that brings them so much, (n,), of what a white wall would send on.

        That is residual then. All of a sample's that is faint goes if its budget for light allows, else nothing.
        """
        if self.unlit is None:
            return np.zeros(0, np.intp)
        faint = flatnonzero((share > 0) & (share <= np.float32(FAINT_LIGHT * self.light_limit * BUDGET_UNIT)))
        lost, owner = share.take(faint), sample.take(faint)
        cost = budget_units(lost)
        fits = self.unlit.take(owner) + self._sum_of_each(owner, cost) <= self.light_limit
        np.add.at(self.unlit, owner[fits], cost[fits])
        np.add.at(self.residual, owner[fits], lost[fits].astype(np.float64))
        return faint[fits]

    def drawn(self, sample: Numbers, weight: Float32) -> Float64 | None:
        """By what branches of weight (n,) of samples (n,) are to be multiplied, (n,), so that they are not too many.

        0 for those that are not followed: that is residual. See `lots`. None: all are followed, and are none too many.
        """
        there = flatnonzero(weight > 0)
        if self.most_rays == 0 and len(there) <= MAX_BRANCHES:
            return None
        owner = sample.take(there)
        number = self._sum_of_each(owner, np.ones(len(owner), np.int64))
        most = np.full(len(owner), MAX_BRANCHES * self.first)
        if self.most_rays:
            left = self.most_rays - self.followed.take(owner)
            np.minimum(most, -(-left // RAYS_AHEAD), out=most)
            np.maximum(most, 1, out=most)  # the last one goes on for all
        many = flatnonzero(number > most)
        if len(many) == 0:
            np.add.at(self.followed, owner, 1)
            return None
        factor = np.ones(len(weight))
        some, cost = owner[many], budget_units(weight.take(there[many]))
        factor[there[many]] = draw(some, cost, most[many], self._chances(some))
        np.add.at(self.followed, owner[factor[there] > 0], 1)
        left_out = there[factor[there] == 0]
        lost = weight.take(left_out).astype(np.float64)
        for total in (self.residual, self.stood_for):
            np.add.at(total, sample.take(left_out), lost)
        return factor

    def close(self) -> None:
        """All is followed: where others stand for rays, no more than all of the light can be wrong."""
        np.minimum(self.residual, np.maximum(self.residual - self.stood_for, 1.0), out=self.residual)

    def _chances(self, sample: Numbers) -> Float64:
        """A random number (n,) for each sample (n,) and generation, strictly between 0 and 1."""
        unknown = Sampler(np.arange(len(self.seen) // self.count, dtype=np.uint32), 0, self.count)
        way = self.generation.take(sample).astype(np.uint32)
        chance = Draws(self.sampler or unknown, sample, way).square(LOT)[0]
        return np.asarray((chance.astype(np.float64) * (1 - BUDGET_UNIT)) + BUDGET_UNIT / 2)

    def _sum_of_each(self, owner: Numbers, cost: NDArray[np.int64]) -> NDArray[np.int64]:
        """What all costs (n,) of the same owner (n,) add up to: (n,)."""
        np.add.at(self.scratch, owner, cost)
        total = self.scratch.take(owner)
        self.scratch[owner] = 0
        return total


def budget_units(weight: Float32) -> NDArray[np.int64]:
    """Throughput (n,), finite, in whole units of the budget, rounded up."""
    units = weight.astype(np.float64)
    units *= 1 / BUDGET_UNIT
    return np.ceil(units, out=units).astype(np.int64)
