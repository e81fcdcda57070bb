# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE's picture and depth as the tracer gets them, and what mirrors show of them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon import tracer
from hybrid_addon.blender import view_layers
from hybrid_addon.blender.pipeline import scene_setup
from hybrid_addon.blender.render import eevee_half, images
from hybrid_addon.tracer.core.camera import project
from hybrid_addon.tracer.core.constants import NO_DEPTH

pytestmark = [pytest.mark.blender, pytest.mark.render]

WIDTH, HEIGHT = 96, 72
WALL_Y = 4.0


def wall(name, left, right):
    """Part of the wall y = WALL_Y, up to z = 5, with a material of its own."""
    mesh = bpy.data.meshes.new(name)
    corners = [(left, WALL_Y, -1), (right, WALL_Y, -1), (right, WALL_Y, 5), (left, WALL_Y, 5)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.materials.append(bpy.data.materials.new(name))
    if mesh.materials[0].node_tree is None:
        mesh.materials[0].use_nodes = True
    bpy.context.collection.objects.link(bpy.data.objects.new(name, mesh))
    return mesh.materials[0].node_tree


@pytest.fixture(scope="module")
def rendered(addon):
    """A ray traced mirror floor before a wall: left half plain and diffuse, right half as no tracer knows it."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    plain, unknown = wall("Plain", -9, 0), wall("Unknown", 0, 3.2)
    diffuse = plain.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.6, 0.5, 0.4, 1)
    plain.links.new(diffuse.outputs[0], plain.nodes["Material Output"].inputs["Surface"])
    voronoi = unknown.nodes.new("ShaderNodeTexVoronoi")
    voronoi.inputs["Scale"].default_value = 0.7
    coordinates = unknown.nodes.new("ShaderNodeTexCoord")
    unknown.links.new(coordinates.outputs["Object"], voronoi.inputs["Vector"])
    glow, seen = unknown.nodes.new("ShaderNodeEmission"), unknown.nodes.new("ShaderNodeShaderToRGB")
    unknown.links.new(voronoi.outputs["Color"], glow.inputs["Color"])
    unknown.links.new(glow.outputs[0], seen.inputs[0])
    unknown.links.new(seen.outputs[0], unknown.nodes["Principled BSDF"].inputs["Base Color"])
    bpy.ops.mesh.primitive_plane_add(size=40, location=(0, WALL_Y - 20, 0))
    hybrid.mark(bpy.context.object, reflectivity=1.0)
    scene.camera.location, scene.camera.rotation_euler = (0.5, -6, 2.5), (1.35, 0, 0.05)
    light = bpy.data.objects["Light"]
    light.location, light.data.energy = (-2, -1, 4), 900
    scene.eevee.use_shadows = False  # most of the time of software OpenGL
    scene.eevee.taa_render_samples, scene.hybrid.passes = 8, {"RASTER_BACKED", "REFLECTION"}
    got, trace = [], tracer.trace
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tracer, "trace", lambda scene, *rest: got.append((scene, *rest)) or trace(scene, *rest))
        hybrid.enable(scene)
        result = hybrid.render(scene, samples=8, resolution=(WIDTH, HEIGHT))
    ours, settings, mask = got[0][:3]
    planes = images.read_render_result(scene_setup.trace_scene(scene))
    return SimpleNamespace(
        scene=scene,
        result=result,
        ours=ours,
        passes={name.partition(".")[2]: plane for name, plane in planes.items()},
        unbacked=trace(replace(ours, raster=None), settings, mask).radiance,
    )


def test_the_tracer_gets_eevees_picture_and_depth(rendered):
    camera, drawn = rendered.ours.camera, rendered.ours.raster
    np.testing.assert_array_equal(drawn.pixels, rendered.result.raster)
    # The wall, in closed form: where the rays through the pixels' centres meet y = WALL_Y.
    x, y = np.meshgrid((np.arange(WIDTH) + 0.5) / WIDTH, (np.arange(HEIGHT) + 0.5) / HEIGHT)
    left, right, bottom, top = camera.view_plane
    way = camera.matrix_world[1, :3] @ np.stack([left + x * (right - left), bottom + y * (top - bottom), -x / x], 1)
    depth = (WALL_Y - camera.matrix_world[1, 3]) / way
    shows_wall = (drawn.pixels[..., 3] == 1) & (drawn.depth < NO_DEPTH)
    assert shows_wall.mean() > 0.3
    assert np.abs(drawn.depth / depth - 1)[shows_wall].max() < 0.005
    sky = drawn.depth[drawn.depth > 60]
    assert len(sky) > 0
    assert (sky == np.float32(NO_DEPTH)).all()


def mirrored(rendered, picture):
    """`picture` as the mirror floor shows it: each pixel's own ray, mirrored, and where the raster has that point."""
    camera = rendered.ours.camera
    x, y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    left, right, bottom, top = camera.view_plane
    plane = np.stack([left + (x + 0.5) / WIDTH * (right - left), bottom + (y + 0.5) / HEIGHT * (top - bottom), -x - 1])
    plane[2] = -1
    way = np.einsum("ij,jhw->ihw", camera.matrix_world[:3, :3], plane)
    t = (WALL_Y - camera.matrix_world[1, 3]) / way[1]
    at = camera.matrix_world[:3, 3][:, None, None] + way * t
    at[2] = -at[2]
    i, j, _ = project(camera, at.reshape(3, -1))
    i, j = (np.clip(v, 0, size - 1).astype(int).reshape(x.shape) for v, size in ((i, WIDTH), (j, HEIGHT)))
    return picture[j, i], at[0]


def test_a_mirror_shows_a_material_that_cannot_be_followed(rendered):
    assert any("not followed" in line for line in rendered.result.report["warnings"])
    backed = rendered.passes["Raster-Backed"][..., 0]
    expected, x = mirrored(rendered, rendered.result.raster[..., :3])
    shows = (backed > 0.99) & (x > 0.3)
    assert shows.sum() > 300
    off = np.abs(rendered.result.traced[..., :3] - expected)[shows].mean()
    without = np.abs(rendered.unbacked - expected)[shows].mean()
    assert off < 0.25 * without
    correlation = np.corrcoef(rendered.result.traced[..., :3][shows].ravel(), expected[shows].ravel())[0, 1]
    assert correlation > 0.9


def test_between_backed_and_unbacked_hits_there_is_no_seam(rendered):
    backed = rendered.passes["Raster-Backed"][..., 0]
    _, x = mirrored(rendered, rendered.result.raster[..., :3])
    plain = (rendered.result.mask > 0.99) & (x < -0.3)
    assert (backed[plain] > 0.99).sum() > 300
    assert (backed[plain] == 0).sum() > 50
    chosen = plain & (backed > 0.99)
    off = np.abs(rendered.result.traced[..., :3][chosen] / rendered.unbacked[chosen] - 1)
    print(f"backed against shaded: {off.mean():.2%} in the mean, {off.max():.2%} at most")
    assert off.mean() < 0.01
    assert off.max() < 0.02


def test_the_passes_and_the_report_tell_which_hits_were_backed(rendered):
    hits = rendered.result.report["hits"]
    assert hits["backed"] > hits["not_backed"] > 0
    assert rendered.result.report["settings"]["raster_backed"] is True
    np.testing.assert_array_equal(rendered.passes["Reflection"], rendered.result.traced[..., :3])
    assert rendered.result.passes.keys() == {"raster_backed", "reflection"}
    np.testing.assert_array_equal(rendered.passes["Raster-Backed"][..., 0], rendered.result.passes["raster_backed"])


def test_only_who_asks_for_it_pays_for_the_depth(rendered):
    scene = rendered.scene
    assert view_layers.mask_layer(scene).use_pass_z
    scene.hybrid.raster_backed = False
    assert not view_layers.mask_layer(scene).use_pass_z
    scene.hybrid.raster_backed = True


def test_the_plan_knows_of_it(rendered):
    def left_out():
        return any(row["what"] == "look-ups in the raster" for row in hybrid.plan(rendered.scene)["skipped"])

    assert not left_out()
    rendered.scene.hybrid.raster_backed = False
    assert left_out()
    rendered.scene.hybrid.raster_backed = True


def test_a_blurred_picture_backs_nothing(rendered):
    scene = rendered.scene
    assert eevee_half.unfit_to_back(scene) == ""
    scene.camera.data.dof.use_dof = True
    assert "depth of field" in eevee_half.unfit_to_back(scene)
    scene.camera.data.dof.use_dof = False
    scene.render.use_motion_blur = True
    assert "motion blur" in eevee_half.unfit_to_back(scene)
    scene.render.use_motion_blur = False
