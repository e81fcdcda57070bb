# SPDX-License-Identifier: GPL-3.0-or-later
"""Numpy functions that have a compiled twin with the same bits.

    @accelerated
    def refine(facets, prim, origin, direction): ...          # numpy: the reference, and what runs without numba

A hot function of arrays is marked so. Its twin is a numba function of `tracer/kernels/` that names it, takes the same
arguments and returns the same bits (tests/tracer/kernels compares the two on stiff input). `tracer/kernels/loading.py`
compiles it, or loads it from its cache, in the background: from then on a call runs the twin. Until then, and where
there is no numba, numpy answers. So nobody can tell from a picture which of the two has worked.

The marked function is called by position. What a kernel was not compiled for (float64 directions, say) numpy does.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np

F = TypeVar("F", bound=Callable[..., Any])

NO_MATCH = "No matching definition"
"""How numba's TypeError begins for arguments of types that a kernel was not compiled for."""


class Twins:
    """A numpy function, and its kernel while there is one in use.

    reference : the numpy function.   kernel : what calls run instead, or None.   compiled : the kernel once loaded, in
    use or not.   written : positions of the arrays that both write to; of others a kernel may be given copies.
    tables : positions of the arrays that are not of one column for each ray: all others are of the same length, and
    those of two axes (3, n).   of_rows : positions of arrays (k, n) that may have any number of rows.
    unmatched : types of arguments for which there is no kernel.
    """

    def __init__(self, name: str, reference: Callable[..., Any]) -> None:
        self.name, self.reference = name, reference
        self.kernel: Callable[..., Any] | None = None
        self.compiled: Callable[..., Any] | None = None
        self.written: tuple[int, ...] = ()
        self.tables: tuple[int, ...] = ()
        self.of_rows: tuple[int, ...] = ()
        self.unmatched: set[tuple[Any, ...]] = set()

    def run(self, kernel: Callable[..., Any], args: tuple[Any, ...]) -> Any:
        """Call the kernel, on arrays laid out row by row; a failure is one warning, and numpy's turn from then on."""
        ready = self._ready(args)
        if ready is None:
            return self.reference(*args)
        try:
            return kernel(*ready)
        except MemoryError:
            raise
        except Exception as error:
            if isinstance(error, TypeError) and str(error).startswith(NO_MATCH):
                self.unmatched.add(_types(args))  # to find it out takes numba longer than the work
            else:
                self.kernel = self.compiled = None
                report_failure(self.name, error)
        return self.reference(*args)

    def _ready(self, args: tuple[Any, ...]) -> list[Any] | None:
        """The arguments as a kernel takes them; None: it is not for these. It would read beyond an array that numpy
        would repeat for all columns, or rows, of another."""
        if self.unmatched and _types(args) in self.unmatched:
            return None
        ready, n = [], -1
        for i, a in enumerate(args):
            if isinstance(a, np.ndarray):
                if i not in self.tables and a.ndim:
                    if n < 0:
                        n = a.shape[-1]
                    elif a.shape[-1] != n:
                        return None
                    if a.ndim == 2 and len(a) != 3 and i not in self.of_rows:
                        return None
                if not a.flags.c_contiguous:
                    if i in self.written:
                        return None
                    a = np.ascontiguousarray(a)
            ready.append(a)
        return ready


ALL: dict[str, Twins] = {}
"""Every marked function that has been imported, by its name within the package (`tracer.geometry.aggregate.refine`)."""

_early: dict[str, tuple[Any, ...]] = {}  # kernels whose function is not imported yet
_wanted = True  # kernels are to run
_failed: dict[str, str] = {}
_warned: list[str] = []


def accelerated(function: F) -> F:
    """Let calls of this numpy function run its compiled twin, while that is loaded and in use."""
    name = f"{function.__module__.removeprefix(f'{__package__}.')}.{function.__qualname__}"
    twins = ALL[name] = Twins(name, function)

    @wraps(function)
    def run(*args: Any) -> Any:
        kernel = twins.kernel
        return function(*args) if kernel is None else twins.run(kernel, args)

    _join(name)
    return cast(F, run)


def provide(
    name: str,
    kernel: Callable[..., Any],
    written: tuple[int, ...] = (),
    tables: tuple[int, ...] = (),
    of_rows: tuple[int, ...] = (),
) -> None:
    """From now on the function of this name runs `kernel`; written, tables, of_rows: see `Twins`."""
    _early[name] = kernel, written, tables, of_rows
    _join(name)


def _join(name: str) -> None:
    """Give a function its kernel, if both are there. Whoever notes his own first and then comes here needs no lock,
    which a forked process might find held: only one gets what `pop` returns."""
    twins = ALL.get(name)
    early = None if twins is None else _early.pop(name, None)
    if twins is not None and early is not None:
        kernel, twins.written, twins.tables, twins.of_rows = early
        twins.compiled = kernel
        twins.kernel = kernel if _wanted else None


def use(wanted: bool) -> None:
    """Run the kernels, those that are loaded later too, or numpy only: to compare the two."""
    global _wanted
    _wanted = wanted
    for twins in list(ALL.values()):
        twins.kernel = twins.compiled if wanted else None


def in_use() -> list[str]:
    """Names of the functions whose kernels run."""
    return sorted(name for name, twins in list(ALL.items()) if twins.kernel is not None)


def report_failure(name: str, error: BaseException) -> None:
    """Note that a kernel cannot be used. The first one is a warning, the others are in the report."""
    _failed[name] = f"{type(error).__name__}: {error}".split("\n")[0]
    if not _warned:
        _warned.append(name)
        warnings.warn(
            f"the compiled kernel {name} failed, numpy does its work ({_failed[name]})", UserWarning, stacklevel=2
        )


def failed() -> dict[str, str]:
    """Name of each kernel that failed -> why."""
    return dict(_failed)


def _types(args: tuple[Any, ...]) -> tuple[Any, ...]:
    return tuple((a.dtype, a.ndim) if isinstance(a, np.ndarray) else type(a) for a in args)
