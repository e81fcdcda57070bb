# SPDX-License-Identifier: GPL-3.0-or-later
"""The nearest hits of rays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64, Int32
from ..core.constants import MISS
from ..core.vectors import ALL, Index, take
from .flatten import Geometry

Bools = NDArray[np.bool_]

NO_FACES = np.zeros(0, np.int64)


@dataclass(eq=False)
class Hits:
    """The nearest hit of each of n rays.

    prim   : (n,) int32, its row in tables of all primitives; MISS for none.
    t      : (n,) float64 from the exact float32 geometry, inf for none.
    normal : (3, n) float32, unit geometric normal on the outer side of the primitive; meaningless for misses.
    toward : (n,) float64, normal . direction: negative where the ray comes from outside.
    face   : (n,) what is hit (see `instanced`): where no mesh is kept once, `prim` itself.
    """

    prim: Int32
    t: Float64
    normal: Float32
    toward: Float64
    face: NDArray[Any] = field(default_factory=lambda: NO_FACES)

    def __post_init__(self) -> None:
        if self.face is NO_FACES:
            self.face = self.prim

    @classmethod
    def empty(cls, n: int, geometry: Geometry) -> Hits:
        """n hits, to be written to."""
        prim = np.empty(n, np.int32)
        face = prim if geometry.instanced is None else np.empty(n, np.int64)
        return cls(prim, np.empty(n), np.empty((3, n), np.float32), np.empty(n), face)

    def take(self, index: Index) -> Hits:
        """The hits `index`, in that order."""
        if isinstance(index, slice) and index == ALL:
            return self
        prim = take(self.prim, index)
        face = prim if self.face is self.prim else take(self.face, index)
        return Hits(prim, take(self.t, index), take(self.normal, index), take(self.toward, index), face)

    def store(self, where: Index, found: Hits) -> None:
        """Put hits in the places `where`."""
        self.prim[where], self.t[where] = found.prim, found.t
        self.normal[:, where], self.toward[where] = found.normal, found.toward
        if self.face is not self.prim:
            self.face[where] = found.face

    def drop(self, where: Index | Bools) -> None:
        """Nothing is hit there."""
        self.prim[where] = self.face[where] = MISS

    def extent(self, geometry: Geometry) -> Float32:
        """(n,) largest |coordinate| of what is hit, none of them a miss."""
        table, place = geometry.faces_of(self.face)
        return table.extent.take(place)
