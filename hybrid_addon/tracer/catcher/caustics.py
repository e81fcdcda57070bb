# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics: the light that ray traced objects bend or mirror onto everything else, by photons from the lights.

Each light sends photons into the cones that balls around the ray traced objects fill (Jensen 1996, projection maps): a
photon counts if the first ray traced primitive that it meets lies in its own ball, so that balls may overlap. It takes
one way through the objects, drawn by its share of the light, and ends where it meets anything that is not ray traced.
If it has been bent or mirrored on its way, and the camera sees the place, its power goes to the pixel that shows it,
over the area that this pixel shows. Photons that went straight through are in the traced shadows already.

Sources: Arvo 1986 (light from the lights); Veach 1997, 8.3.2 (particles seen by a camera).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Camera, Float32, Float64
from ..core.camera import project, spread_on_lens
from ..core.constants import MAX_STRAIGHT_CROSSINGS, SHADOW_REACH
from ..core.rays import DIFFUSE, Rays, camera_rays, concatenate, offset_origin, traceable
from ..core.sampler import UInt32, hash32
from ..core.stats import Stats
from ..core.vectors import dot, largest_component, select, take
from ..emitters.light import CompiledLight
from ..parallel.pool import workers
from ..prepare.compiled import CompiledScene
from ..shading.closures import closures_at
from ..shading.evaluate import surface_hits
from ..shading.interaction import Interaction
from ..shading.shadows import visibility
from ..shading.spawn import children, share_out
from .caster_bounds import BoundingBalls, find_caster_bounds
from .photon_emission import emit

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]

CHUNK = 1 << 15
"""Photons that a thread traces at once; sums are in the order of the chunks, whoever works on them."""

PILOT = 1 << 10
"""So many photons tell how much light of each light goes to each group; all are shared out by that."""

WAVELENGTH_SALT = np.uint32(0x510E527F)
LENS_SALTS = (np.uint32(0x27D4EB2F), np.uint32(0x165667B1))
"""What makes two random numbers of one for a point on the lens."""

KERNEL = np.array([1, 4, 6, 4, 1]) / 16
"""Photons are spread over 5 x 5 pixels by it, across and up: a standard deviation of one pixel."""

STEPS = (1, 2, 4)
"""Where photons are few they are spread again, with the kernel so many pixels wide, up to a deviation of 4.6 pixels."""

ENOUGH = 64
"""Few are less than so many in a kernel: an error of 12 %. Bright caustics have many and stay sharp (as in Jensen 1996,
where the nearest photons are looked for)."""


@dataclass(frozen=True, eq=False)
class _Beam:
    """Photons of one light to one group, `count` in all."""

    light: CompiledLight
    group: BoundingBalls
    key: UInt32
    count: int


def caustic(scene: CompiledScene, mask: Float32 | None, stats: Stats, check: Callable[[], None]) -> Float32:
    """`Film.caustic` (h, w, 3): irradiance by light that ray traced objects bend or mirror; 0 within the mask.

    mask  : (h, w) coverage of the ray traced objects; None: unknown.   check : called now and then; raises to stop.
    """
    x0, y0, x1, y1 = scene.camera.window
    width, height = x1 - x0, y1 - y0
    total = np.zeros((5, height * width))  # three channels, the number of photons, and where any can be seen
    total[4] = 1 if mask is None else np.asarray(mask).reshape(-1) < 1
    tracer = _Tracer(scene)
    # Trace chunks of photons, and add them up in the order of the chunks.
    work = [(beam, first) for beam in _beams(scene) for first in range(0, beam.count, CHUNK)]
    threads = workers(scene.settings)
    with ThreadPoolExecutor(threads, thread_name_prefix="hybrid-photons") as pool:
        for start in range(0, len(work), 2 * threads):  # few at once: stopping must not wait for all
            check()
            for pixel, share, counted in pool.map(tracer.run, work[start : start + 2 * threads]):
                stats.merge(counted)
                for channel in range(3):
                    total[channel] += np.bincount(pixel, share[channel], minlength=height * width)
                total[3] += np.bincount(pixel, minlength=height * width)
    # Spread them over the pixels around.
    picture = _smooth(total.reshape(5, height, width)).transpose(1, 2, 0).astype(np.float32)
    return picture


def _beams(scene: CompiledScene) -> list[_Beam]:
    """The photons shared out among lights and groups of casters, in proportion to the light that may come from them."""
    salt = hash32(np.array([scene.settings.seed & 0xFFFFFFFF], np.uint32))
    if not (scene.plan.reflection or scene.plan.refraction):
        return []
    beams, light = [], []
    caster_bounds = find_caster_bounds(scene)
    for lamp in scene.lights:
        for rank, group in enumerate(caster_bounds):
            key = hash32(salt ^ lamp.key ^ np.uint32(rank))
            beams.append(_Beam(lamp, group, key, 0))
            power = emit(lamp, group, np.arange(PILOT, dtype=np.uint32), key).power
            light.append(float(np.abs(power).sum()) if lamp.light.cast_shadow else 0.0)  # lamps may be negative
    if not sum(light):
        return []
    counts = [round(scene.settings.photons * share / sum(light)) for share in light]
    return [_Beam(b.light, b.group, b.key, count) for b, count in zip(beams, counts, strict=True) if count]


class _Tracer:
    """Photons from lights to pixels."""

    def __init__(self, scene: CompiledScene) -> None:
        self.scene = scene
        self.targets, self.everything = scene.photon_targets()
        self.plain = scene.raster_view(shadowed=False)  # what stands between the lights and the objects
        _ = scene.solids  # built before threads ask for it

    def run(self, work: tuple[_Beam, int]) -> tuple[Numbers, Float64, Stats]:
        """A chunk of a beam: pixels (m,), irradiances (3, m) that they get."""
        beam, first = work
        number = np.arange(first, min(first + CHUNK, beam.count), dtype=np.uint32)
        stats = Stats()
        with stats.phase("shade"), np.errstate(all="ignore"):
            return *self._run(beam, number, stats), stats

    def _run(self, beam: _Beam, number: UInt32, stats: Stats) -> tuple[Numbers, Float64]:
        """The same of the photons `number` (n,)."""
        # Send photons from the light.
        emitted = emit(beam.light, beam.group, number, beam.key)
        power = emitted.power / beam.count
        origin, direction = emitted.origin.astype(np.float32), emitted.direction.astype(np.float32)
        sound = traceable(origin, direction) & (power != 0).any(axis=0)
        n = len(number)
        media = self.scene.media.around_camera(origin, direction, lambda: self.scene.solids, stats)
        endless = np.full(n, np.inf, np.float32)
        rays = camera_rays(
            origin, direction, endless, np.arange(n), media, True, mixed=self.scene.surfaces.mixes_glass,
            asked=self.scene.asks_rays,
        )  # fmt: skip
        rays.history[DIFFUSE : DIFFUSE + 1] = 1  # a path from the eye would have left what they light to any side
        rays = rays.take(np.flatnonzero(sound))
        stats.add("photons", n)
        draw = hash32(number ^ hash32(beam.key ^ np.uint32(0xC2B2AE35)))
        travelled, bent, wave = np.zeros(n), np.zeros(n, bool), 0
        pixels, shares = [np.zeros(0, np.intp)], [np.zeros((3, 0))]
        while len(rays):
            # Find the closest hit of each: first what they are sent to, then anything; solids absorb on the way.
            hits = (self.everything if wave else self.targets).nearest(rays.origin, rays.direction, stats)
            hit = hits.prim >= 0
            if wave == 0:
                hit &= np.isin(hits.prim, beam.group.members)
                if beam.light.blocks is not None:
                    hit &= beam.light.blocks.take(hits.prim, mode="wrap")
            rays = self.scene.media.absorbed(rays, hits.t, hit)
            chosen = np.flatnonzero(hit)
            if len(chosen) == 0:
                break

            # Recompute the hits from the exact geometry.
            rays, hits = rays.take(chosen), hits.take(chosen)
            at, t = surface_hits(self.scene, rays, hits), hits.t
            travelled[rays.sample] += t

            # What stands before the objects takes its share.
            if wave == 0:
                rays = self._arrived(beam, rays, at, t, stats)

            # Those that were bent or mirrored and land on anything else go to the pixels that show the place.
            ray_traced = self.scene.geometry.ray_traced[at.prim]
            lit = True if beam.light.receives is None else beam.light.receives[at.prim]
            landed = np.flatnonzero(~ray_traced & bent[rays.sample] & lit)
            left = beam.light.photon_fading(travelled[rays.sample[landed]])
            carried = power[:, rays.sample[landed]] * rays.throughput[:, landed] * left
            pixel, share = self._seen(at.take(landed), carried, draw[rays.sample[landed]], stats)
            pixels.append(pixel)
            shares.append(share)

            # Those on ray traced objects go on.
            on = np.flatnonzero(ray_traced)
            rays = self._onward(rays.take(on), at.take(on), t[on], draw, bent, wave, stats)
            rays = rays.take(select(traceable(rays.origin, rays.direction)))
            wave += 1
        return np.concatenate(pixels), np.concatenate(shares, axis=1)

    def _arrived(self, beam: _Beam, rays: Rays, at: Interaction, t: Float64, stats: Stats) -> Rays:
        """The photons without what objects that are not ray traced take on their way from the light."""
        back = np.ascontiguousarray(-rays.direction, np.float32)
        distance = (np.full(len(t), np.inf) if beam.light.is_infinite else t).astype(np.float32)
        blockers = self.plain.blockers(beam.light)
        share, _ = visibility(self.plain, blockers, back, distance, at.outer, ~at.entering, None, stats)
        return replace(rays, throughput=rays.throughput * share)

    def _onward(
        self, rays: Rays, at: Interaction, t: Float64, draw: UInt32, bent: Bools, wave: int, stats: Stats
    ) -> Rays:
        """Each photon goes one way, reflected or transmitted, drawn by what they carry; the rest is absorbed."""
        # Draw one closure, then one of the two ways, and let it carry the light of all.
        salt = hash32(np.array([~np.uint32(wave)], np.uint32))
        chance = hash32(draw[rays.sample] ^ salt).astype(np.float64) * 2.0**-32
        wavelength = hash32(draw[rays.sample] ^ WAVELENGTH_SALT).astype(np.float64) * 2.0**-32
        closure = closures_at(self.scene, rays, at, t, most=1, chance=chance, wavelength=wavelength)
        rays, at, t = closure.rays, closure.at, closure.t
        split = share_out(self.scene, rays, at)
        reflected, transmitted = largest_component(split.reflected), largest_component(split.transmitted)
        total = reflected + transmitted
        salt = hash32(np.array([wave + 1], np.uint32))
        chance = hash32(draw[rays.sample] ^ salt).astype(np.float64) * 2.0**-32
        mirrored = chance * total < reflected
        may_bounce = rays.depth < self.scene.settings.max_depth
        mirrors = mirrored & may_bounce & (total > 0)
        passes = (
            ~mirrored & (transmitted > 0) & np.where(split.bends, may_bounce, rays.straight < MAX_STRAIGHT_CROSSINGS)
        )
        drawn = replace(
            split,
            reflected=split.reflected * (total / np.where(mirrors, reflected, np.inf)).astype(np.float32),
            transmitted=split.transmitted * (total / np.where(passes, transmitted, np.inf)).astype(np.float32),
        )
        bent[rays.sample] |= mirrors | (passes & split.bends)
        return concatenate(children(self.scene, rays, at, t, drawn, mirrors, passes, stats))

    def _seen(self, at: Interaction, power: Float64, draw: UInt32, stats: Stats) -> tuple[Numbers, Float64]:
        """Pixels (m,) that show places (n,) which got `power` (3, n), on their lit sides, and irradiances (3, m).

        Each is seen from one point of the camera's lens, chosen by its random number (n,).
        """
        camera, center = self.scene.camera, self.scene.geometry.center
        # Where they lie in the picture, seen from there.
        x0, y0, x1, y1 = camera.window
        place, on_lens = at.point + center[:, None], None
        if camera.lens is not None:
            u, v = (hash32(draw ^ salt).astype(np.float64) * 2.0**-32 for salt in LENS_SALTS)
            on_lens = spread_on_lens(camera.lens, u, v)
        x, y, depth = project(camera, place, on_lens)
        i, j = np.floor(x) - x0, np.floor(y) - y0
        # Which of them are in it, on the side that is seen, and not hidden.
        to_eye, distance = _to_eye(camera, place, on_lens)
        cosine = dot(to_eye, at.n_geometric.astype(np.float64))
        inside = (i >= 0) & (i < x1 - x0) & (j >= 0) & (j < y1 - y0)
        chosen = np.flatnonzero(inside & (cosine > 0) & (depth > camera.clip_start) & (depth < camera.clip_end))
        normal, point = take(at.n_geometric, chosen).astype(np.float64), take(at.point, chosen)
        start = offset_origin(point, normal, take(at.offset, chosen))
        reach = (take(distance, chosen) * SHADOW_REACH).astype(np.float32)
        toward = take(to_eye, chosen).astype(np.float32)
        hidden = self.scene.seen_by_camera.backwards().occluded(start, toward, reach, stats)
        chosen = chosen[~hidden]
        # Their power, over the area that the pixel shows.
        area = footprint(camera, depth[chosen], distance[chosen], cosine[chosen])
        pixel = (j[chosen] * (x1 - x0) + i[chosen]).astype(np.intp)
        return pixel, power[:, chosen] / area


def _to_eye(camera: Camera, point: Float64, on_lens: tuple[Float64, Float64] | None = None) -> tuple[Float64, Float64]:
    """Unit directions (3, n) from world points (3, n) to the camera, or to these points of its lens; distances (n,)."""
    matrix = np.asarray(camera.matrix_world, np.float64)
    across, up, axis, eye = (matrix[:3, i, None] for i in range(4))
    depth = dot(axis, eye - point)
    way = eye - point if camera.projection == "PERSP" else axis * depth
    if on_lens is not None and camera.lens is not None:
        # An orthographic camera has a lens before each point of its film.
        share = 1.0 if camera.projection == "PERSP" else depth / camera.lens.focus_distance
        way = way + (across * on_lens[0] + up * on_lens[1]) * share
    distance = np.sqrt(dot(way, way))
    return way / distance, distance


def footprint(camera: Camera, depth: Float64, distance: Float64, cosine: Float64) -> Float64:
    """The area (n,), m^2, that a pixel shows of a surface seen at `cosine` (n,) of its normal.

    A pixel of area a on the view plane at depth 1 subtends a (depth / distance)^3, over distance^2 / cosine of surface.
    """
    left, right, bottom, top = camera.view_plane
    a = (right - left) * (top - bottom) / (camera.resolution[0] * camera.resolution[1])
    if camera.projection == "ORTHO":
        return np.asarray(a / cosine)
    return np.asarray(a * (depth * depth * depth) / (distance * cosine))


def _smooth(total: Float64) -> Float64:
    """Irradiance (3, h, w), spread as little as there are ENOUGH photons; see `caustic` for total (5, h, w).

    Pixels in which none can be seen take no part.
    """
    result, variance = np.zeros_like(total[:3]), 0.0
    few = total[4] > 0
    for step in STEPS:
        total, variance = _spread(total, step), variance + step * step
        result[:, few] = total[:3, few] / total[4, few]
        few = few & (total[3] * (4 * np.pi * variance) < ENOUGH)  # so many pixels are under such a Gaussian
        if not few.any():
            break
    return result


def _spread(picture: Float64, step: int) -> Float64:
    """Convolve (k, h, w) with KERNEL, every step-th pixel, across and up; what would leave the picture comes back."""
    for axis in (1, 2):
        n, reach = picture.shape[axis], 2 * step
        place = np.arange(-reach, n + reach)
        place = np.where(place < 0, -1 - place, place)
        inside = np.clip(np.where(place >= n, 2 * n - 1 - place, place), 0, n - 1)
        padded = picture.take(inside, axis=axis)
        parts = (w * padded.take(range(k * step, k * step + n), axis=axis) for k, w in enumerate(KERNEL))
        picture = np.asarray(sum(parts))
    return picture
