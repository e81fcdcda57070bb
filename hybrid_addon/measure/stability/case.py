# SPDX-License-Identifier: GPL-3.0-or-later
"""What a case of the stability table is: a measured number, the right answer, and a tolerance that decides."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from ...scene import Float32


@dataclass(frozen=True, eq=False)
class Measured:
    """What a case found.

    value   : the number that is compared with the tolerance; its unit is the case's.
    detail  : what else a reader may want to know, one line.
    picture : (h, w, 3) float32, linear, bottom row first, or None: shown on the page where it helps.
    """

    value: float
    detail: str = ""
    picture: Float32 | None = None


@dataclass(frozen=True, eq=False)
class Result:
    """The outcome of one case: passed means finite and within the tolerance. `seconds` is wall time."""

    value: float
    passed: bool
    detail: str
    picture: Float32 | None
    seconds: float


@dataclass(frozen=True, eq=False)
class Case:
    """One line of the table.

    number    : of the situation it belongs to (SITUATIONS).
    name      : unique slug.   theme : heading under which it stands.
    what      : the situation, `answer` : the right answer, both as text.
    tolerance : the largest value that passes, in `unit`.
    measure   : does the work; an exception counts as a failure that says so.
    """

    number: int
    name: str
    theme: str
    what: str
    answer: str
    tolerance: float
    unit: str
    measure: Callable[[], Measured]

    def run(self) -> Result:
        """Measure, and compare with the tolerance."""
        began = time.perf_counter()
        try:
            found = self.measure()
        except Exception as error:  # the table goes on: a case that cannot be measured has not passed
            found = Measured(math.nan, f"{type(error).__name__}: {error}")
        value = float(found.value)
        passed = math.isfinite(value) and value <= self.tolerance
        return Result(value, passed, found.detail, found.picture, time.perf_counter() - began)


class Theme:
    """Collects the cases of one file: `@theme.case(...)` over a function that measures."""

    def __init__(self, title: str) -> None:
        self.title = title
        self.cases: list[Case] = []

    def case(
        self, number: int, name: str, what: str, answer: str, tolerance: float, unit: str = "radiance"
    ) -> Callable[[Callable[[], Measured]], Callable[[], Measured]]:
        """Register the function below as a case; see `Case` for the arguments."""

        def register(measure: Callable[[], Measured]) -> Callable[[], Measured]:
            self.cases.append(Case(number, name, self.title, what, answer, tolerance, unit, measure))
            return measure

        return register
