# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that reflected and refracted rays meet: their shapes, as far as nothing is before them, at any depth of a path.

A lamp adds its radiance to a ray and does not end it: rays go on through it, as Cycles' do. Camera rays, and what only
went straight on from them, see none. What a rough surface shows of lamps is its highlight (`ltc`), so rays that leave
it by a microfacet do not meet them again (`Rays.unlit`).

Shapes and radiances are EEVEE's and Cycles': an area light shines to one side; a point or spot light is a ball, or with
soft falloff a disk that faces where the ray starts; a sun is a disk in the sky. Range and cone are those of the place
where the ray starts, as for all light. A lamp without a size shows nothing.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64
from ..core.constants import SHADOW_REACH
from ..core.rays import REFLECTED_RAY, Rays, offset_origin, origin_offset, state_of
from ..core.stats import Stats
from ..core.vectors import Array, count, flatnonzero, no_brighter, select, take
from ..emitters.light import CompiledLight
from ..film.samples import SampleBuffer
from ..geometry.hits import Hits
from ..media.nested import transmittance
from ..prepare.compiled import CompiledScene
from .shadows import visibility

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]


def add_lamps(scene: CompiledScene, rays: Rays, hits: Hits, sample_buffer: SampleBuffer, stats: Stats) -> None:
    """Add the radiance of the lamps that rays (n,) meet before their hits."""
    for lamp, seen, radiance in lamps_met(scene, rays, hits, stats):
        stats.add("lamps", len(seen))
        sample_buffer.add_radiance(seen.sample, brought(scene, seen, radiance), seen.branch)
        if sample_buffer.signatures is not None:
            sample_buffer.signatures.add_lamp(seen, lamp.key)


def lamps_met(
    scene: CompiledScene, rays: Rays, hits: Hits, stats: Stats
) -> Iterator[tuple[CompiledLight, Rays, Float32]]:
    """Each lamp that some of the rays (n,) meet before their hits, those rays (m,), and its radiance there (3, m)."""
    if not scene.lamps:
        return
    looks = select(~(rays.camera | rays.unlit))
    if count(looks, len(rays)) == 0:
        return
    rays, hits = rays.take(looks), hits.take(looks)
    # It is their direct light, a highlight of the surface that the ray has left, and limited as that is.
    strength = np.float32(1 / scene.arriving.indirect) if scene.arriving.indirect else np.float32(0)
    for lamp in scene.lamps:
        found, radiance = _met(scene, lamp, rays, hits, stats)
        if len(found):
            yield lamp, rays.take(found), radiance * strength


def brought(scene: CompiledScene, rays: Rays, radiance: Float32) -> Float32:
    """What the radiance (3, n) of a lamp adds to the samples of rays that meet it: no more than *Surface Direct*."""
    return no_brighter(rays.throughput * radiance, scene.arriving.direct_limit)


def _met(scene: CompiledScene, lamp: CompiledLight, rays: Rays, hits: Hits, stats: Stats) -> tuple[Numbers, Float32]:
    """Which of n rays meet a lamp, (m,), and what they see of it, (3, m)."""
    with np.errstate(all="ignore"):
        meets, distance = lamp.met_by(rays.origin, rays.direction.astype(np.float64))
    if lamp.receives is not None:
        meets &= lamp.receives.take(rays.receiver[0], mode="wrap")
    clear = distance * SHADOW_REACH <= hits.t
    found = flatnonzero(meets & (clear | _lets_through(scene, lamp, hits)))
    if len(found) == 0:
        return found, np.zeros((3, 0), np.float32)
    factors = np.float32(lamp.light.specular), np.float32(lamp.light.transmission)
    factor = np.where(take(rays.kind, found) == REFLECTED_RAY, *factors)
    radiance = (lamp.radiance() * lamp.fade(factor, take(rays.origin, found))).astype(np.float32)
    hidden = flatnonzero(~clear[found])
    if len(hidden) and lamp.light.cast_shadow:
        index = found[hidden]
        radiance[:, hidden] *= _seen_past(scene, lamp, rays.take(index), hits.take(index), distance[index], stats)
    if scene.media.absorption is not None and not lamp.is_infinite:
        way = np.minimum(distance[found], hits.t[found])
        left = transmittance(scene.media.absorption, take(rays.media, found), way)
        radiance *= left.astype(np.float32)
    lit = flatnonzero((radiance != 0).any(axis=0))  # a lamp may take light away
    return found[lit], radiance[:, lit]


def _lets_through(scene: CompiledScene, lamp: CompiledLight, hits: Hits) -> Bools | bool:
    """(n,) hits that do not stand in a lamp's way though rays end there: all if it casts no shadow."""
    casts = scene.casts_shadow(lamp) if lamp.light.cast_shadow else np.zeros(len(scene.geometry.shadow), bool)
    if casts is None or (lamp.light.cast_shadow and lamp.blocks is None):
        return False
    # What rays go on behind will meet the lamp there.
    ends = ~scene.surfaces.transmits.take(scene.geometry.surface.take(hits.prim, mode="wrap"))
    return np.asarray((hits.prim >= 0) & ends & ~casts.take(hits.prim, mode="wrap"))


def _seen_past(
    scene: CompiledScene, lamp: CompiledLight, rays: Rays, hits: Hits, distance: Float64, stats: Stats
) -> Array:
    """What share of a lamp comes through all that is behind hits that do not stand in its way: (n,) or (3, n)."""
    direction = rays.direction.astype(np.float32)
    point = rays.origin + direction * hits.t
    offset = origin_offset(point.astype(np.float32), hits.extent(scene.geometry))
    origin = offset_origin(point, hits.normal * np.sign(hits.toward).astype(np.float32), offset)
    media = None if scene.media.shadow_absorption is None else rays.media
    left = np.asarray(distance - hits.t, np.float32)
    inside = np.zeros(len(rays), bool)
    return visibility(scene, scene.blockers(lamp), direction, left, origin, inside, media, stats, state_of(rays))[0]


def brightest_lamp(scene: CompiledScene) -> float:
    """The largest radiance that a ray can meet on any lamp."""
    return max((float(np.max(lamp.radiance())) for lamp in scene.lamps), default=0.0)
