# SPDX-License-Identifier: GPL-3.0-or-later
"""How much light is missing because rays ended early, and where: what a warning is made of.

Counted, not mapped: of samples, how many have lost more than ENDED of their light, and of objects, how much of the
throughput ended at each. All in whole numbers, so that it does not matter who counted what.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64
from ..core.constants import ENDED
from ..core.stats import Stats
from .samples import SampleBuffer

UNIT = 2.0**-20
MOST = 2.0**20
AT = "ended_at_"


def in_units(weight: Float32 | Float64) -> NDArray[np.int64]:
    """Numbers (n,) in whole units; of what is not finite none."""
    sound = np.nan_to_num(weight.astype(np.float64), posinf=0.0, neginf=0.0)
    return np.rint(np.clip(sound, 0, MOST) / UNIT).astype(np.int64)


def count_ended(place: NDArray[np.intp], weight: Float32, stats: Stats) -> None:
    """Count throughput (n,) of rays that ended at objects (n,), with bounces left to go."""
    objects, inverse = np.unique(place, return_inverse=True)
    total = np.zeros(len(objects), np.int64)
    np.add.at(total, inverse.reshape(-1), in_units(weight))
    for number, units in zip(objects.tolist(), total.tolist(), strict=True):
        stats.add(f"{AT}{number}", units)


def count_samples(sample_buffer: SampleBuffer, stats: Stats) -> None:
    """Count the samples of a tile, those that lost much, and what all of them brought and lost."""
    seen = sample_buffer.seen > 0
    lost = np.minimum(sample_buffer.residual - sample_buffer.stood_for, 1.0)[seen]
    stats.add("samples_seen", len(lost))
    stats.add("samples_ended", np.count_nonzero(lost > ENDED))
    stats.add("light_lost", in_units(lost[lost > ENDED]).sum())
    stats.add("light_kept", in_units(1 - lost).sum())
    stats.add("light_found", in_units(sample_buffer.radiance[:, seen].mean(axis=0)).sum())


COUNTERS = ("samples_seen", "samples_ended", "light_lost", "light_kept", "light_found", "lost_to_cutoff")


def found(stats: Stats) -> dict[str, object]:
    """What was counted, as `Film.ended` says it."""
    seen, kept, ended = (stats.counts[name] for name in ("samples_seen", "light_kept", "samples_ended"))
    at = {int(name.removeprefix(AT)): n * UNIT for name, n in stats.counts.items() if name.startswith(AT) and n}
    return {
        "least": ENDED,
        "share": ended / max(seen, 1),
        "lost": stats.counts["light_lost"] * UNIT / max(ended, 1),
        "around": stats.counts["light_found"] / kept if kept else 1.0,
        "cutoff": stats.counts["lost_to_cutoff"] * UNIT,
        "objects": at,
    }


def forget(stats: Stats) -> None:
    """Begin anew."""
    for name in [name for name in stats.counts if name in COUNTERS or name.startswith(AT)]:
        del stats.counts[name]
