# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the picture of the manual that shows one mesh, of which one material is ray traced: an eye and its cornea.

python tools/slots_picture.py OUTPUT.png

Left EEVEE alone, right the same file with *Material > Hybrid > Ray Traced* on the cornea.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from leave import leave  # noqa: E402

import hybrid_addon as hybrid  # noqa: E402

SIZE, SAMPLES = 300, 8


def material(name: str, color: tuple[float, float, float], **inputs: float) -> bpy.types.Material:
    """A Principled BSDF."""
    b_material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        b_material.use_nodes = True
    shader = b_material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1)
    for key, value in inputs.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    return b_material


def eye() -> bpy.types.Object:
    """One mesh of four materials: the white, the iris, the pupil, and the cornea, a ball of glass around these."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, segments=96, ring_count=64, rotation=(np.pi / 2, 0, 0))
    ball = bpy.context.object
    bpy.ops.object.transform_apply()
    for b_material in (
        material("White", (0.85, 0.8, 0.76), Roughness=0.4),
        material("Iris", (0.05, 0.25, 0.45), Roughness=0.5),
        material("Pupil", (0.005, 0.005, 0.005), Roughness=0.5),
    ):
        ball.data.materials.append(b_material)
    for face in ball.data.polygons:
        x, y, z = face.center
        radius = np.hypot(x, z) if y < 0 else 1.0
        face.material_index = 2 if radius < 0.2 else 1 if radius < 0.45 else 0
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.62, segments=96, ring_count=64, location=(0, -0.62, 0))
    cornea = bpy.context.object
    cornea.data.materials.append(material("Cornea", (1, 1, 1), Roughness=0.0, Transmission_Weight=1.0, IOR=1.38))
    ball.select_set(True)
    bpy.context.view_layer.objects.active = ball
    bpy.ops.object.join()
    bpy.ops.object.shade_smooth()
    return ball


def stage() -> bpy.types.Scene:
    """The eye on a table, in the light of a window."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.eevee.taa_render_samples = SAMPLES
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.35, 0.4, 0.5, 1)
    bpy.ops.mesh.primitive_plane_add(size=8, location=(0, 0, -1))
    bpy.context.object.data.materials.append(material("Table", (0.35, 0.2, 0.12), Roughness=0.6))
    bpy.ops.object.light_add(type="AREA", location=(-2.5, -3, 3))
    lamp = bpy.context.object
    lamp.rotation_euler, lamp.data.energy, lamp.data.size = (0.75, 0, -0.7), 250, 1.2
    bpy.ops.object.camera_add(location=(2.2, -4.4, 0.9), rotation=(1.42, 0, 0.45))
    scene.camera = bpy.context.object
    scene.camera.data.lens = 60
    eye()
    return scene


def main() -> None:
    """Render both, side by side."""
    output = sys.argv[-1]
    hybrid.register()
    scene = stage()
    left = hybrid.render(scene, mode="raster").image
    hybrid.mark(bpy.data.materials["Cornea"])
    right = hybrid.render(scene, samples=16, shadow_samples=1).image
    both = np.concatenate([left, np.ones((SIZE, 6, 4), np.float32), right], axis=1)
    image = bpy.data.images.new("both", both.shape[1], SIZE, float_buffer=True)
    image.pixels.foreach_set(np.ascontiguousarray(both, np.float32).ravel())
    scene.render.image_settings.file_format, scene.render.image_settings.color_mode = "PNG", "RGB"
    image.save_render(output, scene=scene)


if __name__ == "__main__":
    main()
    leave()
