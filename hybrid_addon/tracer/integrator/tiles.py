# SPDX-License-Identifier: GPL-3.0-or-later
"""Tiles: whole wave loops of some samples in one compiled function, where a scene has nothing that it cannot do.

It draws the picture of the waves (`whitted`) to the last bit, holds no lock meanwhile, and is asked for as many samples
at once as may pass between two looks at whether somebody wants it to stop.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accelerated import ALL, accelerated
from ...scene import Float64
from ..core.sampler import Sampler
from ..core.stats import Stats
from ..film.ended_rays import AT
from ..film.path_hash import Identities
from ..film.samples import SampleBuffer, wanted_aovs
from ..geometry.aggregate import PrimitiveSet
from ..kernels.tiles import records as of
from ..kernels.tiles.apart import ask_for
from ..prepare.compiled import CompiledScene
from .tile_obstacles import why_not
from .tile_records import TileScene, records_of

AT_ONCE = 1 << 15
"""Camera rays between two looks: some hundredths of a second."""


@accelerated
def trace_tiles(
    scene: of.Scene,
    pixels: of.Pixels,
    first: int,
    start: int,
    stop: int,
    buffer: of.Buffer,
    ended: Any,
    counters: Any,
) -> bool:
    """Trace samples first, first + 1, ... of the pixels start .. stop and add what they find to a buffer; whether that
    is done: without its kernel it is not.

    ended    : int64, throughput that ended at each object, in units.
    counters : int64, what is counted is added, in the order of `records.COUNTERS`.
    """
    return False


NAME = "tracer.integrator.tiles.trace_tiles"


def is_ready() -> bool:
    """Whether the kernel is there."""
    return ALL[NAME].kernel is not None


def tiles_of(scene: CompiledScene, seen: PrimitiveSet, identity: Identities | None) -> TileScene | None:
    """A scene as tiles see it whose camera rays see `seen`; None: it is for the waves."""
    if why_not(scene, seen, wanted_aovs(scene.settings)):
        return None
    if not is_ready():
        ask_for(NAME)
        return None
    return records_of(scene, seen, identity)


def trace_samples(
    tiles: TileScene,
    at: tuple[Any, Any],
    places: tuple[Float64, Float64],
    sampler: Sampler,
    sample_buffer: SampleBuffer,
    stats: Stats,
    check: Callable[[], None],
    begun: NDArray[np.int64],
) -> bool:
    """Trace all samples of a buffer by tiles, as `whitted.trace_rays` does in waves; False: the kernel has failed, and
    the buffer is worth nothing.

    at : x and y of the pixels (m,) of the sampler.   places : (count,) of samples in each.
    check : called now and then; raises to stop.   begun : (1,) where to note how many samples there are so far.
    """
    x, y = (np.ascontiguousarray(a, np.int64) for a in at)
    pixels, count = of.Pixels(sampler.pixels, x, y, *places), sample_buffer.count
    buffer, counters = _buffer(sample_buffer), np.zeros(len(of.COUNTERS), np.int64)
    ended = np.zeros(int(tiles.scene.rules.whole[of.OBJECTS]), np.int64)
    step = max(AT_ONCE // count, 1)
    for start in range(0, len(x), step):
        check()
        stop = min(start + step, len(x))
        if not trace_tiles(tiles.scene, pixels, sampler.first, start, stop, buffer, ended, counters):
            return False
        begun += (stop - start) * count
    for name, number in zip(of.COUNTERS, counters.tolist(), strict=True):
        stats.add(name, number)
    for number in np.flatnonzero(ended).tolist():
        stats.add(f"{AT}{number}", ended[number])
    return True


def _buffer(sums: SampleBuffer) -> of.Buffer:
    n = len(sums.seen)
    budget, nothing = sums.budget, np.zeros(n, np.int64)
    return of.Buffer(
        sums.radiance, sums.seen, sums.residual, sums.stood_for,
        nothing if budget is None else budget.spent, nothing if budget is None else budget.unlit, sums.scratch,
        sums.followed, sums.generation,
        np.zeros(0, np.uint32) if sums.signatures is None else sums.signatures.values,
    )  # fmt: skip
