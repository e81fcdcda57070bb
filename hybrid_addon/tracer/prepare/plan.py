"""What a scene does not need, found out before anything is built to trace it.

Only surfaces that rays can reach count: those that camera rays can stop at, and, if one of these reflects or transmits,
all that secondary rays can meet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ...scene import RGB, Camera, Expression, Lens, Scene, Settings, Texture, World
from ..core.cache import SceneCache, key_of
from ..emitters.light import CompiledLight
from ..emitters.lights import compile_lights
from ..emitters.screen_space import backable
from ..emitters.world import CompiledWorld
from ..geometry.flatten import Geometry, flatten
from ..materials.surfaces import SurfaceTable, compile_surfaces, expressions_of, layout
from ..media.nested import Media
from ..media.solids import find_solids
from .light_culling import bounds_of, can_reach
from .object_culling import unmet
from .prunings import BY_NAME, PRUNINGS
from .texels import with_finite_texels
from .validate import validate

Skipped = list[dict[str, object]]


@dataclass(frozen=True)
class Plan:
    """Which stages of the wave loop run at all.

    reflection, refraction : spawn such rays (refraction includes straight passes through IOR 1).
    secondary : build what they can meet.   weightless : spawn them even where they carry nothing.
    ambient, diffuse, specular : terms of local shading that can differ from 0.   emission : add it.
    world     : add the light of rays that leave the scene.
    shadows   : trace shadow rays.   unlit : even where no light would arrive.   faint : not where hardly any would.
    any_hit : ask for any hit first, and for the nearest where that does not tell all.
    soft_shadows : shadow rays may go to points spread over their lights.
    rough     : rays leave rough surfaces by random microfacets.
    occlusion : work out how much of the world's diffuse light is hidden.
    raster_shadows : work out the shadows of ray traced objects on all others.
    backing   : secondary rays may meet what the raster shows.
    applies   : pruning -> whether it is made.   saved : pruning -> how many of its unit.
    skipped   : what was left out: {"what", "why", "count"}.
    """

    reflection: bool
    refraction: bool
    secondary: bool
    weightless: bool
    ambient: bool
    diffuse: bool
    specular: bool
    shadows: bool
    unlit: bool
    faint: bool
    any_hit: bool
    emission: bool
    world: bool
    soft_shadows: bool
    rough: bool
    occlusion: bool
    raster_shadows: bool
    screen_space: bool
    applies: dict[str, bool] = field(default_factory=dict)
    saved: dict[str, int] = field(default_factory=dict)
    skipped: Skipped = field(default_factory=list)

    @property
    def draws(self) -> bool:
        """Whether hits need random numbers."""
        return self.soft_shadows or self.rough or self.occlusion

    @property
    def local(self) -> bool:
        """Whether any local shading is left."""
        return self.ambient or self.diffuse or self.specular

    def table(self, saved: Mapping[str, int] | None = None) -> Skipped:
        """Every pruning, as the report shows it. saved: how many of its unit, of those that only tracing can tell."""
        counts = {**self.saved, **(saved or {})}
        return [
            {
                "name": p.name,
                "class": p.kind,
                "leaves_out": p.leaves_out,
                "when": p.when,
                "applies": self.applies.get(p.name, False),
                "saved": counts.get(p.name) if p.unit and self.applies.get(p.name) else None,
                "unit": p.unit,
            }
            for p in PRUNINGS
        ]


@dataclass(eq=False)
class _Notes:
    """What is left out so far."""

    keep: frozenset[str]
    applies: dict[str, bool] = field(default_factory=dict)
    saved: dict[str, int] = field(default_factory=dict)
    skipped: Skipped = field(default_factory=list)

    def spare(self, name: str, possible: bool, why: str = "", count: int = 1) -> bool:
        """Whether to leave something out, given that it is possible; noted, and with a reason also listed."""
        left_out = bool(possible) and name not in self.keep
        self.applies[name] = self.applies.get(name, False) or left_out
        if left_out and why:
            self.saved[name] = self.saved.get(name, 0) + count
            self.skipped.append({"what": BY_NAME[name].leaves_out, "why": why, "count": count})
        return left_out


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene as tables, before anything is built to trace it.

    lights : those that can light anything.   lamps : those that rays can meet.
    """

    camera: Camera
    geometry: Geometry
    media: Media
    surfaces: SurfaceTable
    world: CompiledWorld
    lights: list[CompiledLight]
    lamps: list[CompiledLight]
    plan: Plan


def prepare(scene: Scene, settings: Settings, cache: SceneCache | None = None, once: bool = False) -> Prepared:
    """Compile a validated scene to tables and plan the work on it. Raises ValueError for a pruning that is none.

    once : it is for one picture, with this camera and these settings.
    """
    unknown = sorted(settings.keep - BY_NAME.keys())
    if unknown:
        raise ValueError(f"settings: no pruning is called {unknown[0]!r}")
    notes = _Notes(settings.keep)
    cache = SceneCache(0) if cache is None else cache
    scene, texels = with_finite_texels(scene, cache)
    if texels:
        notes.skipped.append({"what": "texels", "why": "not finite: black", "count": texels})
    scene = _with_images(scene, notes)
    surfaces, world = compile_surfaces(scene.surfaces), _world(scene.world, cache)
    layouts = [layout(s) for s in surfaces.surfaces]
    without = unmet(scene, settings, surfaces, world, cache) if once else frozenset()
    if not notes.spare("unmet", bool(without), "no ray can meet them", len(without)):
        without = frozenset()
    geometry, media = find_solids(scene, flatten(scene, layouts, cache=cache, without=without), surfaces)
    if media.rows == 0 and not notes.spare("media", True, "no closed body transmits"):
        media = replace(media, rank=np.zeros(len(geometry.surface), np.int32), rows=1)
    why = "only closed bodies have an inside" if surfaces.absorbs.any() else "no closed body absorbs"
    if media.absorption is None and not notes.spare("absorption", True, why):
        nothing, rank = np.zeros((3, media.count + 1)), np.zeros(len(geometry.surface), np.int32)
        rank = media.rank if len(media.rank) else rank
        media = replace(media, rank=rank, absorption=nothing, shadow_absorption=nothing)
    why = "every triangle is flat"
    if geometry.normals is None and not notes.spare("normals", True, why, geometry.triangle_count):
        geometry = replace(geometry, normals=np.zeros((geometry.triangle_count, 9), np.float32))
    lights = compile_lights((*scene.lights, *world.suns), geometry.center, geometry.object)
    linked = any(light.receives is not None or light.blocks is not None for light in lights)
    if not linked and not notes.spare("light-linking", True):
        every = np.ones(len(geometry.object), bool)
        lights = [replace(light, receives=every, blocks=every) for light in lights]
    plan, lights, lamps = make_plan(geometry, surfaces, world, lights, settings, notes, scene.raster is not None)
    camera = scene.camera
    if camera.lens is None and not notes.spare("depth-of-field", True):
        camera = replace(camera, lens=Lens(0.0, 1.0))
    return Prepared(camera, geometry, media, surfaces, world, lights, lamps, plan)


def _world(world: World, cache: SceneCache) -> CompiledWorld:
    """What is the same all around is worked out in no time: nobody needs to hear that it was kept."""
    varies = world.environment is not None or isinstance(world.radiance, Expression)
    return cache.take(("world", key_of(world)), partial(CompiledWorld, world), "world" if varies else "")


def _with_images(scene: Scene, notes: _Notes) -> Scene:
    """The scene; if images are not to be left out, with images of one colour where it has constants.

    Not where surfaces answer in layers: with constants they are tabulated, and they show the world blurred; both would
    be rounded elsewhere.
    """

    def image(color: RGB) -> Texture:
        pixels = np.broadcast_to(np.array([*color, 1], np.float32), (4, 8, 4))
        return Texture("constant", pixels, interpolation="CLOSEST")

    plain = not any(expressions_of(s) for s in scene.surfaces)
    if plain and not notes.spare("textures", True, "no value varies over a surface", len(scene.surfaces)):
        assigned = tuple(
            s if s.layered else replace(s, base_color_texture=image(cast(RGB, s.base_color))) for s in scene.surfaces
        )
        scene = replace(scene, surfaces=assigned)
    uniform = scene.world.environment is None and not isinstance(scene.world.radiance, Expression)
    layered = any(s.layered for s in scene.surfaces)
    if uniform and not notes.spare("environment", True, "the world is uniform") and not layered:
        scene = replace(scene, world=replace(scene.world, environment=image((1, 1, 1)), sun=None))
    return scene


def describe(scene: Scene, settings: Settings) -> Plan:
    """What a trace of this scene would leave out, with reasons; nothing is traced. Raises as `trace` does."""
    validate(scene, settings, None)
    return prepare(scene, settings, once=True).plan


def make_plan(
    geometry: Geometry,
    table: SurfaceTable,
    world: CompiledWorld,
    lights: Sequence[CompiledLight],
    settings: Settings,
    notes: _Notes,
    raster: bool,
) -> tuple[Plan, list[CompiledLight], list[CompiledLight]]:
    """Find out what the reachable surfaces need, which lights can light any of them, and which lamps rays can meet.

    raster : there is one.
    """
    reachable = reachable_surfaces(geometry, table, settings)
    n, spare = int(np.count_nonzero(reachable)), notes.spare

    def none(flags: NDArray[np.bool_]) -> bool:
        return not (flags & reachable).any()

    spare("unmasked", settings.camera_sees == "RAY_TRACED")
    reflection = not spare("reflection", none(table.reflects), "no reachable surface reflects", n)
    refraction = not spare("refraction", none(table.transmits), "every reachable surface is opaque", n)
    secondary = not spare("secondary", not (reflection or refraction))
    weightless = not spare("weightless", reflection or refraction) and (reflection or refraction)
    emission = not spare("emission", none(table.emits), "no reachable surface emits", n)
    escapes = not spare("world", world.is_black, "the world is black")
    why = "no reachable surface answers to it" if world.gives_light else "the world is black"
    ambient = not spare("ambient", not world.gives_light or none(table.shades_ambient), why, n)
    hides = geometry.secondary & ~table.transmits[geometry.surface]
    why = "nothing can hide the world" if ambient else why
    occlusion = settings.occlusion_samples > 0
    occlusion = occlusion and not spare("occlusion", not (ambient and hides.any()), why, n)
    sends = (table.reflects | table.transmits) & reachable
    lamps = _lamps(lights, geometry, sends[geometry.surface], notes) if secondary else []
    answer = table.shades_diffuse | table.shades_specular
    lights = _useful_lights(lights, geometry, (answer & reachable)[geometry.surface], notes)
    why = "no reachable surface answers to it" if lights else "there is no light"
    diffuse = not spare("diffuse", not lights or none(table.shades_diffuse), why, n)
    specular = not spare("highlights", not lights or none(table.shades_specular), why, n)
    shadows = _shadows(geometry, table, lights, diffuse or specular, notes)
    unlit = shadows and not spare("unlit", True)
    sized = any(light.is_soft for light in lights)
    soft = shadows and settings.shadow_samples > 0
    soft = soft and not spare("soft-shadows", not sized, "no light that casts shadows has a size", len(lights))
    rough = settings.rough_samples > 0 and secondary
    rough = rough and not spare("roughness", none(table.rough), "all that rays reach is smooth", n)
    any_hit = spare("any-hit", shadows)
    caster_bounds = geometry.shadow & geometry.ray_traced & ~table.shadow_clear[geometry.surface]
    raster_shadows = shadows and settings.raster_shadows
    if settings.raster_shadows:
        why = "no ray traced object can cast one"
        raster_shadows = not spare("raster-shadows", not (shadows and caster_bounds.any()), why) and raster_shadows
    backed = not spare("screen_space", not raster or not (secondary and backable(geometry, table).any())) and raster
    spare("cutoff", settings.cutoff > 0)
    faint = shadows and spare("faint-light", settings.cutoff > 0)
    spare("adaptive", settings.adaptive > 0)
    plan = Plan(
        reflection=reflection,
        refraction=refraction,
        secondary=secondary,
        weightless=weightless,
        ambient=ambient,
        diffuse=diffuse,
        specular=specular,
        shadows=shadows,
        unlit=unlit,
        faint=faint,
        any_hit=any_hit,
        emission=emission,
        world=escapes,
        soft_shadows=soft,
        rough=rough,
        occlusion=occlusion,
        raster_shadows=raster_shadows,
        screen_space=backed,
        applies=notes.applies,
        saved=notes.saved,
        skipped=notes.skipped,
    )
    return plan, lights, lamps


def _lamps(
    lights: Sequence[CompiledLight], geometry: Geometry, senders: NDArray[np.bool_], notes: _Notes
) -> list[CompiledLight]:
    """The lamps that reflected and refracted rays can meet; they start on the primitives `senders` (np,) bool."""
    bounds = bounds_of(geometry, senders)
    seen = [light for light in lights if not light.is_unseen and can_reach(light, bounds)]
    why, left = "no size, or out of range of all that mirrors or refracts", len(lights) - len(seen)
    return seen if left == 0 or notes.spare("lamps", True, why, left) else list(lights)


def _useful_lights(
    lights: Sequence[CompiledLight], geometry: Geometry, receivers: NDArray[np.bool_], notes: _Notes
) -> list[CompiledLight]:
    """The lights that are not black and that can reach a primitive that answers to light, `receivers` (np,) bool."""
    black = sum(light.is_black for light in lights)
    cache = list(lights)
    if black and notes.spare("black-lights", True, "they are black", black):
        cache = [light for light in lights if not light.is_black]
    if cache and receivers.any():
        bounds = bounds_of(geometry, receivers)

        def near_any(light: CompiledLight) -> bool:
            if light.receives is None:
                return can_reach(light, bounds)
            own = receivers & light.receives
            return bool(own.any()) and can_reach(light, bounds_of(geometry, own))

        near = [light for light in cache if near_any(light)]
        why = "out of range of all that could answer to them, or turned away"
        if len(near) < len(cache) and notes.spare("far-lights", True, why, len(cache) - len(near)):
            cache = near
    return cache


def _shadows(
    geometry: Geometry, table: SurfaceTable, lights: Sequence[CompiledLight], needed: bool, notes: _Notes
) -> bool:
    """Whether shadow rays are traced at all."""
    if not needed or not lights:
        return False
    if not any(light.light.cast_shadow for light in lights):
        return not notes.spare("shadows", True, "no light casts shadows", len(lights))
    if not (geometry.shadow & ~table.shadow_clear[geometry.surface]).any():
        return not notes.spare("shadows", True, "nothing can cast a shadow", len(lights))
    return True


def reachable_surfaces(geometry: Geometry, table: SurfaceTable, settings: Settings) -> NDArray[np.bool_]:
    """(s,) bool: surfaces on which light is ever worked out."""
    only_ray_traced = settings.camera_sees == "RAY_TRACED" and not settings.raster_shadows
    first = geometry.camera & geometry.ray_traced if only_ray_traced else geometry.camera
    reachable = np.zeros(len(table.ior), bool)
    reachable[geometry.surface[first]] = True
    if settings.raster_shadows and settings.caustics == "PHOTONS":
        reachable[geometry.surface[geometry.shadow & geometry.ray_traced]] = True
    if (table.transmits & table.straight & reachable).any():
        reachable[geometry.surface[geometry.camera]] = True
    if ((table.reflects | table.transmits) & reachable).any():
        reachable[geometry.surface[geometry.secondary]] = True
    return reachable
