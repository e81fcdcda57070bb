# SPDX-License-Identifier: GPL-3.0-or-later
"""Nothing of ours shows: lists, exporters, handlers and user counts are as without the add-on."""

from __future__ import annotations

import json
import struct

import addon_utils
import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.pipeline import context_drivers, others_handlers, scene_setup, trace_scenes

pytestmark = pytest.mark.blender


@pytest.fixture
def cube(scene):
    scene.render.resolution_x, scene.render.resolution_y = 24, 16
    scene.eevee.taa_render_samples, scene.eevee.use_shadows, scene.hybrid.samples = 1, False, 1
    cube = bpy.data.objects["Cube"]
    hybrid.mark(cube, reflectivity=1.0)
    return cube


def test_no_list_of_scenes_has_the_trace_scene(scene, cube):
    hybrid.enable(scene)
    trace = scene_setup.trace_scene(scene)
    assert list(bpy.data.scenes) == [scene]
    assert scene_setup.is_trace_scene(trace) and trace_scenes.owner(trace) == scene
    assert list(cube.users_scene) == [scene]


@pytest.mark.render
def test_a_scene_may_have_the_trace_scenes_name(scene, cube):
    """Blender finds a scene's render by its name, in all databases: 4.5 crashed."""
    hybrid.enable(scene)
    scene.name = scene_setup.trace_scene(scene).name
    assert hybrid.render(scene).mask.any()
    assert scene_setup.trace_scene(scene).name != scene.name


def test_user_counts_stay_however_often_hybrid_is_switched(scene, cube):
    def users():
        ids = [scene, scene.camera, scene.camera.data, scene.world, cube, cube.data, cube.active_material]
        return [b_id.users for b_id in ids], len(bpy.data.linestyles), [style.users for style in bpy.data.linestyles]

    before = users()
    for _ in range(3):
        hybrid.enable(scene)
        hybrid.disable(scene)
    assert users() == before


def test_a_trace_scene_points_into_the_file_only_during_a_render(scene, cube):
    """Blender would not keep such a pointer right when what it points to is removed."""
    hybrid.enable(scene)
    trace = scene_setup.trace_scene(scene)
    trace_scenes.begin()
    assert (trace.background_set, trace.camera) == (scene, scene.camera)
    trace_scenes.detach()
    assert trace.background_set is None
    assert trace.camera not in set(bpy.data.objects)  # one of its own: without any Blender would not begin a render


def test_the_trace_scene_of_a_scene_that_is_gone_serves_the_next(scene, cube):
    hybrid.enable(scene)
    trace = scene_setup.trace_scene(scene)
    other = bpy.data.scenes.new("Other")
    bpy.data.scenes.remove(scene)
    scene_setup.sync_all()
    hybrid.enable(other)
    assert scene_setup.trace_scene(other) == trace


def test_gltf_has_the_scenes_of_the_file(scene, cube, tmp_path):
    addon_utils.enable("io_scene_gltf2")

    def exported(name):
        path = tmp_path / name
        bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB")
        data = path.read_bytes()
        return json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])

    before = exported("off.glb")
    hybrid.enable(scene)
    after = exported("on.glb")
    assert (after["scenes"], after["nodes"]) == (before["scenes"], before["nodes"])


@pytest.mark.render
@pytest.mark.parametrize("transparent", [False, True], ids=["mask layer alone", "beside the user's layer"])
def test_handlers_of_others_run_as_often_and_with_the_same_scenes(scene, cube, tmp_path, transparent):
    seen = []

    def before(scene, *_):
        seen.append(("pre", scene.name, scene.frame_current))

    def after(scene, *_):
        seen.append(("post", scene.name, scene.frame_current))

    scene.frame_start, scene.frame_end = 1, 2
    scene.render.film_transparent = transparent
    scene.render.filepath = str(tmp_path / "frame")
    lists = bpy.app.handlers.frame_change_pre, bpy.app.handlers.frame_change_post
    lists[0].insert(0, before)
    lists[1].append(after)
    own = [list(handlers) for handlers in lists]
    try:
        bpy.ops.render.render(animation=True)
        plain, seen[:] = list(seen), []
        hybrid.enable(scene)
        seen.clear()
        bpy.ops.render.render(animation=True)
        assert seen == plain
        assert [set(handlers) for handlers in lists] == [set(handlers) for handlers in own]
    finally:
        lists[0].remove(before)
        lists[1].remove(after)


@pytest.fixture
def frame_handlers(scene):
    """Blender's list with one handler in it, that handler, and one that is to be added."""

    def early(*_):
        pass

    def late(*_):
        pass

    handlers = bpy.app.handlers.frame_change_post
    handlers.append(early)
    yield handlers, early, late
    handlers.remove(early)
    handlers.remove(late)


def test_a_handler_that_is_added_while_others_are_hidden_stays(frame_handlers):
    handlers, early, late = frame_handlers
    others_handlers.hide()
    assert early not in handlers
    handlers.append(late)
    others_handlers.show()
    assert early in handlers and late in handlers


def test_handlers_that_are_hidden_twice_come_back(frame_handlers):
    handlers, early, late = frame_handlers
    others_handlers.hide()
    handlers.append(late)
    with others_handlers.hidden():
        assert early not in handlers and late not in handlers
    assert early not in handlers and late not in handlers  # whoever hid them first shows them
    others_handlers.show()
    assert early in handlers and late in handlers


# ------------------------------------------------------------------------------------------------ drivers


def _drive(owner, path, index, which, source, expression):
    driver = owner.driver_add(path, index).driver
    variable = driver.variables.new()
    variable.name, variable.type = "v", "CONTEXT_PROP"
    variable.targets[0].context_property, variable.targets[0].data_path = which, source
    driver.expression = expression


def test_what_drivers_read_of_the_active_scene_and_layer_is_found_and_copied(scene, cube):
    scene["offset"], scene["vector"], scene.view_layers[0]["lift"] = 1.5, [1.0, 2.0], 0.25
    scene.unit_settings.scale_length = 0.5
    _drive(cube, "location", 0, "ACTIVE_SCENE", '["offset"]', "v")
    _drive(cube, "location", 1, "ACTIVE_VIEW_LAYER", '["lift"]', "v")
    _drive(cube, "scale", 0, "ACTIVE_SCENE", '["vector"][1]', "v")
    _drive(cube, "location", 2, "ACTIVE_SCENE", "unit_settings.scale_length", "v")
    wanted = context_drivers.paths()
    assert len(wanted) == 4
    other = bpy.data.scenes.new("Other")
    assert context_drivers.copy(wanted, scene, scene.view_layers[0], other) == []
    assert (other["offset"], other["vector"][1], other.view_layers[0]["lift"]) == (1.5, 2.0, 0.25)
    assert other.unit_settings.scale_length == 0.5


def test_what_a_trace_scene_cannot_have_is_named(scene, cube):
    """Values of other datablocks: the database beside the file gets no pointers to them."""
    _drive(cube, "location", 0, "ACTIVE_SCENE", "world.color[0]", "v")
    hybrid.enable(scene)
    trace_scenes.begin()
    trace_scenes.detach()
    (warning,) = trace_scenes.warnings(scene)
    assert "world.color[0]" in warning


@pytest.mark.render
def test_both_halves_have_a_driven_object_at_the_same_place(scene, cube):
    """The driver reads an animated property of the active scene."""
    scene["offset"] = 0.0
    scene.keyframe_insert('["offset"]', frame=1)
    scene["offset"] = 3.0
    scene.keyframe_insert('["offset"]', frame=5)
    _drive(cube, "location", 0, "ACTIVE_SCENE", '["offset"]', "v - 1.5")
    hybrid.enable(scene)
    for frame in (1, 5):
        result = hybrid.render(frame=frame)
        held_out = result.mask > 0.5
        traced = (result.traced[..., :3].sum(-1) > 0.01) & held_out
        assert held_out.sum() > 10
        assert (held_out & ~traced).sum() == 0, frame


@pytest.mark.render
def test_keyframed_properties_of_layer_scene_and_world_are_in_both_halves(scene, cube, tmp_path):
    """An animation, in which Blender evaluates each layer in a database of its own: red, green, blue of two planes."""
    layer, world = scene.view_layers[0], scene.world
    for owner, animated, path in (
        (layer, scene, f'view_layers["{layer.name}"]["of_layer"]'),
        (scene, scene, '["of_scene"]'),
        (world, world, '["of_world"]'),
    ):
        name = path.split('"')[-2]
        for frame, value in ((1, 0.0), (2, 0.75)):
            owner[name] = value
            animated.keyframe_insert(path, frame=frame)
    b_material = bpy.data.materials.new("Glow")
    if b_material.node_tree is None:
        b_material.use_nodes = True
    tree = b_material.node_tree
    b_glow, b_join = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeCombineXYZ")
    for name, b_input in zip(("of_layer", "of_scene", "of_world"), b_join.inputs, strict=True):
        b_node = tree.nodes.new("ShaderNodeAttribute")
        b_node.attribute_type, b_node.attribute_name = "VIEW_LAYER", name
        tree.links.new(b_node.outputs["Fac"], b_input)
    tree.links.new(b_join.outputs[0], b_glow.inputs["Color"])
    tree.links.new(b_glow.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    for is_traced in (True, False):
        bpy.ops.mesh.primitive_plane_add(size=20, location=(-10 if is_traced else 10, 0, 0))
        bpy.context.object.data.materials.append(b_material)
        bpy.context.object.hybrid.ray_traced = is_traced
    cube.hide_render = True
    scene.camera.location, scene.camera.rotation_euler = (0, 0, 10), (0, 0, 0)
    scene.frame_set(1)
    scene.frame_start = scene.frame_end = 2
    scene.render.image_settings.file_format, scene.render.filepath = "OPEN_EXR", str(tmp_path / "f")
    hybrid.enable(scene)
    bpy.ops.render.render(animation=True)
    picture = bpy.data.images.load(str(tmp_path / "f0002.exr"))
    width, height = picture.size
    pixels = np.array(picture.pixels[:]).reshape(height, width, -1)[height // 2, [width // 4, 3 * width // 4], :3]
    assert pixels == pytest.approx(np.full((2, 3), 0.75), rel=0.01)
