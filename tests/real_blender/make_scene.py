# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real Blender with the extension installed: a small moving scene, set up for hybrid rendering, saved.

blender -b --python make_scene.py -- FILE.blend
"""

import sys

import bpy
from bl_ext.user_default import hybrid_addon as hybrid


def add(name: str, location: tuple[float, float, float], rgb: tuple[float, float, float]) -> bpy.types.Object:
    """Name, place and colour the object that an operator has just made."""
    obj = bpy.context.object
    obj.name, obj.location = name, location
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*rgb, 1.0)
    material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 1.0
    obj.data.materials.append(material)
    return obj


bpy.ops.wm.read_factory_settings(use_empty=True)  # so that the file has no "Render Result" image of its own yet
bpy.ops.preferences.addon_enable(module="bl_ext.user_default.hybrid_addon")
scene = bpy.context.scene
scene.world = bpy.data.worlds.new("World")
bpy.ops.object.light_add(type="SUN", rotation=(0.6, 0.3, 0))
bpy.ops.object.camera_add()
scene.camera = bpy.context.object
bpy.ops.mesh.primitive_plane_add(size=20)
add("Floor", (0, 0, 0), (0.5, 0.5, 0.5))
bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
ball = add("Ball", (0, 0, 1), (0.8, 0.8, 0.8))
bpy.ops.object.shade_smooth()
bpy.ops.mesh.primitive_cube_add(size=1)
cube = add("Cube", (1.5, -1.5, 0.5), (0.8, 0.05, 0.05))
for frame, x in ((1, 1.8), (3, 0.2)):
    cube.location.x = x
    cube.keyframe_insert("location", index=0, frame=frame)
scene.camera.location, scene.camera.rotation_euler = (0, -7, 2.5), (1.3, 0, 0)
scene.frame_start, scene.frame_end = 1, 3
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 64, 100
scene.view_settings.view_transform, scene.render.dither_intensity = "Standard", 0.0
scene.eevee.taa_render_samples = 4
scene.hybrid.samples = 4
hybrid.mark(ball, reflectivity=1.0)
hybrid.enable(scene)
scene.frame_set(1)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[sys.argv.index("--") + 1])
