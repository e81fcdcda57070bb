# SPDX-License-Identifier: GPL-3.0-or-later
"""Large pictures are traced strip by strip: what their samples add up to takes memory for one strip alone.

Pixels that share samples with those of the next strip are traced in both, so no pixel shows where a strip ends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..prepare.footprint import LONGEST_STRIP
from .adaptive import upper_limit
from .passes import Progress
from .schedule import Sampling


@dataclass(frozen=True)
class Strip:
    """Rows of a window. Of all pixels to be traced, the shares in it and in those before it."""

    rows: slice
    share: float
    before: float

    def deadline(self, whole: float, now: float) -> float:
        """Until when it may take, if the whole picture may until `whole`: its share of the time that is left."""
        if whole == math.inf or self.share >= 1 - self.before:
            return whole
        return now + (whole - now) * self.share / (1 - self.before)

    def reports(self, progress: Progress | None) -> Progress | None:
        """What to tell how much of the strip is done, if `progress` is told how much of the picture is."""
        return None if progress is None else partial(_reported, progress, self)


def _reported(progress: Progress, strip: Strip, fraction: float) -> bool:
    return progress(strip.before + strip.share * fraction)


def strips_of(width: int, height: int, wanted: NDArray[np.bool_] | None, longest: int | None = None) -> list[Strip]:
    """The strips of a window in which `wanted` (h, w) pixels are traced; None: all.

    longest : pixels to be traced in a strip at most; None: LONGEST_STRIP.
    """
    of_row = np.full(height, width) if wanted is None else np.count_nonzero(wanted, axis=1)
    until = np.concatenate([[0], np.cumsum(of_row)])
    total = max(int(until[-1]), 1)
    number = -(-total // (longest or LONGEST_STRIP))
    cuts = np.searchsorted(until, np.arange(1, number) * (total / number), side="left")
    ends = [0, *np.unique(cuts[(cuts > 0) & (cuts < len(of_row))]).tolist(), len(of_row)]
    return [
        Strip(
            slice(start, stop),
            float(until[stop] - until[start]) / total,
            float(until[start]) / total,
        )
        for start, stop in pairwise(ends)
    ]


def together(strips: Sequence[tuple[int, Sampling]]) -> Sampling:
    """`Film.sampling` of a picture whose strips have so many pixels, and these."""
    known = [strip for strip in strips if strip[0]] or list(strips[:1])
    if len(known) == 1:
        return known[0][1]
    pixels = np.array([n for n, _ in known], np.float64)

    def of_all(name: str) -> list[float]:
        return [float(sampling[name]) for _, sampling in known]  # type: ignore[arg-type]

    unknown = any(sampling["rmse"] is None for _, sampling in known)
    rmse = None if unknown else float(np.sqrt((pixels * np.square(of_all("rmse"))).sum() / pixels.sum()))
    result: Sampling = {
        "samples_mean": float((pixels * of_all("samples_mean")).sum() / pixels.sum()),
        "samples_max": max(int(n) for n in of_all("samples_max")),
        "rmse": rmse,
        "slope": known[0][1]["slope"],
    }
    audits = [sampling["audit"] for _, sampling in known if "audit" in sampling]
    if audits:
        result["audit"] = _audited(audits)  # type: ignore[arg-type]
    return result


def _audited(audits: Sequence[dict[str, float | int]]) -> dict[str, float | int]:
    """What `adaptive.Audit.result` would say of all strips."""
    total = {name: int(sum(audit[name] for audit in audits)) for name in ("pixels", "left_alone", "beyond")}
    mean = sum(audit["error_mean"] * audit["pixels"] for audit in audits) / max(total["pixels"], 1)
    return {
        "pixels": total["pixels"],
        "left_alone": total["left_alone"],
        "error_mean": float(mean),
        "error_max": max(audit["error_max"] for audit in audits),
        "tolerance": audits[0]["tolerance"],
        "beyond": total["beyond"],
        "beyond_share_upper_95": upper_limit(total["beyond"], total["pixels"]),
    }
