"""The wave loop: Whitted's ray tree, one generation of rays at a time, in the style of pbrt's wavefront integrator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32, Float64
from .accel import traceable
from .compiled import CompiledScene
from .constants import MAX_STRAIGHT_PASSES, MISS
from .interaction import Interaction, interact
from .media import relative_ior
from .primitives import Hits, PrimitiveSet
from .rays import Rays, concatenate
from .scattering import fresnel_dielectric, keep_outside, reflect, refract
from .shading import local_radiance
from .tally import Tally
from .vectors import Index, count, normalize, select, take


@dataclass(eq=False)
class Sums:
    """What the samples of m pixels add up to, in float64 and in a fixed order for each pixel.

    radiance : (3, m)   seen : (m,) samples that count   residual : (m,) throughput that was cut off
    """

    radiance: Float64
    seen: Float64
    residual: Float64

    @classmethod
    def zeros(cls, m: int) -> Sums:
        """Nothing yet."""
        return cls(np.zeros((3, m)), np.zeros(m), np.zeros(m))

    def add_radiance(self, pixel: NDArray[np.intp], contribution: Float32) -> None:
        """Add (3, n) to pixels (n,); bincount adds one after the other, so the order is that of the arrays."""
        for channel in range(3):
            weights = np.broadcast_to(contribution[channel], pixel.shape)
            self.radiance[channel] += np.bincount(pixel, weights, minlength=len(self.seen))

    def add_residual(self, pixel: NDArray[np.intp], throughput: Float32) -> None:
        """Note throughput (3, n) that was cut off: its largest channel, so that L_max times it bounds the error."""
        self.residual += np.bincount(pixel, throughput.max(axis=0), minlength=len(self.seen))


def trace_rays(
    scene: CompiledScene, rays: Rays, first_seen: PrimitiveSet, sums: Sums, tally: Tally, check: Callable[[], None]
) -> None:
    """Follow camera rays to their ends and add what they find to `sums`.

    first_seen : what camera rays can hit first.   check : called once a wave; raises to stop.
    """
    first = True
    while len(rays):
        check()
        # Keep rays that Embree can digest; what a lost one could have brought is part of the error bound.
        rays = _drop_untraceable(rays, sums, tally)

        # Find the closest hit of each ray.
        hits = _closest_hits(scene, rays, first_seen if first else scene.seen_by_camera, tally)
        hit = hits.prim >= 0
        if first:
            # Of the camera rays only those count that meet something the tracer is to show.
            rays, hits, hit = _count_camera_rays(scene, rays, hits, hit, sums)
            first = False

        # Let escaped rays see the world.
        _add_escaped(scene, rays, select(~hit), sums)

        # Recompute the hits from the exact geometry.
        chosen = select(hit)
        if count(chosen, len(rays)) == 0:
            return
        rays_hit = rays.take(chosen)
        at = interact(scene.geometry, hits, rays, chosen)

        # Add emitted and local light.
        _add_light(scene, rays_hit, at, sums, tally)

        # Spawn at most one reflected and one transmitted ray from each hit.
        rays = concatenate(_spawn(scene, rays_hit, at, take(hits.t, chosen), sums, tally))


def _drop_untraceable(rays: Rays, sums: Sums, tally: Tally) -> Rays:
    sound = traceable(rays.origin, rays.direction)
    if sound.all():
        return rays
    lost = rays.take(np.flatnonzero(~sound))
    tally.add("dropped", len(lost))
    sums.add_residual(lost.pixel, lost.throughput)
    return rays.take(np.flatnonzero(sound))


def _closest_hits(scene: CompiledScene, rays: Rays, by_camera: PrimitiveSet, tally: Tally) -> Hits:
    """Nearest hits; camera rays and later rays may see different sets, and camera rays end at the clip plane."""
    later = scene.seen_by_secondary
    if by_camera is later or rays.camera.all():
        hits = by_camera.nearest(rays.origin, rays.direction, tally)
    elif not rays.camera.any():
        return later.nearest(rays.origin, rays.direction, tally)
    else:
        n = len(rays)
        hits = Hits(np.empty(n, np.int32), np.empty(n), np.empty((3, n)), np.empty(n))
        for members, primitives in ((rays.camera, by_camera), (~rays.camera, later)):
            index = np.flatnonzero(members)
            part = primitives.nearest(rays.origin[:, index], rays.direction[:, index], tally)
            hits.prim[index], hits.t[index] = part.prim, part.t
            hits.normal[:, index], hits.toward[index] = part.normal, part.toward
    beyond = hits.t > rays.t_max
    hits.prim[beyond] = MISS
    return hits


def _count_camera_rays(
    scene: CompiledScene, rays: Rays, hits: Hits, hit: NDArray[np.bool_], sums: Sums
) -> tuple[Rays, Hits, NDArray[np.bool_]]:
    """Count the samples that saw something and drop the others."""
    if scene.settings.see == "FLAGGED":
        counts = hit & scene.geometry.ray_traced.take(hits.prim, mode="wrap") if hit.any() else hit
    elif scene.settings.transparent:
        counts = hit
    else:
        counts = np.ones(len(rays), bool)
    kept = select(counts)
    rays = rays.take(kept)
    sums.seen += np.bincount(rays.pixel, minlength=len(sums.seen))
    hits = Hits(take(hits.prim, kept), take(hits.t, kept), take(hits.normal, kept), take(hits.toward, kept))
    return rays, hits, take(hit, kept)


def _add_escaped(scene: CompiledScene, rays: Rays, escaped: Index, sums: Sums) -> None:
    """Add the world's radiance; behind a see-through film a ray that passed straight through all sees no world."""
    if count(escaped, len(rays)) == 0:
        return
    gone = rays.take(escaped)
    if scene.settings.see == "ALL" and scene.settings.transparent and gone.camera.any():
        straight = gone.take(select(gone.camera))
        sums.seen -= np.bincount(straight.pixel, straight.throughput.max(axis=0), minlength=len(sums.seen))
        gone = gone.take(select(~gone.camera))
    if len(gone) and not scene.world.is_black:
        sums.add_radiance(gone.pixel, gone.throughput * scene.world.radiance(gone.direction))


def _add_light(scene: CompiledScene, rays: Rays, at: Interaction, sums: Sums, tally: Tally) -> None:
    table = scene.surfaces
    if scene.plan.emission:
        glowing = select(table.emits.take(at.surface))
        if count(glowing, len(rays)):
            emission = table.emission.take(take(at.surface, glowing), axis=1)
            sums.add_radiance(take(rays.pixel, glowing), take(rays.throughput, glowing) * emission)
    if scene.plan.local:
        shaded = select(table.shades_locally.take(at.surface))
        if count(shaded, len(rays)):
            seen = at.take(shaded)
            weight = take(rays.throughput, shaded) * table.local.take(seen.surface)
            sums.add_radiance(take(rays.pixel, shaded), weight * local_radiance(scene, seen, tally))


# ------------------------------------------------------------------------------------------------ new rays


def _spawn(scene: CompiledScene, rays: Rays, at: Interaction, t: Float64, sums: Sums, tally: Tally) -> list[Rays]:
    """The next wave: reflected, then refracted, then straight rays, each kind in the order of its hits."""
    table, plan = scene.surfaces, scene.plan
    waves = []
    if plan.reflection or plan.refraction:
        # Share the light out among the mirror, the interface's reflection and its transmission.
        interface = table.interface.take(at.surface)
        optical = (interface > 0) & ~table.straight.take(at.surface)
        fresnel = np.zeros(len(rays), np.float32)
        bent = select(optical)
        if count(bent, len(rays)):
            cos_i, eta = _angle_and_eta(scene, at, bent)
            exact = fresnel_dielectric(cos_i, eta)
            fresnel[bent] = exact
        if plan.reflection:
            weight = rays.throughput * (table.mirror.take(at.surface, axis=1) + interface * fresnel)
            waves.append(_reflected(scene, rays, at, weight, sums, tally))
        if plan.refraction:
            weight = rays.throughput * (table.tint.take(at.surface, axis=1) * (interface * (1 - fresnel)))
            waves.append(_refracted(scene, rays, at, weight, optical, sums, tally))
            waves.append(_straight(rays, at, weight, ~optical, t, sums, tally))
    return waves or [rays.take(np.zeros(0, np.intp))]


def _angle_and_eta(scene: CompiledScene, at: Interaction, index: Index) -> tuple[Float64, Float64]:
    """Cosine of incidence on the shading normal and eta (n,), in float64."""
    wo, n = take(at.wo, index), take(at.n_shading, index)
    cos_i = wo[0].astype(np.float64) * n[0] + wo[1].astype(np.float64) * n[1] + wo[2].astype(np.float64) * n[2]
    eta = relative_ior(scene.surfaces.ior.take(take(at.surface, index)), take(at.entering, index))
    return np.clip(cos_i, 0, 1), eta


def _allowed(rays: Rays, weight: Float32, wanted: NDArray[np.bool_], limit: NDArray[np.bool_], sums: Sums) -> Index:
    """Index of the hits that may spawn a ray: a weight left, and within limits; what the limit cuts is residual."""
    wanted = wanted & (weight != 0).any(axis=0)
    cut = np.flatnonzero(wanted & ~limit)
    if len(cut):
        sums.add_residual(rays.pixel[cut], weight[:, cut])
    return select(wanted & limit)


def _child(rays: Rays, index: Index, origin: Float32, direction: Float32, weight: Float32) -> Rays:
    """Rays one bounce deeper."""
    n = origin.shape[1]
    return Rays(
        origin=origin,
        direction=direction,
        throughput=take(weight, index),
        pixel=take(rays.pixel, index),
        depth=take(rays.depth, index) + np.int16(1),
        passes=take(rays.passes, index),
        t_max=np.full(n, np.inf, np.float32),
        camera=np.zeros(n, bool),
    )


def _reflected(scene: CompiledScene, rays: Rays, at: Interaction, weight: Float32, sums: Sums, tally: Tally) -> Rays:
    wanted = scene.surfaces.reflects.take(at.surface)
    index = _allowed(rays, weight, wanted, rays.depth < scene.settings.max_depth, sums)
    wo, n_geometric = take(at.wo, index), take(at.n_geometric, index)
    direction = normalize(reflect(wo, take(at.n_shading, index)))
    if at.n_shading is not at.n_geometric:
        direction = keep_outside(direction, n_geometric, wo)
    tally.add("reflected", direction.shape[1])
    return _child(rays, index, take(at.outer, index), direction, weight)


def _refracted(
    scene: CompiledScene,
    rays: Rays,
    at: Interaction,
    weight: Float32,
    optical: NDArray[np.bool_],
    sums: Sums,
    tally: Tally,
) -> Rays:
    index = _allowed(rays, weight, optical, rays.depth < scene.settings.max_depth, sums)
    cos_i, eta = _angle_and_eta(scene, at, index)
    wo, n_geometric = take(at.wo, index), take(at.n_geometric, index)
    bent = refract(wo.astype(np.float64), take(at.n_shading, index).astype(np.float64), cos_i, eta)
    direction = normalize(bent).astype(np.float32)
    if at.n_shading is not at.n_geometric:
        direction = keep_outside(direction, -n_geometric, wo)
    tally.add("refracted", direction.shape[1])
    return _child(rays, index, at.inner(index), direction, weight)


def _straight(
    rays: Rays, at: Interaction, weight: Float32, straight: NDArray[np.bool_], t: Float64, sums: Sums, tally: Tally
) -> Rays:
    """Rays through index-matched surfaces: the same ray goes on behind, and no bounce is spent."""
    index = _allowed(rays, weight, straight, rays.passes < MAX_STRAIGHT_PASSES, sums)
    child = _child(rays, index, at.inner(index), take(rays.direction, index), weight)
    child.depth -= np.int16(1)
    child.passes = child.passes + np.int16(1)
    child.t_max = (take(rays.t_max, index) - take(t, index)).astype(np.float32)
    child.camera = take(rays.camera, index)
    tally.add("straight", len(child))
    return child
