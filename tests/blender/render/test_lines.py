# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender lays over a render is there once: Freestyle's lines, Grease Pencil."""

from __future__ import annotations

import bpy
import mathutils
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.pipeline import scene_setup

pytestmark = [pytest.mark.blender, pytest.mark.render]


@pytest.fixture
def still(scene):
    """A mirror cube and a floor, seen small."""
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    scene.eevee.taa_render_samples, scene.eevee.use_shadows, scene.hybrid.samples = 2, False, 2
    bpy.ops.mesh.primitive_cube_add(size=1.5, location=(-2.5, 1.0, 0.0))
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=1.0)
    return scene


def _stroke(scene, place):
    """A broad stroke across the view, near the camera or behind the cube."""
    pencils = bpy.data.grease_pencils if bpy.app.version >= (5, 0) else bpy.data.grease_pencils_v3
    data = pencils.new("Stroke")
    drawing = data.layers.new("Lines").frames.new(1).drawing
    drawing.add_strokes([2])
    camera = scene.camera.matrix_world
    for point, x in zip(drawing.strokes[0].points, (-4.0, 4.0), strict=True):
        point.position = camera @ mathutils.Vector((x, 0.3, -place))
        point.radius, point.opacity = 0.02 * place, 1.0
    material = bpy.data.materials.new("Stroke")
    bpy.data.materials.create_gpencil_data(material)
    material.grease_pencil.color = (0.5, 0.02, 0.02, 1.0)
    data.materials.append(material)
    data.layers[0].use_lights = False
    scene.collection.objects.link(bpy.data.objects.new("Stroke", data))


@pytest.mark.parametrize("depth", [False, True], ids=["over all", "hidden by surfaces"])
def test_grease_pencil_lies_over_the_picture_as_over_eevees(still, depth):
    """A stroke before the cube, and one behind it."""
    still.view_layers[0].use_pass_z = depth
    for place in (4.0, 20.0):
        _stroke(still, place)
    eevee = hybrid.render(still, mode="raster").image
    result = hybrid.render(still)
    beside = result.mask < 1e-3
    np.testing.assert_allclose(result.image[beside], eevee[beside], atol=2e-3)
    assert result.image[..., 3].max() < 1.001
    red = (eevee[..., 0] > 4 * eevee[..., 1] + 0.1) & (eevee[..., 3] > 0.99)
    assert red.sum() > 40
    both = (result.image[..., 0] > 4 * result.image[..., 1] + 0.1)[red]
    assert both.mean() > 0.9  # on the traced cube, too, where EEVEE's is not hidden by it


def test_freestyle_draws_the_lines_that_it_draws_without_us(still):
    layer = still.view_layers[0]
    still.render.use_freestyle = layer.use_freestyle = True
    lines = layer.freestyle_settings.linesets[0] if layer.freestyle_settings.linesets else None
    lines = lines or layer.freestyle_settings.linesets.new("Lines")
    lines.select_silhouette = lines.select_border = lines.select_crease = True
    eevee = hybrid.render(still, mode="raster").image
    result = hybrid.render(still)
    lines_of = [picture[..., :3].max(-1) < 0.02 for picture in (eevee, result.image)]
    assert lines_of[0].sum() > 60
    assert (lines_of[0] & ~lines_of[1]).sum() == 0
    np.testing.assert_array_equal(result.image, result.raster + result.traced)
    again = hybrid.render(still)  # and a retrace has them, too
    hybrid.enable(still)
    np.testing.assert_array_equal(hybrid.render(still).image, again.image)
    np.testing.assert_array_equal(hybrid.retrace(still).image, again.image)
    hybrid.disable(still)
    assert not layer.freestyle_settings.as_render_pass
    assert any("Freestyle" in line for line in hybrid.render(still, mode="full").report["warnings"])


def test_another_scenes_compositor_gets_eevees_picture(still):
    """It knows nothing of the mask layer: the user's own layer is rendered for it."""
    other = bpy.data.scenes.new("Composition")
    hybrid.enable(still)
    source = scene_setup.source_layer(still)
    assert not source.use
    if bpy.app.version >= (5, 0):
        tree = other.compositing_node_group = bpy.data.node_groups.new("Tree", "CompositorNodeTree")
    else:
        other.use_nodes = True
        tree = other.node_tree
        tree.nodes.clear()
    node = tree.nodes.new("CompositorNodeRLayers")
    node.scene = still
    scene_setup.sync_all()
    assert source.use
    node.mute = True
    scene_setup.sync_all()
    assert not source.use


def test_what_is_ticked_and_yet_not_ray_traced_is_named(still):
    """Instances of the background scene: EEVEE has one flag for all that show an object."""
    stage = bpy.data.scenes.new("Stage")
    shown = bpy.data.collections.new("Shown")
    shown.objects.link(bpy.data.objects.new("Inside", bpy.data.objects["Cube"].data))
    for name, data in (("There", bpy.data.objects["Cube"].data), ("Instancer", None)):
        b_object = bpy.data.objects.new(name, data)
        stage.collection.objects.link(b_object)
        hybrid.mark(b_object)
    b_object.instance_type, b_object.instance_collection = "COLLECTION", shown
    still.background_set = stage
    (warning,) = scene_setup.missed(still)
    assert "'Instancer'" in warning and "Stage" in warning
    assert {ob.name for ob in scene_setup.ray_traced_objects(still)} == {"Cube", "There"}
