"""What one frame leaves for the next: meshes made ready and search trees, found again by what they hold.

Nobody has to say what has changed. A mesh made ready is found by the mesh, the places of its instances and the scene's
centre, a tree by its very vertices and triangles. So what is found is, bit for bit, what would have been made; a frame
that is edited, undone or jumped to finds what it can and makes the rest.

    kept = Kept()
    trace(scene, settings, mask, kept=kept)      # again and again
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from ..scene import Float32, Int32
from .accel import TriangleScene
from .constants import MAX_KEPT_TRIANGLES

T = TypeVar("T")


class Kept:
    """Of the last frame, and of the one in work. A frame with more triangles than `limit` leaves nothing.

    triangles, trees : of the frame in work, how many triangles were made ready, and how many stand in trees that were
                       built, in an earlier frame.
    """

    def __init__(self, limit: int = MAX_KEPT_TRIANGLES) -> None:
        self.limit = limit
        self.triangles = self.trees = 0
        self._is_open = False
        self._lock = threading.Lock()
        self.forget()

    def forget(self) -> None:
        """Let go of everything."""
        with self._lock:
            self._meshes: tuple[dict[Hashable, Any], dict[Hashable, Any]] = ({}, {})  # of the last frame, of this one
            self._trees: tuple[list[TriangleScene], list[TriangleScene]] = ([], [])

    def begin(self, triangles: int) -> None:
        """A frame of so many triangles begins."""
        self._is_open = triangles <= self.limit
        self.triangles = self.trees = 0
        if not self._is_open:
            self.forget()
        with self._lock:
            self._meshes, self._trees = (self._meshes[1], {}), (self._trees[1], [])

    def end(self) -> None:
        """It is finished: what it did not ask for goes."""
        with self._lock:
            self._meshes, self._trees = ({}, self._meshes[1]), ([], self._trees[1])

    def take(self, key: Hashable, make: Callable[[], T], triangles: int = 0) -> T:
        """What the last frame made under this key, else what `make` makes; `triangles` of it are counted."""
        if not self._is_open:
            return make()
        with self._lock:
            before, now = self._meshes
            if key in before and key not in now:
                now[key] = before[key]
                self.triangles += triangles
        if key not in now:
            now[key] = make()
        found: T = now[key]
        return found

    def has(self, key: Hashable) -> bool:
        """Whether `take` would find something."""
        return self._is_open and any(key in meshes for meshes in self._meshes)

    def tree(self, vertices: Float32, triangles: Int32, ids: Int32 | None) -> TriangleScene:
        """A tree over these triangles (see `TriangleScene`), an old one if it has the same."""
        if not self._is_open:
            return TriangleScene(vertices, triangles, ids)
        with self._lock:
            before, now = self._trees
            new = next((tree for tree in now if tree.holds(vertices, triangles)), None)
            old = None if new else next((tree for tree in before if tree.holds(vertices, triangles)), None)
        if old is not None:
            self.trees += old.size
        found = new or old
        tree = TriangleScene(vertices, triangles, ids) if found is None else found.called(ids)
        with self._lock:
            now.append(tree)
        return tree
