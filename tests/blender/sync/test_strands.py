# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair, curves and points as triangles: their size, their shape, their data, and where Blender has them."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from hybrid_addon.blender.sync import translate
from hybrid_addon.blender.sync.tubes import Strands, balls, smoothed, tubes

pytestmark = pytest.mark.blender

SIZE, WINDOW = (64, 48), (0, 0, 64, 48)


def strands_of(*lines, radius=0.1):
    sizes = [len(line) for line in lines]
    points = np.concatenate([np.array(line, np.float32) for line in lines])
    first = np.concatenate([[0], np.cumsum(sizes)])
    return Strands(points, np.full(len(points), radius, np.float32), first, np.arange(len(points), dtype=float))


def volume(made):
    a, b, c = (made.vertices[made.triangles[:, i]].astype(np.float64) for i in range(3))
    return (np.cross(a, b) * c).sum() / 6


def is_closed(made):
    t = made.triangles
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    there = {tuple(edge) for edge in edges.tolist()}
    return len(there) == len(edges) and all((b, a) in there for a, b in there)


def mean_width(made, axis):
    """Of the shadow that turns around an axis, over half a turn."""
    across = [i for i in range(3) if i != axis]
    angles = np.linspace(0, np.pi, 181)[:-1]
    seen = made.vertices[:, across] @ np.array([np.cos(angles), np.sin(angles)])
    return float(np.ptp(seen, axis=0).mean())


@pytest.mark.parametrize("strands", [1, 20_000])
def test_a_tube_is_closed_and_as_wide_as_its_cylinder(strands):
    """However few sides it has."""
    line = [(0, 0, 0), (0, 0, 1), (0, 0, 2)]
    made = tubes(strands_of(*[line] * strands))
    one = np.unique(made.point // 3 == 0)  # all strands are the same
    assert one[-1]
    if strands == 1:
        assert is_closed(made)
        assert volume(made) == pytest.approx(np.pi * 0.1**2 * 2, rel=0.03)
    assert mean_width(made, 2) == pytest.approx(0.2, rel=1e-3)


def test_a_tube_bends_without_a_twist_and_its_normals_look_outwards():
    t = np.linspace(0, 6 * np.pi, 200)
    helix = np.stack([np.cos(t), np.sin(t), 0.3 * t], axis=1)
    made = tubes(strands_of(helix, radius=0.05))
    assert is_closed(made)
    a, b, c = (made.vertices[made.triangles[:, i]] for i in range(3))
    geometric = np.cross(b - a, c - a)
    assert ((geometric * made.normals[made.corners[:, 0]]).sum(axis=1) > 0).all()
    length = np.hypot(1, 0.3) * 6 * np.pi
    assert volume(made) == pytest.approx(np.pi * 0.05**2 * length, rel=0.05)


def test_strands_of_one_point_have_no_tube():
    made = tubes(strands_of([(0, 0, 0)], [(1, 0, 0), (1, 0, 1)], [(5, 5, 5)]))
    used = made.vertices[np.unique(made.triangles)]
    assert is_closed(made) and used[:, 0].max() < 1.2 and used[:, 0].min() > 0.8


def test_curves_pass_through_their_points_and_closed_ones_end_where_they_begin():
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    smooth = smoothed(strands_of(square, square), np.array([8, 8]), np.array([False, True]))
    assert np.diff(smooth.first).tolist() == [25, 33]
    assert np.allclose(smooth.points[:25:8], square)
    assert np.allclose(smooth.points[25::8], [*square, square[0]])
    assert smooth.source[:25:8].tolist() == [0, 1, 2, 3]
    middle = smooth.points[12]
    assert middle.tolist() == pytest.approx([1.125, 0.5, 0])  # of the uniform spline: 9/16 (p1 + p2) - (p0 + p3) / 16


def test_a_bezier_quarter_is_a_circle():
    k = 4 / 3 * (np.sqrt(2) - 1)
    ends = strands_of([(1, 0, 0), (0, 1, 0)])
    right, left = (np.array(h, np.float32) for h in ([(1, k, 0), (0, 1, 0)], [(1, 0, 0), (k, 1, 0)]))
    smooth = smoothed(ends, np.array([16]), np.array([False]), (left, right), np.array([True]))
    assert np.allclose(np.linalg.norm(smooth.points, axis=1), 1, atol=3e-4)


def test_balls_are_as_large_as_their_spheres_in_the_mean():
    made = balls(np.zeros((1, 3), np.float32), np.array([2.0], np.float32))
    assert is_closed(made)
    a, b, c = (made.vertices[made.triangles[:, i]] for i in range(3))
    assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 4 == pytest.approx(np.pi * 4, rel=1e-4)
    assert volume(made) > 0


# ------------------------------------------------------------------------------------------------ from Blender


def translated(scene):
    bpy.context.view_layer.update()
    return translate(bpy.context.evaluated_depsgraph_get(), scene, SIZE, WINDOW)


def mesh_of(result, name):
    (instance,) = [i for i in result.scene.instances if i.name == name]
    return result.scene.meshes[instance.mesh], instance


def reads_strand(b_material, output):
    """Have a material show what node Curves Info gives."""
    if b_material.node_tree is None:
        b_material.use_nodes = True
    b_tree = b_material.node_tree
    b_node = b_tree.nodes.new("ShaderNodeHairInfo")
    b_tree.links.new(b_node.outputs[output], b_tree.nodes["Principled BSDF"].inputs["Base Color"])
    return b_material


def test_curves_objects_arrive_with_radius_and_strand_data(scene):
    b_curves = bpy.data.hair_curves.new("Strands")
    b_curves.add_curves([2, 3])
    places = np.array([(0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 1), (1, 0, 2)], np.float32)
    b_curves.attributes["position"].data.foreach_set("vector", places.ravel())
    b_radius = b_curves.attributes.get("radius") or b_curves.attributes.new("radius", "FLOAT", "POINT")
    b_radius.data.foreach_set("value", np.full(5, 0.25, np.float32))
    b_curves.materials.append(reads_strand(bpy.data.materials.new("Hair"), "Length"))
    b_object = bpy.data.objects.new("Strands", b_curves)
    b_object.location.y, b_object.hybrid.ray_traced = 3, True
    scene.collection.objects.link(b_object)
    result = translated(scene)
    mesh, instance = mesh_of(result, "Strands")
    assert instance.ray_traced and instance.matrix_world[1, 3] == 3
    assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(2, abs=1e-5)
    assert np.ptp(mesh.vertices[:, 1]) == pytest.approx(0.5, rel=0.05)
    share, length, thickness, number = mesh.attributes["strand"].T
    assert share.min() == 0 and share.max() == pytest.approx(1)
    assert sorted(set(np.round(length, 3).tolist())) == [1, 2]
    assert thickness == pytest.approx(0.5)
    assert len(set(number.tolist())) == 2
    assert result.warnings == () or all("Strand" in line for line in result.warnings)


def test_curves_have_generated_coordinates_of_where_they_begin_and_their_first_uv_map(scene):
    """As EEVEE draws them; what they have not is named."""
    b_curves = bpy.data.hair_curves.new("Strands")
    b_curves.add_curves([2, 2])
    places = np.array([(0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0.5, 1)], np.float32)
    b_curves.attributes["position"].data.foreach_set("vector", places.ravel())
    b_places = b_curves.attributes.new("surface_uv_coordinate", "FLOAT2", "CURVE")
    b_places.data.foreach_set("vector", np.array([0.25, 0.75, 0.5, 0.5], np.float32))
    b_object = bpy.data.objects.new("Strands", b_curves)
    scene.collection.objects.link(b_object)
    ask(b_object, "ShaderNodeTexCoord", "Generated")
    found = mesh_of(translated(scene), "Strands")[0].attributes["generated"]
    assert {tuple(row) for row in found.tolist()} == {(0.5, 0.5, 0.5), (1.0, 0.5, 0.5)}
    ask(b_object, "ShaderNodeTexCoord", "UV")
    found = mesh_of(translated(scene), "Strands")[0].uv_maps[""]
    assert {tuple(row) for row in found.tolist()} == {(0.25, 0.75), (0.5, 0.5)}
    b_points = b_curves.attributes.new("Map", "FLOAT2", "POINT")
    b_points.data.foreach_set("vector", np.full(8, 0.125, np.float32))
    b_object.update_tag()
    b_curves.update_tag()
    assert set(mesh_of(translated(scene), "Strands")[0].uv_maps[""].ravel().tolist()) == {0.125}
    ask(b_object, "ShaderNodeAttribute", "Color", attribute_name="None")
    assert [line for line in translated(scene).warnings if "has no attribute 'None'" in line]


def hairy(scene, **settings):
    """A plane of 2 m with straight hair along +Z."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_plane_add(size=2)
    b_plane = bpy.context.object
    b_plane.modifiers.new("Hair", "PARTICLE_SYSTEM")
    b_settings = b_plane.particle_systems[0].settings
    b_settings.type, b_settings.count, b_settings.hair_length = "HAIR", 20, 1.0
    b_settings.radius_scale, b_settings.display_step = 0.1, 2
    for name, value in settings.items():
        setattr(b_settings, name, value)
    return b_plane


def of_hair(scene):
    result = translated(scene)
    found = [result.scene.meshes[i.mesh] for i in result.scene.instances]
    return next(mesh for mesh in found if mesh.name != "Plane")


def test_particle_hair_arrives_on_moved_emitters(scene):
    b_plane = hairy(scene, use_close_tip=False, tip_radius=1.0)
    b_plane.location, b_plane.scale = (5, 0, 0), (1, 1, 2)
    mesh = of_hair(scene)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    assert (low[:2] > -1.1).all() and (high[:2] < 1.1).all() and low[2] == pytest.approx(0, abs=1e-4)
    assert high[2] > 0.2
    sides = 12
    assert len(mesh.vertices) == 20 * 5 * sides
    ring = mesh.vertices[:sides, :2]
    assert np.linalg.norm(ring - ring.mean(axis=0), axis=1) == pytest.approx(0.05, rel=0.02)  # half of 1 x 0.1


def test_strands_thin_towards_a_closed_tip(scene):
    hairy(scene)
    first = of_hair(scene).vertices.reshape(20, 5, 12, 3)[0]
    wide = np.linalg.norm(first - first.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    assert wide / wide[0] == pytest.approx([1, 0.75, 0.5, 0.25, 0], abs=0.01)


def test_children_replace_their_parents_and_smoothing_cuts_strands_finer(scene):
    b_plane = hairy(scene, child_type="SIMPLE")
    b_plane.particle_systems[0].settings.rendered_child_count = 3
    children = len(b_plane.evaluated_get(bpy.context.evaluated_depsgraph_get()).particle_systems[0].child_particles)
    assert children > 20
    assert len(of_hair(scene).vertices) == children * 5 * 12
    scene.render.hair_subdiv = 1
    assert len(of_hair(scene).vertices) == children * 9 * 12


def ask(b_object, kind, output, **settings):
    """Have the first material of an object show the output of a node."""
    b_material = bpy.data.materials.new("Asks")
    if b_material.node_tree is None:
        b_material.use_nodes = True
    b_tree = b_material.node_tree
    b_node = b_tree.nodes.new(kind)
    for name, value in settings.items():
        setattr(b_node, name, value)
    b_tree.links.new(b_node.outputs[output], b_tree.nodes["Principled BSDF"].inputs["Base Color"])
    b_object.data.materials.clear()
    b_object.data.materials.append(b_material)


@pytest.mark.parametrize("child_type", ["NONE", "INTERPOLATED"])
def test_hair_has_colours_and_generated_coordinates_of_where_it_begins(scene, child_type):
    """A plane whose red grows along x; EEVEE has colours of corners in bytes alone, without gamma, for hair."""
    b_plane = hairy(scene, child_type=child_type)
    b_mesh = b_plane.data
    b_color = b_mesh.color_attributes.new("Tint", "BYTE_COLOR", "CORNER")
    for b_loop, b_item in zip(b_mesh.loops, b_color.data, strict=True):
        b_item.color = (float(b_mesh.vertices[b_loop.vertex_index].co.x > 0), 0.2, 0.5, 1)
    b_mesh.attributes.new("Weight", "FLOAT", "POINT")
    ask(b_plane, "ShaderNodeAttribute", "Color", attribute_name="Tint")
    mesh = of_hair(scene)
    color = mesh.attributes["color:Tint"]
    assert color[:, 1:] == pytest.approx(np.full((len(color), 3), (0.2, 0.5, 1)), abs=0.01)
    x = mesh.vertices[mesh.triangles.reshape(-1), 0]
    red = color[mesh.corners.reshape(-1), 0]
    assert np.corrcoef(x, red)[0, 1] > 0.9
    assert not [line for line in translated(scene).warnings if "Tint" in line]
    ask(b_plane, "ShaderNodeTexCoord", "Generated")
    mesh = of_hair(scene)
    assert mesh.attributes["generated"][:, 2] == pytest.approx(0.5)  # of roots, which are all on the plane
    assert np.abs(mesh.attributes["generated"][mesh.corners.reshape(-1), 0] - (x + 1) / 2).max() < 0.1
    ask(b_plane, "ShaderNodeAttribute", "Fac", attribute_name="Weight")
    assert not of_hair(scene).attributes.get("color:Weight", np.zeros(1)).any()
    assert [line for line in translated(scene).warnings if "hair has no attribute 'Weight'" in line]


def test_hair_that_would_be_displaced_is_named(scene):
    b_plane = hairy(scene)
    ask(b_plane, "ShaderNodeTexCoord", "Generated")
    b_material, b_tree = b_plane.active_material, b_plane.active_material.node_tree
    b_node = b_tree.nodes.new("ShaderNodeDisplacement")
    b_tree.links.new(b_node.outputs[0], b_tree.nodes["Material Output"].inputs["Displacement"])
    b_node.inputs["Height"].default_value = 1.0

    def named():
        return [line for line in translated(scene).warnings if "not displaced" in line]

    assert not named()  # Bump Only
    b_material.displacement_method = "DISPLACEMENT"
    assert len(named()) == 1


def test_hair_without_a_strand_drawn_is_left_out(scene):
    b_plane = hairy(scene, render_type="NONE")
    assert translated(scene).counts["meshes"] == 1
    b_plane.particle_systems[0].settings.render_type = "PATH"
    assert translated(scene).counts["meshes"] == 2
    b_plane.modifiers[0].show_viewport = False
    assert translated(scene).counts["meshes"] == 1


def test_hair_that_the_view_layer_does_not_show_is_left_out(scene):
    """EEVEE draws none; its volumes filter, which it asks for Volume objects alone, changes nothing."""
    hairy(scene)
    scene.view_layers[0].use_volumes = False
    assert translated(scene).counts["meshes"] == 2
    scene.view_layers[0].use_strand = False
    assert translated(scene).counts["meshes"] == 1


def test_points_of_geometry_nodes_are_balls(scene):
    b_group = bpy.data.node_groups.new("Points", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        b_group.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    b_in, b_out = b_group.nodes.new("NodeGroupInput"), b_group.nodes.new("NodeGroupOutput")
    b_points = b_group.nodes.new("GeometryNodeMeshToPoints")
    b_points.inputs["Radius"].default_value = 0.3
    b_group.links.new(b_in.outputs[0], b_points.inputs[0])
    b_group.links.new(b_points.outputs[0], b_out.inputs[0])
    b_cube = bpy.data.objects["Cube"]
    b_cube.modifiers.new("Points", "NODES").node_group = b_group
    b_cube.hybrid.ray_traced = True
    mesh, instance = mesh_of(translated(scene), "Cube")
    assert instance.ray_traced
    balls_of = mesh.vertices.reshape(8, -1, 3)
    assert np.abs(balls_of.mean(axis=1)) == pytest.approx(np.ones((8, 3)), abs=1e-5)
    reach = np.linalg.norm(balls_of - balls_of.mean(axis=1, keepdims=True), axis=2)
    assert reach == pytest.approx(0.3, rel=0.01)


def test_hair_of_instances_stands_where_each_instance_stands(scene):
    b_plane = hairy(scene)
    b_collection = bpy.data.collections.new("Instanced")
    b_collection.objects.link(b_plane)
    for b_user in list(b_plane.users_collection):
        if b_user != b_collection:
            b_user.objects.unlink(b_plane)
    for x in (5, 9):
        b_empty = bpy.data.objects.new("Instancer", None)
        b_empty.instance_type, b_empty.instance_collection, b_empty.location.x = "COLLECTION", b_collection, x
        b_empty.scale.z = 0 if x == 9 else 1  # flattened: no place in the object leads to one in the world
        scene.collection.objects.link(b_empty)
    result = translated(scene)
    strands = [i for i in result.scene.instances if result.scene.meshes[i.mesh].name != "Plane"]
    assert sorted(i.matrix_world[0, 3] for i in strands) == [5, 9]
    for instance in strands:
        vertices = result.scene.meshes[instance.mesh].vertices
        assert np.isfinite(vertices).all() and np.abs(vertices[:, :2]).max() < 1.2


def test_instances_of_geometry_nodes_have_each_their_own_geometry(scene):
    """Of two points one shows a point cloud and the other a mesh. (Their curves neither EEVEE nor Cycles draws.)"""
    b_group = bpy.data.node_groups.new("Pick", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        b_group.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    new, link = b_group.nodes.new, b_group.links.new
    b_out, b_line, b_place = new("NodeGroupOutput"), new("GeometryNodeMeshLine"), new("GeometryNodeInstanceOnPoints")
    b_line.inputs["Count"].default_value = 2
    b_line.inputs["Offset"].default_value = (3, 0, 0)
    b_points, b_cube = new("GeometryNodePoints"), new("GeometryNodeMeshCube")
    b_both = new("GeometryNodeGeometryToInstance")
    link(b_cube.outputs[0], b_both.inputs[0])
    link(b_points.outputs[0], b_both.inputs[0])
    link(b_line.outputs[0], b_place.inputs["Points"])
    link(b_both.outputs[0], b_place.inputs["Instance"])
    b_place.inputs["Pick Instance"].default_value = True
    link(b_place.outputs[0], b_out.inputs[0])
    bpy.data.objects["Cube"].modifiers.new("Pick", "NODES").node_group = b_group
    result = translated(scene)
    found = {len(result.scene.meshes[i.mesh].triangles): i.matrix_world[0, 3] for i in result.scene.instances}
    assert len(found) == 2 and 12 in found
    assert sorted(found.values()) == [0, 3]
