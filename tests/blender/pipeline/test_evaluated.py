# SPDX-License-Identifier: GPL-3.0-or-later
"""What is looked at without a render, and what the tracer gets in one, is what EEVEE draws: the scene of a render."""

from __future__ import annotations

import bpy
import pytest

from hybrid_addon.blender.api import enable, mark, render
from hybrid_addon.blender.errors import HybridError
from hybrid_addon.blender.pipeline import scene_setup
from hybrid_addon.blender.scan import advise, explain, plan, translated

pytestmark = pytest.mark.blender


@pytest.fixture
def cube(scene):
    """A mirror in a picture of 32 x 24, all traced."""
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 32, 24, 100
    scene.hybrid.mode, scene.hybrid.samples = "FULL", 1
    cube = bpy.data.objects["Cube"]
    mark(cube, reflectivity=1.0)
    enable(scene)
    return cube


def triangles(scene):
    """By `plan`, and by a render's report."""
    return plan(scene)["counts"]["triangles"], render(scene).report["triangles"]


def subdivide(cube):
    modifier = cube.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 2
    return modifier


def test_levels_of_modifiers_are_those_of_a_render(scene, cube):
    modifier = subdivide(cube)
    assert triangles(scene) == (6 * 4**2 * 2,) * 2
    modifier.show_viewport = False
    assert triangles(scene) == (6 * 4**2 * 2,) * 2
    modifier.show_render = False
    assert triangles(scene) == (12, 12)


def test_what_is_hidden_from_viewports_is_there(scene, cube):
    cube.hide_viewport = True
    assert triangles(scene) == (12, 12)
    assert "Cube" in explain(16, 12)
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.5, 0.7, 1, 1)
    assert [row["object"] for row in advise(scene)["objects"]] == ["Cube"]
    cube.hide_viewport, cube.hide_render = False, True
    assert triangles(scene) == (0, 0)


def test_the_view_layer_is_the_one_that_is_rendered(scene, cube):
    other = scene.view_layers.new("Other")
    hidden = bpy.data.collections.new("Hidden")
    scene.collection.children.link(hidden)
    bpy.ops.mesh.primitive_ico_sphere_add(location=(0, 3, 0))
    ball = bpy.context.object
    for collection in list(ball.users_collection):
        collection.objects.unlink(ball)
    hidden.objects.link(ball)
    scene.view_layers[0].layer_collection.children["Hidden"].exclude = True
    scene_setup.tear_down(scene)
    scene.view_layers[0].use = False
    scene_setup.sync(scene)
    assert scene_setup.source_layer(scene) == other
    shown, rendered = triangles(scene)
    assert shown == rendered > 12


def test_simplify_and_a_stretched_time_hold_for_the_traced_half(scene, cube):
    subdivide(cube)
    scene.render.use_simplify, scene.render.simplify_subdivision_render = True, 1
    assert triangles(scene) == (6 * 4 * 2,) * 2
    for frame, x in ((1, 0.0), (101, 4.0)):
        cube.location.x = x
        cube.keyframe_insert("location", frame=frame)
    scene.render.frame_map_old, scene.render.frame_map_new = 100, 50
    scene.frame_set(20)
    here = cube.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation.x
    scene_setup.sync(scene)
    place = next(i for i in translated(scene).scene.instances if i.name == "Cube").matrix_world[0, 3]
    assert place == pytest.approx(here) and here > 1
    trace = scene_setup.trace_scene(scene)
    assert (trace.render.frame_map_old, trace.render.frame_map_new) == (100, 50)


def test_looking_leaves_nothing_and_says_what_is_wrong(scene, cube):
    def names():
        return [[b.name for b in c] for c in (bpy.data.scenes, bpy.data.objects, bpy.data.cameras, bpy.data.images)]

    scene.frame_set(7)
    plan(scene)
    before = names()
    plan(scene)
    assert names() == before and scene.frame_current == 7
    scene.camera = None
    with pytest.raises(HybridError, match="camera"):
        plan(scene)
    assert names() == before
