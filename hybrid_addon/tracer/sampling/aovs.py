"""Data passes: what a pixel's centre shows, as Blender's own Depth and Normal passes do: nothing is filtered.

They have camera rays of their own, one a pixel: the picture is the same with them and without.
"""

from __future__ import annotations

import numpy as np

from ...scene import Float32
from ..core.camera import generate_rays
from ..core.constants import NO_DEPTH
from ..core.rays import camera_rays, traceable
from ..core.stats import Stats
from ..core.vectors import select, take
from ..geometry.aggregate import Hits
from ..prepare.compiled import CompiledScene
from ..shading.evaluate import resolve
from ..shading.interaction import Interaction, interact
from .passes import Pixels

BAND = 1 << 16
"""Pixels that are worked out at once."""


def depth_and_normal(scene: CompiledScene, pixels: Pixels, stats: Stats) -> dict[str, Float32]:
    """Of the pixels (m,) of the camera's window: {"depth": (h, w), "normal": (h, w, 3)} float32.

    depth  : metres along the view axis to what camera rays are to show; NO_DEPTH where they show nothing.
    normal : world space, unit length, on the camera's side; 0 there.
    """
    x0, y0, x1, y1 = scene.camera.window
    depth = np.full((y1 - y0) * (x1 - x0), NO_DEPTH, np.float32)
    normal = np.zeros((len(depth), 3), np.float32)
    axis, eye = np.asarray(scene.camera.matrix_world, np.float64)[:3, 2], scene.camera.matrix_world[:3, 3]
    for start in range(0, len(pixels), BAND):
        band = pixels[start : start + BAND]
        shown, at = _first_hits(scene, x0 + band % (x1 - x0) + 0.5, y0 + band // (x1 - x0) + 0.5, stats)
        if at is not None:
            from_eye = at.point + (scene.geometry.center - eye)[:, None]
            depth[band[shown]] = -(axis @ from_eye)
            normal[band[shown]] = at.n_shading.T
    return {"depth": depth.reshape(y1 - y0, x1 - x0), "normal": normal.reshape(y1 - y0, x1 - x0, 3)}


def _first_hits(
    scene: CompiledScene, x: np.ndarray, y: np.ndarray, stats: Stats
) -> tuple[np.ndarray, Interaction | None]:
    """Which film positions (m,) show something, and their hits; None if none does."""
    geometry = scene.geometry
    origin, direction, t_max = generate_rays(scene.camera, x, y, geometry.center, geometry.bounds_radius)
    sound = np.flatnonzero(traceable(origin, direction))
    rays = camera_rays(origin, direction, t_max, np.arange(len(x))).take(sound)
    hits: Hits = scene.seen_by_camera.nearest(rays.origin, rays.direction, stats)
    hit = (hits.prim >= 0) & ~(hits.t > rays.t_max)
    if scene.settings.camera_sees == "RAY_TRACED" and hit.any():
        hit &= geometry.ray_traced.take(hits.prim, mode="wrap")
    if not hit.any():
        return sound[:0], None
    chosen = select(hit)
    hits = hits.take(chosen)
    at = interact(geometry, scene.surfaces, hits, rays.take(chosen))
    return take(sound, chosen), resolve(geometry, at, hits.t)
