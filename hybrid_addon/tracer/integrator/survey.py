# SPDX-License-Identifier: GPL-3.0-or-later
"""What needs rays: a coarse picture is traced, and what its rays meet tells which objects a rasteriser cannot draw.

EEVEE, at its best settings, traces in the picture that it has drawn and follows one refraction (its manual: Raytracing,
Limitations). Every ray that the wave loop follows is therefore held against what a screen-space tracer could know; the
share of an object's light that comes by rays that it could not know is the reason to ray trace that object.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Camera, Expression, Float64, Scene, Settings, Surface
from ..core.camera import project
from ..core.constants import SAME_PLACE, SHARP_ROUGHNESS, SURVEY_CUTOFF, SURVEY_PIXELS
from ..core.rays import Rays
from ..core.stats import Stats
from ..core.vectors import Index, largest_component, select, take
from ..film.path_hash import REFLECTED, TRANSMITTED, child_path
from ..film.samples import SampleBuffer
from ..geometry.aggregate import Hits
from ..prepare.compiled import CompiledScene
from ..prepare.validate import validate
from ..shading.closures import closure_path
from ..shading.interaction import Interaction
from .whitted import trace_rays

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]

KINDS = ("OFF_SCREEN", "UNSEEN", "MIRRORS", "BEHIND", "REFRACTED")
"""Light that comes: mirrored, from what the picture does not show; mirrored, from what EEVEE leaves out of reflections
(blended and refracting materials); by two mirrors; through this body from another one that refracts; by more than one
refraction, or a reflection within."""


@dataclass(frozen=True, eq=False)
class Survey:
    """Of each object (instances, then spheres, then planes), o in all.

    pixels : (o,) of the coarse picture that show it, out of `all_pixels`.
    shares : (kinds, o) 0..1, the share of its light of each of KINDS.   needs : (o,) the share of all of them together.
    rays   : (o,) camera rays and those that follow from them, per pixel that shows it.
    build, seconds_per_ray : what it cost here, on one thread: building, and tracing, shadow rays included.
    """

    pixels: Numbers
    all_pixels: int
    shares: Float64
    needs: Float64
    rays: Float64
    build: float
    seconds_per_ray: float


def survey(
    scene: Scene, settings: Settings, blended: frozenset[str], check: Callable[[], None] = lambda: None
) -> Survey:
    """Trace a coarse picture of the whole scene with these settings' depth and cutoff, and take stock.

    blended : names of surfaces that EEVEE draws blended.   check : called now and then; raises to stop.
    Raises ValueError for scenes that cannot be traced.
    """
    camera = _coarse(scene.camera)
    settings = replace(
        settings, camera_sees="ALL", samples=1, transparent=False, cutoff=max(settings.cutoff, SURVEY_CUTOFF)
    )
    scene = replace(scene, camera=camera)
    validate(scene, settings, None)
    began = time.perf_counter()
    compiled = CompiledScene(scene, settings)
    build = time.perf_counter() - began
    began = time.perf_counter()
    watch = _Watch(compiled, scene, blended)
    _trace(compiled, watch, check)
    seconds = time.perf_counter() - began
    lit = np.maximum(watch.pixels, 1)
    return Survey(
        pixels=watch.pixels,
        all_pixels=camera.resolution[0] * camera.resolution[1],
        shares=watch.shares / lit,
        needs=watch.needs / lit,
        rays=watch.rays / lit,
        build=build,
        seconds_per_ray=seconds / max(1, watch.followed),
    )


def _coarse(camera: Camera) -> Camera:
    """The same view in about SURVEY_PIXELS pixels."""
    width, height = camera.resolution
    scale = min(1.0, (SURVEY_PIXELS / (width * height)) ** 0.5)
    size = max(1, round(width * scale)), max(1, round(height * scale))
    return replace(camera, resolution=size, window=(0, 0, *size))


def _trace(scene: CompiledScene, watch: _Watch, check: Callable[[], None]) -> None:
    width, height = scene.camera.resolution
    n = width * height
    pixel = np.arange(n)
    stats = Stats()
    with np.errstate(all="ignore"):
        x, y = (np.asarray(place + 0.5, np.float64) for place in (pixel % width, pixel // width))
        rays = scene.camera_rays(x, y, stats, signed=True)
        sample_buffer = SampleBuffer.zeros(n, 1, scene.settings.cutoff, depth=scene.settings.max_depth)
        trace_rays(scene, [rays], scene.seen_by_camera, sample_buffer, stats, check, watch)


@dataclass(eq=False)
class _Way:
    """How n rays came about. told : (kinds, n), what was counted on the way already."""

    reflections: NDArray[np.int16]
    refractions: NDArray[np.int16]
    told: Bools

    def take(self, index: Index) -> _Way:
        return _Way(take(self.reflections, index), take(self.refractions, index), take(self.told, index))


def _least_roughness(surface: Surface) -> float:
    """Of its closures; what varies counts as rough."""
    if surface.closures:
        return min(_least_roughness(closure.surface) for closure in surface.closures)
    return 1.0 if isinstance(surface.roughness, Expression) else surface.roughness


class _Watch:
    """Looks at each wave of rays, and counts by the object that their pixel shows."""

    def __init__(self, compiled: CompiledScene, scene: Scene, blended: frozenset[str]) -> None:
        self.scene, n = compiled, compiled.camera.resolution[0] * compiled.camera.resolution[1]
        surfaces = compiled.surfaces.surfaces
        blends = np.array([s.name in blended for s in surfaces])
        self.refracts = compiled.surfaces.refracts
        self.unseen = self.refracts | (blends & compiled.surfaces.transmits)
        follows = compiled.settings.rough_samples > 0
        self.sharp = np.array([follows or _least_roughness(s) <= SHARP_ROUGHNESS for s in surfaces])
        objects = len(scene.instances) + len(scene.spheres) + len(scene.planes)
        self.owner, self.place, self.counts = np.full(n, -1), np.full((3, n), np.inf), np.zeros(n, bool)
        self.pixels, self.rays, self.followed = np.zeros(objects, np.intp), np.zeros(objects), 0
        self.shares, self.needs = np.zeros((len(KINDS), objects)), np.zeros(objects)
        self.keys = np.zeros(0, np.uint64)
        self.ways = _Way(np.zeros(0, np.int16), np.zeros(0, np.int16), np.zeros((len(KINDS), 0), bool))
        self.straight = np.zeros(0, np.int16)

    def __call__(self, rays: Rays, hits: Hits, chosen: Index, at: Interaction | None, _children: Rays) -> None:
        """One wave."""
        hit = np.arange(len(rays))[chosen] if at is not None else np.zeros(0, np.intp)
        first = self.followed == 0
        if first:
            self._begin(rays, hit, at)
        way = self._begun(len(rays)) if first else self._continued(rays)
        self.followed += len(rays)
        owner = self.owner[rays.sample]
        np.add.at(self.rays, owner[owner >= 0], 1)
        if not first:
            self._count(rays, way, self._kinds(way, owner, hit, at))
        if at is not None:
            self._expect(rays, way, hit)

    def _begin(self, rays: Rays, hit: Numbers, at: Interaction | None) -> None:
        """Camera rays: which object each pixel shows, where, and whether it is one to judge: rough ones are not."""
        if at is None:
            return
        sample = rays.sample[hit]
        self.owner[sample] = self.scene.geometry.object[at.prim]
        self.place[:, sample] = at.point
        self.counts[sample] = self.sharp[at.surface]
        np.add.at(self.pixels, self.owner[sample], 1)

    def _begun(self, n: int) -> _Way:
        return _Way(np.zeros(n, np.int16), np.zeros(n, np.int16), np.zeros((len(KINDS), n), bool))

    def _continued(self, rays: Rays) -> _Way:
        """How these rays came about. One that went straight through something is still what it was."""
        found = np.searchsorted(self.keys, _key(rays.sample, rays.path[0]))
        way = self.ways.take(found)
        straight = rays.straight > self.straight[found]
        way.refractions[straight] -= 1
        return way

    def _expect(self, rays: Rays, way: _Way, hit: Numbers) -> None:
        """Both rays that each hit may send on, in the order of their keys."""
        parents, way = rays.take(hit), way.take(hit)
        most = max(1, int(np.max(self.scene.surfaces.closure_count)))
        paths = [closure_path(parents.path, np.array([part])) for part in range(most)]
        keys = [_key(parents.sample, child_path(p, kind)[0]) for kind in (REFLECTED, TRANSMITTED) for p in paths]
        every, half = np.concatenate(keys), len(paths) * len(hit)
        order = np.argsort(every)
        self.keys, self.straight = every[order], np.tile(parents.straight, len(keys))[order]
        one, none = np.ones(half, np.int16), np.zeros(half, np.int16)
        self.ways = _Way(
            (np.tile(way.reflections, len(keys)) + np.concatenate([one, none]))[order],
            (np.tile(way.refractions, len(keys)) + np.concatenate([none, one]))[order],
            np.tile(way.told, len(keys))[:, order],
        )

    def _kinds(self, way: _Way, owner: Numbers, hit: Numbers, at: Interaction | None) -> Bools:
        """(kinds, n) which of KINDS the rays of a wave are of."""
        kinds = np.zeros((len(KINDS), len(owner)), bool)
        kinds[4] = way.refractions + np.minimum(way.reflections, way.refractions) >= 2
        if at is None:
            return kinds
        mirrored = (way.refractions == 0)[hit]
        once = mirrored & (way.reflections == 1)[hit]
        unseen = self.unseen[at.surface]
        kinds[0, hit] = once & ~unseen & ~self._on_screen(at.point)
        kinds[1, hit] = once & unseen
        kinds[2, hit] = mirrored & (way.reflections >= 2)[hit]
        other = self.scene.geometry.object[at.prim] != owner[hit]
        kinds[3, hit] = (way.refractions >= 1)[hit] & at.entering & other & self.refracts[at.surface]
        return kinds

    def _count(self, rays: Rays, way: _Way, kinds: Bools) -> None:
        """Add the light of rays to their objects' accounts, each kind once on its way."""
        index = select(self.counts[rays.sample])
        owner, weight = self.owner[take(rays.sample, index)], largest_component(take(rays.throughput, index))
        told, new = way.told[:, index], kinds[:, index]
        np.add.at(self.needs, owner, weight * (new.any(axis=0) & ~told.any(axis=0)))
        for number in range(len(KINDS)):
            np.add.at(self.shares[number], owner, weight * (new[number] & ~told[number]))
        way.told |= kinds

    def _on_screen(self, point: Float64) -> Bools:
        """Whether points (3, n) are what the picture shows where they lie in it."""
        camera, center = self.scene.camera, self.scene.geometry.center
        width, height = camera.resolution
        x, y, depth = project(camera, point + center[:, None])
        i, j = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
        inside = (i >= 0) & (i < width) & (j >= 0) & (j < height) & (depth > 0)
        shown = self.place[:, np.where(inside, j * width + i, 0)]
        distance = np.sqrt(((shown - point) ** 2).sum(axis=0))
        left, right = camera.view_plane[:2]
        scale = depth if camera.projection == "PERSP" else np.full(len(depth), right - left)
        return inside & (distance < SAME_PLACE * scale)


def _key(sample: Numbers, path: NDArray[np.uint32]) -> NDArray[np.uint64]:
    """A ray's number in the whole picture."""
    return (sample.astype(np.uint64) << np.uint64(32)) | path
