# SPDX-License-Identifier: GPL-3.0-or-later
"""Displacement by nodes: vertices moved along a vector, normals bent by how it grows, as EEVEE has both.

EEVEE works the vector out at each corner of a face, in world space, and moves it there, unless the material's
*Displacement* is *Bump Only*. Whatever that says, the shading normal stays the undisplaced mesh's, bent by the vector's
part along it, pixel by pixel (eevee_nodetree_lib.glsl, `displacement_bump`); all nodes that read the normal have that
one. Formulas of the nodes: gpu_shader_material_displacement.glsl, gpu_shader_material_vector_displacement.glsl.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import expressions as ex
from ...scene import Expression, Float32, Float64, Int32, Surface, Texture, TriangleMesh, Value
from .image import Images
from .messages import Warnings
from .nodes import Node, active_output, uses_nodes
from .texture import NodeReader
from .values import NODES, NORMAL, color, number, value_of, vector

ALONG = "object_normal:scaled"
"""Data of a mesh's corners: how far, in world space, a step of 1 along the normal in object space leads."""

AXES = tuple(f"object_normal:axis_{axis}" for axis in "xyz")
"""Likewise a step of 1 along each of the object's axes."""

FRAME = ("object_normal:tangent", ALONG, "object_normal:bitangent")
"""Likewise along the tangent of the UV map, the normal and the bitangent: Vector Displacement's order."""

TANGENT = "tangent:"
"""Of the UV map that is active for rendering."""

WORLDLY = frozenset((*FRAME, *AXES))
"""What depends on a mesh's place in the world."""

SAME = 1e-5
"""Corners of a vertex that move apart by less than this share of the mesh's size stay one vertex: rounding, not a
seam. A closed body then stays closed."""


# ------------------------------------------------------------------------------------------------ nodes to values


def displacement_of(b_material: bpy.types.Material, images: Images, warn: Warnings) -> Any:
    """The vector in world space by which a material moves its surface, an expression; None: it does not."""
    output = active_output(b_material.node_tree) if uses_nodes(b_material) else None
    if output is None or output.input("Displacement").node() is None:
        return None
    reader = NodeReader(f"material {b_material.name!r}", images, warn)
    value = ex.as_color(value_of(reader, output.input("Displacement"), "VECTOR"))
    return None if value == (0.0, 0.0, 0.0) else value


def _displacement(node: Node, output: str, reader: NodeReader) -> Value:
    """Node Displacement."""
    height = ex.apply("subtract", number(reader, node, "Height"), number(reader, node, "Midlevel"))
    size = ex.times(height, number(reader, node, "Scale"))
    own = node.input("Normal").node() is not None
    direction = vector(reader, node, "Normal") if own else NORMAL
    if node.b_node.space == "OBJECT":
        if own:
            reader.give_up(f"node {node.name!r}: its Normal is not followed in object space; the surface's own is used")
        return ex.times(size, Expression("attribute", (), ALONG))
    return ex.times(size, ex.apply("normalize", direction))


def _vector_displacement(node: Node, output: str, reader: NodeReader) -> Value:
    """Node Vector Displacement."""
    moved = ex.apply("subtract", color(reader, node, "Vector"), number(reader, node, "Midlevel"))
    moved = ex.times(moved, number(reader, node, "Scale"))
    if node.b_node.space == "WORLD":
        return ex.as_color(moved)
    total: Any = (0.0, 0.0, 0.0)
    for axis, key in enumerate(AXES if node.b_node.space == "OBJECT" else FRAME):
        part = ex.times(ex.apply("channel", moved, data=axis), Expression("attribute", (), key))
        total = ex.apply("add", total, part)
    return total


NODES.update({"ShaderNodeDisplacement": _displacement, "ShaderNodeVectorDisplacement": _vector_displacement})


def bent(surface: Surface, moved: Any) -> Surface:
    """`surface` with its normal, and the one that its nodes read, bent by a displacement."""
    if moved is None:
        return surface
    slope = Expression("slope", (ex.apply("dot", moved, NORMAL),), True)
    normal = ex.apply("bump", slope, 1.0, 1.0, NORMAL)
    if surface.normal is None:
        return replace(surface, normal=normal)
    return replace(surface, normal=_with_normal(surface.normal, normal, {}))


def _with_normal(value: Any, normal: Expression, known: dict[int, Any]) -> Any:
    """An expression that reads `normal` wherever it reads the surface's."""
    if not isinstance(value, Expression):
        return value
    if id(value) not in known:
        reads_normal = value.operation == "attribute" and value.data in ("normal", "interpolated_normal")
        inputs = tuple(_with_normal(part, normal, known) for part in value.inputs)
        known[id(value)] = normal if reads_normal else replace(value, inputs=inputs)
    return known[id(value)]


# ------------------------------------------------------------------------------------------------ meshes


def keys_of_mesh(reads: frozenset[str]) -> frozenset[str]:
    """What a mesh must tell so that `displaced` can add the rest of what is read."""
    return (reads - WORLDLY) | (frozenset() if reads.isdisjoint(FRAME[::2]) else {TANGENT})


def displaced(
    mesh: TriangleMesh, corner_normals: Float32, moves: Sequence[Any], reads: frozenset[str], matrix: Float64
) -> TriangleMesh:
    """A mesh as it is at one place in the world: moved, with the data that the bent normals read.

    corner_normals : (nc, 3) float32, local, of the mesh before it moves; they stay its shading normals.
    moves  : of each surface slot the vector that moves it, None where it stays.
    reads  : the keys of the data that its surfaces read.
    matrix : (4, 4) float64 object to world.
    """
    linear = matrix[:3, :3]
    to_object = np.linalg.pinv(linear)
    outward = _unit(corner_normals.astype(np.float64) @ to_object)  # world; normals go through the inverse transpose
    extra = {ALONG: (_unit(outward @ linear) @ linear.T).astype(np.float32)} if ALONG in reads else {}
    if not reads.isdisjoint(FRAME[::2]):
        given = mesh.attributes[TANGENT].astype(np.float64)
        local = _unit(given[:, :3])
        across = given[:, 3:] * _unit(np.cross(_unit(outward @ linear), local))
        extra |= {FRAME[0]: (local @ linear.T).astype(np.float32), FRAME[2]: (across @ linear.T).astype(np.float32)}
    for axis, key in enumerate(AXES):
        if key in reads:
            extra[key] = np.broadcast_to(linear[:, axis].astype(np.float32), corner_normals.shape).copy()
    mesh = replace(mesh, normals=corner_normals, attributes={**mesh.attributes, **extra})
    if all(moved is None for moved in moves):
        return mesh
    vertex = np.zeros(len(corner_normals), np.int32)
    vertex[mesh.corners.reshape(-1)] = mesh.triangles.reshape(-1)
    corners = _Corners(mesh, mesh.vertices[vertex] @ linear.T + matrix[:3, 3], outward)
    offset = np.zeros((len(vertex), 3))
    slots = np.zeros(len(mesh.triangles), np.int32) if mesh.surface_slots is None else mesh.surface_slots
    for slot, moved in enumerate(moves):
        if moved is not None:
            worn = np.unique(mesh.corners[np.minimum(slots, len(moves) - 1) == slot])
            found = np.broadcast_to(ex.Evaluation(corners)(moved).astype(np.float64), (3, len(vertex)))
            offset[worn] = np.nan_to_num(found.T[worn]) @ to_object.T
    vertices, triangles = _joined(mesh.vertices, vertex, offset.astype(np.float32), mesh.corners)
    attributes = dict(mesh.attributes)
    if "object" in attributes:
        attributes["object"] = attributes["object"] + offset.astype(np.float32)
    return replace(mesh, vertices=vertices, triangles=triangles, attributes=attributes)


def _joined(vertices: Float32, vertex: Int32, offset: Float32, corners: Int32) -> tuple[Float32, Int32]:
    """Vertices and triangles after each corner has moved: vertices whose corners part become several."""
    used = np.unique(corners)
    first = np.zeros(len(vertices), np.int32)
    first[vertex[used]] = used
    apart = np.abs(offset - offset[first[vertex]]).max(axis=1)
    torn = np.zeros(len(vertices), bool)
    torn[vertex[used[apart[used] > SAME * np.max(np.ptp(vertices, axis=0), initial=0)]]] = True
    moved = vertices.copy()
    moved[vertex[used]] += offset[first[vertex[used]]]
    own = np.flatnonzero(torn[vertex])
    number = vertex.copy()
    number[own] = len(vertices) + np.arange(len(own), dtype=np.int32)
    return np.concatenate([moved, vertices[vertex[own]] + offset[own]]), number[corners].astype(np.int32)


def _unit(v: Float64) -> Float64:
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return np.asarray(v / np.where(length > 0, length, 1))


Sampler = Callable[[Texture, NDArray[Any], NDArray[Any]], Float32]

_samplers: list[Sampler] = []


def use_sampler(sample: Sampler) -> None:
    """Look images up by this: RGBA (4, n) of a texture at u, v (n,). The tracer does it, which this room knows not."""
    _samplers[:] = [sample]


class _Corners:
    """The corners of a mesh, as expressions ask of them (expressions.Hits)."""

    def __init__(self, mesh: TriangleMesh, place: NDArray[Any], normal: Float64) -> None:
        """place, normal: (nc, 3) in world space."""
        self._mesh, self._place, self._normal = mesh, place, normal

    def image(self, texture: Texture, uv: NDArray[Any] | None) -> Float32:
        """RGBA (4, nc)."""
        u, v = (self.attribute("uv:" + texture.uv_map) if uv is None else uv)[:2].astype(np.float64)
        return _samplers[-1](texture, u, v)

    def attribute(self, key: str) -> Float32:
        """(width, nc) float32."""
        n = len(self._place)
        if key.startswith("uv:"):
            maps = self._mesh.uv_maps
            uv = maps.get(key.removeprefix("uv:"), maps.get("", np.zeros((n, 2), np.float32)))
            return np.concatenate([uv.T, np.zeros((1, n), np.float32)])
        if key in ("normal", "interpolated_normal", "true_normal", "incoming"):
            return self._normal.T.astype(np.float32)
        if key == "position":
            return self._place.T.astype(np.float32)
        if key in ("cosine", "backfacing"):
            return np.full((1, n), key == "cosine", np.float32)
        width = ex.ATTRIBUTE_WIDTHS[key.partition(":")[0]]
        found = self._mesh.attributes.get(key)
        return np.zeros((width, n), np.float32) if found is None else found.T

    def gradient(self, value: Callable[[Any], NDArray[Any]], _on_facet: bool = False) -> Float32:
        """(3, nc): none, as in EEVEE's vertex shader."""
        return np.zeros((3, len(self._place)), np.float32)
