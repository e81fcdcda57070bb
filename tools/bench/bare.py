# SPDX-License-Identifier: GPL-3.0-or-later
"""The tracer's own rays, sent to Embree by nobody but a loop: what the tracer can at best come down to."""

from __future__ import annotations

import mmap
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hybrid_addon.tracer.geometry import embree

Call = tuple[Any, np.ndarray, np.ndarray, np.ndarray | None]
"""A tree, origins and directions (3, n), and t_max (n,) of any-hit queries."""


@dataclass
class Recording:
    """Every query of a trace."""

    calls: list[Call] = field(default_factory=list)

    @property
    def rays(self) -> int:
        """How many rays Embree was sent."""
        return sum(origin.shape[1] for _, origin, _, _ in self.calls)

    def replay(self, threads: int, packets: bool = False) -> None:
        """Send them all again, spread over threads, and drop the answers.

        packets : to our own scene, by kernels; else one by one to embreex'. Both have the same triangles.
        """
        trees = {id(tree): tree if packets else _embreex(tree) for tree, *_ in self.calls}
        with ThreadPoolExecutor(threads) as pool:
            for _ in pool.map(lambda call: _send(trees[id(call[0])], *call[1:]), self.calls):
                pass

    @property
    def has_packets(self) -> bool:
        """Whether kernels can send them."""
        return bool(self.calls) and all(isinstance(tree, embree.OwnScene) for tree, *_ in self.calls)


def _send(tree: Any, origin: np.ndarray, direction: np.ndarray, t_max: np.ndarray | None) -> None:
    if t_max is None:
        tree.nearest(origin, direction)
    else:
        tree.occluded(origin, direction, t_max)


def _embreex(tree: Any) -> Any:
    """embreex' own scene of the same triangles: the measure, whatever asked Embree."""
    return getattr(tree, "embreex", tree)


def _kept_apart(a: np.ndarray) -> np.ndarray:
    """A contiguous float32 copy in memory that forks do not inherit: gigabytes would slow them down."""
    if not hasattr(mmap, "MADV_DONTFORK"):
        return np.array(a, np.float32, order="C")
    memory = mmap.mmap(-1, max(a.size, 1) * 4, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)  # neighbours count as one
    memory.madvise(mmap.MADV_DONTFORK)
    copy = np.frombuffer(memory, np.float32, a.size).reshape(a.shape)
    copy[...] = a
    return copy


@contextmanager
def recorded() -> Iterator[Recording]:
    """Record what is traced meanwhile. Slow, and it holds all rays in memory."""
    found, lock = Recording(), threading.Lock()
    intersect, occluded = embree.TriangleScene.intersect, embree.TriangleScene.occluded

    def note(scene: embree.TriangleScene, origin: Any, direction: Any, t_max: Any = None) -> None:
        if scene.size and origin.shape[1]:
            rays = [_kept_apart(a) for a in (origin, direction)]
            with lock:
                found.calls.append((scene._tree, rays[0], rays[1], None if t_max is None else _kept_apart(t_max)))

    def noted_intersect(self: Any, origin: Any, direction: Any) -> Any:
        note(self, origin, direction)
        return intersect(self, origin, direction)

    def noted_occluded(self: Any, origin: Any, direction: Any, t_max: Any) -> Any:
        note(self, origin, direction, t_max)
        return occluded(self, origin, direction, t_max)

    setattr(embree.TriangleScene, "intersect", noted_intersect)  # noqa: B010 (mypy: a method is not assigned to)
    setattr(embree.TriangleScene, "occluded", noted_occluded)  # noqa: B010
    try:
        yield found
    finally:
        setattr(embree.TriangleScene, "intersect", intersect)  # noqa: B010
        setattr(embree.TriangleScene, "occluded", occluded)  # noqa: B010
