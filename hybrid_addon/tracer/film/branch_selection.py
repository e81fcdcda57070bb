# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of a sample's branches are followed, where they are too many: the heaviest, and of the others some by lot.

Those that are drawn stand for those that are not, and carry their weight: on average the light is right, and what a
wrong pick can cost is at most the weight of those left out. Of all ways to keep m of n weights without bias this one
changes them least (Fearnhead & Clifford 2003, On-line inference for hidden Markov models via particle filters,
sec. 4): those above a threshold c stay as they are, others stay with chance w / c, and weigh c then. All draws of one
sample hang on one random number (systematic resampling), so their number and the sum of the weights are exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene import Float64
from ..core.constants import BUDGET_BITS
from ..core.vectors import flatnonzero

Numbers = NDArray[np.intp]

HEAVIEST = (1 << BUDGET_BITS + 8) - 1
"""Weights above 2^8 count as that here."""


def draw(owner: Numbers, cost: NDArray[np.int64], most: Numbers, chance: Float64) -> Float64:
    """By what the branches (n,) are to be multiplied: 0 for those that are not followed, 1 for those that stay.

    owner  : (n,) sample of each; branches of a sample keep their order.   cost : (n,) weights, whole units above 0.
    most   : (n,) of how many branches of its sample, at least 1, are to be left.
    chance : (n,) random number of its sample, strictly between 0 and 1.

    Sums are of whole units, so what other samples are there changes no bit.
    """
    # Sort by sample, the heaviest first.
    cost = np.minimum(cost, HEAVIEST)
    order = np.lexsort((-cost, owner))
    owner, cost, most, chance = owner[order], cost[order], most[order], chance[order]
    starts = flatnonzero(np.diff(owner, prepend=-1))
    number = np.diff(starts, append=len(owner))
    rank = np.arange(len(owner)) - np.repeat(starts, number)
    total = np.cumsum(cost)  # may wrap around: differences do not
    before = total - cost
    end = np.repeat(total[starts + number - 1], number)
    rest = end - before  # this one and all that are lighter
    # The heaviest stay as long as each weighs at least an even share of what is left for the places that are left.
    too_light = cost.astype(np.float64) * (most - rank) < rest
    kept = np.repeat(np.minimum.reduceat(np.where(too_light, rank, len(owner)), starts), number)
    kept = np.minimum(kept, np.repeat(number, number))
    first = np.minimum(np.repeat(starts, number) + kept, len(owner) - 1)  # of the others
    # Of the others each stays with its share of what all of them weigh, on one random number.
    threshold = (end - before[first]) / np.maximum(most - kept, 1)
    at_start = (before - before[first]) / threshold + chance
    at_end = (total - before[first]) / threshold + chance
    lucky = np.floor(at_end) > np.floor(at_start)
    factor = np.where(rank < kept, 1.0, np.where(lucky, threshold / cost, 0.0))
    result = np.empty(len(owner))
    result[order] = factor
    return result
