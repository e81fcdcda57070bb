# SPDX-License-Identifier: GPL-3.0-or-later
"""Toon Glass: clear glass in flat steps, with a dark outline where it turns away from the eye."""

from __future__ import annotations

import numpy as np

from ..scene.programs import SurfaceAnswer, SurfaceHits

TINT = (0.55, 0.85, 1.0)
OUTLINE, RIM = 0.3, 0.55
"""Cosines below which the outside is an outline, and a bright rim."""


def hit(hits: SurfaceHits) -> SurfaceAnswer:
    """Custom properties: "tint" (three numbers), "outline" (a cosine)."""
    tint = np.reshape(np.asarray(hits.values.get("tint", TINT), np.float64)[:3], (3, 1))
    outline = float(hits.values.get("outline", OUTLINE))
    outside, cosine = hits.entering, hits.cosine
    clear = ~outside | (cosine >= outline)
    rim = outside & clear & (cosine < max(RIM, outline))
    return SurfaceAnswer(
        reflection=np.where(rim, 0.6, np.where(outside & clear, 0.05, 0.0)),
        transmission=np.where(clear, np.where(outside, tint, 1.0), 0.0) * np.where(rim, 0.4, 1.0),
    )


def shadow(hits: SurfaceHits) -> np.ndarray:
    """The tint, on the way in, in one step."""
    tint = np.reshape(np.asarray(hits.values.get("tint", TINT), np.float64)[:3], (3, 1))
    return np.where(hits.entering & (hits.cosine >= RIM), tint, np.where(hits.entering, tint * 0.5, 1.0))
