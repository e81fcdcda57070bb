# SPDX-License-Identifier: GPL-3.0-or-later
"""The compositor part of the pipeline.

For each Render Layers node that shows one of the user's hybrid view layers there is one *Hybrid* group node, and
whatever that Render Layers node fed (Image, Alpha) is fed by the Hybrid node instead:

    Render Layers (Hybrid Mask)                           which only stands there, so that Blender renders that layer
    Render Layers (Hybrid Trace) --Raster-->  Hybrid  --> what the user's Render Layers fed
                                 --Traced-->

The group adds all four channels: the raster half is already multiplied by 1 - coverage and the traced half by coverage
(both associated alpha), so the plain sum is exact at every edge. In RASTER mode the user's own layer goes through the
group with nothing to add, in FULL mode nothing but the traced half.

Both halves are passes of the trace scene, the raster one bit for bit what EEVEE drew: with a window Blender composites
anew whenever nodes change, with what the last render left, and a retrace leaves nothing of EEVEE.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import bpy

from ..flags import background_sets
from ..lines import draws_freestyle
from ..view_layers import number_of, rendered_layers, source_layers
from . import node_memory, nodes
from .node_group import GROUP_MARK, composite_group
from .restore import Restore


class Halves(NamedTuple):
    """A view layer that is rendered hybrid, the mask layer that EEVEE draws instead, and the scene that traces it."""

    source: bpy.types.ViewLayer
    mask: bpy.types.ViewLayer
    trace: bpy.types.Scene


def sync(scene: bpy.types.Scene, layers: Sequence[Halves], mode: str, restore: Restore) -> None:
    """Bring the compositor in step; see the module's head. Idempotent."""
    tree = nodes.ensure_tree(scene, rendered_layers(scene)[0], restore)
    before = nodes.own(tree).keys()
    nodes.remove_others(tree, {number_of(halves.source) for halves in layers})
    stand_ins = {node[nodes.SOURCE]: node for node in tree.nodes if nodes.is_stand_in(node)}
    for halves in layers:
        _sync_layer(tree, scene, halves, mode, stand_ins)
    for orphan in stand_ins.values():
        _withdraw(tree, orphan, scene)
    own = nodes.own(tree)
    node_memory.recall(scene, tree, own, own.keys() - before)


def _sync_layer(
    tree: bpy.types.NodeTree,
    scene: bpy.types.Scene,
    halves: Halves,
    mode: str,
    stand_ins: dict[str, bpy.types.Node],
) -> None:
    """The nodes of one hybrid layer. Takes those that stand in for its Render Layers nodes out of `stand_ins`."""
    number, trace = number_of(halves.source), halves.trace
    mask_node = nodes.own_render_layers(tree, "mask", number, scene, halves.mask.name)
    trace_node = nodes.own_render_layers(tree, "trace", number, trace, trace.view_layers[0].name)
    nodes.set_mute(mask_node, mode != "HYBRID")
    nodes.set_mute(trace_node, mode == "RASTER")
    for user_node in nodes.render_layers(tree, scene, halves.source.name):
        hybrid = stand_ins.pop(user_node.name, None) or _insert(tree, user_node)
        if hybrid.get(nodes.LAYER) != number:
            hybrid[nodes.LAYER] = number
        _divert(tree, user_node, hybrid)
        drawn = trace_node.outputs["Raster"] if mode in {"HYBRID", "RETRACE"} else None
        nodes.link_sockets(tree, hybrid.inputs["Raster"], user_node.outputs["Image"] if mode == "RASTER" else drawn)
        # Not the picture itself, over which Blender lays Grease Pencil once more; without EEVEE's half that is right.
        traced = trace_node.outputs["Image" if mode == "FULL" else "Traced"]
        nodes.link_sockets(tree, hybrid.inputs["Traced"], None if mode == "RASTER" else traced)
        nodes.mute_ours(user_node, mode in {"FULL", "RETRACE"} and not nodes.other_outputs(user_node))


def tear_down(scene: bpy.types.Scene, restore: Restore) -> None:
    """Give every link back to the user's Render Layers nodes and remove ours. Does nothing in a clean tree."""
    tree = nodes.compositor_tree(scene)
    if tree is not None:
        node_memory.remember(scene, nodes.own(tree))
        _clean(tree, scene)
        nodes.wake(tree, restore)
    nodes.restore_tree(scene, tree, restore)
    remove_orphans()


def rejoin(scene: bpy.types.Scene, source: bpy.types.ViewLayer, trace: bpy.types.Scene) -> None:
    """Let our node show the trace scene of a layer again: Blender's undo does not know of that."""
    tree, number = nodes.compositor_tree(scene), number_of(source)
    for node in tree.nodes if tree is not None else ():
        if nodes.role(node) == "trace" and nodes.layer_number(node) == number and node.scene != trace:
            node.scene = trace
            node.layer = trace.view_layers[0].name


def remove_orphans() -> None:
    """Remove trees of ours that no scene uses any more, and our nodes from the user's that none does."""
    shown = [nodes.compositor_tree(scene) for scene in bpy.data.scenes]
    for tree in bpy.data.node_groups:
        if tree.library is None and tree.bl_idname == "CompositorNodeTree" and tree not in shown:
            _clean(tree, None)
    for tree in list(bpy.data.node_groups):
        if tree.users == 0 and tree.library is None and (tree.get(nodes.ROLE) == "own" or tree.get(GROUP_MARK)):
            bpy.data.node_groups.remove(tree)


def _clean(tree: bpy.types.NodeTree, scene: bpy.types.Scene | None) -> None:
    """Take our nodes out of a tree, and leave the user's as they were."""
    for node in [node for node in tree.nodes if nodes.is_stand_in(node)]:
        _withdraw(tree, node, scene)
    for node in tree.nodes:
        nodes.mute_ours(node, False)
    for node in [node for node in tree.nodes if nodes.role(node) in {"mask", "trace"}]:
        tree.nodes.remove(node)


def needs_source(scene: bpy.types.Scene, source: bpy.types.ViewLayer, mode: str) -> bool:
    """Whether EEVEE has to render the user's own layer too, beside the mask layer.

    With an opaque film the mask layer alone gives raster and mask. A transparent film hides the difference between sky
    and object; other passes, Freestyle's lines and Cryptomatte exist in the user's layer only, and so do the layers of
    a multilayer file. Other scenes' compositors show it, too: as EEVEE draws it. Of several layers each keeps Use for
    Rendering as the user has it: he may want to switch one of them off. Of a background scene Blender shows the first
    that has it.
    """
    if mode != "HYBRID":
        return mode == "RASTER"
    if len(rendered_layers(scene)) > 1 or any(scene in background_sets(other) for other in bpy.data.scenes):
        return True
    tree = nodes.compositor_tree(scene)
    others = tree is not None and any(
        node.type == "CRYPTOMATTE_V2" or (nodes.is_users(node, scene, source.name) and nodes.other_outputs(node))
        for node in tree.nodes
    )
    others = others or draws_freestyle(scene) or _shown_elsewhere(scene, source.name)
    return scene.render.film_transparent or others or scene.render.image_settings.file_format == "OPEN_EXR_MULTILAYER"


def _shown_elsewhere(scene: bpy.types.Scene, layer: str) -> bool:
    """Whether another scene composites this layer of this scene."""
    own = nodes.compositor_tree(scene)
    trees = {tree for other in bpy.data.scenes if (tree := nodes.compositor_tree(other)) not in (None, own)}
    return any(
        node.type == "R_LAYERS" and node.scene == scene and node.layer == layer and not node.mute
        for tree in trees
        for node in tree.nodes
    )


def feeds_nothing(scene: bpy.types.Scene, source: bpy.types.ViewLayer) -> bool:
    """Whether the user's compositor never uses this layer's picture, so that the hybrid one cannot show either."""
    tree, number = nodes.compositor_tree(scene), number_of(source)
    return tree is None or not any(
        link.from_node.get(nodes.SOURCE) and nodes.layer_number(link.from_node) == number for link in tree.links
    )


# ------------------------------------------------------------------------------------------------ nodes that stand in


def _insert(tree: bpy.types.NodeTree, user_node: bpy.types.Node) -> bpy.types.Node:
    node = tree.nodes.new("CompositorNodeGroup")
    node.node_tree = composite_group()
    node.label = "Hybrid"
    node[nodes.SOURCE] = user_node.name
    node.location = nodes.beside(user_node)
    for socket in node.inputs:
        socket.default_value = (0.0, 0.0, 0.0, 0.0)
    return node


def _divert(tree: bpy.types.NodeTree, user_node: bpy.types.Node, hybrid: bpy.types.Node) -> None:
    """Whatever the user's node fed is fed by the Hybrid node."""
    for name in ("Image", "Alpha"):
        for link in list(user_node.outputs[name].links):
            if link.to_node != hybrid:
                tree.links.new(link.to_socket, hybrid.outputs[name])


def _withdraw(tree: bpy.types.NodeTree, hybrid: bpy.types.Node, scene: bpy.types.Scene | None) -> None:
    """Take a Hybrid node out again; if its Render Layers node was renamed, another of this layer takes its links."""
    layers = [] if scene is None else source_layers(scene)
    layer = next((layer.name for layer in layers if number_of(layer) == nodes.layer_number(hybrid)), None)
    origin = tree.nodes.get(hybrid[nodes.SOURCE]) or next(iter(nodes.render_layers(tree, scene, layer)), None)
    for output in hybrid.outputs:
        for link in list(output.links):
            if origin is not None:
                tree.links.new(link.to_socket, origin.outputs[output.name])
    tree.nodes.remove(hybrid)
