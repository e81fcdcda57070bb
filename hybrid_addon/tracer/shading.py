"""Local shading: ambient, diffuse and Phong light of hits, with shadows (`shadows`).

Llocal = ambient base_color E_world / pi + sum over lights (diffuse base_color / pi + Phong) E_light visibility
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..scene import Float32
from .compiled import CompiledScene
from .constants import LEAST_COSINE
from .interaction import Interaction
from .layers import ggx_highlight
from .lights import CompiledLight, Illumination, angular_radius, illuminate
from .occlusion import open_share
from .scattering import mirrored, phong, schlick
from .shadows import TOGETHER, Origins, visible_shares
from .tally import Tally
from .vectors import Array, Index, add, count, dot, flatnonzero, normalize, select, take, write

PI, INVERSE_PI = np.float32(np.pi), np.float32(1 / np.pi)


Cut = Callable[[Index, Float32], Array]
"""Asked which hits do without a light that brings the share (3, m) of what a white wall would send on: (m,) bool."""


def local_radiance(scene: CompiledScene, hit: Interaction, tally: Tally, cut: Cut | None = None) -> Float32:
    """Llocal (3, n) of hits, seen along wo. Surfaces shade on both sides: normals are on the side of wo."""
    plan, color = scene.plan, hit.value("base_color")
    radiance = np.zeros(color.shape, np.float32)
    if plan.ambient:
        _add_ambient(scene, hit, radiance, tally)
    if plan.diffuse or plan.specular:
        color = color * (hit.value("diffuse") * INVERSE_PI)
        point, origins = hit.point.astype(np.float32), Origins(scene.geometry, hit)
        # Few hits ask for the shadows of several lights at once: see TOGETHER.
        asked: list[_Lit] = []
        for light in scene.lights:
            asked.append(_lit_by(scene, hit, point, light, color, tally, cut))
            if sum(len(lit) for lit in asked) > TOGETHER:
                _add_lit(scene, hit, origins, asked, radiance, tally)
                asked = []
        _add_lit(scene, hit, origins, asked, radiance, tally)
    return radiance


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
        return self.arriving.shape[1]


def _lit_by(
    scene: CompiledScene,
    hit: Interaction,
    point: Float32,
    light: CompiledLight,
    diffuse: Float32,
    tally: Tally,
    cut: Cut | None,
) -> _Lit:
    """What would arrive from one light. diffuse: (3, n), albedo over pi with its weights.

    Shadow rays tell whether light comes through the back of a smooth triangle.
    """
    lit = illuminate(light, point, hit.n_shading, hit.offset)
    arriving = np.asarray(diffuse * (lit.diffuse * np.float32(light.light.diffuse)), np.float32)
    if scene.plan.specular and light.light.specular != 0:
        arriving += _highlight(hit, point, lit, light) * np.float32(light.light.specular)
    if light.light.cast_shadow and hit.n_shading is not hit.n_geometric:
        # What casts no shadow, not even on itself, gets no light through its back.
        casts = scene.casts_shadow(light)
        if casts is not None:
            arriving *= (dot(lit.wi, hit.n_geometric) > 0) | casts.take(hit.prim)

    if light.receives is not None:
        arriving *= light.receives.take(hit.prim)

    # Shadow rays are traced only where something would arrive.
    traces = light.light.cast_shadow and scene.plan.shadows
    if traces and cut is not None:
        _cut_faint(arriving, lit, cut, tally)
    wanted = select((arriving != 0).any(axis=0) | scene.plan.unlit)
    chosen = take(arriving, wanted)
    chosen *= light.color
    if traces:
        tally.add("shadow_not_needed", len(hit.prim) - chosen.shape[1])
    return _Lit(light, wanted, chosen, traces)


def _add_lit(
    scene: CompiledScene, hit: Interaction, origins: Origins, asked: list[_Lit], radiance: Float32, tally: Tally
) -> None:
    """Add what arrives of some lights, through all that is in between, to radiance (3, n)."""
    shares = visible_shares(scene, hit, origins, [(lit.light, lit.wanted) for lit in asked if lit.traces], tally)
    for lit in asked:
        wanted, chosen = lit.wanted, lit.arriving
        if lit.traces:
            visible = next(shares)
            chosen *= visible
            if hit.lit is not None:
                hit.lit[wanted] += lit.light.key * (visible > 0 if visible.ndim == 1 else (visible > 0).any(axis=0))
        add(radiance, wanted, chosen)


def _cut_faint(arriving: Float32, lit: Illumination, cut: Cut, tally: Tally) -> None:
    """Take out of arriving (3, n) what may be cut: then it needs no shadow ray."""
    faces = flatnonzero((lit.specular > 0) & (arriving != 0).any(axis=0))
    share = take(arriving, faces)
    share *= PI / lit.specular[faces]
    faint = faces[cut(faces, share)]
    write(arriving, faint, 0)
    tally.add("shadow_cut", len(faint))


def _add_ambient(scene: CompiledScene, hit: Interaction, radiance: Float32, tally: Tally) -> None:
    """Add the light of the world: what is diffuse, and its blurred image in the reflections that no ray follows."""
    lit = select(hit.table.shades_ambient.take(hit.surface))
    if count(lit, len(hit.prim)):
        color = hit.value("base_color", lit) * hit.value("ambient", lit)
        color = color * scene.world.irradiance_over_pi(take(hit.n_shading, lit))
        if scene.occluders is not None and hit.draws is not None:
            color *= open_share(scene, scene.occluders, hit, lit, tally)
        add(radiance, lit, color)
    blurred = select(hit.table.blurs.take(hit.surface))
    if count(blurred, len(hit.prim)) == 0:
        return
    wo, n = take(hit.wo, blurred), take(hit.n_shading, blurred)
    for name in ("lobe", "coat"):
        weight = hit.value(f"{name}_blurred", blurred)
        rough = flatnonzero(weight if weight.ndim == 1 else weight.any(axis=0))
        if len(rough):
            index = rough if isinstance(blurred, slice) else take(blurred, rough)
            wide = hit.value(f"{name}_roughness", index)
            image = scene.world.glossy(mirrored(wo[:, rough], n[:, rough], wide), wide)
            add(radiance, index, take(weight, rough) * image)


def _highlight(hit: Interaction, point: Float32, lit: Illumination, light: CompiledLight) -> Float32:
    """Highlights (3, n) for light of colour 1; only for hits whose surface has one and which face the light."""
    table = hit.table
    result = np.zeros((3, len(hit.prim)), np.float32)
    cos_i, cos_o = dot(lit.wi, hit.n_shading), dot(hit.wo, hit.n_shading)
    shines = table.shades_specular.take(hit.surface) & (lit.specular > 0) & (cos_i > 0) & (cos_o > 0)
    if table.layered.any():
        layered = table.layered.take(hit.surface)
        _add_layered(hit, point, lit, light, select(shines & layered), result)
        shines &= ~layered
        if not shines.any():
            return result
    shiny = select(shines)
    wi, wo, n = take(lit.wi, shiny), take(hit.wo, shiny), take(hit.n_shading, shiny)
    half = normalize(wi + wo)
    cos_h, wo_h = np.minimum(dot(half, n), np.float32(1)), dot(half, wo)
    faces, least = (cos_h > 0) & (wo_h > 0), np.float32(LEAST_COSINE)
    lobe = phong(
        np.maximum(cos_h, least),
        take(cos_i, shiny),
        take(cos_o, shiny),
        np.maximum(wo_h, least),
        hit.value("exponent", shiny),
    )
    lobe *= take(lit.specular, shiny)
    lobe *= faces
    highlight = schlick(hit.value("specular", shiny), wo_h) * lobe
    write(result, shiny, highlight)
    return result


def _add_layered(
    hit: Interaction, point: Float32, lit: Illumination, light: CompiledLight, index: Index, result: Float32
) -> None:
    """Add the lobes of layered surfaces to result (3, n), at the hits `index`. point: (3, n) of all."""
    if count(index, len(hit.prim)) == 0:
        return
    wi, wo, n = take(lit.wi, index), take(hit.wo, index), take(hit.n_shading, index)
    half = normalize(wi + wo)
    cosines = np.minimum(dot(half, n), np.float32(1)), dot(wi, n), dot(wo, n)
    radius = angular_radius(light, take(point, index))
    color = hit.value("lobe", index) * ggx_highlight(*cosines, hit.value("lobe_roughness", index), radius)
    coat = hit.value("coat", index)
    if coat.any():
        color += coat * ggx_highlight(*cosines, hit.value("coat_roughness", index), radius)
    color *= take(lit.specular, index)
    write(result, index, color)
