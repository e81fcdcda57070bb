# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real Blender with a window and the extension: wait for the viewport's preview, take screenshots, quit.

xvfb-blender FILE.blend --python preview.py -- PREFIX

Writes PREFIX_eevee.png (rendered shading through the camera), PREFIX_traced.png (with the preview), PREFIX_orbit.png
(after the view has moved) and PREFIX_without.png (through the camera, with the add-on disabled); prints when the first
and the last picture were there.
"""

import os
import sys
import time
from collections.abc import Iterator

import bpy
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender import preview
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.pipeline import scene_setup

sys.path.insert(0, os.path.dirname(__file__))
import window as screen

PREFIX = sys.argv[sys.argv.index("--") + 1]
PATIENCE = 60  # seconds for each preview
PACKAGE = "bl_ext.user_default.hybrid_addon"


def shoot(name: str) -> None:
    """The screen as it is now."""
    screen.shoot(f"{PREFIX}_{name}.png")


def steps() -> Iterator[float]:
    """One step after the other; each yields the seconds to wait."""
    scene = bpy.context.scene
    area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    space = area.spaces.active
    space.overlay.show_overlays = space.show_gizmo = False
    space.region_3d.view_perspective = "CAMERA"
    space.shading.type = "RENDERED"
    scene.eevee.taa_samples = 4
    scene.hybrid.enabled = True
    yield 6.0  # EEVEE compiles its shaders
    shoot("eevee")
    for name in ("traced", "orbit"):
        if name == "orbit":
            space.region_3d.view_perspective = "PERSP"
            area.tag_redraw()
        scene.hybrid.preview = True
        yield from preview_comes(name)
        yield 0.5
        shoot(name)
    yield from moves_and_modes(scene, area, space)
    space.region_3d.view_perspective = "CAMERA"
    bpy.ops.preferences.addon_disable(module=PACKAGE)
    area.tag_redraw()
    yield 2.0
    shoot("without")
    print("PREVIEW: done", flush=True)
    os._exit(0)


def moves_and_modes(scene: bpy.types.Scene, area: bpy.types.Area, space: bpy.types.SpaceView3D) -> Iterator[float]:
    """The picture is held while the view moves, comes in local view, and not over what is edited."""
    space.region_3d.view_distance *= 1.1
    area.tag_redraw()
    while not any(v.moved is not None and v.layer is None for v in preview._preview.viewports.values()):
        yield 0.02
    traced = scene_setup.ray_traced_objects(scene)[0]
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
        bpy.ops.object.select_all(action="DESELECT")
        traced.select_set(True)
        bpy.context.view_layer.objects.active = traced
        bpy.ops.view3d.localview(frame_selected=False)
    yield from preview_comes("local")
    assert preview.shown_in(space, scene) == {traced.name_full}
    with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
        bpy.ops.view3d.localview(frame_selected=False)
        bpy.ops.object.mode_set(mode="EDIT")
    yield 1.0
    assert "is being edited" in preview.why_not(scene, space) and not preview._preview.viewports
    with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
        bpy.ops.object.mode_set(mode="OBJECT")
    print("PREVIEW: held, local, not edited", flush=True)


def preview_comes(name: str) -> Iterator[float]:
    """Wait until the work on the view is done and its picture is on the screen."""
    began, first = time.perf_counter(), 0.0
    while time.perf_counter() - began < PATIENCE:
        yield 0.1
        shown = list(preview._preview.viewports.values())
        if not first and any(v.layer is not None for v in shown):
            first = time.perf_counter() - began
        if shown and all(v.job is not None and v.job.done and v.layer is not None for v in shown):
            break
    print(f"PREVIEW: {name}: first {first:.2f} s, all {time.perf_counter() - began:.2f} s", flush=True)


_steps = steps()
screen.soon(lambda: next(_steps))
