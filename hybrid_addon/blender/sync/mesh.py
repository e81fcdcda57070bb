# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated Blender meshes -> scene.TriangleMesh, array by array (`foreach_get`), never element by element."""

from __future__ import annotations

from collections.abc import Iterable

import bpy
import numpy as np

from ...scene import Float32, Int32, TriangleMesh
from .attributes import Scratch, attributes_of, uv_layer
from .messages import Warnings


def translate_mesh(
    b_mesh: bpy.types.Mesh, name: str, keys: Iterable[str], warn: Warnings, scratch: Scratch
) -> TriangleMesh | None:
    """The mesh as triangles, or None if it has no face.

    keys    : data of corners (scene.TriangleMesh), such as "uv:Map", "color:Col"; "uv:" = active for rendering.
    scratch : gives a mesh like this one that may be spoilt, this one itself if need be.
    Vertices that are not finite are kept (the tracer drops their triangles) and reported by `name`, the object's.
    """
    b_mesh.calc_loop_triangles()
    if not len(b_mesh.loop_triangles):
        return None
    vertices, corners = _vertices(b_mesh), _corners(b_mesh)
    _warn_of_broken(vertices, name, warn)
    wanted = sorted(keys)
    uv_names = [key.removeprefix("uv:") for key in wanted if key.startswith("uv:")]
    rest = [key for key in wanted if not key.startswith("uv:")]
    return TriangleMesh(
        name=b_mesh.name,
        vertices=vertices,
        triangles=_vertex_of_corner(b_mesh)[corners],
        corners=corners,
        normals=_corner_normals(b_mesh),
        uv_maps={uv_name: _uv_map(b_mesh, uv_name, name, warn) for uv_name in uv_names},
        surface_slots=_surface_slots(b_mesh),
        attributes=attributes_of(b_mesh, rest, name, warn, scratch),
    )


def _vertices(b_mesh: bpy.types.Mesh) -> Float32:
    """(nv, 3) float32, local space."""
    values = np.zeros(3 * len(b_mesh.vertices), np.float32)
    b_mesh.attributes["position"].data.foreach_get("vector", values)
    return values.reshape(-1, 3)


def _corners(b_mesh: bpy.types.Mesh) -> Int32:
    """(nt, 3) int32: the three corners ("loops") of each triangle."""
    values = np.zeros(3 * len(b_mesh.loop_triangles), np.int32)
    b_mesh.loop_triangles.foreach_get("loops", values)
    return values.reshape(-1, 3)


def _vertex_of_corner(b_mesh: bpy.types.Mesh) -> Int32:
    """(nc,) int32."""
    values = np.zeros(len(b_mesh.loops), np.int32)
    b_mesh.loops.foreach_get("vertex_index", values)
    return values


def _corner_normals(b_mesh: bpy.types.Mesh) -> Float32 | None:
    """(nc, 3) float32 with sharp edges and custom normals applied; None where every face is flat shaded."""
    return None if b_mesh.normals_domain == "FACE" else corner_normals(b_mesh)


def corner_normals(b_mesh: bpy.types.Mesh) -> Float32:
    """(nc, 3) float32, those of the face where it is flat."""
    values = np.zeros(3 * len(b_mesh.loops), np.float32)
    b_mesh.corner_normals.foreach_get("vector", values)
    return values.reshape(-1, 3)


def _uv_map(b_mesh: bpy.types.Mesh, uv_name: str, name: str, warn: Warnings) -> Float32:
    """(nc, 2) float32; zeros where the mesh has no such map, which is what Blender's shaders read there."""
    values = np.zeros(2 * len(b_mesh.loops), np.float32)
    b_layer = uv_layer(b_mesh, uv_name)
    if b_layer is None:
        wanted = f"no UV map {uv_name!r}" if uv_name else "no UV map"
        warn.add(f"object {name!r} has {wanted} for its texture, which is one colour all over")
    else:
        b_layer.uv.foreach_get("vector", values)
    return values.reshape(-1, 2)


def _surface_slots(b_mesh: bpy.types.Mesh) -> Int32 | None:
    """(nt,) int32 material slot of each triangle; None where all wear the first, as EEVEE's do that have none (-1)."""
    of_face = np.zeros(len(b_mesh.polygons), np.int32)
    b_mesh.polygons.foreach_get("material_index", of_face)
    np.maximum(of_face, 0, out=of_face)
    if not of_face.any():
        return None
    face_of_triangle = np.zeros(len(b_mesh.loop_triangles), np.int32)
    b_mesh.loop_triangle_polygons.foreach_get("value", face_of_triangle)
    return of_face[face_of_triangle]


def _warn_of_broken(vertices: Float32, name: str, warn: Warnings) -> None:
    broken = int(np.count_nonzero(~np.isfinite(vertices).all(axis=1)))
    if broken:
        warn.add(f"object {name!r}: {broken} of {len(vertices)} vertices are not finite; their triangles are left out")
