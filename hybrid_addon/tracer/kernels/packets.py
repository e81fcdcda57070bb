# SPDX-License-Identifier: GPL-3.0-or-later
"""The loops that call Embree: arrays of rays in packets of 8, not said to be coherent.

Such packets name the triangle that single rays name (measured: all of 25 million); said to be coherent they do not
always. Embree's functions are found by name when a kernel is linked, so that kernels can be kept on disk.

A packet is 21 rows of 8 numbers (RTCRayHit8 of rtcore_ray.h): origin, tnear, direction, time, tfar, mask, id, flags of
the rays, then normal, u, v, triangle, geometry, instance, number in its array of the hits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import llvmlite.binding
import numba
import numpy as np
from numba import types

from ..geometry.embree.library import query_addresses
from .declare import OPTIONS, Array, F, b1, f4, i4, kernel, written

_addresses = query_addresses()
for _name, _address in _addresses.items():
    llvmlite.binding.add_symbol(_name, _address)

_ADDRESSES: Any = types.void(types.uint64, types.uint64, types.uint64, types.uint64)
_intersect: Any = types.ExternalFunction("rtcIntersect8", _ADDRESSES)
_occluded: Any = types.ExternalFunction("rtcOccluded8", _ADDRESSES)


HAS_QUERIES = bool(_addresses)


def _query(of: str, signatures: list[tuple[Any, ...]]) -> Callable[[F], F]:
    """Declare a kernel, but where its function of Embree was not found: LLVM ends a process that links without."""
    return kernel(of, signatures) if _addresses else lambda function: function


N = 8
ROWS, ALIGNED = 21, 64  # Embree wants 32
ZERO, FAR = np.float32(0), np.float32(np.inf)
NONE, ALL_BITS = np.int32(-1), np.int32(-1)
TFAR, MASK, ID, FLAGS, TRIANGLE, GEOMETRY, INSTANCE, IN_ARRAY = 8, 9, 10, 11, 17, 18, 19, 20
DEFAULT = np.uint64(0)  # arguments of a query: incoherent rays, no filter


def _inline(function: Callable[..., Any]) -> Any:
    """Into each kernel: arrays handed to other functions would be counted as referred to for each packet."""
    return numba.njit(**OPTIONS, inline="always")(function)


@_inline
def _aligned(size: int) -> Any:
    """`size` bytes whose address is aligned."""
    raw = np.empty(size + ALIGNED, np.uint8)
    start = (ALIGNED - raw.ctypes.data % ALIGNED) % ALIGNED
    return raw[start : start + size]


@_inline
def _fill(f: Array, i: Array, valid: Array, origin: Array, direction: Array, first: int) -> Any:
    """Rays from `first` on into a packet: how many."""
    m = min(N, origin.shape[1] - first)
    for k in range(N):
        ray = first + k if k < m else first
        valid[k] = NONE if k < m else np.int32(0)
        for axis in range(3):
            f[axis * N + k] = origin[axis, ray]
            f[(4 + axis) * N + k] = direction[axis, ray]
        f[3 * N + k] = ZERO
        f[7 * N + k] = ZERO
        i[MASK * N + k] = ALL_BITS
        i[ID * N + k] = np.int32(0)
        i[FLAGS * N + k] = np.int32(0)
    return m


@_query("tracer.geometry.embree.nearest_of", [(types.uint64, f4[2], f4[2], written(i4[2]))])
def nearest_of(scene: Any, origin: Array, direction: Array, found: Array) -> None:
    """See the function of this name."""
    packet, mask = _aligned(ROWS * N * 4), _aligned(N * 4)
    f, i, valid = packet.view(np.float32), packet.view(np.int32), mask.view(np.int32)
    for first in range(0, origin.shape[1], N):
        m = _fill(f, i, valid, origin, direction, first)
        for k in range(N):
            f[TFAR * N + k] = FAR
            for row in range(TRIANGLE, ROWS):
                i[row * N + k] = NONE
        _intersect(valid.ctypes.data, scene, packet.ctypes.data, DEFAULT)
        for k in range(m):
            found[0, first + k] = i[TRIANGLE * N + k]  # still NONE where nothing is hit
            found[1, first + k] = i[INSTANCE * N + k]
            found[2, first + k] = i[IN_ARRAY * N + k]


@_query("tracer.geometry.embree.occluded_of", [(types.uint64, f4[2], f4[2], f4[1], written(b1[1]))])
def occluded_of(scene: Any, origin: Array, direction: Array, t_max: Array, blocked: Array) -> None:
    """See the function of this name."""
    packet, mask = _aligned(12 * N * 4), _aligned(N * 4)
    f, i, valid = packet.view(np.float32), packet.view(np.int32), mask.view(np.int32)
    for first in range(0, origin.shape[1], N):
        m = _fill(f, i, valid, origin, direction, first)
        for k in range(N):
            f[TFAR * N + k] = t_max[first + k if k < m else first]
        _occluded(valid.ctypes.data, scene, packet.ctypes.data, DEFAULT)
        for k in range(m):
            blocked[first + k] = f[TFAR * N + k] < ZERO  # -inf for a hit
