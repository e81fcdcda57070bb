# SPDX-License-Identifier: GPL-3.0-or-later
"""AOVs that are data: what a pixel's centre shows, as Blender's own Depth and Normal passes do: nothing is filtered.

They have camera rays of their own, one a pixel: the picture is the same with them and without.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32
from ..core.constants import NO_DEPTH
from ..core.stats import Stats
from ..core.vectors import select
from ..film.filter import grow, reach_of_centres
from ..prepare.compiled import CompiledScene
from ..shading.closures import closures_at
from ..shading.interaction import interact
from .tiles import Pixels


def seen_through(scene: CompiledScene, stats: Stats) -> NDArray[np.bool_]:
    """(h, w) of the camera's window: pixels in whose filter a ray traced surface may be that one sees straight through.

    One ray goes through the centre of each pixel.
    """
    x0, y0, x1, y1 = scene.camera.window
    shape = y1 - y0, x1 - x0
    result = np.zeros(shape[0] * shape[1], bool)
    shows = scene.surfaces.passes_straight[scene.geometry.surface] & scene.geometry.ray_traced
    for start in range(0, len(result) if shows.any() else 0, CHUNK):
        chunk = np.arange(start, min(start + CHUNK, len(result)))
        rays, hits = scene.shown(chunk, stats)
        result[chunk[rays.sample[shows.take(hits.prim)]]] = True
    return grow(result.reshape(shape), reach_of_centres(scene.settings.filter_radius))


CHUNK = 1 << 16
"""Pixels that are worked out at once."""


def depth_and_normal(scene: CompiledScene, pixels: Pixels, stats: Stats) -> dict[str, Float32]:
    """Of the pixels (m,) of the camera's window: {"depth": (h, w), "normal": (h, w, 3)} float32.

    depth  : metres along the view axis to what camera rays are to show, of a panorama along the ray; NO_DEPTH: nothing.
    normal : world space, unit length, on the camera's side; 0 there.
    """
    x0, y0, x1, y1 = scene.camera.window
    depth = np.full((y1 - y0) * (x1 - x0), NO_DEPTH, np.float32)
    normal = np.zeros((len(depth), 3), np.float32)
    axis, eye = np.asarray(scene.camera.matrix_world, np.float64)[:3, 2], scene.camera.matrix_world[:3, 3]
    for start in range(0, len(pixels), CHUNK):
        chunk = pixels[start : start + CHUNK]
        rays, hits = scene.shown(chunk, stats)
        if scene.settings.camera_sees == "RAY_TRACED":
            kept = select(scene.geometry.ray_traced.take(hits.prim))
            rays, hits = rays.take(kept), hits.take(kept)
        at = interact(scene.geometry, scene.surfaces, hits, rays)
        place, from_eye = chunk[rays.sample], at.point + (scene.geometry.center - eye)[:, None]
        depth[place] = (
            -(axis @ from_eye) if scene.camera.panorama is None else np.sqrt((from_eye * from_eye).sum(axis=0))
        )
        normal[place] = at.n_shading.T
        closures = closures_at(scene, rays, at, hits.t)
        if closures.owner is None or closures.weight is None:
            normal[place] = closures.at.n_shading.T
        else:  # that of the heaviest closure
            last = np.argsort(closures.weight.max(axis=0), kind="stable")
            normal[place[closures.owner[last]]] = closures.at.n_shading.T[last]
    return {"depth": depth.reshape(y1 - y0, x1 - x0), "normal": normal.reshape(y1 - y0, x1 - x0, 3)}
