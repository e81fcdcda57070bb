# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user has made of our nodes in his compositor, kept in the file while they are away.

The pipeline's nodes leave when a file is saved or Hybrid is switched off; links from their sockets (Mask, Residual, the
data passes, EEVEE's half) into the user's nodes would go with them, and so would the nodes' places. They are written
down before, and put back when the nodes come again.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import bpy

Place = tuple[float, float]

FARTHEST = 1e6
"""No node stands further out than that; a file may say anything."""


@dataclass(frozen=True)
class Own:
    """A node of ours. default: where it stands unless the user moves it. feeds: what it feeds is the user's choice."""

    node: bpy.types.Node
    default: Place
    feeds: bool


def remember(scene: bpy.types.Scene, nodes: Mapping[str, Own]) -> None:
    """Write down where our nodes stand and which of the user's they feed. What waits from before stays.

    nodes : by names that say in any session which is which.
    """
    memory = _read(scene.hybrid.memory)
    ours = {own.node.name for own in nodes.values()}
    for name, own in nodes.items():
        place = list(own.node.location)
        if place != list(own.default):
            memory["places"][name] = place
        for output in own.node.outputs if own.feeds else ():
            for link in output.links:
                if link.to_node.name not in ours:
                    inputs = [socket.identifier for socket in link.to_node.inputs]
                    index = inputs.index(link.to_socket.identifier)
                    memory["links"].append([name, output.name, link.to_node.name, index, link.to_socket.name])
    _write(scene, memory)


def recall(scene: bpy.types.Scene, tree: bpy.types.NodeTree, nodes: Mapping[str, Own], fresh: set[str]) -> None:
    """Put back what can be: places of `fresh` nodes, and links whose two ends are there. The others wait on.

    A link into a socket that the user has linked otherwise by now, or into a node that is gone, is forgotten.
    """
    memory = _read(scene.hybrid.memory)
    for name in fresh & memory["places"].keys():
        nodes[name].node.location = memory["places"].pop(name)
    memory["links"] = [link for link in memory["links"] if not _done(tree, nodes, link)]
    _write(scene, memory)


def _done(tree: bpy.types.NodeTree, nodes: Mapping[str, Own], link: list[Any]) -> bool:
    """Make a link, if its output is there; False: not yet."""
    name, output_name, to_node_name, index, input_name = link
    to_node = tree.nodes.get(to_node_name)
    if to_node is None or not 0 <= index < len(to_node.inputs):
        return True
    to_socket = to_node.inputs[index]
    if to_socket.name != input_name or to_socket.is_linked:
        return True
    own = nodes.get(name)
    output = next((s for s in own.node.outputs if s.name == output_name and s.enabled), None) if own else None
    if output is None:
        return False
    tree.links.new(to_socket, output)
    return True


def _read(text: str) -> dict[str, Any]:
    """A file is untrusted: what is no memory of ours is none."""
    try:
        found = json.loads(text or "{}")
    except (ValueError, RecursionError):
        found = {}
    found = found if isinstance(found, dict) else {}
    places, links = found.get("places"), found.get("links")
    return {
        "places": {k: v for k, v in places.items() if _is_place(v)} if isinstance(places, dict) else {},
        "links": [link for link in links if _is_link(link)] if isinstance(links, list) else [],
    }


def _is_place(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 2
        and all(isinstance(v, int | float) and abs(v) <= FARTHEST for v in value)
    )


def _is_link(value: Any) -> bool:
    return isinstance(value, list) and [type(v) for v in value] == [str, str, str, int, str]


def _write(scene: bpy.types.Scene, memory: dict[str, Any]) -> None:
    """Only what changed: every assignment tags the dependency graph."""
    text = json.dumps(memory, sort_keys=True) if memory["places"] or memory["links"] else ""
    if scene.hybrid.memory != text:
        scene.hybrid.memory = text
