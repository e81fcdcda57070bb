# SPDX-License-Identifier: GPL-3.0-or-later
"""What shadow rays let through: from hits to points of lights, tinted by what is not opaque."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64
from ..core.constants import MAX_SHADOW_CROSSINGS, SHADOW_REACH
from ..core.rays import RayState, offset_origin, origin_offset, shadow_state, traceable
from ..core.stats import Stats
from ..core.vectors import ALL, Array, Index, count, flatnonzero, select, take, write
from ..emitters.light import CompiledLight
from ..geometry.flatten import Geometry
from ..geometry.hits import Hits
from ..media.nested import Stack, transmittance
from ..prepare.compiled import CompiledScene, ShadowCasters
from .closures import closure_weights
from .evaluate import resolve_crossings
from .interaction import Interaction, shadow_origin
from .programs import shadows_passed
from .scattering import both_faces, fresnel_dielectric, passed, simple_caustic, with_film

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]

NOTHING = np.zeros(0, np.intp)
STATE = tuple(field.name for field in fields(RayState))

TOGETHER = 1 << 13
"""Shadow rays, of several lights or points of lights, that are followed at once. A question costs a millisecond however
few they are; of many the work is most of the time, and wants the cache."""


class Origins:
    """Where shadow rays start: worked out for hits when a light first asks for them."""

    def __init__(self, geometry: Geometry, hit: Interaction) -> None:
        self.geometry, self.hit = geometry, hit
        self.known = np.zeros(len(hit.prim), bool)
        self.origin = np.empty(hit.outer.shape, np.float32)

    def work_out(self, indices: list[Index]) -> None:
        """Those of the hits of all these indices."""
        if self.hit.weights is None:
            self.origin = self.hit.outer
            return
        asked = np.zeros(len(self.known), bool)
        for index in indices:
            asked[index] = True
        new = select(asked & ~self.known)
        write(self.origin, new, shadow_origin(self.geometry, self.hit, new))
        self.known |= asked


@dataclass(eq=False)
class _Beam:
    """Shadow rays from the hits `wanted` to one point of a light.

    inside : (m,) bool, they start behind surfaces that transmit.
    media  : (rows, m), the solids around their origins.
    came   : how the rays came that hit there; None: no surface asks.
    """

    blockers: ShadowCasters
    wanted: Index
    origin: Float32
    inside: Bools
    wi: Float32
    distance: Float32
    media: Stack | None
    came: RayState | None

    def __len__(self) -> int:
        result: int = self.origin.shape[1]
        return result


def visible_shares(
    scene: CompiledScene, hit: Interaction, origins: Origins, asked: list[tuple[CompiledLight, Index]], stats: Stats
) -> Iterator[tuple[Array, Numbers]]:
    """What share, (m,) or (3, m), of each light gets to the hits that it may reach: the mean over shadow samples.

    And to which of these hits (k,) a shadow ray was not followed to its end.
    """
    origins.work_out([wanted for _, wanted in asked])
    squares = [points_asked(scene, hit, light) for light, _ in asked]
    beams = (
        beam
        for (light, wanted), n in zip(asked, squares, strict=True)
        for beam in _beams(scene, hit, light, wanted, take(origins.origin, wanted), n)
    )
    seen = _visibilities(scene, beams, stats)
    for n in squares:
        shares, cut = zip(*islice(seen, max(n, 1)), strict=True)
        mean = shares[0] if n <= 1 else np.asarray(sum(shares) / np.float32(n), np.float32)
        yield mean, cut[0] if n <= 1 else np.concatenate(cut)


def points_asked(scene: CompiledScene, hit: Interaction, light: CompiledLight) -> int:
    """To how many points of a light shadow rays go; 0: to its middle."""
    soft = hit.draws is not None and light.is_soft and scene.plan.soft_shadows
    return scene.settings.shadow_samples if soft else 0


def _beams(
    scene: CompiledScene, hit: Interaction, light: CompiledLight, wanted: Index, origin: Float32, samples: int
) -> Iterator[_Beam]:
    """From the hits `wanted`, one after the other."""
    blockers, normal = scene.blockers(light), take(hit.n_geometric, wanted)
    inside = hit.table.transmits.take(take(hit.surface, wanted)) & ~take(hit.entering, wanted)
    media = None if hit.media is None else take(hit.media, wanted)
    if media is not None and blockers.hollow is not None:
        media = scene.media.without(media, blockers.hollow)
    draws = None if hit.draws is None or samples == 0 else hit.draws.take(wanted)
    came = None if hit.came is None else hit.came.take(wanted)
    for part in range(max(samples, 1)):
        square = None if draws is None else draws.square(light.key, part, samples)
        yield _Beam(blockers, wanted, origin, inside, *light.shadow_rays(origin, normal, square), media, came)


def _visibilities(scene: CompiledScene, beams: Iterable[_Beam], stats: Stats) -> Iterator[tuple[Array, Numbers]]:
    """What gets through along each of some beams, and which of its rays were not followed to their ends. Those that the
    same things may block go together while they are few."""
    waiting: list[_Beam] = []
    for beam in beams:
        if waiting and (beam.blockers is not waiting[0].blockers or sum(map(len, waiting)) + len(beam) > TOGETHER):
            yield from _visibility_of(scene, waiting, stats)
            waiting = []
        waiting.append(beam)
    if waiting:
        yield from _visibility_of(scene, waiting, stats)


def _visibility_of(scene: CompiledScene, beams: list[_Beam], stats: Stats) -> Iterator[tuple[Array, Numbers]]:
    """The same of beams with the same blockers, in one question."""
    names = "wi", "distance", "origin", "inside"
    wi, distance, origin, inside = (_joined([getattr(b, name) for b in beams]) for name in names)
    media = _joined([b.media for b in beams if b.media is not None]) if beams[0].media is not None else None
    states = [b.came for b in beams if b.came is not None]
    came = RayState(*(_joined([getattr(s, name) for s in states]) for name in STATE)) if states else None
    share, cut = visibility(scene, beams[0].blockers, wi, distance, origin, inside, media, stats, came)
    start = 0
    for beam in beams:
        stop = start + len(beam)
        first, last = np.searchsorted(cut, (start, stop)) if len(cut) else (0, 0)
        yield share[..., start:stop], cut[first:last] - start
        start = stop


def _joined(parts: list[Array]) -> Array:
    """One array out of several, along the last axis; one alone is itself."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=-1)


def visibility(
    scene: CompiledScene,
    blockers: ShadowCasters,
    wi: Float32,
    distance: Float32,
    origin: Float32,
    inside: Bools,
    media: Stack | None,
    stats: Stats,
    came: RayState | None = None,
) -> tuple[Array, Numbers]:
    """What share, (n,) or (3, n), of the light `distance` (n,) along wi (3, n) gets to the origins (3, n).

    And which rays (k,), ascending, were not followed to their ends: they count as blocked.

    inside : (n,) bool, rays that are likely to meet something.   media : (rows, n), the solids around the origins.
    came   : how the rays came that hit these; None: camera rays, or no surface asks.
    """
    # Rays that Embree cannot digest are not sent.
    t_max = distance * np.float32(SHADOW_REACH)
    is_open = traceable(origin, wi)
    sound = select(is_open)
    cut = NOTHING if isinstance(sound, slice) else flatnonzero(~is_open)
    stats.add("dropped", len(is_open) - count(sound, len(is_open)))
    stats.add("shadow", count(sound, len(is_open)))
    is_blocked = is_open.copy()
    if scene.plan.any_hit and media is None:
        # Most rays meet nothing: only the others have to be told by what. But the way through a solid may absorb.
        asked = select(is_open & ~inside) if blockers.tints else sound
        o, d, t = take(origin, asked), take(wi, asked), take(t_max, asked)
        is_blocked[asked] = blockers.casts.occluded(o, d, t, stats)
        is_open &= ~is_blocked
        stats.add("any_hit", np.count_nonzero(is_open) if blockers.tints else count(asked, len(is_open)))
        if not blockers.tints:
            return is_open, cut
    # Of those that meet something, follow the ray through all that tints it.
    blocked = select(is_blocked)
    media = None if media is None else take(media, blocked)
    way = take(origin, blocked), take(wi, blocked), take(t_max, blocked)
    came = None if came is None else came.take(blocked)
    share, exhausted = _transmittance(scene, blockers, *way, media, stats, came)
    if len(exhausted):
        cut = np.union1d(cut, exhausted if isinstance(blocked, slice) else blocked[exhausted])
    if isinstance(blocked, slice):
        return share, cut
    visible = np.empty(origin.shape, np.float32)
    visible[...] = is_open
    write(visible, blocked, share)
    return visible, cut


def _transmittance(
    scene: CompiledScene,
    blockers: ShadowCasters,
    origin: Float32,
    wi: Float32,
    t_max: Float32,
    media: Stack | None,
    stats: Stats,
    came: RayState | None,
) -> tuple[Float32, Numbers]:
    """Product (3, n) over the surfaces on straight shadow rays of (1-r)(1-o)(1-F) transmission_tint: 0 for opaque ones.

    And of what the solids between them leave over, where any absorbs; media: (rows, n), those around the origins.
    The ray is not bent, so at both faces of a solid its angle is that in the outer medium, and F is taken from there.
    Also the rays that cross too many: they count as blocked.
    """
    geometry, absorption = scene.geometry, scene.media.shadow_absorption
    result = np.ones(wi.shape, np.float32)
    # Of the rays that are on their way: which they are, how far it is, how far they came; what is left; None: all.
    active, d, reach, travelled = np.arange(wi.shape[1]), wi, t_max.astype(np.float64), np.zeros(wi.shape[1])
    left = None if media is None or absorption is None else result
    for number in range(MAX_SHADOW_CROSSINGS):
        # To the next surface, or to the light; what lies between may absorb.
        stats.add("shadow_steps", len(active))
        hits = blockers.casts.nearest(origin, d, stats)
        crosses = hits.t < reach
        ends = crosses & blockers.opaque.take(hits.prim, mode="wrap")
        if left is not None and media is not None and absorption is not None:
            left = left * transmittance(absorption, media, np.minimum(hits.t, reach)).astype(np.float32)
        # Done are those that something opaque stops, and those that arrive.
        crossed = select(crosses & ~ends)
        if not isinstance(crossed, slice):
            write(result, active[ends], 0)
            if left is not None:
                arrived = flatnonzero(~crosses)
                write(result, active[arrived], take(left, arrived))
        if count(crossed, len(active)) == 0:
            return result, active[:0]
        hits, active, origin, d = hits.take(crossed), active[crossed], take(origin, crossed), take(d, crossed)
        # The surface lets some of it through.
        prim, entering = hits.prim.astype(np.intp), hits.toward < 0
        travelled = take(travelled, crossed)
        share = _passed(scene, prim, hits, origin, d, partial(_crossing, came, active, number, travelled), stats)
        left = share if left is None else take(left, crossed) * share
        # Go on behind the surface, unless nothing is left.
        going = (left > 0).any(axis=0)
        alive = select(going)
        if not isinstance(alive, slice):
            write(result, active[~going], 0)
        if count(alive, len(active)) == 0:
            return result, active[:0]
        if media is not None:
            media = take(scene.media.cross(take(media, crossed), prim, entering, Stats()), alive)
        active, d, left, hits = active[alive], take(d, alive), take(left, alive), hits.take(alive)
        point = d * hits.t
        point += take(origin, alive)
        reach, travelled = take(take(reach, crossed), alive) - hits.t, take(travelled, alive) + hits.t
        offset = origin_offset(point.astype(np.float32), hits.extent(geometry))
        offset *= np.sign(hits.toward).astype(np.float32)
        origin = offset_origin(point, hits.normal, offset)
    write(result, active, 0)
    stats.add("shadow_crossings_exhausted", len(active))
    return result, active


def _crossing(came: RayState | None, active: Numbers, crossed: int, travelled: Float64, told: Numbers) -> RayState:
    """The state of the shadow rays `told` of those that are on their way, `active` of all."""
    return shadow_state(came, active[told], len(told), crossed, travelled[told])


def _passed(
    scene: CompiledScene, prim: Numbers, hits: Hits, origin: Float32, d: Float32,
    state: Callable[[Numbers], RayState], stats: Stats,
) -> Float32:  # fmt: skip
    """What share (3, n) shadow rays, from origins along d, keep of their light at a surface that they cross.

    state : of those of them that it is asked for.
    """
    table, surface = scene.surfaces, scene.geometry.surface.take(prim)
    if not table.closure_count.take(surface).any():
        return _passed_closures(scene, surface, prim, hits, origin, d, state)
    # Each closure lets its share pass.
    owner, row, part = table.closures_of(surface)
    entering, normal = hits.toward < 0, hits.normal * -np.sign(hits.toward).astype(np.float32)
    came = state(np.arange(len(prim)))
    way = hits.face, surface, origin + d * hits.t, entering, normal, -d, hits.t, came
    weight = closure_weights(scene.geometry, table, *way, owner, row, part)
    rays = hits.take(owner), origin[:, owner], d[:, owner]
    share = weight * _passed_closures(scene, row, prim[owner], *rays, lambda told: state(owner[told]))
    starts = flatnonzero(np.diff(owner, prepend=-1))
    summed = np.asarray(np.add.reduceat(share, starts, axis=1), np.float32)
    return shadows_passed(scene, prim, surface, hits, origin, d, summed, stats.counts)


def _passed_closures(
    scene: CompiledScene, surface: Numbers, prim: Numbers, hits: Hits, origin: Float32, d: Float32,
    state: Callable[[Numbers], RayState],
) -> Float32:  # fmt: skip
    """The same of single closures `surface` (n,)."""
    table = scene.surfaces
    cos = np.abs(hits.toward)
    seen = table.tabulated.look_up(surface, cos.astype(np.float32))
    told = flatnonzero(table.varies_through.take(surface))
    if len(told):
        way = take(origin, told), take(d, told)
        seen = resolve_crossings(scene.geometry, table, surface, told, hits.take(told), *way, state(told), seen)
    ior = table.ior.take(surface) if seen.ior is None else seen.ior
    thin = scene.media.is_thin(prim)
    once = fresnel_dielectric(cos.astype(np.float32), ior.astype(np.float32))
    if table.filmed.any():
        filmed, outside = flatnonzero(table.filmed.take(surface)), np.ones(len(prim), bool)
        once = with_film(once, filmed, np.minimum(cos, 1.0), ior, outside, ior, seen)
    fresnel, tint = both_faces(once, seen.value("tint", ALL), thin)
    share: Array = seen.value("interface", ALL) * passed(fresnel, ~table.glossless.take(surface))
    if scene.settings.caustics == "SIMPLE":
        focused = simple_caustic(cos, ior)
        share = share * (focused if thin is None else np.where(thin, 1.0, focused))
    return np.asarray(tint * share.astype(np.float32), np.float32)
