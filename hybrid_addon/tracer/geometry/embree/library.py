# SPDX-License-Identifier: GPL-3.0-or-later
"""Embree's own functions by ctypes: scenes over the arrays that we have, without embreex' copies.

The library is the one in embreex' wheel (Embree 4.4). Its sharp edges, all ended here:

* auditwheel gives it another name on each system: it is found by pattern, beside embreex, which has loaded it and what
  it needs (TBB) when it is imported;
* a shared buffer is read 16 bytes at a time: four bytes past the last vertex must be there, so there is one more;
* it keeps no reference to shared arrays: a scene does, as long as it lives;
* errors are numbers that nobody sees who does not ask: they are asked for after each build;
* an array of instances names the instance and the triangle of each hit, and its transforms are float32.

What calls its queries, thousands of times for each array of rays, are compiled loops (`packets`).
"""

from __future__ import annotations

import ctypes
import platform
import threading
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any
from weakref import finalize

import embreex
import numpy as np
from embreex import rtcore_scene  # noqa: F401 (its import loads the library, and what that needs)

from ....scene import Float32, Int32

PATTERNS = {
    "Linux": "../embreex.libs/libembree4*.so*",
    "Windows": "../embreex.libs/embree4*.dll",
    "Darwin": ".dylibs/libembree4*.dylib",
}
"""Where the library lies, from embreex' own folder (auditwheel, delvewheel, delocate)."""

TRIANGLES, INSTANCES = 0, 122
INDEX, VERTEX, TRANSFORM = 0, 1, 23
UINT3, FLOAT3, FLOAT3X4_ROWS = 0x5003, 0x9003, 0x9134
ROBUST = 1 << 2
MEDIUM = 1
"""rtcore_geometry.h, rtcore_buffer.h, rtcore_common.h, rtcore_scene.h of Embree 4.4. embreex builds robust scenes of
medium quality, too: so both find the same."""

OUT_OF_MEMORY = 4

_P, _U, _I, _SIZE = ctypes.c_void_p, ctypes.c_uint, ctypes.c_int, ctypes.c_size_t
_FUNCTIONS: dict[str, tuple[Any, list[Any]]] = {
    "rtcNewDevice": (_P, [ctypes.c_char_p]),
    "rtcGetDeviceError": (_I, [_P]),
    "rtcGetDeviceLastErrorMessage": (ctypes.c_char_p, [_P]),
    "rtcNewScene": (_P, [_P]),
    "rtcSetSceneFlags": (None, [_P, _I]),
    "rtcSetSceneBuildQuality": (None, [_P, _I]),
    "rtcCommitScene": (None, [_P]),
    "rtcReleaseScene": (None, [_P]),
    "rtcNewGeometry": (_P, [_P, _I]),
    "rtcSetSharedGeometryBuffer": (None, [_P, _I, _U, _I, _P, _SIZE, _SIZE, _SIZE]),
    "rtcSetGeometryInstancedScene": (None, [_P, _P]),
    "rtcCommitGeometry": (None, [_P]),
    "rtcAttachGeometry": (_U, [_P, _P]),
    "rtcReleaseGeometry": (None, [_P]),
}
QUERIES = "rtcIntersect8", "rtcOccluded8"
"""Packets of 8: measured as fast as those of 16, and no processor that Blender runs on splits them."""


def library_file(system: str = "") -> Path | None:
    """The library in embreex' wheel; None: there is none that we know."""
    pattern = PATTERNS.get(system or platform.system())
    found = sorted(Path(embreex.__file__).parent.glob(pattern)) if pattern else []
    return found[0] if found else None


@cache
def library() -> ctypes.CDLL | None:
    """Embree, loaded; None: not found, or another than we know."""
    file = library_file()
    try:
        loaded = ctypes.CDLL(str(file)) if file else None
        for name, (result, arguments) in _FUNCTIONS.items() if loaded else ():
            function = getattr(loaded, name)
            function.restype, function.argtypes = result, arguments
        return loaded
    except (OSError, AttributeError):  # not to be loaded here; a version without one of these functions
        return None


def query_addresses() -> dict[str, int]:
    """The addresses of its queries by name; none without the library, or where it lacks one of them."""
    embree = library()
    try:
        return {name: ctypes.cast(getattr(embree, name), ctypes.c_void_p).value or 0 for name in QUERIES}
    except AttributeError:
        return {}


@cache
def _made() -> tuple[ctypes.CDLL, int]:
    embree = library()
    assert embree is not None
    return embree, embree.rtcNewDevice(None)


_making = threading.Lock()


def _device() -> tuple[ctypes.CDLL, int]:
    """The library, and its one device: threads that ask at once do not make two."""
    with _making:
        return _made()


class _Scene:
    """An Embree scene, freed with its last reference. address : of the RTCScene, for the queries."""

    def __init__(self, *kept: Any) -> None:
        embree, device = _device()
        self.address: int = embree.rtcNewScene(device)
        self._kept = kept  # what it reads
        finalize(self, embree.rtcReleaseScene, self.address).atexit = False
        embree.rtcSetSceneFlags(self.address, ROBUST)
        embree.rtcSetSceneBuildQuality(self.address, MEDIUM)

    def _attach(self, geometry: int) -> None:
        embree, _ = _device()
        embree.rtcCommitGeometry(geometry)
        embree.rtcAttachGeometry(self.address, geometry)
        embree.rtcReleaseGeometry(geometry)

    def _build(self) -> None:
        embree, device = _device()
        embree.rtcCommitScene(self.address)
        error = embree.rtcGetDeviceError(device)
        if error == OUT_OF_MEMORY:
            raise MemoryError("Embree has no memory left to build a search tree")
        if error:
            message = embree.rtcGetDeviceLastErrorMessage(device) or b""
            raise RuntimeError(f"Embree cannot build a search tree: error {error} {message.decode(errors='replace')}")


class Triangles(_Scene):
    """A tree over triangles (nt, 3) int32 of finite vertices (nv, 3) float32, which it reads from our arrays.

    Raises MemoryError, and RuntimeError for whatever else Embree refuses.
    """

    def __init__(self, vertices: Float32, triangles: Int32) -> None:
        padded = np.empty((len(vertices) + 1, 3), np.float32)
        padded[:-1], padded[-1] = vertices, 0
        triangles = np.ascontiguousarray(triangles, np.int32)
        super().__init__(padded, triangles)
        embree, device = _device()
        mesh = embree.rtcNewGeometry(device, TRIANGLES)
        embree.rtcSetSharedGeometryBuffer(mesh, VERTEX, 0, FLOAT3, padded.ctypes.data, 0, 12, len(vertices))
        embree.rtcSetSharedGeometryBuffer(mesh, INDEX, 0, UINT3, triangles.ctypes.data, 0, 12, len(triangles))
        self._attach(mesh)
        self._build()


class Instances(_Scene):
    """A tree over instances of trees: of each of some a group, at matrices (k, 3, 4) float32, object to world.

    A query names the group of a hit, which of its instances, and which triangle of its tree.
    Raises as `Triangles` does.
    """

    def __init__(self, groups: Sequence[tuple[Triangles, Float32]]) -> None:
        placed = [(tree, np.ascontiguousarray(matrices, np.float32)) for tree, matrices in groups]
        super().__init__(placed)
        embree, device = _device()
        for tree, rows in placed:
            group = embree.rtcNewGeometry(device, INSTANCES)
            embree.rtcSetGeometryInstancedScene(group, tree.address)
            embree.rtcSetSharedGeometryBuffer(group, TRANSFORM, 0, FLOAT3X4_ROWS, rows.ctypes.data, 0, 48, len(rows))
            self._attach(group)
        self._build()
