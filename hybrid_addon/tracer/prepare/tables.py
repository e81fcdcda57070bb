# SPDX-License-Identifier: GPL-3.0-or-later
"""A validated scene as tables: the first thing that is made of it, before its plan and before anything is built.

Nothing is made here that a scene does not have: what is not there is None, and costs nothing on the way.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from ...scene import Camera, Expression, Scene, Settings, World
from ..core.cache import SceneCache, key_of
from ..emitters.light import CompiledLight
from ..emitters.lights import compile_lights
from ..emitters.world import CompiledWorld
from ..geometry.flatten import Geometry, flatten
from ..materials.surfaces import SurfaceTable, compile_surfaces, layout
from ..media.fog import CompiledFog, compile_fog
from ..media.nested import Media
from ..media.solids import find_solids
from .plan import Plan, Tables, make_plan
from .texels import with_finite_texels
from .validate import validate


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene as tables, and its plan.

    lights : those that can light anything.   lamps : those that rays can meet.
    fog    : None: there is none.   fog_lights : those that it scatters.
    """

    camera: Camera
    geometry: Geometry
    media: Media
    surfaces: SurfaceTable
    world: CompiledWorld
    lights: list[CompiledLight]
    lamps: list[CompiledLight]
    plan: Plan
    fog: CompiledFog | None
    fog_lights: list[CompiledLight]


def prepare(scene: Scene, settings: Settings, cache: SceneCache | None = None) -> Prepared:
    """Compile a validated scene to tables and plan the work on it. cache: of earlier frames."""
    cache = SceneCache(0) if cache is None else cache
    scene, black_texels = with_finite_texels(scene, cache)
    surfaces, world = compile_surfaces(scene.surfaces), _world(scene.world, cache)
    layouts = [layout(surfaces.surfaces[owner]) for owner in surfaces.owner]
    geometry, media = find_solids(scene, flatten(scene, layouts, cache=cache), surfaces)
    lights = compile_lights((*scene.lights, *world.suns), geometry.center, geometry.object)
    fog = compile_fog(scene.fog, scene.camera, geometry.center)
    scattered = [x for x in lights if x.color.any() and x.light.volume != 0] if fog and fog.scatters else []
    tables = Tables(geometry, media, surfaces, world, lights, fog, scattered)
    plan, lights, lamps = make_plan(scene, settings, tables, black_texels)
    return Prepared(scene.camera, geometry, media, surfaces, world, lights, lamps, plan, fog, scattered)


def describe(scene: Scene, settings: Settings) -> Plan:
    """What a trace of this scene would leave out, with reasons; nothing is traced. Raises as `trace` does."""
    validate(scene, settings, None)
    return prepare(scene, settings).plan


def _world(world: World, cache: SceneCache) -> CompiledWorld:
    """What is the same all around is worked out in no time: nobody needs to hear that it was kept."""
    varies = world.environment is not None or isinstance(world.radiance, Expression)
    return cache.take(("world", key_of(world)), partial(CompiledWorld, world), "world" if varies else "")
