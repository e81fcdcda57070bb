# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real Blender with a window and the extension: a first hour with it, by keys and clicks; then quit.

xvfb-blender --enable-event-simulate --python artist.py -- FOLDER

Enables the add-on, ticks an object, presses F12, looks at insets and at one pixel, changes a slider and undoes that,
saves, opens the file again, undoes an edit that the pipeline had followed, disables the add-on, enables and disables
it with the file open. Writes insets.png, traced.png, pixel.png, pixel.txt, disabled.png and
artist.blend there, and prints ARTIST: done.
"""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, os.path.dirname(__file__))
import window as screen

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
PACKAGE = "bl_ext.user_default.hybrid_addon"
PATIENCE = 120  # seconds for a render on a busy machine


def window() -> bpy.types.Window:
    """The only one."""
    return bpy.context.window_manager.windows[0]


def area(kind: str) -> bpy.types.Area:
    """The first of this kind."""
    return next(area for area in window().screen.areas if area.type == kind)


def press(key: str, x: int = 0, y: int = 0) -> None:
    """A key, or a button of the mouse at this place of the window."""
    x, y = (x, y) if x else (window().width // 2, window().height // 2)
    window().event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(key, value, x=x, y=y)


def rendered() -> Iterator[float]:
    """Press F12 and wait for the picture."""
    ended: list[bool] = []
    handler = bpy.app.handlers.render_complete
    handler.append(lambda *_: ended.append(True))
    press("F12")
    for _ in range(PATIENCE * 10):
        yield 0.1
        if ended:
            break
    handler.pop()
    assert ended, "F12 gave no picture"
    yield 0.5


def place(u: float, v: float) -> tuple[int, int]:
    """Where in the window this part of the picture is drawn."""
    region = next(region for region in area("IMAGE_EDITOR").regions if region.type == "WINDOW")
    x, y = region.view2d.view_to_region(u, v, clip=False)
    return region.x + x, region.y + y


def steps() -> Iterator[float]:
    """One step after the other; each yields the seconds to wait."""
    bpy.ops.preferences.addon_enable(module=PACKAGE)
    scene, cube = bpy.context.scene, bpy.data.objects["Cube"]
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 240, 180, 50
    scene.eevee.taa_render_samples, scene.hybrid.samples = 1, 4
    bpy.context.preferences.view.render_display_type = "SCREEN"
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 0, -1))
    bpy.data.meshes["Plane"].materials.append(bpy.data.materials["Material"].copy())
    cube.hybrid.ray_traced, scene.hybrid.enabled = True, True
    cube.hybrid.opacity = 0.0
    yield 0.2
    yield from rendered()
    editor = area("IMAGE_EDITOR")
    editor.spaces.active.show_region_ui = True
    scene.hybrid.insets = True
    yield 0.2
    sidebar = next(region for region in editor.regions if region.type == "UI")
    sidebar.active_panel_category = "Hybrid"
    with bpy.context.temp_override(window=window(), area=editor, region=editor.regions[-1]):
        bpy.ops.image.view_zoom_ratio("EXEC_DEFAULT", ratio=4.0)
    yield 0.5
    screen.shoot(str(FOLDER / "insets.png"))
    scene.hybrid.shown = "TRACED"
    yield 0.5
    screen.shoot(str(FOLDER / "traced.png"))
    scene.hybrid.shown = "PICTURE"
    with bpy.context.temp_override(window=window(), area=editor, region=editor.regions[-1]):
        assert bpy.ops.hybrid.explain_pixel("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield 0.2
    press("LEFTMOUSE", *place(60.5 / 120, 45.5 / 90))
    while "Hybrid Pixel" not in bpy.data.texts:
        yield 0.1
    yield 2.0  # for the sidebar to be open
    screen.shoot(str(FOLDER / "pixel.png"))
    (FOLDER / "pixel.txt").write_text(bpy.data.texts["Hybrid Pixel"].as_string(), encoding="utf-8")
    press("ESC")
    yield 0.2
    from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.pipeline import scene_setup

    with bpy.context.temp_override(window=window(), object=cube):
        bpy.ops.wm.context_set_float("EXEC_DEFAULT", True, data_path="object.hybrid.opacity", value=0.5)
        assert bpy.data.objects["Cube"].hybrid.opacity == 0.5
        bpy.ops.ed.undo()
    yield 0.3
    assert bpy.data.objects["Cube"].hybrid.opacity == 0.0
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "artist.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "artist.blend"))
    yield 0.5
    assert scene_setup.is_active(bpy.context.scene) and bpy.context.scene.hybrid.insets
    assert [ob.name for ob in scene_setup.ray_traced_objects(bpy.context.scene)] == ["Cube"]
    yield from rendered()
    layer = bpy.context.view_layer.layer_collection.children["Collection"]
    with bpy.context.temp_override(window=window()):
        layer.exclude = True
        bpy.ops.ed.undo_push(message="exclude")
        yield 0.5  # the pipeline follows, by a step of its own
        bpy.ops.ed.undo()
    yield 0.5
    assert not bpy.context.view_layer.layer_collection.children["Collection"].exclude, "one Ctrl Z is not enough"
    bpy.ops.preferences.addon_disable(module=PACKAGE)
    assert len(bpy.context.scene.view_layers) == 1
    bpy.ops.preferences.addon_enable(module=PACKAGE)
    for _ in range(50):
        yield 0.1
        if len(bpy.context.scene.view_layers) == 2:
            break
    assert len(bpy.context.scene.view_layers) == 2, "enabled with a hybrid file open, and it waits for an edit"
    bpy.ops.preferences.addon_disable(module=PACKAGE)
    yield 0.5
    assert len(bpy.context.scene.view_layers) == 1 and not hasattr(bpy.context.scene, "hybrid")
    screen.shoot(str(FOLDER / "disabled.png"))
    print("ARTIST: done", flush=True)
    os._exit(0)


_steps = steps()
screen.soon(lambda: next(_steps), persistent=True)
