# SPDX-License-Identifier: GPL-3.0-or-later
"""Data of a mesh's corners that materials read, by key (scene.TriangleMesh): colours, coordinates, tangents."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import bmesh
import bpy
import numpy as np

from ...scene import Float32, Float64, Int32
from .messages import Warnings

FIELDS = {  # of an attribute's data type: the property to read, and its numbers
    "FLOAT": ("value", 1), "INT": ("value", 1), "BOOLEAN": ("value", 1), "INT8": ("value", 1),
    "FLOAT_VECTOR": ("vector", 3), "FLOAT2": ("vector", 2), "FLOAT_COLOR": ("color", 4), "BYTE_COLOR": ("color", 4),
}  # fmt: skip


TANGENT_CORNERS = 4  # of the largest faces for which Blender works out tangents
CORNER = "hybrid_corner"  # attribute of a scratch mesh: which corner of the mesh each was

Scratch = Callable[[], bpy.types.Mesh]


def attributes_of(
    b_mesh: bpy.types.Mesh, keys: Iterable[str], name: str, warn: Warnings, scratch: Scratch
) -> dict[str, Float32]:
    """(nc, width) float32 by key: "color:NAME", "generated", "object", "object_normal", "around:Z" or "tangent:UV MAP".

    name    : the object's.
    scratch : gives a mesh like this one that may be spoilt, this one itself if need be; asked for last.
    """
    wanted = sorted(keys)
    tangents = [key for key in wanted if key.startswith("tangent:")]
    found = {key: _plain(b_mesh, key, name, warn) for key in wanted if key not in tangents}
    return found | _tangents(b_mesh, tangents, name, warn, scratch)


def _plain(b_mesh: bpy.types.Mesh, key: str, name: str, warn: Warnings) -> Float32:
    kind, _, of = key.partition(":")
    if kind == "color":
        return _color(b_mesh, of, name, warn)
    if kind == "strand":  # of hair alone
        return np.zeros((len(b_mesh.loops), 4), np.float32)
    if kind == "object_normal":
        normals = np.zeros((len(b_mesh.loops), 3), np.float32)
        b_mesh.corner_normals.foreach_get("vector", normals.reshape(-1))
        return normals
    if kind == "around":
        return _around(b_mesh)
    of_vertices = _generated(b_mesh) if kind == "generated" else _of_vertices(b_mesh, "position", "vector", 3)
    return of_vertices[_vertex_of_corner(b_mesh)]


def _generated(b_mesh: bpy.types.Mesh) -> Float32:
    """(nv, 3), 0..1 over the mesh's texture space, before modifiers deformed it; 0.5 along an axis without extent."""
    values = np.zeros(3 * len(b_mesh.vertices), np.float32)
    b_mesh.vertices.foreach_get("undeformed_co", values)
    return generated_of(b_mesh, values.reshape(-1, 3))


def generated_of(b_mesh: bpy.types.Mesh, points: Float32) -> Float32:
    """(n, 3) generated coordinates of local points (n, 3): where they lie in the mesh's texture space."""
    middle, half = (np.array(v, np.float32) for v in (b_mesh.texspace_location, b_mesh.texspace_size))
    return (points - middle) / (2 * np.where(half != 0, half, np.float32(1))) + np.float32(0.5)


def texture_space(b_mesh: bpy.types.Mesh) -> Float64:
    """(3, 4), the same as a matrix for local positions."""
    middle, half = (np.array(v, np.float64) for v in (b_mesh.texspace_location, b_mesh.texspace_size))
    scale = 0.5 / np.where(half != 0, half, 1.0)
    return np.concatenate([np.diag(scale), (0.5 - middle * scale)[:, None]], axis=1)


def _around(b_mesh: bpy.types.Mesh) -> Float32:
    """(nc, 4), the direction around the local Z axis through the middle of the mesh's texture space, and 0: how
    Blender's brushed metals run where no tangent is given (Cycles, primitive_tangent)."""
    x, y = (_generated(b_mesh)[_vertex_of_corner(b_mesh)].T - np.float32(0.5))[:2]
    return np.stack([-y, x, np.zeros_like(x), np.zeros_like(x)], axis=1)


def uv_layer(b_mesh: bpy.types.Mesh, uv_name: str) -> bpy.types.MeshUVLoopLayer | None:
    """The UV map of that name; for "" the one that is active for rendering."""
    if uv_name:
        return b_mesh.uv_layers.get(uv_name)
    return next((b_layer for b_layer in b_mesh.uv_layers if b_layer.active_render), None)


def _color(b_mesh: bpy.types.Mesh, of: str, name: str, warn: Warnings) -> Float32:
    """(nc, 4) of any attribute, as shaders read it: grey for one number, alpha 1 where there is none."""
    result = np.zeros((len(b_mesh.loops), 4), np.float32)
    of = of or (b_mesh.color_attributes[b_mesh.color_attributes.render_color_index].name if _has_color(b_mesh) else "")
    b_attribute = b_mesh.attributes.get(of) if of else None
    if b_attribute is None or b_attribute.data_type not in FIELDS:
        warn.add(f"object {name!r} has no attribute {of!r} for its material, which is black there")
        return result
    field, width = FIELDS[b_attribute.data_type]
    values = np.zeros(width * len(b_attribute.data), np.float32)
    b_attribute.data.foreach_get(field, values)
    rows = _on_corners(b_mesh, values.reshape(-1, width), b_attribute.domain)
    result[:, 3] = 1
    result[:, :3] = rows if width == 1 else 0
    result[:, :width] = rows if width > 1 else result[:, :1]
    return result


def _has_color(b_mesh: bpy.types.Mesh) -> bool:
    return 0 <= b_mesh.color_attributes.render_color_index < len(b_mesh.color_attributes)


def _on_corners(b_mesh: bpy.types.Mesh, rows: Float32, domain: str) -> Float32:
    if domain == "POINT":
        return rows[_vertex_of_corner(b_mesh)]
    if domain == "FACE":
        sizes = np.zeros(len(b_mesh.polygons), np.int32)
        b_mesh.polygons.foreach_get("loop_total", sizes)
        return np.repeat(rows, sizes, axis=0)
    if domain == "EDGE":
        return _of_edges(b_mesh, rows)
    return rows if domain == "CORNER" else np.zeros((len(b_mesh.loops), rows.shape[1]), np.float32)


def _of_edges(b_mesh: bpy.types.Mesh, rows: Float32) -> Float32:
    """(nc, width): a corner has what the edge has that leaves it around the face, as EEVEE's buffers do."""
    edge = np.zeros(len(b_mesh.loops), np.int32)
    b_mesh.loops.foreach_get("edge_index", edge)
    return rows[edge]


def _of_vertices(b_mesh: bpy.types.Mesh, attribute: str, field: str, width: int) -> Float32:
    values = np.zeros(width * len(b_mesh.vertices), np.float32)
    b_mesh.attributes[attribute].data.foreach_get(field, values)
    return values.reshape(-1, width)


def _vertex_of_corner(b_mesh: bpy.types.Mesh) -> Int32:
    values = np.zeros(len(b_mesh.loops), np.int32)
    b_mesh.loops.foreach_get("vertex_index", values)
    return values


def _tangents(
    b_mesh: bpy.types.Mesh, keys: list[str], name: str, warn: Warnings, scratch: Scratch
) -> dict[str, Float32]:
    """(nc, 4) MikkTSpace tangents and the sign of the bitangent; zeros (no normal map) without UV map."""
    count = len(b_mesh.loops)
    found = {key: np.zeros((count, 4), np.float32) for key in keys}
    layers: dict[str, str] = {}
    for key in keys:
        of = key.partition(":")[2]
        b_layer = uv_layer(b_mesh, of)
        if b_layer is None:
            wanted = f"no UV map {of!r}" if of else "no UV map"
            warn.add(f"object {name!r} has {wanted} for its normal map, which is left out")
        else:
            layers[key] = b_layer.name
    if not layers:
        return found
    b_mesh, corner = _without_ngons(b_mesh, scratch)
    tangent, sign = np.zeros((len(b_mesh.loops), 3), np.float32), np.zeros(len(b_mesh.loops), np.float32)
    for key, uv_name in layers.items():
        b_mesh.calc_tangents(uvmap=uv_name)
        b_mesh.loops.foreach_get("tangent", tangent.reshape(-1))
        b_mesh.loops.foreach_get("bitangent_sign", sign)
        b_mesh.free_tangents()
        found[key][corner, :3], found[key][corner, 3] = tangent, sign
    return found


def _without_ngons(b_mesh: bpy.types.Mesh, scratch: Scratch) -> tuple[bpy.types.Mesh, Int32 | slice]:
    """A mesh whose faces have at most TANGENT_CORNERS corners, and which corner of `b_mesh` each of its corners was.

    Blender works out tangents of triangles and quads alone; EEVEE's are those of the triangles that it cuts other
    faces into. What triangles of one face meet at a corner agree there: they have its normal and texture coordinate.
    """
    sizes = np.zeros(len(b_mesh.polygons), np.int32)
    b_mesh.polygons.foreach_get("loop_total", sizes)
    if np.max(sizes, initial=0) <= TANGENT_CORNERS:
        return b_mesh, slice(None)
    b_cut = scratch()
    b_cut.attributes.new(CORNER, "INT", "CORNER").data.foreach_set("value", np.arange(len(b_cut.loops), dtype=np.int32))
    b_edit = bmesh.new()
    try:
        b_edit.from_mesh(b_cut)
        b_edit.faces.ensure_lookup_table()
        large = [b_edit.faces[i] for i in np.flatnonzero(sizes > TANGENT_CORNERS).tolist()]
        bmesh.ops.triangulate(b_edit, faces=large, ngon_method="EAR_CLIP")
        b_edit.to_mesh(b_cut)
    finally:
        b_edit.free()
    corner = np.zeros(len(b_cut.loops), np.int32)
    b_cut.attributes[CORNER].data.foreach_get("value", corner)
    return b_cut, corner
