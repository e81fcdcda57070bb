# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene prepared to trace: recentred geometry, tables, lights, and one primitive set for each kind of ray."""

from __future__ import annotations

import copy
import threading
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...expressions import casts_rays, reads_ray
from ...scene import Camera, Float32, Float64, Scene, Settings
from ..core.cache import PREPARED, SceneCache
from ..core.camera import NOTHING, generate_rays, near_plane
from ..core.constants import MIRROR_ROUGHNESS
from ..core.rays import Rays, camera_rays, traceable
from ..core.stats import Stats
from ..core.vectors import select
from ..emitters.light import CompiledLight
from ..emitters.screen_space import ScreenSpaceLookup
from ..film.samples import DRAWN_LIGHT, SHADOWED_LIGHT
from ..geometry.aggregate import PrimitiveSet
from ..geometry.hits import Hits
from ..geometry.trees import divides
from .footprint import require_memory, triangles_by_mesh
from .plan import Plan
from .tables import load_what_finds_instances, prepare


class ShadowCasters(NamedTuple):
    """What stands in the way of a light.

    casts  : all of it, but for what changes no light.
    opaque : (np,) bool, what of it ends a shadow ray; the rest tints it.   tints : there is a rest.
    hollow : (count + 1,) bool, solids that do not stand in its way; None: all do.
    """

    casts: PrimitiveSet
    opaque: NDArray[np.bool_]
    tints: bool
    hollow: NDArray[np.bool_] | None = None


class CompiledScene:
    """Everything that worker threads share; read only after construction.

    geometry, media, surfaces, world, lights, plan : see their modules; `lights` holds those that can light anything.
    lamps : lights that reflected and refracted rays can meet.   linked_lamps : not all of them light everything.
    asks_rays : surfaces ask how the rays came that see them.
    fog, fog_lights : fog, or None, and the lights that it scatters.
    seen_by_camera, seen_by_secondary : what camera rays and all later rays can hit.
    occluders : what hides the world from points, or None: nothing does.
    bodies    : what probes for light that goes on within bodies meet, or None: there are none (`shading.subsurface`).
    screen_space : what raster-backed hits are looked up in, or None.
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        cache: SceneCache | None = None,
        pixels: int | None = None,
    ) -> None:
        """cache: what an earlier frame has left, and what this one leaves. pixels: to be traced; None: all.

        Raises NotEnoughMemory, before anything is built, for a scene that does not fit.
        """
        x0, y0, x1, y1 = scene.camera.window
        pixels = (x1 - x0) * (y1 - y0) if pixels is None else pixels
        load_what_finds_instances(scene)
        require_memory(scene, settings, pixels, cache)
        self.settings, self.arriving = settings, scene.arriving
        self.names, self.matrices = scene.names, [i.matrix_world for i in scene.instances]
        self.asks_rays = any(reads_ray(surface) for surface in scene.surfaces)
        self._kept = SceneCache(0) if cache is None else cache
        self._kept.begin(triangles_by_mesh(scene).total())
        prepared = prepare(scene, settings, self._kept)
        self.camera = prepared.camera
        self.geometry, self.surfaces, self.world = prepared.geometry, prepared.surfaces, prepared.world
        self.media = prepared.media
        if any(casts_rays(surface) for surface in scene.surfaces):
            self.geometry = replace(self.geometry, cast=self._cast)
            seen = [[thing.visibility.raycast for thing in of] for of in (scene.instances, scene.spheres, scene.planes)]
            self._met_by_casts = np.concatenate([np.array(of, bool) for of in seen])[self.geometry.object]
        self.plan = prepared.plan
        if self.plan.ambient and self.surfaces.blurs.any():
            self.world.prepare_glossy(*self.surfaces.blur_roughness)
        if self.plan.world and settings.rough_samples == 0 and self.surfaces.rough.any():
            self.world.prepare_glossy(MIRROR_ROUGHNESS, 1.0)
        self.lights = prepared.lights if self.plan.diffuse or self.plan.specular else []
        self.lamps = prepared.lamps
        self.fog, self.fog_lights = prepared.fog, prepared.fog_lights
        self.linked_lamps = any(lamp.receives is not None for lamp in self.lamps)
        self._divided = divides(self.geometry, settings.samples, pixels)
        self._sets: dict[bytes, PrimitiveSet] = {}
        self._lock = threading.Lock()
        self._make_sets()
        self.screen_space = self._backing(scene) if self.plan.screen_space else None
        self.plan = self._with_unchanged()
        if settings.denoise:
            plan, passes = self.plan, settings.passes
            if plan.rough or plan.lit_fog or plan.probed or self.camera.lens is not None:
                passes |= DRAWN_LIGHT
            if plan.soft_shadows or plan.occlusion:
                passes |= SHADOWED_LIGHT
            self.settings = replace(settings, passes=passes)

    def _make_sets(self) -> None:
        g, table = self.geometry, self.surfaces
        solid = self.media.rank < self.media.count
        self._solid = solid if len(solid) else np.zeros(len(g.surface), bool)
        self._culled, self._shadow_culled = (of[g.surface] & ~self._solid for of in (table.culled, table.shadow_culled))
        self.seen_by_camera = self._set(g.camera)
        self.seen_by_secondary = self._set(g.secondary if self.plan.secondary else np.zeros_like(g.secondary))
        hides = g.secondary & ~self.surfaces.transmits[g.surface]
        self.occluders = self._set(hides) if self.plan.occlusion else None
        self.bodies = self._set(g.camera | g.secondary) if self.plan.probed else None
        self._casts_meet = (
            None if g.cast is None else self._set((g.camera | g.secondary | g.shadow) & self._met_by_casts)
        )
        self._all_cast = bool(g.shadow.all())
        self._make_shadow_sets(g.shadow, np.zeros_like(g.shadow))

    def _cast(self, origin: Float32, direction: Float32) -> Hits:
        """What rays of expressions hit first, whatever it is."""
        assert self._casts_meet is not None
        return self._casts_meet.nearest(origin, direction, Stats())

    def _make_shadow_sets(self, casts: NDArray[np.bool_], blocks: NDArray[np.bool_]) -> None:
        """Let the primitives `casts` (np,) cast shadows, and `blocks` (np,) of them opaque ones whatever they are."""
        g, table = self.geometry, self.surfaces
        opaque, clear = table.shadow_opaque[g.surface] | blocks, table.shadow_clear[g.surface] & ~blocks
        if self.media.shadow_absorption is not None:
            clear = clear & (self.media.rank == self.media.count)  # even a clear solid displaces one that absorbs

        def blockers(members: NDArray[np.bool_], hollow: NDArray[np.bool_] | None = None) -> ShadowCasters:
            members = members & ~clear
            seen = self._lit(members).backwards()  # shadow rays go against the light
            return ShadowCasters(seen, opaque, bool((members & ~opaque).any()), hollow)

        self._blockers = blockers(casts if self.plan.shadows else np.zeros_like(casts))
        asking = (*self.lights, *self.lamps, *self.fog_lights)
        linked = [(light.key, light.blocks) for light in asking if light.blocks is not None]
        self._linked = {int(key): blockers(casts & blocks, self.media.bounded_by(~blocks)) for key, blocks in linked}

    @property
    def blockers_of_all(self) -> ShadowCasters:
        """What casts shadows in the light of all lamps that are not linked."""
        return self._blockers

    def blockers(self, light: CompiledLight) -> ShadowCasters:
        """What casts shadows in the light of a lamp."""
        return self._blockers if light.blocks is None else self._linked[int(light.key)]

    def casts_shadow(self, light: CompiledLight) -> NDArray[np.bool_] | None:
        """(np,) the primitives that cast shadows in the light of a lamp; None: all of them."""
        if light.blocks is not None:
            return self.geometry.shadow & light.blocks
        return None if self._all_cast else self.geometry.shadow

    def _backing(self, scene: Scene) -> ScreenSpaceLookup | None:
        """What raster-backed hits are looked up in."""
        if scene.raster is None:
            return None
        g = self.geometry
        veils = g.camera & ~g.ray_traced & self.surfaces.transmits[g.surface]
        seen = self._set(veils).backwards()  # asked from what is seen to the eye
        return ScreenSpaceLookup(scene.camera, scene.raster, self.settings.filter_radius, g, self.surfaces, seen)

    def _set(self, members: NDArray[np.bool_]) -> PrimitiveSet:
        """What of the primitives `members` (np,) is to be seen."""
        return self._all(members).without_backs(self._culled)

    def _lit(self, members: NDArray[np.bool_]) -> PrimitiveSet:
        """What of them is in the way of light."""
        return self._all(members).without_backs(self._shadow_culled)

    def _all(self, members: NDArray[np.bool_]) -> PrimitiveSet:
        """A primitive set, built once however many kinds of ray share it."""
        key = np.packbits(members).tobytes()
        if key not in self._sets:
            self._sets[key] = PrimitiveSet(self.geometry, members, self._kept, self._divided)
        return self._sets[key]

    def _with_unchanged(self) -> Plan:
        """The plan, which says now what of an earlier frame could be used."""
        found = self._kept.found
        return self.plan.with_unchanged(found, found[PREPARED])

    def seen_from(self, camera: Camera, settings: Settings) -> CompiledScene:
        """The same scene for another camera and other samples, depth or cutoff; `camera_sees` and `transparent` must
        agree."""
        other = copy.copy(self)
        other.camera, other.settings = camera, settings
        return other

    def shaded(self, shadow: Float32, caustic: Float32 | None) -> CompiledScene:
        """The same scene, whose raster has shadows and light (h, w, 3) that are not drawn in it but will be in the
        picture."""
        if self.screen_space is None:
            return self
        other = copy.copy(self)
        other.screen_space = self.screen_space.shaded(shadow, caustic)
        return other

    def raster_view(self, shadowed: bool) -> CompiledScene:
        """What a rasteriser draws: all but the ray traced objects, with the shadows that these cast on it or without.

        With photons, no shadow ray goes through what they are to bend.
        """
        other = self.seen_from(
            self.camera, replace(self.settings, camera_sees="RASTER", adaptive=0.0, passes=frozenset())
        )
        g = self.geometry
        other.seen_by_camera = self._set(g.camera & ~g.ray_traced)
        secondary = g.secondary & ~g.ray_traced
        other.seen_by_secondary = self._set(secondary if self.plan.secondary else np.zeros_like(secondary))
        other.screen_space = other.occluders = None  # the raster is what is being worked out
        bends = g.ray_traced & self.surfaces.refracts[g.surface]
        blocks = bends if self.settings.caustics == "PHOTONS" else np.zeros_like(bends)
        if blocks.any() or not shadowed:
            other._make_shadow_sets(g.shadow if shadowed else g.shadow & ~g.ray_traced, blocks)
        return other

    def photon_targets(self) -> tuple[PrimitiveSet, PrimitiveSet]:
        """What photons are sent to, and all that they may meet on their ways from there."""
        g = self.geometry
        caster_bounds = g.shadow & g.ray_traced
        return self._lit(caster_bounds), self._lit(caster_bounds | ((g.shadow | g.camera) & ~g.ray_traced))

    @cached_property
    def solids(self) -> PrimitiveSet:
        """The surfaces of all solids, to find those around the camera; built when first asked for."""
        with self._lock:
            return self._set(self._solid)

    @cached_property
    def ray_traced_only(self) -> PrimitiveSet:
        """What camera rays see when everything that is not ray traced steps aside; built when first asked for."""
        with self._lock:
            return self._set(self.geometry.camera & self.geometry.ray_traced)

    def camera_rays(
        self,
        x: Float64,
        y: Float64,
        stats: Stats | None = None,
        sample: NDArray[np.intp] | None = None,
        on_lens: tuple[Float64, Float64] | None = None,
        signed: bool = False,
        branched: int = 0,
    ) -> Rays:
        """Camera rays through film positions x, y (n,), in pixels of the full frame; some may not be traceable.

        stats  : what counts while the solids around the camera are looked for; None: they are not asked for.
        sample : (n,) which each belongs to; None: its own.   on_lens : see `generate_rays`.
        signed : their paths are asked for.   branched : so many rows of branches are (see `Rays`).
        """
        geometry, n = self.geometry, len(x)
        radius = geometry.bounds_radius if self.fog is None else max(geometry.bounds_radius, self.fog.radius)
        origin, direction, t_max = generate_rays(self.camera, x, y, geometry.center, radius, on_lens)
        media = self.media.empty(n)
        if stats is not None and self.camera_in_solid:
            media = self.media.around_camera(origin, direction, lambda: self.solids, stats)
        sample = np.arange(n) if sample is None else sample
        rays = camera_rays(
            origin, direction, t_max, sample, media, signed, branched, self.linked_lamps, self.surfaces.mixes_glass,
            self.asks_rays,
        )  # fmt: skip
        if self.camera.panorama is not None:
            rays.throughput[:, t_max == NOTHING] = 0  # black beside a fisheye's circle
        return rays

    def shown(self, pixels: NDArray[np.intp], stats: Stats) -> tuple[Rays, Hits]:
        """What rays through the centres of pixels (n,) of the window hit first, through a pinhole, between the clip
        planes: the rays that hit something, (m,), their `sample` being the pixel's number among the n, and their hits.
        """
        x0, y0, x1, _ = self.camera.window
        row, column = np.divmod(pixels, x1 - x0)
        rays = self.camera_rays(np.add(x0 + 0.5, column, dtype=np.float64), np.add(y0 + 0.5, row, dtype=np.float64))
        rays = rays.take(select(traceable(rays.origin, rays.direction)))
        hits = self.seen_by_camera.nearest(rays.origin, rays.direction, stats)
        hit = select((hits.prim >= 0) & ~(hits.t > rays.t_max))
        return rays.take(hit), hits.take(hit)

    @property
    def camera_in_solid(self) -> bool:
        """Whether the camera may be in a solid."""
        return self.media.rows > 0 and self.media.meet(*near_plane(self.camera, self.geometry.center))

    def build_all(self) -> None:
        """Build now what is built when first asked for: a forked process cannot."""
        if self.plan.shadows and self.geometry.normals is not None:
            _ = self.geometry.heights
        if self.camera_in_solid:
            _ = self.solids
