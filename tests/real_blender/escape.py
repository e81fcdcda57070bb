"""Run in a real Blender with a window: press F12, press Esc while rays are traced, see how long it takes, quit.

xvfb-blender FILE.blend --python escape.py
"""

import os
import subprocess
import time

import bpy
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender import engine, pipeline

PATIENCE = 240  # seconds
pressed = 0.0
tracing = False


def watch(self, phase, fraction):
    """The engine's own progress, and a note when it traces."""
    global tracing
    tracing = tracing or (phase == "Tracing" and fraction > 0)
    return original(self, phase, fraction)


original = engine.HybridTracer._progress
engine.HybridTracer._progress = watch


def press_f12() -> None:
    bpy.context.scene.hybrid.samples = 16384  # minutes of work
    bpy.app.handlers.render_cancel.append(cancelled)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.render.render("INVOKE_DEFAULT")
    bpy.app.timers.register(press_escape, first_interval=0.5)


def press_escape() -> float | None:
    global pressed
    if not tracing:
        return 0.1
    pressed = time.perf_counter()
    subprocess.run(["xdotool", "mousemove", "600", "400", "key", "Escape"], check=True)
    return None


def cancelled(*_args: object) -> None:
    print(f"ESCAPE: {time.perf_counter() - pressed:.2f} s", flush=True)
    bpy.app.timers.register(look, first_interval=1.0)


def look() -> None:
    scene = bpy.context.scene
    temporary = [name for name in os.listdir(bpy.app.tempdir) if name.startswith("hybrid_")]
    standing = pipeline.mask_layer(scene) is not None and pipeline.trace_scene(scene) is not None
    print(f"LEFT: {temporary} PIPELINE: {standing}", flush=True)
    os._exit(0)


def give_up() -> None:
    print(f"ESCAPE: nothing after {PATIENCE} s, tracing {tracing}", flush=True)
    os._exit(3)


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(press_f12, first_interval=1.0)
bpy.app.timers.register(give_up, first_interval=PATIENCE)
