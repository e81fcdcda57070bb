# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of its throughput each sample may lose to the cutoff, and how much it has lost.

In whole units: sums of integers are exact, so what else is in a wave cannot change an answer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated
from ...scene import Float32
from ..core.constants import BUDGET_BITS, BUDGET_UNIT, FAINT_LIGHT, LIGHT_BUDGET
from ..core.vectors import flatnonzero

Numbers = NDArray[np.intp]
Units = NDArray[np.int64]

HEAVIEST_KEY = np.iinfo(np.int64).max


@dataclass(frozen=True, eq=False)
class ErrorBudget:
    """The budgets of n samples, in units of BUDGET_UNIT.

    limit, light_limit : throughput that each may lose of its branches, and of light that is not asked for.
    spent, unlit : (n,) int64, what each has lost of them so far.
    released : (depth + 1,) int64, how much of `limit` may be spent after so many bounces, in equal parts. Spent at once
               it would go to the first small branches, and nothing would be left to prune the many, tinier ones that
               grow from the others.
    scratch  : (n,) int64, working space: zeros between calls.
    """

    limit: int
    light_limit: int
    spent: Units
    unlit: Units
    released: Units
    scratch: Units

    @classmethod
    def of(cls, cutoff: float, depth: int, spent: Units, unlit: Units, scratch: Units) -> ErrorBudget | None:
        """Nothing spent yet; None where the cutoff allows nothing. spent, unlit, scratch: zeros (n,)."""
        light_limit = int(cutoff * LIGHT_BUDGET / BUDGET_UNIT)
        limit = int(cutoff / BUDGET_UNIT) - light_limit
        if limit == 0:
            return None
        released = np.array([limit * (k + 1) // (depth + 1) for k in range(depth + 1)], np.int64)
        return cls(limit, light_limit, spent, unlit, released, scratch)

    def charge(self, sample: Numbers, lost: Float32) -> None:
        """Samples (n,) have lost throughput (n,) of their branches."""
        np.add.at(self.spent, sample, budget_units(np.nan_to_num(lost, posinf=0.0)))

    def cuttable(self, sample: Numbers, weight: Float32, generation: NDArray[np.int16]) -> NDArray[np.bool_]:
        """Which branches of weight (n,) of samples (n,) may be cut: the smallest of a sample first.

        Of those that weigh the same all or none. generation: (all samples,) bounces so far.
        """
        result = np.zeros(len(weight), bool)
        heaviest = np.array([self.limit * BUDGET_UNIT], np.float32)
        key, index = candidates(sample, weight, generation, self.released, self.spent, heaviest)
        if len(key):
            ordered = np.sort(key)
            result[index] = lightest(key, ordered, generation, self.released, self.spent, self.scratch)
        return result

    def cut_light(self, sample: Numbers, share: Float32) -> Numbers:
        """Which of n samples do without a light that brings them so much, (n,), of what a white wall would send on.

        All of a sample's that is faint goes if its budget for light allows, else nothing.
        """
        faint = flatnonzero((share > 0) & (share <= np.float32(FAINT_LIGHT * self.light_limit * BUDGET_UNIT)))
        cost, owner = budget_units(share.take(faint)), sample.take(faint)
        fits = self.unlit.take(owner) + sum_of_each(owner, cost, self.scratch) <= self.light_limit
        np.add.at(self.unlit, owner[fits], cost[fits])
        return faint[fits]


@accelerated
def candidates(
    sample: Numbers, weight: Float32, generation: NDArray[np.int16], released: Units, spent: Units, heaviest: Float32
) -> tuple[Units, Numbers]:
    """Of the branches (n,) those that alone are not too much: keys that sort by sample, then by weight; which they are.

    heaviest : (1,), what no sample may lose of one.   generation, released, spent : see `ErrorBudget`.
    """
    light = flatnonzero((weight > 0) & (weight <= heaviest[0]))
    cost, owner = budget_units(weight.take(light)), sample.take(light)
    allowed = released.take(generation.take(owner), mode="clip")
    possible = flatnonzero(cost <= allowed - spent.take(owner))
    return (owner.take(possible) << BUDGET_BITS) | cost.take(possible), light.take(possible)


@accelerated
def lightest(
    key: Units, ordered: Units, generation: NDArray[np.int16], released: Units, spent: Units, scratch: Units
) -> NDArray[np.bool_]:
    """Which of the candidates (n,) are cut: of each sample the lightest, as far as all of them fit. ordered: sorted."""
    owner, cost = ordered >> BUDGET_BITS, ordered & ((1 << BUDGET_BITS) - 1)
    starts = flatnonzero(np.diff(owner, prepend=-1))
    first, number = owner.take(starts), np.diff(starts, append=len(owner))
    total = np.cumsum(cost)
    allowed = released.take(generation.take(first), mode="clip")
    until = (total - cost).take(starts) + allowed - spent.take(first)
    # Of each sample the first that is too much, and all of its weight: where the sums go beyond what is left.
    beyond = np.searchsorted(total, until, side="right")
    scratch[first] = np.where(beyond < starts + number, ordered.take(beyond, mode="clip"), HEAVIEST_KEY)
    result = key < scratch.take(key >> BUDGET_BITS)
    scratch[first] = 0
    return np.asarray(result, bool)


def budget_units(weight: Float32) -> Units:
    """Throughput (n,), finite, in whole units of the budget, rounded up."""
    units = weight.astype(np.float64)
    units *= 1 / BUDGET_UNIT
    return np.ceil(units, out=units).astype(np.int64)


def sum_of_each(owner: Numbers, cost: Units, scratch: Units) -> Units:
    """What all costs (n,) of the same owner (n,) add up to: (n,). scratch: zeros, one for each owner."""
    np.add.at(scratch, owner, cost)
    total = scratch.take(owner)
    scratch[owner] = 0
    return total
