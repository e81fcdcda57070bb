# SPDX-License-Identifier: GPL-3.0-or-later
"""Image Texture and Mapping nodes -> scene.Texture and matrices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

from ...scene import RGB, Float64, Texels, Texture
from ..view_layers import source_layer
from .image import MISSING, Images
from .messages import Warnings
from .nodes import Node


@dataclass(frozen=True, eq=False)
class FrameFacts:
    """What nodes may ask of more than their own datablock.

    camera        : (4, 4) float64, its matrix in the world, without scale.
    parallel      : it is orthographic: it sees everything from one direction.
    b_owners      : whose properties are the View Layer's attributes: its own, then the scene's, then the world's.
    working_space : of the file, as Blender names it.
    """

    camera: Float64 = field(default_factory=lambda: np.eye(4))
    parallel: bool = False
    b_owners: tuple[bpy.types.bpy_struct, ...] = ()
    working_space: str = "Linear Rec.709"


def facts_of(
    b_scene: bpy.types.Scene, camera: Float64, parallel: bool = False, b_depsgraph: bpy.types.Depsgraph | None = None
) -> FrameFacts:
    """Those of a frame of this scene. camera, parallel: see `FrameFacts`.

    b_depsgraph : of a render, in which the world's own properties are animated. Blender hands the scene's and the
                  layer's back to what is evaluated; None: as everything stands.
    """
    space = bpy.data.colorspace.working_space if hasattr(bpy.data, "colorspace") else "Linear Rec.709"
    b_world = b_scene.world
    if b_world is not None and b_depsgraph is not None:
        b_world = b_world.evaluated_get(b_depsgraph)
    b_owners = (source_layer(b_scene), b_scene, b_world)
    return FrameFacts(camera, parallel, tuple(filter(None, b_owners)), space)


class NodeReader:
    """Reads constants and textures from nodes, and warns of whatever it cannot follow.

    owner : how warnings name the tree, such as "material 'Glass'".
    approximate : something could not be followed: EEVEE draws more than the translated surface knows.
    camera      : of a world, whether camera rays see it, or those that light and are mirrored; None: a surface.
    unseen      : of a world, the colour where a sky cannot be drawn.
    light_path  : a world's Light Path node was asked, so that the two may differ.
    frame       : what the nodes may ask of the camera and of the view layer.   material_index : the artist's own.
    grids       : while a volume is read, by name how many numbers the grids of its object have; None: a surface is.
    """

    def __init__(
        self, owner: str, images: Images, warn: Warnings, frame: FrameFacts, camera: bool | None = None
    ) -> None:
        self.owner = owner
        self.images = images
        self._warn = warn
        self.values: dict[Any, Any] = {}  # of nodes' outputs, for `values`
        self.nested = 0
        self.approximate = self.light_path = False
        self.camera = camera
        self.unseen: RGB | None = None
        self.frame = frame
        self.material_index = 0
        self.grids: Mapping[str, int] | None = None

    def warn(self, text: str, rank: int = 1) -> None:
        """Warn, in the owner's name. rank: see `Warnings`."""
        self._warn.add(text, rank, self.owner)

    def give_up(self, text: str) -> None:
        """Warn of something that cannot be followed."""
        self.approximate = True
        self.warn(text)

    def number(self, node: Node, name: str | int) -> float:
        """The input's constant value."""
        return float(self._constant(node, name))

    def color(self, node: Node, name: str | int) -> RGB:
        """The input's constant colour, without alpha."""
        red, green, blue = self._constant(node, name)[:3]
        return red, green, blue

    def vector(self, node: Node, name: str | int) -> Vector:
        """The input's constant vector."""
        return Vector(self._constant(node, name)[:3])

    def _constant(self, node: Node, name: str | int) -> Any:
        socket = node.input(name)
        upstream = socket.node()
        if upstream is None or socket.is_constant():
            return socket.value()
        if upstream.kind == "ShaderNodeLightPath" and socket.output().startswith("Is "):
            value: Any = float(socket.output() == "Is Camera Ray")
            self.warn(f"{socket.output()!r} of node {upstream.name!r} is always {value:.0f}, as for the camera")
            return value
        value = socket.value()
        self.give_up(
            f"{socket.name!r} of node {node.name!r} is linked to {upstream.name!r}, which is not followed; "
            f"{_brief(value)} is used"
        )
        return value


def image_texture(reader: NodeReader, node: Node) -> tuple[Texture, bool]:
    """An Image Texture node that has an image, and whether its coordinates are all in it: a UV map and its Mapping."""
    b_node = node.b_node
    found = _plain_coordinates(reader, node) if b_node.projection == "FLAT" else None
    uv_map, transform = found or ("", Matrix.Identity(4))
    tiles: dict[tuple[int, int], Texels] = {}
    if b_node.image.source == "TILED":
        pixels = MISSING
        tiles = {place: _color_output(tile, b_node) for place, tile in reader.images.tiles(b_node.image).items()}
    else:
        pixels = _color_output(reader.images.pixels(b_node.image, b_node.image_user), b_node)
    texture = Texture(
        name=b_node.image.name,
        pixels=pixels,
        tiles=tiles,
        extension=b_node.extension,
        interpolation="CLOSEST" if b_node.interpolation == "Closest" else "LINEAR",
        uv_map=uv_map,
        uv_transform=np.array(transform, dtype=np.float64)[:2][:, [0, 1, 3]],
    )
    return texture, found is not None


def _color_output(texels: Texels, b_node: bpy.types.Node) -> Texels:
    """What the node's Color output gives: multiplied by alpha, unless the Alpha output is used (as in EEVEE)."""
    b_image = b_node.image
    apart = b_image.alpha_mode in ("NONE", "CHANNEL_PACKED") or b_image.colorspace_settings.is_data
    return texels if apart or b_node.outputs["Alpha"].is_linked else texels.multiplied()


def _plain_coordinates(reader: NodeReader, node: Node) -> tuple[str, Matrix] | None:
    """(name of the UV map, "" = active for rendering; (4, 4) matrix that its (u, v, 0, 1) go through), or None."""
    transform = Matrix.Identity(4)
    source, output = _vector_source(node)
    while source and source.kind == "ShaderNodeMapping" and _is_constant_mapping(source):
        transform = transform @ mapping_matrix(reader, source)
        source, output = _vector_source(source)
    if source is None or (source.kind == "ShaderNodeTexCoord" and output == "UV"):
        return "", transform
    if source.kind == "ShaderNodeUVMap":
        return source.b_node.uv_map, transform
    if source.kind == "ShaderNodeAttribute" and source.b_node.attribute_type == "GEOMETRY" and output == "Vector":
        return source.b_node.attribute_name, transform
    return None


def _is_constant_mapping(node: Node) -> bool:
    names = ("Location", "Rotation", "Scale")
    moves = any(node.has_input(name) and not node.input(name).is_constant() for name in names)
    return node.b_node.vector_type != "NORMAL" and not moves


def _vector_source(node: Node) -> tuple[Node | None, str]:
    return node.input("Vector").node(), node.input("Vector").output()


def mapping_matrix(reader: NodeReader, node: Node) -> Matrix:
    """(4, 4): what a Mapping node of constant settings does to a vector."""
    location = reader.vector(node, "Location") if node.has_input("Location") else Vector()
    return mapping(node.b_node.vector_type, location, reader.vector(node, "Rotation"), reader.vector(node, "Scale"))


def mapping(kind: str, location: Sequence[float], rotation: Sequence[float], scale: Sequence[float]) -> Matrix:
    """(4, 4); see Blender's manual, page Mapping Node."""
    turned = Euler(rotation, "XYZ").to_matrix().to_4x4()
    if kind == "NORMAL":
        return turned @ Matrix.Diagonal((*(1 / s if s else 0.0 for s in scale), 1.0))
    forward = turned @ Matrix.Diagonal((*scale, 1.0))
    if kind == "VECTOR":
        return forward
    forward = Matrix.Translation(location) @ forward
    return forward if kind == "POINT" else forward.inverted_safe()


def _brief(value: Any) -> str:
    """A number or a colour, short enough for one line."""
    if isinstance(value, tuple):
        return "(" + ", ".join(f"{component:.3g}" for component in value[:3]) + ")"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
