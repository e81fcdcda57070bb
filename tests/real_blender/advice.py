# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real Blender with a window and the extension: fill the advice, flag it, undo, take screenshots, quit.

xvfb-blender --python advice.py -- FOLDER

Writes advice.png (the Hybrid panel with its list; the material's, the object's and the collection's panels beside it)
and prints ADVICE: ok once flagging, and undoing it, did what they say.
"""

import os
import sys
from pathlib import Path

import bpy
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.pipeline import scene_setup
from bl_ext.user_default.hybrid_addon.hybrid_addon.blender.ui import advice, panels, render_panels

sys.path.insert(0, os.path.dirname(__file__))
import window as screen

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
GLASS, MIRROR = "Wine Glass", "Mirror Ball"


def material(name: str, **values: float) -> bpy.types.Material:
    """A Principled material of this roughness, transmission, metallic."""
    b_material = bpy.data.materials.new(name)
    b_material.use_nodes = True
    for socket, value in values.items():
        b_material.node_tree.nodes["Principled BSDF"].inputs[socket.replace("_", " ")].default_value = value
    return b_material


def ball(name: str, x: float, b_material: bpy.types.Material) -> None:
    """A ball on the floor."""
    bpy.ops.mesh.primitive_uv_sphere_add(location=(x, 0, 1))
    bpy.context.object.name = name
    bpy.context.object.data.materials.append(b_material)


def opened(found: list[type]) -> None:
    """The panels, none closed at first; a parent comes before its children."""
    for panel in reversed(found):
        bpy.utils.unregister_class(panel)
    for panel in found:
        panel.bl_options = set()
        bpy.utils.register_class(panel)


def arrange() -> None:
    """Glass and mirror on a floor; ask; flag all; undo; flag again."""
    scene = bpy.context.scene
    window = bpy.context.window_manager.windows[0]
    view = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    with bpy.context.temp_override(window=window, area=view, region=view.regions[-1]):
        bpy.ops.object.select_all(action="DESELECT")
        bpy.data.objects["Cube"].select_set(True)
        bpy.ops.object.delete()
        bpy.ops.mesh.primitive_plane_add(size=60)
        ball(MIRROR, 1.2, material("Mirror", Roughness=0.0, Metallic=1.0))
        ball(GLASS, -1.2, material("Glass", Roughness=0.0, Transmission_Weight=1.0))
        scene.hybrid.enabled = True
        bpy.ops.ed.undo_push(message="made")
        assert bpy.ops.hybrid.advise("EXEC_DEFAULT") == {"FINISHED"}
        assert bpy.ops.hybrid.flag_advised("EXEC_DEFAULT", True) == {"FINISHED"}
        assert names() == {GLASS, MIRROR}, names()
        bpy.ops.ed.undo()
    screen.soon(again)


def names() -> set[str]:
    """What is ray traced."""
    return {ob.name for ob in scene_setup.ray_traced_objects(bpy.context.window_manager.windows[0].scene)}


def again() -> None:
    """After the undo nothing is ray traced; redo, and show the panels."""
    window = bpy.context.window_manager.windows[0]
    assert names() == set(), names()
    view = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    with bpy.context.temp_override(window=window, area=view, region=view.regions[-1]):
        bpy.ops.ed.redo()
        assert names() == {GLASS, MIRROR}, names()
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    every = (*panels.CLASSES, *render_panels.CLASSES, *advice.CLASSES)
    opened([panel for panel in every if issubclass(panel, bpy.types.Panel)])
    areas = [area for area in window.screen.areas if area.type in {"VIEW_3D", "PROPERTIES"}]
    areas.sort(key=lambda area: (area.x, -area.y))
    for area in areas[:3]:
        area.type = "PROPERTIES"
    screen.soon(tabs)


def tabs() -> None:
    """Which panel each Properties editor shows."""
    areas = [area for area in bpy.context.window_manager.windows[0].screen.areas if area.type == "PROPERTIES"]
    areas.sort(key=lambda area: (area.x, -area.y))
    for area, tab in zip(areas, ("RENDER", "MATERIAL", "COLLECTION"), strict=False):
        area.spaces.active.context = tab
    print("ADVICE: ok", flush=True)
    screen.soon(scroll)


def scroll() -> None:
    """Down to our panels."""
    window = bpy.context.window_manager.windows[0]
    for area in window.screen.areas:
        region = next(region for region in area.regions if region.type == "WINDOW")
        if area.type == "PROPERTIES" and area.spaces.active.context in {"RENDER", "MATERIAL"}:
            with bpy.context.temp_override(window=window, area=area, region=region):
                for _ in range(40):
                    bpy.ops.view2d.scroll_down()
    screen.soon(shoot, 2.0)


def shoot() -> None:
    """The picture is the end."""
    screen.shoot(str(FOLDER / "advice.png"))
    os._exit(0)


bpy.context.preferences.view.ui_scale = 0.8
screen.soon(arrange)
