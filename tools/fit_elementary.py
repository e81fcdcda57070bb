# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits the polynomials of hybrid_addon/procedural/elementary.py.

    python -m tools.fit_elementary

prints them, and how far each is off, over the value of its function. A polynomial goes through the exact values at the
zeros of a Chebyshev polynomial: its largest error is then within a factor of two of the smallest there is. The numbers
have 50 digits until they are rounded to float64; the errors printed are those of the rounded coefficients.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal, getcontext

getcontext().prec = 50

Function = Callable[[Decimal], Decimal]

PI = Decimal("3.14159265358979323846264338327950288419716939937510582")
NOTHING = Decimal(10) ** -45
CHECKED = 400
"""Places at which the error is looked at."""


def series(x: Decimal, first: Decimal, next_term: Callable[[Decimal, int], Decimal]) -> Decimal:
    """Sum of a series in x, of terms 0, 1, ..., each made from the one before."""
    total = term = first
    k = 0
    while abs(term) > NOTHING * abs(total):
        k += 1
        term = next_term(term, k)
        total += term
    return total


def sin(x: Decimal) -> Decimal:
    """Taylor's series, for |x| < 4."""
    return series(x, x, lambda term, k: -term * x * x / (2 * k * (2 * k + 1)))


def cos(x: Decimal) -> Decimal:
    """Taylor's series, for |x| < 4."""
    return series(x, Decimal(1), lambda term, k: -term * x * x / (2 * k * (2 * k - 1)))


def atan(x: Decimal) -> Decimal:
    """Euler's series, for |x| <= 1."""
    y = x * x / (1 + x * x)
    return series(y, x / (1 + x * x), lambda term, k: term * y * 2 * k / (2 * k + 1))


def log_of_ratio(s: Decimal) -> Decimal:
    """log((1 + s) / (1 - s))."""
    return ((1 + s) / (1 - s)).ln()


# What the polynomial stands for, as a function of its variable; the function whose value its error is over; what the
# polynomial is multiplied by there; the interval; how many coefficients for float32 results and for float64 ones.
FITS: dict[str, tuple[Function, Function, Function, tuple[Decimal, Decimal], tuple[int, int]]] = {
    # sin(r) = r + r z P(z), z = r^2, |r| <= pi / 4
    "SINE": (
        lambda z: (sin(z.sqrt()) / z.sqrt() - 1) / z, lambda z: sin(z.sqrt()), lambda z: z * z.sqrt(),
        (Decimal(0), PI * PI / 16), (3, 6),
    ),
    # cos(r) = 1 - z / 2 + z^2 P(z), z = r^2, |r| <= pi / 4
    "COSINE": (
        lambda z: (cos(z.sqrt()) - 1 + z / 2) / (z * z), lambda z: cos(z.sqrt()), lambda z: z * z,
        (Decimal(0), PI * PI / 16), (3, 6),
    ),
    # exp(r) = 1 + r + r^2 P(r), |r| <= log(2) / 2
    "EXPONENTIAL": (
        lambda r: series(r, Decimal("0.5"), lambda term, k: term * r / (k + 2)), lambda r: r.exp(), lambda r: r * r,
        (-Decimal(2).ln() / 2, Decimal(2).ln() / 2), (5, 10),
    ),
    # log((1 + s) / (1 - s)) = 2 s + s z P(z), z = s^2, |s| <= (sqrt(2) - 1) / (sqrt(2) + 1)
    "LOGARITHM": (
        lambda z: (log_of_ratio(z.sqrt()) / z.sqrt() - 2) / z, lambda z: log_of_ratio(z.sqrt()),
        lambda z: z * z.sqrt(), (Decimal(0), (3 - Decimal(8).sqrt()) ** 2), (3, 7),
    ),
    # atan(t) = t + t z P(z), z = t^2, |t| <= tan(pi / 8)
    "ARCTANGENT": (
        lambda z: (atan(z.sqrt()) / z.sqrt() - 1) / z, lambda z: atan(z.sqrt()), lambda z: z * z.sqrt(),
        (Decimal(0), (Decimal(2).sqrt() - 1) ** 2), (5, 12),
    ),
}  # fmt: skip


def fitted(function: Function, interval: tuple[Decimal, Decimal], count: int) -> list[float]:
    """Coefficients, that of the highest power first: Newton's interpolation, multiplied out."""
    low, high = interval
    x = [(low + high) / 2 + (high - low) / 2 * cos(PI * (2 * i + 1) / (2 * count)) for i in range(count)]
    divided = [function(place) for place in x]
    for level in range(1, count):
        for i in range(count - 1, level - 1, -1):
            divided[i] = (divided[i] - divided[i - 1]) / (x[i] - x[i - level])
    powers = [divided[-1]]
    for i in range(count - 2, -1, -1):
        moved = [*powers, Decimal(0)]
        powers = [a - x[i] * b for a, b in zip(moved, [Decimal(0), *powers], strict=True)]
        powers[-1] += divided[i]
    return [float(p) for p in powers]


def error(name: str, coefficients: list[float]) -> float:
    """The largest error over the function's value."""
    function, value, weight, (low, high), _ = FITS[name]
    worst = Decimal(0)
    for i in range(CHECKED):
        x = low + (high - low) * (i + Decimal("0.5")) / CHECKED
        found = Decimal(0)
        for c in coefficients:
            found = found * x + Decimal(c)
        worst = max(worst, abs((found - function(x)) * weight(x) / value(x)))
    return float(worst)


def parts(value: Decimal, bits: int, count: int) -> list[float]:
    """A number as a sum of `count` float64: of so many bits each, the last of all of them."""
    found: list[float] = []
    for _ in range(count - 1):
        step = Decimal(2) ** ((value.ln() / Decimal(2).ln()).to_integral_value(rounding="ROUND_FLOOR") - bits + 1)
        found.append(float((value / step).to_integral_value(rounding="ROUND_FLOOR") * step))
        value -= Decimal(found[-1])
    return [*found, float(value)]


def main() -> None:
    """Print all of it."""
    for name, (function, _, _, interval, counts) in FITS.items():
        for kind, count in zip(("float32", "float64"), counts, strict=True):
            coefficients = fitted(function, interval, count)
            print(f"{name}, {kind}: error {error(name, coefficients):.1e}")
            print("   ", ", ".join(map(repr, coefficients)))
    print("pi / 2:", parts(PI / 2, 11, 4), parts(PI / 2, 33, 3), "2 / pi:", float(2 / PI))
    print(
        "log(2):",
        parts(Decimal(2).ln(), 15, 2),
        parts(Decimal(2).ln(), 33, 2),
        "1 / log(2):",
        float(1 / Decimal(2).ln()),
    )
    print("tan(pi / 8):", float(Decimal(2).sqrt() - 1), "pi:", parts(PI, 24, 2), parts(PI, 53, 2))


if __name__ == "__main__":
    main()
