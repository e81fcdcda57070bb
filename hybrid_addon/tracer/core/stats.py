# SPDX-License-Identifier: GPL-3.0-or-later
"""What was counted during some work and how long its phases took; merged by plain sums, so order does not matter."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from typing import SupportsInt


class Stats:
    """Integer counters and phase clocks of one thread's work.

    counts : name -> number (rays by kind, invariants, work that was saved).
    skipped : (what, why) -> number, what was left out. Processes count none.
    wall, cpu : phase -> seconds, exclusive: a phase begun inside another stops the outer clock.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.skipped: Counter[tuple[str, str]] = Counter()
        self.wall: defaultdict[str, float] = defaultdict(float)
        self.cpu: defaultdict[str, float] = defaultdict(float)
        self._open: list[str] = []
        self._since = (0.0, 0.0)

    def add(self, name: str, number: SupportsInt) -> None:
        """Count `number` more of `name`."""
        if int(number):
            self.counts[name] += int(number)

    def skip(self, what: str, why: str, number: int) -> None:
        """Note that `number` of something were left out."""
        if number:
            self.skipped[what, why] += number

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Charge the time inside to `name`, and not to the phase around it."""
        self._lap()
        self._open.append(name)
        try:
            yield
        finally:
            self._lap()
            self._open.pop()

    def _lap(self) -> None:
        now = (time.perf_counter(), time.thread_time())
        if self._open:
            self.wall[self._open[-1]] += now[0] - self._since[0]
            self.cpu[self._open[-1]] += now[1] - self._since[1]
        self._since = now

    def merge(self, other: Stats) -> None:
        """Add what others counted to this."""
        self.counts.update(other.counts)
        self.skipped.update(other.skipped)
        for phase in other.wall:
            self.wall[phase] += other.wall[phase]
            self.cpu[phase] += other.cpu[phase]
