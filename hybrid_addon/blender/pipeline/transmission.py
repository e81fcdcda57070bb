# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether light may pass through objects, as far as their materials tell before anything is evaluated or rendered.

The translator itself reads the materials, without their images. What is linked, or animated, may be anything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import bpy
import numpy as np

from ...scene import Expression, Surface, Texels
from ..instancing import shown
from ..sync.camera import matrix_without_scale
from ..sync.image import Images
from ..sync.material import DEFAULT, customised, translate_material
from ..sync.messages import Warnings
from ..sync.settings import NOTHING_OF_ITS_OWN, CustomSurface, custom_surface
from ..sync.sums import singles
from ..sync.texture import FrameFacts, facts_of


def transmit(
    scene: bpy.types.Scene, objects: Iterable[bpy.types.Object], materials: Iterable[bpy.types.Material] = ()
) -> bool:
    """Whether any of these ray traced objects of a scene, or of what they instance, may let light through.

    materials : those that are ray traced whatever wears them.
    """
    if any(_transmits(b_material, NOTHING_OF_ITS_OWN, scene) for b_material in materials):
        return True
    known: dict[tuple[str, CustomSurface], bool] = {}
    for b_owner in objects:
        if b_owner.hide_render and not _is_animated(b_owner, "hide_render"):
            continue
        for b_object, b_material in shown(b_owner):
            # Whose Custom values count: see `sync.settings.instance_settings`.
            wearer = b_object if b_object is not None and b_object.hybrid.ray_traced else b_owner
            if wearer.hybrid.surface == "CUSTOM" and _is_animated(wearer, "hybrid."):
                return True
            key = (b_material.name_full if b_material else "", custom_surface(wearer))
            if key not in known:
                known[key] = _transmits(b_material, key[1], scene)
            if known[key]:
                return True
    return False


def _frame(scene: bpy.types.Scene) -> FrameFacts:
    """As the scene stands."""
    b_camera = scene.camera
    if b_camera is None or b_camera.type != "CAMERA":
        return facts_of(scene, np.eye(4))
    return facts_of(scene, matrix_without_scale(b_camera), b_camera.data.type == "ORTHO")


def _transmits(b_material: bpy.types.Material | None, custom: CustomSurface, scene: bpy.types.Scene) -> bool:
    if custom.over(custom_surface(b_material)).program is not None:
        return True  # a program may let anything through
    if b_material is None:
        return custom.values is not None and custom.values[0] < 1.0 and custom.values[1] < 1.0
    if custom.values is None and (_is_animated(b_material, "hybrid.") or _has_animated_nodes(b_material.node_tree)):
        return True
    surface = customised(surface_of(b_material, scene), custom.over(custom_surface(b_material)))
    return surface.fog is None and any(
        _is_not(closure.opacity, 1.0) and _is_not(closure.reflectivity, 1.0) for closure in singles(surface)
    )


def surface_of(b_material: bpy.types.Material | None, scene: bpy.types.Scene) -> Surface:
    """What the tracer takes from a material's nodes in a scene as it stands, but for the pixels of images; None: an
    object that has none."""
    if b_material is None:
        return DEFAULT
    warn = Warnings()
    return translate_material(b_material, _NoImages(warn), warn, _frame(scene))


_kept: dict[tuple[object, ...], Any] = {}


def until_changed(key: tuple[object, ...], make: Callable[[], Any]) -> Any:
    """What `make` gives, for panels that ask at every redraw: kept until `changed`.

    Not in the background, where scripts edit and ask before Blender tells of anything.
    """
    if bpy.app.background:
        return make()
    found = _kept.get(key)
    if found is None:
        _kept[key] = found = make()
    return found


def changed() -> None:
    """Blender has told of a change, of whatever it is; any thread."""
    _kept.clear()


def shown_surface(b_material: bpy.types.Material | None, b_context: bpy.types.Context) -> Surface:
    """`surface_of`, for panels. It is kept only where Blender would tell of a change: what its depsgraph evaluates."""
    scene, b_depsgraph = b_context.scene, b_context.view_layer.depsgraph
    if b_material is None or b_depsgraph is None or not b_material.evaluated_get(b_depsgraph).is_evaluated:
        return surface_of(b_material, scene)
    key = ("surface", b_material.session_uid, scene.session_uid)
    found: Surface = until_changed(key, lambda: surface_of(b_material, scene))
    return found


def _is_not(value: Any, number: float) -> bool:
    return isinstance(value, Expression) or value != number


class _NoImages(Images):
    """Images whose pixels nobody will look at."""

    looked_at = False

    def pixels(self, b_image: bpy.types.Image, b_image_user: bpy.types.ImageUser | None = None) -> Texels:
        """One white pixel."""
        return Texels(np.ones((1, 1, 4), np.float32))

    def tiles(self, b_image: bpy.types.Image) -> dict[tuple[int, int], Texels]:
        """None."""
        return {}


# ------------------------------------------------------------------------------------------------ what may change


def _has_animated_nodes(b_tree: bpy.types.NodeTree | None, depth: int = 0) -> bool:
    """Whether a value of a node, here or in a group, is keyframed or driven."""
    if b_tree is None or depth > DEEPEST:
        return False
    groups = (getattr(b_node, "node_tree", None) for b_node in b_tree.nodes)
    return _is_animated(b_tree, "nodes[") or any(_has_animated_nodes(b_group, depth + 1) for b_group in groups)


DEEPEST = 16
"""Groups in groups; Blender allows no circles, a broken file may have them."""


def _is_animated(b_id: bpy.types.ID, path: str) -> bool:
    """Whether a property whose path begins so is keyframed or driven."""
    data = b_id.animation_data
    if data is None:
        return False
    actions = [data.action, *(b_strip.action for b_track in data.nla_tracks for b_strip in b_track.strips)]
    bags = [
        b_bag
        for b_action in filter(None, actions)
        for b_layer in b_action.layers
        for b_strip in b_layer.strips
        for b_bag in b_strip.channelbags
    ]
    curves = [*data.drivers, *(b_curve for b_bag in bags for b_curve in b_bag.fcurves)]
    return any(b_curve.data_path.startswith(path) for b_curve in curves)
