# SPDX-License-Identifier: GPL-3.0-or-later
"""What one frame's translation leaves for the next.

A final render builds a dependency graph of its own for every frame, in which everything counts as updated and lies at
new addresses (only with Persistent Data does it tell what has changed). So a mesh is read again, which is a copy of its
arrays, and compared with the last one, byte for byte: the same is the *same object*, by which the tracer knows that
nothing has to be done about it. An image file is read again if its name, size, time or colour settings have changed; a
packed one, if its content has. A painted image is compared by a digest of its pixels, a generated one by its settings.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from ...scene import Float64, Texels, TriangleMesh, VoxelGrid

MAX_BYTES = 1 << 30
"""What is kept of meshes, of images, and of grids, at most."""


class MeshCache:
    """Meshes and images of the last frame, and of the one in work.

    meshes, images : of the frame in work, how many were the last frame's.
    learns         : what has moved once is taken to move again; for a preview, whose search trees need not be the same
                     after any order of edits.
    """

    def __init__(self, learns: bool = False) -> None:
        self._learns = learns
        self.forget()

    def forget(self) -> None:
        """Let go of everything."""
        self.meshes = self.images = 0
        self._meshes: tuple[dict[Hashable, TriangleMesh], dict[Hashable, TriangleMesh]] = ({}, {})
        self._images: tuple[dict[Hashable, Texels], dict[Hashable, Texels]] = ({}, {})
        self._grids: tuple[dict[Hashable, VoxelGrid], dict[Hashable, VoxelGrid]] = ({}, {})
        self._room = [MAX_BYTES, MAX_BYTES, MAX_BYTES]
        self._places: dict[str, set[Hashable]] = {}
        self._seen: dict[str, set[Hashable]] = {}
        self._restless: set[str] = set()

    def begin(self) -> None:
        """A frame begins."""
        self.meshes = self.images = 0
        self._room = [MAX_BYTES, MAX_BYTES, MAX_BYTES]
        self._meshes, self._images = (self._meshes[1], {}), (self._images[1], {})
        self._grids = (self._grids[1], {})

    def end(self) -> None:
        """It is translated: what it did not ask for goes."""
        self._meshes, self._images = ({}, self._meshes[1]), ({}, self._images[1])
        self._grids = ({}, self._grids[1])
        self._places, self._seen = self._seen, {}

    def mesh(self, key: Hashable, new: TriangleMesh) -> TriangleMesh:
        """The last frame's mesh of this key if it is the same as `new`, else `new`."""
        old = self._meshes[0].get(key)
        found = old if old is not None and same(old, new) else new
        self.meshes += found is old
        self._room[0] -= _size(found)
        if self._room[0] >= 0:
            self._meshes[1][key] = found
        return found

    def image(self, key: Hashable) -> Texels | None:
        """The last frame's texels of this key, if it has left any."""
        texels = self._images[0].get(key)
        if texels is not None:
            self.images += 1
            self.keep_image(key, texels)
        return texels

    def keep_image(self, key: Hashable, texels: Texels) -> None:
        """Leave them for the next frame. The key says all that they are made of."""
        self._room[1] -= texels.nbytes
        if self._room[1] >= 0:
            self._images[1][key] = texels

    def grid(self, key: Hashable) -> VoxelGrid | None:
        """The last frame's grid of this key, or this one's, if there is one."""
        return self._grids[1].get(key) or self._grids[0].get(key)

    def keep_grid(self, key: Hashable, grid: VoxelGrid) -> None:
        """Leave it for the next frame. The key says all that it is made of."""
        self._room[2] -= grid.values.nbytes
        if self._room[2] >= 0:
            self._grids[1][key] = grid

    def has_moved(self, name: str, mesh: TriangleMesh, matrix: Float64) -> bool:
        """Whether an object has been elsewhere, or of another shape, in any frame so far."""
        if not self._learns:
            return False
        place = (mesh, matrix.tobytes())
        self._seen.setdefault(name, set()).add(place)
        if name in self._places and place not in self._places[name]:
            self._restless.add(name)
        return name in self._restless


def _size(mesh: TriangleMesh) -> int:
    arrays = [getattr(mesh, field.name) for field in fields(TriangleMesh)]
    arrays += [array for part in arrays if isinstance(part, dict) for array in part.values()]
    return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))


def same(a: Any, b: Any) -> bool:
    """Whether two values are equal, parts of a scene part by part, arrays byte for byte.

    Parts that several share are compared once: n nodes of a material make up to 2 ** n paths.
    """
    waiting: list[tuple[Any, Any]] = [(a, b)]
    known: set[tuple[int, int]] = set()
    while waiting:
        a, b = waiting.pop()
        if a is b or (id(a), id(b)) in known:
            continue
        if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
            if a.dtype != b.dtype or a.shape != b.shape or not np.array_equal(_bits(a), _bits(b)):
                return False
            continue
        if type(a) is not type(b):
            return False
        if is_dataclass(a) and not isinstance(a, type):
            known.add((id(a), id(b)))  # both live as long as the scenes that hold them
            waiting += [(getattr(a, field.name), getattr(b, field.name)) for field in fields(a)]
        elif isinstance(a, dict):
            if a.keys() != b.keys():
                return False
            waiting += [(value, b[key]) for key, value in a.items()]
        elif isinstance(a, list | tuple):
            if len(a) != len(b):
                return False
            waiting += zip(a, b, strict=True)
        elif not a == b:
            return False
    return True


def _bits(a: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """An array as whole numbers, as few as may be: what a comparison takes most of its time for is its own result."""
    return np.ascontiguousarray(a).reshape(-1).view(np.uint8 if a.nbytes % 8 else np.uint64)
