# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that vary: what their hits look like, by their cosines and by what the expressions give there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...expressions import Evaluation
from ...scene import Expression, Float32, Float64, Surface
from ..core.constants import LEAST_COSINE
from ..core.rays import Rays, RayState
from ..core.sampler import Draws
from ..core.vectors import ALL, Array, Index, dot, flatnonzero, take, write
from ..geometry.flatten import Geometry
from ..geometry.hits import Hits
from ..materials.columns import CROSSING, HitValues, plain_columns
from ..materials.fields import fields_of, limited
from ..materials.principled import layered_columns
from ..materials.surfaces import SurfaceTable
from ..materials.tabulated import factors
from ..media.nested import Stack
from ..prepare.compiled import CompiledScene
from .crossings import with_sides
from .hit_data import HitData
from .interaction import Interaction, interact
from .microfacets import brushed_share
from .scattering import above

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]


def surface_hits(
    scene: CompiledScene, rays: Rays, hits: Hits, media: Stack | None = None, draws: Draws | None = None
) -> Interaction:
    """Where the hits of rays, none of them a miss, are; `closures_at` tells how they look.

    media, draws : see `Interaction`.
    """
    at = interact(scene.geometry, scene.surfaces, hits, rays, media, draws)
    return with_sides(scene.geometry, scene.media, rays, at, hits.t)


def resolve(geometry: Geometry, at: Interaction, distance: Float64) -> Interaction:
    """Hits on single closures with values of their own where these vary, and normal maps applied.

    distance : (n,) along the rays.
    """
    if not at.table.varies.take(at.surface).any():
        return at
    way = at.face, at.surface, at.point, at.entering, at.n_shading, at.wo, distance
    assigned = hit_groups(geometry, at.table, *way, at.came)
    n_shading = _turned(assigned, at.n_shading)
    cos = np.maximum(dot(at.wo, n_shading), 0)  # one that looks away from the eye is seen edge on
    values = at.table.tabulated.look_up(at.surface, cos)
    values = _with_expressions(at.table, assigned, values, at.surface, cos)
    at = replace(at, values=values, n_shading=n_shading)
    tangent = _tangents(assigned, n_shading)
    return at if tangent is None else _brushed(at, tangent)


def resolve_crossings(
    geometry: Geometry, table: SurfaceTable, surface: Numbers, told: Numbers, hits: Hits, origin: Float32, wi: Float32,
    came: RayState, seen: HitValues,
) -> HitValues:  # fmt: skip
    """The values `seen` of n points where shadow rays cross single closures, with what expressions tell of some.

    surface          : (n,) closures.   told : (m,) of which.
    hits, origin, wi : of these, and their rays (3, m).   came : how these came.
    Of columns there are the rows CROSSING alone.
    """
    face, cos = hits.face.astype(np.intp, copy=False), np.abs(hits.toward)
    normal = hits.normal * -np.sign(hits.toward).astype(np.float32)
    assigned = hit_groups(
        geometry, table, face, surface.take(told), origin + wi * hits.t, hits.toward < 0, normal, -wi, hits.t, came,
        told,
    )  # fmt: skip
    cosines = np.zeros(len(seen.place))
    cosines[told] = cos
    return _with_expressions(table, assigned, seen, surface, cosines, crossing=True)


@dataclass(frozen=True, eq=False)
class _HitGroup:
    """A surface with expressions and the hits on it."""

    number: int
    surface: Surface
    hits: Numbers
    data: HitData
    evaluate: Evaluation


def hit_groups(
    geometry: Geometry, table: SurfaceTable, face: Numbers, surface: Numbers, point: Float64, entering: Bools,
    normal: Float32, wo: Float32, distance: Float64, came: RayState | None, among: Index = ALL,
) -> list[_HitGroup]:  # fmt: skip
    """The surfaces with expressions among those of n hits, which are the hits `among` some others."""
    found = []
    met = flatnonzero(np.bincount(surface, minlength=len(table.expressive)))
    for number in met[table.expressive[met]].tolist():
        hits = flatnonzero(surface == number)
        data = HitData(geometry, number, face, point, entering, normal, wo, distance, came, hits)
        hits = hits if isinstance(among, slice) else take(among, hits)
        found.append(_HitGroup(number, table.surfaces[number], hits, data, Evaluation(data)))
    return found


def _turned(assigned: list[_HitGroup], n_shading: Float32) -> Float32:
    """Shading normals (3, n) with normal maps applied. These may look away from the eye, as in EEVEE and Cycles."""
    mapped = [one for one in assigned if one.surface.normal is not None]
    result = n_shading.copy() if mapped else n_shading
    for one in mapped:
        assert one.surface.normal is not None
        write(result, one.hits, one.data.unit_normal(one.evaluate(one.surface.normal)))
    return result


def _tangents(assigned: list[_HitGroup], n_shading: Float32) -> Float32 | None:
    """Unit vectors (3, n) along brushed surfaces, 0 where there is none; None: no surface is brushed."""
    brushed = [one for one in assigned if one.surface.tangent is not None]
    result = np.zeros_like(n_shading) if brushed else None
    for one in brushed:
        assert one.surface.tangent is not None and result is not None
        write(result, one.hits, _along(one.evaluate(one.surface.tangent)[:3], take(n_shading, one.hits)))
    return result


def _brushed(at: Interaction, tangent: Float32) -> Interaction:
    """The hits with their grooves, and the light that is lost in these."""
    at = replace(at, tangent=tangent)
    index = flatnonzero(tangent.any(axis=0))
    brushed = at.brushed(index)
    if brushed is None or len(index) == 0:
        return at
    n = at.n_shading[:, index]
    wo, _ = above(at.wo[:, index], n, at.cos_o[index])
    share = np.ones(tangent.shape, np.float32)
    share[:, index] = brushed_share(wo, n, at.value("lobe_roughness", index), brushed)
    # The coat, which is round, has its part of what rays follow.
    mirror, coat = at.value("mirror"), at.value("coat") - at.value("coat_blurred")
    coated = np.where(mirror > 0, coat / np.where(mirror > 0, mirror, np.float32(1)), np.float32(0))
    followed = share + (1 - share) * np.minimum(coated, np.float32(1))
    factors = {**at.values.factors, "mirror": followed, "lobe_blurred": share}
    return replace(at, values=replace(at.values, factors=factors))


def _along(vector: Array, n: Float32) -> Float32:
    """Unit vectors (3, m): the part of `vector` (3, m or 1) in the plane of normals n, 0 where there is none."""
    along = np.broadcast_to(vector, n.shape).astype(np.float64)
    along = along / np.maximum(np.abs(along).max(axis=0), np.finfo(np.float32).tiny)
    along = along - n * dot(along, n)
    length = np.sqrt(dot(along, along))
    found = np.isfinite(length) & (length > LEAST_COSINE)
    return np.where(found, along / np.where(found, length, 1), 0).astype(np.float32)


def _with_expressions(
    table: SurfaceTable, assigned: list[_HitGroup], values: HitValues, surface: Numbers, cos: Array,
    crossing: bool = False,
) -> HitValues:  # fmt: skip
    """The values of n hits on `surface` (n,), seen at `cos`, with what expressions tell.

    crossing : the rows CROSSING alone.
    """
    scaled = [one for one in assigned if table.tabulated.known[one.number]]
    factor: dict[str, Float32] = {}
    for one in () if crossing else scaled:
        for name in factors(one.surface):
            scale = factor.setdefault(name, np.ones((3, len(cos)), np.float32))
            color = limited(name, one.evaluate(getattr(one.surface, name)))
            write(scale, one.hits, np.broadcast_to(color, (3, len(one.hits))))
    own = [one for one in assigned if not table.tabulated.known[one.number]]
    if not own:
        return replace(values, factors=factor)
    columns, place, ior = values.columns, values.place.copy(), None
    if any(isinstance(one.surface.ior, Expression) for one in own):
        ior = table.ior.take(surface)
    rows = CROSSING if crossing else slice(None)
    found = [columns.values[rows]]
    start = columns.values.shape[1]
    for one in own:
        fields = fields_of(one.surface, one.evaluate, table.known[crossing][one.number])
        if ior is not None and isinstance(one.surface.ior, Expression):
            ior[one.hits] = fields["ior"]
        angle = take(cos, one.hits).astype(np.float64)
        own_columns = layered_columns(fields, angle) if one.surface.layered else plain_columns(fields, len(angle))
        found.append(own_columns[rows])
        place[one.hits] = start + np.arange(len(angle))
        start += len(angle)
    columns = replace(columns, values=np.concatenate(found, axis=1))
    return replace(values, columns=columns, place=place, factors=factor, ior=ior)
