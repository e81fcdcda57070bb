# SPDX-License-Identifier: GPL-3.0-or-later
"""Where an error sits: along the edges of objects, which supersampling is for, or inside them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32
from ...tracer import CompiledScene
from ...tracer.core.camera import generate_rays
from ...tracer.core.stats import Stats

Bools = NDArray[np.bool_]

REGIONS = ("interior", "edges", "all")


def object_ids(scene: CompiledScene) -> NDArray[np.int32]:
    """Number (h, w) of the object in the middle of each pixel, -1 for none."""
    x0, y0, x1, y1 = scene.camera.window
    y, x = np.mgrid[y0:y1, x0:x1] + 0.5
    geometry = scene.geometry
    rays = generate_rays(scene.camera, x.ravel(), y.ravel(), geometry.center, geometry.bounds_radius)
    hits = scene.seen_by_camera.nearest(*rays[:2], Stats())
    number = np.where(hits.prim >= 0, geometry.object.take(hits.prim, mode="wrap"), -1)
    return number.reshape(y1 - y0, x1 - x0).astype(np.int32)


def regions(ids: NDArray[np.int32], mask: Float32) -> dict[str, Bools]:
    """Masked pixels (h, w): all, edges (another object among the eight neighbours, or part of the mask), the rest."""
    everything = mask > 0
    padded = np.pad(ids, 1, mode="edge")
    h, w = ids.shape
    edges = mask < 1
    for dy in range(3):
        for dx in range(3):
            edges = edges | (padded[dy : dy + h, dx : dx + w] != ids)
    return {"interior": everything & ~edges, "edges": everything & edges, "all": everything}
