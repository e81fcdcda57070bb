# SPDX-License-Identifier: GPL-3.0-or-later
"""The two view layers that matter: the user's, and the mask layer, which imitates it and holds our collection out.

And what else it depends on what the objects in a layer look like.
"""

from __future__ import annotations

from typing import Any

import bpy

MASK_LAYER = "Hybrid Mask"
SOURCE_MARK = "hybrid_source"  # custom property on the user's view layer that the mask layer imitates
MASK_MARK = "hybrid_mask"  # custom property on the mask layer: found again after a rename

# Settings of a view layer that change what EEVEE draws; the mask layer takes them from the user's layer.
_LAYER_SETTINGS = (
    "material_override",
    "world_override",
    "samples",
    "use_sky",
    "use_solid",
    "use_strand",
    "use_volumes",
    "use_motion_blur",
    "use_grease_pencil",
    "use_pass_grease_pencil",
)


# How the names of those render settings begin on which it depends what shape objects have, and where they are.
_EVALUATION = ("use_simplify", "simplify_", "frame_map_", "fps")


def copy_evaluation(scene: bpy.types.Scene, to: bpy.types.Scene) -> None:
    """Let `to`, a scene of ours that shows the objects of another, evaluate them as that one does."""
    for name in scene.render.bl_rna.properties.keys():
        if name.startswith(_EVALUATION):
            set_(to.render, name, getattr(scene.render, name))
    set_(to, "use_gravity", scene.use_gravity)
    if tuple(to.gravity) != tuple(scene.gravity):
        to.gravity = scene.gravity


def source_layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """The user's view layer that is rendered hybrid: the first one that is rendered at all."""
    found = _source(scene)
    if found.layer_collection is None:  # a scene that Blender has just made
        found.update()
    return found


def _source(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    layers = list(scene.view_layers)
    own = [layer for layer in layers if not layer.get(MASK_MARK)] or layers[:1]  # whatever a file says of them
    marked = [layer for layer in own if layer.get(SOURCE_MARK)]
    used = [layer for layer in own if layer.use]
    return (marked or used or own)[0]


def mask_layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer | None:
    """The mask view layer, or None. Evaluates nothing: it is asked for while Blender evaluates another scene."""
    source = _source(scene)
    return next((layer for layer in scene.view_layers if layer.get(MASK_MARK) and layer != source), None)


def sync_mask_layer(
    scene: bpy.types.Scene, source: bpy.types.ViewLayer, ours: bpy.types.Collection, *, depth: bool, albedo: bool
) -> bpy.types.ViewLayer:
    """Make the mask layer show what the source layer shows, with `ours` held out; no other layer shows `ours`.

    depth, albedo: the tracer, or Blender itself, asks for these of it, too.
    """
    mask = mask_layer(scene)
    if mask is None:
        mask = scene.view_layers.new(MASK_LAYER)
        mask[MASK_MARK] = True
        for name in mask.bl_rna.properties.keys():  # a new layer has Depth on; the mask layer needs the picture only
            if name.startswith("use_pass_"):
                set_(mask, name, name == "use_pass_combined")
    set_(mask, "use_freestyle", False)  # its lines come from the user's layer
    set_(mask, "use_pass_z", depth)
    set_(mask, "use_pass_diffuse_color", albedo)
    for name in _LAYER_SETTINGS:
        if hasattr(source, name):
            set_(mask, name, getattr(source, name))
    _copy_properties(source, mask)
    for layer in scene.view_layers:
        set_(_children(layer.layer_collection)[ours], "exclude", layer != mask)
    set_(_children(mask.layer_collection)[ours], "holdout", True)
    _imitate(source.layer_collection, mask.layer_collection, ours)
    return mask


def hand_over_properties(scene: bpy.types.Scene, b_evaluated: bpy.types.ViewLayer) -> None:
    """Custom properties may be keyframed: an evaluated mask layer gets those that the user's layer has at that frame.

    Blender evaluates one layer at a time, and their keys name the user's.
    """
    if MASK_MARK in b_evaluated:
        _copy_properties(_source(scene), b_evaluated)


def _copy_properties(b_from: bpy.types.ViewLayer, b_to: bpy.types.ViewLayer) -> None:
    """Custom properties, which Attribute nodes of type View Layer read; those of add-ons are not ours to copy."""
    held = {SOURCE_MARK, MASK_MARK, *b_from.bl_rna.properties.keys()}
    given = {key: plain(b_from[key]) for key in b_from.keys() if key not in held}
    for key in [key for key in b_to.keys() if key not in held and key not in given]:
        del b_to[key]
    for key, value in given.items():
        if value is not None and plain(b_to.get(key)) != value:
            b_to[key] = value


def plain(value: Any) -> Any:
    """The value of a custom property without Blender's types: what may be assigned to another one; None: a pointer."""
    if hasattr(value, "to_dict"):
        found = {key: plain(part) for key, part in value.items()}
        return {key: part for key, part in found.items() if part is not None}
    if hasattr(value, "to_list"):
        return value.to_list()
    if isinstance(value, list):
        return [plain(part) for part in value]
    return None if isinstance(value, bpy.types.bpy_struct) else value


def _imitate(b_from: bpy.types.LayerCollection, b_to: bpy.types.LayerCollection, ours: bpy.types.Collection) -> None:
    """Copy the per-layer switches of the user's collections."""
    twins = _children(b_to)
    for child in b_from.children:
        if child.collection == ours:
            continue
        twin = twins[child.collection]
        for name in ("exclude", "holdout", "indirect_only"):
            set_(twin, name, getattr(child, name))
        _imitate(child, twin, ours)


def _children(b_layer: bpy.types.LayerCollection) -> dict[bpy.types.Collection, bpy.types.LayerCollection]:
    """By collection: names are not unique, a linked one may have that of a local one."""
    return {child.collection: child for child in b_layer.children}


def set_(owner: bpy.types.bpy_struct, name: str, value: object) -> None:
    """Assign only what differs: every assignment tags the dependency graph, and sync runs after each of its updates."""
    if getattr(owner, name) != value:
        setattr(owner, name, value)
