# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample scenes are what their README says: triangles, flags, camera, lights, animation, packed pictures."""

from __future__ import annotations

from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module")
import bmesh  # noqa: E402  (only importable next to bpy)

pytestmark = pytest.mark.blender

FOLDER = Path(__file__).resolve().parents[2] / "sample_scenes"
TRIANGLES = {"cornell_box": 19_248, "simple": 19_625, "intermediate": 128_232, "complex": 82_778, "studio": 68_798}
FLAGGED = {
    "cornell_box": {"Left sphere", "Right sphere", "Mirror wall"},
    "simple": {"Wine glass"},
    "intermediate": {"Reflective sphere", "Half transparent sphere", "Dragon", "Head", "Wine glass"},
    "studio": {
        "Plinth", "Bottle", "Liquid", "Stopper", "Frosted slab", "Copper ball", "Lacquered ball", "Chrome ball",
        "Glass ball", "Diamond",
    },
}  # fmt: skip
CUSTOM = {  # (reflectivity, opacity, ior or None)
    ("cornell_box", "Left sphere"): (0.5, 0.5, 1.5),
    ("cornell_box", "Right sphere"): (1.0, 1.0, None),
    ("cornell_box", "Mirror wall"): (1.0, 1.0, None),
    ("simple", "Wine glass"): (0.0, 1.0, None),
    ("intermediate", "Reflective sphere"): (0.5, 1.0, None),
    ("intermediate", "Half transparent sphere"): (0.5, 0.5, 1.3),
    ("intermediate", "Dragon"): (0.08, 1.0, None),
    ("intermediate", "Head"): (0.15, 1.0, None),
    ("complex", "Mirror"): (1.0, 1.0, None),
}
MOVING = {
    "cornell_box": set(),
    "simple": {"Moving light"},
    "intermediate": {"Moving light", "Reflective sphere", "Half transparent sphere", "Head"},
    "complex": {"Cabin light", "Window light"},
    "studio": set(),
}
LIGHTS = {
    "cornell_box": {"Ceiling light", "Fill light"},
    "simple": {"Fixed light", "Moving light"},
    "intermediate": {"Fixed light", "Moving light"},
    "complex": {"Cabin light", "Window light"},
    "studio": {"Key", "Side", "Halo", "Bar"},
}
TRANSPARENT = {  # light passes through these: their skin must be closed and face outwards
    "cornell_box": {"Left sphere"},
    "simple": {"Wine glass"},
    "intermediate": {"Half transparent sphere", "Wine glass"},
    "complex": {"Tumbler", "Dispenser", "Flask 0", "Flask 1", "Shelf 0", "Shelf 1"},
    "studio": {"Bottle", "Liquid", "Frosted slab", "Glass ball", "Diamond"},
}
NOT_CLEAR_GLASS = {"Liquid": (1.36, 0.0), "Frosted slab": (1.45, 0.32), "Diamond": (2.42, 0.0)}  # IOR and roughness


@pytest.fixture(scope="module", params=sorted(TRIANGLES))
def name(request, addon):
    """Each file opened once, in turn."""
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{request.param}.blend"))
    yield request.param
    bpy.ops.wm.read_factory_settings()


def _evaluated():
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return [instance.object for instance in depsgraph.object_instances if instance.object.type == "MESH"]


def test_the_triangles_are_counted_exactly(name):
    total = 0
    for obj in _evaluated():
        obj.data.calc_loop_triangles()
        total += len(obj.data.loop_triangles)
    assert total == TRIANGLES[name]


@pytest.mark.usefixtures("name")
def test_the_viewport_shows_as_many_as_the_render():
    for obj in bpy.data.objects:
        for modifier in obj.modifiers:
            if modifier.type == "SUBSURF":
                assert modifier.levels == modifier.render_levels
            if modifier.type == "SCREW":
                assert modifier.steps == modifier.render_steps


def test_the_right_objects_are_flagged(name):
    ray_traced = {obj.name for obj in bpy.data.objects if obj.hybrid.ray_traced}
    if name in FLAGGED:
        assert ray_traced == FLAGGED[name]
        return
    unflagged = {obj.name for obj in bpy.data.objects if obj.type == "MESH"} - ray_traced
    assert len(ray_traced) == 79, "most of the washroom is ray traced"
    assert {"Floor", "Ceiling", "Left wall", "Back wall", "Front wall", "Fuselage wall", "Towel"} <= unflagged


def test_the_custom_surfaces_have_their_values(name):
    for (scene, obj), (reflectivity, opacity, ior) in CUSTOM.items():
        if scene != name:
            continue
        settings = bpy.data.objects[obj].hybrid
        assert settings.surface == "CUSTOM"
        assert (settings.reflectivity, settings.opacity) == pytest.approx((reflectivity, opacity))
        if ior is not None:
            assert settings.ior == pytest.approx(ior)


def test_what_is_glass_from_its_material_is_clear_glass_but_what_is_named(name):
    for key in TRANSPARENT[name]:
        obj = bpy.data.objects[key]
        if obj.hybrid.surface == "CUSTOM":
            assert (name, key) in CUSTOM
            continue
        inputs = obj.data.materials[0].node_tree.nodes["Principled BSDF"].inputs
        assert inputs["Transmission Weight"].default_value == 1.0
        values = inputs["IOR"].default_value, inputs["Roughness"].default_value
        if key in NOT_CLEAR_GLASS:
            assert values == pytest.approx(NOT_CLEAR_GLASS[key])
        else:
            assert values in (pytest.approx((1.45, 0.0)), pytest.approx((1.5, 0.0)))


def test_solids_face_outwards_and_transparent_ones_are_closed(name):
    closed = set()
    for obj in _evaluated():
        skin = bmesh.new()
        skin.from_mesh(obj.data)
        if all(len(edge.link_faces) == 2 for edge in skin.edges):
            closed.add(obj.name)
            assert skin.calc_volume(signed=True) > 0, obj.name
        skin.free()
    assert TRANSPARENT[name] <= closed


def test_camera_size_samples_and_frames(name):
    scene = bpy.context.scene
    assert scene.camera is not None and scene.camera.type == "CAMERA"
    assert scene.render.engine in {"BLENDER_EEVEE", "BLENDER_EEVEE_NEXT"}
    assert scene.eevee.taa_render_samples == 16
    render = scene.render
    assert (render.resolution_x, render.resolution_y, render.resolution_percentage) == (1024, 768, 100)
    assert (scene.frame_start, scene.frame_end, scene.frame_current, render.fps) == (1, 24, 1, 24)
    assert scene.hybrid.enabled


def test_the_lights_reach_the_things_they_light(name):
    lamps = {obj.name: obj for obj in bpy.data.objects if obj.type == "LIGHT"}
    assert set(lamps) == LIGHTS[name]
    threshold = bpy.context.scene.eevee.light_threshold
    for lamp in lamps.values():
        reach = (lamp.data.energy / 100 / threshold) ** 0.5  # EEVEE: nothing beyond
        assert reach > 2.5, lamp.name


def test_what_moves_moves_and_nothing_else_does(name):
    scene = bpy.context.scene
    poses = {}
    for frame in (1, 8):
        scene.frame_set(frame)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        poses[frame] = {obj.name: obj.evaluated_get(depsgraph).matrix_world.copy() for obj in scene.objects}
    scene.frame_set(1)
    moved = {key for key in poses[1] if any((poses[1][key][i] - poses[8][key][i]).length > 1e-3 for i in range(4))}
    assert moved == MOVING[name]


@pytest.mark.usefixtures("name")
def test_every_picture_is_packed_and_nothing_is_linked():
    for image in bpy.data.images:
        if image.source == "FILE":
            assert image.packed_file is not None, image.name
    assert not bpy.data.libraries


@pytest.mark.parametrize("name", ["studio"], indirect=True)
def test_the_softboxes_have_each_another_shape_and_the_bar_is_long_and_thin(name):
    lamps = {obj.name: obj.data for obj in bpy.data.objects if obj.type == "LIGHT"}
    shapes = {key: lamp.shape for key, lamp in lamps.items()}
    assert shapes == {"Key": "SQUARE", "Side": "RECTANGLE", "Halo": "DISK", "Bar": "RECTANGLE"}
    assert lamps["Bar"].size > 40 * lamps["Bar"].size_y


@pytest.mark.parametrize("name", ["studio"], indirect=True)
def test_the_diamond_is_a_brilliant(name):
    facets = bpy.data.objects["Diamond"].data.polygons
    girdle = [facet for facet in facets if abs(facet.normal.z) < 1e-3]
    assert (len(facets) - len(girdle), len(girdle)) == (57, 64)  # a table, 32 crown and 24 pavilion facets
    assert not any(facet.use_smooth for facet in facets)


def test_the_file_is_small(name):
    assert (FOLDER / f"{name}.blend").stat().st_size < 1_000_000
