# SPDX-License-Identifier: GPL-3.0-or-later
"""The time that a report has, and its parts."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field

SHARES = {"reference": 0.4, "knobs": 0.12, "points": 0.33, "cycles": 0.15}
"""Of the time. All hangs on the reference; it comes first, with what is drawn and prepared before it."""


class Until:
    """Progress for the tracer that stops it at a time on time.perf_counter's clock. done: the fraction that it did."""

    def __init__(self, until: float) -> None:
        self._until, self.done = until, 0.0

    def __call__(self, done: float) -> bool:
        """Whether to go on."""
        self.done = done
        return time.perf_counter() < self._until


@dataclass
class Budget:
    """Seconds for the parts of a report, one after the other.

    What one leaves over the next ones get; what one takes too much they do not lose, or one slow part would leave
    nothing of a report.   spent : seconds of the parts so far.
    """

    seconds: float
    shares: Mapping[str, float] = field(default_factory=lambda: SHARES)
    spent: dict[str, float] = field(default_factory=dict)
    _part: str = ""
    _began: float = 0.0
    _until: float = 0.0

    def begin(self, part: str) -> float:
        """End the part before, if any; until when this one may take, on time.perf_counter's clock."""
        now = time.perf_counter()
        left_over = max(0.0, self._until - now) if self._part else 0.0
        self.end()
        self._part, self._began = part, now
        self._until = now + self.shares[part] * self.seconds + left_over
        return self._until

    def end(self) -> None:
        """The last part is done."""
        if self._part:
            self.spent[self._part] = time.perf_counter() - self._began
        self._part = ""
