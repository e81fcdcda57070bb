"""Lamps seen through rough glass: the highlight of what refracts light out of a solid.

The lobe is that of a reflection with its mirror direction turned into the refracted one (as in EEVEE), made narrower by
how much less refraction turns a ray than reflection does where a microfacet tilts: a reflected ray by twice the tilt, a
refracted one by |cos_i / (eta cos_t) - 1| times it (Walter et al. 2007, eq. 17, to the first order). Rays that leave by
such a microfacet meet no lamp, so none is counted twice. Within a solid lamps are met by rays alone: those that enter.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32
from .compiled import CompiledScene
from .constants import FROSTED_ROUGHNESS, LEAST_COSINE
from .interaction import Interaction
from .lights import CompiledLight, shadow_rays
from .ltc import ggx_lobe, highlight
from .rays import Rays
from .scattering import reflect, refract
from .shadows import visibility
from .spawn import share_out
from .sums import Sums
from .tally import Tally
from .vectors import dot, flatnonzero, normalize

Bools = NDArray[np.bool_]


def add_through(scene: CompiledScene, rays: Rays, at: Interaction, sums: Sums, tally: Tally) -> None:
    """Add the light of lamps that hits of rays (n,) refract out of rough glass."""
    lamps = [light for light in scene.lights if light.light.transmission > 0]
    if not lamps or not scene.plan.refraction or scene.settings.rough_samples == 0:
        return
    index = flatnonzero(at.glows & ~rays.unlit & (rays.depth <= scene.settings.max_depth))
    if len(index) == 0:
        return
    rays, at = rays.take(index), at.take(index)
    split = share_out(scene, rays, at)
    leaves = flatnonzero(split.bends & (split.transmitted != 0).any(axis=0))
    if len(leaves) == 0:
        return
    rays, at = rays.take(leaves), at.take(leaves)
    weight, cos_i, eta = split.transmitted[:, leaves], split.cos_i[leaves], split.eta[leaves]
    wo, n = at.wo.astype(np.float64), at.n_shading.astype(np.float64)
    out = normalize(refract(wo, n, cos_i, eta))
    cos_t = np.maximum(-dot(out, n), LEAST_COSINE)
    narrower = np.abs(cos_i / (eta * cos_t) - 1) / 2
    roughness = at.value("lobe_roughness") * np.sqrt(np.minimum(narrower, 1)).astype(np.float32)
    back = np.asarray(-at.n_shading, np.float32)
    lobe = ggx_lobe(reflect(out, -n).astype(np.float32), back, np.maximum(roughness, np.float32(FROSTED_ROUGHNESS / 2)))
    point, outward = at.point.astype(np.float32), -at.n_geometric
    for lamp in lamps:
        seen = highlight(lamp, point, outward, lobe, at.offset) * np.float32(lamp.light.transmission)
        if lamp.receives is not None:
            seen *= lamp.receives.take(at.prim)
        lit = flatnonzero(seen > 0)
        if len(lit):
            light = weight[:, lit] * (lamp.color * seen[lit])
            _add_seen(scene, rays.take(lit), at.take(lit), lamp, light, sums, tally)


def _add_seen(
    scene: CompiledScene,
    rays: Rays,
    at: Interaction,
    lamp: CompiledLight,
    light: Float32,
    sums: Sums,
    tally: Tally,
) -> None:
    """Add light (3, n) of a lamp, as far as it comes through to the outer sides of hits."""
    if lamp.light.cast_shadow and scene.plan.shadows:
        origin, outward = at.inner(slice(None)), -at.n_geometric
        samples = scene.settings.shadow_samples if lamp.is_soft and at.draws is not None else 0
        square = at.draws.square(lamp.key, 0, 1) if samples and at.draws is not None else None
        wi, distance = shadow_rays(lamp, origin, outward, square)
        inside = np.zeros(len(rays), bool)
        light = light * visibility(scene, scene.blockers(lamp), wi, distance, origin, inside, None, tally)
    sums.add_radiance(rays.sample, light.astype(np.float32), rays.branch)
