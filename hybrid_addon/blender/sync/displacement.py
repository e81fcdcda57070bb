# SPDX-License-Identifier: GPL-3.0-or-later
"""Displacement by nodes: vertices moved along a vector, normals bent by how it grows, as EEVEE has both.

EEVEE works the vector out at each corner of a face, in world space, and moves it there, unless the material's
*Displacement* is *Bump Only*. Whatever that says, the shading normal stays the undisplaced mesh's, bent by the vector's
part along it, pixel by pixel (eevee_nodetree_lib.glsl, `displacement_bump`); all nodes that read the normal have that
one. Formulas of the nodes: gpu_shader_material_displacement.glsl, gpu_shader_material_vector_displacement.glsl.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import expressions as ex
from ...scene import Expression, Float32, Float64, Int32, Surface, Texture, TriangleMesh, Value
from .nodes import Node
from .object_values import MATRICES
from .texture import FrameFacts, NodeReader
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


def displacement_of(output: Node, reader: NodeReader) -> Any:
    """The vector in world space by which a material moves its surface, an expression; None: it does not.

    output : the material's active output.
    """
    if output.input("Displacement").node() is None:
        return None
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


Sampler = Callable[[Texture, NDArray[Any], NDArray[Any]], Float32]
"""RGBA (4, n) of a texture at u, v (n,). The tracer does it, which this room knows not."""


@dataclass(frozen=True, eq=False)
class Place:
    """Where a mesh is displaced, and what its material may ask there.

    matrix : (4, 4) float64 object to world.   values : of the instance (scene.Instance.values).
    sample : looks up images; None: there are none.
    """

    matrix: Float64
    frame: FrameFacts
    values: Mapping[str, tuple[float, ...]]
    sample: Sampler | None

    def of_instance(self, key: str) -> tuple[float, ...]:
        """What the instance has of this key (expressions.INSTANCE), 0 where it has none; matrices row by row."""
        if key in MATRICES:
            matrix = self.matrix if key == "OBJECT_TO_WORLD" else np.linalg.pinv(self.matrix)
            return tuple(matrix[:3].ravel().tolist())
        return self.values.get(key, (0.0,) * 4)


def displaced(
    mesh: TriangleMesh, corner_normals: Float32, moves: Sequence[Any], reads: frozenset[str], place: Place
) -> TriangleMesh:
    """A mesh as it is at one place in the world: moved, with the data that the bent normals read.

    corner_normals : (nc, 3) float32, local, of the mesh before it moves; they stay its shading normals.
    moves  : of each surface slot the vector that moves it, None where it stays.
    reads  : the keys of the data that its surfaces read.
    """
    matrix, linear = place.matrix, place.matrix[:3, :3]
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
    corners = _Corners(mesh, mesh.vertices[vertex] @ linear.T + matrix[:3, 3], outward, place)
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


class _Corners:
    """The corners of a mesh, as expressions ask of them (expressions.Hits) and as EEVEE's vertex shader answers.

    It shapes what the camera sees for the camera: the ray is the camera's, the eye its place.
    """

    def __init__(self, mesh: TriangleMesh, point: NDArray[Any], normal: Float64, place: Place) -> None:
        """point, normal: (nc, 3) in world space."""
        self._mesh, self._point, self._normal, self._place = mesh, point, normal, place

    def image(self, texture: Texture, uv: NDArray[Any] | None) -> Float32:
        """RGBA (4, nc)."""
        u, v = (self.attribute("uv:" + texture.uv_map) if uv is None else uv)[:2].astype(np.float64)
        if self._place.sample is None:
            raise TypeError("nobody who translates a scene with displaced images has said what looks them up: sample=")
        return self._place.sample(texture, u, v)

    def attribute(self, key: str) -> Float32:
        """(width, nc) float32."""
        n = len(self._point)
        kind, _, of = key.partition(":")
        if kind == "uv":
            uv = self._mesh.uv_maps.get(of, self._mesh.uv_maps.get("", np.zeros((n, 2), np.float32)))
            return np.concatenate([uv.T, np.zeros((1, n), np.float32)])
        if kind == "instance":
            value = np.array(self._place.of_instance(of), np.float32)
            return np.broadcast_to(value[:, None], (len(value), n))
        if kind == "ray":
            return self._of_ray(of)[None]
        if key in ("normal", "interpolated_normal", "true_normal"):
            return self._normal.T.astype(np.float32)
        if key == "position":
            return self._point.T.astype(np.float32)
        if key == "incoming":
            return self._incoming.T.astype(np.float32)
        if key == "cosine":
            return (self._normal * self._incoming).sum(axis=1).astype(np.float32)[None]
        if key == "backfacing":
            return np.zeros((1, n), np.float32)
        width = ex.ATTRIBUTE_WIDTHS[kind]
        found = self._mesh.attributes.get(key)
        return np.zeros((width, n), np.float32) if found is None else found.T

    def raycast(self, _position: Any, _direction: Any, length: Any, _only_local: bool) -> NDArray[Any]:
        """Nothing is hit: there is no scene yet."""
        return np.concatenate([np.zeros((2, 1)), np.atleast_2d(length)[:, :1], np.zeros((6, 1))])

    def gradient(self, value: Callable[[Any], NDArray[Any]], _on_facet: bool = False) -> Float32:
        """(3, nc): none, as in EEVEE's vertex shader."""
        return np.zeros((3, len(self._point)), np.float32)

    @property
    def _incoming(self) -> Float64:
        """(nc, 3) unit directions to the camera."""
        camera = self._place.frame.camera
        if self._place.frame.parallel:
            return np.broadcast_to(_unit(camera[None, :3, 2]), self._point.shape)
        return _unit(camera[:3, 3] - self._point)

    def _of_ray(self, output: str) -> Float32:
        """(nc,) what Light Path's outputs are for camera rays (`init_globals` in eevee_nodetree_lib.glsl)."""
        if output == "Ray Length":
            return np.linalg.norm(self._place.frame.camera[:3, 3] - self._point, axis=1).astype(np.float32)
        return np.full(len(self._point), output == "Is Camera Ray", np.float32)
