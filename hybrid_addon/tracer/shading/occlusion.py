# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient occlusion: how much of the world's diffuse light what lies around a point takes away.

Rays leave in directions that are as dense as their cosine, so the share of them that meets nothing is the share of the
light: of a uniform world exactly, of others on the whole. What lets light through takes none away.
"""

from __future__ import annotations

import numpy as np

from ...scene import Float32
from ..core.rays import traceable
from ..core.sampler import disk
from ..core.stats import Stats
from ..core.vectors import Index, dot, flatnonzero, normalize, orthonormal_basis, take
from ..geometry.aggregate import PrimitiveSet
from ..prepare.compiled import CompiledScene
from .interaction import Interaction

DIMENSION = np.uint32(0x6C8E9CF5)
"""Of the sampler."""


def open_share(scene: CompiledScene, occluders: PrimitiveSet, hit: Interaction, index: Index, stats: Stats) -> Float32:
    """Share (m,) of the directions around the hits `index` in which nothing lies within `occlusion_distance`."""
    settings, draws = scene.settings, hit.draws
    assert draws is not None
    origin, n, facing = take(hit.outer, index), take(hit.n_shading, index), take(hit.n_geometric, index)
    draws, tangents = draws.take(index), orthonormal_basis(n)
    limit = np.full(origin.shape[1], settings.occlusion_distance, np.float32)
    seen = np.zeros(origin.shape[1], np.float32)
    for part in range(settings.occlusion_samples):
        x, y = disk(*draws.square(DIMENSION, part, settings.occlusion_samples))
        up = np.sqrt(np.maximum(1 - x * x - y * y, np.float32(0)))
        direction = tangents[0] * x + tangents[1] * y + n * up
        # What a smooth normal sends into its own flat triangle leaves it on the other side.
        direction = normalize(direction - facing * (2 * np.minimum(dot(direction, facing), np.float32(0))))
        sound = flatnonzero(traceable(origin, direction))
        seen += 1
        seen[sound] -= occluders.occluded(origin[:, sound], direction[:, sound], limit[sound], stats)
    stats.add("occlusion", len(seen) * settings.occlusion_samples)
    return seen * np.float32(1 / settings.occlusion_samples)
