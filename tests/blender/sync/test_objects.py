# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects arrive, where, how often, with which settings; and what the artist is told of the others."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.sync import Warnings, translate
from hybrid_addon.blender.sync.coverage import PROBE_TYPES
from hybrid_addon.scene import Settings
from hybrid_addon.tracer import trace

pytestmark = pytest.mark.blender

SIZE, WINDOW = (64, 48), (0, 0, 64, 48)


def translation(scene, **options):
    bpy.context.view_layer.update()
    return translate(bpy.context.evaluated_depsgraph_get(), scene, SIZE, WINDOW, **options)


def instances(scene, name):
    return [instance for instance in translation(scene).scene.instances if instance.name == name]


def scatter_group(kind, socket, value):
    """Geometry nodes that put instances of another datablock on the points of the mesh, and drop the mesh."""
    b_group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        b_group.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    b_in, b_out = b_group.nodes.new("NodeGroupInput"), b_group.nodes.new("NodeGroupOutput")
    b_source, b_points = b_group.nodes.new(kind), b_group.nodes.new("GeometryNodeInstanceOnPoints")
    b_source.inputs[socket].default_value = value
    if "As Instance" in b_source.inputs:
        b_source.inputs["As Instance"].default_value = True
    b_group.links.new(b_in.outputs[0], b_points.inputs["Points"])
    b_group.links.new(
        b_source.outputs["Geometry" if "Geometry" in b_source.outputs else 0], b_points.inputs["Instance"]
    )
    b_group.links.new(b_points.outputs[0], b_out.inputs[0])
    return b_group


def collection_instance(b_object, name="Instancer"):
    """An empty that shows a collection with `b_object` in it, which the scene itself does not hold."""
    b_collection = bpy.data.collections.new("Instanced")
    b_collection.objects.link(b_object)
    for b_user in list(b_object.users_collection):
        if b_user != b_collection:
            b_user.objects.unlink(b_object)
    b_empty = bpy.data.objects.new(name, None)
    b_empty.instance_type, b_empty.instance_collection = "COLLECTION", b_collection
    bpy.context.collection.objects.link(b_empty)
    return b_empty


def test_the_factory_scene(scene):
    result = translation(scene)
    assert result.counts == {
        "instances": 1,
        "ray_traced": 0,
        "meshes": 1,
        "triangles": 12,
        "surfaces": 1,
        "lights": 1,
    }
    assert result.warnings == ()
    assert result.scene.instances[0].ray_traced is False
    assert result.scene.lights[0].range == pytest.approx((1000 / 100 / 0.01) ** 0.5)
    assert translation(scene, light_falloff="PHYSICAL").scene.lights[0].range == float("inf")


def test_a_far_and_sheared_matrix_keeps_its_digits(scene):
    b_cube = bpy.data.objects["Cube"]
    b_cube.matrix_world = [[1, 0.5, 0, 1e6], [0, -2, 0, 0.25], [0, 0, 0, 3], [0, 0, 0, 1]]
    b_cube.matrix_parent_inverse = [[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    b_cube.parent = bpy.data.objects["Light"]
    found = instances(scene, "Cube")[0].matrix_world
    assert found.dtype == np.float64
    assert found.tolist() == np.array(b_cube.matrix_world).tolist()


def test_flag_and_custom_numbers_arrive_with_animated_values(scene):
    b_hybrid = bpy.data.objects["Cube"].hybrid
    b_hybrid.ray_traced, b_hybrid.surface, b_hybrid.opacity, b_hybrid.ior = True, "CUSTOM", 0.25, 1.5
    for frame, value in ((1, 0.0), (11, 1.0)):
        b_hybrid.reflectivity = value
        bpy.data.objects["Cube"].keyframe_insert("hybrid.reflectivity", frame=frame)
    scene.frame_set(1)
    assert translation(scene).scene.surfaces[0].reflectivity == 0.0
    scene.frame_set(11)
    result = translation(scene)
    assert result.counts["ray_traced"] == 1
    surface = result.scene.surfaces[result.scene.instances[0].surfaces[0]]
    assert (surface.reflectivity, surface.opacity, surface.ior) == (1.0, 0.25, 1.5)


def test_equal_meshes_and_surfaces_are_shared(scene):
    b_cube = bpy.data.objects["Cube"]
    for x in (3, 6):
        b_copy = bpy.data.objects.new("Copy", b_cube.data)
        b_copy.location.x = x
        bpy.context.collection.objects.link(b_copy)
    b_copy.hybrid.surface = "CUSTOM"
    result = translation(scene)
    assert result.counts["instances"] == 3
    assert result.counts["meshes"] == 1
    assert result.counts["triangles"] == 36
    assert result.counts["surfaces"] == 2  # the material as it is, and with the last copy's own numbers
    assert sorted(instance.matrix_world[0, 3] for instance in result.scene.instances) == [0, 3, 6]


def test_a_picture_of_shared_meshes_is_that_of_copies_exact(scene):
    b_cube = bpy.data.objects["Cube"]
    b_cube.hybrid.ray_traced = True
    for x in (-3, 3):
        b_copy = bpy.data.objects.new("Copy", b_cube.data)
        b_copy.location.x = x
        bpy.context.collection.objects.link(b_copy)
    shared = translation(scene)
    for b_object in bpy.data.objects:
        if b_object.type == "MESH":
            b_object.data = b_object.data.copy()
    copies = translation(scene)
    assert (shared.counts["meshes"], copies.counts["meshes"]) == (1, 3)
    films = [trace(found.scene, Settings(samples=2, camera_sees="ALL", threads=1)) for found in (shared, copies)]
    np.testing.assert_array_equal(films[0].radiance, films[1].radiance)
    assert films[0].rays == films[1].rays and films[0].radiance.any()


def test_modifiers_are_applied_and_give_the_object_a_mesh_of_its_own(scene):
    b_copy = bpy.data.objects.new("Copy", bpy.data.objects["Cube"].data)
    bpy.context.collection.objects.link(b_copy)
    b_copy.modifiers.new("Array", "ARRAY").count = 5
    result = translation(scene)
    assert sorted(len(mesh.triangles) for mesh in result.scene.meshes) == [12, 60]


@pytest.mark.parametrize("ray_traced", ["Cube", "Instancer", None])
def test_collection_instances_are_flagged_by_their_instancer(scene, ray_traced):
    """As EEVEE holds them out: an instance takes the holdout of what instances it, not of the object shown."""
    b_empty = collection_instance(bpy.data.objects["Cube"])
    b_empty.location = (1, 2, 3)
    if ray_traced:
        b_hybrid = bpy.data.objects[ray_traced].hybrid
        b_hybrid.ray_traced, b_hybrid.surface, b_hybrid.reflectivity = True, "CUSTOM", 0.75
    result = translation(scene)
    (instance,) = result.scene.instances
    assert instance.ray_traced is (ray_traced == "Instancer")
    assert any("tick 'Instancer'" in warning for warning in result.warnings) is (ray_traced == "Cube")
    assert instance.matrix_world[:3, 3].tolist() == [1, 2, 3]
    assert result.scene.surfaces[instance.surfaces[0]].reflectivity == (0.75 if ray_traced else 0.0)


def test_lights_are_instanced_too(scene):
    b_light = bpy.data.objects["Light"]
    b_light.location = (0, 0, 1)
    collection_instance(b_light).location = (5, 0, 0)
    assert [lamp.position for lamp in translation(scene).scene.lights] == [(5, 0, 1)]


def test_geometry_nodes_instances_and_their_materials(scene):
    b_cube = bpy.data.objects["Cube"]
    bpy.ops.mesh.primitive_ico_sphere_add()
    b_source = bpy.context.object
    b_source.hide_render = True  # hidden itself, shown where it is instanced
    b_source.data.materials.append(bpy.data.materials.new("Of Source"))
    b_cube.hybrid.ray_traced = True
    b_modifier = b_cube.modifiers.new("Scatter", "NODES")
    b_modifier.node_group = scatter_group("GeometryNodeObjectInfo", "Object", b_source)
    result = translation(scene)
    assert result.counts["instances"] == 8
    assert result.counts["meshes"] == 1
    assert result.counts["ray_traced"] == 8
    assert {tuple(instance.matrix_world[:3, 3]) for instance in result.scene.instances} == {
        (x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)
    }
    assert {surface.name for surface in result.scene.surfaces} == {"Of Source"}


@pytest.mark.parametrize(
    "add",
    [
        lambda: bpy.ops.curve.primitive_bezier_circle_add(),
        lambda: bpy.ops.object.text_add(),
        lambda: bpy.ops.surface.primitive_nurbs_surface_sphere_add(),
    ],
    ids=["curve", "text", "surface"],
)
def test_whatever_evaluates_to_a_mesh_arrives_once(scene, add):
    add()
    b_object = bpy.context.object
    if b_object.type == "CURVE":
        b_object.data.bevel_depth = 0.1
    b_object.hybrid.ray_traced = True
    (instance,) = instances(scene, b_object.name)
    assert instance.ray_traced
    b_object.hide_render = True
    assert instances(scene, b_object.name) == []


def test_metaballs_are_eevees_and_named(scene):
    """Blender gives them a skin in their own scene's depsgraph only: a render would show a hole."""
    bpy.ops.object.metaball_add()
    b_object = bpy.context.object
    b_object.hybrid.ray_traced = True
    result = translation(scene)
    assert b_object.name not in {instance.name for instance in result.scene.instances}
    assert [w for w in result.warnings if "metaballs" in w and b_object.name in w]
    assert result.counts["ray_traced"] == 0
    with pytest.raises(hybrid.HybridError, match="convert it to a mesh"):
        hybrid.mark(b_object)


def test_hidden_objects_and_hidden_instancers_do_not_arrive(scene):
    b_cube = bpy.data.objects["Cube"]
    bpy.ops.mesh.primitive_plane_add()
    b_plane = bpy.context.object
    b_cube.parent, b_plane.instance_type = b_plane, "VERTS"
    assert len(instances(scene, "Plane")) == 1
    b_plane.show_instancer_for_render = b_plane.show_instancer_for_viewport = False
    assert instances(scene, "Plane") == []
    assert len(instances(scene, "Cube")) >= 4
    b_plane.modifiers.new("Particles", "PARTICLE_SYSTEM")  # the depsgraph then lists the plane, with show_self off
    assert instances(scene, "Plane") == []
    bpy.data.objects["Light"].hide_render = True
    assert translation(scene).counts["lights"] == 0


def test_ray_visibility(scene):
    b_cube = bpy.data.objects["Cube"]
    b_cube.visible_camera = b_cube.visible_shadow = b_cube.visible_glossy = False
    visibility = instances(scene, "Cube")[0].visibility
    assert (visibility.camera, visibility.shadow, visibility.secondary) == (False, False, True)
    b_cube.visible_transmission = False
    assert instances(scene, "Cube")[0].visibility.secondary is False


def test_what_is_visible_but_not_traced_is_named_and_the_rest_is_not(scene):
    bpy.ops.object.metaball_add()
    bpy.ops.object.armature_add()
    bpy.ops.object.empty_add()
    bpy.ops.object.lightprobe_add()
    bpy.data.objects["Cube"].is_holdout = True
    assert set(translation(scene).warnings) == {
        "object 'Mball': metaballs are not ray traced: convert them to meshes",
        "object 'Sphere': rough reflections of ray traced objects show the world instead of it",
        "object 'Cube': Holdout is not traced; it is solid in reflections",
    }


def test_an_object_without_material_is_blenders_grey(scene):
    bpy.data.objects["Cube"].data.materials.clear()
    (surface,) = translation(scene).scene.surfaces
    assert surface.base_color == (0.8, 0.8, 0.8)
    assert (surface.reflectivity, surface.opacity) == (0.0, 1.0)


def test_a_missing_library_is_named(scene, tmp_path):
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {bpy.data.objects["Cube"]})
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.objects = ["Cube"]
    bpy.context.collection.objects.link(wanted.objects[0])
    main = str(tmp_path / "main.blend")
    bpy.ops.wm.save_as_mainfile(filepath=main)
    (tmp_path / "library.blend").unlink()
    try:
        bpy.ops.wm.open_mainfile(filepath=main, load_ui=False)
    except RuntimeError:  # Blender reports the missing library as an error and has opened the file all the same
        pass
    warnings = translation(bpy.context.scene).warnings
    assert [line for line in warnings if "'Cube'" in line and "library.blend" in line]


NAMES = ("'Sphere.001'", "'Sphere.002'", "'Sphere.003'")


def test_warnings_come_in_the_same_order_each_time_and_once(scene):
    bpy.ops.object.lightprobe_add()
    for _ in range(3):
        b_copy = bpy.context.object.copy()
        bpy.context.collection.objects.link(b_copy)
    first, second = translation(scene).warnings, translation(scene).warnings
    assert first == second
    assert first == (f"object 'Sphere': {PROBE_TYPES['SPHERE']} (4 such: 'Sphere', " + ", ".join(NAMES) + ")",)
    collected = Warnings()
    collected.add("from elsewhere")
    assert translation(scene, warn=collected).warnings == (*first, "from elsewhere"), "a whole object is missing"
