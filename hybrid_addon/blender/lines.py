# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines that Blender draws over a render: Freestyle's and Grease Pencil's.

Freestyle leaves out what is held out. So its lines come from the user's own layer, as a pass, and lie over both halves.
Grease Pencil is laid over what an engine has rendered, hidden by surfaces only where the layer has the pass Depth.
"""

from __future__ import annotations

import bpy

from .view_layers import source_layer


def draws_grease_pencil(scene: bpy.types.Scene) -> bool:
    """Whether Blender lays Grease Pencil over EEVEE's picture."""
    if not getattr(source_layer(scene), "use_grease_pencil", True):  # Blender 4.5 has no such switch
        return False
    instanced = (ob.instance_collection for ob in scene.objects if ob.instance_type == "COLLECTION")
    owners = [scene, *filter(None, instanced)]
    return any(ob.type == "GREASEPENCIL" for owner in owners for ob in getattr(owner, "all_objects", owner.objects))


def draws_freestyle(scene: bpy.types.Scene) -> bool:
    """Whether Freestyle draws lines into the user's layer."""
    return bool(scene.render.use_freestyle and source_layer(scene).use_freestyle)


def warnings(scene: bpy.types.Scene) -> list[str]:
    """What of the lines a hybrid picture has not."""
    if scene.hybrid.mode == "FULL" and draws_freestyle(scene):
        return ["Freestyle draws its lines over EEVEE's picture: there are none where the ray tracer draws everything"]
    return []
