# SPDX-License-Identifier: GPL-3.0-or-later
"""Both switches of a material's Backface Culling, as EEVEE draws them, in Full mode and with everything ray traced."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

import hybrid_addon as hybrid
from tests.blender.kit import empty_scene

pytestmark = [pytest.mark.blender, pytest.mark.render]
SIZE, WIDTH = (96, 72), 16.0  # pixels, metres across
TURNS = (Matrix(), Euler((np.pi, 0, 0)).to_matrix().to_4x4(), Matrix.Diagonal((1, 1, -1, 1)))


def empty():
    """A floor seen from above in slanted sunlight."""
    b_scene = empty_scene(*SIZE, 2)
    b_scene.hybrid.samples, b_scene.eevee.use_shadows = 2, True
    b_camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    b_camera.data.type, b_camera.data.ortho_scale, b_camera.location = "ORTHO", WIDTH, (0, 0, 10)
    b_scene.collection.objects.link(b_camera)
    b_scene.camera = b_camera
    b_sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    b_sun.data.energy, b_sun.rotation_euler = 3.0, (0, -np.pi / 4, 0)
    b_scene.collection.objects.link(b_sun)
    square(b_scene, "Floor", material("Floor", (0.8, 0.8, 0.8, 1)), (0, 0, 0), 9, Matrix())
    return b_scene


def material(name, color, camera=False, shadow=False):
    b_material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        b_material.use_nodes = True
    b_shader = b_material.node_tree.nodes["Principled BSDF"]
    b_shader.inputs["Base Color"].default_value, b_shader.inputs["Roughness"].default_value = color, 1.0
    b_material.use_backface_culling, b_material.use_backface_culling_shadow = camera, shadow
    return b_material


def square(b_scene, name, b_material, place, size, turn):
    b_mesh = bpy.data.meshes.new(name)
    corners = [(-size, -size, 0), (size, -size, 0), (size, size, 0), (-size, size, 0)]
    b_mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    b_mesh.materials.append(b_material)
    b_object = bpy.data.objects.new(name, b_mesh)
    b_object.matrix_world = Matrix.Translation(place) @ turn
    b_scene.collection.objects.link(b_object)
    return b_object


def found(image):
    """Of each square (row, column): whether it is seen, and whether it casts a shadow."""
    scale = SIZE[0] / WIDTH

    def at(row, column, aside):
        return image[int(SIZE[1] / 2 + (4 * row - 4) * scale), int(SIZE[0] / 2 + (4 * column - 6 + aside) * scale)]

    places = [(row, column) for row in range(3) for column in range(4)]
    seen = [bool(at(*place, 0)[2] > 2 * at(*place, 0)[0] + 0.02) for place in places]
    shadows = [bool(min(at(*place, 1.2)[0], at(*place, -1.2)[0]) < 0.1) for place in places]
    return seen, shadows


def test_both_switches_do_what_they_do_in_eevee(addon):
    """Squares face the camera and the sun, turn their backs, and are mirrored; no switch, one, the other, both."""
    b_scene = empty()
    for row, turn in enumerate(TURNS):
        for column in range(4):
            b_material = material("Square", (0.1, 0.1, 0.8, 1), bool(column & 1), bool(column & 2))
            hybrid.mark(square(b_scene, "Square", b_material, (4 * column - 6, 4 * row - 4, 1.2), 0.7, turn))
    b_scene.hybrid.traced_shadows = "ON"
    hybrid.enable(b_scene)
    pictures = {mode: hybrid.render(mode=mode) for mode in ("raster", "full", "hybrid")}
    assert pictures["full"].report["warnings"] == []
    results = {mode: found(picture.image) for mode, picture in pictures.items()}
    back = [row > 0 for row in range(3) for _ in range(4)]
    seen = [not (is_back and number % 4 & 1) for number, is_back in enumerate(back)]
    shadows = [not (is_back and number % 4 & 2) for number, is_back in enumerate(back)]
    assert results == dict.fromkeys(pictures, (seen, shadows))


def test_a_single_sided_glass_stays_glass(addon):
    """Importers switch culling on for every single-sided material: closed glass looks the same with it."""
    b_scene = empty()
    b_material = material("Glass", (1, 1, 1, 1))
    b_shader = b_material.node_tree.nodes["Principled BSDF"]
    b_shader.inputs["Transmission Weight"].default_value, b_shader.inputs["Roughness"].default_value = 1.0, 0.0
    bpy.ops.mesh.primitive_uv_sphere_add(radius=3, location=(0, 0, 4))
    b_ball = bpy.context.object
    b_ball.data.materials.append(b_material)
    hybrid.mark(b_ball)
    hybrid.enable(b_scene)
    square(b_scene, "Stripe", material("Stripe", (0.8, 0.1, 0.1, 1)), (1, 0, 0.5), 0.5, Matrix())
    pictures = []
    for culled in (False, True):
        b_material.use_backface_culling = culled
        pictures.append(hybrid.render(mode="full").image)
    np.testing.assert_array_equal(*pictures)
