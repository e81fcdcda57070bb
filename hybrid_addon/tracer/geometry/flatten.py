# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's geometry as flat arrays: instances realised, recentred in float64, rounded to float32 once.

A *primitive* is a triangle, an analytic sphere or an analytic plane; they are numbered in this order, and every
per-primitive array runs over all of them. The float32 vertices made here *are* the scene: hit points, normals and
distances are worked out from them in float64. Meshes of very many instances are not realised: see `instanced`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64, Instance, Int32, Plane, Scene, Sphere
from ..core.cache import PREPARED, SceneCache
from ..core.constants import MAX_SWELLING, MISS, STEADY_SCENE
from .instanced import Faces, Instanced, divided, instanced_of
from .instances import (
    Layouts,
    MeshInstances,
    Shape,
    bounds_of_batch,
    corner_data_of,
    mesh_instances_of,
    shapes_of,
    surface_of_triangles,
    visible,
)
from .subdivide import split_large_triangles
from .triangles import TriangleSoup, join, no_triangles

Bools = NDArray[np.bool_]

Cast = Callable[[Float32, Float32], Any]
"""Origins and directions (3, n) of rays, their nearest `hits.Hits`."""

TOGETHER = 1 << 14
"""Triangles of small meshes that are prepared at once: they stay in a core's cache."""


@dataclass(frozen=True, eq=False)
class Geometry:
    """nt triangles, then ns spheres, then planes: np primitives in all. Coordinates are relative to `center`.

    Where meshes are kept once, tables of objects, surfaces and flags have more rows behind these (see `instanced`).
    """

    center: Float64  # (3,) of the scene's bounds, in world space
    vertices: Float32  # (nv, 3)
    triangles: Int32  # (nt, 3) counter-clockwise seen from outside, mirrored instances too
    facets: Float64  # (np, 4) unit geometric normal and its distance from the origin: n.x = d; 0 for spheres
    weights: Float64  # (nt, 8) barycentrics as planes (soup.facets_of)
    extent: Float32  # (np,) largest |coordinate| of the primitive's vertices: scale of its rounding errors
    normals: Float32 | None  # (nt, 9) shading normals of the three corners; None: nothing is smooth
    smooth: Bools  # (np,) shading normals differ from the geometric one
    corner_data: Float32 | None  # (nt, 3 k) what expressions read of the three corners; None: nothing
    layouts: Layouts  # for each surface: where in the k numbers of a corner its data are
    object: NDArray[np.intp]  # (np,) number in the scene: of its instances, then its spheres, then its planes
    source: Int32  # (nt,) number of the triangle in its mesh; parts of a split one have the same
    surface: NDArray[np.intp]  # (np,) index into the surface table (intp: `take` need not convert it)
    ray_traced: Bools  # (np,) ray traced by the artist
    camera: Bools  # (np,) visibility for camera rays,
    shadow: Bools  # (np,) for shadow rays,
    secondary: Bools  # (np,) and for reflected and refracted rays
    moves: Bools  # (np,) likely to be elsewhere in the next frame
    sphere_center: Float64  # (ns, 3)
    sphere_radius: Float64  # (ns,)
    dropped: int  # triangles left out because they are degenerate or not finite
    split: int  # triangles made by splitting large ones towards small ray traced objects
    object_values: Mapping[str, Float64]  # key -> (objects, width), what surfaces read of instances
    instanced: Instanced | None  # meshes that are kept once; None: all are flattened
    bounds_radius: float  # of a ball around the centre that holds the whole scene; infinite if there are planes
    cast: Cast | None = None  # what rays (3, n) of expressions hit; None: none asks
    enclosed: Bools | None = None  # (objects,) closed bodies that light may come into through their walls; None: none

    @cached_property
    def heights(self) -> Float32:
        """(nt, 3) n.v of the three corners v and their shading normals n."""
        assert self.normals is not None
        products = self.vertices.take(self.triangles, axis=0).reshape(-1, 9)
        products *= self.normals
        return np.asarray(products[:, 0::3] + products[:, 1::3] + products[:, 2::3])

    @property
    def triangle_count(self) -> int:
        """The first primitive that is not a triangle."""
        return len(self.triangles)

    @property
    def flattened_count(self) -> int:
        """np: triangles, spheres and planes."""
        return len(self.facets)

    def rows_of(self, face: NDArray[Any]) -> NDArray[Any]:
        """The rows (n,), in tables of all primitives, of faces (n,); MISS stays."""
        if self.instanced is None:
            return face
        result, shared = face.copy(), np.flatnonzero(face >= self.instanced.first)
        result[shared] = self.instanced.rows(face[shared])
        return result

    def faces_of(self, face: NDArray[Any]) -> tuple[Geometry | Faces, NDArray[Any]]:
        """Tables with `facets`, `weights`, `extent`, `smooth`, `normals` and `heights` of faces (n,), and where in them
        each has its own; MISS stays."""
        if self.instanced is None:
            return self, face
        met = np.flatnonzero(face >= 0)
        place = np.full(len(face), MISS, np.int32)
        place[met] = np.arange(len(met), dtype=np.int32)
        return Faces(self, face[met]), place

    def is_triangle(self, face: NDArray[Any]) -> Bools:
        """(n,) of faces (n,)."""
        on_flattened: Bools = face < self.triangle_count
        return on_flattened if self.instanced is None else on_flattened | (face >= self.instanced.first)

    def corners_of(self, face: NDArray[Any], key: str, start: int, width: int) -> Float32 | None:
        """(3 corners, width, n) of triangles `face` (n,): data by key, which stand from `start` on; None: no triangle
        has any."""
        if self.instanced is not None:
            return Faces(self, face).corner_data(key, start, width)
        if self.corner_data is None:
            return None
        rows = self.corner_data.take(face, axis=0)
        return rows.T.reshape(3, rows.shape[1] // 3, len(face))[:, start : start + width]

    @property
    def sphere_count(self) -> int:
        """Spheres come right after the triangles."""
        return len(self.sphere_radius)


def flatten(
    scene: Scene,
    layouts: Layouts,
    use_normals: bool = True,
    cache: SceneCache | None = None,
    apart: Bools | None = None,
) -> Geometry:
    """Realise all visible instances.

    layouts     : for each surface of the scene what it reads of a mesh's corners.
    use_normals : False leaves the shading normals out (a plan that never shades).
    cache       : what an earlier frame has left, and what this one leaves.
    apart       : (s,) surfaces of bodies that are worked on one by one: their instances are flattened. None: all are.
    """
    cache = SceneCache(0) if cache is None else cache
    batches = list(mesh_instances_of(scene))
    spheres, planes = [s for s in scene.spheres if visible(s)], [p for p in scene.planes if visible(p)]
    boxes = [bounds_of_batch(batch, cache) for batch in batches]
    center, radius = _center_and_radius(scene, batches, boxes, spheres)
    kept: list[MeshInstances] = []
    if apart is not None:
        batches, kept = divided(scene, batches, boxes, apart)
    shapes = _shapes(batches, center, use_normals, cache)
    traced = scene.ray_traced_surfaces
    parts = [_realise(batch, shape, layouts, traced) for batch, shape in zip(batches, shapes, strict=True)]
    mesh = join(parts) if parts else no_triangles()
    balls = np.array([(*np.subtract(b.center, center), b.radius) for b in spheres if scene.is_ray_traced(b)]).reshape(
        -1, 4
    )
    instanced = _instanced(kept, center, len(mesh.triangles) + len(spheres) + len(planes), cache, traced)
    mesh = split_large_triangles(mesh, np.concatenate([balls, _balls(instanced)]))
    if instanced is not None:  # splitting has made more triangles
        instanced = instanced.after(len(mesh.triangles) + len(spheres) + len(planes))
    analytic: list[Sphere | Plane] = [*scene.spheres, *scene.planes]
    numbers = [number for number, thing in enumerate(analytic, len(scene.instances)) if visible(thing)]
    return _assemble(mesh, layouts, center, np.inf if planes else radius, spheres, planes, numbers, instanced, traced)


def _instanced(
    kept: list[MeshInstances], center: Float64, first: int, cache: SceneCache, traced: Bools
) -> Instanced | None:
    """What is kept as instances, whose faces are those from `first` on. traced: (s,) surfaces that are."""
    if not kept:
        return None
    flags = [np.array([_flags(i) for i in batch.instances], bool).T for batch in kept]
    found = instanced_of(kept, [bounds_of_batch(batch, cache) for batch in kept], center, first, flags)
    found.flags[0] |= traced[found.surface] & found.worn
    return found


def _balls(instanced: Instanced | None) -> Float64:
    """(b, 4) centres and radii of the bounds of ray traced instances."""
    if instanced is None:
        return np.zeros((0, 4))
    low, high = instanced.bounds(instanced.flags[0]).astype(np.float64).transpose(1, 0, 2)
    return np.concatenate([(low + high) / 2, np.sqrt(((high - low) ** 2).sum(axis=1))[:, None] / 2], axis=1)


def _center_and_radius(
    scene: Scene, batches: list[MeshInstances], boxes: list[Float64], spheres: Sequence[Sphere]
) -> tuple[Float64, float]:
    """The centre of coordinates, and the radius of a ball around it that holds everything, however it swells."""
    traced = [[scene.is_ray_traced(i) for i in batch.instances] for batch in batches]
    everything = _box(boxes, spheres)
    chosen = [of_batch[which] for of_batch, which in zip(boxes, traced, strict=True)]
    ray_traced = _box(chosen, [ball for ball in spheres if scene.is_ray_traced(ball)])
    if not len(everything):
        return np.array(scene.camera.matrix_world, np.float64)[:3, 3], 0.0
    moves = any(
        i.moves and is_traced
        for b, of in zip(batches, traced, strict=True)
        for i, is_traced in zip(b.instances, of, strict=True)
    )
    center = _center(moves, everything, ray_traced)
    return center, float(np.sqrt(3) * np.max(np.abs(everything - center)) * (1 + MAX_SWELLING))


def _center(moves: bool, everything: Float64, ray_traced: Float64) -> Float64:
    """Center of the ray traced objects' bounds, else of all: there coordinates are small and rounding is least.

    moves: one of them is likely to move.
    """
    low, high = ray_traced if len(ray_traced) else everything
    middle, size = (low + high) / 2, np.max(high - low)
    if not moves or not 0 < size * STEADY_SCENE > np.max(everything[1] - everything[0]):
        return np.asarray(middle)
    step = np.ldexp(1.0, np.frexp(size)[1] - 1)
    return np.asarray(np.round(middle / step) * step)


def _box(bounds: list[Float64], spheres: Sequence[Sphere]) -> Float64:
    """(2, 3) lowest and highest coordinates of bounds (n, 2, 3) and of spheres; (0, 3) if there is nothing."""
    boxes = [np.zeros((0, 2, 3)), *bounds]
    boxes += [np.array([[np.subtract(s.center, s.radius), np.add(s.center, s.radius)]]) for s in spheres]
    low, high = np.concatenate(boxes).transpose(1, 0, 2)
    known = (low <= high).all(axis=1)
    return np.array([low[known].min(axis=0), high[known].max(axis=0)]) if known.any() else np.zeros((0, 3))


def _shapes(batches: list[MeshInstances], center: Float64, use_normals: bool, cache: SceneCache) -> list[Shape]:
    """Those of an earlier frame, and the others worked out: of small meshes some together."""
    keys = [("shape", *batch.key, center.tobytes(), use_normals) for batch in batches]
    made: dict[int, Shape] = {}
    group: list[int] = []
    held = 0
    for number, batch in enumerate(batches):
        if not cache.has(keys[number]):
            group.append(number)
            held += batch.size
        if group and (held >= TOGETHER or number == len(batches) - 1):
            made |= zip(group, shapes_of([batches[i] for i in group], center, use_normals), strict=True)
            group, held = [], 0
    return [cache.take(key, partial(made.__getitem__, i), PREPARED, batches[i].size) for i, key in enumerate(keys)]


def _realise(batch: MeshInstances, shape: Shape, layouts: Layouts, traced: Bools) -> TriangleSoup:
    """Triangles of all instances of one mesh. traced: (s,) surfaces that are ray traced."""
    nt, sound, surface = len(batch.mesh.triangles), shape.sound, surface_of_triangles(batch)
    flags = np.repeat(np.array([_flags(i) for i in batch.instances], bool).T, nt, axis=1)
    flags[0] |= traced[surface]
    data = corner_data_of(batch, surface, layouts)
    return TriangleSoup(
        vertices=shape.vertices,
        triangles=shape.triangles,
        facets=shape.facets,
        weights=shape.weights,
        extent=shape.extent,
        normals=shape.normals,
        smooth=shape.smooth,
        corner_data=None if data is None else data[sound],
        object=np.repeat(np.array(batch.numbers, np.int32), nt)[sound],
        source=np.tile(np.arange(nt, dtype=np.int32), len(batch.instances))[sound],
        surface=surface[sound],
        flags=flags[:, sound],
        dropped=int(len(sound) - np.count_nonzero(sound)),
    )


def _flags(thing: Instance | Sphere | Plane) -> tuple[bool, bool, bool, bool, bool]:
    v = thing.visibility
    return thing.ray_traced, v.camera, v.shadow, v.secondary, isinstance(thing, Instance) and thing.moves


def _assemble(
    mesh: TriangleSoup,
    layouts: Layouts,
    center: Float64,
    radius: float,
    spheres: Sequence[Sphere],
    planes: Sequence[Plane],
    numbers: list[int],
    instanced: Instanced | None,
    traced: Bools,
) -> Geometry:
    """Append the analytic shapes, of these numbers in the scene, to the triangles. traced: (s,) surfaces that are."""
    ns = len(spheres)
    sphere_center = np.array([s.center for s in spheres], np.float64).reshape(-1, 3) - center
    sphere_radius = np.array([s.radius for s in spheres], np.float64)
    point = np.array([p.point for p in planes], np.float64).reshape(-1, 3) - center
    normal = np.array([p.normal for p in planes], np.float64).reshape(-1, 3)
    normal = normal / np.sqrt((normal * normal).sum(1, keepdims=True))
    distance = (normal * point).sum(1)
    analytic: list[Sphere | Plane] = [*spheres, *planes]
    of_shapes = np.array([_flags(a) for a in analytic], np.bool_).reshape(-1, 5).T
    of_shapes[0] |= traced[[a.surface for a in analytic]]
    flags = np.concatenate([mesh.flags, of_shapes], axis=1)
    facets = np.concatenate([mesh.facets, np.zeros((ns, 4)), np.concatenate([normal, distance[:, None]], axis=1)])
    sphere_extent = np.abs(sphere_center).max(1, initial=0) + sphere_radius
    # A plane is as large as what stands on it: one through the very centre must not lose its scale.
    scale = max(np.max(mesh.extent, initial=0.0), np.max(sphere_extent, initial=0.0))
    objects, surfaces = np.array(numbers, np.intp), np.array([a.surface for a in analytic], np.int32)
    if instanced is not None:
        scale = max(scale, np.max(np.abs(instanced.boxes)))
        objects, surfaces = np.append(objects, instanced.object), np.append(surfaces, instanced.surface)
        flags = np.concatenate([flags, instanced.flags], axis=1)
    extent = np.concatenate([sphere_extent, np.maximum(np.abs(distance), scale)])
    return Geometry(
        center=center,
        vertices=mesh.vertices,
        triangles=np.ascontiguousarray(mesh.triangles, np.int32),
        facets=np.ascontiguousarray(facets),
        weights=mesh.weights,
        extent=np.concatenate([mesh.extent, extent.astype(np.float32)]),
        normals=mesh.normals if mesh.smooth.any() else None,
        smooth=np.concatenate([mesh.smooth, np.zeros(len(analytic), bool)]),
        corner_data=mesh.corner_data,
        layouts=layouts,
        object=np.concatenate([mesh.object, objects]).astype(np.intp),
        source=mesh.source,
        surface=np.concatenate([mesh.surface, surfaces]).astype(np.intp),
        ray_traced=flags[0],
        camera=flags[1],
        shadow=flags[2],
        secondary=flags[3],
        moves=flags[4],
        sphere_center=sphere_center,
        sphere_radius=sphere_radius,
        dropped=mesh.dropped,
        split=mesh.split,
        object_values={},
        instanced=instanced,
        bounds_radius=radius,
    )
