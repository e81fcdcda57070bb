# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes, their instances, and analytic shapes. Conventions: see the package."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from .numbers import Float32, Float64, Int32


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Triangles in local space; shared by its instances.

    vertices         : (nv, 3) float32.
    triangles        : (nt, 3) int32, vertex index of each corner.
    corners          : (nt, 3) int32, index of each corner into `normals` and `uv_maps`.
    normals          : (nc, 3) float32 shading normals, or None: flat shaded throughout.
    uv_maps          : name -> (nc, 2) float32; "" is the map active for rendering.
    surface_slots    : (nt,) int32, which of the instance's surfaces each triangle wears.
    attributes       : other data of the corners, key -> (nc, width) float32. "color:NAME" (4), "generated" (3, 0..1
                       over the bounds), "object" (3, local position), "object_normal" (3, local), "around:Z" (4, local
                       direction around that axis, and 0), "tangent:UV MAP" (4, local direction and the sign of the
                       bitangent), "strand" (4, of hair: share of the way from root to tip, metres of it, metres of its
                       thickness there, a random number of the strand).
    """

    name: str
    vertices: Float32
    triangles: Int32
    corners: Int32
    normals: Float32 | None = None
    uv_maps: Mapping[str, Float32] = field(default_factory=dict)
    surface_slots: Int32 | None = None
    attributes: Mapping[str, Float32] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Visibility:
    """Which rays an object exists for: camera rays, shadow rays, all others (reflected and refracted), and those that
    nodes ask for (Raycast)."""

    camera: bool = True
    shadow: bool = True
    secondary: bool = True
    raycast: bool = True


@dataclass(frozen=True, eq=False)
class Instance:
    """One appearance of a mesh in the world.

    mesh, surfaces : indices into `Scene.meshes` and `Scene.surfaces` (one for each slot).
    matrix_world   : (4, 4) float64; mirrored, sheared and singular matrices are allowed.
    ray_traced     : ray traced by the artist; else what wears a surface that is. In hybrid mode camera rays see only
                     what is ray traced.
    moves          : it is likely to be elsewhere in the next frame: a hint, by which search trees are divided.
    values         : what its surfaces read of it, key -> up to 4 numbers: "location", "color", "random", "object:NAME",
                     ... (expressions.INSTANCE). Its matrices need not be there.
    """

    name: str
    mesh: int
    matrix_world: Float64
    surfaces: tuple[int, ...]
    ray_traced: bool = False
    visibility: Visibility = Visibility()
    moves: bool = False
    values: Mapping[str, tuple[float, ...]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Sphere:
    """An analytic sphere: exact normals, no tessellation."""

    name: str
    center: tuple[float, float, float]
    radius: float
    surface: int
    ray_traced: bool = False
    visibility: Visibility = Visibility()


@dataclass(frozen=True, eq=False)
class Plane:
    """An analytic, unbounded plane through `point`; `normal` (any length) is its outer side."""

    name: str
    point: tuple[float, float, float]
    normal: tuple[float, float, float]
    surface: int
    ray_traced: bool = False
    visibility: Visibility = Visibility()
