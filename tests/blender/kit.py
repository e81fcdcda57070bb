# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests build scenes with: an empty scene of EEVEE's, small worlds, node trees in both versions of Blender."""

from __future__ import annotations

import bpy

SMALL = "512"
"""World.probe_resolution of tests: at Blender's own 1024, EEVEE's picture of the world takes four fifths of the time of
a small render on software OpenGL, and so it does where there is no world. At 128 its light is 2 % too dark."""


@bpy.app.handlers.persistent
def small_worlds(*_):
    """Those of the file that was just read."""
    for b_world in bpy.data.worlds:
        b_world.probe_resolution = SMALL


def nodes_of(b_id):
    """The node tree of a material or a world, which before Blender 5 has one only if asked to."""
    if bpy.app.version < (5, 0, 0):
        b_id.use_nodes = True
    return b_id.node_tree


def new_world(name="World"):
    """A world as Blender makes it, but small."""
    b_world = bpy.data.worlds.new(name)
    b_world.probe_resolution = SMALL
    nodes_of(b_world)
    return b_world


def empty_scene(width, height, samples):
    """A scene of EEVEE's without objects or lights, black, no shadows: most of the time of software OpenGL.

    width, height: pixels. samples: EEVEE's.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    b_scene = bpy.context.scene
    kinds = {item.identifier for item in b_scene.render.bl_rna.properties["engine"].enum_items}
    b_scene.render.engine = "BLENDER_EEVEE" if "BLENDER_EEVEE" in kinds else "BLENDER_EEVEE_NEXT"
    b_scene.render.resolution_x, b_scene.render.resolution_y = width, height
    b_scene.eevee.taa_render_samples, b_scene.eevee.use_shadows = samples, False
    b_scene.world = new_world()
    b_scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    return b_scene
