# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real Blender with a window: press F12, save the picture as the Image editor would, quit.

xvfb-blender FILE.blend --python f12.py -- PICTURE.png
"""

import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(__file__))
import window as screen


def press_f12() -> None:
    """What the key does: the render operator, invoked, so that it runs as a job beside the interface."""
    bpy.app.handlers.render_complete.append(lambda *_: screen.soon(save))
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def save() -> None:
    """Back on the main thread, after the job."""
    bpy.data.images["Render Result"].save_render(sys.argv[sys.argv.index("--") + 1])
    print("F12: saved", flush=True)
    bpy.ops.wm.quit_blender()


screen.soon(press_f12)
