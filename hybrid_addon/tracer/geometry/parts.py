# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of a mesh: what hangs together by its edges, and which of that is closed.

A bottle and the open label that was joined to it are one mesh, but two parts: only the bottle has an inside. Edges are
walked once each way by the triangles of a closed part. They are found by vertex numbers, or else by the places of the
vertices, or else by places that differ by rounding, as importers and lathes leave them along their seams.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, TriangleMesh
from ..core.constants import EMBREE_LIMIT, WELD
from .triangles import facets_of

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]


class Parts(NamedTuple):
    """The closed parts of a mesh.

    part  : (nt,) number of each triangle's part, from 0 on; -1: it is of none that is closed.
    place : (nv,) for each vertex the one, in the same place but for rounding, that stands for it; None: itself.
    """

    part: Numbers
    place: Numbers | None


def closed_parts(mesh: TriangleMesh) -> Parts:
    """The closed parts of a mesh, the seams of which may differ by rounding."""
    triangles, vertices = mesh.triangles.astype(np.intp), mesh.vertices
    sound = (np.abs(vertices) < EMBREE_LIMIT).all(axis=1)  # False for NaN
    usable = sound[triangles].all(axis=1)
    edges = _Edges(triangles, usable)
    if edges.match.all():
        return Parts(_numbered(edges), None)
    _, first, place = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    stands = first[place.reshape(-1)]
    edges = _Edges(stands[triangles], usable)
    welded = None
    if not edges.match.all():
        open_ends = np.unique(edges.ends[:, ~edges.match])
        group = _near(vertices[open_ends])
        if (group != np.arange(len(group))).any():
            to = np.arange(len(vertices))
            to[open_ends] = open_ends[group]
            welded = to[stands]
            edges = _Edges(welded[triangles], usable)
    return Parts(_numbered(edges), welded)


_closed_slots: WeakKeyDictionary[TriangleMesh, list[int]] = WeakKeyDictionary()


def _slots_of_closed(mesh: TriangleMesh) -> list[int]:
    """The surface slots that closed parts wear: looked for once."""
    if mesh not in _closed_slots:
        sound = facets_of(mesh.vertices[mesh.triangles])[3]  # a degenerate triangle is closed, and is left out
        closed = sound & (closed_parts(mesh).part >= 0)
        slots = np.zeros(len(closed), np.int32) if mesh.surface_slots is None else mesh.surface_slots
        _closed_slots[mesh] = np.unique(slots[closed]).tolist()
    return _closed_slots[mesh]


def closed_wear(mesh: TriangleMesh, surfaces: Sequence[tuple[int, ...]], marked: Bools) -> Bools:
    """(k,) whether any closed part of a mesh wears a surface `marked` (s,), for each k-th tuple that its slots name.

    A leaf is none, whatever it lets through; a slot too many wears the last surface.
    """
    found = {worn: bool(marked[list(worn)].any()) for worn in set(surfaces)}
    for worn in [worn for worn, able in found.items() if able]:
        found[worn] = any(marked[worn[min(slot, len(worn) - 1)]] for slot in _slots_of_closed(mesh))
    return np.array([found[worn] for worn in surfaces], bool)


def closed_by_number(triangles: Numbers) -> bool:
    """Whether vertex numbers alone tell that triangles (nt, 3) are closed."""
    return bool(_Edges(triangles, np.ones(len(triangles), bool)).match.all())


class _Edges:
    """The edges of triangles, each as often as it is used; those of degenerate triangles that are none are left out.

    triangle : (e,) whose edges they are.   ends : (2, e) vertices, the lower number first.
    forth    : (e,) 1 where it is walked from the lower number to the higher, else -1.
    edge     : (e,) number of the edge: the same for all its uses.
    match    : (e,) bool, it is walked as often one way as the other.
    """

    def __init__(self, triangles: Numbers, usable: Bools) -> None:
        self.count, self.usable = len(triangles), usable
        a, b = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
        real = a != b
        if not usable.all():
            real &= np.repeat(usable, 3)
        corner = np.arange(len(a)) if real.all() else np.flatnonzero(real)
        a, b = a[corner], b[corner]
        key = (np.minimum(a, b) << 32) | np.maximum(a, b)
        order = np.argsort(key)
        self._key = key[order]
        self.triangle, self.forth = corner[order] // 3, np.where(a < b, 1, -1)[order]
        self.edge = np.concatenate([[0], np.cumsum(self._key[1:] != self._key[:-1])])[: len(order)]
        self.match = (np.bincount(self.edge, self.forth) == 0)[self.edge] if len(order) else np.zeros(0, bool)

    @property
    def ends(self) -> Numbers:
        """(2, e)."""
        return np.stack([self._key >> 32, self._key & 0xFFFFFFFF])


def _numbered(edges: _Edges) -> Numbers:
    """The closed parts (nt,) of triangles that hang together by edges that match."""
    follows = (edges.edge[1:] == edges.edge[:-1]) & edges.match[1:]
    part = _components(edges.count, edges.triangle[1:][follows], edges.triangle[:-1][follows])
    closed = edges.usable.copy()
    loose = np.flatnonzero(~edges.match)
    if len(loose):
        # An edge that does not match as a whole may do so within a part: where a fin hangs on a closed one.
        key = part[edges.triangle[loose]].astype(np.int64) * (edges.edge[-1] + 1) + edges.edge[loose]
        _, inverse = np.unique(key, return_inverse=True)
        odd = np.bincount(inverse, edges.forth[loose])[inverse] != 0
        closed &= ~np.isin(part, part[edges.triangle[loose[odd]]])
    result = np.full(edges.count, -1, np.intp)
    result[closed] = np.unique(part[closed], return_inverse=True)[1].reshape(-1)
    return result


def _components(count: int, a: Numbers, b: Numbers) -> Numbers:
    """The least number (count,) that each is linked with, by links from a to b (l,)."""
    label = np.arange(count)
    while True:
        low = np.minimum(label[a], label[b])
        apart = (label[a] != low) | (label[b] != low)
        if not apart.any():
            return label
        a, b, low = a[apart], b[apart], low[apart]
        for end in (label[a], label[b]):
            np.minimum.at(label, end, low)
        while True:  # to the end of each chain
            further = label[label]
            if (further == label).all():
                break
            label = further


def _near(points: Float32) -> Numbers:
    """For points (n, 3) the least number (n,) of those no further than WELD away, and of what these are near to.

    In one of eight grids, shifted by half a cell, two points so near lie in the same cell.
    """
    n = len(points)
    label = np.arange(n)
    size = float(np.max(np.abs(points), initial=0.0))
    if n < 2 or size == 0:
        return label
    cell = 2 * WELD * size
    links = [np.zeros((2, 0), np.intp)]
    for shift in range(8):
        place = points.astype(np.float64) / cell + 0.5 * ((shift >> np.arange(3)) & 1)
        x, y, z = np.floor(place).astype(np.int64).T & ((1 << 21) - 1)
        key = (x << 42) | (y << 21) | z
        order = np.argsort(key, kind="stable")
        same = key[order][1:] == key[order][:-1]
        links.append(np.stack([order[:-1][same], order[1:][same]]))
    a, b = np.concatenate(links, axis=1)
    return _components(n, a, b)
