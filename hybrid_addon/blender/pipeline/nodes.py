# SPDX-License-Identifier: GPL-3.0-or-later
"""The compositor's nodes and tree: which nodes are ours, which the user's, and the tree that ours stand in."""

from __future__ import annotations

from collections.abc import Collection

import bpy

from ..view_layers import source_layers
from . import node_memory, trace_scenes
from .restore import Restore

SOURCE = "hybrid_source"  # on a Hybrid node: name of the Render Layers node that it stands in for
ROLE = "hybrid_role"  # on nodes that we made: "mask", "trace", or "own" (made because the user had none)
LAYER = "hybrid_layer"  # on nodes of ours, from the second hybrid view layer on: its number
MUTED = "hybrid_muted"  # on the user's nodes that we muted
PLACES = {"mask": (-700.0, -450.0), "trace": (-700.0, -800.0)}
OUTPUTS = {"COMPOSITE", "GROUP_OUTPUT"}
_PLAIN = {"R_LAYERS", "COMPOSITE", "VIEWER", "REROUTE", "GROUP_OUTPUT"}
_NEW_API = bpy.app.version >= (5, 0)


def compositor_tree(scene: bpy.types.Scene) -> bpy.types.NodeTree | None:
    """The scene's compositor tree in this version of Blender, or None."""
    return scene.compositing_node_group if _NEW_API else scene.node_tree


# ------------------------------------------------------------------------------------------------ the tree itself


def ensure_tree(scene: bpy.types.Scene, source: bpy.types.ViewLayer, restore: Restore) -> bpy.types.NodeTree:
    """The live tree: the user's, or a plain one (Render Layers -> output) where he has none or has switched his off."""
    was_off = not scene.render.use_compositing
    restore.remember("use_compositing", scene.render.use_compositing)
    if was_off:
        scene.render.use_compositing = True
    if _NEW_API:
        tree = scene.compositing_node_group
        asleep = tree if was_off else None
        if tree is None or was_off:
            tree = scene.compositing_node_group = _new_tree(asleep)
    else:
        was_off = was_off or not scene.use_nodes
        restore.remember("use_nodes", scene.use_nodes)
        if not scene.use_nodes:
            scene.use_nodes = True  # Blender fills an empty scene's tree with Render Layers -> Composite
        tree = scene.node_tree
        if was_off and any(node.type not in _PLAIN for node in tree.nodes):
            _put_to_sleep(tree, scene, source, restore)
    _ensure_output(tree, scene, source)
    return tree


def _new_tree(asleep: bpy.types.NodeTree | None) -> bpy.types.NodeTree:
    """A tree of ours. One that the user has switched off sleeps in a muted node of it, and so is not lost."""
    tree = bpy.data.node_groups.new("Hybrid Compositor", "CompositorNodeTree")
    tree[ROLE] = "own"
    if asleep is not None:
        bed = tree.nodes.new("CompositorNodeGroup")
        bed[ROLE], bed.node_tree, bed.mute, bed.label = "own", asleep, True, "Your compositor, switched off"
        bed.location = (400, 300)
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    return tree


def _ensure_output(tree: bpy.types.NodeTree, scene: bpy.types.Scene, source: bpy.types.ViewLayer) -> None:
    """An empty tree gets the two nodes that Blender's own default has."""
    if any(node.type in OUTPUTS for node in tree.nodes):
        return
    output = tree.nodes.new("NodeGroupOutput" if _NEW_API else "CompositorNodeComposite")
    output.location = (400, 0)
    output[ROLE] = "own"
    if output.inputs:
        render_layers = _render_layers_node(tree, "own", scene, source.name)
        tree.links.new(output.inputs[0], render_layers.outputs["Image"])


def _put_to_sleep(
    tree: bpy.types.NodeTree, scene: bpy.types.Scene, source: bpy.types.ViewLayer, restore: Restore
) -> None:
    """4.5 only: a tree that the user has switched off must stay without effect although Use Nodes is now on."""
    for node in tree.nodes:
        if node.type == "OUTPUT_FILE":
            mute_ours(node, True)
    output = next((node for node in tree.nodes if node.type == "COMPOSITE"), None)
    if output is None:
        return
    link = next(iter(output.inputs[0].links), None)
    before = [link.from_node.name, link.from_socket.identifier] if link else None
    restore.remember("asleep", {"output": output.name, "before": before})
    render_layers = _render_layers_node(tree, "own", scene, source.name)
    tree.links.new(output.inputs[0], render_layers.outputs["Image"])


def wake(tree: bpy.types.NodeTree, restore: Restore) -> None:
    """The inverse of `_put_to_sleep`."""
    match restore.get("asleep"):
        case {"output": str(name), "before": [str(origin), str(identifier)]}:
            node = tree.nodes.get(origin)
            before = next((s for s in node.outputs if s.identifier == identifier), None) if node else None
        case {"output": str(name), "before": None}:
            before = None
        case _:
            return
    output = tree.nodes.get(name)
    if output is None or not output.inputs:
        return
    link_sockets(tree, output.inputs[0], before)
    for node in [node for node in tree.nodes if node.get(ROLE) == "own"]:
        tree.nodes.remove(node)


def restore_tree(scene: bpy.types.Scene, tree: bpy.types.NodeTree | None, restore: Restore) -> None:
    """The inverse of `ensure_tree`: the tree that the user had, in use or not as he had it."""
    if _NEW_API:
        if tree is not None and tree.get(ROLE) == "own":
            untouched = all(node.get(ROLE) == "own" for node in tree.nodes)
            if untouched:
                scene.compositing_node_group = next((n.node_tree for n in tree.nodes if n.type == "GROUP"), None)
                bpy.data.node_groups.remove(tree)
            else:  # the user has built on it: it is his now
                del tree[ROLE]
                for node in tree.nodes:
                    node.pop(ROLE, None)
    elif restore.get("use_nodes") is False:
        if tree is not None:
            for node in tree.nodes:
                node.pop(ROLE, None)
        scene.use_nodes = False
    if restore.get("use_compositing") is False:
        scene.render.use_compositing = False


# ------------------------------------------------------------------------------------------------ nodes


def role(node: bpy.types.Node) -> str:
    """What we made this node for; "" for the user's. A file may hold any property: it must fit the node too."""
    found = node.get(ROLE)
    return found if found == "own" or (isinstance(found, str) and node.type == "R_LAYERS") else ""


def is_stand_in(node: bpy.types.Node) -> bool:
    """Whether this is a Hybrid node, whatever the file says of it."""
    return (
        node.type == "GROUP" and isinstance(node.get(SOURCE), str) and {"Raster", "Traced"} <= set(node.inputs.keys())
    )


def own(tree: bpy.types.NodeTree) -> dict[str, node_memory.Own]:
    """The nodes that stand for the two halves, and those that stand in for the user's."""
    found = {}
    for node in tree.nodes:
        number = layer_number(node)
        if role(node) in PLACES:
            name = role(node) if number == 1 else f"{role(node)} {number}"
            found[name] = node_memory.Own(node, _place(role(node), number), True)
        elif is_stand_in(node):
            found[f"for {node[SOURCE]}"] = node_memory.Own(node, beside(tree.nodes.get(node[SOURCE])), False)
    return found


def layer_number(node: bpy.types.Node) -> int:
    """The number of the hybrid view layer that a node of ours belongs to."""
    found = node.get(LAYER)
    return found if isinstance(found, int) and found > 0 else 1


def remove_others(tree: bpy.types.NodeTree, numbers: Collection[int]) -> None:
    """Remove the nodes of layers that are hybrid no more."""
    for node in [node for node in tree.nodes if role(node) in PLACES and layer_number(node) not in numbers]:
        tree.nodes.remove(node)


def _place(which: str, number: int) -> tuple[float, float]:
    x, y = PLACES[which]
    return x - 300 * (number - 1), y


def beside(user_node: bpy.types.Node | None) -> tuple[float, float]:
    """Where a Hybrid node stands."""
    return (user_node.location.x + 260, user_node.location.y - 40) if user_node else (0.0, 0.0)


def is_users(node: bpy.types.Node, scene: bpy.types.Scene | None, layer: str | None) -> bool:
    """Whether this is a Render Layers node of the user's, in use, that shows this layer (None: any layer)."""
    if node.type != "R_LAYERS" or role(node) in {"mask", "trace"} or node.scene not in (None, scene):
        return False
    return (not node.mute or MUTED in node) and layer in (None, node.layer)


def render_layers(tree: bpy.types.NodeTree, scene: bpy.types.Scene | None, layer: str | None) -> list[bpy.types.Node]:
    """The user's Render Layers nodes that show this layer (None: any layer) of this scene."""
    return [node for node in tree.nodes if is_users(node, scene, layer)]


def other_outputs(node: bpy.types.Node) -> bool:
    """Whether a pass other than the picture is used."""
    return any(socket.is_linked for socket in node.outputs if socket.name not in {"Image", "Alpha"})


def _render_layers_node(tree: bpy.types.NodeTree, which: str, scene: bpy.types.Scene, layer: str) -> bpy.types.Node:
    # Blender gives a new node the context's scene, of which it forgets to take one user back: let that be one of ours.
    ours = scene if trace_scenes.is_trace_scene(scene) else trace_scenes.ensure(scene, source_layers(scene)[0])
    with bpy.context.temp_override(scene=ours):
        node = tree.nodes.new("CompositorNodeRLayers")
    node[ROLE] = which
    node.scene = scene
    node.layer = layer
    return node


def own_render_layers(
    tree: bpy.types.NodeTree, which: str, number: int, scene: bpy.types.Scene, layer: str
) -> bpy.types.Node:
    """Our node for the "mask" or the "trace" half of the hybrid layer of this number, made if there is none.

    It shows this layer of this scene.
    """
    node = next((node for node in tree.nodes if role(node) == which and layer_number(node) == number), None)
    if node is None:
        node = _render_layers_node(tree, which, scene, layer)
        node.label = {
            "mask": "Hybrid: EEVEE without the ray traced objects",
            "trace": "Hybrid: the ray traced objects",
        }[which]
        node.location = _place(which, number)
        if number > 1:
            node[LAYER] = number
    if node.scene != scene:
        node.scene = scene
    if node.layer != layer:
        node.layer = layer
    return node


def link_sockets(
    tree: bpy.types.NodeTree, to_socket: bpy.types.NodeSocket, from_socket: bpy.types.NodeSocket | None
) -> None:
    """Make exactly this link stand, or none."""
    link = next(iter(to_socket.links), None)
    if link is not None and from_socket is not None and link.from_socket == from_socket:
        return
    if from_socket is not None:
        tree.links.new(to_socket, from_socket)
    elif link is not None:
        tree.links.remove(link)


def set_mute(node: bpy.types.Node, value: bool) -> None:
    """Mute a node or not; write nothing where it is so already."""
    if node.mute != value:
        node.mute = value


def mute_ours(node: bpy.types.Node, value: bool) -> None:
    """Mute one of the user's nodes for a while, or give it back; never touches what he muted himself."""
    if value and not node.mute:
        node.mute = True
        node[MUTED] = True
    elif not value and MUTED in node:
        node.mute = False
        del node[MUTED]
