"""Local shading: ambient, diffuse and Phong light of hits, with shadows tinted through what is not opaque.

Llocal = ambient base_color E_world / pi + sum over lights (diffuse base_color / pi + Phong) E_light visibility
"""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32
from .accel import traceable
from .compiled import Blockers, CompiledScene
from .constants import MAX_SHADOW_CROSSINGS, SHADOW_REACH
from .geometry import Geometry
from .interaction import Interaction, shadow_origin
from .layers import ggx_highlight
from .lights import CompiledLight, Illumination, angular_radius, illuminate, shadow_rays
from .media import Stack, transmittance
from .occlusion import open_share
from .primitives import PrimitiveSet
from .rays import offset_origin, origin_offset
from .scattering import both_faces, fresnel_dielectric, mirrored, phong, schlick, simple_caustic
from .tally import Tally
from .varying import resolve_crossings
from .vectors import Array, Index, count, dot, normalize, select, take

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]

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
        point = hit.point.astype(np.float32)
        origins = _Origins(scene.geometry, hit)
        for light in scene.lights:
            _add_light(scene, hit, point, origins, light, color, radiance, tally, cut)
    return radiance


class _Origins:
    """Where shadow rays start: worked out for hits when the first light asks for them."""

    def __init__(self, geometry: Geometry, hit: Interaction) -> None:
        self.geometry, self.hit = geometry, hit
        self.known = np.zeros(len(hit.prim), bool)
        self.origin = np.empty(hit.outer.shape, np.float32)

    def take(self, index: Index) -> Float32:
        """Origins (3, m) for the hits `index`."""
        if self.hit.weights is None:
            return take(self.hit.outer, index)
        unknown = select(~self.known[index])
        new = unknown if isinstance(index, slice) else take(index, unknown)
        self.origin[:, new] = shadow_origin(self.geometry, self.hit, new)
        self.known[new] = True
        return take(self.origin, index)


def _add_light(
    scene: CompiledScene,
    hit: Interaction,
    point: Float32,
    origins: _Origins,
    light: CompiledLight,
    diffuse: Float32,
    radiance: Float32,
    tally: Tally,
    cut: Cut | None,
) -> None:
    """Add one light's share to radiance (3, n). diffuse: (3, n), albedo over pi with its weights.

    Shadow rays tell whether light comes through the back of a smooth triangle.
    """
    # Work out what would arrive if nothing were in between.
    lit = illuminate(light, point, hit.n_shading, hit.offset)
    arriving = np.asarray(diffuse * (lit.diffuse * np.float32(light.light.diffuse)), np.float32)
    if scene.plan.specular and light.light.specular != 0:
        arriving += _highlight(hit, lit, light) * np.float32(light.light.specular)
    if light.light.cast_shadow and hit.n_shading is not hit.n_geometric:
        # What casts no shadow, not even on itself, gets no light through its back.
        casts = scene.geometry.shadow if light.blocks is None else scene.geometry.shadow & light.blocks
        arriving *= (dot(lit.wi, hit.n_geometric) > 0) | casts.take(hit.prim)

    if light.receives is not None:
        arriving *= light.receives.take(hit.prim)

    # Trace shadow rays only where something would arrive.
    traces = light.light.cast_shadow and scene.plan.shadows
    if traces and cut is not None:
        _cut_faint(arriving, lit, cut, tally)
    wanted = select((arriving != 0).any(axis=0) | scene.plan.unlit)
    chosen = take(arriving, wanted)
    chosen *= light.color
    if traces:
        tally.add("shadow_not_needed", len(hit.prim) - chosen.shape[1])
        visible = _visible_share(scene, light, hit, origins.take(wanted), wanted, tally)
        chosen *= visible
        if hit.lit is not None:
            hit.lit[wanted] += light.key * (visible > 0 if visible.ndim == 1 else (visible > 0).any(axis=0))
    if isinstance(wanted, slice):
        radiance += chosen
    else:
        for i in range(3):
            radiance[i, wanted] += chosen[i]


def _cut_faint(arriving: Float32, lit: Illumination, cut: Cut, tally: Tally) -> None:
    """Take out of arriving (3, n) what may be cut: then it needs no shadow ray."""
    faces = np.flatnonzero((lit.specular > 0) & (arriving != 0).any(axis=0))
    faint = faces[cut(faces, np.asarray(arriving[:, faces] * (PI / lit.specular[faces]), np.float32))]
    arriving[:, faint] = 0
    tally.add("shadow_cut", len(faint))


def _add_ambient(scene: CompiledScene, hit: Interaction, radiance: Float32, tally: Tally) -> None:
    """Add the light of the world: what is diffuse, and its blurred image in the reflections that no ray follows."""
    lit = select(hit.table.shades_ambient.take(hit.surface))
    if count(lit, len(hit.prim)):
        color = hit.value("base_color", lit) * hit.value("ambient", lit)
        color = color * scene.world.irradiance_over_pi(take(hit.n_shading, lit))
        if scene.occluders is not None and hit.draws is not None:
            color *= open_share(scene, scene.occluders, hit, lit, tally)
        radiance[:, lit] += color
    blurred = select(hit.table.blurs.take(hit.surface))
    if count(blurred, len(hit.prim)) == 0:
        return
    wo, n = take(hit.wo, blurred), take(hit.n_shading, blurred)
    for name in ("lobe", "coat"):
        weight = hit.value(f"{name}_blurred", blurred)
        rough = np.flatnonzero(weight if weight.ndim == 1 else weight.any(axis=0))
        if len(rough):
            index = rough if isinstance(blurred, slice) else take(blurred, rough)
            wide = hit.value(f"{name}_roughness", index)
            image = scene.world.glossy(mirrored(wo[:, rough], n[:, rough], wide), wide)
            radiance[:, index] += take(weight, rough) * image


def _highlight(hit: Interaction, lit: Illumination, light: CompiledLight) -> Float32:
    """Highlights (3, n) for light of colour 1; only for hits whose surface has one and which face the light."""
    table = hit.table
    result = np.zeros((3, len(hit.prim)), np.float32)
    cos_i, cos_o = dot(lit.wi, hit.n_shading), dot(hit.wo, hit.n_shading)
    shines = table.shades_specular.take(hit.surface) & (lit.specular > 0) & (cos_i > 0) & (cos_o > 0)
    if table.layered.any():
        layered = table.layered.take(hit.surface)
        _add_layered(hit, lit, light, select(shines & layered), result)
        shines &= ~layered
        if not shines.any():
            return result
    shiny = select(shines)
    wi, wo, n = take(lit.wi, shiny), take(hit.wo, shiny), take(hit.n_shading, shiny)
    half = normalize(wi + wo)
    cos_h, wo_h = np.minimum(dot(half, n), np.float32(1)), dot(half, wo)
    faces = (cos_h > 0) & (wo_h > 0)
    lobe = phong(
        np.where(faces, cos_h, np.float32(1)),
        take(cos_i, shiny),
        take(cos_o, shiny),
        np.where(faces, wo_h, np.float32(1)),
        hit.value("exponent", shiny),
    )
    lobe *= take(lit.specular, shiny)
    lobe *= faces
    highlight = schlick(hit.value("specular", shiny), wo_h) * lobe
    for i in range(3):
        result[i, shiny] = highlight[i]
    return result


def _add_layered(hit: Interaction, lit: Illumination, light: CompiledLight, index: Index, result: Float32) -> None:
    """Add the lobes of layered surfaces to result (3, n), at the hits `index`."""
    if count(index, len(hit.prim)) == 0:
        return
    wi, wo, n = take(lit.wi, index), take(hit.wo, index), take(hit.n_shading, index)
    half = normalize(wi + wo)
    cosines = np.minimum(dot(half, n), np.float32(1)), dot(wi, n), dot(wo, n)
    radius = angular_radius(light, take(hit.point, index))
    color = hit.value("lobe", index) * ggx_highlight(*cosines, hit.value("lobe_roughness", index), radius)
    coat = hit.value("coat", index)
    if coat.any():
        color += coat * ggx_highlight(*cosines, hit.value("coat_roughness", index), radius)
    color *= take(lit.specular, index)
    for row, values in zip(result, color, strict=True):
        row[index] = values


def _visible_share(
    scene: CompiledScene, light: CompiledLight, hit: Interaction, origin: Float32, wanted: Index, tally: Tally
) -> Array:
    """What share, (m,) or (3, m), of a light gets to the origins (3, m) at the hits `wanted`: the mean over samples."""
    normal, media = take(hit.n_geometric, wanted), None if hit.media is None else take(hit.media, wanted)
    cut = np.zeros(origin.shape[1], bool)
    seen = _seen_share(scene, light, hit, origin, normal, media, wanted, cut, tally)
    if hit.cut is not None and cut.any():
        hit.cut[wanted] |= cut
    return seen


def _seen_share(
    scene: CompiledScene, light: CompiledLight, hit: Interaction, origin: Float32, normal: Float32,
    media: Stack | None, wanted: Index, cut: Bools, tally: Tally,
) -> Array:  # fmt: skip
    """The same, with marks in `cut` (m,) where a shadow ray is not followed to its end."""
    blockers = scene.blockers(light)
    if media is not None and blockers.hollow is not None:
        media = scene.media.without(media, blockers.hollow)
    if hit.draws is None or not (light.is_soft and scene.plan.soft_shadows):
        return visibility(scene, blockers, *shadow_rays(light, origin, normal, None), origin, media, tally, cut)
    draws, parts = hit.draws.take(wanted), scene.settings.shadow_samples
    squares = [draws.square(light.key, part, parts) for part in range(parts)]
    rays = (shadow_rays(light, origin, normal, square) for square in squares)
    seen = [visibility(scene, blockers, wi, distance, origin, media, tally, cut) for wi, distance in rays]
    return seen[0] if parts == 1 else np.asarray(sum(seen) / np.float32(parts), np.float32)


def visibility(
    scene: CompiledScene,
    blockers: Blockers,
    wi: Float32,
    distance: Float32,
    origin: Float32,
    media: Stack | None,
    tally: Tally,
    cut: Bools | None = None,
) -> Array:
    """What share, (n,) or (3, n), of the light `distance` (n,) along wi (3, n) gets to the origins (3, n).

    media : (rows, n), the solids around the origins.   cut : (n,), gets marks where a ray is not followed to its end.
    """
    t_max = distance * np.float32(SHADOW_REACH)
    is_open = traceable(origin, wi)
    sound = select(is_open)
    if cut is not None and not isinstance(sound, slice):
        cut |= ~is_open
    tally.add("dropped", len(is_open) - count(sound, len(is_open)))
    tally.add("shadow", count(sound, len(is_open)))
    if len(blockers.opaque):
        o, d, t = take(origin, sound), take(wi, sound), take(t_max, sound)
        is_open[sound] = ~blockers.opaque.occluded(o, d, t, tally)
    if not len(blockers.tinted):
        return is_open
    remaining = select(is_open)
    media = None if media is None else take(media, remaining)
    way = take(origin, remaining), take(wi, remaining), take(t_max, remaining)
    passed, exhausted = _transmittance(scene, blockers.tinted, *way, media, tally)
    if cut is not None and len(exhausted):
        cut[exhausted if isinstance(remaining, slice) else remaining[exhausted]] = True
    if isinstance(remaining, slice):
        return passed
    visible = np.zeros(origin.shape, np.float32)
    for i in range(3):
        visible[i, remaining] = passed[i]
    return visible


def _transmittance(
    scene: CompiledScene,
    tinted: PrimitiveSet,
    origin: Float32,
    wi: Float32,
    t_max: Float32,
    media: Stack | None,
    tally: Tally,
) -> tuple[Float32, Numbers]:
    """Product (3, n) over the non-opaque surfaces on straight shadow rays of (1-r)(1-o)(1-F) transmission_tint.

    And of what the solids between them leave over, where any absorbs; media: (rows, n), those around the origins.
    The ray is not bent, so at both faces of a solid its angle is that in the outer medium, and F is taken from there.
    Also the rays that cross too many: they count as blocked.
    """
    geometry = scene.geometry
    result = np.ones(wi.shape, np.float32)
    active, d = np.arange(wi.shape[1]), wi
    travelled = np.zeros(wi.shape[1])
    for _ in range(MAX_SHADOW_CROSSINGS):
        tally.add("shadow_steps", len(active))
        hits = tinted.nearest(origin, d, tally)
        crosses = travelled + hits.t < t_max.take(active)
        if media is not None and scene.media.shadow_absorption is not None:
            way = np.where(crosses, hits.t, t_max.take(active) - travelled)
            result[:, active] *= transmittance(scene.media.shadow_absorption, media, way).astype(np.float32)
        crossed = np.flatnonzero(crosses)
        if len(crossed) == 0:
            return result, crossed
        active, d, prim, t = active[crossed], d.take(crossed, axis=1), hits.prim[crossed], hits.t[crossed]
        normal, toward = hits.normal.take(crossed, axis=1), hits.toward[crossed]
        table, surface = scene.surfaces, geometry.surface.take(prim)
        columns, column = table.columns, cast(Index, surface)
        if table.varies_through.take(surface).any():
            at = origin[:, crossed] + d * t
            columns, column = resolve_crossings(
                geometry, table, prim.astype(np.intp), at, toward < 0, -normal * np.sign(toward), d
            )
        fresnel, tint = fresnel_dielectric(np.abs(toward), table.ior.take(surface)), columns.take("tint", column)
        thin = scene.media.is_thin(prim.astype(np.intp))
        fresnel, tint = both_faces(fresnel, tint, thin)
        share = columns.take("interface", column) * (1 - fresnel)
        if scene.settings.caustics == "SIMPLE":
            focused = simple_caustic(np.abs(toward), table.ior.take(surface))
            share = share * (focused if thin is None else np.where(thin, 1.0, focused))
        passed = result.take(active, axis=1)
        passed *= (tint * share).astype(np.float32)
        for row, values in zip(result, passed, strict=True):
            row[active] = values
        if media is not None:
            media = scene.media.cross(media.take(crossed, axis=1), prim.astype(np.intp), toward < 0, Tally())
        # Go on behind the surface, unless nothing is left.
        alive = np.flatnonzero((passed > 0).any(axis=0))
        active, d, prim, t = active[alive], d.take(alive, axis=1), prim[alive], t[alive]
        if len(active) == 0:
            return result, active
        media = None if media is None else media.take(alive, axis=1)
        onward = normal.take(alive, axis=1) * np.sign(toward[alive])
        point = origin.take(crossed[alive], axis=1) + d * t
        travelled = travelled[crossed[alive]] + t
        origin = offset_origin(point, onward, origin_offset(point.astype(np.float32), geometry.extent.take(prim)))
    result[:, active] = 0
    tally.add("shadow_crossings_exhausted", len(active))
    return result, active
