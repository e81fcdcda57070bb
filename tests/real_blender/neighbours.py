# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real Blender before a render: other add-ons' handlers, of every kind that there is, which do what such do.

blender -b FILE.blend --python neighbours.py -f 1      (or with a window, before f12.py)
"""

import collections

import addon_utils
import bpy
from bpy.app.handlers import persistent

called: collections.Counter = collections.Counter()
KINDS = [name for name in dir(bpy.app.handlers) if isinstance(getattr(bpy.app.handlers, name), list)]


def handler(name: str):
    """Count the call; edit what other add-ons edit, where they edit it."""

    @persistent
    def call(*arguments: object) -> None:
        called[name] += 1
        scene = arguments[0] if arguments and isinstance(arguments[0], bpy.types.Scene) else bpy.context.scene
        if name == "frame_change_post":
            scene["neighbour_frame"] = scene.frame_current
        elif name == "render_init" and bpy.app.background:
            bpy.data.collections.new("Neighbour")
        elif name == "render_pre" and bpy.app.background:
            scene.render.use_stamp_note = True
        elif name == "depsgraph_update_post" and called[name] < 5:
            scene["neighbour_updates"] = called[name]  # an update from within an update

    return call


own = {name: handler(name) for name in KINDS}
for name, call in own.items():
    getattr(bpy.app.handlers, name).insert(0, call)


def left_alone() -> None:
    """Say whether they all still stand once the extension is gone; and which were called."""
    addon_utils.disable("bl_ext.user_default.hybrid_addon")
    standing = all(own[name] in getattr(bpy.app.handlers, name) for name in KINDS)
    ours = [call for name in KINDS for call in getattr(bpy.app.handlers, name) if "hybrid" in call.__module__]
    print("NEIGHBOURS:", standing, ours)
    print("CALLED:", *(name for name in KINDS if called[name]), flush=True)


bpy.app.driver_namespace["left_alone"] = left_alone
