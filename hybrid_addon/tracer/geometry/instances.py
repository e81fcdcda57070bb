# SPDX-License-Identifier: GPL-3.0-or-later
"""The instances of one mesh, worked on at once: their triangles in the world, and what these carry."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64, Instance, Int32, Plane, Scene, Sphere, TriangleMesh
from ..core.cache import SceneCache
from ..core.constants import EMBREE_LIMIT, FLAT
from ..core.vectors import cross, dot, select
from .triangles import facets_of

Bools = NDArray[np.bool_]
PARAMETRIC = ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0))
"""Barycentrics of the three corners, as Geometry's Parametric has them."""

INSTANCING_FROM = 1 << 18
"""Meshes are kept once, and their instances as matrices, where that spares so many triangles: 150 MB. Fewer are
flattened: they are traced faster so."""

LEAST_INSTANCED = 1 << 10
"""A mesh whose instances would be fewer triangles than this is flattened all the same: each costs a query a box."""

AT_ONCE = 1 << 20
"""Vertices of instances that are in memory at once while their bounds are found: 25 MB."""

Layouts = Sequence[Mapping[str, tuple[int, int]]]
"""For each surface, key of what it reads of a corner -> (start, width)."""


@dataclass(eq=False)
class MeshInstances:
    """All instances of one mesh, k of them, in world space and float64."""

    mesh: TriangleMesh
    instances: list[Instance]
    numbers: list[int]  # of the instances in the scene
    matrices: Float64  # (k, 4, 4)

    @property
    def size(self) -> int:
        """Triangles of all."""
        return len(self.instances) * len(self.mesh.triangles)

    def only(self, index: NDArray[np.intp]) -> MeshInstances:
        """The instances `index`, ascending; itself if these are all."""
        if len(index) == len(self.instances):
            return self
        chosen = index.tolist()
        instances, numbers = [self.instances[i] for i in chosen], [self.numbers[i] for i in chosen]
        return MeshInstances(self.mesh, instances, numbers, self.matrices[index])

    @cached_property
    def vertices(self) -> Float64:
        """(3, k, nv)."""
        return _transform(self.mesh.vertices.astype(np.float64), self.matrices)

    @cached_property
    def handedness(self) -> Float64:
        """(k,) sign of the determinant: -1 for mirrored instances, 0 for singular ones."""
        return np.asarray(np.sign((self.matrices[:, 0, :3] * self.cofactors[:, 0]).sum(1)))

    @cached_property
    def cofactors(self) -> Float64:
        """(k, 3, 3) of the linear parts: cofactor(M) = det(M) M^-T exists for singular matrices, too."""
        rows = self.matrices[:, :3, :3].transpose(1, 2, 0)
        return np.stack([cross(rows[(i + 1) % 3], rows[(i + 2) % 3]).T for i in range(3)], axis=1)

    @cached_property
    def key(self) -> tuple[TriangleMesh, bytes]:
        """What all that can be kept of it depends on."""
        return self.mesh, self.matrices.tobytes()


@dataclass(eq=False)
class Shape:
    """What of a batch depends on nothing but its mesh, its places and the centre; corners as in the mesh, n = k nt."""

    vertices: Float32  # (k nv, 3)
    triangles: Int32  # those that are sound,
    facets: Float64
    weights: Float64
    extent: Float32
    normals: Float32 | None
    smooth: Bools
    sound: Bools  # (n,) of all


def visible(thing: Instance | Sphere | Plane) -> bool:
    """Whether any ray can see it."""
    v = thing.visibility
    return v.camera or v.shadow or v.secondary


def mesh_instances_of(scene: Scene) -> Iterator[MeshInstances]:
    """Group the visible instances by mesh: numpy then works on all instances of a mesh at once. Those that are likely
    to move are a batch of their own, so that the others can be kept."""
    members: dict[tuple[int, bool], list[int]] = {}
    for number, instance in enumerate(scene.instances):
        if visible(instance) and len(scene.meshes[instance.mesh].triangles):
            members.setdefault((instance.mesh, instance.moves), []).append(number)
    for (mesh, _), numbers in members.items():
        instances = [scene.instances[n] for n in numbers]
        matrices = np.array([i.matrix_world for i in instances], np.float64)
        yield MeshInstances(scene.meshes[mesh], instances, numbers, matrices)


def _transform(points: Float64, matrices: Float64) -> Float64:
    """(n, 3) points through (k, 3 or 4, 3 or 4) matrices, which move them if there is a fourth column: (3, k, n)."""
    m = matrices[:, :, :, None]
    x, y, z = points.T
    result = np.empty((3, len(matrices), len(points)))
    with np.errstate(invalid="ignore", over="ignore"):  # vertices that are not finite are dropped later
        for i, row in enumerate(result):
            np.multiply(m[:, i, 0], x, out=row)
            row += m[:, i, 1] * y
            row += m[:, i, 2] * z
            if m.shape[2] > 3:
                row += m[:, i, 3]
    return result


def bounds_of_batch(batch: MeshInstances, cache: SceneCache) -> Float64:
    """`bounds_of_instances`, those of an earlier frame if it had the same."""
    return cache.take(("bounds", *batch.key), partial(bounds_of_instances, batch))


def bounds_of_instances(batch: MeshInstances) -> Float64:
    """(k, 2, 3) lowest and highest coordinates of each instance's traceable vertices; low > high: none."""
    k, nv = len(batch.instances), len(batch.mesh.vertices)
    if k > 1 and k * nv > AT_ONCE:
        step = max(1, AT_ONCE // nv)
        index = np.arange(k)
        return np.concatenate([bounds_of_instances(batch.only(index[i : i + step])) for i in range(0, k, step)])
    rows = batch.vertices
    usable = (np.abs(rows) < EMBREE_LIMIT).all(axis=0)  # not NaN
    low, high = np.where(usable, rows, np.inf).min(axis=2), np.where(usable, rows, -np.inf).max(axis=2)
    return np.stack([low.T, high.T], axis=1)


def shapes_of(batches: Sequence[MeshInstances], center: Float64, use_normals: bool) -> list[Shape]:
    """Their triangles around the centre, those left out that are degenerate.

    Few calls for many small meshes: what is done to each triangle alone is done to those of all batches at once.
    """
    vertices = [_around(batch, center) for batch in batches]
    triangles = [_numbered(batch) for batch in batches]
    normals = [_corner_normals(batch) if use_normals else None for batch in batches]
    points = [of_batch.take(t, axis=0) for of_batch, t in zip(vertices, triangles, strict=True)]
    facets, weights, extent, sound = facets_of(np.concatenate(points))
    ends = np.cumsum([len(t) for t in triangles]).tolist()
    parts = [slice(end - len(t), end) for end, t in zip(ends, triangles, strict=True)]
    smooth = np.zeros(len(sound), bool)
    curved = [(part, n) for part, n in zip(parts, normals, strict=True) if n is not None]
    if curved:
        there = np.concatenate([np.arange(part.start, part.stop) for part, _ in curved])
        smooth[there] = is_smooth(np.concatenate([n for _, n in curved]), facets.take(there, axis=0))
    found = []
    for part, v, t, n in zip(parts, vertices, triangles, normals, strict=True):
        kept = select(sound[part])
        found.append(
            Shape(
                v,
                t[kept],
                facets[part][kept],
                weights[part][kept],
                extent[part][kept],
                None if n is None else n[kept],
                smooth[part][kept],
                sound[part],
            )
        )
    return found


def _around(batch: MeshInstances, center: Float64) -> Float32:
    """(k nv, 3) vertices around the centre."""
    with np.errstate(invalid="ignore", over="ignore"):
        rows = (batch.vertices - center[:, None, None]).astype(np.float32)
    return np.ascontiguousarray(rows.reshape(3, -1).T)


def _numbered(batch: MeshInstances) -> Int32:
    """(k nt, 3) triangles, whose vertices are those of `_around`."""
    k = len(batch.instances)
    first = (np.arange(k, dtype=np.int32) * np.int32(len(batch.mesh.vertices)))[:, None, None]
    return (_wound(batch.mesh.triangles, batch) + first).reshape(-1, 3)


def _wound(indices: Int32, batch: MeshInstances) -> Int32:
    """(k, nt, 3): a mirrored instance turns its triangles over; swapping two corners turns them back."""
    mirrored = batch.handedness < 0
    if not mirrored.any():
        return np.broadcast_to(indices, (len(mirrored), *indices.shape))
    return np.where(mirrored[:, None, None], indices[None, :, [0, 2, 1]], indices[None])


def surface_of_triangles(batch: MeshInstances) -> Int32:
    """(k nt,) surface of each triangle, through the slots of each instance; a slot too many wears the last one."""
    slots = batch.mesh.surface_slots
    if slots is None:
        slots = np.zeros(len(batch.mesh.triangles), np.int32)
    width = max(len(i.surfaces) for i in batch.instances)
    assigned = np.array([i.surfaces + (i.surfaces[-1],) * (width - len(i.surfaces)) for i in batch.instances], np.int32)
    return assigned[:, np.minimum(slots, width - 1)].reshape(-1)


def _corner_normals(batch: MeshInstances) -> Float32 | None:
    """(k nt, 9) unit world normals of the three corners, through the cofactors: their sign makes up for mirroring."""
    local, k = batch.mesh.normals, len(batch.instances)
    if local is None:
        return None
    turned = batch.cofactors * np.where(batch.handedness < 0, -1.0, 1.0)[:, None, None]
    with np.errstate(all="ignore"):
        world = _transform(local.astype(np.float64), turned)
        world /= np.sqrt(dot(world, world))
    rows = np.ascontiguousarray(world.reshape(3, -1).T.astype(np.float32))
    corners = _wound(batch.mesh.corners, batch) + (np.arange(k) * len(local))[:, None, None]
    return rows.take(corners.reshape(-1), axis=0).reshape(-1, 9)


def is_smooth(normals: Float32, facets: Float64) -> Bools:
    """Triangles whose shading normal can differ from the geometric one, and whose normals are usable at all."""
    rows = np.ascontiguousarray(normals.T)
    flat = (rows.reshape(3, 3, -1) == facets[:, :3].T.astype(np.float32)).all(axis=(0, 1))
    result: Bools = np.isfinite(rows).all(axis=0) & ~flat
    return result


def corner_data_of(batch: MeshInstances, surface: Int32, layouts: Layouts) -> Float32 | None:
    """(k nt, 3 w) what expressions read of the corners; each triangle carries what its own surface reads."""
    assigned = np.unique(surface).tolist()
    width = max((start + size for s in assigned for start, size in layouts[s].values()), default=0)
    own = any("parametric" in layouts[s] for s in assigned)
    if width == 0 or not (own or batch.mesh.normals is not None or batch.mesh.uv_maps or batch.mesh.attributes):
        return None
    corners = _wound(batch.mesh.corners, batch)
    result = np.zeros((len(surface), 3, width), np.float32)
    for s in assigned:
        reads = surface == s
        for key, (start, size) in layouts[s].items():
            source = _source(batch, key, corners)
            if source is not None:
                result[reads, :, start : start + size] = source.reshape(len(surface), 3, -1)[reads, :, :size]
    result[~np.isfinite(result)] = 0
    return result.reshape(len(surface), -1)


def _source(batch: MeshInstances, key: str, corners: Int32) -> Float32 | None:
    """(k, nt, 3 corners, width) of the mesh's own data; tangents are unit vectors in world space."""
    mesh = batch.mesh
    if key == "parametric":
        of_corners = np.broadcast_to(np.array(PARAMETRIC, np.float32), (len(mesh.triangles), 3, 2))
        return np.stack([of_corners[:, [0, 2, 1]] if sign < 0 else of_corners for sign in batch.handedness])
    if key.startswith("uv:"):
        local = mesh.uv_maps.get(key.removeprefix("uv:"), mesh.uv_maps.get(""))
    else:
        local = mesh.attributes.get(key)
    if local is None:
        return None
    if not key.startswith(("tangent:", "around:")):
        return local[corners]
    return _world_tangents(batch, local)[np.arange(len(corners))[:, None, None], corners]


def _world_tangents(batch: MeshInstances, local: Float32) -> Float32:
    """(k, nc, 4) of tangents (nc, 4) in local space: unit vectors, 0 where there are none; the sign of the bitangent.

    EEVEE turns them as normals (attr_load_tangent), so they go through the cofactors. Those of a flattened instance
    know nothing but its normal: there the matrix itself turns them.
    """
    side, linear = np.where(batch.handedness < 0, -1.0, 1.0), batch.matrices[:, :3, :3]
    volume = (linear[:, 0] * batch.cofactors[:, 0]).sum(1)
    flat = np.abs(volume) <= FLAT * np.sqrt((linear * linear).sum(1)).prod(1)
    turned = np.where(flat[:, None, None], linear, batch.cofactors * side[:, None, None])
    with np.errstate(all="ignore"):
        world = _transform(local[:, :3].astype(np.float64), turned)
        world /= np.sqrt(dot(world, world))
    result = np.empty((len(side), len(local), 4), np.float32)
    result[..., :3] = np.where(np.isfinite(world), world, 0).transpose(1, 2, 0)
    result[..., 3] = local[:, 3] * side[:, None]
    return result
