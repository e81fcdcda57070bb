# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the picture of the manual that shows the surface programs that ship: Toon Glass, X-Ray and Portal.

python tools/programs_picture.py OUTPUT.png

The portal shows what a second camera sees: three balls that stand elsewhere.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from leave import leave  # noqa: E402
from slots_picture import material  # noqa: E402

import hybrid_addon as hybrid  # noqa: E402

SIZE, SAMPLES = (640, 300), 8
ELSEWHERE = (0.0, -80.0, 0.0)


def stage() -> bpy.types.Scene:
    """Two monkeys and a window on a tiled floor; three balls where the second camera is."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.eevee.taa_render_samples = SAMPLES
    scene.world = bpy.data.worlds.new("World")
    scene.world.color = (0.5, 0.55, 0.65)
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.5, 0.55, 0.65, 1)
    light, dark = (
        material("Light", (0.75, 0.7, 0.62), Roughness=0.8),
        material("Dark", (0.35, 0.3, 0.27), Roughness=0.8),
    )
    bpy.ops.mesh.primitive_grid_add(size=24, x_subdivisions=24, y_subdivisions=24)
    floor = bpy.context.object
    for b_material in (light, dark):
        floor.data.materials.append(b_material)
    for face in floor.data.polygons:
        face.material_index = int(sum(round(v - 0.5) for v in face.center[:2])) % 2
    bpy.ops.object.light_add(type="AREA", location=(-3, -4, 6), rotation=(0.7, -0.4, 0))
    bpy.context.object.data.energy, bpy.context.object.data.size = 700, 2
    chosen = []
    for x, program in ((-2.6, "Toon Glass"), (0.0, "X-Ray")):
        bpy.ops.mesh.primitive_monkey_add(size=1.9, location=(x, 0, 0.95), rotation=(-0.2, 0, 0.15))
        bpy.ops.object.modifier_add(type="SUBSURF")
        bpy.context.object.modifiers[0].render_levels = 2
        bpy.ops.object.shade_smooth()
        chosen.append((bpy.context.object, program))
    chosen[1][0]["density"] = 1.6
    bpy.ops.object.camera_add(location=(ELSEWHERE[0], ELSEWHERE[1] - 5, 1.2), rotation=(1.5708, 0, 0))
    there = bpy.context.object
    for x, color in ((-1.2, (0.8, 0.1, 0.05)), (0.0, (0.1, 0.6, 0.15)), (1.2, (0.1, 0.2, 0.8))):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.55, location=(ELSEWHERE[0] + x, ELSEWHERE[1], 1.2))
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(material("Ball", color, Roughness=0.5))
    bpy.ops.object.light_add(type="POINT", location=(-2, ELSEWHERE[1] - 4, 5))
    bpy.context.object.data.energy = 900
    bpy.ops.mesh.primitive_plane_add(size=2, location=(2.6, 0.2, 1.05), rotation=(1.5708, 0, -0.3))
    window = bpy.context.object
    window["camera"] = there
    chosen.append((window, "Portal"))
    for b_object, program in chosen:
        hybrid.surface(b_object, program)
    bpy.ops.object.camera_add(location=(0, -8.2, 2.1), rotation=(1.44, 0, 0))
    scene.camera = bpy.context.object
    scene.camera.data.lens = 36
    return scene


def main() -> None:
    """Draw it."""
    hybrid.register()
    scene = stage()
    scene.render.filepath, scene.render.image_settings.file_format = sys.argv[1], "PNG"
    result = hybrid.render(scene, samples=SAMPLES)
    bpy.data.images["Render Result"].save_render(sys.argv[1], scene=scene)
    print("\n".join(result.report["warnings"]))


if __name__ == "__main__":
    main()
    leave()
