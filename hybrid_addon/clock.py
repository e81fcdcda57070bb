# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds: how long something took, and how much of the processors, whichever process used them."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

_elsewhere = [0.0]


def processor_seconds() -> float:
    """What all threads of this process have used so far, and the processes that it forked, for what they have done."""
    return time.process_time() + _elsewhere[0]


def used_elsewhere(seconds: float) -> None:
    """A forked process has used so many for what it was asked to do."""
    _elsewhere[0] += seconds


@dataclass
class Clock:
    """Wall and processor seconds since it was made."""

    wall: float = field(default_factory=time.perf_counter)
    cpu: float = field(default_factory=processor_seconds)

    def read(self) -> dict[str, float]:
        """{"wall": s, "cpu": s}."""
        return {"wall": time.perf_counter() - self.wall, "cpu": processor_seconds() - self.cpu}
