# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real Blender with a window and the extension: show both panels, press F12, take a screenshot, quit.

xvfb-blender --python panels.py -- PICTURE.png (and PICTURE_german.png, in German and the light theme)

Left the Object tab, right the Render tab; both panels opened, as an artist would click, and the interface small enough
to show them whole. Before that all panels are measured at the default width, in English and in German: prints CUT and
the words that Blender would cut.
"""

import os
import sys
from pathlib import Path

import bpy
from bl_ext.user_default import hybrid_addon as hybrid
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.ui import advice, panels, render_panels
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.ui.image_editor import editor_panels

sys.path.insert(0, os.path.dirname(__file__))
sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "blender", "ui"))
import labels
import window as screen

SCROLLED = 13
"""Steps of the mouse wheel down to our panel: its title is at the top."""
PICTURE = sys.argv[sys.argv.index("--") + 1]


ALL = [
    c for room in (panels, editor_panels, render_panels, advice) for c in room.CLASSES if issubclass(c, bpy.types.Panel)
]


def open_all() -> None:
    """No panel is closed at first; a parent comes before its children."""
    for panel in reversed(ALL):
        bpy.utils.unregister_class(panel)
    for panel in ALL:
        panel.bl_options = set()
        bpy.utils.register_class(panel)


def measure() -> None:
    """Every word of every panel, where Blender draws it at first: in the Properties editor at the right."""
    window, view = bpy.context.window_manager.windows[0], bpy.context.preferences.view
    area = next(area for area in window.screen.areas if area.type == "PROPERTIES")
    region = next(region for region in area.regions if region.type == "WINDOW")
    cube = bpy.data.objects["Wine Glass"]
    view.use_translate_interface = True
    for language in ("en_US", "de_DE"):
        view.language = language
        assert language in bpy.app.translations.locale
        for surface in ("MATERIAL", "CUSTOM"):
            cube.hybrid.surface = surface
            with bpy.context.temp_override(window=window, area=area, region=region, object=cube,
                                           material=cube.active_material):  # fmt: skip
                found = {panel.__name__: words for panel in ALL if (words := labels.cut(panel, bpy.context))}
            print("CUT", language, region.width, found, flush=True)
    view.language = "en_US"


def arrange() -> None:
    """Mark a glass, render, and turn the two largest editors into Properties editors."""
    scene = bpy.context.scene
    window = bpy.context.window_manager.windows[0]
    open_all()
    scene.render.resolution_x, scene.render.resolution_y, scene.eevee.taa_render_samples = 96, 72, 1
    cube = bpy.data.objects["Cube"]
    cube.name = "Wine Glass"
    hybrid.mark(cube, reflectivity=0.0, opacity=0.0, ior=1.5)
    hybrid.render(scene, samples=4)
    hybrid.enable(scene)
    measure()
    bpy.context.preferences.view.ui_scale = 0.75
    view = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    view.type = "PROPERTIES"
    with bpy.context.temp_override(window=window, area=view, region=view.regions[-1]):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    halves = sorted((a for a in window.screen.areas if a.type == "PROPERTIES"), key=lambda a: a.x)
    for half, tab in zip(halves, ("OBJECT", "RENDER"), strict=False):
        half.spaces.active.context = tab
    screen.soon(scroll)


def scroll() -> None:
    """Down to our panel."""
    window = bpy.context.window_manager.windows[0]
    for area in window.screen.areas:
        if area.type == "PROPERTIES" and area.spaces.active.context == "RENDER":
            with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
                for _ in range(SCROLLED):
                    bpy.ops.view2d.scroll_down()
    screen.soon(shoot, 2.0)


def shoot() -> None:
    """The picture; then the same in German, in the light theme."""
    screen.shoot(PICTURE)
    themes = (Path(folder, "interface_theme", "Blender_Light.xml") for folder in bpy.utils.preset_paths(""))
    light = next(path for path in themes if path.is_file())
    bpy.ops.script.execute_preset(filepath=str(light), menu_idname="USERPREF_MT_interface_theme_presets")
    bpy.context.preferences.view.language = "de_DE"
    screen.soon(shoot_german, 2.0)


def shoot_german() -> None:
    """The second picture is the end."""
    screen.shoot(PICTURE.replace(".png", "_german.png"))
    print("PANELS: saved", flush=True)
    os._exit(0)


screen.soon(arrange)
