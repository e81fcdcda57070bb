# SPDX-License-Identifier: GPL-3.0-or-later
"""The search trees of a set of triangles: one, or two of which one is kept from frame to frame."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Int32
from ..core.cache import IN_TREES, Digest, SceneCache
from ..core.constants import BUILD_SECONDS, MISS, QUERY_SECONDS, RAYS_PER_SAMPLE
from ..core.vectors import flatnonzero
from .embree import InstanceScene, Triangles, TriangleScene
from .flatten import Geometry
from .instanced import Instanced
from .shapes import plane_distance

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]


class TwoTrees:
    """What stands still in one tree, what moves, or instances, in another: the nearer of two hits, at equal distance
    the lower number.

    The distances compared are those in float64 from the planes of the triangles.
    """

    def __init__(self, geometry: Geometry, still: Tree, moving: Tree) -> None:
        self._geometry, self._still, self._moving = geometry, still, moving

    @property
    def parts(self) -> tuple[Tree, Tree]:
        """What stands still, what moves."""
        return self._still, self._moving

    def intersect(self, origin: Float32, direction: Float32) -> Any:
        """As `TriangleScene.intersect`."""
        found, other = self._still.intersect(origin, direction), self._moving.intersect(origin, direction)
        met = flatnonzero(other >= 0)
        found = found.astype(other.dtype, copy=False)  # faces of instances have longer numbers
        rival, mine = other[met], found[met]
        both = flatnonzero(mine >= 0)
        nearer = np.ones(len(met), bool)
        rays = met[both]
        o, d = origin.take(rays, axis=1), direction.take(rays, axis=1)
        t, t_rival = (self._distance(prim, o, d) for prim in (mine[both], rival[both]))
        nearer[both] = (t_rival < t) | ((t_rival == t) & (rival[both] < mine[both]))
        found[met[nearer]] = rival[nearer]
        return found

    def _distance(self, face: Int32, origin: Float32, direction: Float32) -> NDArray[np.float64]:
        table, place = self._geometry.faces_of(face)
        facets = np.ascontiguousarray(table.facets.take(place, axis=0).T)
        return plane_distance(facets, origin, direction)[0]

    def occluded(self, origin: Float32, direction: Float32, t_max: Float32) -> Bools:
        """As `TriangleScene.occluded`."""
        blocked = self._moving.occluded(origin, direction, t_max)
        free = flatnonzero(~blocked)
        blocked[free] = self._still.occluded(origin.take(free, axis=1), direction.take(free, axis=1), t_max[free])
        return blocked


class Tree(Protocol):
    """Triangles that rays are sent to; what is found are faces."""

    def intersect(self, origin: Float32, direction: Float32) -> Any:
        """As `TriangleScene.intersect`."""

    def occluded(self, origin: Float32, direction: Float32, t_max: Float32) -> Bools:
        """As `TriangleScene.occluded`."""


class InstanceTree:
    """Instances of the meshes that are kept once, of the rows `members` (C,) bool, some of which triangles wear: a tree
    of each mesh, or of the part of it that some instances have, and one tree over all instances."""

    def __init__(self, instanced: Instanced, members: Bools, cache: SceneCache) -> None:
        self._instanced = instanced
        groups = []
        numbers: list[Numbers] = []
        triangles: list[Numbers] = []
        matrices = instanced.matrices.copy()
        matrices[:, :, 3] -= instanced.center
        ends = np.searchsorted(instanced.mesh, np.arange(len(instanced.start))).tolist()  # it ascends
        for (start, end), own in zip(pairwise(instanced.start.tolist()), pairwise(ends), strict=True):
            of_mesh = np.arange(*own)
            slots = instanced.slots[start:end]
            rows = instanced.row[of_mesh, None] - instanced.first + np.arange(int(np.max(slots, initial=0)) + 1)
            patterns, which = np.unique(members[rows], axis=0, return_inverse=True)
            for number, pattern in enumerate(patterns):
                local = flatnonzero(pattern[slots])
                if len(local):
                    chosen = of_mesh[which.reshape(-1) == number]
                    arrays = _compact(instanced.vertices, instanced.triangles[start:end][local])
                    key = ("mesh", Digest(*arrays))  # not what `kept_tree` makes of the same arrays
                    if key not in instanced.trees:
                        instanced.trees[key] = cache.take(key, partial(Triangles, *arrays), IN_TREES, len(local))
                    groups.append((instanced.trees[key], matrices[chosen].astype(np.float32)))
                    numbers.append(chosen)
                    triangles.append(local)
        self._numbers, self._number_start = _joined(numbers)
        self._triangles, self._triangle_start = _joined(triangles)
        self._scene = InstanceScene(groups, partial(_flattened, instanced, numbers, triangles))

    def intersect(self, origin: Float32, direction: Float32) -> NDArray[np.int64]:
        """As `TriangleScene.intersect`: faces."""
        triangle, group, number = self._scene.nearest(origin, direction)
        met = flatnonzero(triangle >= 0)
        group, face = group[met], np.full(len(triangle), MISS, np.int64)
        instance = self._numbers[self._number_start[group] + number[met]]
        local = self._triangles[self._triangle_start[group] + triangle[met]]
        face[met] = self._instanced.first + instance * self._instanced.stride + local
        return face

    def occluded(self, origin: Float32, direction: Float32, t_max: Float32) -> Bools:
        """As `TriangleScene.occluded`."""
        return self._scene.occluded(origin, direction, t_max)


def _flattened(instanced: Instanced, numbers: list[Numbers], triangles: list[Numbers]) -> tuple[Float32, Int32, Int32]:
    """All triangles of groups of instances, as `InstanceScene` asks for them: vertices (3 n, 3), triangles (n, 3), and
    (3, n) their numbers in their trees, groups, and numbers in their groups.

    numbers, triangles : of each group the instances, and the triangles of their mesh.
    """
    names = [
        np.stack(np.broadcast_arrays(np.arange(len(local)), group, np.arange(len(chosen))[:, None])).reshape(3, -1)
        for group, (chosen, local) in enumerate(zip(numbers, triangles, strict=True))
    ]
    found = np.concatenate(names, axis=1).astype(np.int32)
    (of_instances, first), (of_triangles, start) = _joined(numbers), _joined(triangles)
    instance, local = of_instances[first[found[1]] + found[2]], of_triangles[start[found[1]] + found[0]]
    corners = instanced.points(instance, instanced.start[instanced.mesh[instance]] + local)
    return corners.reshape(-1, 3), np.arange(3 * len(instance), dtype=np.int32).reshape(-1, 3), found


def _joined(parts: list[Numbers]) -> tuple[Numbers, Numbers]:
    """All in one, and where each begins."""
    return np.concatenate(parts), np.cumsum([0, *(len(part) for part in parts)])


def trees_over(geometry: Geometry, members: Bools, cache: SceneCache, divided: bool) -> Tree:
    """Trees over the triangles among the primitives `members` (np,) bool."""
    of_triangles = _over_triangles(geometry, members[: geometry.triangle_count], cache, divided)
    instanced = geometry.instanced
    if instanced is None or not (of_instances := members[geometry.flattened_count :] & instanced.worn).any():
        return of_triangles
    tree = InstanceTree(instanced, of_instances, cache)
    return TwoTrees(geometry, of_triangles, tree) if members[: geometry.triangle_count].any() else tree


def _over_triangles(geometry: Geometry, members: Bools, cache: SceneCache, divided: bool) -> TriangleScene | TwoTrees:
    """Trees over the triangles `members` (nt,) bool."""
    moving = members & geometry.moves[: len(members)]
    if divided and moving.any() and (members & ~moving).any():
        return TwoTrees(geometry, _tree(geometry, members & ~moving, cache), _tree(geometry, moving, cache))
    return _tree(geometry, members, cache)


def _tree(geometry: Geometry, members: Bools, cache: SceneCache) -> TriangleScene:
    if members.all():
        return kept_tree(cache, geometry.vertices, geometry.triangles, None)
    ids = flatnonzero(members).astype(np.int32)
    return kept_tree(cache, *_compact(geometry.vertices, geometry.triangles[ids]), ids)


def kept_tree(cache: SceneCache, vertices: Float32, triangles: Int32, ids: Int32 | None) -> TriangleScene:
    """A tree over these triangles (see `TriangleScene`), the last frame's if it has the same."""
    key = Digest(vertices, triangles)
    tree = cache.take(key, lambda: TriangleScene(vertices, triangles), IN_TREES, len(triangles))
    return tree.called(ids)


def _compact(vertices: Float32, triangles: Int32) -> tuple[Float32, Int32]:
    """Only the vertices that these triangles use: Embree's copy of the others would be as slow as a small tree."""
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    number = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return vertices[used], number[triangles]


def divides(geometry: Geometry, samples: int, pixels: int) -> bool:
    """Whether it pays that what moves has a tree of its own: building the other anew costs more than asking both.

    It depends on the scene and the settings alone, never on earlier frames: any order of frames gives the same trees.
    """
    triangles = geometry.triangle_count
    still = triangles - int(np.count_nonzero(geometry.moves[:triangles]))
    rays = pixels * samples * RAYS_PER_SAMPLE
    return still < triangles and still * BUILD_SECONDS > rays * QUERY_SECONDS
