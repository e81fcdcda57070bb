# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE's half of the picture, as the tracer gets it: picture, mask, depth, and whether it may back hits."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from ...scene import Camera, Float32
from ..errors import HybridError
from ..flags import Flags
from ..lines import draws_freestyle
from ..pipeline import scene_setup
from ..session import Half
from ..view_layers import view_in_work
from . import images
from .motion_blur import is_blurred

Window = tuple[int, int, int, int]

FREESTYLE = ("Freestyle", "FreestyleLineSet")
"""Names of Freestyle's pass."""

ALBEDO = ("Diffuse Color", "DiffCol")
"""Names of EEVEE's pass in 5.x and 4.5."""


def read(scene: bpy.types.Scene, window: Window, check: Callable[[], None]) -> Half:
    """What EEVEE has just drawn, over the window. Raises HybridError if the scene has no mask layer."""
    from ...compositor import mask_from_alpha

    mask_layer = scene_setup.mask_layer(scene)
    if mask_layer is None:
        raise HybridError(f"scene '{scene.name}' has no mask view layer: switch Hybrid off and on again")
    source, own = scene_setup.source_layer(scene).name, mask_layer.name
    picture, depths, whole_picture = f"{own}.Combined", f"{own}.Depth", f"{source}.Combined"
    colors, freestyle = [f"{own}.{name}" for name in ALBEDO], [f"{source}.{name}" for name in FREESTYLE]
    wanted = [picture]  # what is not wanted is not read: each pass takes some milliseconds
    wanted += [depths] if scene_setup.needs_raster(scene) else []
    wanted += colors if scene_setup.needs_albedo(scene) else []
    wanted += freestyle if draws_freestyle(scene) else []
    wanted += [whole_picture] if scene.render.film_transparent else []
    view = view_in_work()
    wanted += [f"{name}.{view}" for name in wanted] if view else []
    planes = images.of_view(images.read_render_result(scene, check, wanted), view)
    planes = {name: _crop(plane, window) for name, plane in planes.items()}
    raster, depth = planes[picture], planes.get(depths)
    albedo = next((planes[name][..., :3] for name in colors if name in planes), None)
    lines = next((planes[name] for name in freestyle if name in planes), None)
    whole = planes[whole_picture][..., 3] if whole_picture in wanted else None
    depth = None if depth is None else depth[..., 0]
    return Half(raster, mask_from_alpha(raster[..., 3], whole), depth, albedo, lines)


def without_sky(depth: Float32, camera: Camera) -> Float32:
    """EEVEE's depth pass with NO_DEPTH where there is only sky: 5.x has it already, 4.5 writes about the clip end.

    It is read back from a depth buffer, whose rounding grows with clip end over clip start.
    """
    from ...tracer.core.constants import FLOAT32_ULP, NO_DEPTH

    rounding = 8 * FLOAT32_ULP * camera.clip_end / camera.clip_start
    return np.where(depth > camera.clip_end * (1 - min(rounding, 0.5)), np.float32(NO_DEPTH), depth)


def unfit_to_back(scene: bpy.types.Scene) -> str:
    """Why the pixels of EEVEE's picture are not those of the surfaces that its depth pass has; "" if they are."""
    if scene.camera is not None and scene.camera.type == "CAMERA" and scene.camera.data.dof.use_dof:
        return "depth of field blurs EEVEE's picture, but not its depth"
    if is_blurred(scene):
        return "motion blur blurs EEVEE's picture, but not its depth"
    if may_scatter(scene):
        return "a volume lies between EEVEE's picture and its surfaces"
    return ""


def may_scatter(scene: bpy.types.Scene) -> bool:
    """Whether EEVEE may draw a volume before what is ray traced: light that is right where everything is held out."""
    if _has_volume(scene.world):
        return True
    is_ray_traced = Flags(scene).is_ray_traced
    return any(
        b_object.type == "VOLUME" or any(_has_volume(slot.material) for slot in b_object.material_slots)
        for b_object in bpy.data.objects  # those of instanced collections, too
        if not is_ray_traced(b_object)
    )


def _has_volume(owner: bpy.types.World | bpy.types.Material | None) -> bool:
    tree = owner.node_tree if owner is not None else None
    output = tree.get_output_node("EEVEE") if tree is not None else None
    return output is not None and output.inputs["Volume"].is_linked


def _crop(image: Float32, window: Window) -> Float32:
    """The window of a full frame; a cropped render is the window already."""
    x0, y0, x1, y1 = window
    if image.shape[:2] == (y1 - y0, x1 - x0):
        return image
    return np.ascontiguousarray(image[y0:y1, x0:x1])
