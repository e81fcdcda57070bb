# SPDX-License-Identifier: GPL-3.0-or-later
"""What a cloud of (time, error) points says: slopes with their confidence, the Pareto front, times at equal error."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

T_95 = (12.71, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)
"""Student's t for 95 %, two sided, with 1 to 10 degrees of freedom; beyond, 2."""


FASTER, MORE_EXACT, AS_EXACT = 0.9, 0.95, 1.01
"""A point beats another with at most so many times its seconds and an error that is at most 1.01 times its own, or with
so many times its error in no more seconds: times are measured, and come out a little different every time."""

SURE, ENDLESS = 2.0, 99.0
"""Standard errors by which it must do so (95 %), and a logarithm that no ratio reaches."""


@dataclass(frozen=True)
class Slope:
    """A fitted slope, half the width of its 95 % confidence interval (None from two points), and what is expected.

    why : where there is no fit, the reason.
    """

    fit: float | None
    ci: float | None
    expected: float | None = None
    why: str = ""


def slope(x: Sequence[float], y: Sequence[float], expected: float | None = None) -> Slope | None:
    """Least squares through points (x, y); None if they are fewer than two, or all at one x."""
    a, b = np.asarray(x, np.float64), np.asarray(y, np.float64)
    good = np.isfinite(a) & np.isfinite(b)
    a, b = a[good], b[good]
    n = len(a)
    spread = float(np.square(a - a.mean()).sum()) if n else 0.0
    if n < 2 or spread == 0:
        return None
    fit = float(((a - a.mean()) * (b - b.mean())).sum() / spread)
    if n == 2:
        return Slope(fit, None, expected)
    rest = b - b.mean() - fit * (a - a.mean())
    deviation = math.sqrt(float(np.square(rest).sum()) / (n - 2) / spread)
    return Slope(fit, deviation * (T_95[n - 3] if n - 3 < len(T_95) else 2.0), expected)


def power(x: Sequence[float], y: Sequence[float], expected: float | None = None) -> Slope | None:
    """Exponent p of y ~ x^p. Points that are not positive say nothing and are left out."""
    logs = [(math.log10(a), math.log10(b)) for a, b in zip(x, y, strict=True) if a > 0 and b > 0]
    return slope([a for a, _ in logs], [b for _, b in logs], expected)


def decay(x: Sequence[float], y: Sequence[float], expected: float | None = None) -> Slope | None:
    """Decades of y for each step of x, of y ~ 10^(s x)."""
    logs = [(a, math.log10(b)) for a, b in zip(x, y, strict=True) if b > 0]
    return slope([a for a, _ in logs], [b for _, b in logs], expected)


def pareto(time: Sequence[float], error: Sequence[float]) -> list[int]:
    """Indices, by time, of the points that no other point beats: none is as fast and has a smaller error."""
    front: list[int] = []
    for i in sorted(range(len(time)), key=lambda i: (time[i], error[i])):
        if not front or error[i] < error[front[-1]]:
            front.append(i)
    return front


def beaten_by(
    i: int,
    time: Sequence[float],
    error: Sequence[float],
    against: Callable[[int, int], tuple[float, float] | None] | None = None,
) -> int | None:
    """The point that clearly beats point i, by the most (in time, times in error); None: i is on the front.

    against : of two points j and i, how many times the error of i that of j is, and the standard error of the logarithm
    of that, for errors are measured, too; None: as the errors say, without doubt.
    """

    def beats(j: int) -> bool:
        if time[j] > time[i]:
            return False
        known = against(j, i) if against else None
        times, doubt = known or (error[j] / error[i] if error[i] else math.inf, 0.0)
        most = times * math.exp(min(SURE * doubt, ENDLESS))
        return most <= MORE_EXACT or (time[j] <= FASTER * time[i] and most <= AS_EXACT)

    found = [j for j in range(len(time)) if j != i and beats(j)]
    return min(found, key=lambda j: time[j] * error[j], default=None)


def time_to(target: float, time: Sequence[float], error: Sequence[float]) -> float | None:
    """Seconds until an error of `target`, along the front, straight between its points on logarithmic axes.

    None if the front does not reach it; the first point's time if that is there at once.
    """
    front = [(time[i], error[i]) for i in pareto(time, error)]
    for k, (t, e) in enumerate(front):
        if e > target:
            continue
        if k == 0 or e <= 0:
            return t
        t0, e0 = front[k - 1]
        share = math.log(e0 / target) / math.log(e0 / e)
        result: float | None = t0 * (t / t0) ** share
        return result
    return None
