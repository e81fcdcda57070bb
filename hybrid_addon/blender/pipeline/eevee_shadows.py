# SPDX-License-Identifier: GPL-3.0-or-later
"""Who draws the shadows of ray traced objects on what EEVEE draws: EEVEE, or with Traced Shadows the tracer.

EEVEE casts them whether an object is held out or not. It is told not to in the evaluated copies of one render, which
Blender throws away with it: nothing of the user's data is written to, nor what his viewports show.
"""

from __future__ import annotations

import bpy

from .. import session
from ..view_layers import MASK_MARK, imitated_by
from . import held_out, scene_setup


def hand_over(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Take EEVEE's shadows from the ray traced objects, in the depsgraph of a render of the mask layer, or give them.

    An instance casts as the object that it is an instance of.
    """
    if depsgraph.mode != "RENDER" or not depsgraph.view_layer.get(MASK_MARK):
        return
    traced = session.of(scene.name).traces_shadows = scene_setup.traces_shadows(scene)
    held_out.hold_out(depsgraph, casts=not traced)
    if not (traced or scene.render.use_persistent_data):
        return
    chosen = set(scene_setup.ray_traced_objects(scene, imitated_by(scene, depsgraph.view_layer)))
    by_tracer, by_eevee = set[bpy.types.Object](), set[bpy.types.Object]()
    for b_instance in depsgraph.object_instances:
        owner = (b_instance.parent or b_instance.object).original
        (by_tracer if traced and owner in chosen else by_eevee).add(b_instance.object.original)
    for b_object in by_tracer | by_eevee:
        evaluated, casts = b_object.evaluated_get(depsgraph), b_object.visible_shadow and b_object in by_eevee
        if evaluated.visible_shadow != casts:
            evaluated.visible_shadow = casts
    session.of(scene.name).casting = sorted(b_object.name for b_object in by_tracer & by_eevee)


def warnings(scene: bpy.types.Scene) -> list[str]:
    """What of it could not be done in the last render."""
    names = session.of(scene.name).casting
    if not names or not scene_setup.traces_shadows(scene):  # which takes longer to tell
        return []
    return [f"object {name!r}: instances that are not ray traced, too, keep EEVEE's shadow for all" for name in names]
