# SPDX-License-Identifier: GPL-3.0-or-later
"""How a kernel is written down: a loop over rays beside the numpy function with the same bits.

    @kernel("tracer.geometry.shapes.plane_distance", [(f8[2], f4[2], f4[2])])
    def plane_distance(facets, origin, direction): ...

Rules, which make the bits those of numpy:

* The same operations in the same order and of the same type. + - * / and sqrt are exact to the last bit; exp, sin, pow
  and the like are not: they have functions of their own.
* A literal number next to a float32 makes a float64 here, not in numpy: constants are module globals of their type
  (`ONE = np.float32(1)`).
* No fastmath: nothing is reassociated or contracted to a fused multiply-add (a test reads the machine code).
* minimum, maximum, clip: numpy's hand NaN on, Python's `min` and `max` do not: `least` and `largest` below do.
* Arrays of arguments lie row by row and are not written to, but for those that a type says so of: `written(f8[2])`.
  Helpers take numbers, not arrays, which would be counted as referred to for each call.
* Arrays are as long as one another but for those that `tables` names: their last axis is one column for each ray. Those
  of two axes are (3, n) but for those that `of_rows` names.
* Nothing but the arguments is read or written, no lock is held, no thread started: any number of threads, or of forked
  processes, run a kernel at once.

numba is imported here and in kernels only, which `loading.py` imports where there is a numba.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numba
import numpy as np
from numba import types
from numba.np.numpy_support import as_dtype
from numpy.typing import NDArray

Array = NDArray[Any]

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": False, "boundscheck": False}
"""Of all kernels. error_model: dividing by 0 gives inf or NaN, as in numpy."""

none, boolean, int64, float32, float64 = types.none, types.boolean, types.int64, types.float32, types.float64
"""Types of arguments that are no arrays."""


class ArrayTypes:
    """The types of arrays of one kind of number, by their dimensions: f4[2] is a (k, n) float32 array."""

    def __init__(self, number: Any) -> None:
        self.number = number

    def __getitem__(self, dimensions: int) -> Any:
        return types.Array(self.number, dimensions, "C", readonly=True)


f4, f8 = ArrayTypes(types.float32), ArrayTypes(types.float64)
u1, u4, b1 = ArrayTypes(types.uint8), ArrayTypes(types.uint32), ArrayTypes(types.boolean)
i2, i4, i8 = ArrayTypes(types.int16), ArrayTypes(types.int32), ArrayTypes(types.int64)


def written(array: Any) -> Any:
    """The type of an array that a kernel writes to."""
    return types.Array(array.dtype, array.ndim, "C", readonly=False)


class Kernel(NamedTuple):
    """A kernel as it was declared. of: the numpy function's name (see `accelerated`); signatures: types of arguments,
    one tuple for each combination that it is compiled for. tables: positions of the arrays that are not of one column
    for each ray. of_rows: positions of arrays (k, n) that may have any number of rows. late: it is
    loaded only when somebody asks for it (`tiles.apart`)."""

    of: str
    function: Callable[..., Any]
    signatures: list[tuple[Any, ...]]
    tables: tuple[int, ...] = ()
    of_rows: tuple[int, ...] = ()
    late: bool = False

    @property
    def written(self) -> tuple[int, ...]:
        """Positions of the arguments that it writes to."""
        return tuple(i for i, t in enumerate(self.signatures[0]) if isinstance(t, types.Array) and t.mutable)


DECLARED: list[Kernel] = []
"""All kernels of the modules that have been imported."""


def kernel(
    of: str,
    signatures: Sequence[tuple[Any, ...]],
    tables: tuple[int, ...] = (),
    of_rows: tuple[int, ...] = (),
    late: bool = False,
) -> Callable[[F], F]:
    """Declare a function as the twin of the numpy function `of`, compiled for these types of arguments.

    tables  : positions of arrays that are not of one column for each ray. All others are as long as one another: where
              they are not (numpy would repeat a single column), numpy does the work.
    of_rows : positions of arrays (k, n) of any number of rows, which the kernel asks for. All others of two axes are
              (3, n): where they are not, numpy does the work.
    late    : it is loaded only when somebody asks for it.
    """

    def declare(function: F) -> F:
        DECLARED.append(Kernel(of, function, list(signatures), tables, of_rows, late))
        return function

    return declare


def nothing(of: Any) -> Any:
    """The least argument of this type: an empty array, 0 or None."""
    if isinstance(of, types.NamedTuple):
        return of.instance_class(*map(nothing, of.types))
    if isinstance(of, types.Array):
        result = np.zeros((0,) * of.ndim, as_dtype(of.dtype))
        result.flags.writeable = of.mutable  # in a record the types must be the same
        return result
    return None if isinstance(of, types.NoneType) else as_dtype(of).type(0)


def names_in(of: Any) -> str:
    """The names in a record, in their order, and in its records: numba knows the types alone."""
    records = getattr(of, "fields", ())
    return f"{records}{''.join(map(names_in, of.types))}" if records else ""


def names_in_all(kernel: Kernel) -> str:
    """The same of all records among the arguments of a kernel."""
    return "".join(map(names_in, kernel.signatures[0]))


def helper(function: F) -> Any:
    """A function of numbers for use in kernels, into which it is compiled."""
    return numba.njit(**OPTIONS)(function)


def stage(function: F) -> Any:
    """A function of arrays for use in other kernels: one of a kernel's own, or the twin that a module declares."""
    return numba.njit(**OPTIONS)(function)


def inlined(function: F) -> Any:
    """A function of arrays that is written out where it is called: one that calls stages, and works little itself.

    What a function calls is optimised with it, and once more with whatever calls it: the fewer calls lie one in
    another, the sooner all is compiled.
    """
    return numba.njit(**OPTIONS, inline="always")(function)


@helper
def least(a: Any, b: Any) -> Any:
    """np.minimum: NaN if either is."""
    return a if a <= b or a != a else b


@helper
def largest(a: Any, b: Any) -> Any:
    """np.maximum: NaN if either is."""
    return a if a >= b or a != a else b


@helper
def clip(a: Any, low: Any, high: Any) -> Any:
    """np.clip."""
    return least(largest(a, low), high)


@helper
def dot(ax: Any, ay: Any, az: Any, bx: Any, by: Any, bz: Any) -> Any:
    """vectors.dot."""
    return ax * bx + ay * by + az * bz


@helper
def largest_component(x: Any, y: Any, z: Any) -> Any:
    """vectors.largest_component."""
    return largest(largest(np.abs(x), np.abs(y)), np.abs(z))
