# SPDX-License-Identifier: GPL-3.0-or-later
"""Local shading: ambient, diffuse and Phong light of hits, with shadows (`shadows`).

Llocal = ambient base_color E_world / pi + sum over lights (diffuse base_color / pi + Phong) E_light visibility
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32
from ..core.constants import MIRROR_ROUGHNESS
from ..core.stats import Stats
from ..core.vectors import Index, add, count, dot, flatnonzero, no_brighter, select, take
from ..emitters.light import CompiledLight, Illumination
from ..prepare.compiled import CompiledScene
from .interaction import Interaction
from .ltc import BrushedLobe, LampLobe, Lobe, ggx_lobe
from .occlusion import open_share
from .scattering import above, mirrored, phong_light
from .shadows import NOTHING, TOGETHER, Origins, points_asked, visible_shares
from .subsurface import gathered, scatters

PI, INVERSE_PI = np.float32(np.pi), np.float32(1 / np.pi)


Cut = Callable[[Float32], NDArray[np.intp]]
"""Asked which of the hits do without a light that brings them shares (3, n) of what a white wall would send on."""


@dataclass(eq=False)
class _Receivers:
    """Hits, and what all lights ask of them.

    point   : (3, n) float32.   diffuse : (3, n) float32, albedo over pi with its weights.
    glossy  : rough lobes: which hits have one, its colour (3, m) or (m,), and its shape.
    """

    hit: Interaction
    point: Float32
    diffuse: Float32
    glossy: list[tuple[Index, Float32, Lobe | BrushedLobe]]
    only_diffuse: bool


@dataclass(frozen=True, eq=False)
class DirectLight:
    """What the lights and the world bring to n hits.

    radiance : (3, n) float32, Llocal, seen along wo.
    cut      : (k,) intp, ascending: hits to which a shadow ray was not followed to its end.
    lit      : (n,) uint32, sum of the keys of the lights that reach each; None: nobody asks.
    soft     : (2, 3, n) float32, of the radiance, what has random shadows: with these, and without; None: nobody asks.
    spread   : hits (k,) whose light is that of random places of their bodies, and their albedos (3, k).
    """

    radiance: Float32
    cut: NDArray[np.intp]
    lit: NDArray[np.uint32] | None
    soft: Float32 | None = None
    spread: tuple[NDArray[np.intp], Float32] | None = None


def direct_light(
    scene: CompiledScene,
    hit: Interaction,
    stats: Stats,
    cut: Cut | None = None,
    asks_lit: bool = False,
    asks_random: bool = False,
) -> DirectLight:
    """The light of hits (n,), some of which may get theirs from elsewhere of their bodies (`subsurface`).

    cut : see `Cut`; None: no light is too faint.   asks_lit : which lights reach each hit is wanted.
    asks_random : what of it is random is wanted.
    """
    index = scatters(scene, hit)
    if len(index) == 0:
        return _light_on(scene, hit, stats, cut, asks_lit, asks_random=asks_random)
    elsewhere, own = gathered(
        scene, hit.take(index), lambda place: _light_on(scene, place, stats, only_diffuse=True).radiance, stats
    )
    factors, whole = hit.values.factors, np.ones(hit.outer.shape, np.float32)
    whole[:, index] = own
    factors = {**factors, "base_color": factors.get("base_color", np.float32(1)) * whole}
    own_light = replace(hit, values=replace(hit.values, factors=factors))
    found = _light_on(scene, own_light, stats, cut, asks_lit, asks_random=asks_random)
    found.radiance[:, index] += elsewhere
    if found.soft is None:
        return found
    found.soft[:, :, index] = 0
    return replace(found, spread=(index, hit.value("base_color", index)))


def _light_on(
    scene: CompiledScene,
    hit: Interaction,
    stats: Stats,
    cut: Cut | None = None,
    asks_lit: bool = False,
    only_diffuse: bool = False,
    asks_random: bool = False,
) -> DirectLight:
    """The light that falls on hits (n,). Surfaces shade on both sides: normals are on the side of wo.

    only_diffuse : highlights, and what the world's blurred image adds, are left out.
    """
    if scene.surfaces.translucent.any():
        hit = hit.turned(hit.table.translucent.take(hit.surface))
    plan, color = scene.plan, hit.value("base_color")
    radiance = np.zeros(color.shape, np.float32)
    lit = np.zeros(len(hit.prim), np.uint32) if asks_lit else None
    soft = np.zeros((2, *color.shape), np.float32) if asks_random else None
    unknown: list[NDArray[np.intp]] = []
    # Light of the world, which has a limit of its own.
    if plan.ambient:
        _add_ambient(scene, hit, color, radiance, soft, stats, only_diffuse)
        radiance *= np.float32(scene.arriving.indirect)
        if soft is not None:
            soft *= np.float32(scene.arriving.indirect)
    is_limited = np.isfinite(scene.arriving.direct_limit)
    ambient = radiance.copy() if is_limited else None
    occluded = soft.copy() if is_limited and soft is not None else None
    # Light of lamps.
    if plan.diffuse or plan.specular:
        diffuse = color * (hit.value("diffuse") * INVERSE_PI)
        glossy = _glossy(hit) if plan.specular and not only_diffuse else []
        receivers = _Receivers(hit, hit.point.astype(np.float32), diffuse, glossy, only_diffuse)
        origins = Origins(scene.geometry, hit)
        # Few hits ask for the shadows of several lights at once: see TOGETHER.
        asked: list[_Lit] = []
        for light in scene.lights:
            asked.append(_lit_by(scene, receivers, light, stats, cut))
            if sum(map(len, asked)) > TOGETHER:
                unknown += _add_lit(scene, hit, origins, asked, radiance, lit, soft, stats)
                asked = []
        unknown += _add_lit(scene, hit, origins, asked, radiance, lit, soft, stats)
    if ambient is not None:
        radiance = ambient + no_brighter(radiance - ambient, scene.arriving.direct_limit)
    if soft is not None and occluded is not None:  # each limited by itself: no more noise, and no more light
        for part, world in zip(soft, occluded, strict=True):
            part[...] = world + no_brighter(part - world, scene.arriving.direct_limit)
    return DirectLight(radiance, np.unique(np.concatenate(unknown)) if unknown else NOTHING, lit, soft)


@dataclass(eq=False)
class _Lit:
    """The hits `wanted` that a light may reach, and what each would get of it, (3, m), if nothing is in between.

    traces : shadow rays are to tell.
    """

    light: CompiledLight
    wanted: Index
    arriving: Float32
    traces: bool

    def __len__(self) -> int:
        result: int = self.arriving.shape[1]
        return result


def _lit_by(scene: CompiledScene, receivers: _Receivers, light: CompiledLight, stats: Stats, cut: Cut | None) -> _Lit:
    """What would arrive from one light. Shadow rays tell whether it comes through the back of a smooth triangle."""
    # What the surface sends on of it: diffuse, then its highlights.
    hit = receivers.hit
    lit = light.illuminate(receivers.point, hit.n_shading, hit.offset)
    arriving = np.asarray(receivers.diffuse * (lit.diffuse * np.float32(light.light.diffuse)), np.float32)
    if scene.plan.specular and light.light.specular != 0 and not receivers.only_diffuse:
        _add_phong(hit, lit, light, arriving)
        for index, color, lobes in receivers.glossy:
            point, normal = take(receivers.point, index), take(hit.n_geometric, index)
            lobe = lobes if isinstance(lobes, Lobe) else lobes.towards(take(lit.wi, index))
            seen = light.highlight(point, normal, lobe, take(hit.offset, index))
            if isinstance(lobe, LampLobe):
                seen = seen * lobe.weight.astype(np.float32)
            add(arriving, index, color * (seen * np.float32(light.light.specular)))
    if light.light.cast_shadow and hit.n_shading is not hit.n_geometric:
        # What casts no shadow, not even on itself, gets no light through its back: a flat one asked for none.
        casts = scene.casts_shadow(light)
        if casts is not None:
            is_flat = (hit.n_shading == hit.n_geometric).all(axis=0)
            arriving *= is_flat | (dot(lit.wi, hit.n_geometric) > 0) | casts.take(hit.prim)

    # Of a linked lamp others get nothing.
    if light.receives is not None:
        arriving *= light.receives.take(hit.prim)

    # Shadow rays are traced only where something would arrive, and enough of it.
    traces = light.light.cast_shadow and scene.plan.shadows
    arrives = (arriving != 0).any(axis=0) | scene.plan.unlit
    if traces and cut is not None:
        faint = cut(np.asarray(arriving * (PI / lit.specular), np.float32))
        arrives[faint] = False
        stats.add("shadow_cut", len(faint))
    wanted = select(arrives)
    chosen = take(arriving, wanted)
    chosen *= light.color
    if traces:
        stats.add("shadow_not_needed", len(hit.prim) - chosen.shape[1])
    return _Lit(light, wanted, chosen, traces)


def _add_lit(
    scene: CompiledScene,
    hit: Interaction,
    origins: Origins,
    asked: list[_Lit],
    radiance: Float32,
    lit_by: NDArray[np.uint32] | None,
    soft: Float32 | None,
    stats: Stats,
) -> list[NDArray[np.intp]]:
    """Add what arrives of some lights, through all that is in between, to radiance (3, n); their keys to lit_by (n,);
    to soft (2, 3, n) see `DirectLight`.

    Returns the hits to which shadow rays were not followed to their ends.
    """
    unknown: list[NDArray[np.intp]] = []
    shares = visible_shares(scene, hit, origins, [(lit.light, lit.wanted) for lit in asked if lit.traces], stats)
    for lit in asked:
        wanted, chosen = lit.wanted, lit.arriving
        if lit.traces:
            visible, cut = next(shares)
            told = soft is not None and points_asked(scene, hit, lit.light) > 0
            if soft is not None and told:
                add(soft[1], wanted, chosen)
            chosen *= visible
            if soft is not None and told:
                add(soft[0], wanted, chosen)
            if lit_by is not None:
                lit_by[wanted] += lit.light.key * (visible > 0 if visible.ndim == 1 else (visible > 0).any(axis=0))
            if len(cut):
                unknown.append(cut if isinstance(wanted, slice) else wanted[cut])
        add(radiance, wanted, chosen)
    return unknown


def _add_ambient(
    scene: CompiledScene, hit: Interaction, color: Float32, radiance: Float32, soft: Float32 | None, stats: Stats,
    only_diffuse: bool,
) -> None:  # fmt: skip
    """Add the light of the world: what is diffuse, and its blurred image in the reflections that no ray follows.

    color : (3, n), base_color of the hits.   soft : (2, 3, n), see `DirectLight`.
    """
    let_in = hit.let_in  # translucent surfaces are lit from their other side
    if let_in is not None:
        let_in = np.where(hit.table.translucent.take(hit.surface), np.float32(1), let_in)
    lit = select(hit.table.shades_ambient.take(hit.surface))
    if count(lit, len(hit.prim)):
        color = take(color, lit) * hit.value("ambient", lit)
        if let_in is not None:
            color *= take(let_in, lit)
        color = color * scene.world.irradiance_over_pi(take(hit.n_shading, lit))
        if scene.occluders is not None and hit.draws is not None:
            share = open_share(scene, scene.occluders, hit, lit, stats)
            if soft is not None:
                add(soft[1], lit, color)
                add(soft[0], lit, color * share)
            color *= share
        add(radiance, lit, color)
    blurred = select(hit.table.blurs.take(hit.surface))
    if only_diffuse or count(blurred, len(hit.prim)) == 0:
        return
    wo, n = take(hit.wo, blurred), take(hit.n_shading, blurred)
    for name in ("lobe", "coat"):
        weight = hit.value(f"{name}_blurred", blurred)
        rough = flatnonzero(weight if weight.ndim == 1 else weight.any(axis=0))
        if len(rough):
            index = rough if isinstance(blurred, slice) else take(blurred, rough)
            wide = hit.value(f"{name}_roughness", index)
            image = scene.world.glossy(mirrored(take(wo, rough), take(n, rough), wide), wide)
            if let_in is not None:
                image = image * take(let_in, index)
            add(radiance, index, take(weight, rough) * image)


def _glossy(hit: Interaction) -> list[tuple[Index, Float32, Lobe | BrushedLobe]]:
    """The rough lobes of layered surfaces that lamps may light: of the base, then of the coat."""
    shines = hit.table.layered.take(hit.surface) & hit.has_highlight
    shines &= hit.table.shades_specular.take(hit.surface)
    found: list[tuple[Index, Float32, Lobe | BrushedLobe]] = []
    for name in ("lobe", "coat") if shines.any() else ():
        weight, roughness = hit.value(name), hit.value(f"{name}_roughness")
        has_weight = weight != 0 if weight.ndim == 1 else (weight != 0).any(axis=0)
        has_lobe = shines & has_weight & (roughness > MIRROR_ROUGHNESS)
        if name == "lobe" and hit.tangent is not None:
            grooves = has_lobe & hit.tangent.any(axis=0)
            has_lobe = has_lobe & ~grooves
            index = select(grooves)
            brushed = hit.brushed(index)
            if brushed is not None and count(index, len(shines)):
                n = take(hit.n_shading, index)
                wo, _ = above(take(hit.wo, index), n, dot(take(hit.wo, index), n))
                found.append((index, take(weight, index), BrushedLobe(wo, n, take(roughness, index), brushed)))
        index = select(has_lobe)
        if count(index, len(shines)):
            lobe = ggx_lobe(take(hit.wo, index), take(hit.n_shading, index), take(roughness, index))
            found.append((index, take(weight, index), lobe))
    return found


def _add_phong(hit: Interaction, lit: Illumination, light: CompiledLight, arriving: Float32) -> None:
    """Add Phong's highlight to arriving (3, n): only where a surface has one and faces the light."""
    table = hit.table
    wo, cos_o = above(hit.wo, hit.n_shading, hit.cos_o)
    shines = (lit.specular > 0) & (lit.cosine > 0)
    shines &= table.shades_specular.take(hit.surface) & ~table.layered.take(hit.surface)
    index = select(shines)
    if count(index, len(shines)) == 0:
        return
    strength = take(lit.specular, index) * np.float32(light.light.specular)
    surface = hit.value("exponent", index), hit.value("specular", index)
    way = take(lit.wi, index), take(wo, index), take(hit.n_shading, index), take(lit.cosine, index), take(cos_o, index)
    add(arriving, index, phong_light(*way, *surface, strength))
