# SPDX-License-Identifier: GPL-3.0-or-later
"""X-Ray: rays go straight through, and each metre of the inside takes its share (Beer-Lambert).

A closed body is dark where it is thick. Its inside is what lies between an outer side and the next hit of an inner one.
"""

from __future__ import annotations

import numpy as np

from ..scene.programs import SurfaceAnswer, SurfaceHits

DENSITY = 1.0


def hit(hits: SurfaceHits) -> SurfaceAnswer:
    """Custom property: "density", 1/m."""
    return SurfaceAnswer(transmission=_left(hits))


def shadow(hits: SurfaceHits) -> np.ndarray:
    """All of it on the way in, and what the inside leaves on the way out. Of shadow rays `distance` is from the last
    surface, too."""
    return _left(hits)


def _left(hits: SurfaceHits) -> np.ndarray:
    density = max(float(hits.values.get("density", DENSITY)), 0.0)
    return np.where(hits.entering, 1.0, np.exp(-density * hits.distance))
