# SPDX-License-Identifier: GPL-3.0-or-later
"""Displacement by nodes: where vertices go, how normals bend, and that the mask of EEVEE's half agrees."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.sync import translate
from hybrid_addon.scene import Settings
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.materials.textures import sample_texture

pytestmark = pytest.mark.blender

SIZE = (64, 48)


def translated(scene, size=SIZE):
    bpy.context.view_layer.update()
    window = (0, 0, *size)
    return translate(bpy.context.evaluated_depsgraph_get(), scene, size, window, sample=sample_texture)


def material_of(b_object, kind="ShaderNodeDisplacement", method="DISPLACEMENT", **settings):
    """A matte material that is displaced; gives the displacing node and its tree."""
    b_material = bpy.data.materials.new("Displaced")
    if b_material.node_tree is None:
        b_material.use_nodes = True
    b_tree = b_material.node_tree
    b_diffuse, b_node = b_tree.nodes.new("ShaderNodeBsdfDiffuse"), b_tree.nodes.new(kind)
    b_output = b_tree.nodes["Material Output"]
    b_tree.links.new(b_diffuse.outputs[0], b_output.inputs["Surface"])
    b_tree.links.new(b_node.outputs[0], b_output.inputs["Displacement"])
    if "Scale" in b_node.inputs:
        b_node.inputs["Scale"].default_value = 1.0
    b_node.space = settings.pop("space", "OBJECT")
    for name, value in settings.items():
        b_node.inputs[name].default_value = value
    b_material.displacement_method = method
    b_object.data.materials.clear()
    b_object.data.materials.append(b_material)
    return b_node, b_tree


def smooth(b_object):
    b_object.data.polygons.foreach_set("use_smooth", [True] * len(b_object.data.polygons))
    return b_object


def mesh_of(scene, name="Cube"):
    result = translated(scene)
    (instance,) = [i for i in result.scene.instances if i.name == name]
    return result.scene.meshes[instance.mesh], instance, result


@pytest.mark.parametrize("space", ["OBJECT", "WORLD"])
def test_vertices_move_along_the_normal_by_height_less_midlevel(scene, space):
    """A ball of radius 1, three times as large in the world: in object space it grows with the object."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=1)
    ball = smooth(bpy.context.object)
    ball.scale = (3, 3, 3)
    material_of(ball, Height=0.9, Midlevel=0.4, Scale=0.5, space=space)
    mesh, instance, result = mesh_of(scene, ball.name)
    world = mesh.vertices @ instance.matrix_world[:3, :3].T
    assert np.linalg.norm(world, axis=1) == pytest.approx(3 + (0.75 if space == "OBJECT" else 0.25), rel=1e-3)
    assert len(mesh.vertices) == len(ball.data.vertices)  # still closed
    assert result.warnings == ()


def test_bump_only_moves_nothing(scene):
    cube = bpy.data.objects["Cube"]
    material_of(cube, method="BUMP", Height=2.0)
    mesh, _, result = mesh_of(scene)
    assert np.abs(mesh.vertices).max() == 1
    assert result.scene.surfaces[0].normal is not None


def test_flat_faces_come_apart_as_eevee_draws_them_and_smooth_ones_stay_together(scene):
    cube = bpy.data.objects["Cube"]
    material_of(cube, Height=1.0, Midlevel=0.0, Scale=0.5)
    mesh = mesh_of(scene)[0]
    moved = mesh.vertices[mesh.triangles].reshape(-1, 3)
    assert sorted(set(np.round(np.abs(moved).max(axis=1), 4).tolist())) == [1.5]
    assert sorted(set(np.round(np.abs(moved).min(axis=1), 4).tolist())) == [1.0]
    smooth(cube)
    mesh = mesh_of(scene)[0]
    assert len(mesh.vertices) == 8
    assert np.abs(mesh.vertices) == pytest.approx(1 + 0.5 / np.sqrt(3), rel=1e-4)


def test_only_the_faces_that_wear_it_move(scene):
    cube = bpy.data.objects["Cube"]
    material_of(cube, kind="ShaderNodeVectorDisplacement", space="WORLD", Vector=(0, 0, 1, 0), Midlevel=0.0)
    cube.data.materials.append(bpy.data.materials.new("Plain"))
    top = [all(cube.data.vertices[v].co.z > 0 for v in p.vertices) for p in cube.data.polygons]
    cube.data.polygons.foreach_set("material_index", [0 if is_top else 1 for is_top in top])
    mesh = mesh_of(scene)[0]
    heights = mesh.vertices[mesh.triangles][..., 2]
    assert sorted(set(np.round(heights[mesh.surface_slots == 0].ravel(), 4).tolist())) == [2.0]
    assert sorted(set(np.round(heights[mesh.surface_slots == 1].ravel(), 4).tolist())) == [-1.0, 1.0]


@pytest.mark.parametrize(("space", "moved"), [("WORLD", (0.3, 0, 0)), ("OBJECT", (0, 0.6, 0))])
def test_vector_displacement_in_world_and_object_space(scene, space, moved):
    """The object is turned by a quarter about z and twice as large."""
    cube = bpy.data.objects["Cube"]
    cube.rotation_euler, cube.scale = (0, 0, np.pi / 2), (2, 2, 2)
    material_of(cube, kind="ShaderNodeVectorDisplacement", space=space, Vector=(0.8, 0.5, 0.5, 0), Midlevel=0.5)
    mesh, instance, _ = mesh_of(scene)
    used = mesh.vertices[np.unique(mesh.triangles)]
    world = used.astype(float) @ instance.matrix_world[:3, :3].T
    assert (world.max(axis=0) + world.min(axis=0)) / 2 == pytest.approx(moved, abs=1e-4)


def test_tangent_space_has_the_uv_maps_u_the_normal_and_v(scene):
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_plane_add(size=2)  # its U runs along x, its V along y
    plane = bpy.context.object
    material_of(plane, kind="ShaderNodeVectorDisplacement", space="TANGENT", Vector=(0.1, 0.2, 0.3, 0), Midlevel=0.0)
    mesh = mesh_of(scene, plane.name)[0]
    used = mesh.vertices[np.unique(mesh.triangles)]
    assert (used.max(axis=0) + used.min(axis=0)) / 2 == pytest.approx((0.1, 0.3, 0.2), abs=1e-4)


def test_copies_at_other_places_have_their_own_shape(scene):
    """World space: of two copies one is stretched along x."""
    cube = bpy.data.objects["Cube"]
    material_of(cube, kind="ShaderNodeVectorDisplacement", space="WORLD", Vector=(1, 0, 0, 0), Midlevel=0.0)
    copy = bpy.data.objects.new("Copy", cube.data)
    copy.scale.x = 4
    scene.collection.objects.link(copy)
    assert mesh_of(scene)[0].vertices[:, 0].max() == pytest.approx(2)
    assert mesh_of(scene, "Copy")[0].vertices[:, 0].max() == pytest.approx(1.25)


@pytest.mark.parametrize("method", ["BUMP", "DISPLACEMENT", "BOTH"])
@pytest.mark.parametrize("is_scaled", [False, True])
def test_a_slope_is_lit_as_a_slope(scene, method, is_scaled):
    """Height k x over a plane that a sun lights from above: its cosine is that of the slope, moved or not."""
    for name in ("Cube", "Light"):
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.ops.mesh.primitive_plane_add(size=8)
    plane = bpy.context.object
    plane.scale = (2, 2, 2) if is_scaled else (1, 1, 1)
    k = 0.75
    b_node, b_tree = material_of(plane, method=method, Midlevel=0.0, Scale=k)
    b_place, b_split = b_tree.nodes.new("ShaderNodeNewGeometry"), b_tree.nodes.new("ShaderNodeSeparateXYZ")
    b_tree.links.new(b_place.outputs["Position"], b_split.inputs[0])
    b_tree.links.new(b_split.outputs["X"], b_node.inputs["Height"])
    if is_scaled:  # object space: the height itself is scaled
        b_node.inputs["Scale"].default_value = k / 2
    b_tree.nodes["Diffuse BSDF"].inputs["Color"].default_value = (1, 1, 1, 1)
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle = np.pi, 0
    scene.collection.objects.link(sun)
    scene.camera.location, scene.camera.rotation_euler = (0, 0, 20), (0, 0, 0)
    film = trace(translated(scene, (16, 16)).scene, Settings(samples=4, camera_sees="ALL"))
    assert film.radiance[6:10, 6:10] == pytest.approx(1 / np.hypot(1, k), rel=0.01)


def feed(b_tree, b_node, kind, output, socket="Height", **settings):
    """Link an output of a new node to an input of the displacing node."""
    b_asked = b_tree.nodes.new(kind)
    for name, value in settings.items():
        setattr(b_asked, name, value)
    b_tree.links.new(b_asked.outputs[output], b_node.inputs[socket])
    return b_asked


def test_each_object_has_its_own_height(scene):
    """Two of one mesh, whose material asks the object for the height: smooth corners go out along the diagonal."""
    cube = smooth(bpy.data.objects["Cube"])
    b_node, b_tree = material_of(cube, Midlevel=0.0)
    feed(b_tree, b_node, "ShaderNodeAttribute", "Fac", attribute_type="OBJECT", attribute_name="height")
    copy = bpy.data.objects.new("Copy", cube.data)
    scene.collection.objects.link(copy)
    cube["height"], copy["height"] = 0.5, 2.0
    for name, height in (("Cube", 0.5), ("Copy", 2.0)):
        mesh, _, result = mesh_of(scene, name)
        assert np.abs(mesh.vertices) == pytest.approx(1 + height / np.sqrt(3), rel=1e-4)
        assert result.warnings == ()


@pytest.mark.parametrize(
    ("kind", "output", "settings", "height"),
    [
        ("ShaderNodeLightPath", "Is Camera Ray", {}, 1.0),
        ("ShaderNodeLightPath", "Is Shadow Ray", {}, 0.0),
        ("ShaderNodeLightPath", "Ray Length", {}, 6.0),
        ("ShaderNodeNewGeometry", "Backfacing", {}, 0.0),
        ("ShaderNodeLayerWeight", "Facing", {}, 0.0),
        ("ShaderNodeCameraData", "View Z Depth", {}, 6.0),
        ("ShaderNodeObjectInfo", "Material Index", {}, 3.0),
        ("ShaderNodeObjectInfo", "Object Index", {}, 4.0),
        ("ShaderNodeAttribute", "Fac", {"attribute_type": "VIEW_LAYER", "attribute_name": "rise"}, 0.75),
    ],
)
def test_what_nodes_ask_of_the_frame_displaces(scene, kind, output, settings, height):
    """A plane under the camera, whose middle vertex (at 6 m) is watched."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=2, y_subdivisions=2, size=2)
    plane = bpy.context.object
    scene.camera.location, scene.camera.rotation_euler = (0, 0, 6), (0, 0, 0)
    b_node, b_tree = material_of(plane, Midlevel=0.0, space="WORLD")
    feed(b_tree, b_node, kind, output, **settings)
    plane.pass_index, plane.active_material.pass_index = 4, 3
    scene.view_layers[0]["rise"] = 0.75
    mesh, _, result = mesh_of(scene, plane.name)
    middle = np.abs(mesh.vertices[:, :2]).max(axis=1) == 0
    assert mesh.vertices[middle, 2] == pytest.approx(height, abs=1e-5)
    assert result.warnings == ()


@pytest.mark.render
def test_the_mask_and_the_displaced_shape_agree(scene):
    """EEVEE's own coverage of a bumpy ball, and that of the tracer, with and without displacement."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1.2)
    ball = smooth(bpy.context.object)
    b_node, b_tree = material_of(ball, Midlevel=0.5)
    b_noise, b_coordinates = b_tree.nodes.new("ShaderNodeTexNoise"), b_tree.nodes.new("ShaderNodeTexCoord")
    b_noise.inputs["Scale"].default_value, b_noise.inputs["Detail"].default_value = 0.9, 1.0
    b_tree.links.new(b_coordinates.outputs["Object"], b_noise.inputs["Vector"])
    b_tree.links.new(b_noise.outputs[0], b_node.inputs["Height"])
    feed(b_tree, b_node, "ShaderNodeAttribute", "Fac", "Scale", attribute_type="OBJECT", attribute_name="swing")
    ball["swing"] = 1.2
    hybrid.mark(ball)
    scene.eevee.use_shadows, scene.eevee.taa_render_samples = False, 16
    hybrid.enable(scene)
    mask = hybrid.render(scene, samples=16, resolution=SIZE).mask
    hybrid.disable(scene)
    settings, wanted = Settings(samples=16), np.ones(SIZE[::-1], np.float32)

    def coverage():
        return trace(translated(scene).scene, settings, wanted).coverage

    assert np.abs(coverage() - mask).mean() < 0.01 * mask.mean()
    ball["swing"] = 0.0
    ball.update_tag()
    assert np.abs(coverage() - mask).mean() > 0.05 * mask.mean()
