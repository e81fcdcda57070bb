# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real Blender with a window and the extension: F12, another IOR, the Retrace button, F12 again, quit.

xvfb-blender FILE.blend --python retrace.py -- PREFIX

Writes PREFIX_first.exr, PREFIX_again.exr (retraced), PREFIX_later.exr (the same, a second later) and PREFIX_whole.exr
(rendered with the same settings), and the screenshot PREFIX_window.png of both panels.
"""

import os
import sys
import threading
import time
from collections.abc import Iterator

import bpy
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender import session
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.pipeline import scene_setup
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.render import images, retrace

sys.path.insert(0, os.path.dirname(__file__))
import window as screen

PREFIX = sys.argv[sys.argv.index("--") + 1]
PATIENCE = 150  # seconds for each render
savers = set()
save_render = images._save_render


def save(*arguments) -> None:
    """Note who saves the picture: if not the thread that draws it, one of some renders stands still for ever."""
    savers.add(threading.current_thread())
    save_render(*arguments)


images._save_render = save


def steps() -> Iterator[float]:
    """One step after the other; each yields the seconds to wait."""
    scene, window = bpy.context.scene, bpy.context.window_manager.windows[0]
    scene.hybrid.enabled = True
    scene.render.resolution_percentage = 800  # of a small picture: saving it takes a while, in which it is drawn
    scene.eevee.taa_render_samples = 2
    areas = sorted(window.screen.areas, key=lambda a: a.width * a.height)
    areas[-1].type = "IMAGE_EDITOR"
    yield 1.0
    assert retrace.why_not(scene) == "there is no render to trace over: press F12 first"
    yield from job("first", lambda: bpy.ops.render.render("INVOKE_DEFAULT"))
    area = next(a for a in window.screen.areas if a.type == "IMAGE_EDITOR")
    area.spaces.active.image = bpy.data.images["Render Result"]
    area.spaces.active.show_region_ui = True
    assert retrace.why_not(scene) == "", retrace.why_not(scene)
    for b_object in scene_setup.ray_traced_objects(scene):
        b_object.hybrid.ior = 1.2
        b_object.hybrid.opacity = 0.1
    scene.hybrid.samples = 3
    yield 1.0
    assert retrace.why_not(scene) == "", retrace.why_not(scene)
    yield from job("again", lambda: bpy.ops.hybrid.retrace("INVOKE_DEFAULT"))
    yield 1.0
    assert not session.of(scene.name).retracing and retrace.why_not(scene) == "", retrace.why_not(scene)
    screen.shoot(f"{PREFIX}_window.png")
    images.write_render_result(f"{PREFIX}_later.exr", scene)  # the nodes are back: Blender has composited once more
    yield from job("whole", lambda: bpy.ops.render.render("INVOKE_DEFAULT"))
    scene_setup.ray_traced_objects(scene)[0].location.x += 0.1
    yield 1.0
    assert "press F12" in retrace.why_not(scene)
    assert savers == {threading.main_thread()}, savers
    print("RETRACE: done", flush=True)
    os._exit(0)


def job(name: str, start) -> Iterator[float]:
    """Run a render as a job, the interface drawing it all the time beside it, and save its picture."""
    window, began = bpy.context.window_manager.windows[0], time.perf_counter()
    ended = []
    bpy.app.handlers.render_complete.append(lambda *_: ended.append(True))
    with bpy.context.temp_override(window=window, screen=window.screen):
        state = start()
    assert state & {"RUNNING_MODAL", "FINISHED"}, state
    assert not ended, "it did not run beside the interface"
    while not ended or bpy.app.is_job_running("RENDER"):
        assert time.perf_counter() - began < PATIENCE, name
        for area in window.screen.areas:
            area.tag_redraw()
        yield 0.002
    print(f"RETRACE: {name} {time.perf_counter() - began:.1f} s", flush=True)
    images.write_render_result(f"{PREFIX}_{name}.exr", bpy.context.scene)


running = steps()
screen.limit(280)
screen.soon(lambda: next(running), 2.0)
