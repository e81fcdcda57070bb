# SPDX-License-Identifier: GPL-3.0-or-later
"""Quality presets: points on the measured front of error against run time, for the panel and for the report."""

from __future__ import annotations

from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Quality:
    """Values of the tracer's settings; the names are those of `scene.hybrid` and of `Settings`.

    Occlusion is none of them: with it another picture is drawn, not a better one.
    """

    samples: int
    max_depth: int
    cutoff: float
    adaptive: float
    rough_samples: int = 1
    shadow_samples: int = 1
    denoise: bool = False  # an estimate, without a bound of its error: to be chosen beside a preset

    def values(self) -> dict[str, float]:
        """Setting -> value."""
        return asdict(self)


# key: (label, tooltip, values)
QUALITY: dict[str, tuple[str, str, Quality]] = {
    "DRAFT": ("Draft", "To look at: edges are a little rough", Quality(4, 8, 1 / 64, 0.0)),
    "FINAL": ("Final", "To deliver: no difference to see", Quality(64, 32, 1 / 64, 0.0, rough_samples=4)),
    "REFERENCE": (
        "Reference",
        "To measure against: nothing is left to chance",
        Quality(256, 64, 1e-3, 0.0, rough_samples=8),
    ),
}
