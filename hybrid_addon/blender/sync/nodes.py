# SPDX-License-Identifier: GPL-3.0-or-later
"""Walking back through shader nodes: reroutes, muted nodes and links, and node groups are looked through.

A socket inside a group is only known together with the group nodes that lead to it, so `Node` and `Socket` carry them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy

MAX_STEPS = 256  # links followed before a walk gives up: longer than any sane tree, and node cycles end there

Groups = tuple[bpy.types.Node, ...]


@dataclass(frozen=True)
class Node:
    """A Blender node and the group nodes, outermost first, that it lives in."""

    b_node: bpy.types.Node
    groups: Groups = ()

    @property
    def kind(self) -> str:
        """Blender's identifier of the node type, such as "ShaderNodeBsdfPrincipled"."""
        return self.b_node.bl_idname

    @property
    def name(self) -> str:
        """The name shown in the node editor's header: the label if there is one."""
        return self.b_node.label or self.b_node.name

    def input(self, name: str | int) -> Socket:
        """The input called `name` (or the one at that position); KeyError if the node has none."""
        return Socket(self.b_node.inputs[name], self.groups)

    def identified(self, identifier: str) -> Socket:
        """The input of that identifier: some nodes have several of one name."""
        return Socket(_by_identifier(self.b_node.inputs, identifier), self.groups)

    def has_input(self, name: str) -> bool:
        """Whether there is an input of that name (they come and go with Blender's versions)."""
        return name in self.b_node.inputs

    def inputs(self) -> Iterator[Socket]:
        """The inputs that are in use."""
        return (Socket(b_socket, self.groups) for b_socket in self.b_node.inputs if b_socket.enabled)


@dataclass(frozen=True)
class Socket:
    """An input socket and the group nodes, outermost first, that it lives in."""

    b_socket: bpy.types.NodeSocket
    groups: Groups = ()

    @property
    def name(self) -> str:
        """As the artist reads it."""
        return self.b_socket.name

    def node(self) -> Node | None:
        """The node whose output arrives here, or None if it is a constant."""
        return _trace(self)[0]

    def output(self) -> str:
        """Name of the output that arrives here, "" if none does."""
        return _trace(self)[1]

    def output_type(self) -> str:
        """Kind of the output that arrives here: VALUE, RGBA, VECTOR, ..."""
        b_output = _trace(self)[3]
        return b_output.type if b_output else ""

    def output_identifier(self) -> str:
        """Unique name, on its node, of the output that arrives here."""
        b_output = _trace(self)[3]
        return b_output.identifier if b_output else ""

    def value(self) -> Any:
        """The constant that applies here: a float, or a tuple; what a linked socket would hold if it were not."""
        node, _, origin, _ = _trace(self)
        if node and node.kind in ("ShaderNodeValue", "ShaderNodeRGB"):
            return _plain(node.b_node.outputs[0].default_value)
        return _plain(getattr(origin.b_socket, "default_value", None))

    def is_constant(self) -> bool:
        """Whether `value` is the whole truth."""
        node = self.node()
        return node is None or node.kind in ("ShaderNodeValue", "ShaderNodeRGB")


def uses_nodes(b_id: bpy.types.Material | bpy.types.World | bpy.types.Light) -> bool:
    """Whether the datablock's node tree counts: always from Blender 5 on, where the switch is deprecated."""
    return b_id.node_tree is not None and (bpy.app.version >= (5, 0, 0) or b_id.use_nodes)


def active_output(b_tree: bpy.types.NodeTree) -> Node | None:
    """The output node that EEVEE uses of a material's or world's tree."""
    b_output = b_tree.get_output_node("EEVEE")
    return Node(b_output) if b_output else None


def is_thin_wall(node: Node) -> bool:
    """Whether a Principled BSDF is one (Blender 5.2)."""
    return node.has_input("Thin Wall") and bool(node.input("Thin Wall").value())


def _trace(socket: Socket) -> tuple[Node | None, str, Socket, Any]:
    """(node, name of its output, the last socket passed: the one whose default value applies without node, output)."""
    for _ in range(MAX_STEPS):
        b_link = _link(socket.b_socket)
        if b_link is None:
            return None, "", socket, None
        step = _through(b_link.from_node, b_link.from_socket, socket.groups)
        if step is None:
            return Node(b_link.from_node, socket.groups), b_link.from_socket.name, socket, b_link.from_socket
        if step.b_socket is None or (b_link.from_node.mute and _link(step.b_socket) is None):
            return None, "", socket, None  # Blender takes links to muted nodes away that lead to nothing
        socket = step
    return None, "", socket, None


def _link(b_socket: bpy.types.NodeSocket) -> bpy.types.NodeLink | None:
    return next((b_link for b_link in b_socket.links if b_link.is_valid and not b_link.is_muted), None)


def _through(b_node: bpy.types.Node, b_output: bpy.types.NodeSocket, groups: Groups) -> Socket | None:
    """The input that `b_output` merely passes on, or None if its node has a say of its own."""
    if b_node.mute:
        return Socket(_passed_when_muted(b_node, b_output), groups)
    if b_node.bl_idname == "NodeReroute":
        return Socket(b_node.inputs[0], groups)
    if b_node.bl_idname == "ShaderNodeGroup" and b_node.node_tree:
        return _into_group(b_node, b_output, groups)
    if b_node.bl_idname == "NodeGroupInput" and groups:
        return Socket(_by_identifier(groups[-1].inputs, b_output.identifier), groups[:-1])
    return None


def _into_group(b_group: bpy.types.Node, b_output: bpy.types.NodeSocket, groups: Groups) -> Socket | None:
    for b_node in b_group.node_tree.nodes:
        if b_node.bl_idname == "NodeGroupOutput" and b_node.is_active_output:
            return Socket(_by_identifier(b_node.inputs, b_output.identifier), (*groups, b_group))
    return None


def _passed_when_muted(b_node: bpy.types.Node, b_output: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    return next((link.from_socket for link in b_node.internal_links if link.to_socket == b_output), None)


def _by_identifier(b_sockets: Any, identifier: str) -> bpy.types.NodeSocket | None:
    return next((b_socket for b_socket in b_sockets if b_socket.identifier == identifier), None)


def _plain(value: Any) -> Any:
    """A float, int or str as it is; a Blender vector or colour as a tuple of floats."""
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
