"""What the samples of a portion add up to, and how much of its error budget each of them has spent.

Contributions are float32 and sums float64: they are exact, in any order, as long as what counts lies within 2^29 of the
largest.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32, Float64, Settings
from .constants import BUDGET_BITS, BUDGET_UNIT, FAINT_LIGHT, LIGHT_BUDGET, MAX_BRANCHES
from .rays import REFLECTION, REFRACTION
from .signature import Signatures
from .vectors import flatnonzero, largest_component

Numbers = NDArray[np.intp]

HEAVIEST = np.iinfo(np.int32).max
HEAVIEST_KEY = np.iinfo(np.int64).max

LIGHT_PASSES = {"reflection": 3, "refraction": 3, "raster_backed": 1}
"""Passes that add up with the picture, and their channels."""

BRANCHES = {"reflection": REFLECTION, "refraction": REFRACTION}


def wanted_parts(settings: Settings) -> list[str]:
    """The light passes that are wanted."""
    return sorted(LIGHT_PASSES.keys() & settings.passes)


@dataclass(eq=False)
class Sums:
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
    light_limit, unlit : the same for light that is not asked for (see `cut_light`).
    spent    : (n,) int64, throughput that each sample has lost so far, in the same units; None without a limit.
    scratch  : (n,) int64, working space: zeros between calls.
    """

    radiance: Float64
    seen: Float64
    residual: Float64
    scratch: NDArray[np.int64]
    count: int = 1
    limit: int = 0
    spent: NDArray[np.int64] | None = None
    light_limit: int = 0
    unlit: NDArray[np.int64] | None = None
    signatures: Signatures | None = None
    parts: dict[str, Float64] = field(default_factory=dict)
    depth: int = 0
    first: int = 1

    def __post_init__(self) -> None:
        """What follows from the others."""
        self.generation = np.zeros(len(self.seen), np.int16)
        self._released = np.array([self.limit * (k + 1) // (self.depth + 1) for k in range(self.depth + 1)], np.int64)

    @classmethod
    def zeros(
        cls, m: int, count: int = 1, cutoff: float = 0.0, parts: Iterable[str] = (), depth: int = 0, first: int = 1
    ) -> Sums:
        """Nothing yet.

        cutoff : throughput that each sample may lose.   parts : light passes that are wanted.   depth, first : of the
        class.
        """
        light_limit = int(cutoff * LIGHT_BUDGET / BUDGET_UNIT)
        limit = int(cutoff / BUDGET_UNIT) - light_limit
        names = list(parts)
        # One array: large ones are given in pages of 2 MB, five hundred times as few.
        rows = np.zeros((8 + sum(LIGHT_PASSES[name] for name in names), m * count))
        spent, unlit, scratch = rows[5:8].view(np.int64)
        place = 8 + np.cumsum([LIGHT_PASSES[name] for name in names])
        return cls(
            rows[:3],
            rows[3],
            rows[4],
            scratch,
            count,
            limit,
            spent if limit else None,
            light_limit=light_limit,
            unlit=unlit if light_limit else None,
            parts={name: rows[end - LIGHT_PASSES[name] : end] for name, end in zip(names, place.tolist(), strict=True)},
            depth=depth,
            first=first,
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

    def crowded(self, sample: Numbers, weight: Float32) -> NDArray[np.bool_]:
        """Which branches of weight (n,) of samples (n,) are one too many: all but a sample's MAX_BRANCHES heaviest."""
        result = np.zeros(len(weight), bool)
        # Each generation has at most twice the branches of the one before.
        many = self.generation.take(sample) >= (MAX_BRANCHES // self.first).bit_length() - 1
        there = flatnonzero(many & (weight > 0))
        if len(there) <= MAX_BRANCHES:
            return result
        owner = sample[there]
        there = there[self._sum_of_each(owner, np.ones(len(owner), np.int64)) > MAX_BRANCHES]
        if len(there) == 0:
            return result
        lightness = HEAVIEST - weight[there].view(np.int32).astype(np.int64)  # floats that are not < 0 sort as integers
        there = there[_argsort(sample[there], lightness)]
        starts = flatnonzero(np.diff(sample[there], prepend=-1))
        rank = np.arange(len(there)) - np.repeat(starts, np.diff(starts, append=len(there)))
        result[there[rank >= MAX_BRANCHES]] = True
        return result

    def _sum_of_each(self, owner: Numbers, cost: NDArray[np.int64]) -> NDArray[np.int64]:
        """What all costs (n,) of the same owner (n,) add up to: (n,)."""
        np.add.at(self.scratch, owner, cost)
        total = self.scratch.take(owner)
        self.scratch[owner] = 0
        return total


def _argsort(owner: Numbers, cost: NDArray[np.int64]) -> Numbers:
    """Order by owner, then cost; equal ones keep their order.

    Numpy's vectorised sort, seven times as fast as lexsort, does not keep it: equal ones are sorted once more.
    """
    key = (owner << BUDGET_BITS) | cost
    order = np.argsort(key)
    key = key[order]
    equal = flatnonzero(key[1:] == key[:-1])
    if len(equal):
        tied = np.zeros(len(key), bool)
        tied[equal] = tied[equal + 1] = True
        equal = flatnonzero(tied)
        order[equal] = order[equal][np.lexsort((order[equal], key[equal]))]
    return order


def budget_units(weight: Float32) -> NDArray[np.int64]:
    """Throughput (n,), finite, in whole units of the budget, rounded up."""
    units = weight.astype(np.float64)
    units *= 1 / BUDGET_UNIT
    return np.ceil(units, out=units).astype(np.int64)
