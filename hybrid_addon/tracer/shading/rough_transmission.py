# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps seen through rough glass: the highlight of what refracts light out of a solid.

The lobe is that of a reflection with its mirror direction turned into the refracted one (as in EEVEE), made narrower by
how much less refraction turns a ray than reflection does where a microfacet tilts: a reflected ray by twice the tilt, a
refracted one by |cos_i / (eta cos_t) - 1| times it (Walter et al. 2007, eq. 17, to the first order). Rays that leave by
such a microfacet meet no lamp, so none is counted twice. Within a solid lamps are met by rays alone: those that enter.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import Float32, Float64
from ..core.constants import LEAST_COSINE, MIRROR_ROUGHNESS
from ..core.rays import Rays
from ..core.stats import Stats
from ..core.vectors import ALL, Array, Index, dot, flatnonzero, normalize
from ..emitters.light import CompiledLight
from ..prepare.compiled import CompiledScene
from .interaction import Interaction
from .ltc import Lobe, ggx_lobe
from .scattering import reflect, refract
from .shadows import visibility
from .spawn import share_out


def through_rough_glass(scene: CompiledScene, rays: Rays, at: Interaction, stats: Stats) -> list[tuple[Index, Float32]]:
    """Which of the hits (n,) of rays refract light of lamps out of rough glass, and its radiance (3, m)."""
    lamps = [light for light in scene.lights if light.light.transmission > 0]
    if not lamps or not scene.plan.refraction or scene.settings.rough_samples == 0:
        return []
    index = flatnonzero(at.glows & ~rays.unlit)
    if len(index) == 0:
        return []
    rays, at = rays.take(index), at.take(index)
    split = share_out(scene, replace(rays, throughput=np.ones_like(rays.throughput)), at)
    leaves = flatnonzero(split.bends & (split.transmitted != 0).any(axis=0))
    if len(leaves) == 0:
        return []
    at = at.take(leaves)
    lobe = _lobe(at, split.cos_i[leaves], split.eta[leaves])
    point, outward = at.point.astype(np.float32), -at.n_geometric
    radiance = np.zeros_like(point)
    for lamp in lamps:
        seen = lamp.highlight(point, outward, lobe, at.offset) * np.float32(lamp.light.transmission)
        if lamp.receives is not None:
            seen *= lamp.receives.take(at.prim)
        lit = flatnonzero(seen > 0)
        if len(lit):
            radiance[:, lit] += _seen(scene, at.take(lit), lamp, lamp.color * seen[lit], stats)
    return [(index[leaves], split.transmitted[:, leaves] * radiance)]


def _lobe(at: Interaction, cos_i: Float64, eta: Float64) -> Lobe:
    """The lobes of hits (n,) around the directions in which they refract, of cosine cos_i (n,) and eta (n,)."""
    n = at.n_shading.astype(np.float64)
    out = normalize(refract(at.wo.astype(np.float64), n, cos_i, eta))
    cos_t = np.maximum(-dot(out, n), LEAST_COSINE)
    narrower = np.sqrt(np.minimum(np.abs(cos_i / (eta * cos_t) - 1) / 2, 1)).astype(np.float32)
    roughness = np.maximum(at.value("lobe_roughness") * narrower, np.float32(MIRROR_ROUGHNESS))
    return ggx_lobe(reflect(out, -n).astype(np.float32), -at.n_shading, roughness)


def _seen(scene: CompiledScene, at: Interaction, lamp: CompiledLight, light: Float32, stats: Stats) -> Array:
    """Light (3, n) of a lamp, as far as it comes through to the outer sides of hits."""
    if not (lamp.light.cast_shadow and scene.plan.shadows):
        return light
    is_spread = at.draws is not None and lamp.is_soft and scene.settings.shadow_samples > 0
    square = at.draws.square(lamp.key, 0, 1) if at.draws is not None and is_spread else None
    wi, distance = lamp.shadow_rays(at.inner(ALL), -at.n_geometric, square)
    inside = np.zeros(len(at.prim), bool)
    share, _ = visibility(scene, scene.blockers(lamp), wi, distance, at.inner(ALL), inside, None, stats, at.came)
    return light * share
