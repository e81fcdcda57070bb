# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera's view plane against Blender's own projection matrix, and the cameras that are refused."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector

import hybrid_addon as hybrid
from hybrid_addon.blender.sync import UnsupportedError, Warnings
from hybrid_addon.blender.sync.camera import translate_camera

pytestmark = pytest.mark.blender


def translated(scene, width=64, height=48, warn=None):
    b_depsgraph = bpy.context.evaluated_depsgraph_get()
    return translate_camera(b_depsgraph, scene, (width, height), (0, 0, width, height), warn or Warnings())


def randomise(scene, rng):
    """Any lens, sensor, fit, shift, pixel aspect and frame."""
    b_camera = scene.camera.data
    b_camera.type = str(rng.choice(["PERSP", "ORTHO"]))
    b_camera.sensor_fit = str(rng.choice(["AUTO", "HORIZONTAL", "VERTICAL"]))
    b_camera.sensor_width, b_camera.sensor_height = rng.uniform(5, 80, 2)
    b_camera.lens, b_camera.ortho_scale = rng.uniform(10, 200), rng.uniform(0.1, 50)
    b_camera.shift_x, b_camera.shift_y = rng.uniform(-2, 2, 2)
    b_camera.clip_start, b_camera.clip_end = 0.1, 100.0
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = rng.uniform(1, 3, 2)
    scene.render.resolution_x, scene.render.resolution_y = (int(n) for n in rng.integers(4, 4000, 2))
    scene.render.resolution_percentage = 100
    return scene.render.resolution_x, scene.render.resolution_y


def projection_of(camera):
    """Blender's (4, 4) projection matrix made of our view plane."""
    left, right, bottom, top = camera.view_plane
    near, far = camera.clip_start, camera.clip_end
    wide, high, deep = right - left, top - bottom, far - near
    if camera.projection == "ORTHO":
        return np.array(
            [
                [2 / wide, 0, 0, -(right + left) / wide],
                [0, 2 / high, 0, -(top + bottom) / high],
                [0, 0, -2 / deep, -(far + near) / deep],
                [0, 0, 0, 1],
            ]
        )
    return np.array(
        [
            [2 / wide, 0, (right + left) / wide, 0],
            [0, 2 / high, (top + bottom) / high, 0],
            [0, 0, -(far + near) / deep, -2 * far * near / deep],
            [0, 0, -1, 0],
        ]
    )


@pytest.mark.parametrize("seed", range(4))
def test_view_plane_is_blenders_projection_matrix(scene, seed):
    rng = np.random.default_rng(seed)
    for _ in range(50):
        width, height = randomise(scene, rng)
        bpy.context.view_layer.update()
        b_depsgraph = bpy.context.evaluated_depsgraph_get()
        expected = np.array(
            scene.camera.calc_matrix_camera(
                b_depsgraph,
                x=width,
                y=height,
                scale_x=scene.render.pixel_aspect_x,
                scale_y=scene.render.pixel_aspect_y,
            )
        )
        found = projection_of(translated(scene, width, height))
        assert np.abs(found - expected).max() <= 3e-6 * np.abs(expected).max()


@pytest.mark.parametrize("projection", ["PERSP", "ORTHO"])
def test_a_point_lands_on_the_pixel_where_blender_draws_it(scene, projection):
    scene.camera.data.type, scene.camera.data.shift_x = projection, 0.3
    scene.camera.scale = (2, 3, 0.5)
    scene.render.resolution_x, scene.render.resolution_y = 200, 90
    bpy.context.view_layer.update()
    camera = translated(scene, 200, 90)
    for point in ((0, 0, 0), (1, -2, 0.5), (-0.5, 0.2, -1)):
        local = np.linalg.inv(camera.matrix_world) @ (*point, 1.0)
        x, y = local[:2] / (-local[2] if projection == "PERSP" else 1.0)
        left, right, bottom, top = camera.view_plane
        frame = ((x - left) / (right - left), (y - bottom) / (top - bottom))
        expected = world_to_camera_view(scene, scene.camera, Vector(point))
        assert frame == pytest.approx(expected[:2], abs=2e-6)


def test_scale_is_dropped_and_position_kept(scene):
    turned = Matrix.Rotation(0.7, 4, "X") @ Matrix.Rotation(0.3, 4, "Z")
    scene.camera.matrix_world = Matrix.Translation((1e5, 2, 3)) @ turned @ Matrix.Diagonal((2, 5, 0.1, 1))
    bpy.context.view_layer.update()
    matrix = translated(scene).matrix_world
    assert matrix.dtype == np.float64
    assert matrix[:3, 3] == pytest.approx((1e5, 2, 3))
    assert matrix[:3, :3] == pytest.approx(np.array(turned)[:3, :3], abs=1e-6)


def test_the_window_and_clipping_are_passed_on(scene):
    scene.camera.data.clip_start, scene.camera.data.clip_end = 0.25, 40.0
    b_depsgraph = bpy.context.evaluated_depsgraph_get()
    camera = translate_camera(b_depsgraph, scene, (64, 48), (10, 5, 30, 20), Warnings())
    assert (camera.resolution, camera.window) == ((64, 48), (10, 5, 30, 20))
    assert (camera.clip_start, camera.clip_end) == (0.25, 40.0)


@pytest.mark.parametrize("kind", ["PANO", "CUSTOM"])
def test_a_camera_of_cycles_is_the_perspective_one_that_eevee_draws(scene, kind):
    """Bit for bit: EEVEE's pictures are the same, too."""
    scene.camera.data.lens, scene.camera.data.shift_x = 35.0, 0.1
    bpy.context.view_layer.update()
    plain = translated(scene)
    scene.camera.data.type = kind
    warn = Warnings()
    bpy.context.view_layer.update()
    camera = translated(scene, warn=warn)
    assert (camera.projection, camera.view_plane) == (plain.projection, plain.view_plane)
    assert "drawn as Perspective" in next(iter(warn))


def test_no_camera_is_refused(scene):
    scene.camera = None
    with pytest.raises(UnsupportedError, match="'Scene' has no camera"):
        translated(scene)


def test_a_lamp_for_a_camera_is_refused(scene):
    scene.camera = bpy.data.objects["Light"]
    with pytest.raises(UnsupportedError, match="'Light', which is no camera but of type LIGHT"):
        translated(scene)


def test_the_lens_is_eevees(scene):
    b_camera = scene.camera.data
    b_dof = b_camera.dof
    assert translated(scene).lens is None
    b_dof.use_dof, b_dof.aperture_fstop, b_dof.focus_distance = True, 2.0, 7.0
    b_dof.aperture_blades, b_dof.aperture_rotation, b_dof.aperture_ratio = 5, 0.5, 2.0
    b_camera.lens = 80.0
    lens = translated(scene).lens
    assert lens.radius == pytest.approx(0.02)  # the opening is lens / f-stop = 40 mm wide
    assert (lens.focus_distance, lens.blades, lens.rotation, lens.ratio) == (7.0, 5, 0.5, 2.0)
    b_camera.type = "ORTHO"
    assert translated(scene).lens.radius == pytest.approx(0.04 * 7.0 / 4)


def test_an_object_or_a_bone_sets_the_focus(scene):
    scene.camera.matrix_world = Matrix.Translation((0, 0, 9)) @ Matrix.Diagonal((2, 2, 2, 1))
    b_dof = scene.camera.data.dof
    b_dof.use_dof, b_dof.focus_object = True, bpy.data.objects["Cube"]
    b_dof.focus_object.location = (3, 1, 2)
    assert translated(scene).lens.focus_distance == pytest.approx(7)
    bpy.ops.object.armature_add(location=(0, 0, -1))
    b_dof.focus_object = bpy.context.object
    b_dof.focus_subtarget = "Bone"
    b_bone = bpy.context.object.pose.bones["Bone"]
    b_bone.location = (0, 4, 0)
    assert translated(scene).lens.focus_distance == pytest.approx(6)


@pytest.mark.render
def test_a_ball_out_of_focus_has_eevees_outline(scene):
    """EEVEE's blurred mask is the traced picture's own blur: no fringe where mask and traced colours meet."""
    b_cube, b_dof = bpy.data.objects["Cube"], scene.camera.data.dof
    b_dof.use_dof, b_dof.focus_distance, b_dof.aperture_fstop = True, 3.0, 0.05
    emission = b_cube.active_material.node_tree.nodes["Principled BSDF"].inputs
    emission["Base Color"].default_value = (0, 0, 0, 1)
    emission["Specular IOR Level"].default_value = 0.0
    emission["Emission Color"].default_value, emission["Emission Strength"].default_value = (1, 0.4, 0.1, 1), 1.0
    scene.eevee.taa_render_samples, scene.eevee.use_shadows = 8, False  # most of the time of software OpenGL
    hybrid.mark(b_cube)
    hybrid.enable(scene)
    size = {"resolution": (64, 48)}
    mixed = hybrid.render(scene, samples=64, **size)
    full = hybrid.render(scene, mode="FULL", samples=64, **size)
    soft = (mixed.mask > 0.05) & (mixed.mask < 0.95)
    assert soft.mean() > 0.15
    off = np.abs(full.image - mixed.image)[..., :3]
    print(f"at the outline {off[soft].mean():.4f}, of all {off.mean():.4f}")
    assert off[soft].mean() < 0.03
    assert off.mean() < 0.02
