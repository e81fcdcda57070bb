# SPDX-License-Identifier: GPL-3.0-or-later
"""One octave of Worley's cellular noise (1996): a random point in each cell of a lattice, and what is near it.

Sources: Worley 1996; Quilez, Voronoi borders (distance to the edge); gpu_shader_material_voronoi (hashes, the
polynomial that smooths, its correction).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from . import elementary
from .hashes import Array, Int32, color_of_floats, pcg, place_of_floats, to_unit

SAME_POINT = np.float32(0.0001)  # squared distance below which two points have no edge between them


@dataclass(frozen=True, eq=False)
class Kind:
    """metric: EUCLIDEAN, MANHATTAN, CHEBYCHEV or MINKOWSKI with `exponent`; randomness, smoothness (1 or n,).

    hash : in two dimensions and more "PCG" (Blender 5), or "LOOKUP3" of the cell's coordinates as floats (4.5).
    """

    metric: str
    exponent: Array
    randomness: Array
    smoothness: Array
    hash: str = "PCG"

    def distance(self, a: Array, b: Array) -> Array:
        """(n,) between points (d, n)."""
        away = np.abs(a - b)
        if len(away) == 1:
            return np.asarray(away[0])
        if self.metric == "MANHATTAN":
            return np.asarray(away.sum(axis=0))
        if self.metric == "CHEBYCHEV":
            return np.asarray(away.max(axis=0))
        if self.metric == "MINKOWSKI":
            with np.errstate(all="ignore"):
                total = elementary.power(away, self.exponent).sum(axis=0)
                return np.asarray(elementary.power(total, 1 / self.exponent), np.float32)
        return _length(away)


@dataclass(frozen=True, eq=False)
class Octave:
    """Of n points: distance (n,), color (3, n) of the cell, position (d, n) of its point."""

    distance: Array
    color: Array
    position: Array


class Lattice:
    """The cells that n points (d, n) are in."""

    def __init__(self, p: Array, kind: Kind) -> None:
        self.kind, self.low = kind, np.floor(p)
        self.local, self.cell = p - self.low, self.low.astype(np.int32)

    def around(self, reach: int) -> Iterator[Int32]:
        """Offsets (d, 1) of the cells within that reach; the first axis runs fastest."""
        for offset in product(range(-reach, reach + 1), repeat=len(self.low)):
            yield np.array(offset[::-1], np.int32)[:, None]

    def point(self, offset: Int32) -> Array:
        """(d, n) the point of a neighbouring cell, offset (d, 1 or n), relative to this one."""
        at = self.cell + offset
        inside = to_unit(pcg(at)) if self._by_integers else place_of_floats(at.astype(np.float32))
        return np.asarray(offset + inside * self.kind.randomness, np.float32)

    def color(self, offset: Int32) -> Array:
        """(3, n) a random colour of that cell."""
        at = self.cell + offset
        if not self._by_integers:
            return color_of_floats(at.astype(np.float32))
        if len(at) == 2:
            at = np.concatenate([at, np.zeros_like(at[:1])])
        return to_unit(pcg(at))[:3]

    @property
    def _by_integers(self) -> bool:
        return self.kind.hash == "PCG" and len(self.low) > 1

    def nearest(self) -> tuple[Array, Int32, Array]:
        """(distance squared (n,), offset (d, n) of the cell, its point (d, n)), by Euclid."""
        best = np.full(self.local.shape[1], np.inf, np.float32)
        cell, point = np.zeros_like(self.cell), np.zeros_like(self.local)
        for offset in self.around(1):
            candidate = self.point(offset)
            squared = _dot(candidate - self.local, candidate - self.local)
            closer = squared < best
            best, cell = np.where(closer, squared, best), np.where(closer, offset, cell)
            point = np.where(closer, candidate, point)
        return best, cell, point


def f1(p: Array, kind: Kind) -> Octave:
    """The nearest point."""
    return _ranked(p, kind, 1)


def f2(p: Array, kind: Kind) -> Octave:
    """The second nearest point."""
    return _ranked(p, kind, 2)


def _ranked(p: Array, kind: Kind, rank: int) -> Octave:
    lattice = Lattice(p, kind)
    distances = [np.full(p.shape[1], np.inf, np.float32) for _ in range(rank)]
    cells, points = [np.zeros_like(lattice.cell)] * rank, [np.zeros_like(p)] * rank
    for offset in lattice.around(1):
        point = lattice.point(offset)
        distance, cell = kind.distance(point, lattice.local), np.broadcast_to(offset, lattice.cell.shape)
        for i in range(rank):  # put it in its place, and what was there one place on
            closer = distance < distances[i]
            distance, distances[i] = _swapped(closer, distance, distances[i])
            cell, cells[i] = _swapped(closer, cell, cells[i])
            point, points[i] = _swapped(closer, point, points[i])
    return Octave(distances[-1], lattice.color(cells[-1]), points[-1] + lattice.low)


def _swapped(where: Array, a: Array, b: Array) -> tuple[Array, Array]:
    return np.where(where, b, a), np.where(where, a, b)


def smooth_f1(p: Array, kind: Kind) -> Octave:
    """The nearest point, blended into those that are nearly as near."""
    lattice, smoothness = Lattice(p, kind), kind.smoothness
    distance: Array = np.zeros(1, np.float32)
    color, position = np.zeros((3, 1), np.float32), np.zeros_like(p)
    first = True
    for offset in lattice.around(2):
        point = lattice.point(offset)
        here = kind.distance(point, lattice.local)
        t = np.clip(0.5 + 0.5 * (distance - here) / smoothness, 0, 1)
        h = np.ones_like(here) if first else t * t * (3 - 2 * t)
        first = False
        correction = smoothness * h * (1 - h)
        distance = distance + (here - distance) * h - correction
        correction = correction / (1 + 3 * smoothness)
        color = color + (lattice.color(offset) - color) * h - correction
        position = position + (point - position) * h - correction
    return Octave(distance, color, position + lattice.low)


def distance_to_edge(p: Array, kind: Kind) -> Array:
    """(n,) to the nearest border between two cells."""
    lattice = Lattice(p, kind)
    if len(p) == 1:
        left, middle, right = (lattice.point(np.array([[i]], np.int32))[0] for i in (-1, 0, 1))
        x = lattice.local[0]
        result: Array = np.minimum(np.abs((middle + left) / 2 - x), np.abs((middle + right) / 2 - x))
        return result
    nearest = lattice.nearest()[2] - lattice.local
    best = np.full(p.shape[1], np.inf, np.float32)
    for offset in lattice.around(1):
        other = lattice.point(offset) - lattice.local
        across = other - nearest
        squared = _dot(across, across)
        apart = squared > SAME_POINT
        edge = _dot((nearest + other) / 2, across) / np.sqrt(np.where(apart, squared, 1))
        best = np.where(apart, np.minimum(best, edge), best)
    return np.asarray(best)


def n_sphere_radius(p: Array, kind: Kind) -> Array:
    """(n,) of the largest ball around the nearest point that touches no other's."""
    lattice = Lattice(p, kind)
    _, cell, nearest = lattice.nearest()
    best = np.full(p.shape[1], np.inf, np.float32)
    for offset in lattice.around(1):
        if offset.any():
            best = np.minimum(best, _length(lattice.point(cell + offset) - nearest))
    return np.asarray(best / 2)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=0))


def _length(v: Array) -> Array:
    return np.sqrt(_dot(v, v))
