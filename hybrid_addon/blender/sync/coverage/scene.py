# SPDX-License-Identifier: GPL-3.0-or-later
"""Warnings of what a scene, its view layer and their collections have set, and rays do not follow."""

from __future__ import annotations

import bpy

from ...view_layers import source_layer
from ..messages import Warnings
from . import name_settings


def name_scene(b_scene: bpy.types.Scene, warn: Warnings) -> None:
    """Warn of the settings of the scene and of the view layer that is rendered hybrid."""
    for b_struct in (b_scene.render, b_scene.eevee, b_scene.eevee.ray_tracing_options):
        name_settings(b_struct, f"scene {b_scene.name!r}", warn)
    b_layer = source_layer(b_scene)
    for b_struct in (b_layer, b_layer.eevee):
        name_settings(b_struct, f"view layer {b_layer.name!r}", warn)
    _name_collections(b_layer.layer_collection, warn)


def _name_collections(b_collection: bpy.types.LayerCollection, warn: Warnings) -> None:
    if not b_collection.exclude:
        name_settings(b_collection, f"collection {b_collection.name!r}", warn)
        for b_child in b_collection.children:
            _name_collections(b_child, warn)
