"""What a hit knows: its point, normals and surface, recomputed in float64 from the exact float32 geometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32, Float64
from .geometry import Geometry
from .primitives import Hits, barycentrics
from .rays import Rays, offset_origin, origin_offset
from .surfaces import SurfaceTable
from .textures import sample_texture
from .vectors import Index, dot, take

Numbers = NDArray[np.intp]


@dataclass(eq=False)
class Interaction:
    """n hits, seen from where their rays come from: normals are turned to the side of `wo`.

    prim        : (n,) intp
    surface     : (n,) intp
    entering    : (n,) bool, the ray comes from the primitive's outer side
    point       : (3, n) float64, in the primitive's plane
    n_geometric : (3, n) float32
    n_shading   : (3, n) float32; the same array where nothing is smooth
    wo          : (3, n) float32, back along the ray
    offset      : (n,) float32, how far off the surface new rays start
    outer       : (3, n) float32, origin of new rays on the side of wo
    lit         : (n,) uint32, sum of the keys of the lights that reach it; None: nobody asks
    """

    prim: Numbers
    surface: Numbers
    entering: NDArray[np.bool_]
    point: Float64
    n_geometric: Float32
    n_shading: Float32
    wo: Float32
    offset: Float32
    outer: Float32
    lit: NDArray[np.uint32] | None = None

    def inner(self, index: Index) -> Float32:
        """Origins (3, m) of new rays on the far side, for the hits `index`."""
        return offset_origin(
            take(self.point, index), take(self.n_geometric, index).astype(np.float64), -take(self.offset, index)
        )

    def take(self, index: Index) -> Interaction:
        """The hits `index`, in that order."""
        if isinstance(index, slice) and index == slice(None):
            return self
        flat = self.n_shading is self.n_geometric
        n_geometric = take(self.n_geometric, index)
        return Interaction(
            prim=take(self.prim, index),
            surface=take(self.surface, index),
            entering=take(self.entering, index),
            point=take(self.point, index),
            n_geometric=n_geometric,
            n_shading=n_geometric if flat else take(self.n_shading, index),
            wo=take(self.wo, index),
            offset=take(self.offset, index),
            outer=take(self.outer, index),
            lit=None if self.lit is None else take(self.lit, index),
        )


def interact(geometry: Geometry, hits: Hits, rays: Rays, chosen: Index) -> Interaction:
    """Recompute the hits `chosen` (none of them a miss) of a wave of rays."""
    prim, t = take(hits.prim, chosen).astype(np.intp), take(hits.t, chosen)
    normal, toward = take(hits.normal, chosen), take(hits.toward, chosen)
    direction = take(rays.direction, chosen)
    entering = toward < 0
    point = direction * t
    point += take(rays.origin, chosen)
    facing = normal * np.where(entering, 1.0, -1.0)
    offset = origin_offset(point.astype(np.float32), geometry.extent.take(prim))
    n_geometric = facing.astype(np.float32)
    return Interaction(
        prim=prim,
        surface=geometry.surface.take(prim),
        entering=entering,
        point=point,
        n_geometric=n_geometric,
        n_shading=_shading_normal(geometry, prim, point, n_geometric, entering),
        wo=-direction.astype(np.float32, copy=False),
        offset=offset,
        outer=offset_origin(point, facing, offset),
    )


def _shading_normal(
    geometry: Geometry, prim: Numbers, point: Float64, n_geometric: Float32, entering: NDArray[np.bool_]
) -> Float32:
    """Interpolated normals (3, n) on the side of n_geometric; n_geometric itself where a triangle is flat."""
    if geometry.normals is None:
        return n_geometric
    smooth = np.flatnonzero(geometry.smooth.take(prim))
    if len(smooth) == 0:
        return n_geometric
    u, v = barycentrics(geometry, prim[smooth], point[:, smooth])
    corner = np.ascontiguousarray(geometry.normals.take(prim[smooth], axis=0).T)
    n = corner[0:3] * (1 - u - v).astype(np.float32) + corner[3:6] * u.astype(np.float32)
    n += corner[6:9] * v.astype(np.float32)
    length = np.sqrt(dot(n, n))
    n *= np.where(entering[smooth], np.float32(1), np.float32(-1)) / np.where(length > 0, length, np.float32(1))
    # A normal that vanishes or points into its own surface tells nothing: the geometric one then.
    usable = dot(n, n_geometric[:, smooth]) > 0
    result = n_geometric.copy()
    result[:, smooth] = np.where(usable, n, n_geometric[:, smooth])
    return result


def shadow_origin(geometry: Geometry, hit: Interaction) -> Float32:
    """Where shadow rays start (3, n): off the surface, on smooth triangles lifted to the curved one that it stands for.

    Otherwise coarse facets shadow each other along the terminator. Hanika, Hacking the Shadow Terminator (Ray Tracing
    Gems II, 2021): P' = P + sum b_i max(0, (v_i - P).n_i) n_i, towards the tangent planes of the corners.
    """
    if hit.n_shading is hit.n_geometric or geometry.normals is None:
        return hit.outer
    smooth = np.flatnonzero(geometry.smooth.take(hit.prim))
    if len(smooth) == 0:
        return hit.outer
    prim, point = hit.prim[smooth], hit.point[:, smooth]
    u, v = barycentrics(geometry, prim, point)
    normals = geometry.normals.take(prim, axis=0).T * np.where(hit.entering[smooth], np.float32(1), np.float32(-1))
    lifted = point.copy()
    for i, weight in enumerate((1 - u - v, u, v)):
        corner = geometry.vertices.take(geometry.triangles[prim, i], axis=0).T
        n = normals[3 * i : 3 * i + 3].astype(np.float64)
        lifted += n * (weight * np.maximum(dot(corner - point, n), 0))
    result = hit.outer.copy()
    facing = hit.n_geometric[:, smooth].astype(np.float64)
    result[:, smooth] = offset_origin(lifted, facing, hit.offset[smooth])
    return result


def base_color(geometry: Geometry, surfaces: SurfaceTable, hit: Interaction) -> Float32:
    """Albedo (3, n) of hits, textures looked up."""
    color = surfaces.base_color.take(hit.surface, axis=1)
    if not surfaces.textures:
        return color
    texture = surfaces.texture.take(hit.surface)
    for number, image in enumerate(surfaces.textures):
        wears = np.flatnonzero(texture == number)
        if len(wears):
            u, v = _texture_coordinates(geometry, hit.prim[wears], hit.point[:, wears])
            color[:, wears] = sample_texture(image, u, v)
    return color


def _texture_coordinates(geometry: Geometry, prim: Numbers, point: Float64) -> tuple[Float64, Float64]:
    """u, v (n,) from the UV map of triangles, longitude and latitude on spheres, metres on planes."""
    nt, ns = geometry.triangle_count, geometry.sphere_count
    u, v = np.zeros(len(prim)), np.zeros(len(prim))
    on_mesh = np.flatnonzero(prim < nt)
    if len(on_mesh) and geometry.uvs is not None:
        b1, b2 = barycentrics(geometry, prim[on_mesh], point[:, on_mesh])
        corner = geometry.uvs.take(prim[on_mesh], axis=0).T.astype(np.float64)
        b0 = 1 - b1 - b2
        u[on_mesh] = corner[0] * b0 + corner[2] * b1 + corner[4] * b2
        v[on_mesh] = corner[1] * b0 + corner[3] * b1 + corner[5] * b2
    on_sphere = np.flatnonzero((prim >= nt) & (prim < nt + ns))
    if len(on_sphere):
        x, y, z = point[:, on_sphere] - geometry.sphere_center[prim[on_sphere] - nt].T
        u[on_sphere] = 0.5 + np.arctan2(y, x) / (2 * np.pi)
        v[on_sphere] = 0.5 + np.arctan2(z, np.sqrt(x * x + y * y)) / np.pi
    on_plane = np.flatnonzero(prim >= nt + ns)
    if len(on_plane):
        u[on_plane], v[on_plane] = _plane_coordinates(geometry.facets[prim[on_plane], :3].T, point[:, on_plane])
    return u, v


def _plane_coordinates(normal: Float64, point: Float64) -> tuple[Float64, Float64]:
    """Coordinates along two axes of a plane; for a floor along x and y (Duff et al. 2017, branchless basis)."""
    sign = np.where(normal[2] < 0, -1.0, 1.0)
    a = -1 / (sign + normal[2])
    b = normal[0] * normal[1] * a
    x = (1 + sign * normal[0] ** 2 * a) * point[0] + sign * b * point[1] - sign * normal[0] * point[2]
    y = b * point[0] + (sign + normal[1] ** 2 * a) * point[1] - normal[1] * point[2]
    return x, y
