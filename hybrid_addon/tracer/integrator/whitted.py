# SPDX-License-Identifier: GPL-3.0-or-later
"""The wave loop: Whitted's ray tree, one generation of a sample's rays at a time, in the style of pbrt's wavefront
integrator.

A wave costs a thousand calls, however few its rays are, and deep in a glass there are few. So samples do not wait for
one another: rays that are left of earlier samples join those of later ones. All rays of a sample that are of one
generation are in one wave, in their order: what else is in it cannot change the sample.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32
from ..core.constants import LONGEST_WAVE
from ..core.rays import BACKGROUND, WAY, Rays, concatenate, traceable
from ..core.sampler import Sampler
from ..core.stats import Stats
from ..core.vectors import Index, add, count, flatnonzero, largest_component, no_brighter, select, take
from ..film.samples import SampleBuffer
from ..geometry.aggregate import PrimitiveSet
from ..geometry.hits import Hits
from ..prepare.compiled import CompiledScene
from ..shading.closures import ClosureHits, closures_at
from ..shading.direct import direct_light
from ..shading.evaluate import surface_hits
from ..shading.interaction import Interaction
from ..shading.lamps import add_lamps
from ..shading.programs import sent_by_programs
from ..shading.random_light import asks_light, note_random, through_lens
from ..shading.rough_transmission import through_rough_glass
from ..shading.spawn import spawn
from .fog import through_fog

Watch = Callable[[Rays, Rays, Hits, Index, Interaction | None, Rays], None]
"""Told of each wave: its rays as they start, and with what media leave of them; their hits, which of them hit, what is
known of those (None: no one hit), their rays."""


def trace_rays(
    scene: CompiledScene,
    chunks: Iterable[Rays],
    first_seen: PrimitiveSet,
    sample_buffer: SampleBuffer,
    stats: Stats,
    check: Callable[[], None],
    watch: Watch | None = None,
    sampler: Sampler | None = None,
) -> None:
    """Follow camera rays to their ends and add what they find to `sample_buffer`.

    chunks     : of camera rays, each of other samples; one is begun when fewer rays than half of it are left of others.
    first_seen : what camera rays can hit first.   check : called once a wave; raises to stop.   watch : see `Watch`.
    sampler    : of the tile; None: lights are seen from their centres, so shadows are hard.
    """
    coming, size = iter(chunks), 0
    waiting: list[Rays] = []
    while True:
        first = None
        if 2 * sum(len(rays) for rays in waiting) <= size:
            first = next(coming, None)
        if first is not None:
            rays, size = first, max(size, len(first))
        elif waiting:
            rays = _joined(waiting, size, sample_buffer.count if watch is None else 0)
            sample_buffer.next_generation(rays.sample)
        else:
            return
        check()
        children = _trace_wave(scene, rays, None if first is None else first_seen, sample_buffer, stats, watch, sampler)
        if len(children):
            waiting.append(children)


def _trace_wave(
    scene: CompiledScene,
    rays: Rays,
    first_seen: PrimitiveSet | None,
    sample_buffer: SampleBuffer,
    stats: Stats,
    watch: Watch | None,
    sampler: Sampler | None,
) -> Rays:
    """Add what rays find, and return those that they spawn. first_seen: what camera rays can hit; None: later ones."""
    # Keep rays that Embree can digest; what a lost one could have brought is part of the error bound.
    rays = _drop_untraceable(rays, sample_buffer, stats)

    # Find the closest hit of each ray.
    hits = _closest_hits(scene, rays, scene.seen_by_camera if first_seen is None else first_seen, stats)
    hit = hits.prim >= 0
    if first_seen is not None:
        # Of the camera rays only those count that meet something the tracer is to show.
        rays, hits, hit = _count_camera_rays(scene, rays, hits, hit, sample_buffer)
        rays = through_lens(scene.camera, scene.geometry.center, rays, hits, hit, sample_buffer)

    started = rays

    # Let them see the lamps that are nearer.
    if first_seen is None:
        add_lamps(scene, rays, hits, sample_buffer, stats)

    # Let the solids absorb their share on the way.
    rays = scene.media.absorbed(rays, hits.t, hit)

    # So does fog, which glows besides.
    rays = through_fog(scene, rays, hits.t, hit, sample_buffer, stats, sampler)

    # What is not ray traced and seen straight through what is, is the background of the picture.
    if first_seen is None and "background" in sample_buffer.aovs:
        rays = _mark_background(scene, rays, hits, hit, sample_buffer)

    # Let escaped rays see the world.
    add_escaped(scene, rays, select(~hit), sample_buffer, stats)

    # What the raster shows is lit already: it ends its rays.
    if scene.screen_space is not None:
        hit = add_backed(scene, rays, hits, hit, sample_buffer, stats)

    # Recompute the hits from the exact geometry.
    chosen = select(hit)
    if count(chosen, len(rays)) == 0:
        nothing = rays.take(chosen)
        if watch is not None:
            watch(started, rays, hits, chosen, None, nothing)
        return nothing
    rays_hit, found = rays.take(chosen), hits.take(chosen)
    media = None if scene.media.shadow_absorption is None else rays_hit.media
    draws = None if sampler is None else sampler.draws(rays_hit.sample, rays_hit.path)
    at = surface_hits(scene, rays_hit, found, media, draws)
    closures = closures_at(scene, rays_hit, at, found.t)
    if closures.left_out is not None:
        sample_buffer.stand_for(*closures.left_out)

    # Add emitted and local light.
    add_light(scene, closures, sample_buffer, stats)

    # Spawn at most one reflected and one transmitted ray from each closure.
    children = concatenate(spawn(scene, closures.rays, closures.at, closures.t, sample_buffer, stats))
    if watch is not None:
        watch(started, rays, hits, chosen, at, children)
    return children


def _joined(waiting: list[Rays], size: int, count: int) -> Rays:
    """One wave out of those that wait, the latest first, until there are `size` rays.

    If one is too long, some of it goes back, by pixels of `count` samples each; 0: never.
    """
    parts = [waiting.pop()]
    while waiting and sum(len(part) for part in parts) + len(waiting[-1]) <= size:
        parts.append(waiting.pop())
    *rest, rays = _split(concatenate(parts), count)
    waiting += rest
    return rays


def _split(rays: Rays, count: int) -> list[Rays]:
    """A wave as it is, in a list, or if it is too long in parts, by pixels of `count` samples each; 0: never in parts.

    All rays of a pixel stay together, in their order: what they add up to is the same bit by bit.
    """
    if len(rays) == 0:
        return []
    number = -(-len(rays) // LONGEST_WAVE)
    if number == 1 or count == 0:
        return [rays]
    pixel = rays.sample // count
    held = np.cumsum(np.bincount(pixel))  # by this and all pixels before it
    part = np.minimum(held * number // (held[-1] + 1), number - 1)[pixel]
    return [rays.take(flatnonzero(part == p)) for p in reversed(np.unique(part).tolist())]


def _drop_untraceable(rays: Rays, sample_buffer: SampleBuffer, stats: Stats) -> Rays:
    sound = traceable(rays.origin, rays.direction)
    if sound.all():
        return rays
    lost = rays.take(flatnonzero(~sound))
    stats.add("dropped", len(lost))
    sample_buffer.add_residual(lost.sample, largest_component(lost.throughput))
    return rays.take(flatnonzero(sound))


def _closest_hits(scene: CompiledScene, rays: Rays, by_camera: PrimitiveSet, stats: Stats) -> Hits:
    """Nearest hits; camera rays and later rays may see different sets, and camera rays end at the clip plane."""
    later = scene.seen_by_secondary
    if not rays.camera.any():
        return later.nearest(rays.origin, rays.direction, stats)
    if by_camera is later or rays.camera.all():
        hits = by_camera.nearest(rays.origin, rays.direction, stats)
    else:
        n = len(rays)
        hits = Hits.empty(n, scene.geometry)
        for members, primitives in ((rays.camera, by_camera), (~rays.camera, later)):
            index = flatnonzero(members)
            part = primitives.nearest(rays.origin[:, index], rays.direction[:, index], stats)
            hits.store(index, part)
    beyond = hits.t > rays.t_max
    hits.drop(beyond)
    return hits


def _count_camera_rays(
    scene: CompiledScene, rays: Rays, hits: Hits, hit: NDArray[np.bool_], sample_buffer: SampleBuffer
) -> tuple[Rays, Hits, NDArray[np.bool_]]:
    """Count the samples that saw something and drop the others."""
    camera_sees = scene.settings.camera_sees
    ray_traced = (
        hit & scene.geometry.ray_traced.take(hits.prim, mode="wrap") if camera_sees != "ALL" and hit.any() else hit
    )
    if camera_sees == "RAY_TRACED":
        counts = ray_traced
    elif scene.settings.transparent:
        counts = hit
    else:
        counts = np.ones(len(rays), bool)
    if camera_sees == "RASTER":
        counts = counts & ~ray_traced
    kept = select(counts)
    rays = rays.take(kept)
    sample_buffer.add_seen(rays.sample)
    return rays, hits.take(kept), take(hit, kept)


def _mark_background(
    scene: CompiledScene, rays: Rays, hits: Hits, hit: NDArray[np.bool_], sample_buffer: SampleBuffer
) -> Rays:
    """The rays, of which those that went straight on from the camera to what is not ray traced have the branch
    BACKGROUND, as all that follow from them."""
    ends = rays.camera & ~(hit & scene.geometry.ray_traced.take(hits.prim, mode="wrap"))
    ends &= rays.branch[WAY] != BACKGROUND
    chosen = flatnonzero(ends)
    if len(chosen) == 0:
        return rays
    sample_buffer.add_passed(rays.sample[chosen], rays.throughput[:, chosen])
    branch = rays.branch.copy()
    branch[WAY, ends] = BACKGROUND
    return replace(rays, branch=branch)


def add_escaped(scene: CompiledScene, rays: Rays, escaped: Index, sample_buffer: SampleBuffer, stats: Stats) -> None:
    """Add the world's radiance; behind a see-through film a ray that passed straight through all sees no world."""
    if count(escaped, len(rays)) == 0:
        return
    gone = rays.take(escaped)
    if sample_buffer.signatures is not None:
        sample_buffer.signatures.add_escaped(gone)
    if scene.settings.camera_sees != "RAY_TRACED" and scene.settings.transparent and gone.camera.any():
        straight = gone.take(select(gone.camera))
        sample_buffer.add_seen(straight.sample, -straight.throughput.max(axis=0))
        gone = gone.take(select(~gone.camera))
    scene.media.count_lost(gone.media[:, ~gone.camera], stats)
    if len(gone) and scene.plan.world:
        sample_buffer.add_radiance(
            gone.sample, gone.throughput * scene.world.seen(gone.direction, gone.camera), gone.branch
        )


def add_backed(
    scene: CompiledScene, rays: Rays, hits: Hits, hit: NDArray[np.bool_], sample_buffer: SampleBuffer, stats: Stats
) -> NDArray[np.bool_]:
    """Add the raster's own light where rays meet what it shows. Returns the hits (n,) that are left to shade."""
    assert scene.screen_space is not None
    index, radiance = scene.screen_space.look_up(rays, hits, hit, stats)
    if len(index) == 0:
        return hit
    found = rays.take(index)
    radiance = no_brighter(radiance, scene.arriving.indirect_limit)
    sample_buffer.add_radiance(found.sample, found.throughput * radiance, found.branch)
    sample_buffer.add_backed(found.sample, found.throughput)
    if sample_buffer.signatures is not None:
        sample_buffer.signatures.add_backed(found, hits.take(index))
    left = hit.copy()
    left[index] = False
    return left


def add_light(scene: CompiledScene, closures: ClosureHits, sample_buffer: SampleBuffer, stats: Stats) -> None:
    """Add what closures emit, and the light that they get from the lights and the world, rough glass also from behind.
    What was hit, and which lights reach it, goes into the signatures, where anybody asks for these."""
    rays, at = closures.rays, closures.at
    table, signatures = at.table, sample_buffer.signatures
    lit = None if signatures is None else np.zeros(len(rays), np.uint32)
    sent = sent_by_programs(at, stats)  # by which hits, and the radiance
    direct = None
    # What they emit.
    if scene.plan.emission:
        glowing = select(table.emits.take(at.surface))
        if count(glowing, len(rays)):
            sent.append((glowing, at.value("emission", glowing)))
    # What lights and the world bring them; where that was cut, it is residual.
    if scene.plan.local:
        shaded = select(table.shades_locally.take(at.surface))
        if count(shaded, len(rays)):
            seen = at.take(shaded)
            local, sample = seen.value("local"), take(rays.sample, shaded)
            weight = take(rays.throughput, shaded) * local
            may_cut = sample_buffer.budget is not None and scene.plan.faint
            cut = partial(_cut_light, weight, sample, sample_buffer) if may_cut else None
            direct = direct_light(scene, seen, stats, cut, lit is not None, asks_light(sample_buffer))
            sent.append((shaded, local * direct.radiance))
            if len(direct.cut):
                sample_buffer.add_residual(sample[direct.cut], largest_component(weight[:, direct.cut]))
            if lit is not None and direct.lit is not None:
                lit[shaded] = direct.lit
    # What comes through rough glass.
    if scene.plan.rough and scene.plan.specular:
        sent += through_rough_glass(scene, rays, at, stats)
    # All of it together is limited.
    dimming = _dimming(scene, closures, sent)
    for index, radiance in sent:
        weighted = take(rays.throughput, index) * radiance
        if dimming is not None:
            weighted *= take(dimming, index)
        sample_buffer.add_radiance(take(rays.sample, index), weighted, take(rays.branch, index))
    if direct is not None:
        note_random(rays, shaded, weight if dimming is None else weight * take(dimming, shaded), direct, sample_buffer)
    if signatures is not None and lit is not None:
        signatures.add_hits(rays, at.prim, at.face, at.entering, lit)


def _dimming(scene: CompiledScene, closures: ClosureHits, sent: list[tuple[Index, Float32]]) -> Float32 | None:
    """(n,) by what the light that hits send into rays which a surface has sent on is multiplied; None: by 1."""
    limit, rays = scene.arriving.indirect_limit, closures.rays
    if not np.isfinite(limit) or not sent or rays.camera.all():
        return None
    if closures.owner is None and sum(float(np.max(radiance, initial=0)) for _, radiance in sent) <= limit:
        return None
    total = np.zeros((3, len(rays)), np.float32)
    for index, radiance in sent:
        add(total, index, np.broadcast_to(radiance, (3, count(index, len(rays)))))
    if closures.owner is not None and closures.weight is not None:  # all closures of a hit together
        sums = np.zeros((3, int(closures.owner[-1]) + 1), np.float32)
        np.add.at(sums, (slice(None), closures.owner), total * closures.weight)
        total = sums[:, closures.owner]
    brightest = total.max(axis=0)
    too_bright = (brightest > limit) & ~rays.camera
    return np.where(too_bright, np.float32(limit) / np.maximum(brightest, np.float32(limit)), np.float32(1))


def _cut_light(
    weight: Float32, sample: NDArray[np.intp], sample_buffer: SampleBuffer, share: Float32
) -> NDArray[np.intp]:
    """Which hits do without a light that brings them shares (3, n) of what a white wall would send on."""
    return sample_buffer.cut_light(sample, largest_component(weight * share))
