# SPDX-License-Identifier: GPL-3.0-or-later
"""The user's view layers that are rendered hybrid; the mask layer of each, which imitates it but for what is traced.

And what else it depends on what the objects in a layer look like.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import count
from typing import Any

import bpy

MASK_LAYER = "Hybrid Mask"
SOURCE_MARK = "hybrid_source"  # custom property on the user's view layers that are hybrid: a number, from 1 on
MASK_MARK = "hybrid_mask"  # on a mask layer: the number of the layer that it imitates; found again after a rename
USE_MARK = "hybrid_use"  # on a layer of which we changed Use for Rendering: what the user had chosen

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


# ------------------------------------------------------------------------------------------------ views


def views(scene: bpy.types.Scene) -> list[str]:
    """The names of the views that Blender renders of a scene, in its order; [""] without Stereoscopy.

    After BKE_scene_multiview_is_render_view_active (blenkernel/intern/scene.cc).
    """
    own = scene.render
    names = [view.name for view in own.views if view.use] if own.use_multiview else []
    if own.views_format == "STEREO_3D":
        names = [name for name in names if name in {"left", "right"}]
    return names or [""]


def copy_views(scene: bpy.types.Scene, to: bpy.types.Scene) -> None:
    """Let `to` render the views that `scene` does."""
    set_(to.render, "use_multiview", scene.render.use_multiview)
    if not scene.render.use_multiview:
        return
    set_(to.render, "views_format", scene.render.views_format)
    for view in scene.render.views:
        own = to.render.views.get(view.name) or to.render.views.new(view.name)
        for name in ("use", "file_suffix", "camera_suffix"):
            set_(own, name, getattr(view, name))
    for own in [own for own in to.render.views if own.name not in scene.render.views]:
        to.render.views.remove(own)


def camera_in_work(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The camera of the view in work: where each has one of its own, that of its suffix, if there is one.

    After camera_multiview_advanced (blenkernel/intern/camera.cc): of several suffixes the longest one counts.
    """
    camera, view = scene.camera, scene.render.views.get(view_in_work())
    if camera is None or view is None or scene.render.views_format != "MULTIVIEW":
        return camera
    fit = [each.camera_suffix for each in scene.render.views if camera.name.endswith(each.camera_suffix)]
    stem = camera.name.removesuffix(max(fit, key=len)) if fit else None
    return camera if stem is None else scene.objects.get(stem + view.camera_suffix, camera)


# ------------------------------------------------------------------------------------------------ which layers


def own_layers(scene: bpy.types.Scene) -> list[bpy.types.ViewLayer]:
    """The user's view layers; whatever a file says of them, there is at least one."""
    layers = list(scene.view_layers)
    return [layer for layer in layers if not layer.get(MASK_MARK)] or layers[:1]


def rendered_layers(scene: bpy.types.Scene) -> list[bpy.types.ViewLayer]:
    """Those of them that the user has rendered; where that is none, the first."""
    own = own_layers(scene)
    return [layer for layer in own if is_wanted(layer)] or own[:1]


def source_layers(scene: bpy.types.Scene) -> list[bpy.types.ViewLayer]:
    """The user's view layers that are rendered hybrid, the first one that is rendered if there is none yet."""
    return [layer for layer in own_layers(scene) if layer.get(SOURCE_MARK)] or rendered_layers(scene)[:1]


def source_layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """The hybrid layer in work, else the first one."""
    found = _source(scene)
    if found.layer_collection is None:  # a scene that Blender has just made
        found.update()
    return found


_in_work: ContextVar[tuple[int | None, str, str]] = ContextVar("_in_work", default=(None, "", ""))


@contextmanager
def in_work(scene: bpy.types.Scene, layer: bpy.types.ViewLayer, view: str = "") -> Iterator[None]:
    """On this thread `source_layer` and `mask_layer` of this scene mean this hybrid layer of it.

    view : of a scene that renders several of them, which one.
    """
    before = _in_work.set((scene.session_uid, layer.name, view))
    try:
        yield
    finally:
        _in_work.reset(before)


def _source(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    uid, name, _ = _in_work.get()
    layer = scene.view_layers.get(name) if uid == scene.original.session_uid else None
    return layer or source_layers(scene)[0]


def view_in_work() -> str:
    """The name of the view in work; "" where a scene has one only."""
    return _in_work.get()[2]


def part(scene: bpy.types.Scene) -> str:
    """What the picture of the hybrid layer, and view, in work is called: "ViewLayer", "ViewLayer.left"."""
    return part_of(_source(scene), view_in_work())


def part_of(layer: bpy.types.ViewLayer, view: str) -> str:
    """The same of any layer, and view of it."""
    return f"{layer.name}.{view}" if view else str(layer.name)


def number_of(layer: bpy.types.ViewLayer) -> int:
    """By which a hybrid layer, its mask layer and its trace scene know each other; 1 where there is none yet."""
    return _number(layer.get(SOURCE_MARK)) or 1


def _number(value: Any) -> int:
    """A mark as a number: a file may say anything."""
    return int(value) if isinstance(value, (bool, int)) and value > 0 else 0


def mask_layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer | None:
    """The mask layer of `source_layer`, or None.

    Evaluates nothing: it is asked for while Blender evaluates another scene.
    """
    return mask_of(scene, _source(scene))


def mask_of(scene: bpy.types.Scene, source: bpy.types.ViewLayer) -> bpy.types.ViewLayer | None:
    """The mask layer of a hybrid layer, or None."""
    masks = (layer for layer in mask_layers(scene) if layer != source)
    return next((layer for layer in masks if _number(layer[MASK_MARK]) == number_of(source)), None)


def mask_layers(scene: bpy.types.Scene) -> list[bpy.types.ViewLayer]:
    """All mask layers."""
    own = own_layers(scene)
    return [layer for layer in scene.view_layers if layer.get(MASK_MARK) and layer not in own]


def imitated_by(scene: bpy.types.Scene, mask: bpy.types.ViewLayer) -> bpy.types.ViewLayer | None:
    """The user's layer that a mask layer, original or evaluated, stands beside."""
    number = _number(mask.get(MASK_MARK))
    return next((layer for layer in source_layers(scene) if number and number_of(layer) == number), None)


def is_wanted(layer: bpy.types.ViewLayer) -> bool:
    """Whether the user has ticked Use for Rendering, whatever we made of it."""
    return bool(layer.get(USE_MARK, layer.use))


def set_use(layer: bpy.types.ViewLayer, value: bool) -> None:
    """Have EEVEE draw one of the user's layers or not, and remember what he had chosen."""
    wanted = is_wanted(layer)
    if value != wanted:
        if USE_MARK not in layer:
            layer[USE_MARK] = wanted
    else:
        layer.pop(USE_MARK, None)
    set_(layer, "use", value)


def choose_sources(scene: bpy.types.Scene, chosen: Collection[bpy.types.ViewLayer]) -> None:
    """Mark the layers that are hybrid; a layer that was copied has the number of another. Takes the others' masks."""
    taken: set[int] = set()
    for layer in own_layers(scene):
        number = _number(layer.get(SOURCE_MARK))
        if layer not in chosen:
            release_source(layer)
            continue
        if not number or number in taken:
            number = next(n for n in count(1) if n not in taken and not _marked(scene, n))
            layer[SOURCE_MARK] = number
        taken.add(number)
    there: set[int] = set()
    for mask in mask_layers(scene):
        number = _number(mask[MASK_MARK])
        if number in taken and number not in there:
            there.add(number)
        else:
            scene.view_layers.remove(mask)


def _marked(scene: bpy.types.Scene, number: int) -> bool:
    return any(_number(layer.get(SOURCE_MARK)) == number for layer in own_layers(scene))


def release_source(layer: bpy.types.ViewLayer) -> None:
    """A layer of the user's is hybrid no more: as he had it."""
    if USE_MARK in layer:
        set_(layer, "use", bool(layer.pop(USE_MARK)))
    layer.pop(SOURCE_MARK, None)


# ------------------------------------------------------------------------------------------------ the mask layer


def sync_mask_layer(
    scene: bpy.types.Scene,
    source: bpy.types.ViewLayer,
    held_out: bpy.types.Collection | None,
    ours: Collection[bpy.types.Collection],
    *,
    depth: bool,
    albedo: bool,
) -> bpy.types.ViewLayer:
    """Make the mask layer of a hybrid layer show what that shows, with `held_out` held out; no other layer shows it.

    ours : all collections of ours.   depth, albedo : the tracer, or Blender itself, asks for these of it, too.
    """
    mask = mask_of(scene, source)
    if mask is None:
        mask = scene.view_layers.new(MASK_LAYER)
        mask[MASK_MARK] = number_of(source)
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
    if held_out is not None:
        for layer in scene.view_layers:
            set_(_children(layer.layer_collection)[held_out], "exclude", layer != mask)
        set_(_children(mask.layer_collection)[held_out], "holdout", True)
    _imitate(source.layer_collection, mask.layer_collection, ours)
    return mask


def hand_over_properties(scene: bpy.types.Scene, b_evaluated: bpy.types.ViewLayer) -> None:
    """Custom properties may be keyframed: an evaluated mask layer gets those that the user's layer has at that frame.

    Blender evaluates one layer at a time, and their keys name the user's.
    """
    source = imitated_by(scene, b_evaluated) if MASK_MARK in b_evaluated else None
    if source is not None:
        _copy_properties(source, b_evaluated)


def _copy_properties(b_from: bpy.types.ViewLayer, b_to: bpy.types.ViewLayer) -> None:
    """Custom properties, which Attribute nodes of type View Layer read; those of add-ons are not ours to copy."""
    held = {SOURCE_MARK, MASK_MARK, USE_MARK, *b_from.bl_rna.properties.keys()}
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


def _imitate(
    b_from: bpy.types.LayerCollection, b_to: bpy.types.LayerCollection, ours: Collection[bpy.types.Collection]
) -> None:
    """Copy the per-layer switches of the user's collections."""
    twins = _children(b_to)
    for child in b_from.children:
        if child.collection in ours:
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
