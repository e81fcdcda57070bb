# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of many instances, kept once: what a hit needs to know of its triangle is worked out at the hit.

A *face* is what a ray hits. Those of the flattened primitives have their numbers. Behind them every instance has
`stride` numbers, one for each triangle of its mesh: they are only numbers, nothing is as long as there are faces. What
instances wear and how they are seen stands in the tables of all primitives, in a *row* for each surface slot of each
instance. So tables by row are as they are for flattened triangles; tables by face are asked for with `Faces`.

A face's corners in the world are those that flattening would give, to the last bit: transformed in float64, rounded
once. Embree transforms rays in float32 instead. Its error then is a few ulp of the coordinates as before if no matrix
stretches much more in one direction than in another (measured: none of 60 000 rays from surfaces met its own again).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64, Int32, Scene
from ..core.constants import EMBREE_LIMIT, MOST_STRETCH
from ..core.vectors import cross, dot, flatnonzero
from .instances import INSTANCING_FROM, LEAST_INSTANCED, PARAMETRIC, MeshInstances, is_smooth
from .parts import closed_wear
from .triangles import facets_of

if TYPE_CHECKING:
    from .flatten import Geometry

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]


def saved_by_instancing(scene: Scene) -> Counter[int]:
    """Mesh -> triangles that need not be made of its instances; nothing if they are few in all."""
    used = Counter(i.mesh for i in scene.instances)
    saved = Counter({mesh: (times - 1) * len(scene.meshes[mesh].triangles) for mesh, times in used.items()})
    saved = Counter({mesh: n for mesh, n in saved.items() if n >= LEAST_INSTANCED})
    return saved if saved.total() >= INSTANCING_FROM else Counter()


def divided(
    scene: Scene, batches: list[MeshInstances], bounds: list[Float64], apart: Bools
) -> tuple[list[MeshInstances], list[MeshInstances]]:
    """What is to be flattened, and what is kept as instances.

    bounds : (k, 2, 3) of the instances of each batch.   apart : (s,) whose closed bodies are worked on one by one.
    """
    meshes = {id(scene.meshes[mesh]) for mesh in saved_by_instancing(scene)}
    flat, kept = [], []
    for batch, boxes in zip(batches, bounds, strict=True):
        if id(batch.mesh) not in meshes:
            flat.append(batch)
            continue
        able = _even(batch) & (np.abs(boxes) < EMBREE_LIMIT).all(axis=(1, 2))
        able &= ~closed_wear(batch.mesh, [i.surfaces for i in batch.instances], apart)
        kept += [batch.only(flatnonzero(able))] if able.any() else []
        flat += [batch.only(flatnonzero(~able))] if not able.all() else []
    return flat, kept


def _even(batch: MeshInstances) -> Bools:
    """(k,) matrices that stretch alike in all directions, but for MOST_STRETCH.

    Which is measured by the product of the norms of a matrix and of its inverse: 3 for a turn.
    """
    linear, cofactors = batch.matrices[:, :3, :3], batch.cofactors
    volume = np.abs((linear[:, 0] * cofactors[:, 0]).sum(1))
    with np.errstate(over="ignore", invalid="ignore"):
        norms = np.sqrt((linear * linear).sum((1, 2))) * np.sqrt((cofactors * cofactors).sum((1, 2)))
        return np.asarray(norms <= MOST_STRETCH * volume) & (volume > 0)


@dataclass(frozen=True, eq=False)
class Instanced:
    """m meshes, T triangles in all, and k instances of them. C rows: one for each slot of each instance."""

    center: Float64  # (3,) the scene's
    first: int  # the first face, and the first row, that is of an instance
    stride: int  # faces of an instance
    vertices: Float32  # (V, 3) local
    triangles: Int32  # (T, 3) into vertices
    corners: Int32  # (T, 3) into the tables of corners
    slots: Int32  # (T,) surface slots
    start: Numbers  # (m + 1,) where the triangles of each mesh begin
    mesh: Numbers  # (k,)
    matrices: Float64  # (k, 3, 4) object to world
    mirrored: Bools  # (k,)
    boxes: Float32  # (k, 2, 3) bounds around the centre
    row: Numbers  # (k,) of each instance's first slot
    instance: Numbers  # (C,) whose each row is
    object: Numbers  # (C,) number in the scene
    surface: Int32  # (C,)
    flags: Bools  # (5, C) ray_traced, camera, shadow, secondary, moves
    worn: Bools  # (C,) there are triangles of it
    meshes: list[Any]  # the TriangleMesh of each
    tables: dict[str, Float32] = field(default_factory=dict)  # of corners, made when first asked for
    trees: dict[Any, Any] = field(default_factory=dict)  # of meshes, which all sets share

    def after(self, first: int) -> Instanced:
        """The same, whose first face and row is `first`."""
        return replace(self, first=first, row=self.row + (first - self.first))

    def parts(self, face: Numbers) -> tuple[Numbers, Numbers]:
        """The instance (n,) and the triangle (n,) of faces of instances."""
        instance, local = np.divmod(face - self.first, self.stride)
        return instance, self.start[self.mesh[instance]] + local

    def rows(self, face: Numbers) -> Numbers:
        """The rows (n,) of faces of instances."""
        instance, triangle = self.parts(face)
        return np.asarray(self.row[instance] + self.slots[triangle])

    def points(self, instance: Numbers, triangle: Numbers) -> Float32:
        """(n, 3 corners, 3) around the centre, counter-clockwise seen from outside."""
        m, local = self.matrices[instance], self.vertices[self.wound(self.triangles, instance, triangle)]
        x, y, z = local.astype(np.float64).transpose(2, 0, 1)
        result = np.empty(local.shape, np.float32)
        for i in range(3):
            row = m[:, i, 0, None] * x
            row += m[:, i, 1, None] * y
            row += m[:, i, 2, None] * z
            row += m[:, i, 3, None]
            row -= self.center[i]
            result[:, :, i] = row
        return result

    def wound(self, indices: Int32, instance: Numbers, triangle: Numbers) -> Int32:
        """(n, 3) rows of indices of corners; a mirrored instance turns its triangles over, which is undone."""
        result = indices[triangle]
        turned = self.mirrored[instance]
        result[turned] = result[turned][:, [0, 2, 1]]
        return result

    def turned(self, vectors: Float64, instance: Numbers) -> Float32:
        """Unit vectors (n, 3, 3) in the world of normals (n, 3 corners, 3), through the cofactors; NaN of none."""
        m = self.matrices[instance][:, :, :3].transpose(1, 2, 0)
        sign = np.where(self.mirrored[instance], -1.0, 1.0)
        x, y, z = vectors.transpose(2, 0, 1)
        rows = [(cross(m[(i + 1) % 3], m[(i + 2) % 3]) * sign)[:, :, None] for i in range(3)]
        world = np.stack([c[0] * x + c[1] * y + c[2] * z for c in rows])
        with np.errstate(all="ignore"):
            world /= np.sqrt(dot(world, world))
        return np.asarray(world.transpose(1, 2, 0), np.float32)

    def table(self, key: str) -> Float32:
        """(all corners, width) of the meshes' own data by key, 0 where a mesh has none; "normals": NaN there."""
        if key not in self.tables:
            found = [_data(mesh, key) for mesh in self.meshes]
            width = max((data.shape[1] for data in found if data is not None), default=0)
            nothing = np.nan if key == "normals" else 0.0
            parts = [np.full((_corner_count(m), width), nothing, np.float32) for m in self.meshes]
            for part, data in zip(parts, found, strict=True):
                if data is not None:
                    part[: len(data), : data.shape[1]] = data[: len(part)]
            self.tables[key] = np.concatenate(parts)
        return self.tables[key]

    def corner_data(self, key: str, width: int, instance: Numbers, triangle: Numbers) -> Float32:
        """(n, 3 corners, width) of data by key (see `instances.corner_data_of`)."""
        result = np.zeros((len(instance), 3, width), np.float32)
        if key == "parametric":
            of_corners = np.array(PARAMETRIC, np.float32)
            found = np.where(self.mirrored[instance][:, None, None], of_corners[[0, 2, 1]], of_corners)
        else:
            found = self.table(key)[self.wound(self.corners, instance, triangle)]
            if key.startswith(("tangent:", "around:")) and found.shape[2]:
                sign = np.where(self.mirrored[instance], np.float32(-1), np.float32(1))
                world = self.turned(found[:, :, :3].astype(np.float64), instance)
                found = np.concatenate([world, found[:, :, 3:4] * sign[:, None, None]], axis=2)
        result[:, :, : found.shape[2]] = found[:, :, :width]
        result[~np.isfinite(result)] = 0
        return result

    def extent_within(self, low: Float64, high: Float64) -> float:
        """The largest |coordinate| of instances whose bounds meet a box; 0: none do."""
        meets = ((self.boxes[:, 0] <= high) & (self.boxes[:, 1] >= low)).all(axis=1)
        return float(np.max(np.abs(self.boxes[meets]), initial=0.0))

    def bounds(self, rows: Bools) -> Float32:
        """(n, 2, 3) bounds of the instances that have any of the rows (C,)."""
        chosen = np.zeros(len(self.row), bool)
        chosen[self.instance[rows]] = True
        return self.boxes[chosen]


def _data(mesh: Any, key: str) -> Float32 | None:
    if key == "normals":
        return mesh.normals  # type: ignore[no-any-return]
    if key.startswith("uv:"):
        return mesh.uv_maps.get(key.removeprefix("uv:"), mesh.uv_maps.get(""))  # type: ignore[no-any-return]
    return mesh.attributes.get(key)  # type: ignore[no-any-return]


def _corner_count(mesh: Any) -> int:
    return int(np.max(mesh.corners, initial=-1)) + 1


def instanced_of(
    batches: Sequence[MeshInstances], bounds: Sequence[Float64], center: Float64, first: int, flags: Sequence[Bools]
) -> Instanced:
    """bounds, flags: (k, 2, 3) and (5, k) of the instances of each batch."""
    meshes = [batch.mesh for batch in batches]
    whole = [_sound(batch.mesh) for batch in batches]
    slots = [_slots(batch, w) for batch, w in zip(batches, whole, strict=True)]
    widths = [int(np.max(s, initial=0)) + 1 for s in slots]
    count = [len(batch.instances) for batch in batches]
    worn = [np.tile(np.bincount(s, minlength=w) > 0, k) for s, w, k in zip(slots, widths, count, strict=True)]
    width = np.repeat(widths, count)
    surface = [_assigned(batch, w) for batch, w in zip(batches, widths, strict=True)]
    sizes = [len(w) for w in whole]
    v_start = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    c_start = np.cumsum([0, *(_corner_count(m) for m in meshes)])
    numbers = np.concatenate([np.array(batch.numbers, np.intp) for batch in batches])
    matrices = np.concatenate([batch.matrices[:, :3] for batch in batches])
    boxes = np.concatenate(list(bounds)) - center
    return Instanced(
        center=center,
        first=first,
        stride=max(sizes),
        vertices=np.concatenate([m.vertices for m in meshes]),
        triangles=np.concatenate(
            [m.triangles[w] + np.int32(s) for m, w, s in zip(meshes, whole, v_start, strict=False)]
        ),
        corners=np.concatenate([m.corners[w] + np.int32(s) for m, w, s in zip(meshes, whole, c_start, strict=False)]),
        slots=np.concatenate(slots),
        start=np.cumsum([0, *sizes]),
        mesh=np.repeat(np.arange(len(meshes)), count),
        matrices=matrices,
        mirrored=np.concatenate([batch.handedness < 0 for batch in batches]),
        boxes=boxes.astype(np.float32),
        row=first + np.cumsum(width) - width,
        instance=np.repeat(np.arange(len(width)), width),
        object=np.repeat(numbers, width),
        surface=np.concatenate(surface).astype(np.int32),
        flags=np.repeat(np.concatenate(list(flags), axis=1), width, axis=1),
        worn=np.concatenate(worn),
        meshes=meshes,
    )


def _sound(mesh: Any) -> Numbers:
    """The triangles that are finite and not degenerate."""
    return flatnonzero(facets_of(mesh.vertices[mesh.triangles])[3])


def _slots(batch: MeshInstances, whole: Numbers) -> Int32:
    """The surface slots of the triangles `whole`."""
    slots, most = batch.mesh.surface_slots, max(len(i.surfaces) for i in batch.instances)
    return np.zeros(len(whole), np.int32) if slots is None else np.minimum(slots[whole], most - 1).astype(np.int32)


def _assigned(batch: MeshInstances, width: int) -> NDArray[np.integer]:
    """(k width,) surfaces of the first slots of each instance; a slot too many wears the last one."""
    return np.array([(i.surfaces + (i.surfaces[-1],) * width)[:width] for i in batch.instances], np.int32).reshape(-1)


class Faces:
    """What a hit needs to know of each of n faces, none of them a miss, by the names that `Geometry` has for it."""

    def __init__(self, geometry: Geometry, face: Numbers) -> None:
        assert geometry.instanced is not None
        self._geometry, self._instanced, self._n = geometry, geometry.instanced, len(face)
        shared = face >= self._instanced.first
        self._real, self._shared = flatnonzero(~shared), flatnonzero(shared)
        self._face = face[self._real]
        self._instance, self._triangle = self._instanced.parts(face[self._shared])

    def faces_of(self, place: Numbers) -> tuple[Faces, Numbers]:
        """As `Geometry.faces_of`, of the n."""
        return self, place

    def _rows(self, of_flattened: NDArray[Any] | None, of_instances: NDArray[Any]) -> Any:
        """(n, ...) of both; what is not there of flattened ones is 0."""
        result = np.zeros((self._n, *of_instances.shape[1:]), of_instances.dtype)
        if of_flattened is not None and len(of_flattened):
            result[self._real] = of_flattened.take(self._face, axis=0, mode="clip")
        result[self._shared] = of_instances
        return result

    @cached_property
    def _points(self) -> Float32:
        return self._instanced.points(self._instance, self._triangle)

    @cached_property
    def _measured(self) -> tuple[Float64, Float64, Float32]:
        facets, weights, extent, sound = facets_of(self._points)
        lost = flatnonzero(~sound)  # so small, so far away, that its corners are rounded onto one another
        if len(lost):
            facets[lost, :3] = self._flat_normals(lost)
            facets[lost, 3] = (facets[lost, :3] * self._points[lost, 0]).sum(axis=1)
            weights[lost] = 0
        return facets, weights, extent

    def _flat_normals(self, which: Numbers) -> Float32:
        """(n, 3) geometric normals through the matrices."""
        instance = self._instance[which]
        indices = self._instanced.triangles[self._triangle[which]]
        a, b, c = self._instanced.vertices[indices].astype(np.float64).transpose(1, 2, 0)
        normal = cross(b - a, c - a).T[:, None]
        return self._instanced.turned(normal, instance)[:, 0]

    @cached_property
    def facets(self) -> Float64:  # noqa: D102 (see `Geometry`)
        return np.asarray(self._rows(self._geometry.facets, self._measured[0]))

    @cached_property
    def weights(self) -> Float64:  # noqa: D102
        return np.asarray(self._rows(self._geometry.weights, self._measured[1]))

    @cached_property
    def extent(self) -> Float32:  # noqa: D102
        return np.asarray(self._rows(self._geometry.extent, self._measured[2]))

    @cached_property
    def _normals(self) -> Float32:
        """(n, 9) of those of instances; NaN of meshes that have none."""
        table, place = self._instanced.table("normals"), (self._instance, self._triangle)
        if table.shape[1] == 0:
            return np.full((len(self._shared), 9), np.nan, np.float32)
        local = table[self._instanced.wound(self._instanced.corners, *place)].astype(np.float64)
        return self._instanced.turned(local, self._instance).reshape(-1, 9)

    @cached_property
    def normals(self) -> Float32:  # noqa: D102
        return np.asarray(self._rows(self._geometry.normals, self._normals))

    @cached_property
    def smooth(self) -> Bools:  # noqa: D102
        return np.asarray(self._rows(self._geometry.smooth, is_smooth(self._normals, self._measured[0])))

    @cached_property
    def heights(self) -> Float32:  # noqa: D102
        flattened = None if self._geometry.normals is None else self._geometry.heights
        products = self._points.reshape(-1, 9) * self._normals
        return np.asarray(self._rows(flattened, products[:, 0::3] + products[:, 1::3] + products[:, 2::3]))

    def corner_data(self, key: str, start: int, width: int) -> Float32:
        """(3 corners, width, n) of data by key, which flattened triangles have from `start` on."""
        found = self._rows(None, self._instanced.corner_data(key, width, self._instance, self._triangle))
        data = self._geometry.corner_data
        if data is not None and len(self._real):  # it may be narrower: of surfaces that read less
            rows = data.take(self._face, axis=0).reshape(len(self._real), 3, -1)[:, :, start : start + width]
            found[self._real, :, : rows.shape[2]] = rows
        return np.asarray(found.transpose(1, 2, 0))
