# SPDX-License-Identifier: GPL-3.0-or-later
"""Fog on rays: it dims what they see, and glows by its emission and by the light of the world and of lamps.

Emission and the world's light have a closed form. The light of a lamp is taken at FOG_STEPS random distances along the
ray: half of them where most of what is scattered comes from, half where the lamp is near (equi-angular sampling, Kulla
& Fajardo 2012), weighted by the balance heuristic (Veach 1997). What a lamp sends there is its irradiance on a plane
that faces it, times the Henyey-Greenstein phase function (1941), as in EEVEE (eevee_volume_lib.glsl).

In hybrid pictures EEVEE's half already has the fog before all that is held out: it draws the glow there, and leaves
the mask as the mean of what gets through. So camera rays, up to their first hit, get only their colour from fog: each
channel's transmittance over that mean.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...procedural import elementary
from ...scene import Float32, Float64
from ..core.rays import Rays
from ..core.sampler import Draws, Sampler
from ..core.stats import Stats
from ..core.vectors import ALL, Array, dot, flatnonzero, normalize
from ..emitters.light import CompiledLight
from ..film.samples import SampleBuffer
from ..media.fog import CompiledFog, FogPath
from ..media.nested import innermost
from ..prepare.compiled import CompiledScene
from ..shading.random_light import asks, note_light
from ..shading.shadows import visibility

Bools = NDArray[np.bool_]

FOG_STEPS = 4
"""Places on each ray at which fog asks for the light of each lamp; each sample of a pixel takes others."""

LEAST_HEIGHT = 1e-6
"""A ray passes a lamp no nearer than this share of its distance, as far as choosing places goes: angles stay finite."""

LEAST_DISTANCE = 1e-6
"""Metres: and that distance is no less, where a ray starts in a lamp."""

TOGETHER = 1 << 17
"""So many stretches of rays are worked on at once: with 250 bytes each that is 30 MB, however many bodies overlap."""

PLACES = np.uint32(0x0F06F06F)
"""With a light's key: the sampler's dimension of places on rays that ask for it."""


def through_fog(
    scene: CompiledScene, rays: Rays, t: Float64, hit: Bools, sample_buffer: SampleBuffer, stats: Stats,
    sampler: Sampler | None,
) -> Rays:  # fmt: skip
    """The rays (n,) with what fog leaves of their throughput up to distances t (n,), where they hit something, or all
    the way. What the fog sends into them is added to `sample_buffer`."""
    if scene.fog is None or len(rays) == 0:
        return rays
    size = max(TOGETHER // scene.fog.stretches, 1)
    if len(rays) <= size:
        return _through(scene, scene.fog, rays, t, hit, sample_buffer, stats, sampler)
    left = np.empty_like(rays.throughput)
    for start in range(0, len(rays), size):
        part = slice(start, start + size)
        of_part = _through(scene, scene.fog, rays.take(part), t[part], hit[part], sample_buffer, stats, sampler)
        left[:, part] = of_part.throughput
    return replace(rays, throughput=left)


def _through(
    scene: CompiledScene, fog: CompiledFog, rays: Rays, t: Float64, hit: Bools, sample_buffer: SampleBuffer,
    stats: Stats, sampler: Sampler | None,
) -> Rays:  # fmt: skip
    """`through_fog` of rays that are not too many."""
    distance, first = np.where(hit, t, np.inf), rays.camera & (rays.straight == 0)
    if scene.media.rows:  # in a solid there is none
        distance[innermost(rays.media, scene.media.count) != scene.media.count] = 0.0
    origin, direction, distance = _drawn_part(scene, fog, rays, distance, first)
    path = fog.along(origin, direction, distance, stats)
    left = path.transmittance()
    drawn = first & (scene.settings.camera_sees != "ALL")
    glows = flatnonzero(~drawn)
    if len(glows) and fog.glows:
        seen, path = replace(rays, origin=origin).take(glows), path.take(glows)
        draws = None if sampler is None or len(seen.path) == 0 else sampler.draws(seen.sample, seen.path)
        radiance = path.glow(_ambient(scene, seen, path) if fog.sky else np.zeros((3, 1)))
        for light in scene.fog_lights:
            radiance += _scattered(scene, fog, light, seen, path, draws, stats)
        glow = (seen.throughput * radiance).astype(np.float32)
        sample_buffer.add_radiance(seen.sample, glow, seen.branch)
        if asks(sample_buffer) and scene.fog_lights:
            note_light(seen, ALL, glow, seen.throughput, sample_buffer)
    mean = left.mean(axis=0)
    left = np.where(drawn, np.where(mean > 0, left / np.where(mean > 0, mean, 1.0), 1.0), left)
    return replace(rays, throughput=(rays.throughput * left).astype(np.float32))


def _drawn_part(
    scene: CompiledScene, fog: CompiledFog, rays: Rays, distance: Float64, first: Bools
) -> tuple[Float32, Array, Float64]:
    """Origins, directions and lengths of rays of lengths (n,); of those that come straight from the camera, `first`,
    the part in which EEVEE draws fog."""
    index = flatnonzero(first)
    if len(index) == 0:
        return rays.origin, rays.direction, distance
    camera = np.asarray(scene.camera.matrix_world, np.float64)
    start, direction = rays.origin[:, index].astype(np.float64), rays.direction[:, index].astype(np.float64)
    eye, axis = camera[:3, 3:] - scene.geometry.center[:, None], -camera[:3, 2:3]
    depth, toward = dot(axis, start - eye), dot(axis, direction)
    begins = np.maximum((fog.start - depth) / toward, 0.0)
    ends = np.minimum(distance[index], (fog.reach - depth) / toward)
    origin, distance = rays.origin.copy(), distance.copy()
    origin[:, index] = (start + direction * begins).astype(np.float32)
    distance[index] = np.maximum(ends - begins, 0.0)
    return origin, rays.direction, distance


def _ambient(scene: CompiledScene, rays: Rays, path: FogPath) -> Float64:
    """(3, n) or (3, 1) mean radiance of the world, weighted by the phase function: of its spherical harmonics, those of
    order 1 count g times (EEVEE's volume_phase_function_as_sh_L1)."""
    if not scene.world.gives_light:
        return np.zeros((3, 1))
    direction = rays.direction.astype(np.float32)
    before, behind = (scene.world.irradiance_over_pi(d).astype(np.float64) for d in (direction, -direction))
    mean, turned = (before + behind) / 2, (before - behind) / 2
    # Of irradiance over pi the first order has 2/3 of its weight in radiance. EEVEE's sign is the other way around than
    # for lamps: fog that scatters forward shows the world behind the camera. Measured, 5.2.
    light = mean - 1.5 * path.anisotropy() * turned if turned.any() else mean
    return np.asarray(np.maximum(light, 0.0) * scene.arriving.indirect)


def _scattered(
    scene: CompiledScene,
    fog: CompiledFog,
    light: CompiledLight,
    rays: Rays,
    path: FogPath,
    draws: Draws | None,
    stats: Stats,
) -> Float64:
    """(3, n) radiance that the fog on the way of rays scatters of a lamp."""
    n = len(rays)
    total = np.zeros((3, n))
    concerned = flatnonzero(path.scatters.any(axis=0))
    if len(concerned) == 0:
        return total
    path, origin, direction = path.take(concerned), rays.origin[:, concerned], rays.direction[:, concerned]
    draws = None if draws is None else draws.take(concerned)
    direction = direction.astype(np.float64)
    cone = None if light.is_infinite else _Cone(light, origin, direction, path)
    for part in range(FOG_STEPS):
        square = None if draws is None else draws.square(light.key ^ PLACES, part, FOG_STEPS)
        even = np.full(len(concerned), (part + 0.5) / FOG_STEPS)
        chance, lot = (even, even) if square is None else (numbers.astype(np.float64) for numbers in square)
        if cone is None:
            distance = path.drawn(chance, lot)
            density = path.density(distance)
        else:
            # The lower half of the random numbers draws by what is seen, the upper one by nearness.
            by_light = chance >= 0.5
            distance = np.where(by_light, cone.drawn(2 * chance - 1), path.drawn(np.minimum(2 * chance, 1.0), lot))
            density = (path.density(distance) + cone.density(distance)) / 2
        left, scattering, turned = path.at(distance)
        counts = flatnonzero((density > 0) & (scattering > 0).any(axis=0) & np.isfinite(distance))
        if len(counts) == 0:
            continue
        point = (origin[:, counts] + direction[:, counts] * distance[counts]).astype(np.float32)
        lit = None if draws is None else draws.take(counts).square(light.key, part, FOG_STEPS)
        arriving = _arriving(scene, fog, light, point, direction[:, counts], turned[counts], lit, stats)
        share = left[:, counts] * scattering[:, counts] * arriving / (density[counts] * FOG_STEPS)
        total[:, concerned[counts]] += share
    return total


def _arriving(
    scene: CompiledScene,
    fog: CompiledFog,
    light: CompiledLight,
    point: Float32,
    direction: Float64,
    turned: Float64,
    square: tuple[Float32, Float32] | None,
    stats: Stats,
) -> Float64:
    """(3, n): what fog of scattering 1 per metre at points (3, n) sends against directions (3, n) of a lamp's light."""
    wi = normalize(light.toward(point))
    received = light.into_fog(point).astype(np.float64) * light.light.volume
    result = light.color.astype(np.float64) * (received * phase(dot(direction, wi.astype(np.float64)), turned))
    lit = flatnonzero((result != 0).any(axis=0))
    if len(lit) == 0:
        return result
    result, wi, point = result.copy(), wi[:, lit], point[:, lit]
    soft = light.is_soft and square is not None and scene.settings.shadow_samples > 0
    part = None if square is None or not soft else (square[0][lit], square[1][lit])
    toward, distance = light.shadow_rays(point, wi, part)
    if light.light.cast_shadow and scene.plan.shadows:
        media = None if scene.media.shadow_absorption is None else scene.media.empty(len(lit))
        inside = np.zeros(len(lit), bool)
        seen, _ = visibility(scene, scene.blockers(light), toward, distance, point, inside, media, stats)
        result[:, lit] *= seen
    if fog.shadows and light.light.cast_shadow:
        result[:, lit] *= fog.along(point, toward, distance.astype(np.float64), stats).transmittance()
    return result


def phase(cosine: Float64, g: Float64) -> Float64:
    """Henyey & Greenstein (1941), 1/sr: of light that comes from where a ray goes to, cosine (n,) apart from there."""
    apart = 1 + g * g - 2 * g * cosine
    return np.asarray((1 - g * g) / (4 * np.pi * apart * np.sqrt(apart)))


class _Cone:
    """Distances along rays at equal angles as a lamp sees them, between the ends of what scatters."""

    def __init__(self, light: CompiledLight, origin: Float32, direction: Float64, path: FogPath) -> None:
        toward = light.position.astype(np.float64) - origin
        self._nearest = dot(toward, direction)
        off = toward - direction * self._nearest
        least = LEAST_HEIGHT * np.maximum(np.sqrt(dot(toward, toward)), LEAST_DISTANCE)
        self._height: Float64 = np.maximum(np.sqrt(dot(off, off)), least)
        scatters = path.scatters
        first = np.where(scatters, path.start, np.inf).min(axis=0)
        last = np.where(scatters, path.start + path.length, -np.inf).max(axis=0)
        self._low, self._high = first, last
        self._from, self._to = (elementary.arctan((s - self._nearest) / self._height) for s in (first, last))

    def drawn(self, chance: Float64) -> Float64:
        """Distances (n,) by random numbers (n,)."""
        angle = self._from + np.clip(chance, 0.0, 1.0) * (self._to - self._from)
        return np.asarray(np.clip(self._nearest + self._height * elementary.tan(angle), self._low, self._high))

    def density(self, distance: Float64) -> Float64:
        """(n,) 1/m of `drawn`."""
        width, away = self._to - self._from, distance - self._nearest
        inside = (distance >= self._low) & (distance <= self._high) & (width > 0)
        density: Float64 = self._height / (np.where(width > 0, width, 1.0) * (self._height**2 + away**2))
        density *= inside
        return density
