# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of film/: sums of samples and of pixels, and what the cutoff may take from each."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.constants import BUDGET_BITS, BUDGET_UNIT
from .declare import Array, f4, f8, helper, i2, i8, int64, kernel, written

ZERO = np.float32(0)
EXPONENT = np.int32(0x7F800000)  # of what is no number
OWN = 4  # rows of radiance and of samples that count
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


@kernel("tracer.film.pixels.give", [(written(f4[3]), i8[1], f4[2], f4[2], int64)], tables=(0, 1, 2, 3))
def give(given: Array, pixels: Array, values: Array, weights: Array, first: int) -> tuple[Array, Array]:
    """See there."""
    m, count = len(pixels), weights.shape[1]
    middle = (first + count) // 2 - first
    half, second = np.zeros((OWN, m), np.float32), np.zeros((OWN, m), np.float32)
    # Sample by sample, channel by channel: loops over pixels that the processor does many of at once.
    of_sample, sound = np.empty((count, m), np.float32), np.ones((count, m), np.bool_)
    lost = False
    for c in range(len(values)):
        bits, odd = values[c].view(np.int32), np.int32(0)
        for j in range(m * count):
            odd |= np.int32((bits[j] & EXPONENT) == EXPONENT)
        if odd:
            lost = True
            for i in range(m):
                for s in range(count):
                    sound[s, i] &= abs(values[c, i * count + s]) < np.inf
    start, is_run = pixels[0] if m else 0, True
    for i in range(m):
        is_run &= pixels[i] == start + i
    row = np.empty(m, np.float32)
    for c in range(given.shape[1]):
        for s in range(count):
            one = of_sample[s]
            for i in range(m):
                one[i] = values[c, i * count + s]
        for k in range(given.shape[0]):
            if k == 1 and lost:
                for s in range(count):
                    for i in range(m):
                        if not sound[s, i]:
                            of_sample[s, i] = ZERO
            to = given[k, c, start : start + m] if is_run else row
            if first == 0:
                to[:] = ZERO
            elif not is_run:
                for i in range(m):
                    to[i] = given[k, c, pixels[i]]
            for s in range(count):
                if k == 0 and s == middle and c < OWN:
                    half[c] = to
                weight, one = weights[k, s], of_sample[s]
                if weight != ZERO:
                    for i in range(m):
                        to[i] += one[i] * weight
                    if k == 0 and s >= middle and c < OWN:
                        late = second[c]
                        for i in range(m):
                            late[i] += one[i] * weight
            if not is_run:
                for i in range(m):
                    given[k, c, pixels[i]] = to[i]
    return half, second
