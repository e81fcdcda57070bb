# SPDX-License-Identifier: GPL-3.0-or-later
"""What needs rays: a coarse picture is traced, and what its rays meet tells which objects a rasteriser cannot draw.

EEVEE, at its best settings, traces in the picture that it has drawn and follows one refraction (its manual: Raytracing,
Limitations). Every ray that the wave loop follows is therefore held against what a screen-space tracer could know; the
share of an object's light that comes by rays that it could not know is the reason to ray trace that object.

What goes straight through a surface is not its light but that of what lies behind: each camera ray shows as many
objects as it passes, each by the share of the light that stays with it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Camera, Expression, Float64, Scene, Settings, Surface
from ..core.camera import project
from ..core.constants import MIRROR_ROUGHNESS, SAME_PLACE, SURVEY_CUTOFF, SURVEY_PIXELS
from ..core.rays import TRANSMISSIONS, Rays
from ..core.sampler import Sampler, pixel_keys
from ..core.stats import Stats
from ..core.vectors import Index, largest_component
from ..film.samples import SampleBuffer
from ..geometry.hits import Hits
from ..prepare.compiled import CompiledScene
from ..prepare.validate import validate
from ..shading.interaction import Interaction
from .whitted import trace_rays

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]

KINDS = ("OFF_SCREEN", "UNSEEN", "MIRRORS", "BEHIND", "REFRACTED")
"""Light that comes: mirrored, from what the picture does not show; mirrored, from what EEVEE leaves out of reflections
(blended and refracting materials); by two mirrors; through this body from another one that refracts; by more than one
refraction, or a reflection within."""

TAG = 4
"""The row of `Rays.history` after its own: a survey's ray keeps there its number in its wave, and so its children know
whose they are."""


@dataclass(frozen=True, eq=False)
class Worn:
    """Of each surface that an object shows, w such pairs in all: what `Survey` says of whole objects.

    object, surface : (w,) their numbers in the scene.   pixels, needs, rays : (w,).
    """

    object: Numbers
    surface: Numbers
    pixels: Float64
    needs: Float64
    rays: Float64


@dataclass(frozen=True, eq=False)
class Survey:
    """Of each object (instances, then spheres, then planes), o in all.

    pixels : (o,) of the coarse picture that show it, out of `all_pixels`, each by the share of its light that is the
             object's: what lies behind a see-through one has the rest.
    shares : (kinds, o) 0..1, the share of its light of each of KINDS.   needs : (o,) the share of all of them together.
    if_rough : (o,) what `needs` would be if rays followed rough surfaces, too; the same where they do.
    rays   : (o,) camera rays that meet it and all that follow from them, also straight through it, in all.
    front  : (height, width) the object of which each pixel shows most, -1 where it shows none.
    build, seconds_per_ray : what it cost here, on one thread: building, and tracing, shadow rays included.
    worn   : the same by the surfaces of each.
    """

    pixels: Float64
    all_pixels: int
    shares: Float64
    needs: Float64
    if_rough: Float64
    rays: Float64
    front: Numbers
    build: float
    seconds_per_ray: float
    worn: Worn


def survey(
    scene: Scene, settings: Settings, blended: frozenset[str], check: Callable[[], None] = lambda: None
) -> Survey:
    """Trace a coarse picture of the whole scene with these settings' depth and cutoff, and take stock.

    blended : names of surfaces that EEVEE draws blended.   check : called now and then; raises to stop.
    Raises ValueError for scenes that cannot be traced.
    """
    camera, follows_rough = coarse(scene.camera, SURVEY_PIXELS), settings.rough_samples > 0
    settings = replace(
        settings, camera_sees="ALL", samples=1, transparent=False, cutoff=max(settings.cutoff, SURVEY_CUTOFF),
        rough_samples=max(settings.rough_samples, 1),
    )  # fmt: skip
    scene = replace(scene, camera=camera)
    validate(scene, settings, None)
    began = time.perf_counter()
    compiled = CompiledScene(scene, settings)
    compiled.build_all()
    build = time.perf_counter() - began
    watch = _Watch(compiled, scene, blended, follows_rough)
    _trace(compiled, watch, check)
    return watch.found(camera.resolution, build)


def coarse(camera: Camera, pixels: float) -> Camera:
    """The whole view of a camera in about so many pixels, or in its own if these are fewer."""
    width, height = camera.resolution
    scale = min(1.0, math.sqrt(pixels / (width * height)))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    return replace(camera, resolution=size, window=(0, 0, *size))


def _trace(scene: CompiledScene, watch: _Watch, check: Callable[[], None]) -> None:
    settings, (width, height) = scene.settings, scene.camera.resolution
    n = width * height
    x, y = np.arange(n) % width, np.arange(n) // width
    stats, sampler = Stats(), Sampler(pixel_keys(x, y, settings.seed), settings.first, 1)
    with np.errstate(all="ignore"):
        film_x, film_y = (np.asarray(place + 0.5, np.float64) for place in (x, y))
        rays = scene.camera_rays(film_x, film_y, stats, signed=True)
        rays = replace(rays, history=np.zeros((TAG + 1, n), np.float32))
        rays.history[TAG] = np.arange(n)
        sample_buffer = SampleBuffer.zeros(
            n, 1, settings.cutoff, depth=settings.max_depth, first=settings.rough_samples + 1, sampler=sampler
        )
        draws = sampler if scene.plan.draws else None
        trace_rays(scene, [rays], scene.seen_by_camera, sample_buffer, stats, check, watch, draws)


def _least_roughness(surface: Surface) -> float:
    """Of its closures and its coat; what varies counts as rough. Only what is layered mirrors or refracts by it."""
    if surface.closures:
        return min(_least_roughness(closure.surface) for closure in surface.closures)
    if not surface.layered:
        return 0.0
    known = [surface.roughness, *([surface.coat_roughness] if surface.coat_shows and surface.coat != 0 else [])]
    return min(1.0 if isinstance(roughness, Expression) else roughness for roughness in known)


@dataclass(eq=False)
class _Views:
    """The v places at which camera rays have met surfaces so far: what a pixel shows, front to back.

    owner, surface : (v,) the object, and what it wears there.
    weight : (v,) the share of the pixel's light that is its own.
    behind : (v,) the view in front of it, which the ray has passed straight; -1: none.
    sharp  : (v,) its surface mirrors or refracts by rays even where rough ones are left to the world's blurred image.
    told   : (kinds, v) of its light, how much is of each of KINDS, and `needs` (v,) of any.   rays : (v,) from it on.
    """

    owner: Numbers
    surface: Numbers
    weight: Float64
    behind: Numbers
    sharp: Bools
    told: Float64
    needs: Float64
    rays: Float64

    @classmethod
    def of(cls, owner: Numbers, surface: Numbers, weight: Float64, behind: Numbers, sharp: Bools) -> _Views:
        """New ones, of which nothing is told."""
        v = len(owner)
        return cls(owner, surface, weight, behind, sharp, np.zeros((len(KINDS), v)), np.zeros(v), np.ones(v))

    def joined(self, others: _Views) -> _Views:
        """These and others, in this order."""
        parts = ([getattr(each, name) for each in (self, others)] for name in self.__dataclass_fields__)
        return _Views(*(np.concatenate(part, axis=-1) for part in parts))

    def rays_through(self) -> Float64:
        """(v,) rays from each view on, and from those behind it."""
        total, source = self.rays.copy(), np.flatnonzero(self.behind >= 0)
        whose = self.behind[source]
        while len(source):
            np.add.at(total, whose, self.rays[source])
            further = self.behind[whose]
            source, whose = source[further >= 0], further[further >= 0]
        return total


class _Watch:
    """Looks at each wave of rays, and counts by the views that they come from.

    The rays of a wave are the children of the one before, in an order of their own: TAG says whose they are.
    view : (n,) of each ray the last view on its way from the camera; -1: none yet.
    told : (kinds, n) bool, what has been counted on its way.
    """

    def __init__(self, compiled: CompiledScene, scene: Scene, blended: frozenset[str], follows_rough: bool) -> None:
        self.scene, n = compiled, compiled.camera.resolution[0] * compiled.camera.resolution[1]
        surfaces = compiled.surfaces.surfaces
        blends = np.array([s.name in blended for s in surfaces])
        self.refracts = compiled.surfaces.refracts
        self.unseen = self.refracts | (blends & compiled.surfaces.transmits)
        self.sharp = np.array([follows_rough or _least_roughness(s) <= MIRROR_ROUGHNESS for s in surfaces])
        self.objects = len(scene.instances) + len(scene.spheres) + len(scene.planes)
        self.place, self.shown, self.front = np.full((3, n), np.inf), np.zeros(n), np.full(n, -1)
        self.began, self.rays = time.perf_counter(), 0
        nothing = np.zeros(0, np.intp)
        self.views = _Views.of(nothing, nothing, np.zeros(0), nothing, np.zeros(0, bool))
        self.view, self.told = np.full(n, -1), np.zeros((len(KINDS), n), bool)

    def __call__(self, _: Rays, rays: Rays, hits: Hits, chosen: Index, at: Interaction | None, children: Rays) -> None:
        """One wave."""
        tag = rays.history[TAG].astype(np.intp)
        view, told = self.view[tag], self.told[:, tag]
        hit = np.arange(len(rays))[chosen] if at is not None else np.zeros(0, np.intp)
        bent = ~rays.camera & (view >= 0)
        np.add.at(self.views.rays, view[bent], 1)
        self._count(rays, view, told, self._kinds(rays, view, hit, at) & bent)
        if at is not None:
            self._meet(rays, hit, at, view, children)
        # What the children come from.
        parent = children.history[TAG].astype(np.intp)
        self.view[tag], self.told[:, tag] = view, told
        self.view, self.told = self.view[parent], self.told[:, parent]
        children.history[TAG] = np.arange(len(children))
        self.rays += len(rays)

    def _meet(self, rays: Rays, hit: Numbers, at: Interaction, view: Numbers, children: Rays) -> None:
        """Camera rays meet surfaces: these are views of their own, by the share of the light that does not go on."""
        met = np.flatnonzero(rays.camera[hit])
        ray, tag = hit[met], rays.history[TAG].astype(np.intp)
        passed = np.zeros(len(self.view))
        straight = children.camera
        light = largest_component(children.throughput[:, straight])
        np.add.at(passed, children.history[TAG, straight].astype(np.intp), light)
        weight = np.maximum(largest_component(rays.throughput[:, ray]) - passed[tag[ray]], 0.0)
        surface, known = at.surface[met], len(self.views.owner)
        owner = self.scene.geometry.object[at.prim[met]].astype(np.intp)
        self.views = self.views.joined(_Views.of(owner, surface, weight, view[ray], self.sharp[surface]))
        view[ray] = known + np.arange(len(ray))
        # Where the picture shows most of what it shows there.
        sample = rays.sample[ray]
        more = weight > self.shown[sample]
        self.shown[sample[more]], self.place[:, sample[more]] = weight[more], at.point[:, met[more]]
        self.front[sample[more]] = owner[more]

    def _kinds(self, rays: Rays, view: Numbers, hit: Numbers, at: Interaction | None) -> Bools:
        """(kinds, n) which of KINDS the rays of a wave are of. One that went straight on is still what it was."""
        refractions = rays.history[TRANSMISSIONS].astype(np.intp)
        reflections = rays.depth - refractions
        kinds = np.zeros((len(KINDS), len(rays)), bool)
        kinds[4] = refractions + np.minimum(reflections, refractions) >= 2
        if at is None:
            return kinds
        mirrored = (refractions == 0)[hit]
        once = mirrored & (reflections == 1)[hit]
        unseen = self.unseen[at.surface]
        kinds[0, hit] = once & ~unseen & ~self._on_screen(at.point)
        kinds[1, hit] = once & unseen
        kinds[2, hit] = mirrored & (reflections >= 2)[hit]
        owner = np.append(self.views.owner, -1)[view[hit]]
        other = self.scene.geometry.object[at.prim] != owner
        kinds[3, hit] = (refractions >= 1)[hit] & at.entering & other & self.refracts[at.surface]
        return kinds

    def _count(self, rays: Rays, view: Numbers, told: Bools, kinds: Bools) -> None:
        """Add the light of rays to the accounts of their views, each kind once on its way."""
        new = kinds & ~told
        index = np.flatnonzero(new.any(axis=0))
        whose, weight = view[index], largest_component(rays.throughput[:, index])
        np.add.at(self.views.needs, whose, weight * ~told[:, index].any(axis=0))
        for number in range(len(KINDS)):
            np.add.at(self.views.told[number], whose, weight * new[number, index])
        told |= kinds

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

    def found(self, size: tuple[int, int], build: float) -> Survey:
        """What all waves have told, by objects. size: width and height of the picture."""
        views = self.views

        def of(values: Float64) -> Float64:
            return np.bincount(views.owner, values, minlength=self.objects)

        # A tint above 1 brings more light than the surface shows of what is white: a share is a share of what it shows.
        pixels = of(views.weight)
        lit = np.where(pixels > 0, pixels, 1)
        needs, shares = np.minimum(views.needs, views.weight), np.minimum(views.told, views.weight)
        return Survey(
            pixels=pixels,
            all_pixels=size[0] * size[1],
            shares=np.array([of(share * views.sharp) for share in shares]) / lit,
            needs=of(needs * views.sharp) / lit,
            if_rough=of(needs) / lit,
            rays=of(views.rays_through()),
            front=self.front.reshape(size[::-1]),
            build=build,
            seconds_per_ray=(time.perf_counter() - self.began) / max(self.rays, 1),
            worn=self._worn(needs * views.sharp),
        )

    def _worn(self, needs: Float64) -> Worn:
        """needs: (v,)."""
        views, surfaces = self.views, len(self.sharp)
        key, number = np.unique(views.owner * surfaces + views.surface, return_inverse=True)

        def of(values: Float64) -> Float64:
            return np.bincount(number.reshape(-1), values, minlength=len(key))

        pixels = of(views.weight)
        share = of(needs) / np.where(pixels > 0, pixels, 1)
        return Worn(key // max(surfaces, 1), key % max(surfaces, 1), pixels, share, of(views.rays_through()))
