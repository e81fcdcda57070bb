# SPDX-License-Identifier: GPL-3.0-or-later
"""What one frame leaves for the next: meshes prepared, search trees and the world, found again by what they hold.

Nobody has to say what has changed. A mesh prepared is found by the mesh, the places of its instances and the scene's
centre, a tree by its very vertices and triangles, a world by all that it is made of (`key_of`). So what is found is,
bit for bit, what would have been made; a frame that is edited, undone or jumped to finds what it can and makes the
rest.

    kept = SceneCache()
    trace(scene, settings, mask, cache=cache)      # again and again
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Hashable, Mapping
from dataclasses import fields, is_dataclass
from hashlib import blake2b
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .constants import MAX_KEPT_TRIANGLES

T = TypeVar("T")


PREPARED, IN_TREES = "triangles prepared", "triangles in search trees"

LARGEST_VALUE = 64
"""Numbers of an array up to which it is found by them; a larger one is found if it is the same object."""


class _Same:
    """Stands for one array, whatever it holds: arrays are not written to once they are part of a scene."""

    def __init__(self, array: Any) -> None:
        self.array = array

    def __hash__(self) -> int:
        return id(self.array)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.array is self.array


def key_of(value: Any) -> Hashable:
    """What a part of a scene is found again by: all that it is made of, large arrays as the objects that they are."""
    if isinstance(value, np.ndarray):
        small = value.size <= LARGEST_VALUE and not value.dtype.hasobject
        return (value.shape, value.dtype.str, value.tobytes()) if small else _Same(value)
    if is_dataclass(value) and not isinstance(value, type):
        return (type(value), *(key_of(getattr(value, field.name)) for field in fields(value)))
    if isinstance(value, Mapping):
        return tuple((key_of(key), key_of(item)) for key, item in value.items())
    if isinstance(value, (tuple, list)):
        return tuple(key_of(item) for item in value)
    return value if isinstance(value, Hashable) else _Same(value)


class Digest:
    """Stands for arrays by what they hold, byte for byte (NaN equals itself, 0 differs from -0), without holding them.

    It reads them when it is first compared, so that a key that nobody looks up costs nothing.
    """

    def __init__(self, *arrays: NDArray[Any]) -> None:
        self._arrays, self._digest = arrays, b""

    def _read(self) -> bytes:
        if not self._digest:
            content = blake2b(digest_size=16)
            for array in self._arrays:
                content.update(f"{array.dtype.str}{array.shape}".encode())
                content.update(np.ascontiguousarray(array).view(np.uint8))
            self._arrays, self._digest = (), content.digest()
        return self._digest

    def __hash__(self) -> int:
        return hash(self._read())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Digest) and other._read() == self._read()


class SceneCache:
    """Of the last frame, and of the one in work. A frame with more triangles than `limit` leaves nothing.

    found : of the frame in work, how many of what were made in an earlier one.
    """

    def __init__(self, limit: int = MAX_KEPT_TRIANGLES) -> None:
        self.limit = limit
        self.found: Counter[str] = Counter()
        self._is_open = False
        self._lock = threading.Lock()
        self.forget()

    def forget(self) -> None:
        """Let go of everything."""
        with self._lock:
            self._things: tuple[dict[Hashable, Any], dict[Hashable, Any]] = ({}, {})  # of the last frame, of this one

    def begin(self, triangles: int) -> None:
        """A frame of so many triangles begins."""
        self._is_open = triangles <= self.limit
        self.found.clear()
        if not self._is_open:
            self.forget()
        with self._lock:
            self._things = (self._things[1], {})

    def end(self) -> None:
        """It is finished: what it did not ask for goes."""
        with self._lock:
            self._things = ({}, self._things[1])

    def take(self, key: Hashable, make: Callable[[], T], what: str = "", count: int = 1) -> T:
        """What the last frame made under this key, counted as so many of `what`; else what `make` makes."""
        if not self._is_open:
            return make()
        with self._lock:
            before, now = self._things
            if key in before and key not in now:
                now[key] = before[key]
                if what:
                    self.found[what] += count
        if key not in now:
            now[key] = make()
        found: T = now[key]
        return found

    def has(self, key: Hashable) -> bool:
        """Whether `take` would find something."""
        return self._is_open and any(key in things for things in self._things)
