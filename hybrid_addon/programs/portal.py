# SPDX-License-Identifier: GPL-3.0-or-later
"""Portal: a window to another place. What falls in comes out at another camera, turned and shifted as that is.

A ray that goes through the object's local -Z leaves the camera along its own -Z, so somebody who looks straight at a
plane's upper side sees what the camera sees.
"""

from __future__ import annotations

import numpy as np

from ..scene.programs import SurfaceAnswer, SurfaceHits


def hit(hits: SurfaceHits) -> SurfaceAnswer:
    """Custom property: "camera", a pointer to any object. Without it: the object's own material."""
    target = hits.values.get("camera")
    if target is None or np.shape(target) != (4, 4):
        return SurfaceAnswer(material=1.0)
    here, there = _unscaled(hits.object_matrix), _unscaled(np.asarray(target, np.float64))
    turn = there[:3, :3] @ here[:3, :3].T
    local = hits.point - here[:3, 3:]
    return SurfaceAnswer(transmission=1.0, transmitted=turn @ -hits.wo, origin=turn @ local + there[:3, 3:])


def _unscaled(matrix: np.ndarray) -> np.ndarray:
    """The matrix with columns of length 1."""
    result = matrix.copy()
    length = np.linalg.norm(matrix[:3, :3], axis=0)
    result[:3, :3] /= np.where(length > 0, length, 1.0)
    return result
