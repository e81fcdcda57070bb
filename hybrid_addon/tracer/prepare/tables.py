# SPDX-License-Identifier: GPL-3.0-or-later
"""A validated scene as tables: the first thing that is made of it, before its plan and before anything is built.

Nothing is made here that a scene does not have: what is not there is None, and costs nothing on the way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...expressions import reads_of_instance
from ...scene import Camera, Expression, Float64, Scene, Settings, Surface, World
from ..core.cache import SceneCache, key_of
from ..emitters.light import CompiledLight
from ..emitters.lights import compile_lights
from ..emitters.world import CompiledWorld
from ..geometry.embree import QUERIES, has_kernels
from ..geometry.flatten import Geometry, flatten
from ..geometry.instanced import saved_by_instancing
from ..geometry.parts import closed_by_number
from ..kernels import loading
from ..materials.surfaces import SurfaceTable, compile_surfaces, layout
from ..media.fog import CompiledFog, compile_fog
from ..media.nested import Media
from ..media.solids import find_solids
from .plan import Plan, Tables, make_plan
from .texels import with_finite_texels
from .validate import validate

Bools = NDArray[np.bool_]


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
    geometry = flatten(scene, layouts, cache=cache, apart=_apart(scene, surfaces))
    geometry, media = find_solids(scene, geometry, surfaces)
    geometry = replace(
        geometry,
        object_values=object_values(scene, surfaces.surfaces),
        enclosed=_enclosed(scene, surfaces),
    )
    lights = compile_lights((*scene.lights, *world.suns), geometry.center, geometry.object)
    fog = _fog(scene, geometry.center, cache)
    scattered = [x for x in lights if x.color.any() and x.light.volume != 0] if fog and fog.scatters else []
    tables = Tables(geometry, media, surfaces, world, lights, fog, scattered)
    plan, lights, lamps = make_plan(scene, settings, tables, black_texels)
    return Prepared(scene.camera, geometry, media, surfaces, world, lights, lamps, plan, fog, scattered)


def _apart(scene: Scene, surfaces: SurfaceTable) -> Bools | None:
    """(s,) the surfaces whose closed bodies are worked on one by one: solids swell where they touch others, and are
    looked for once anything refracts or absorbs (see `find_solids`). None: there are too few instances to keep meshes
    once, or no kernels, which alone find them."""
    load_what_finds_instances(scene)
    if not saved_by_instancing(scene) or not has_kernels():
        return None
    solids = surfaces.bounds_solids
    return solids & (solids & (surfaces.refracts | surfaces.absorbs)).any()


def _enclosed(scene: Scene, surfaces: SurfaceTable) -> Bools | None:
    """(objects,) of bodies whose walls let light through and scatter it those that are closed: their insides see what
    is around them through their walls alone."""
    worn = surfaces.owner[surfaces.translucent | surfaces.admits]
    found, known = np.zeros(len(scene.names), bool), dict[int, bool]()
    for number, instance in enumerate(scene.instances if len(worn) else ()):
        if not np.isin(worn, instance.surfaces).any():
            continue
        if instance.mesh not in known:
            known[instance.mesh] = closed_by_number(scene.meshes[instance.mesh].triangles.astype(np.intp))
        found[number] = known[instance.mesh]
    for number, ball in enumerate(scene.spheres, len(scene.instances)):
        found[number] = ball.surface in worn
    return found if found.any() else None


def load_what_finds_instances(scene: Scene) -> None:
    """Wait for the kernels that ask Embree, where a scene gains by instances: spreading them out would take longer.
    They come before all others: a second or two, and what the one in work still needs."""
    if not has_kernels() and saved_by_instancing(scene):
        loading.load(QUERIES)


def object_values(scene: Scene, surfaces: Sequence[Surface]) -> dict[str, Float64]:
    """What surfaces read of instances, key -> (objects, width): 0 for those that have none."""
    found: dict[str, Float64] = {}
    for key in sorted(set().union(*(reads_of_instance(surface) for surface in surfaces))):
        if key in MATRICES:
            rows = np.tile(np.eye(3, 4), (len(scene.names), 1, 1))
            matrices = np.array([i.matrix_world for i in scene.instances], np.float64).reshape(-1, 4, 4)
            rows[: len(matrices)] = MATRICES[key](matrices)[:, :3]
            found[key] = rows.reshape(-1, 12)
            continue
        values = [i.values.get(key, ()) for i in scene.instances]
        found[key] = np.zeros((len(scene.names), max((len(v) for v in values), default=0) or 1))
        for number, value in enumerate(values):
            found[key][number, : len(value)] = value
    return found


def _inverses(matrices: Float64) -> Float64:
    """(k, 4, 4); 0 of those that have none."""
    usable = np.isfinite(matrices).all(axis=(1, 2))
    usable[usable] = np.linalg.det(matrices[usable, :3, :3]) != 0
    result = np.zeros_like(matrices)
    result[usable] = np.linalg.inv(matrices[usable])
    return result


MATRICES: dict[str, Callable[[Float64], Float64]] = {
    "OBJECT_TO_WORLD": lambda matrices: np.nan_to_num(matrices),
    "WORLD_TO_OBJECT": _inverses,
}


def describe(scene: Scene, settings: Settings) -> Plan:
    """What a trace of this scene would leave out, with reasons; nothing is traced. Raises as `trace` does."""
    validate(scene, settings, None)
    return prepare(scene, settings).plan


def _world(world: World, cache: SceneCache) -> CompiledWorld:
    """What is the same all around is worked out in no time: nobody needs to hear that it was kept."""
    varies = world.environment is not None or isinstance(world.radiance, Expression)
    return cache.take(("world", key_of(world)), partial(CompiledWorld, world), "world" if varies else "")


def _fog(scene: Scene, center: Float64, cache: SceneCache) -> CompiledFog | None:
    """Only where there are bodies it takes time: trees of their surfaces, which no camera changes."""
    key = ("fog", key_of(scene.fog), center.tobytes())
    return cache.take(key, partial(compile_fog, scene.fog, scene.camera, center))
