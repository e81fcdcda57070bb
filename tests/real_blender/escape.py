# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real Blender with a window: press F12, see the picture grow, press Esc, see how long it takes; then have
renders fail, see how soon the window says why; quit.

xvfb-blender FILE.blend --python escape.py
"""

import os
import subprocess
import sys
import time
from collections.abc import Iterator

import bpy
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender import session
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.errors import HybridError
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.pipeline import scene_setup
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.render import engine
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.ui import messages

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
    steps = reasons()
    screen.soon(lambda: next(steps))


def no_embree() -> None:
    raise HybridError("Embree does not load on this system: no such file")


def no_memory(*_args: object) -> None:
    raise MemoryError("not enough memory: film 12 GB")


def warned(*args: object):
    frame, film = traced(*args)
    frame.report["warnings"].append("a line")
    return frame, film


traced = engine.trace_frame


def reasons() -> Iterator[float]:
    """Renders without EEVEE, each of which fails or warns in its own way: prints what is said how long after it."""
    scene, told = bpy.context.scene, []
    scene.hybrid.mode, scene.hybrid.samples = "FULL", 1
    session.Session.fail = lambda own, error, fail=session.Session.fail: (told.append(time.perf_counter()),
                                                                           fail(own, error))  # fmt: skip
    bpy.app.handlers.render_complete.append(lambda *_: told.append(time.perf_counter()))
    messages.say = lambda level, text, say=messages.say: (told.append((time.perf_counter(), level, text)),
                                                          say(level, text))  # fmt: skip
    for name, owner, changed, value in (
        ("camera", scene, "camera", bpy.data.objects["Cube"]),
        ("embree", engine, "require_tracer", no_embree),
        ("memory", engine, "trace_frame", no_memory),
        ("warning", engine, "trace_frame", warned),
    ):
        before = getattr(owner, changed)
        setattr(owner, changed, value)
        yield 0.5
        told.clear()
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            bpy.ops.render.render("INVOKE_DEFAULT")
        while not (told and isinstance(told[-1], tuple)):
            yield 0.05
        at, level, text = told[-1]
        print(f"REASON {name} {at - told[0]:.2f} {level} {text}", flush=True)
        while bpy.app.is_job_running("RENDER"):
            yield 0.1
        setattr(owner, changed, before)
    os._exit(0)


screen.soon(press_f12)
