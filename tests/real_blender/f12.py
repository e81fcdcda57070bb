"""Run in a real Blender with a window: press F12, save the picture as the Image editor would, quit.

xvfb-blender FILE.blend --python f12.py -- PICTURE.png
"""

import os
import sys

import bpy

PATIENCE = 240  # seconds


def press_f12() -> None:
    """What the key does: the render operator, invoked, so that it runs as a job beside the interface."""
    bpy.app.handlers.render_complete.append(lambda *_: bpy.app.timers.register(save, first_interval=1.0))
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def save() -> None:
    """Back on the main thread, after the job."""
    bpy.data.images["Render Result"].save_render(sys.argv[sys.argv.index("--") + 1])
    print("F12: saved", flush=True)
    bpy.ops.wm.quit_blender()


def give_up() -> None:
    print(f"F12: no picture after {PATIENCE} s", flush=True)
    os._exit(3)


bpy.app.timers.register(press_f12, first_interval=1.0)
bpy.app.timers.register(give_up, first_interval=PATIENCE)
