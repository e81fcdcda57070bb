# SPDX-License-Identifier: GPL-3.0-or-later
"""Balls in fog, as EEVEE draws them and as the two halves do together: no fog twice, and none missing."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.render import images

pytestmark = [pytest.mark.blender, pytest.mark.render]
BALLS = (np.s_[20:28, 12:20], np.s_[20:28, 28:36])
CORNER = np.s_[44:48, 44:48]


@pytest.fixture
def street(scene):
    """Two matte balls 10 m away and a lamp between; EEVEE's fog in fine steps from 6 to 14 m."""
    for name in ("Cube", "Light"):
        bpy.data.objects.remove(bpy.data.objects[name])
    b_eevee, b_render = scene.eevee, scene.render
    b_render.resolution_x = b_render.resolution_y = 48
    b_eevee.taa_render_samples, b_eevee.use_shadows, b_eevee.use_volume_custom_range = 8, False, True
    b_eevee.volumetric_start, b_eevee.volumetric_end, b_eevee.volumetric_sample_distribution = 6, 14, 0
    b_eevee.volumetric_samples, b_eevee.volumetric_tile_size = 64, "4"
    scene.camera.location, scene.camera.rotation_euler, scene.camera.data.lens = (0, -10, 0), (np.pi / 2, 0, 0), 50
    background = scene.world.node_tree.nodes["Background"].inputs
    background[0].default_value, background[1].default_value = (0.3, 0.4, 0.6, 1), 1.0
    matte = bpy.data.materials.new("matte")
    if bpy.app.version < (5, 0, 0):
        matte.use_nodes = True
    shader = next(n for n in matte.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled").inputs
    shader["Roughness"].default_value, shader["Specular IOR Level"].default_value = 1.0, 0.0
    for x in (-1.1, 1.1):
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, location=(x, 0, 0))
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(matte)
    bpy.ops.object.light_add(type="POINT", location=(0, -1, 1.8))
    lamp = bpy.context.object.data
    lamp.energy, lamp.shadow_soft_size, lamp.use_shadow = 400, 0.3, False
    return scene


def fill(scene, where, kind, color, varies=False):
    """Fill the world, or a box, with fog; varies: as dense as a Noise Texture is bright."""
    if where == "box":
        bpy.ops.mesh.primitive_cube_add(size=1, scale=(6, 6, 4))
        b_id = bpy.data.materials.new("fog")
        if bpy.app.version < (5, 0, 0):
            b_id.use_nodes = True
        b_id.node_tree.nodes.clear()
        output = b_id.node_tree.nodes.new("ShaderNodeOutputMaterial")
        bpy.context.object.data.materials.append(b_id)
    else:
        b_id = scene.world
        output = next(n for n in b_id.node_tree.nodes if n.bl_idname == "ShaderNodeOutputWorld")
    b_node = b_id.node_tree.nodes.new(f"ShaderNode{kind}")
    b_node.inputs["Color"].default_value = (*color, 1)
    amount = b_node.inputs["Strength" if kind == "Emission" else "Density"]
    amount.default_value = 0.1
    if varies:
        b_noise, b_range = (b_id.node_tree.nodes.new(f"ShaderNode{name}") for name in ("TexNoise", "MapRange"))
        b_noise.inputs["Detail"].default_value, b_range.inputs["To Max"].default_value = 0.0, 0.3
        b_id.node_tree.links.new(b_noise.outputs[0], b_range.inputs[0])
        b_id.node_tree.links.new(b_range.outputs[0], amount)
    b_id.node_tree.links.new(b_node.outputs[0], output.inputs["Volume"])


@pytest.mark.parametrize("where", ["box", "world"])
@pytest.mark.parametrize(
    ("kind", "color"),
    [("VolumeScatter", (0.3, 0.6, 1)), ("VolumeAbsorption", (0.2, 0.6, 0.9)), ("Emission", (1, 0.5, 0.2))],
)
def test_balls_in_fog_are_those_of_eevee(street, where, kind, color):
    fill(street, where, kind, color)
    bpy.ops.render.render(scene=street.name)
    planes = images.read_render_result(street)
    eevee = next(planes[name] for name in planes if name.endswith("Combined"))[..., :3]
    for b_object in bpy.data.objects:
        b_object.hybrid.ray_traced = b_object.name.startswith("Sphere")
    found = hybrid.render(street, samples=8)
    theirs, ours = (
        np.mean([image[ball][..., :3].mean((0, 1)) for ball in BALLS], axis=0) for image in (eevee, found.image)
    )
    print(f"{where} {kind}: EEVEE {theirs}, hybrid {ours}")
    np.testing.assert_allclose(ours, theirs, rtol=0.03)
    np.testing.assert_allclose(found.image[CORNER][..., :3], eevee[CORNER], rtol=1e-3, atol=1e-5)
    assert not any(found.report["invariants"].values())


def test_a_picture_of_fog_that_varies_is_that_of_eevee(street):
    """All of it traced, in tiles of 6 x 6 pixels: the clouds of a Noise Texture lie where EEVEE has them."""
    fill(street, "box", "VolumeScatter", (0.3, 0.6, 1), varies=True)
    bpy.data.objects["Point"].location = (3, -5, 6)  # no lamp in sight, whose glow EEVEE blurs
    coarse = bpy.app.version < (5, 0, 0)
    if coarse:  # 4.5 blurs the outline of a box over its froxels: by 8.8 % with those of 4 pixels, even fog by 4.2 %
        street.eevee.volumetric_tile_size = "2"
    eevee = hybrid.render(street, mode="RASTER").image[..., :3]
    ours = hybrid.render(street, mode="FULL", samples=8).image[..., :3]
    theirs, ours = (image.reshape(8, 6, 8, 6, 3).mean(axis=(1, 3)) for image in (eevee, ours))
    print(f"noise: the largest difference of a tile is {np.abs(ours / theirs - 1).max():.3f}")
    np.testing.assert_allclose(ours, theirs, rtol=0.04 if coarse else 0.03)
