# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene does not need, found out before anything is built to trace it.

Only surfaces that rays can reach count: those that camera rays can stop at, and, if one of these reflects or transmits,
all that secondary rays can meet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ...expressions import expressions_of
from ...scene import Expression, Scene, Settings
from ..core.constants import MOST_CLOSURES
from ..emitters.light import CompiledLight
from ..emitters.screen_space import backable
from ..emitters.world import CompiledWorld
from ..geometry.flatten import Geometry
from ..materials.surfaces import SurfaceTable
from ..media.fog import CompiledFog
from ..media.nested import Media
from .light_culling import bounds_of, can_reach
from .prunings import BY_NAME, PRUNINGS

Bools = NDArray[np.bool_]
LeftOut = dict[str, object]
"""One thing that was left out: "what", "why", and the "count" of it."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Which stages of the wave loop run at all. Nothing of it changes once it is made.

    reflection, refraction : spawn such rays (refraction includes straight passes through IOR 1).
    secondary : build what they can meet.   weightless : spawn them even where they carry nothing.
    ambient, diffuse, specular : terms of local shading that can differ from 0.   emission : add it.
    world     : add the light of rays that leave the scene.
    shadows   : trace shadow rays.   unlit : even where no light would arrive.   faint : not where hardly any would.
    any_hit : ask for any hit first, and for the nearest where that does not tell all.
    soft_shadows : shadow rays may go to points spread over their lights.
    rough     : rays leave rough surfaces by random microfacets.
    lit_fog   : fog scatters the light of lamps, at random places.
    probed    : bodies get light from elsewhere of themselves, which rays find.
    crowded   : some surface has more closures than every hit answers with, or disperses: they are drawn.
    occlusion : work out how much of the world's diffuse light is hidden.
    raster_shadows : work out the shadows of ray traced objects on all others.
    screen_space : secondary rays may meet what the raster shows.
    applies   : pruning -> whether it is made.   saved : pruning -> how many of its unit.
    skipped   : what was left out.
    """

    reflection: bool
    refraction: bool
    secondary: bool
    weightless: bool = False
    ambient: bool
    diffuse: bool
    specular: bool
    shadows: bool
    unlit: bool = False
    faint: bool
    any_hit: bool = True
    emission: bool
    world: bool
    soft_shadows: bool
    rough: bool
    crowded: bool = False
    lit_fog: bool = False
    probed: bool = False
    occlusion: bool
    raster_shadows: bool
    screen_space: bool
    applies: Mapping[str, bool] = field(default_factory=lambda: MappingProxyType({}))
    saved: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    skipped: tuple[LeftOut, ...] = ()

    @property
    def draws(self) -> bool:
        """Whether hits need random numbers."""
        return self.soft_shadows or self.rough or self.occlusion or self.crowded or self.lit_fog or self.probed

    @property
    def local(self) -> bool:
        """Whether any local shading is left."""
        return self.ambient or self.diffuse or self.specular

    def with_unchanged(self, found: Mapping[str, int], triangles: int) -> Plan:
        """The same, with what an earlier frame has left: what -> how many, and how many triangles among it."""
        why = "unchanged since the last frame"
        entries = tuple({"what": what, "why": why, "count": n} for what, n in found.items() if n)
        return self.with_pruning("unchanged", bool(entries), triangles, (*self.skipped, *entries))

    def with_pruning(self, name: str, applies: bool, saved: int, skipped: tuple[LeftOut, ...]) -> Plan:
        """The same with another row and another list of what was left out."""
        return replace(
            self,
            applies=MappingProxyType({**self.applies, name: applies}),
            saved=MappingProxyType({**self.saved, name: saved}),
            skipped=skipped,
        )

    def table(self, saved: Mapping[str, int] | None = None) -> list[dict[str, object]]:
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

    applies: dict[str, bool] = field(default_factory=dict)
    saved: dict[str, int] = field(default_factory=dict)
    skipped: list[LeftOut] = field(default_factory=list)

    def spare(self, what: str, spared: bool, why: str = "", count: int = 1) -> bool:
        """Whether `what`, a pruning's name or in words, is left out; with a reason that is listed, too."""
        spared, pruning = bool(spared), BY_NAME.get(what)
        if pruning is not None:
            self.applies[what] = self.applies.get(what, False) or spared
        if spared and why:
            self.skipped.append({"what": pruning.leaves_out if pruning else what, "why": why, "count": count})
            if pruning is not None:
                self.saved[what] = self.saved.get(what, 0) + count
        return spared


@dataclass(frozen=True, eq=False)
class Tables:
    """What a plan is made from."""

    geometry: Geometry
    media: Media
    surfaces: SurfaceTable
    world: CompiledWorld
    lights: Sequence[CompiledLight]
    fog: CompiledFog | None = None
    fog_lights: Sequence[CompiledLight] = ()


def make_plan(
    scene: Scene, settings: Settings, tables: Tables, black_texels: int = 0
) -> tuple[Plan, list[CompiledLight], list[CompiledLight]]:
    """Find out what the reachable surfaces need, which lights can light any of them, and which lamps rays can meet.

    black_texels : how many were made black because they are not finite.
    """
    geometry, table, world, lights = tables.geometry, tables.surfaces, tables.world, tables.lights
    notes = _Notes()
    if black_texels:
        notes.skipped.append({"what": "texels", "why": "not finite: black", "count": black_texels})
    _note_what_is_not_there(scene, tables, notes)
    reachable = reachable_surfaces(geometry, table, settings)
    n, spare = int(np.count_nonzero(reachable)), notes.spare

    def none(flags: Bools) -> bool:
        return not (flags & reachable).any()

    # Which rays leave surfaces at all, and what those that leave the scene bring back.
    reflection = not spare("reflected rays", none(table.reflects), "no reachable surface reflects", n)
    refraction = not spare("refracted rays", none(table.transmits), "every reachable surface is opaque", n)
    secondary = not spare("secondary", not (reflection or refraction))
    spare("weightless", secondary)
    rough = settings.rough_samples > 0 and secondary
    rough = rough and not spare("random microfacets", none(table.rough), "all that rays reach is smooth", n)
    emission = not spare("emission", none(table.emits), "no reachable surface emits", n)
    escapes = not spare("light of rays that leave the scene", world.is_black, "the world is black")

    # The world's diffuse light, and what can hide it.
    why = "no reachable surface answers to it" if world.gives_light else "the world is black"
    ambient = not spare("ambient light", not world.gives_light or none(table.shades_ambient), why, n)
    hides = geometry.secondary & ~table.transmits[geometry.surface]
    why = "nothing can hide the world" if ambient else why
    occlusion = settings.occlusion_samples > 0
    occlusion = occlusion and not spare("ambient occlusion", not (ambient and hides.any()), why, n)

    # Lights that rays can meet, and lights that can reach what answers to them.
    sends = (table.reflects | table.transmits) & reachable
    lamps = _lamps(lights, geometry, sends[geometry.surface], notes) if secondary else []
    answers = (table.shades_diffuse | table.shades_specular) & reachable
    lights = _useful_lights(lights, geometry, answers[geometry.surface], notes)
    why = "no reachable surface answers to it" if lights else "there is no light"
    diffuse = not spare("diffuse light", not lights or none(table.shades_diffuse), why, n)
    specular = not spare("highlights", not lights or none(table.shades_specular), why, n)

    # Shadow rays, and the shadows of ray traced objects on all others.
    lit_fog = list(tables.fog_lights)
    shadows = (diffuse or specular or bool(lit_fog)) and _shadows(geometry, table, [*lights, *lit_fog], notes)
    spare("unlit", shadows)
    spare("any-hit", shadows)
    soft = shadows and settings.shadow_samples > 0
    why = "no light that casts shadows has a size"
    hard = not any(x.is_soft for x in (*lights, *lit_fog))
    soft = soft and not spare("random points on lights", hard, why, len(lights))
    raster_shadows = shadows and settings.raster_shadows
    if settings.raster_shadows:
        casts = geometry.shadow & geometry.ray_traced & ~table.shadow_clear[geometry.surface]
        why = "no ray traced object can cast one"
        raster_shadows = not spare("shadows on the raster", not (shadows and casts.any()), why) and raster_shadows
    shown = scene.raster is not None and secondary and bool(backable(geometry, table).any())
    spare("look-ups in the raster", not shown, "no raster, or rays reach nothing matte that it shows")

    # What the settings allow to leave out, with an error.
    spare("unmasked", settings.camera_sees == "RAY_TRACED")
    spare("cutoff", settings.cutoff > 0)
    faint = shadows and spare("faint-light", settings.cutoff > 0)
    spare("adaptive", settings.adaptive > 0)
    plan = Plan(
        reflection=reflection,
        refraction=refraction,
        secondary=secondary,
        ambient=ambient,
        diffuse=diffuse,
        specular=specular,
        shadows=shadows,
        faint=faint,
        emission=emission,
        world=escapes,
        soft_shadows=soft,
        rough=rough,
        crowded=bool((table.closure_count[reachable] > MOST_CLOSURES).any()) or table.disperses,
        lit_fog=bool(lit_fog),
        probed=bool((table.scatters | (table.translucent & (geometry.enclosed is not None)))[reachable].any()),
        occlusion=occlusion,
        raster_shadows=raster_shadows,
        screen_space=shown,
        applies=MappingProxyType(notes.applies),
        saved=MappingProxyType(notes.saved),
        skipped=tuple(notes.skipped),
    )
    return plan, lights, lamps


def _note_what_is_not_there(scene: Scene, tables: Tables, notes: _Notes) -> None:
    """List what needs no flag: the tables just do not have it."""
    geometry, media, spare = tables.geometry, tables.media, notes.spare
    plain = not any(expressions_of(s) for s in scene.surfaces)
    spare("texture look-ups", plain, "no value varies over a surface", len(scene.surfaces))
    uniform = scene.world.environment is None and not isinstance(scene.world.radiance, Expression)
    spare("environment look-ups", uniform, "the world is uniform")
    spare("the stack of media around each ray", media.rows == 0, "no closed body transmits")
    absorbs = tables.surfaces.absorbs.any()
    why = "only closed bodies have an inside" if absorbs else "no closed body absorbs"
    spare("absorption", media.absorption is None, why)
    spare("fog", tables.fog is None, "there is none")
    if tables.fog is not None and tables.fog.left_out:
        spare("fog of open or flat bodies", True, "only closed bodies have an inside", len(tables.fog.left_out))
    spare("shading normals", geometry.normals is None, "every triangle is flat", geometry.triangle_count)


def _lamps(lights: Sequence[CompiledLight], geometry: Geometry, senders: Bools, notes: _Notes) -> list[CompiledLight]:
    """The lamps that reflected and refracted rays can meet; they start on the primitives `senders` (np,) bool."""
    bounds = bounds_of(geometry, senders)
    seen = [light for light in lights if not light.is_unseen and can_reach(light, bounds)]
    why, left = "no size, or out of range of all that mirrors or refracts", len(lights) - len(seen)
    notes.spare("lamps that rays could meet", left > 0, why, left)
    return seen


def _useful_lights(
    lights: Sequence[CompiledLight], geometry: Geometry, receivers: Bools, notes: _Notes
) -> list[CompiledLight]:
    """The lights that are not black and that can reach a primitive that answers to light, `receivers` (np,) bool."""
    bright = [light for light in lights if not light.is_black]
    notes.spare("lights", len(bright) < len(lights), "they are black", len(lights) - len(bright))
    if not bright or not receivers.any():
        return bright
    bounds = bounds_of(geometry, receivers)

    def near_any(light: CompiledLight) -> bool:
        if light.receives is None:
            return can_reach(light, bounds)
        own = receivers & light.receives
        return bool(own.any()) and can_reach(light, bounds_of(geometry, own))

    near = [light for light in bright if near_any(light)]
    why = "out of range of all that could answer to them, or turned away"
    notes.spare("lights", len(near) < len(bright), why, len(bright) - len(near))
    return near


def _shadows(geometry: Geometry, table: SurfaceTable, lights: Sequence[CompiledLight], notes: _Notes) -> bool:
    """Whether shadow rays are traced at all, where there is light to shade."""
    if not any(light.light.cast_shadow for light in lights):
        return not notes.spare("all shadow rays", True, "no light casts shadows", len(lights))
    if not (geometry.shadow & ~table.shadow_clear[geometry.surface]).any():
        return not notes.spare("all shadow rays", True, "nothing can cast a shadow", len(lights))
    return True


def reachable_surfaces(geometry: Geometry, table: SurfaceTable, settings: Settings) -> Bools:
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
