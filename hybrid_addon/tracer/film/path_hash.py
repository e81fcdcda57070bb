# SPDX-License-Identifier: GPL-3.0-or-later
"""Path signatures: what a sample met along its whole ray tree, as one number.

Two samples with the same signature saw the same things in the same way: the same objects, from the same sides, through
the same reflections and refractions, lit by the same lights. Between them the picture has no edge that geometry made.
After Genetti, Gordon and Williams (1998), who compare what the rays of neighbouring pixels meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene import Float64
from ..core.rays import Rays
from ..core.sampler import hash32
from ..core.vectors import flatnonzero, largest_component
from ..geometry.flatten import Geometry
from ..geometry.hits import Hits

UInt32 = NDArray[np.uint32]

REFLECTED, TRANSMITTED = np.uint32(0x9E3779B9), np.uint32(0x7F4A7C15)
ESCAPED = np.uint32(0x85EBCA6B)
INSIDE = np.uint32(0xC2B2AE35)
BACKED = np.uint32(0x27D4EB2F)

NORMAL_STEPS = 64.0
"""Flat faces of one object are told apart by their normals, in steps of 1 / 64."""


@dataclass(eq=False)
class Signatures:
    """Signatures of the samples of a tile.

    values     : (samples,) uint32, sums over the nodes of each tree, in any order; 0: nothing seen.
    identity   : what of hits is told apart.
    importance : nodes that bring less than this share of a sample do not count: they cannot make a visible edge.
    """

    values: UInt32
    identity: Identities
    importance: np.float32

    def add_hits(
        self, rays: Rays, prim: NDArray[np.integer], face: NDArray[np.integer], entering: NDArray[np.bool_], lit: UInt32
    ) -> None:
        """Note what rays (n,) hit (see `Hits`), from which side, and which lights (n,) reach it."""
        node = self.identity.take(prim, face) + lit
        node[~entering] += INSIDE
        self._add(rays, node)

    def add_escaped(self, rays: Rays) -> None:
        """Note rays that left the scene."""
        self._add(rays, np.full(len(rays), ESCAPED, np.uint32))

    def add_backed(self, rays: Rays, hits: Hits) -> None:
        """Note what rays (n,) hit whose light the raster gives."""
        self.add_hits(rays, hits.prim, hits.face, hits.toward < 0, np.full(len(rays), BACKED, np.uint32))

    def add_lamp(self, rays: Rays, key: np.uint32) -> None:
        """Note a lamp that rays (n,) meet, by its key."""
        self._add(rays, np.full(len(rays), key, np.uint32))

    def _add(self, rays: Rays, node: UInt32) -> None:
        counts = flatnonzero(largest_component(rays.throughput) >= self.importance)
        np.add.at(self.values, rays.sample[counts], hash32(rays.path[0, counts] ^ hash32(node[counts])))


def child_path(path: UInt32, kind: np.uint32) -> UInt32:
    """Paths (rows, n) one generation further."""
    return hash32(path ^ kind) if len(path) else path


class Identities:
    """What of hits a signature tells apart: the object, the surface, and flat faces by their normals."""

    def __init__(self, geometry: Geometry) -> None:
        self._geometry = geometry
        flattened = slice(0, geometry.flattened_count)
        self._key = np.zeros(len(geometry.object), np.int64)
        self._key[flattened] = _faces(geometry.facets, geometry.smooth)
        self._key = (self._key * 8191 + geometry.object) * 8191 + geometry.surface
        self._hashed = _hashed(self._key)

    @property
    def hashed(self) -> UInt32:
        """(np,) of all primitives, those apart that are kept once."""
        return self._hashed

    def take(self, prim: NDArray[np.integer], face: NDArray[np.integer]) -> UInt32:
        """(n,) of hits (n,), see `Hits`."""
        found, instanced = self._hashed.take(prim), self._geometry.instanced
        if instanced is not None:  # whose faces are known at the hit alone
            shared = flatnonzero(face >= instanced.first)
            table, _ = self._geometry.faces_of(face[shared])
            found[shared] = _hashed(self._key[prim[shared]] + _faces(table.facets, table.smooth) * 8191**2)
        return found


def _hashed(key: NDArray[np.int64]) -> UInt32:
    return hash32((key & 0xFFFFFFFF).astype(np.uint32))


def _faces(facets: Float64, smooth: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(n,) of plane equations (n, 4): the same for like normals, 0 for what is smooth."""
    steps = np.rint(facets[:, :3] * NORMAL_STEPS).astype(np.int64)
    return np.where(smooth, 0, (steps[:, 0] * 65537 + steps[:, 1]) * 65537 + steps[:, 2])
