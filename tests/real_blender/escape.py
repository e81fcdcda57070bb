# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real Blender with a window: press F12, see the picture grow, press Esc, see how long it takes, quit.

xvfb-blender FILE.blend --python escape.py
"""

import os
import subprocess
import sys
import time

import bpy
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender import session
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.pipeline import scene_setup
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.render import engine

sys.path.insert(0, os.path.dirname(__file__))
import window as screen

pressed = 0.0
tracing = False
pictures = {}  # those that grew, kept so that their ids stay theirs


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
    screen.soon(press_escape, 0.5)


def press_escape() -> float | None:
    global pressed
    so_far = session.of(bpy.context.scene.name).so_far
    if so_far is not None and so_far.picture is not None:
        pictures[id(so_far.picture)] = so_far.picture
    if not tracing or len(pictures) < 3:  # EEVEE's half, a coarse one, a finer one
        return 0.1
    pressed = time.perf_counter()
    subprocess.run(["xdotool", "mousemove", "600", "400", "key", "Escape"], check=True)
    return None


def cancelled(*_args: object) -> None:
    print(f"ESCAPE: {time.perf_counter() - pressed:.2f} s", flush=True)
    screen.soon(look)


def look() -> None:
    scene = bpy.context.scene
    temporary = [name for name in os.listdir(bpy.app.tempdir) if name.startswith("hybrid_")]
    standing = scene_setup.mask_layer(scene) is not None and scene_setup.trace_scene(scene) is not None
    so_far = session.of(scene.name).so_far
    print(f"KEPT: {so_far is not None and so_far.picture is not None and so_far.text.startswith('Stopped')}")
    print(f"LEFT: {temporary} PIPELINE: {standing}", flush=True)
    os._exit(0)


screen.soon(press_f12)
