# SPDX-License-Identifier: GPL-3.0-or-later
"""A file that Blender alone can composite: the user's own compositor over EXR layers instead of over a render.

For a farm without the add-on, and for compositors: both halves come from files, so that nothing is drawn again (no
EEVEE, no graphics card, no ray tracer) and the picture is the one that was rendered here. A file whose EEVEE half were
drawn on the farm would draw it twice: tracing needs EEVEE's mask, that is its picture, here.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import bpy

from .. import files
from ..errors import HybridError
from ..pipeline import nodes, scene_setup
from ..pipeline.restore import Restore
from ..view_layers import source_layer, source_layers

LAYERS = {"raster": "Raster", "traced": "Traced"}  # of a frame : input of the Hybrid node that adds them


def save(
    path: Path,
    scene: bpy.types.Scene,
    camera: bpy.types.Object | None,
    layers: Mapping[str, Path],
    frames: Sequence[int],
) -> None:
    """Write the .blend `path`. The scene in memory is changed for it, and is no hybrid one afterwards.

    camera : the one that the layers were seen by; None for the scene's own.
    layers : the EXR of each of LAYERS, of the first of `frames`, whose number its name ends in.
    frames : those that have layers, from 0 on; empty for one picture without a number.
    """
    if camera is not None:  # what the user's nodes still take from a render is seen by it too
        scene.camera = camera
        for marker in scene.timeline_markers:
            marker.camera = None
    scene_setup.enable(scene)
    hybrid = source_layers(scene)
    if len(hybrid) > 1:
        raise HybridError(f"--handoff writes one view layer, and {len(hybrid)} of scene '{scene.name}' are hybrid")
    tree = nodes.compositor_tree(scene)
    if tree is None:
        raise HybridError(f"scene '{scene.name}' has no compositor")
    stand_ins = [node for node in tree.nodes if nodes.is_stand_in(node)]
    for name, socket in LAYERS.items():
        node = _image_node(tree, name, layers[name], frames)
        for stand_in in stand_ins:
            tree.links.new(stand_in.inputs[socket], node.outputs["Image"])
    _keep(scene, tree)
    scene_setup.disable(scene)
    if frames:
        scene.frame_start, scene.frame_end = min(frames), max(frames)
        scene.frame_step = math.gcd(*(frame - min(frames) for frame in frames)) or 1
        scene.frame_set(min(frames))
    with files.atomic(path) as temporary:
        bpy.ops.wm.save_as_mainfile(filepath=temporary, copy=True, relative_remap=True)


def _image_node(tree: bpy.types.NodeTree, name: str, path: Path, frames: Sequence[int]) -> bpy.types.Node:
    node = tree.nodes.new("CompositorNodeImage")
    node.label = f"Hybrid: {name}"
    node.location = {"raster": (-700, -450), "traced": (-700, -800)}[name]
    image = node.image = bpy.data.images.load(str(path.absolute()))
    image.name = f"Hybrid {name}"
    image.alpha_mode = "PREMUL"
    if frames:
        image.source = "SEQUENCE"
        node.frame_start, node.frame_duration = min(frames), max(frames) - min(frames) + 1
        node.frame_offset = min(frames) - 1  # the file of frame n is number n
        node.use_auto_refresh = True
    with contextlib.suppress(ValueError):  # on another drive of Windows: the whole path stays
        image.filepath = bpy.path.relpath(image.filepath)
    return node


def _keep(scene: bpy.types.Scene, tree: bpy.types.NodeTree) -> None:
    """Make the tree the user's own, so that switching Hybrid off leaves it as it is; nothing is drawn for nothing."""
    for node in [node for node in tree.nodes if nodes.role(node) in {"mask", "trace"}]:
        tree.nodes.remove(node)
    for node in nodes.render_layers(tree, scene, source_layer(scene).name):
        node.mute = not nodes.other_outputs(node)
    for node in tree.nodes:
        for mark in (nodes.SOURCE, nodes.ROLE, nodes.MUTED):
            node.pop(mark, None)
    tree.pop(nodes.ROLE, None)
    restore = Restore(scene)
    restore.forget("asleep", "use_nodes", "use_compositing")
    restore.save()
