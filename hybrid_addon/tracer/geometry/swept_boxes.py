"""Boxes that move and grow evenly: where rays can be that go from one box to another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene import Float64

Bools = NDArray[np.bool_]

OUTWARD = np.array([[-1.0], [1.0]])
"""By which the low and the high corner of a box move when it grows."""


@dataclass(frozen=True, eq=False)
class SweptBoxes:
    """Where rays can be: in boxes (b, 2, 3) that move with speeds (b, 2, 3) of their two corners, from 0 to `until`.

    Of rays from one box to another that is exactly the convex hull of both.
    """

    boxes: Float64
    speeds: Float64
    until: float

    def touch(self, others: Float64) -> Bools:
        """(b, k) which other boxes (k, 2, 3) each of them touches."""
        shape = len(self.boxes), len(others)
        begin, end = np.zeros(shape), np.full(shape, self.until)
        (low, high), (low_speed, high_speed) = self.boxes.transpose(1, 2, 0), self.speeds.transpose(1, 2, 0)
        with np.errstate(all="ignore"):  # boxes may be infinite
            for axis in range(3):
                _narrow(begin, end, low_speed[axis, :, None], others[:, 1, axis] - low[axis, :, None])
                _narrow(begin, end, -high_speed[axis, :, None], high[axis, :, None] - others[:, 0, axis])
        return begin <= end


def _narrow(begin: Float64, end: Float64, speed: Float64, room: Float64) -> None:
    """Cut times (b, k) down to those when speed (b, 1) times the time is at most the room (b, k)."""
    time = room / speed
    np.copyto(end, np.minimum(end, time), where=speed > 0)
    np.copyto(begin, np.maximum(begin, time), where=speed < 0)
    np.copyto(end, -np.inf, where=(speed == 0) & (room < 0))
