# SPDX-License-Identifier: GPL-3.0-or-later
"""What the pipeline depends on and what it makes, as plain data: two equal fingerprints mean that nothing happened."""

from __future__ import annotations

from typing import Any

import bpy

from ..flags import shows_ray_traced
from . import nodes

Fingerprint = tuple[Any, ...]


def fingerprint() -> Fingerprint:
    """Of all scenes of the file."""
    return tuple(_scene(scene) for scene in bpy.data.scenes)


def _scene(scene: bpy.types.Scene) -> Fingerprint:
    settings, render = scene.hybrid, scene.render
    b_set, b_camera = scene.background_set, scene.camera
    return (
        (scene.name, render.engine, render.film_transparent, render.use_compositing, render.use_single_layer),
        (settings.enabled, settings.mode, settings.restore),
        (b_set.name if b_set else "", b_camera.name if b_camera else ""),
        tuple((layer.name, layer.use, _layer(layer.layer_collection)) for layer in scene.view_layers),
        _tree(nodes.compositor_tree(scene)),
    )


def _layer(b_layer: bpy.types.LayerCollection | None) -> Fingerprint:
    if b_layer is None:  # a view layer that Blender has not filled yet
        return ()
    collection = b_layer.collection
    return (
        (collection.name, b_layer.exclude, b_layer.holdout, b_layer.indirect_only, collection.hide_render),
        collection.hybrid.ray_traced,
        tuple((ob.name, ob.hybrid.ray_traced, shows_ray_traced(ob)) for ob in collection.objects),
        tuple(_layer(child) for child in b_layer.children),
    )


def _tree(tree: bpy.types.NodeTree | None) -> Fingerprint:
    if tree is None:
        return ()
    return (
        tree.name,
        tuple((node.name, node.mute) for node in tree.nodes),
        tuple((k.from_node.name, k.from_socket.identifier, k.to_node.name, k.to_socket.identifier) for k in tree.links),
    )
