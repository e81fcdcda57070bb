# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of procedural/elementary.py, and the functions of single numbers that they and other kernels are made of.

Each is compiled for float32 (`SHORT`) and for float64 (`LONG`): `SHORT.exp(x)`. Where an odd number needs a branch, a
kernel works on all numbers without it, as the processor does many of these at once, and on the odd ones once more.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...procedural import elementary_core as core
from .declare import f4, f8, helper, kernel, largest, least


class Functions(NamedTuple):
    """Helpers of one number, or two, of one type. The twins in `elementary_core` have the formulas."""

    exp: Any
    expm1: Any
    log: Any
    log1p: Any
    sincos: Any
    sincos_near_0: Any
    arctan2: Any
    power: Any
    normal_log: Any
    normal_log1p: Any
    normal_power: Any
    normal_sincos: Any
    normal_arctan2: Any


def functions(form: core.Format, long: Functions | None = None) -> Functions:
    """Those of a format. long: those of float64, for what float32 does not reach."""
    N: Any = form.number
    I: Any = form.integer  # noqa: E741
    zero, half, one, two = N(0), N(0.5), N(1), N(2)
    whole, tiny, huge, most, inf, nan = (N(v) for v in (form.whole, form.tiny, form.huge, form.most, np.inf, np.nan))
    over_log_2, two_over_pi, tan_pi_8 = (N(v) for v in (core.OVER_LOG_2, core.TWO_OVER_PI, core.TAN_PI_8))
    (least_exp, most_exp), (log_2, log_2_rest) = map(N, form.exp_range), map(N, form.log_2)
    up, down, raised, turn = N(2.0**core.UP), N(2.0**-core.UP), N(core.UP), core.TURN
    quarter_pi, half_pi_rest, pi_rest = N(form.pi[0] / 4), N(form.pi[1] * 0.5), N(form.pi[1])
    half_pi, pi = N(form.pi[0] * 0.5), N(form.pi[0])
    sine_of, cosine_of, exponential, logarithm, arctangent, quarters = (
        tuple(map(N, c))
        for c in (form.sine, form.cosine, form.exponential, form.logarithm, form.arctangent, form.half_pi)
    )
    mantissa, moved, sign, unit = I(form.mantissa), I(form.quarter), I(form.sign), I(1)
    whole_bits, one_bits, root_half_bits = map(I, form.bits)

    @helper
    def polynomial(x, c):
        total = x * c[0]
        for k in range(1, len(c) - 1):
            total = (total + c[k]) * x
        return total + c[len(c) - 1]

    @helper
    def reduced_exp(x):
        x = least(largest(x, least_exp), most_exp)
        k = x * over_log_2 + whole
        n = k - whole
        x = x - n * log_2 - n * log_2_rest
        return polynomial(x, exponential) * x * x + x, k

    @helper
    def times_power_of_2(x, k):
        bits = I(N(k).view(I) - whole_bits)
        first = I(bits >> unit)
        second = I(bits - first)
        x = x * I((first << mantissa) + one_bits).view(N)
        return x * I((second << mantissa) + one_bits).view(N)

    @helper
    def exp(x):
        p, k = reduced_exp(x)
        return times_power_of_2(p + one, k)

    @helper
    def expm1(x):
        p, k = reduced_exp(x)
        scale = times_power_of_2(one, k - one)
        return (p * scale + (scale - half)) * two

    @helper
    def log_of(x, lowered, rest, has_rest):
        bits = N(x).view(I)
        exponent = I(I(bits - root_half_bits) >> mantissa)
        f = I(bits - I(exponent << mantissa)).view(N) - one
        k = I(exponent + whole_bits).view(N) - whole - lowered
        s = f / (f + two)
        z = s * s
        square = f * half * f
        p = (polynomial(z, logarithm) * z + square) * s + k * log_2_rest
        if has_rest:
            p = p + rest
        return k * log_2 + (f - (square - p))

    @helper
    def normal_log(x):
        return log_of(x, zero, zero, False)

    @helper
    def any_log(x, rest, has_rest):
        if x >= tiny and x < inf:
            return log_of(x, zero, rest, has_rest)
        if x > zero and x < inf:
            return log_of(x * up, raised, rest, has_rest)
        return -inf if x == zero else (inf if x == inf else nan)

    @helper
    def log(x):
        return any_log(x, zero, False)

    @helper
    def log1p(x):
        u = x + one
        return any_log(u, (x - (u - one)) / u, True)

    @helper
    def normal_log1p(x):
        u = x + one
        return log_of(u, zero, (x - (u - one)) / u, True)

    @helper
    def normal_power(x, y):
        return exp(normal_log(x) * y)

    @helper
    def power(x, y):
        result = exp(log(abs(x)) * y)
        if x > zero and x < inf and abs(y) < inf:
            return result
        if y == zero or x == one or (x == -one and abs(y) == inf):
            return one
        if x < zero and x > -inf and np.floor(y) != y:
            return nan
        return N(np.copysign(result, x)) if abs(np.fmod(y, two)) == one else result

    @helper
    def sincos_near_0(x):
        z = x * x
        return polynomial(z, sine_of) * z * x + x, (polynomial(z, cosine_of) * z - half) * z + one

    @helper
    def normal_sincos(x):
        k = x * two_over_pi + whole
        n = k - whole
        for part in quarters:
            x = x - n * part
        sine, cosine = sincos_near_0(x)
        quarter, s, c = N(k).view(I), N(sine).view(I), N(cosine).view(I)
        swapped = I(I(-I(quarter & unit)) & I(s ^ c))
        s = I(I(s ^ swapped) ^ I(I(quarter << moved) & sign))
        c = I(I(c ^ swapped) ^ I(I(I(quarter + unit) << moved) & sign))
        return s.view(N), c.view(N)

    if long is None:

        @helper
        def far_sincos(x):
            return normal_sincos(np.fmod(x, turn)) if abs(x) < inf else (nan, nan)

    else:
        of_float64 = long.sincos

        @helper
        def far_sincos(x):
            sine, cosine = of_float64(np.float64(x))
            return N(sine), N(cosine)

    @helper
    def sincos(x):
        return normal_sincos(x) if abs(x) < most else far_sincos(x)

    @helper
    def angle_of(y, x, low, high):
        steep = one if low > high * tan_pi_8 else zero
        t = (low - steep * high) / (high + low * steep)
        z = t * t
        angle = polynomial(z, arctangent) * z * t + t + steep * quarter_pi
        upper, left = (one if abs(y) > abs(x) else zero), (one if N(x).view(I) < 0 else zero)
        angle = angle * (one - two * upper) + upper * half_pi_rest + upper * half_pi
        angle = angle * (one - two * left) + left * pi_rest + left * pi
        return N(np.copysign(angle, y))

    @helper
    def normal_arctan2(y, x):
        return angle_of(y, x, least(abs(x), abs(y)), largest(abs(x), abs(y)))

    @helper
    def arctan2(y, x):
        low, high = least(abs(x), abs(y)), largest(abs(x), abs(y))
        endless, large = high == inf, high >= huge
        low = (one if low == inf else zero) if endless else (low * down if large else low)
        high = one if endless or high == zero else (high * down if large else high)
        return angle_of(y, x, low, high)

    return Functions(
        exp, expm1, log, log1p, sincos, sincos_near_0, arctan2, power, normal_log, normal_log1p, normal_power,
        normal_sincos, normal_arctan2,
    )  # fmt: skip


LONG = functions(core.LONG)
SHORT = functions(core.SHORT, LONG)


def declare(form: core.Format, of: Functions, row: Any) -> None:
    """Declare the kernels of a format; row: the type of its arrays (n,)."""
    tiny, inf, most, huge, zero = (form.number(v) for v in (form.tiny, np.inf, form.most, form.huge, 0))
    least_above = -form.number(1)

    @helper
    def every(x):
        return True

    @helper
    def is_normal(x):
        return x >= tiny and x < inf

    @helper
    def is_above(x):
        return x > least_above and x < inf

    @helper
    def is_small(x):
        return abs(x) < most

    @helper
    def has_angle(y, x):
        high = largest(abs(x), abs(y))
        return high > zero and high < huge

    of_one(form, "exp", of.exp, of.exp, every, row)
    of_one(form, "expm1", of.expm1, of.expm1, every, row)
    of_one(form, "log", of.normal_log, of.log, is_normal, row)
    of_one(form, "log1p", of.normal_log1p, of.log1p, is_above, row)
    of_one(form, "sincos", of.normal_sincos, of.sincos, is_small, row, results=2)
    of_one(form, "sincos_near_0", of.sincos_near_0, of.sincos_near_0, every, row, results=2)
    of_two(form, "arctan2", of.normal_arctan2, of.arctan2, has_angle, row)


def of_one(form: core.Format, name: str, normal: Any, whole: Any, usual: Any, row: Any, results: int = 1) -> None:
    """The kernel of a function of one number, which gives one or two.

    normal : has no branches, so that the loop over it takes several numbers at once; it is for those that are usual.
    whole  : for all others, in a loop of its own.
    """
    one = form.number(1)

    if results == 1:

        def loop(x):
            result = np.empty_like(x)
            for i in range(len(x)):
                result[i] = normal(x[i] if usual(x[i]) else one)
            for i in range(len(x)):
                if not usual(x[i]):
                    result[i] = whole(x[i])
            return (result,)

    else:

        def loop(x):
            first, second = np.empty_like(x), np.empty_like(x)
            for i in range(len(x)):
                first[i], second[i] = normal(x[i] if usual(x[i]) else one)
            for i in range(len(x)):
                if not usual(x[i]):
                    first[i], second[i] = whole(x[i])
            return first, second

    kernel(f"procedural.elementary.{name}_{form.number.__name__}", [(row,)])(loop)


def of_two(form: core.Format, name: str, normal: Any, whole: Any, usual: Any, row: Any) -> None:
    """The kernel of a function of two numbers; see `of_one`."""
    one = form.number(1)

    def loop(x, y):
        result = np.empty_like(x)
        for i in range(len(x)):
            ordinary = usual(x[i], y[i])
            result[i] = normal(x[i] if ordinary else one, y[i] if ordinary else one)
        for i in range(len(x)):
            if not usual(x[i], y[i]):
                result[i] = whole(x[i], y[i])
        return (result,)

    kernel(f"procedural.elementary.{name}_{form.number.__name__}", [(row, row)])(loop)


@helper
def has_power(x, y):
    """Whether x ** y needs no case of its own."""
    return x >= TINY and x < INF and abs(y) < INF


TINY, INF = core.LONG.tiny, np.inf
declare(core.SHORT, SHORT, f4[1])
declare(core.LONG, LONG, f8[1])
of_two(core.LONG, "power", LONG.normal_power, LONG.power, has_power, f8[1])
