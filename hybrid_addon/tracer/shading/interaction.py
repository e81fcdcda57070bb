# SPDX-License-Identifier: GPL-3.0-or-later
"""What a hit knows: its point, normals and surface, recomputed in float64 from the exact float32 geometry."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated
from ...scene import Float32, Float64, Int32
from ..core.constants import FROSTED_ROUGHNESS
from ..core.rays import Rays, RayState, offset_origin, origin_offset, state_of
from ..core.sampler import Draws
from ..core.vectors import ALL, Array, Index, count, dot, most, put, select, signs, take
from ..geometry.aggregate import barycentric_weights, clamped
from ..geometry.flatten import Geometry
from ..geometry.hits import Hits
from ..geometry.instanced import Faces
from ..materials.columns import HitValues
from ..materials.surfaces import SurfaceTable
from ..media.near import Sides

Numbers = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Interaction:
    """n hits, seen from where their rays come from: normals are turned to the side of `wo`.

    prim        : (n,) intp, rows in tables of all primitives
    face        : (n,) intp, what is hit (see `aggregate.Hits`)
    table       : the scene's surfaces
    surface     : (n,) intp, which of them; after `closures_at`, which closure
    values      : their numbers of the surface model
    entering    : (n,) bool, the ray comes from the primitive's outer side
    point       : (3, n) float64, in the primitive's plane
    n_geometric : (3, n) float32
    n_shading   : (3, n) float32; the same array where nothing is smooth
    weights     : (2, n) float64, barycentrics of the second and third corner on smooth triangles; None: none is smooth
    wo          : (3, n) float32, back along the ray
    offset      : (n,) float32, how far off the surface new rays start
    outer       : (3, n) float32, origin of new rays on the side of wo
    media       : (rows, n) int32, solids around the hit on the side of wo; None: nothing absorbs shadow rays
    draws       : its random numbers; None: shadows are hard
    tangent     : (3, n) float32 unit vectors along brushed surfaces, 0 on others; None: all are round
    came        : how the rays came that hit; None: no surface asks
    sides       : the media around hits where more than one surface is passed; None: nowhere
    share       : (n,) float32, of the weights of all closures there, that of this one; None: it is alone
    let_in      : (3, n) float32, of the world's light what gets to insides of closed bodies; None: all of it
    answers     : what surface programs said of the hits (`programs.Answers`); None: there is none
    """

    prim: Numbers
    face: Numbers
    table: SurfaceTable
    surface: Numbers
    values: HitValues
    entering: NDArray[np.bool_]
    point: Float64
    n_geometric: Float32
    n_shading: Float32
    weights: Float64 | None
    wo: Float32
    offset: Float32
    outer: Float32
    media: NDArray[np.int32] | None = None
    draws: Draws | None = None
    came: RayState | None = None
    sides: Sides | None = None
    tangent: Float32 | None = None
    share: Float32 | None = None
    let_in: Float32 | None = None
    answers: Any = None

    @property
    def ior(self) -> Float64:
        """(n,) inside over outside."""
        return self.table.ior.take(self.surface) if self.values.ior is None else self.values.ior

    @cached_property
    def cos_o(self) -> Float32:
        """(n,) cosine between the shading normal and wo."""
        return dot(self.wo, self.n_shading)

    @cached_property
    def has_highlight(self) -> NDArray[np.bool_]:
        """(n,) whether lamps light its reflection straight: not from within what bends their light on its way."""
        return self.entering | ~self.table.refracts.take(self.surface)

    @cached_property
    def glows(self) -> NDArray[np.bool_]:
        """(n,) whether lamps light what it refracts: out of rough glass, seen from within."""
        rough = self.table.rough.take(self.surface) & (self.value("lobe_roughness") > FROSTED_ROUGHNESS)
        return ~self.entering & self.table.refracts.take(self.surface) & rough

    def value(self, name: str, index: Index = ALL) -> Float32:
        """Numbers (m,) or (3, m) of the surface model (columns.WIDTHS) for the hits `index`; not to be written to."""
        return self.values.value(name, index)

    def inner(self, index: Index) -> Float32:
        """Origins (3, m) of new rays on the far side, for the hits `index`."""
        return offset_origin(take(self.point, index), take(self.n_geometric, index), -take(self.offset, index))

    def brushed(self, index: Index) -> tuple[Float32, Float32] | None:
        """Tangents (3, m) and stretches (m,) of the hits `index`; None: all are round."""
        if self.tangent is None:
            return None
        return take(self.tangent, index), self.value("stretch", index)

    def turned(self, over: NDArray[np.bool_]) -> Interaction:
        """The hits with those `over` (n,) as seen from the other side: what falls there lights them."""
        if not over.any():
            return self
        side = np.where(over, np.float32(-1), np.float32(1))
        n_geometric = self.n_geometric * side
        flat = self.n_shading is self.n_geometric
        return replace(
            self,
            entering=self.entering ^ over,
            n_geometric=n_geometric,
            n_shading=n_geometric if flat else self.n_shading * side,
            outer=np.where(over, self.inner(ALL), self.outer),
        )

    def take(self, index: Index) -> Interaction:
        """The hits `index`, in that order."""
        if isinstance(index, slice) and index == slice(None):
            return self
        flat = self.n_shading is self.n_geometric
        n_geometric, prim = take(self.n_geometric, index), take(self.prim, index)
        return Interaction(
            prim=prim,
            face=prim if self.face is self.prim else take(self.face, index),
            table=self.table,
            surface=take(self.surface, index),
            values=self.values.take(index),
            entering=take(self.entering, index),
            point=take(self.point, index),
            n_geometric=n_geometric,
            n_shading=n_geometric if flat else take(self.n_shading, index),
            weights=None if self.weights is None else take(self.weights, index),
            wo=take(self.wo, index),
            offset=take(self.offset, index),
            outer=take(self.outer, index),
            media=None if self.media is None else take(self.media, index),
            draws=None if self.draws is None else self.draws.take(index),
            came=None if self.came is None else self.came.take(index),
            sides=None if self.sides is None else self.sides.take(index),
            tangent=None if self.tangent is None else take(self.tangent, index),
            share=None if self.share is None else take(self.share, index),
            let_in=None if self.let_in is None else take(self.let_in, index),
            answers=None if self.answers is None else self.answers.take(index),
        )


def interact(
    geometry: Geometry,
    table: SurfaceTable,
    hits: Hits,
    rays: Rays,
    media: NDArray[np.int32] | None = None,
    draws: Draws | None = None,
) -> Interaction:
    """Recompute the hits, none of them a miss, of rays. media, draws: see `Interaction`."""
    way = hits.t, hits.normal, hits.toward, rays.origin, rays.direction
    # Meshes that are kept once have no tables of all faces: there the hits have tables of their own.
    faces, place = geometry.faces_of(hits.face)
    surfaces = geometry.surface if faces is geometry else geometry.surface.take(hits.prim)
    place, surface, entering, point, n_geometric, offset, wo, outer = hit_points(surfaces, faces.extent, place, *way)
    prim, face = (place, place) if faces is geometry else (hits.prim.astype(np.intp), hits.face)
    n_shading, weights = _shading_normal(faces, place, point, n_geometric, entering)
    return Interaction(
        prim=prim,
        face=face,
        table=table,
        surface=surface,
        values=HitValues(table.columns, surface),
        entering=entering,
        point=point,
        n_geometric=n_geometric,
        n_shading=n_shading,
        weights=weights,
        wo=wo,
        offset=offset,
        outer=outer,
        media=media,
        draws=draws,
        came=state_of(rays),
    )


def seen_at(geometry: Geometry, at: Interaction, hits: Hits, origin: Float32, direction: Float32) -> Interaction:
    """What `at` (n,) is, at other places: where rays (3, n) of their own hit, none of them a miss."""
    faces, place = geometry.faces_of(hits.face)
    surfaces = geometry.surface if faces is geometry else geometry.surface.take(hits.prim)
    way = hits.t, hits.normal, hits.toward, origin, direction
    place, _, entering, point, n_geometric, offset, wo, outer = hit_points(surfaces, faces.extent, place, *way)
    prim, face = (place, place) if faces is geometry else (hits.prim.astype(np.intp), hits.face)
    n_shading, weights = _shading_normal(faces, place, point, n_geometric, entering)
    return replace(
        at, prim=prim, face=face, entering=entering, point=point, n_geometric=n_geometric, n_shading=n_shading,
        weights=weights, wo=wo, offset=offset, outer=outer,
    )  # fmt: skip


@accelerated
def hit_points(
    surfaces: Numbers, extents: Float32, prim: Int32, t: Float64, normal: Float32, toward: Float64, origin: Float32,
    direction: Array,
) -> tuple[Array, ...]:  # fmt: skip
    """Of `Interaction`: prim, surface, entering, point, n_geometric, offset, wo, outer.

    surfaces, extents : (np,) of all primitives.   prim, t, normal, toward : of the hits (n,), see `Hits`.
    """
    numbers = prim.astype(np.intp)
    entering = toward < 0
    point = direction * t
    point += origin
    facing = normal * signs(entering)
    offset = origin_offset(point.astype(np.float32), extents.take(numbers))
    wo = -direction.astype(np.float32, copy=False)
    return numbers, surfaces.take(numbers), entering, point, facing, offset, wo, offset_origin(point, facing, offset)


def _shading_normal(
    geometry: Geometry | Faces, prim: Numbers, point: Float64, n_geometric: Float32, entering: NDArray[np.bool_]
) -> tuple[Float32, Float64 | None]:
    """Interpolated normals (3, n) on the side of n_geometric, itself where a triangle is flat; and their weights."""
    if geometry.normals is None:
        return n_geometric, None
    number, normals, weights = smooth_normals(
        geometry.smooth, geometry.normals, geometry.weights, prim, point, n_geometric, entering
    )
    return (normals, weights) if number else (n_geometric, None)


@accelerated
def smooth_normals(
    is_smooth: NDArray[np.bool_], normals: Float32, planes: Float64, prim: Numbers, point: Float64,
    n_geometric: Float32, entering: NDArray[np.bool_],
) -> tuple[int, Float32, Float64]:  # fmt: skip
    """How many of the hits (n,) are on smooth triangles, the normals and weights of all.

    is_smooth : (np,)   normals, planes : (nt, 9), (nt, 8), see `Geometry`.
    """
    here = is_smooth.take(prim)
    smooth = most(here)
    number = count(smooth, len(prim))
    if number == 0:
        return 0, n_geometric, np.zeros((2, len(prim)))
    weights = clamped(barycentric_weights(planes.reshape(-1, 4), take(prim, smooth), take(point, smooth)))
    u, v = weights.astype(np.float32)
    corner = np.ascontiguousarray(normals.take(take(prim, smooth), axis=0, mode="clip").T)
    n = corner[0:3] * (1 - weights[0] - weights[1]).astype(np.float32)
    n += corner[3:6] * u
    n += corner[6:9] * v
    length = np.maximum(np.sqrt(dot(n, n)), np.finfo(np.float32).tiny)
    n *= signs(take(entering, smooth)) / length
    # A normal that vanishes or points into its own surface tells nothing: the geometric one then.
    facing = take(n_geometric, smooth)
    np.copyto(n, facing, where=~(take(here, smooth) & (dot(n, facing) > 0)))
    return int(np.count_nonzero(here)), put(n_geometric, smooth, n), put(np.zeros((2, len(prim))), smooth, weights)


def shadow_origin(geometry: Geometry, hit: Interaction, index: Index) -> Float32:
    """Where shadow rays of the hits `index` start, (3, m): off the surface, on smooth triangles off the curved one.

    The curved one is what the triangle stands for.

    Otherwise coarse facets shadow each other along the terminator. Hanika, Hacking the Shadow Terminator (Ray Tracing
    Gems II, 2021): P' = P + sum b_i max(0, (v_i - P).n_i) n_i, towards the tangent planes of the corners.
    """
    outer = take(hit.outer, index)
    if hit.weights is None:
        return outer
    table, prim = geometry.faces_of(take(hit.face, index))
    if table.normals is None:
        return outer
    smooth = select(table.smooth.take(prim))
    if count(smooth, len(prim)) == 0:
        return outer
    on_smooth = smooth if isinstance(index, slice) else take(index, smooth)
    prim, point = take(prim, smooth), take(hit.point, on_smooth)
    place, sign = point.astype(np.float32), signs(take(hit.entering, on_smooth))
    u, v = take(hit.weights, on_smooth).astype(np.float32)
    normals = np.ascontiguousarray(table.normals.take(prim, axis=0).T)
    heights = table.heights.take(prim, axis=0).T
    # What is lifted is small, and may be an ulp of the place too much: float32 will do.
    lifted = take(hit.n_geometric, on_smooth) * take(hit.offset, on_smooth)
    for i, weight in enumerate((1 - u - v, u, v)):
        n = normals[3 * i : 3 * i + 3]
        above = (heights[i] - dot(n, place)) * sign
        np.maximum(above, 0, out=above)
        above *= weight * sign
        lifted += n * above
    return put(outer, smooth, (lifted + point).astype(np.float32))
