# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics by photons on EEVEE's half, beside Cycles' of the same scene."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.pipeline import scene_setup
from hybrid_addon.blender.render import images

pytestmark = [pytest.mark.blender, pytest.mark.render]
SIZE = (80, 60)
SAMPLES = 500  # of Cycles, whose paths have to find the lamp through the ball by chance


@pytest.fixture(scope="module")
def rendered(addon):
    """A glass ball over a floor whose checkers only EEVEE knows exactly, a large lamp, a black world."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    (scene.render.resolution_x, scene.render.resolution_y), scene.eevee.taa_render_samples = SIZE, 4
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    bpy.ops.mesh.primitive_plane_add(size=14)
    bpy.context.object.data.materials.append(checkers())
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.8, location=(0, 0, 1.3), segments=48, ring_count=24)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(glass())
    hybrid.mark(bpy.context.object)
    lamp = bpy.data.objects["Light"]
    lamp.location, lamp.data.shadow_soft_size, lamp.data.energy = (-3, 2, 4.5), 0.5, 900
    scene.camera.location, scene.camera.rotation_euler, scene.camera.data.lens = (0.5, -8, 6), (0.93, 0, 0), 50
    scene_setup.enable(scene)
    r = SimpleNamespace()
    given = {"samples": 2, "light_falloff": "physical", "traced_shadows": True, "caustics": "photons"}
    r.photons = hybrid.render(scene, photons=300_000, **given)
    planes = images.read_render_result(scene)
    r.albedo = next(planes[name] for name in planes if name.endswith(("Diffuse Color", "DiffCol")))
    hybrid.disable(scene)
    r.cycles = by_cycles(scene)
    return r


def checkers():
    material = bpy.data.materials.new("checkers")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    checker = nodes.new("ShaderNodeTexChecker")
    checker.inputs["Scale"].default_value = 14
    checker.inputs["Color1"].default_value, checker.inputs["Color2"].default_value = (
        (0.6,) * 3 + (1,),
        (0.5,) * 3 + (1,),
    )
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    links.new(checker.outputs["Color"], diffuse.inputs["Color"])
    links.new(diffuse.outputs[0], nodes["Material Output"].inputs["Surface"])
    return material


def glass():
    material = bpy.data.materials.new("glass")
    material.use_nodes = True
    values = material.node_tree.nodes["Principled BSDF"].inputs
    values["Transmission Weight"].default_value, values["Roughness"].default_value = 1.0, 0.0
    return material


def by_cycles(scene):
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.samples, cycles.use_denoising, cycles.blur_glossy = SAMPLES, False, 0.0
    cycles.use_adaptive_sampling, cycles.sample_clamp_indirect = False, 0.0
    bpy.ops.render.render(scene=scene.name)
    planes = images.read_render_result(scene)
    return next(planes[name] for name in planes if name.endswith("Combined"))


def gain(picture, r):
    """By how much the floor is brighter than without the ball and its shadow."""
    return np.where(r.photons.mask > 0, 0, picture[..., 1] - r.photons.raster[..., 1])


def centroid(gained):
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    bright = np.where(gained > 0.1, gained, 0)
    return np.array([(bright * x).sum(), (bright * y).sum()]) / bright.sum()


def test_the_spot_is_where_cycles_has_it(rendered):
    ours, theirs = gain(rendered.photons.image, rendered), gain(rendered.cycles, rendered)
    place = centroid(ours)
    assert np.abs(place - centroid(theirs)).max() < 1
    x, y = place.astype(int)
    around = (slice(y - 8, y + 9), slice(x - 8, x + 9))
    light = [picture[around][..., 1].sum() for picture in (rendered.photons.image, rendered.cycles)]
    assert light[0] == pytest.approx(light[1], rel=0.12)  # with 10000 samples, Cycles' noise gone: 0.016
    brighter = ours > 0.5 * rendered.photons.raster[..., 1]
    assert np.count_nonzero(brighter & (rendered.photons.mask == 0)) > 20


def test_light_is_added_to_the_traced_layer(rendered):
    np.testing.assert_array_equal(rendered.photons.image, rendered.photons.raster + rendered.photons.traced)
    assert rendered.photons.report["settings"]["caustics"] == "PHOTONS"
    assert rendered.photons.report["rays"]["shadow"] > 0


def test_what_is_held_out_has_no_colour_to_light(rendered):
    assert rendered.albedo[rendered.photons.mask == 1][:, :3].max() == 0
