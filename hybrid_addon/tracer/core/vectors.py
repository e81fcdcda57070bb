# SPDX-License-Identifier: GPL-3.0-or-later
"""Arithmetic on (3, n) arrays, written out so that every ray gives the same bits in any chunk.

BLAS and einsum choose their order of summation by the shape of the array: neither may touch per-ray data.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated

Array = NDArray[Any]
Index = NDArray[np.intp] | slice

ALL = slice(None)
"""The index of everything."""

LONG = 1 << 17
"""Columns, above which products in between would each need new memory, which takes longer than working them out."""


@accelerated
def dot(a: Array, b: Array) -> Array:
    """Dot product of (3, n) with (3, n), or of (3,) with (3, n): (n,)."""
    result: Array = a[0] * b[0]
    result += a[1] * b[1]
    result += a[2] * b[2]
    return result


def cross(a: Array, b: Array) -> Array:
    """Cross product of two (3, n) arrays."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    if a.shape == b.shape and result[0].size > LONG:
        for start in range(0, result.shape[1], LONG):
            chunk = slice(start, start + LONG)
            result[:, chunk] = cross(a[:, chunk], b[:, chunk])
        return result
    np.subtract(a[1] * b[2], a[2] * b[1], out=result[0])
    np.subtract(a[2] * b[0], a[0] * b[2], out=result[1])
    np.subtract(a[0] * b[1], a[1] * b[0], out=result[2])
    return result


@accelerated
def normalize(a: Array) -> Array:
    """The (3, n) directions of the (3, n) vectors; NaN where a vector is 0."""
    result: Array = a * (1 / np.sqrt(dot(a, a)))
    return result


@accelerated
def orthonormal_basis(n: Array) -> tuple[Array, Array]:
    """Two unit directions (3, n) that make a right-handed basis with unit n (3, n) (Duff et al. 2017)."""
    sign = np.copysign(n.dtype.type(1), n[2])
    a = -1 / (sign + n[2])
    b = n[0] * n[1] * a
    tangent = np.stack([1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]])
    return tangent, np.stack([b, sign + n[1] * n[1] * a, -n[1]])


def matrix_times(matrix: Array, a: Array) -> Array:
    """A (3, 3) matrix times each column of (3, n), in the dtype of `a`."""
    m = matrix.astype(a.dtype, copy=False)
    return np.stack([m[i, 0] * a[0] + m[i, 1] * a[1] + m[i, 2] * a[2] for i in range(3)])


@accelerated
def largest_component(a: Array) -> Array:
    """The largest |coordinate| of each column of (3, n): (n,)."""
    result: Array = np.abs(a[0])
    np.maximum(result, np.abs(a[1]), out=result)
    np.maximum(result, np.abs(a[2]), out=result)
    return result


def no_brighter(radiance: NDArray[np.float32], limit: float | np.float32) -> NDArray[np.float32]:
    """Radiance (3, n) of the same hue, its largest channel at most the limit; itself if there is none (inf)."""
    if not np.isfinite(limit):
        return radiance
    brightest, most = radiance.max(axis=0), np.float32(limit)
    return radiance * np.where(brightest > most, most / np.maximum(brightest, np.float32(1e-30)), np.float32(1))


def signs(mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    """1 where the mask (n,) is True, else -1: (n,). Choosing between two takes ten times as long as arithmetic."""
    return np.asarray(2 * mask.astype(np.float32) - 1)


def flatnonzero(mask: Array) -> NDArray[np.intp]:
    """Numbers of the elements of (n,) that are not 0: of few in a quarter of the time that numpy's takes."""
    return mask.nonzero()[0]


def evenly(mask: NDArray[np.bool_], number: int) -> NDArray[np.intp]:
    """Numbers of the True elements of (n,): of every second, third, ... if they are that many times `number`."""
    there = np.count_nonzero(mask)
    step = max(1, there // number)
    # Of a whole picture no list of all: to be given new memory costs ten times as much as to write to it.
    return np.arange(0, len(mask), step, dtype=np.intp) if there == len(mask) else flatnonzero(mask)[::step]


def select(mask: NDArray[np.bool_]) -> Index:
    """Index of the True elements: everything as a slice (no copies), else a stable index array."""
    chosen = flatnonzero(mask)
    return ALL if len(chosen) == len(mask) else chosen


def most(mask: NDArray[np.bool_]) -> Index:
    """The same, or everything if that is more than half: then choosing costs more than working on all."""
    chosen = flatnonzero(mask)
    return ALL if 2 * len(chosen) > len(mask) else chosen


def take(a: Array, index: Index) -> Array:
    """Columns `index` of (n,) or (k, n); a view where `index` is everything."""
    if isinstance(index, slice):
        return a[..., index]
    return a.take(index, axis=-1, mode="wrap")  # all numbers are valid: "raise" takes half as long again


def put(a: Array, index: Index, columns: Array) -> Array:
    """A copy of (k, n) with its columns `index` replaced; the columns themselves where they are everything."""
    if isinstance(index, slice):
        return columns
    result = a.copy()
    write(result, index, columns)
    return result


def write(a: Array, index: Index, columns: Array | float) -> None:
    """Replace the columns `index` of (k, n) by (k, m) or by a number: row by row, which takes half the time."""
    if isinstance(index, slice):
        a[:, index] = columns
        return
    values = [columns] * len(a) if isinstance(columns, (int, float)) else columns
    for row, value in zip(a, values, strict=True):
        row[index] = value


def add(a: Array, index: Index, columns: Array) -> None:
    """Add to the columns `index`, none twice, of (k, n): (k, m), or (m,) to all rows."""
    if isinstance(index, slice):
        a[:, index] += columns
        return
    for row, values in zip(a, columns if columns.ndim > 1 else [columns] * len(a), strict=True):
        row[index] += values


def as_slice(index: NDArray[Any]) -> Index:
    """Consecutive numbers (n,) as a slice: it copies ten times as fast."""
    is_run = len(index) > 0 and index[-1] - index[0] == len(index) - 1 and bool((index[1:] > index[:-1]).all())
    return slice(int(index[0]), int(index[-1]) + 1) if is_run else index


def count(index: Index, n: int) -> int:
    """How many of `n` columns an index from `select` takes."""
    return n if isinstance(index, slice) else len(index)
