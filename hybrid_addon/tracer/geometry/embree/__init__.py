# SPDX-License-Identifier: GPL-3.0-or-later
"""The only room that talks to Embree: nearest and any hit with one triangle soup, or with instances of such.

Without kernels (see `tracer/kernels`) embreex' own scenes answer, with the same bits. A NaN, infinite or zero ray
visits the whole tree (600 times slower): such rays are masked out and counted before they come here.
"""

from __future__ import annotations

import copy
import os
import threading
from collections.abc import Callable, Sequence
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from ....accelerated import ALL, accelerated
from ....scene import Float32, Int32
from ...core.constants import MISS
from .embreex_scene import EmbreexScene
from .library import Instances, Triangles

__all__ = ["InstanceScene", "OwnScene", "TriangleScene", "Triangles", "embree_version", "has_kernels"]


Soup = tuple[Float32, Int32, Int32]


@cache
def embree_version() -> str:
    """Version of embreex, whose first three numbers are those of the Embree inside; it takes long to look up."""
    try:
        return version("embreex")
    except PackageNotFoundError:
        return "unknown"


_own: WeakValueDictionary[int, _Own] = WeakValueDictionary()


@accelerated
def nearest_of(scene: int | np.uint64, origin: Float32, direction: Float32, found: Int32) -> None:
    """Write into found (3, n) the triangle that each ray (3, n) meets first, its group of instances and its number in
    the group; -1 for none. scene: the address of one of our own."""
    own = _own[int(scene)]
    triangle = own.embreex.nearest(origin, direction)
    found[:] = own.names.take(triangle, axis=1, mode="wrap")
    found[:, triangle < 0] = MISS


@accelerated
def occluded_of(
    scene: int | np.uint64, origin: Float32, direction: Float32, t_max: Float32, blocked: NDArray[np.bool_]
) -> None:
    """Write whether (n,) anything lies on each ray (3, n) up to t_max (n,)."""
    blocked[:] = _own[int(scene)].embreex.occluded(origin, direction, t_max)


QUERIES = {f"tracer.geometry.embree.{query.__name__}" for query in (nearest_of, occluded_of)}
"""The kernels that call our own scenes."""


def has_kernels() -> bool:
    """Whether they are there."""
    return all(ALL[name].kernel is not None for name in QUERIES)


def _nearest(scene: np.uint64, origin: Float32, direction: Float32) -> Int32:
    """(3, n), see `nearest_of`."""
    found = np.empty((3, origin.shape[1]), np.int32)
    nearest_of(scene, origin, direction, found)
    return found


def _occluded(scene: np.uint64, origin: Float32, direction: Float32, t_max: Float32) -> NDArray[np.bool_]:
    """(n,), see `occluded_of`."""
    blocked = np.empty(origin.shape[1], bool)
    occluded_of(scene, origin, direction, t_max, blocked)
    return blocked


class _Own:
    """Our own scene, asked by kernels. Should these fail, embreex' scene of the same triangles answers.

    soup : gives what embreex' scene is made of: vertices (nv, 3) float32, triangles (nt, 3) int32, and (3, nt) int32
           what our own scene calls each of them (see `nearest_of`).
    """

    def __init__(self, scene: Triangles | Instances, soup: Callable[[], Soup]) -> None:
        self.scene, self._soup, self._lock, self._process = scene, soup, threading.Lock(), os.getpid()
        self.address = np.uint64(scene.address)
        self._made: tuple[EmbreexScene, Int32] | None = None
        _own[scene.address] = self

    def _other(self) -> tuple[EmbreexScene, Int32]:
        """embreex' scene, built when first asked for, but not in a forked process, which lacks the threads that build
        it: a task that fails there is done again here."""
        if os.getpid() != self._process:
            raise RuntimeError("a forked process builds no trees")
        with self._lock:
            if self._made is None:
                vertices, triangles, names = self._soup()
                self._made = EmbreexScene(vertices, triangles), names
            return self._made

    @property
    def embreex(self) -> EmbreexScene:
        """embreex' scene of the same triangles."""
        return self._other()[0]

    @property
    def names(self) -> Int32:
        """(3, nt) what our own scene calls its triangles."""
        return self._other()[1]

    def occluded(self, origin: Float32, direction: Float32, t_max: Float32) -> NDArray[np.bool_]:
        """Whether (n,) anything lies on each ray up to t_max (n,)."""
        return _occluded(self.address, origin, direction, t_max)


class OwnScene(_Own):
    """A tree over triangles (nt, 3) int32 of finite vertices (nv, 3) float32."""

    def __init__(self, vertices: Float32, triangles: Int32) -> None:
        self._triangles = vertices, triangles
        super().__init__(Triangles(vertices, triangles), partial(_soup_of, vertices, triangles))

    def nearest(self, origin: Float32, direction: Float32) -> Int32:
        """The triangle (n,) that each ray (3, n) meets first, -1 for none."""
        triangle: Int32 = _nearest(self.address, origin, direction)[0]
        return triangle


def _soup_of(vertices: Float32, triangles: Int32) -> Soup:
    names = np.full((3, len(triangles)), MISS, np.int32)
    names[0] = np.arange(len(triangles))
    return vertices, triangles, names


class InstanceScene(_Own):
    """Instances of trees: groups of a tree and matrices (k, 3, 4) float32, object to world.

    flattened : gives all their triangles in the world (see `_Own`), should the kernels fail.
    """

    def __init__(self, groups: Sequence[tuple[Triangles, Float32]], flattened: Callable[[], Soup]) -> None:
        super().__init__(Instances(groups), flattened)

    def nearest(self, origin: Float32, direction: Float32) -> Int32:
        """Triangle, group and number in the group (3, n) of what each ray (3, n) meets first, -1 for none."""
        return _nearest(self.address, origin, direction)


class TriangleScene:
    """An Embree scene over some of the world's triangles.

    vertices  : (nv, 3) float32, finite.
    triangles : (nt, 3) int32, indices into vertices, already validated.
    ids       : (nt,) int32, the world's primitive id of each triangle, or None: its own number.
    """

    def __init__(self, vertices: Float32, triangles: Int32, ids: Int32 | None = None) -> None:
        self.size = len(triangles)
        self.vertices, self.triangles, self._ids = vertices, triangles, ids
        if self.size:
            self._tree = OwnScene(vertices, triangles) if has_kernels() else EmbreexScene(vertices, triangles)

    @property
    def own(self) -> OwnScene | EmbreexScene | None:
        """The tree itself; None: there are no triangles."""
        return self._tree if self.size else None

    @property
    def ids(self) -> Int32 | None:
        """(nt,) see the class."""
        return self._ids

    def called(self, ids: Int32 | None) -> TriangleScene:
        """The same tree with other primitive ids."""
        other = copy.copy(self)
        other._ids = ids
        return other

    def intersect(self, origin: Float32, direction: Float32) -> Int32:
        """Primitive id of the nearest hit of each ray, MISS for none.

        origin, direction : (3, n) float32, finite, direction not 0.
        """
        n = origin.shape[1]
        if self.size == 0 or n == 0:
            return np.full(n, MISS, np.int32)
        found = self._tree.nearest(origin, direction)
        if self._ids is None:
            return found
        missed = found < 0
        found = self._ids.take(found, mode="wrap")
        found[missed] = MISS
        return found

    def occluded(self, origin: Float32, direction: Float32, t_max: Float32) -> NDArray[np.bool_]:
        """Whether anything lies on each ray up to t_max (n,)."""
        n = origin.shape[1]
        if self.size == 0 or n == 0:
            return np.zeros(n, bool)
        return self._tree.occluded(origin, direction, t_max)
