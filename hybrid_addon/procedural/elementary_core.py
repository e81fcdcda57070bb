# SPDX-License-Identifier: GPL-3.0-or-later
"""The arithmetic of `elementary`, in either format: of arrays (m,) that fit into the cache and that it may write to.

Methods: Cody & Waite (1980, Software Manual for the Elementary Functions) reduce the argument; the sums are in the
order of Ng's fdlibm (1993). The polynomials are our own (tools/fit_elementary.py). `tracer/kernels/elementary.py` does
the same operations in the same order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


@dataclass(frozen=True)
class Format:
    """A floating point format, and the constants of the functions in it. Polynomials: the highest power first.

    number, integer : dtypes of the same size.   mantissa : bits below the leading one.
    whole       : 1.5 2^mantissa. Added to a small number it rounds that to a whole one, which is then in the low bits.
    bits        : of `whole`, of 1 and of sqrt(1/2), as integers.
    half_pi     : a sum; products of its parts, but the last, with numbers up to `most` / half_pi are exact.
    most        : the largest angle that these parts reduce.
    log_2       : a sum; products of its first part with exponents are exact.
    exp_range   : exp beyond, and at the ends, is 0 or inf; half of it is finite yet.
    tiny        : the least normal number; huge: what may still be added to itself.
    pi          : the nearest number, and what pi is more than that.
    """

    number: type
    integer: type
    mantissa: int
    whole: float
    bits: tuple[int, int, int]
    sine: tuple[float, ...]
    cosine: tuple[float, ...]
    exponential: tuple[float, ...]
    logarithm: tuple[float, ...]
    arctangent: tuple[float, ...]
    half_pi: tuple[float, ...]
    most: float
    log_2: tuple[float, float]
    exp_range: tuple[float, float]
    tiny: float
    huge: float
    pi: tuple[float, float]

    @property
    def quarter(self) -> int:
        """By how many bits the second lowest one is moved to become the sign."""
        return 8 * np.dtype(self.integer).itemsize - 2

    @property
    def sign(self) -> int:
        """The sign alone, as an integer."""
        return -2 << self.quarter


SHORT = Format(
    np.float32, np.int32, 23, 1.5 * 2.0**23, (0x4B400000, 0x3F800000, 0x3F3504F3),
    sine=(-0.00019587890880412386, 0.008332748270629749, -0.1666666466231438),
    cosine=(2.4547942085071572e-05, -0.0013888303035894866, 0.04166666465950221),
    exponential=(0.001392617611993558, 0.008363173074513711, 0.041666554662050534, 0.1666657702559799, 0.5),
    logarithm=(0.2957994939197279, 0.3998878056602198, 0.6666668503957586),
    arctangent=(-0.06451928208121749, 0.10743731490791084, -0.1426395559798464, 0.19999540483648964,
                -0.3333333176116852),
    half_pi=(1.5703125, 0.0004837512969970703, 7.549533620476723e-08, 2.563344151594519e-12), most=1.57 * 2**13,
    log_2=(0.693145751953125, 1.4286068203094173e-06), exp_range=(-105.0, 88.8), tiny=2.0**-126, huge=2.0**100,
    pi=(3.1415927410125732, -8.742277657347586e-08),
)  # fmt: skip
LONG = Format(
    np.float64, np.int64, 52, 1.5 * 2.0**52, (0x4338000000000000, 0x3FF0000000000000, 0x3FE6A09E667F3BCD),
    sine=(1.5918129294866608e-10, -2.5051131845003624e-08, 2.755731610255244e-06, -0.00019841269836758574,
          0.008333333333330948, -0.16666666666666666),
    cosine=(-1.1382632425521717e-11, 2.08761462684032e-09, -2.7557317271729793e-07, 2.480158729876569e-05,
            -0.0013888888888887398, 0.041666666666666664),
    exponential=(2.5100375832561234e-08, 2.7620075879983367e-07, 2.7557268480310024e-06, 2.4801521322368692e-05,
                 0.00019841269863040545, 0.0013888888917196719, 0.008333333333330065, 0.041666666666624164,
                 0.16666666666666669, 0.5000000000000001),
    logarithm=(0.14616449685043406, 0.15331721600556042, 0.18182889125261723, 0.2222221113479508,
               0.28571428625975487, 0.39999999999899505, 0.666666666666667),
    arctangent=(0.016285756855221028, -0.034570561981427744, 0.04551593220626549, -0.05230454270650244,
                0.05878928997834775, -0.06666424885738255, 0.07692296375032143, -0.09090908753500877,
                0.11111111105155447, -0.14285714285659828, 0.19999999999999804, -0.3333333333333333),
    half_pi=(1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21), most=1.57 * 2**20,
    log_2=(0.6931471804855391, 7.440617110012397e-11), exp_range=(-746.0, 709.9), tiny=2.0**-1022, huge=2.0**1000,
    pi=(3.141592653589793, 1.2246467991473532e-16),
)  # fmt: skip

TURN = 6.283185307179586
TWO_OVER_PI = 0.6366197723675814
OVER_LOG_2 = 1.4426950408889634
TAN_PI_8 = 0.41421356237309503
UP = 64
"""Numbers that are not normal are worked on times 2^UP."""


def _polynomial(x: Array, coefficients: tuple[float, ...]) -> Array:
    """By Horner."""
    total = x * coefficients[0]
    for c in coefficients[1:-1]:
        total += c
        total *= x
    total += coefficients[-1]
    return total


# ------------------------------------------------------------------------------------------------ exp, log, pow


def _reduced_exp(form: Format, x: Array) -> tuple[Array, Array]:
    """r = exp(f) - 1 and k + whole: x = k log(2) + f, |f| <= log(2) / 2, of x brought into the range of exp."""
    np.maximum(x, form.exp_range[0], out=x)
    np.minimum(x, form.exp_range[1], out=x)
    k = x * OVER_LOG_2
    k += form.whole
    whole = k - form.whole
    x -= whole * form.log_2[0]
    x -= whole * form.log_2[1]
    p = _polynomial(x, form.exponential)
    p *= x
    p *= x
    p += x
    return p, k


def _times_power_of_2(form: Format, x: Array, k: Array) -> Array:
    """x 2^k, given k + whole: in two steps, as 2^k may be no normal number."""
    bits: Array = k.view(form.integer)
    bits -= form.bits[0]
    half = bits >> 1
    bits -= half
    for exponent in (half, bits):
        exponent <<= form.mantissa
        exponent += form.bits[1]
        x *= exponent.view(form.number)
    return x


def exp(form: Format, x: Array) -> tuple[Array]:
    """e^x."""
    p, k = _reduced_exp(form, x)
    p += 1
    return (_times_power_of_2(form, p, k),)


def expm1(form: Format, x: Array) -> tuple[Array]:
    """e^x - 1."""
    p, k = _reduced_exp(form, x)
    # 2^k (1 + r) - 1 = 2 (2^(k-1) r + (2^(k-1) - 1/2)): 2^k itself may be infinite.
    k -= 1
    scale = _times_power_of_2(form, np.ones_like(p), k)
    p *= scale
    scale -= 0.5
    p += scale
    p *= 2
    return (p,)


def log(form: Format, x: Array) -> tuple[Array]:
    """log(x)."""
    return (_log_and_rest(form, x, None),)


def log1p(form: Format, x: Array) -> tuple[Array]:
    """log(1 + x)."""
    u = x + 1
    rest = u - 1
    np.subtract(x, rest, out=rest)  # what the sum left out
    rest /= u
    return (_log_and_rest(form, u, rest),)


def _log_and_rest(form: Format, x: Array, rest: Array | None) -> Array:
    """log(x) + rest: with f = m - 1, x = m 2^k, sqrt(1/2) <= m < sqrt(2), and s = f / (2 + f)
    log(m) = f - (f^2 / 2 - s (f^2 / 2 + s^2 P(s^2)))."""
    odd = None if x.min(initial=1) >= form.tiny and x.max(initial=1) < np.inf else x
    if odd is not None:
        small = (x > 0) & (x < form.tiny)
        x = np.where(small, x * 2.0**UP, np.where((x > 0) & (x < np.inf), x, form.number(1)))
    bits: Array = x.view(form.integer)
    exponent = bits - form.bits[2]
    exponent >>= form.mantissa
    f = (bits - (exponent << form.mantissa)).view(form.number)
    f -= 1
    exponent += form.bits[0]
    k: Array = exponent.view(form.number)
    k -= form.whole
    if odd is not None:
        k[small] -= UP
    s = f / (f + 2)
    z = s * s
    p = _polynomial(z, form.logarithm)
    p *= z
    half = f * 0.5
    half *= f
    p += half
    p *= s
    p += k * form.log_2[1]
    if rest is not None:
        p += rest
    half -= p
    f -= half
    k *= form.log_2[0]
    k += f
    if odd is not None:
        k[~(odd >= 0)] = np.nan
        k[odd == 0] = -np.inf
        k[odd == np.inf] = np.inf
    return k


def power(form: Format, x: Array, y: Array) -> tuple[Array]:
    """x^y."""
    exponent = _log_and_rest(form, np.abs(x), None)
    exponent *= y
    result = exp(form, exponent)[0]
    if x.min(initial=1) > 0 and max(x.max(initial=1), y.max(initial=0), -y.min(initial=0)) < np.inf:
        return (result,)
    odd = np.abs(np.fmod(y, 2)) == 1
    result = np.where(odd, np.copysign(result, x), result)
    result = np.where((x < 0) & (x > -np.inf) & (np.floor(y) != y), np.nan, result)
    return (np.where((y == 0) | (x == 1) | ((x == -1) & np.isinf(y)), 1.0, result),)


# ------------------------------------------------------------------------------------------------ angles


def sincos(form: Format, x: Array) -> tuple[Array, Array]:
    """Sine and cosine of x radians."""
    if not (x.max(initial=0) < form.most and x.min(initial=0) > -form.most):
        return _sincos_of_any(form, x)
    k = x * TWO_OVER_PI
    k += form.whole
    whole = k - form.whole
    for part in form.half_pi:
        x -= whole * part
    sine, cosine = sincos_near_0(form, x)
    # In odd quarters they change places; the sine is negative in quarters 2 and 3, the cosine in 1 and 2.
    quarter: Array = k.view(form.integer)
    s: Array = sine.view(form.integer)
    c: Array = cosine.view(form.integer)
    _swap(-(quarter & 1), s, c)
    for row in (s, c):
        turned = quarter << form.quarter
        turned &= form.sign
        row ^= turned
        quarter += 1
    return sine, cosine


def sincos_near_0(form: Format, x: Array) -> tuple[Array, Array]:
    """The same of |x| <= pi / 4."""
    z = x * x
    sine = _polynomial(z, form.sine)
    sine *= z
    sine *= x
    sine += x
    cosine = _polynomial(z, form.cosine)
    cosine *= z
    cosine -= 0.5
    cosine *= z
    cosine += 1
    return sine, cosine


def _sincos_of_any(form: Format, x: Array) -> tuple[Array, Array]:
    """Of angles some of which are large."""
    far = ~(np.abs(x) < form.most)
    large = x[far].astype(np.float64)
    sine, cosine = sincos(form, np.where(far, form.number(0), x))
    if form is LONG:
        large = np.fmod(large, TURN)
        large[~np.isfinite(large)] = np.nan
        sine[far], cosine[far] = np.nan, np.nan
        there = ~np.isnan(large)
        far[far] = there
        large = large[there]
    if len(large):
        sine[far], cosine[far] = sincos(LONG, large)
    return sine, cosine


def arctan2(form: Format, y: Array, x: Array) -> tuple[Array]:
    """The angle of the point (x, y)."""
    a, b = np.abs(x), np.abs(y)
    low, high = np.minimum(a, b), np.maximum(a, b)
    if not (high.min(initial=1) > 0 and high.max(initial=1) < form.huge):
        endless, large, one = high == np.inf, high >= form.huge, form.number(1)
        low = np.where(endless, (low == np.inf).astype(form.number), np.where(large, low * 2.0**-UP, low))
        high = np.where(endless | (high == 0), one, np.where(large, high * 2.0**-UP, high))
    # atan(q) = pi / 4 + atan((q - 1) / (q + 1)): for q > tan(pi / 8).
    steep: Array = (low > high * TAN_PI_8).astype(form.number)
    t = steep * high
    np.subtract(low, t, out=t)
    low *= steep
    high += low
    t /= high
    z = t * t
    angle = _polynomial(z, form.arctangent)
    angle *= z
    angle *= t
    angle += t
    steep *= form.pi[0] / 4
    angle += steep
    # pi / 2 - angle above the diagonal, then pi - angle on the left.
    for half, where in ((0.5, b > a), (1.0, np.signbit(x))):
        there: Array = where.astype(form.number)
        angle *= 1 - 2 * there
        angle += there * (form.pi[1] * half)
        there *= form.pi[0] * half
        angle += there
    return (np.copysign(angle, y),)


def swap(where: NDArray[np.bool_], a: Array, b: Array) -> None:
    """Let numbers of two arrays (n,) of one dtype change places, in place. To choose between two takes three times as
    long."""
    form = SHORT if a.dtype == np.float32 else LONG
    _swap(-where.astype(form.integer), a.view(form.integer), b.view(form.integer))


def _swap(where: Array, a: Array, b: Array) -> None:
    """The same of integers; where: -1 or 0."""
    where &= a ^ b
    a ^= where
    b ^= where
