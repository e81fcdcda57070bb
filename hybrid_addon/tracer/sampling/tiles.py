# SPDX-License-Identifier: GPL-3.0-or-later
"""How the pixels of a pass are dealt out: in tiles, each of them what one thread or process traces at once.

A tile is many short runs of pixels from all over the strip, so that all tiles cost about the same.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.intp]

WORTH_IT = 0.03
"""Seconds of one thread's work, below which starting processes, some milliseconds each, and copying what they touch
cost too much."""

FIRST_GUESS, OF_GLASS = 1e6, 2e5
"""Camera rays a second of one thread, before any were traced; where rays are refracted each becomes many."""

LONGEST_TILE = 1 << 20
"""Camera rays of a tile: the sums of their samples take 80 bytes each, and share 64 bits with their budgets."""

SMALLEST_TILE, SHORTEST = 1 << 13, 0.02
"""Small pictures are split evenly over the processes, but not into fewer camera rays than pay for a wave's overhead:
so many, or of those that become many rays what takes so many seconds."""

FOR_A_THREAD = 1 << 16
"""The same for threads: two with half as many each take up to 1.8 times as long as one with all. They hand the
interpreter lock over at every call, and the waves at the end of a tile are many short calls."""

SHORT_TILE = 1 << 14
"""Camera rays that are taken at once at least against a deadline: what is not done by then is lost."""

SHARE_AT_RISK = 0.25
"""Of the time that is left, what a tile may take: short ones would cost more than is lost of long ones, up to three
times the time."""

TILES, EVEN_TILE = 4, 1 << 17
"""For each of many processes, and of so many camera rays: the slowest decides, and of 16 equal tiles one takes half as
long again as another. Few processes are even, and lose more to the short waves at the end of each tile."""

MANY = 4
"""Processes that are more than a few."""

TURN = 0.618
"""Of the tiles, by how much each deal is turned against the last."""

RUNS = 32
"""For each tile: from so many places of the picture at least."""

WORTH_GROWING = 3.0
"""Seconds that a picture takes by the guess above, from which on it begins coarse if somebody looks on. The guess is of
what is cheap: such pictures take longer."""

DEAREST_SHOW = 0.02
"""Of the time, what may go into showing more of a picture: into waves of few rays at the end of what is traced at once.
The first coarse raster, which is little else, tells how long these take."""


def guessed_speed(refracts: bool) -> float:
    """Camera rays a second of one thread, before any were traced."""
    return OF_GLASS if refracts else FIRST_GUESS


def pays_for_processes(n: int, speed: float) -> bool:
    """Whether n camera rays are worth starting processes, if one traces `speed` a second."""
    return n >= WORTH_IT * speed


def longest_tile(left: float, speed: float) -> int:
    """Camera rays of a tile at most, with so many seconds left, and `speed` traced in one; 0: not known yet."""
    if left == math.inf:
        return LONGEST_TILE
    return int(min(max(SHARE_AT_RISK * max(left, 0.0) * speed, SHORT_TILE), LONGEST_TILE))


def smallest_tile(forked: bool, speed: float) -> int:
    """Camera rays of a tile at least, traced by a process or by a thread."""
    return min(SMALLEST_TILE, int(SHORTEST * speed) + 1) if forked else FOR_A_THREAD


def deal(pixels: Pixels, count: int, workers: int, longest: int, smallest: int) -> list[Pixels]:
    """Pixels with `count` samples each, dealt out to tiles of `smallest` to `longest` samples for so many workers."""
    # How many tiles: as the limits allow, and in whole rounds, or some workers would wait for the others' last.
    n = len(pixels) * count
    each = min(max(n // (workers * EVEN_TILE), 1), TILES) if workers > MANY else 1
    wanted = max(-(-n // longest), min(each * workers if workers > 1 else 1, n // smallest))
    if wanted > workers:
        wanted = -(-wanted // workers) * workers
    number = max(1, min(wanted, len(pixels)))
    if number == 1:
        return [pixels] if len(pixels) else []
    # Each deal gives every tile one run of pixels.
    run = max(1, len(pixels) // (number * RUNS))
    whole = len(pixels) // (number * run) * (number * run)
    deals, rest = pixels[:whole].reshape(-1, number, run), pixels[whole:]
    # A deal may be so many rows of the picture: it begins with another tile each time, or they would be columns.
    deal, turn = np.arange(len(deals)), int(number * TURN) | 1
    return [
        np.concatenate([deals[deal, (k + deal * turn) % number].reshape(-1), rest[k * run : (k + 1) * run]])
        for k in range(number)
    ]
