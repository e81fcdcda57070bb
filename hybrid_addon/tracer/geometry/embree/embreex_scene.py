# SPDX-License-Identifier: GPL-3.0-or-later
"""embreex' own scenes: what answers while there are no kernels. Its loop calls Embree for one ray after the other.

embreex (4.4) has sharp edges, and all of them end here:

* it does not check triangle indices, and loses vertices that are not finite: it gets checked ones only;
* it overwrites the array of distances: a copy goes in;
* OCCLUDED answers 0 for a hit and -1 for none, INTERSECT the primitive or -1;
* it reads vertices and indices one by one as Python objects: an array of such is read in a third of the time;
* a mesh added after the first query is ignored unless `is_committed` is reset: all geometry is one mesh, built at once;
* a scene that Python's search for cycles frees loses its device before it ends, and ends in freed memory, which kills
  Blender some time later: `finalize` holds on to it, and so no search for cycles ever finds it;
* it tells of a hit which triangle it is, not of which instance.
"""

from __future__ import annotations

from weakref import finalize

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh as EmbreeMesh
from numpy.typing import NDArray

from ....scene import Float32, Int32
from ...core.vectors import Array

READ_AS_OBJECTS = 1 << 21
"""Triangles up to which they are handed over as Python objects, in a fifth of the time: a passing 300 MB then."""


class EmbreexScene:
    """A tree over triangles (nt, 3) int32 of finite vertices (nv, 3) float32."""

    def __init__(self, vertices: Float32, triangles: Int32) -> None:
        self._scene = rtcore_scene.EmbreeScene(robust=True)
        if len(triangles) <= READ_AS_OBJECTS:
            numbers = np.arange(len(vertices)).astype(object)  # one object for each vertex, not for each corner
            mesh = EmbreeMesh(self._scene, vertices.astype(object), numbers.take(triangles))
        else:
            mesh = EmbreeMesh(self._scene, np.ascontiguousarray(vertices), np.ascontiguousarray(triangles))
        self._commit()
        self._life = _Life()
        finalize(self._life, [mesh, self._scene].clear).atexit = False

    def _commit(self) -> None:
        """Build the tree now: embreex builds it in the first query, which must not come from two threads at once."""
        self._scene.run(np.zeros((1, 3), np.float32), np.array([[0, 0, 1]], np.float32), query="OCCLUDED")

    def nearest(self, origin: Float32, direction: Float32) -> Int32:
        """The triangle (n,) that each ray (3, n) meets first, -1 for none."""
        found: Int32 = self._scene.run(rows(origin), rows(direction), query="INTERSECT")
        return found

    def occluded(self, origin: Float32, direction: Float32, t_max: Float32) -> NDArray[np.bool_]:
        """Whether (n,) anything lies on each ray up to t_max (n,)."""
        answer = self._scene.run(rows(origin), rows(direction), dists=t_max.copy(), query="OCCLUDED")
        return np.asarray(answer == 0)


class _Life:
    """As long as it lasts its tree is needed."""


def rows(a: Array) -> Array:
    """(3, n) as the (n, 3) rows that embreex reads: a strided view, measured as fast as a copy."""
    return a.T
