# SPDX-License-Identifier: GPL-3.0-or-later
"""A note in every saved file, for whoever opens it without the add-on: what he sees is EEVEE alone, and why.

A text, and a custom property of each hybrid scene that points to it. They are in the file only: written before it is
saved, taken away after it and wherever the add-on opens it.
"""

from __future__ import annotations

import bpy

from . import scene_setup

TITLE = "Hybrid Ray Tracing"
"""Name of the text and of the property."""

MARK = "hybrid_note"  # custom property on our text

POINTER = f"Not installed here? Then EEVEE draws everything. See the text '{TITLE}' in a Text Editor"

HEAD = """This file was made with the Blender extension "Hybrid Ray Tracing".

Where the extension is not installed, it renders with plain EEVEE: complete, but without ray tracing.
To have these objects ray traced, install and enable the extension and open the file again:
"""

TAIL = """
The settings are kept in the file. Switch Hybrid off (Properties > Render > Hybrid) and save, and this note is gone.
"""


def leave() -> None:
    """Write the note, if a scene of this file is hybrid."""
    scenes = [scene for scene in bpy.data.scenes if scene_setup.is_active(scene)]
    take_back()
    if not scenes:
        return
    text = bpy.data.texts.new(TITLE)
    text[MARK] = True
    text.write("\n".join([HEAD, *map(_line, scenes), TAIL]))
    text.cursor_set(0)
    for scene in scenes:
        if TITLE not in scene:
            scene[TITLE] = POINTER


def _line(scene: bpy.types.Scene) -> str:
    names = [ob.name for ob in scene_setup.ray_traced_objects(scene)]
    names += [f"material '{b_material.name}'" for b_material in scene_setup.ray_traced_materials(scene)]
    return f"- scene '{scene.name}': {', '.join(names) or 'none yet'}"


def take_back() -> bool:
    """Remove what `leave` wrote, here or before, or what came with an appended scene; whether there was any."""
    texts = [text for text in bpy.data.texts if MARK in text and text.library is None]
    scenes = [scene for scene in bpy.data.scenes if scene.library is None and scene.get(TITLE) == POINTER]
    for text in texts:
        bpy.data.texts.remove(text)
    for scene in scenes:
        del scene[TITLE]
    return bool(texts or scenes)
