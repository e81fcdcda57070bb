# SPDX-License-Identifier: GPL-3.0-or-later
"""exp, log, sin, cos, atan2, pow and their kin, built of + - * / sqrt and of operations on bits alone.

numpy's own differ in the last digits between its versions, so between Blender's, and between processors. These give the
same bits wherever arithmetic follows IEEE 754, and a compiled loop of the same operations gives them, too. They are
called as numpy's: arrays of any shape, which broadcast; float32 gives float32 by float32 arithmetic, anything else
float64. Nothing warns: exp(1000) is inf, log(-1) is NaN.

The largest errors, in units of the last place (tests/test_elementary.py measures them; numpy promises 4):

                               float32    float64
    exp, log, log1p            1.5        1.5
    sin, cos, expm1            2.5        2.5
    arctan, arctan2            3          3
    tan, arcsin, arccos        4          4
    power x^y                  0.6        2 + 2 |y log x|  (float32 by float64 arithmetic)

Angles so large that a float32 does not tell their quarter from the next to all digits (12 800) are worked out in
float64. Beyond 1.6 million radians sin, cos and tan are those of what is left of x by the float64 nearest to 2 pi:
within x 2^-54 of the right angle. Results too small for normal numbers are rounded as all others. Exact are exp(0),
log(1), cos(0), sin(0), arctan2(0, x > 0), x^0, 1^y. Infinities and NaN are as in C (C99, annex F),
and so is the sign of 0 of arctan2 and power; others give 0 without one.

The arithmetic is in elementary_core.py.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..accelerated import accelerated
from . import elementary_core as core
from .elementary_core import LONG, SHORT, Format

Array = NDArray[Any]

Rows = tuple[Array, ...]
Function = Callable[..., Rows]

CHUNK = 1 << 14
"""Numbers that are worked on at once: what a function writes in between stays in the processor's cache."""


# ------------------------------------------------------------------------------------------------ for callers


def exp(x: Any) -> Array:
    """e^x."""
    return _worked_out(core.exp, x)[0]


def expm1(x: Any) -> Array:
    """e^x - 1, which near 0 keeps all its digits."""
    return _worked_out(core.expm1, x)[0]


def log(x: Any) -> Array:
    """The natural logarithm."""
    return _worked_out(core.log, x)[0]


def log1p(x: Any) -> Array:
    """log(1 + x), which near 0 keeps all its digits."""
    return _worked_out(core.log1p, x)[0]


def sin(x: Any) -> Array:
    """The sine of x radians."""
    return _worked_out(core.sincos, x)[0]


def cos(x: Any) -> Array:
    """The cosine of x radians."""
    return _worked_out(core.sincos, x)[1]


def sincos(x: Any) -> tuple[Array, Array]:
    """The sine and the cosine of x radians, in half the time of one after the other."""
    sine, cosine = _worked_out(core.sincos, x)
    return sine, cosine


def sincos_near_0(x: Any) -> tuple[Array, Array]:
    """The same of angles |x| <= pi / 4, in half the time again."""
    sine, cosine = _worked_out(core.sincos_near_0, x)
    return sine, cosine


def tan(x: Any) -> Array:
    """The tangent of x radians."""
    sine, cosine = sincos(x)
    with np.errstate(all="ignore"):
        return sine / cosine


def arctan2(y: Any, x: Any) -> Array:
    """The angle of the point (x, y), from -pi to pi."""
    return _worked_out(core.arctan2, y, x)[0]


def arctan(x: Any) -> Array:
    """The angle from -pi / 2 to pi / 2 whose tangent is x."""
    return arctan2(x, np.ones_like(x))


def arcsin(x: Any) -> Array:
    """The angle from -pi / 2 to pi / 2 whose sine is x; NaN beyond -1 .. 1."""
    return arctan2(x, _leg(x))


def arccos(x: Any) -> Array:
    """The angle from 0 to pi whose cosine is x; NaN beyond -1 .. 1."""
    return arctan2(_leg(x), x)


def power(x: Any, y: Any) -> Array:
    """x^y. NaN for x < 0 and a y that is no whole number."""
    dtype = np.result_type(x, y)
    with np.errstate(all="ignore"):
        result = _worked_out(core.power, np.asarray(x, np.float64), np.asarray(y, np.float64))[0]
        return np.asarray(result, np.float32)[()] if dtype == np.float32 else result


def _leg(x: Any) -> Array:
    with np.errstate(all="ignore"):
        leg: Array = np.sqrt((1 - x) * (1 + x))
        return leg


# ------------------------------------------------------------------------------------------------ arrays


def _worked_out(function: Function, *inputs: Any) -> list[Array]:
    """What a function of `elementary_core` gives for arrays that broadcast, in their shape."""
    form = SHORT if np.result_type(*inputs) == np.float32 else LONG
    if len(inputs) > 1:
        inputs = np.broadcast_arrays(*inputs)
    rows = [np.asarray(a, form.number).reshape(-1) for a in inputs]
    with np.errstate(all="ignore"):
        found = _OF_ROWS[function, form.number](*rows)
    return [result.reshape(np.shape(inputs[0]))[()] for result in found]


def _of_rows(function: Function, form: Format) -> Callable[..., Rows]:
    """The function of arrays (n,), which it does not write to; it has a compiled twin."""

    def run(*rows: Array) -> Rows:
        size = rows[0].size
        if size <= CHUNK:
            return function(form, *(row.copy() for row in rows))
        parts = [slice(start, start + CHUNK) for start in range(0, size, CHUNK)]
        found = zip(*(function(form, *(row[part].copy() for row in rows)) for part in parts), strict=True)
        return tuple(np.concatenate(chunks) for chunks in found)

    run.__qualname__ = f"{function.__name__}_{form.number.__name__}"
    return accelerated(run)


_OF_ROWS: dict[tuple[Function, type], Function] = {
    (function, form.number): _of_rows(function, form)
    for function in (
        core.exp, core.expm1, core.log, core.log1p, core.sincos, core.sincos_near_0, core.arctan2, core.power
    )
    for form in (SHORT, LONG)
    if function is not core.power or form is LONG
}  # fmt: skip
