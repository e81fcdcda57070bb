# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of film/samples.py and film/error_budget.py: sums of samples, and what the cutoff may take from each."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.constants import BUDGET_BITS, BUDGET_UNIT
from .declare import Array, f4, f8, helper, i2, i8, int64, kernel, written

UNITS = np.float64(1 / BUDGET_UNIT)
BITS, COST = np.int64(BUDGET_BITS), np.int64((1 << BUDGET_BITS) - 1)
NONE = np.int64(np.iinfo(np.int64).max)


@helper
def units(weight: Any) -> Any:
    """error_budget.budget_units, of one weight."""
    return np.int64(np.ceil(np.float64(weight) * UNITS))


@helper
def step(bounces: Any, last: Any) -> Any:
    """The place of `released` that is asked for after so many bounces."""
    return min(max(np.int64(bounces), 0), last)


@kernel("tracer.film.samples.add_at", [(written(f8[2]), i8[1], f4[2])], tables=(0,), of_rows=(2,))
def add_at(to: Array, sample: Array, values: Array) -> None:
    """See there."""
    for c in range(len(values)):
        for i in range(len(sample)):
            to[c, sample[i]] += np.float64(values[c, i])


@kernel("tracer.film.error_budget.candidates", [(i8[1], f4[1], i2[1], i8[1], i8[1], f4[1])], tables=(2, 3, 4, 5))
def candidates(
    sample: Array, weight: Array, generation: Array, released: Array, spent: Array, heaviest: Array
) -> tuple[Array, Array]:
    """See there."""
    n, last, found = len(sample), len(released) - 1, 0
    key, index = np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(n):
        if weight[i] > np.float32(0) and weight[i] <= heaviest[0]:
            cost, owner = units(weight[i]), sample[i]
            allowed = released[step(generation[owner], last)]
            if cost <= allowed - spent[owner]:
                key[found], index[found] = owner << BITS | cost, i
                found += 1
    return key[:found].copy(), index[:found].copy()


@kernel("tracer.film.error_budget.lightest", [(i8[1], i8[1], i2[1], i8[1], i8[1], written(i8[1]))], tables=(2, 3, 4, 5))
def lightest(key: Array, ordered: Array, generation: Array, released: Array, spent: Array, scratch: Array) -> Array:
    """See there."""
    n, last = len(key), len(released) - 1
    start = 0
    while start < n:
        owner = ordered[start] >> BITS
        left = released[step(generation[owner], last)] - spent[owner]
        total, end, limit = np.int64(0), start, NONE
        while end < n and ordered[end] >> BITS == owner:
            total += ordered[end] & COST
            if total > left and limit == NONE:
                limit = ordered[end]
            end += 1
        scratch[owner] = limit
        start = end
    result = np.empty(n, np.bool_)
    for i in range(n):
        result[i] = key[i] < scratch[key[i] >> BITS]
    for i in range(n):
        scratch[key[i] >> BITS] = 0
    return result


@kernel(
    "tracer.film.samples.follow_all",
    [(i8[1], f4[1], written(i8[1]), written(i8[1]), int64, int64, int64)],
    tables=(2, 3),
)
def follow_all(
    sample: Array, weight: Array, followed: Array, scratch: Array, most: int, most_rays: int, ahead: int
) -> bool:
    """See there."""
    n, few = len(sample), True
    for i in range(n):
        if weight[i] > np.float32(0):
            scratch[sample[i]] += 1
    for i in range(n):
        owner = sample[i]
        if scratch[owner] > 0:
            limit = most
            if most_rays:
                limit = max(min(limit, -(-(most_rays - followed[owner]) // ahead)), 1)
            few &= scratch[owner] <= limit
    for i in range(n):
        owner = sample[i]
        if few:
            followed[owner] += scratch[owner]
        scratch[owner] = 0
    return few
