# SPDX-License-Identifier: GPL-3.0-or-later
"""New rays: at most one reflected and one transmitted ray from each hit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64
from ..core.constants import MAX_STRAIGHT_CROSSINGS, MIRROR_ROUGHNESS, MISS
from ..core.rays import (
    REFLECTED_RAY,
    SHARP,
    TRANSMISSIONS,
    TRANSMITTED_RAY,
    TRAVELLED,
    Rays,
)
from ..core.stats import Stats
from ..core.vectors import Index, count, flatnonzero, largest_component, most, put, select, take
from ..film.ended_rays import count_ended, in_units
from ..film.path_hash import REFLECTED, TRANSMITTED, child_path
from ..film.samples import SampleBuffer
from ..prepare.compiled import CompiledScene
from .interaction import Interaction
from .microfacets import are_blurred, roughen
from .random_light import asks, child_branch, note_ways
from .scattering import (
    both_faces,
    fresnel_dielectric,
    mirror_directions,
    mirrored,
    reflecting_normal,
    refracted_directions,
    shares,
    with_film,
)

Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Split:
    """How n hits share out the throughput of their rays.

    reflected, transmitted : (3, n) float32, throughput of the new rays.
    unlit : (n,) bool, the light of lamps that the reflected ray would meet is in the hit's highlight.
    bends : (n,) bool, a transmitted ray is refracted; otherwise it goes straight on and spends no bounce.
    cos_i, eta : (n,) float64, on the shading normal, where it bends.
    blurs : (n,) bool, its rays leave by microfacets, not as from a mirror.
    drawn : (n,) bool, these were drawn at random; None: nobody asks.
    """

    reflected: Float32
    transmitted: Float32
    unlit: Bools
    bends: Bools
    cos_i: Float64
    eta: Float64
    blurs: Bools
    drawn: Bools | None = None

    def scaled(self, factor: float) -> Split:
        """All that is mirrored or bent counts so many times."""
        if factor == 1.0:
            return self
        return replace(
            self,
            reflected=self.reflected * np.float32(factor),
            transmitted=self.transmitted * np.where(self.bends, np.float32(factor), np.float32(1)),
        )


def spawn(
    scene: CompiledScene, rays: Rays, at: Interaction, t: Float64, sample_buffer: SampleBuffer, stats: Stats
) -> list[Rays]:
    """The next wave: reflected, then refracted, then straight rays, each kind in the order of its hits."""
    plan = scene.plan
    if not (plan.reflection or plan.refraction):
        return [rays.take(np.zeros(0, np.intp))]
    drawn = roughen(scene, rays, at, t) if plan.rough else None
    rays, at, t = (rays, at, t) if drawn is None else (drawn.rays, drawn.at, drawn.t)
    split = share_out(scene, rays, at).scaled(scene.arriving.indirect)
    if drawn is not None:
        reflected, transmitted = drawn.share(split.reflected, split.transmitted, split.bends)
        unlit = at.has_highlight & drawn.is_rough
        random = drawn.is_rough if asks(sample_buffer) else None
        split = replace(
            split, reflected=reflected, transmitted=transmitted, unlit=unlit, blurs=drawn.is_rough, drawn=random
        )
    blurred = are_blurred(scene, at)
    if blurred is not None:
        split = _add_blurred(scene, rays, at, split, blurred, sample_buffer)
    split, reflect_too, transmit_too = _followed(scene, rays, at, split, sample_buffer, stats)
    if drawn is not None and asks(sample_buffer):
        weight = split.reflected * reflect_too + split.transmitted * (transmit_too & split.bends)
        note_ways(rays, drawn.is_rough, weight, sample_buffer)
    return children(scene, rays, at, t, split, reflect_too, transmit_too, stats)


def children(
    scene: CompiledScene,
    rays: Rays,
    at: Interaction,
    t: Float64,
    split: Split,
    reflect_too: Bools,
    transmit_too: Bools,
    stats: Stats,
) -> list[Rays]:
    """The rays that hits (n,) send on as they share out, where they are to."""
    waves = []
    mirrored, bent, through = reflect_too, transmit_too & split.bends, transmit_too & ~split.bends
    if scene.plan.reflection and mirrored.any():
        waves.append(_reflected(scene, rays, at, split, select(mirrored), stats))
    if scene.plan.refraction and bent.any():
        waves.append(_refracted(scene, rays, at, split, select(bent), stats))
    if scene.plan.refraction and through.any():
        waves.append(_straight(scene, rays, at, split, select(through), t, stats))
    return waves or [rays.take(flatnonzero(mirrored))]


def share_out(scene: CompiledScene, rays: Rays, at: Interaction) -> Split:
    """Share the light out among the mirror, the interface's reflection and its transmission."""
    n, interface, tint = len(rays), at.value("interface"), at.value("tint")
    thin = scene.media.is_thin(at.prim)
    fresnel, cos_i, eta = np.zeros(n, np.float32), np.zeros(n), np.ones(n)
    is_optical = interface > 0
    optical = most(is_optical)
    if count(optical, n):
        outside = at.entering if thin is None else at.entering | thin
        ior, prim = take(at.ior, optical), take(at.prim, optical)
        cosine = np.clip(take(at.cos_o, optical), 0, 1).astype(np.float64)
        relative = scene.media.eta(take(rays.media, optical), prim, ior, take(outside, optical))
        if at.sides is not None:
            at.sides.amend_eta(relative, optical)
        relative[~take(is_optical, optical)] = 1.0
        cos_i[optical], eta[optical] = cosine, relative
        fresnel[optical] = fresnel_dielectric(cosine, relative)
        if scene.surfaces.filmed.any():
            filmed = flatnonzero(is_optical & at.table.filmed.take(at.surface))
            fresnel = with_film(fresnel, filmed, cos_i, eta, outside, at.ior, at.values)
    bends, blurs = eta != 1, at.value("lobe_roughness") > MIRROR_ROUGHNESS
    if thin is not None:
        fresnel, tint = both_faces(fresnel, tint, thin)
        bends &= ~thin
    reflects = ~at.table.glossless.take(at.surface)
    reflected, transmitted = shares(
        rays.throughput, at.value("mirror"), at.value("interface_tint"), tint, interface, fresnel, reflects
    )
    if at.answers is not None:
        reflected, transmitted, bends = at.answers.share(rays.throughput, reflected, transmitted, bends)
    return Split(
        reflected=reflected,
        transmitted=transmitted,
        unlit=at.has_highlight & blurs,
        bends=bends,
        cos_i=cos_i,
        eta=eta,
        blurs=blurs,
    )


def _add_blurred(
    scene: CompiledScene, rays: Rays, at: Interaction, split: Split, blurred: Bools, sample_buffer: SampleBuffer
) -> Split:
    """Let hits whose base is `blurred` (n,) show the world's blurred image: in the mirror's direction, and straight on.

    Returns what is left to rays: what a smooth coat reflects, and what goes straight on.
    """
    index = flatnonzero(blurred)
    smooth = at.value("coat_roughness", index) <= MIRROR_ROUGHNESS
    coat = np.where(smooth, at.value("coat", index) - at.value("coat_blurred", index), np.float32(0))
    sharp = np.minimum(take(rays.throughput, index) * coat, take(split.reflected, index))
    if scene.plan.world:
        roughness, wo = at.value("lobe_roughness", index), take(at.wo, index)
        n = reflecting_normal(wo, take(at.n_shading, index), take(at.n_geometric, index))
        light = (take(split.reflected, index) - sharp) * scene.world.glossy(mirrored(wo, n, roughness), roughness)
        light += take(split.transmitted, index) * take(split.bends, index) * scene.world.glossy(-wo, roughness)
        sample_buffer.add_radiance(take(rays.sample, index), light, take(rays.branch, index))
    straight = np.where(blurred & split.bends, np.float32(0), split.transmitted)
    return replace(split, reflected=put(split.reflected, index, sharp), transmitted=straight)


def _followed(
    scene: CompiledScene, rays: Rays, at: Interaction, split: Split, sample_buffer: SampleBuffer, stats: Stats
) -> tuple[Split, Bools, Bools]:
    """Which reflected and which transmitted rays go on: those with a weight, within depth, worth their work.

    What the depth or the cutoff ends, or what is one of too many, is residual; of those that are too many, some stand
    for the others, and carry more. Camera rays that pass straight through are never cut: the film's alpha counts them.
    """
    # Those with a weight, within depth.
    may_bounce = rays.depth < scene.settings.max_depth
    may_pass = (may_bounce & split.bends) | ((rays.straight < MAX_STRAIGHT_CROSSINGS) & ~split.bends)
    weightless = scene.plan.weightless
    reflected, transmitted = largest_component(split.reflected), largest_component(split.transmitted)
    if not weightless:
        stats.add("weightless", 2 * len(rays) - np.count_nonzero(reflected) - np.count_nonzero(transmitted))
    place = scene.geometry.object.take(at.prim)
    reflects = _within(rays, place, reflected, may_bounce, sample_buffer, weightless, stats)
    transmits = _within(rays, place, transmitted, may_pass, sample_buffer, weightless, stats)
    # Those that are worth their work: the smallest are cut, as far as the error budget goes.
    weight = np.concatenate([reflected * reflects, transmitted * (transmits & (split.bends | ~rays.camera))])
    sample = np.concatenate([rays.sample, rays.sample])
    ended = sample_buffer.cuttable(sample, weight)
    if ended.any():
        stats.add("cut", np.count_nonzero(ended))
        sample_buffer.add_residual(sample[ended], weight[ended])
        stats.add("lost_to_cutoff", in_units(weight[ended]).sum())
        weight[ended] = 0
        reflects, transmits = reflects & ~ended[: len(rays)], transmits & ~ended[len(rays) :]
    # Of too many, those that are drawn.
    factor = sample_buffer.drawn(sample, weight)
    if factor is None:
        return split, reflects, transmits
    stats.add("crowded", np.count_nonzero(factor == 0))
    left, through = factor.reshape(2, -1).astype(np.float32)
    split = replace(split, reflected=split.reflected * left, transmitted=split.transmitted * through)
    return split, reflects & (left > 0), transmits & (through > 0)


def _within(
    rays: Rays,
    place: NDArray[np.intp],
    weight: Float32,
    limit: Bools,
    sample_buffer: SampleBuffer,
    weightless: bool,
    stats: Stats,
) -> Bools:
    """The hits that may spawn a ray: a weight (n,) left, and within limits; what the limit cuts is residual.

    place : (n,) the objects that are hit.   weightless : rays without a weight are wanted, too.
    """
    wanted = (weight != 0) | weightless
    cut = flatnonzero(wanted & ~limit)
    if len(cut):
        sample_buffer.add_residual(rays.sample[cut], weight[cut])
        count_ended(place[cut], weight[cut], stats)
    result: Bools = wanted & limit
    return result


def _child(
    rays: Rays,
    at: Interaction,
    index: Index,
    origin: Float32,
    direction: Float32,
    split: Split,
    media: NDArray[np.int32],
    unlit: Bools,
    closure: NDArray[np.int32],
    path_kind: np.uint32,
) -> Rays:
    """Rays that the hits `index` bend, one bounce deeper. path_kind: REFLECTED or TRANSMITTED."""
    n, blurs = origin.shape[1], take(split.blurs, index)
    drawn = None if split.drawn is None else take(split.drawn, index)
    weight = split.reflected if path_kind == REFLECTED else split.transmitted
    return Rays(
        origin=origin,
        direction=direction,
        throughput=take(weight, index),
        sample=take(rays.sample, index),
        depth=take(rays.depth, index) + np.int16(1),
        straight=take(rays.straight, index),
        t_max=np.full(n, np.inf, np.float32),
        media=media,
        kind=np.full(n, REFLECTED_RAY if path_kind == REFLECTED else TRANSMITTED_RAY),
        unlit=unlit,
        receiver=np.broadcast_to(take(at.prim, index).astype(np.int32), (len(rays.receiver), n)),
        closure=closure,
        path=child_path(take(rays.path, index), path_kind),
        branch=child_branch(take(rays.branch, index), path_kind, drawn),
        history=_child_history(take(rays.history, index), path_kind, blurs),
    )


def _child_history(history: Float32, kind: np.uint32, blurs: Bools) -> Float32:
    """Histories (rows, n) of new rays, which start where the last one ended."""
    if len(history) == 0:
        return history
    history = history.copy()
    history[TRANSMISSIONS] += kind == TRANSMITTED
    history[SHARP], history[TRAVELLED] = ~blurs, 0
    return history


def _reflected(scene: CompiledScene, rays: Rays, at: Interaction, split: Split, index: Index, stats: Stats) -> Rays:
    wo, normal = take(at.wo, index), take(at.n_shading, index)
    curved = scene.plan.rough or at.n_shading is not at.n_geometric  # whatever else is in the wave
    direction = mirror_directions(wo, normal, take(at.n_geometric, index) if curved else normal, curved)
    direction = direction if at.answers is None else at.answers.mirrored(index, direction)
    stats.add("reflected", direction.shape[1])
    media, unlit, closure = take(rays.media, index), take(split.unlit, index), take(rays.closure, index)
    if at.sides is not None:
        media = at.sides.amend(media, index, beyond=False)
    return _child(rays, at, index, take(at.outer, index), direction, split, media, unlit, closure, REFLECTED)


def _refracted(scene: CompiledScene, rays: Rays, at: Interaction, split: Split, index: Index, stats: Stats) -> Rays:
    wo, n_shading = take(at.wo, index), take(at.n_shading, index)
    cos_i, eta = take(split.cos_i, index), take(split.eta, index)
    curved = scene.plan.rough or at.n_shading is not at.n_geometric
    facing = take(at.n_geometric, index) if curved else n_shading
    direction = refracted_directions(wo, n_shading, facing, cos_i, eta, curved)
    stats.add("refracted", direction.shape[1])
    unlit = take(rays.unlit, index)
    if scene.plan.rough and scene.plan.specular:
        unlit = unlit | take(at.glows, index)
    media, closure = _beyond(scene, rays, at, index, stats), take(rays.closure, index)
    if len(closure):
        closure = np.where(take(at.entering, index), take(at.surface, index), MISS).astype(np.int32)[None]
    origin = at.inner(index)
    if at.answers is not None:
        origin, direction, elsewhere = at.answers.passed_on(at, index, direction)
        media = np.where(elsewhere, np.int32(scene.media.count), media)
    return _child(rays, at, index, origin, direction, split, media, unlit, closure, TRANSMITTED)


def _beyond(scene: CompiledScene, rays: Rays, at: Interaction, index: Index, stats: Stats) -> NDArray[np.int32]:
    """Media (rows, m) of rays that go on behind the hits `index`."""
    media = scene.media.cross(take(rays.media, index), take(at.prim, index), take(at.entering, index), stats)
    return media if at.sides is None else at.sides.amend(media, index, beyond=True)


def _straight(
    scene: CompiledScene, rays: Rays, at: Interaction, split: Split, index: Index, t: Float64, stats: Stats
) -> Rays:
    """Rays through index-matched surfaces: the same ray goes on behind, and no bounce is spent."""
    path, branch, history = (take(part, index) for part in (rays.path, rays.branch, rays.history))
    if len(history):
        history = history.copy()
        history[TRAVELLED] += take(t, index)
    on = replace(
        rays.take(index),
        origin=at.inner(index),
        throughput=take(split.transmitted, index),
        straight=take(rays.straight, index) + np.int16(1),
        t_max=(take(rays.t_max, index) - take(t, index)).astype(np.float32),
        media=_beyond(scene, rays, at, index, stats),
        path=child_path(path, TRANSMITTED),
        branch=child_branch(branch, TRANSMITTED),
        history=history,
    )
    stats.add("straight", len(on))
    return on
