"""What a scene does not need. Every omission here is exact: the picture is the same, bit for bit, with it and without.

Only surfaces that rays can reach count: those that camera rays can stop at, and, if one of these reflects or
transmits, all that secondary rays can meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..scene import Scene, Settings
from .geometry import Geometry, flatten
from .lights import CompiledLight, compile_lights
from .media import Media
from .solids import find_solids
from .surfaces import SurfaceTable, compile_surfaces, layout
from .validate import validate
from .world import CompiledWorld

Skipped = list[dict[str, object]]


@dataclass(frozen=True)
class Plan:
    """Which stages of the wave loop run at all.

    reflection, refraction : spawn such rays (refraction includes straight passes through IOR 1).
    ambient, diffuse, specular : terms of local shading that can differ from 0.
    shadows : trace shadow rays.  emission : add it.
    skipped : what was left out: {"what", "why", "count"}.
    """

    reflection: bool
    refraction: bool
    ambient: bool
    diffuse: bool
    specular: bool
    shadows: bool
    emission: bool
    skipped: Skipped = field(default_factory=list)

    @property
    def local(self) -> bool:
        """Whether any local shading is left."""
        return self.ambient or self.diffuse or self.specular


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene as tables, before anything is built to trace it; `lights` are those that can light anything."""

    geometry: Geometry
    media: Media
    surfaces: SurfaceTable
    world: CompiledWorld
    lights: list[CompiledLight]
    plan: Plan


def prepare(scene: Scene, settings: Settings) -> Prepared:
    """Compile a validated scene to tables and plan the work on it."""
    surfaces, world = compile_surfaces(scene.surfaces), CompiledWorld(scene.world)
    layouts = [layout(s) for s in surfaces.surfaces]
    geometry, media = find_solids(scene, flatten(scene, layouts), surfaces)
    lights = [light for light in compile_lights(scene.lights, geometry.center) if not light.is_black]
    plan = make_plan(geometry, surfaces, world, lights, len(scene.lights), settings)
    if media.rows == 0:
        plan.skipped.append({"what": "media around rays", "why": "no closed body transmits", "count": 1})
    return Prepared(geometry, media, surfaces, world, lights, plan)


def describe(scene: Scene, settings: Settings) -> Skipped:
    """What a trace of this scene would leave out, with reasons; nothing is traced. Raises as `trace` does."""
    validate(scene, settings, None)
    return list(prepare(scene, settings).plan.skipped)


def make_plan(
    geometry: Geometry,
    table: SurfaceTable,
    world: CompiledWorld,
    lights: Sequence[CompiledLight],
    light_count: int,
    settings: Settings,
) -> Plan:
    """Find out what the reachable surfaces and the lights can need."""
    reachable = reachable_surfaces(geometry, table, settings)
    n = int(np.count_nonzero(reachable))
    skipped: Skipped = []

    def needs(flags: NDArray[np.bool_], what: str, why: str) -> bool:
        """Whether any reachable surface has the flag; if none has, say so."""
        if (flags & reachable).any():
            return True
        skipped.append({"what": what, "why": why, "count": n})
        return False

    reflection = needs(table.reflects, "reflected rays", "no reachable surface reflects")
    refraction = needs(table.transmits, "refracted rays", "every reachable surface is opaque")
    emission = needs(table.emits, "emission", "no reachable surface emits")
    ambient = diffuse = specular = False
    if world.is_black:
        skipped.append({"what": "ambient light", "why": "the world is black", "count": n})
    else:
        ambient = needs(table.shades_ambient, "ambient light", "no reachable surface answers to it")
    if light_count > len(lights):
        skipped.append({"what": "lights", "why": "they are black", "count": light_count - len(lights)})
    if lights:
        diffuse = needs(table.shades_diffuse, "diffuse light", "no reachable surface answers to it")
        specular = needs(table.shades_specular, "highlights", "no reachable surface has one")
    shadows = diffuse or specular
    if shadows and not any(light.light.cast_shadow for light in lights):
        skipped.append({"what": "shadow rays", "why": "no light casts shadows", "count": len(lights)})
        shadows = False
    if shadows and not (geometry.shadow & ~table.shadow_clear[geometry.surface]).any():
        skipped.append({"what": "shadow rays", "why": "nothing can cast a shadow", "count": len(lights)})
        shadows = False
    if geometry.normals is None:
        skipped.append({"what": "shading normals", "why": "every triangle is flat", "count": geometry.triangle_count})
    if not table.textured:
        skipped.append({"what": "texture look-ups", "why": "no surface has a texture", "count": n})
    if not world.has_environment:
        skipped.append({"what": "environment look-ups", "why": "the world is uniform", "count": 1})
    return Plan(reflection, refraction, ambient, diffuse, specular, shadows, emission, skipped)


def reachable_surfaces(geometry: Geometry, table: SurfaceTable, settings: Settings) -> NDArray[np.bool_]:
    """(s,) bool: surfaces on which light is ever worked out."""
    first = geometry.camera & geometry.ray_traced if settings.see == "FLAGGED" else geometry.camera
    reachable = np.zeros(len(table.ior), bool)
    reachable[geometry.surface[first]] = True
    if (table.transmits & table.straight & reachable).any():
        reachable[geometry.surface[geometry.camera]] = True
    if ((table.reflects | table.transmits) & reachable).any():
        reachable[geometry.surface[geometry.secondary]] = True
    return reachable
