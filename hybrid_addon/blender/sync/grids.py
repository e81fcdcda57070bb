# SPDX-License-Identifier: GPL-3.0-or-later
"""Voxel grids of volume objects and of smoke -> scene.VoxelGrid.

Blender hands out no voxels of a volume object, but writes its grids to a file, whatever made them: a file, a sequence,
modifiers or geometry nodes. Its own OpenVDB library reads them from there. Smoke it hands out itself.
"""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...scene import Float32, Float64, TriangleMesh, VoxelGrid
from .cache import MeshCache
from .coverage import FIRST
from .messages import Warnings

MOST_VOXELS = 1 << 25
"""Of a grid, 128 MB of single numbers; a larger one is read as means of blocks."""

WIDTHS = {
    "FLOAT": 1, "DOUBLE": 1, "INT": 1, "INT64": 1, "BOOLEAN": 1, "VECTOR_FLOAT": 3, "VECTOR_DOUBLE": 3,
    "VECTOR_INT": 3,
}  # fmt: skip
"""Numbers in a voxel, by a grid's data type; others are no numbers."""

EMPTY_AROUND = 1
"""Voxels of nothing around a volume object's grids: what lies beyond them is 0, and linear until there, as in EEVEE."""

LEAF = 8
"""Voxels along a leaf of OpenVDB's trees: Blender's box around a volume object holds whole leaves."""

LEAST_FLAME = 0.01
"""Of a flame, above which it has a temperature (gpu_shader_material_volume_info.glsl)."""


@dataclass(frozen=True, eq=False)
class Grids:
    """The grids of an object, not read yet.

    widths    : by name, numbers in a voxel.   low, high : (3,) float64 corners of the box around all, local.
    read      : those of these names.
    """

    widths: dict[str, int]
    low: Float64
    high: Float64
    read: Callable[[Collection[str]], dict[str, VoxelGrid]]

    def box(self, name: str) -> TriangleMesh:
        """The closed mesh around them."""
        corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, 8).T
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32)
        vertices = (self.low + corners * (self.high - self.low)).astype(np.float32)
        return TriangleMesh(name, vertices, triangles, triangles)

    @property
    def to_generated(self) -> Float64:
        """(3, 4), from local positions to 0..1 over the box."""
        size = np.where(self.high > self.low, self.high - self.low, 1.0)
        return np.concatenate([np.diag(1 / size), (-self.low / size)[:, None]], axis=1)


# ------------------------------------------------------------------------------------------------ volume objects


def volume_grids(b_object: bpy.types.Object, kept: MeshCache, warn: Warnings) -> Grids | None:
    """Those of an evaluated volume object; None, and a warning, if there are none that can be read."""
    b_grids, owner = b_object.data.grids, f"object {b_object.name!r}"
    if not b_grids.load():
        warn.add(f"{owner}: its volume cannot be read, rays meet nothing of it: {b_grids.error_message}", FIRST)
        return None
    widths = {b_grid.name: WIDTHS[b_grid.data_type] for b_grid in b_grids if b_grid.data_type in WIDTHS}
    if not widths:
        return None
    openvdb = _openvdb()
    if openvdb is None:
        warn.add(f"{owner}: this Blender has no module openvdb: rays meet nothing of the volume", FIRST)
        return None
    matrices = {b_grid.name: np.array(b_grid.matrix_object, np.float64) for b_grid in b_grids}
    own = "" if b_object.modifiers else b_grids.frame_filepath
    state = _state(own)

    def read(names: Collection[str]) -> dict[str, VoxelGrid]:
        known = {name: kept.grid((state, name)) for name in names} if state else {}
        missing = [name for name in names if known.get(name) is None]
        with _file(b_grids, own if state else "") as path:
            known |= {name: _voxels(openvdb.read(path, name), matrices[name]) for name in missing}
        for name, grid in known.items():
            if grid is not None and state:
                kept.keep_grid((state, name), grid)
        return {name: grid for name, grid in known.items() if grid is not None}

    low, high = _bounds(openvdb, b_grids, own if state else "", matrices)
    return None if low is None or high is None else Grids(widths, low, high, read)


def _openvdb() -> Any:
    """Blender's own module, which a Blender that is a Python module keeps beside the path; None: it has none."""
    try:
        return importlib.import_module("openvdb")
    except ImportError:
        version = f"python{sys.version_info.major}.{sys.version_info.minor}"
        own = Path(bpy.utils.system_resource("PYTHON"), "lib", version, "site-packages")
    sys.path.append(str(own))
    try:
        return importlib.import_module("openvdb")
    except ImportError:
        return None
    finally:
        sys.path.remove(str(own))


def _state(path: str) -> tuple[str, int, int] | None:
    """What a file is known again by; None: there is none."""
    if not path or not os.path.isfile(path):
        return None
    found = os.stat(path)
    return path, found.st_mtime_ns, found.st_size


class _file:
    """The path of a file with these grids: their own, or one that is written for as long as it is needed."""

    def __init__(self, b_grids: Any, own: str) -> None:
        self._b_grids, self._own, self._folder = b_grids, own, ""

    def __enter__(self) -> str:
        if self._own:
            return self._own
        self._temporary = tempfile.TemporaryDirectory(prefix="hybrid_")
        path = str(Path(self._temporary.name, "volume.vdb"))
        self._b_grids.save(filepath=path)
        return path

    def __exit__(self, *_: object) -> None:
        if not self._own:
            self._temporary.cleanup()


def _bounds(
    openvdb: Any, b_grids: Any, own: str, matrices: dict[str, Float64]
) -> tuple[Float64 | None, Float64 | None]:
    """Local corners (3,) of Blender's box around all voxels; None: there are none."""
    corners = []
    with _file(b_grids, own) as path:
        for grid in openvdb.readAllGridMetadata(path):
            low, high = (grid.metadata.get(f"file_bbox_{end}") for end in ("min", "max"))
            if low is None or high is None or grid.name not in matrices or any(np.subtract(high, low) < 0):
                continue
            first, last = np.array(low) // LEAF, np.array(high) // LEAF + 1
            ends = np.array([first * LEAF - 0.5, last * LEAF - 0.5])
            box = np.array(np.meshgrid(*ends.T, indexing="ij")).reshape(3, 8)
            corners.append(matrices[grid.name][:3, :3] @ box + matrices[grid.name][:3, 3:])
    if not corners:
        return None, None
    found = np.concatenate(corners, axis=1)
    return found.min(axis=1), found.max(axis=1)


def _voxels(grid: Any, matrix: Float64) -> VoxelGrid | None:
    """A grid as an array, with nothing around; None if it is empty. matrix: (4, 4), from voxels to local positions."""
    low, high = (np.array(end, np.int64) for end in grid.evalActiveVoxelBoundingBox())
    size = high - low + 1
    if (size <= 0).any():
        return None
    block = int(np.ceil((float(np.prod(size.astype(np.float64))) / MOST_VOXELS) ** (1 / 3)))
    blocks = -(-size // block)
    one = np.ndim(grid.background) == 0
    values = np.zeros((*(blocks + 2 * EMPTY_AROUND), 1 if one else 3), np.float32)
    shape = np.array([1, *blocks[1:]]) * block
    slab = np.zeros(tuple(shape) if one else (*shape, 3), np.float32)
    for i in range(int(blocks[0])):
        grid.copyToArray(slab, (int(low[0]) + i * block, int(low[1]), int(low[2])))
        means = slab.reshape(block, blocks[1], block, blocks[2], block, -1).mean(axis=(0, 2, 4))
        values[i + EMPTY_AROUND, EMPTY_AROUND:-EMPTY_AROUND, EMPTY_AROUND:-EMPTY_AROUND] = means
    corner = low - 0.5 - EMPTY_AROUND * block
    scale = 1 / (np.array(values.shape[:3]) * block)
    from_voxels = np.diag([*scale, 1.0])
    from_voxels[:3, 3] = -corner * scale
    return VoxelGrid(values, (from_voxels @ np.linalg.inv(matrix))[:3])


# ------------------------------------------------------------------------------------------------ smoke


def smoke_domain(b_object: bpy.types.Object) -> Any:
    """Settings of the smoke that an object is filled with, which has a surface no more; None: of any other."""
    for b_modifier in b_object.modifiers:
        is_domain = b_modifier.type == "FLUID" and b_modifier.fluid_type == "DOMAIN" and b_modifier.show_render
        if is_domain and b_modifier.domain_settings.domain_type == "GAS":
            return b_modifier.domain_settings
    return None


def smoke_grids(b_object: bpy.types.Object, b_domain: Any) -> Grids | None:
    """Those of a domain's smoke in this frame; None: there is no smoke yet.

    As EEVEE knows them: density, colour with the density divided out, flame, and the flame's temperature.
    """
    size = np.array(b_domain.domain_resolution, np.int64)
    density = _array(b_domain.density_grid)
    if len(density) == 0 or (size <= 0).any():
        return None
    if len(density) != np.prod(size):  # of the finer noise
        size = size * max(int(b_domain.noise_scale), 1)
    if len(density) != np.prod(size):
        return None
    found: dict[str, Float32] = {"density": _along(density, size, 1)}
    flame = _array(b_domain.flame_grid)
    if len(flame) == len(density):
        found["flame"] = _along(flame, size, 1)
        cold, hot = b_domain.flame_ignition, b_domain.flame_max_temp
        warm = found["flame"] * np.float32(hot - cold) + np.float32(cold)
        found["temperature"] = np.where(found["flame"] > LEAST_FLAME, warm, 0).astype(np.float32)
    rgba = _array(b_domain.color_grid)
    if len(rgba) == 4 * len(density):
        color = _along(rgba, size, 4)
        weight = color[..., 3:]
        found["color"] = np.asarray(color[..., :3] / np.where(weight > 0, weight, 1), np.float32)
    vertices = np.array([tuple(corner) for corner in b_object.bound_box], np.float64)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    grids = Grids({name: values.shape[3] for name, values in found.items()}, low, high, lambda names: {})
    voxels = {name: VoxelGrid(values, grids.to_generated) for name, values in found.items()}
    return Grids(grids.widths, low, high, lambda names: {name: voxels[name] for name in names})


def _array(b_array: Any) -> Float32:
    found = np.empty(len(b_array), np.float32)
    if len(found):
        b_array.foreach_get(found)
    return found


def _along(values: Float32, size: Any, width: int) -> Float32:
    """(nx, ny, nz, width) of voxels of which x runs fastest."""
    return np.ascontiguousarray(values.reshape(size[2], size[1], size[0], width).transpose(2, 1, 0, 3))
