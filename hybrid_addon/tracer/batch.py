"""The instances of one mesh, worked on at once: their triangles in the world, and what these carry."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32, Float64, Instance, Int32, Plane, Scene, Sphere, TriangleMesh
from .constants import EMBREE_LIMIT
from .soup import facets_of
from .vectors import cross

Bools = NDArray[np.bool_]
Layouts = Sequence[Mapping[str, tuple[int, int]]]
"""For each surface, key of what it reads of a corner -> (start, width)."""


@dataclass(eq=False)
class Batch:
    """All instances of one mesh, k of them, in world space and float64."""

    mesh: TriangleMesh
    instances: list[Instance]
    numbers: list[int]  # of the instances in the scene
    matrices: Float64  # (k, 4, 4)

    @cached_property
    def vertices(self) -> Float64:
        """(k, nv, 3)."""
        return _transform(self.mesh.vertices.astype(np.float64), self.matrices)

    @cached_property
    def handedness(self) -> Float64:
        """(k,) sign of the determinant: -1 for mirrored instances, 0 for singular ones."""
        a, b, c = self.matrices[:, 0, :3], self.matrices[:, 1, :3], self.matrices[:, 2, :3]
        return np.asarray(np.sign((a * cross(b.T, c.T).T).sum(1)))

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


def batches_of(scene: Scene) -> Iterator[Batch]:
    """Group the visible instances by mesh: numpy then works on all instances of a mesh at once. Those that are likely
    to move are a batch of their own, so that the others can be kept."""
    members: dict[tuple[int, bool], list[int]] = {}
    for number, instance in enumerate(scene.instances):
        if visible(instance) and len(scene.meshes[instance.mesh].triangles):
            members.setdefault((instance.mesh, instance.moves), []).append(number)
    for (mesh, _), numbers in members.items():
        instances = [scene.instances[n] for n in numbers]
        matrices = np.array([i.matrix_world for i in instances], np.float64)
        yield Batch(scene.meshes[mesh], instances, numbers, matrices)


def _transform(points: Float64, matrices: Float64) -> Float64:
    """(n, 3) points through (k, 4, 4) matrices: (k, n, 3)."""
    m = matrices[:, :, :, None]
    x, y, z = points.T
    with np.errstate(invalid="ignore", over="ignore"):  # vertices that are not finite are dropped later
        return np.stack([m[:, i, 0] * x + m[:, i, 1] * y + m[:, i, 2] * z + m[:, i, 3] for i in range(3)], axis=-1)


def bounds_of_instances(batch: Batch) -> Float64:
    """(k, 2, 3) lowest and highest coordinates of each instance's traceable vertices; low > high: none."""
    points = batch.vertices
    size = np.abs(points)
    usable = (size[..., 0] < EMBREE_LIMIT) & (size[..., 1] < EMBREE_LIMIT) & (size[..., 2] < EMBREE_LIMIT)  # not NaN
    low = np.stack([np.where(usable, points[..., i], np.inf).min(axis=1) for i in range(3)], axis=1)
    high = np.stack([np.where(usable, points[..., i], -np.inf).max(axis=1) for i in range(3)], axis=1)
    return np.stack([low, high], axis=1)


def shape_of(batch: Batch, center: Float64, use_normals: bool) -> Shape:
    """Its triangles around the centre, those left out that are degenerate."""
    mesh, k = batch.mesh, len(batch.instances)
    first = (np.arange(k, dtype=np.int32) * np.int32(len(mesh.vertices)))[:, None, None]
    with np.errstate(invalid="ignore", over="ignore"):
        vertices = (batch.vertices - center).astype(np.float32).reshape(-1, 3)
    triangles = (_wound(mesh.triangles, batch) + first).reshape(-1, 3)
    facets, weights, extent, sound = facets_of(vertices[triangles])
    normals, smooth = None, np.zeros(len(triangles), bool)
    if use_normals and mesh.normals is not None:
        corners = _wound(mesh.corners, batch)
        normals = _corner_normals(mesh.normals, batch.matrices, batch.handedness, corners).reshape(-1, 9)
        smooth = _is_smooth(normals, facets)
        normals = normals[sound]
    each = triangles[sound], facets[sound], weights[sound], extent[sound], normals, smooth[sound]
    return Shape(vertices, *each, sound)


def _wound(indices: Int32, batch: Batch) -> Int32:
    """(k, nt, 3): a mirrored instance turns its triangles over; swapping two corners turns them back."""
    mirrored = batch.handedness < 0
    if not mirrored.any():
        return np.broadcast_to(indices, (len(mirrored), *indices.shape))
    return np.where(mirrored[:, None, None], indices[None, :, [0, 2, 1]], indices[None])


def surface_of_triangles(batch: Batch) -> Int32:
    """(k nt,) surface of each triangle, through the slots of each instance; a slot too many wears the last one."""
    slots = batch.mesh.surface_slots
    if slots is None:
        slots = np.zeros(len(batch.mesh.triangles), np.int32)
    width = int(np.max(slots)) + 1
    worn = np.array([(i.surfaces + (i.surfaces[-1],) * width)[:width] for i in batch.instances], np.int32)
    return worn[:, slots].reshape(-1)


def _corner_normals(local: Float32, matrices: Float64, sign: Float64, corners: Int32) -> Float32:
    """(k, nt, 3 corners, 3) unit world normals through the cofactor matrix, which exists for singular matrices too.

    cofactor(M) = det(M) M^-T, so its sign makes up for mirroring.
    """
    m = matrices[:, :3, :3]
    cofactor = np.stack([cross(m[:, (i + 1) % 3].T, m[:, (i + 2) % 3].T).T for i in range(3)], axis=1)
    cofactor *= np.where(sign < 0, -1.0, 1.0)[:, None, None]
    padded = np.zeros((len(m), 4, 4))
    padded[:, :3, :3] = cofactor
    with np.errstate(all="ignore"):
        world = _transform(local.astype(np.float64), padded)
        world /= np.sqrt((world * world).sum(-1, keepdims=True))
    instance = np.arange(len(m))[:, None, None]
    return world.astype(np.float32)[instance, corners]


def _is_smooth(normals: Float32, facets: Float64) -> Bools:
    """Triangles whose shading normal can differ from the geometric one, and whose normals are usable at all."""
    rows = np.ascontiguousarray(normals.T)
    flat = (rows.reshape(3, 3, -1) == facets[:, :3].T.astype(np.float32)).all(axis=(0, 1))
    return np.isfinite(rows).all(axis=0) & ~flat


def corner_data_of(batch: Batch, surface: Int32, layouts: Layouts) -> Float32 | None:
    """(k nt, 3 w) what expressions read of the corners; each triangle carries what its own surface reads."""
    worn = np.unique(surface).tolist()
    width = max((start + size for s in worn for start, size in layouts[s].values()), default=0)
    if width == 0 or not (batch.mesh.normals is not None or batch.mesh.uv_maps or batch.mesh.attributes):
        return None
    corners = _wound(batch.mesh.corners, batch)
    result = np.zeros((len(surface), 3, width), np.float32)
    for s in worn:
        reads = surface == s
        for key, (start, size) in layouts[s].items():
            source = _source(batch, key, corners)
            if source is not None:
                result[reads, :, start : start + size] = source.reshape(len(surface), 3, -1)[reads, :, :size]
    result[~np.isfinite(result)] = 0
    return result.reshape(len(surface), -1)


def _source(batch: Batch, key: str, corners: Int32) -> Float32 | None:
    """(k, nt, 3 corners, width) of the mesh's own data; tangents are turned to world space."""
    mesh = batch.mesh
    if key.startswith("uv:"):
        local = mesh.uv_maps.get(key.removeprefix("uv:"), mesh.uv_maps.get(""))
    else:
        local = mesh.attributes.get(key)
    if local is None:
        return None
    if not key.startswith("tangent:"):
        return local[corners]
    linear = batch.matrices.copy()
    linear[:, :3, 3] = 0
    world = np.concatenate(
        [_transform(local[:, :3].astype(np.float64), linear), np.empty((len(linear), len(local), 1))], 2
    )
    world[..., 3] = local[:, 3] * np.where(batch.handedness < 0, -1, 1)[:, None]
    return world.astype(np.float32)[np.arange(len(linear))[:, None, None], corners]
