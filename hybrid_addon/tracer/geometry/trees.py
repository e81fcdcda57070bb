# SPDX-License-Identifier: GPL-3.0-or-later
"""The search trees of a set of triangles: one, or two of which one is kept from frame to frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Int32
from ..core.cache import IN_TREES, Digest, SceneCache
from ..core.constants import BUILD_SECONDS, QUERY_SECONDS, RAYS_PER_SAMPLE
from ..core.vectors import flatnonzero
from .embree import TriangleScene
from .flatten import Geometry
from .shapes import plane_distance

Bools = NDArray[np.bool_]


class TwoTrees:
    """What stands still in one tree, what moves in another: the nearer of two hits, at equal distance the lower number.

    The distances compared are those in float64 from the planes of the triangles.
    """

    def __init__(self, geometry: Geometry, still: TriangleScene, moving: TriangleScene) -> None:
        self._geometry, self._still, self._moving = geometry, still, moving

    def intersect(self, origin: Float32, direction: Float32) -> Int32:
        """As `TriangleScene.intersect`."""
        found, other = self._still.intersect(origin, direction), self._moving.intersect(origin, direction)
        met = flatnonzero(other >= 0)
        rival, mine = other[met], found[met]
        both = flatnonzero(mine >= 0)
        nearer = np.ones(len(met), bool)
        rays = met[both]
        o, d = origin.take(rays, axis=1), direction.take(rays, axis=1)
        t, t_rival = (self._distance(prim, o, d) for prim in (mine[both], rival[both]))
        nearer[both] = (t_rival < t) | ((t_rival == t) & (rival[both] < mine[both]))
        found[met[nearer]] = rival[nearer]
        return found

    def _distance(self, prim: Int32, origin: Float32, direction: Float32) -> NDArray[np.float64]:
        facets = np.ascontiguousarray(self._geometry.facets.take(prim, axis=0).T)
        return plane_distance(facets, origin, direction)[0]

    def occluded(self, origin: Float32, direction: Float32, t_max: Float32) -> Bools:
        """As `TriangleScene.occluded`."""
        blocked = self._moving.occluded(origin, direction, t_max)
        free = flatnonzero(~blocked)
        blocked[free] = self._still.occluded(origin.take(free, axis=1), direction.take(free, axis=1), t_max[free])
        return blocked


def trees_over(geometry: Geometry, members: Bools, cache: SceneCache, divided: bool) -> TriangleScene | TwoTrees:
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
