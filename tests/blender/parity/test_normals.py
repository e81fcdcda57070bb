# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading normals as EEVEE has them: normal maps and bumps on scaled, mirrored and instanced meshes of any faces."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

import hybrid_addon as hybrid
from tests.blender.kit import empty_scene

pytestmark = [pytest.mark.blender, pytest.mark.render]
CELL = 32  # pixels of an object
TURNED = Euler((0.5, 0.3, 0.8)).to_matrix().to_4x4()
SHEAR = Matrix(((1, 0.5, 0.3, 0), (0, 1, 0.4, 0), (0, 0, 1, 0), (0, 0, 0, 1)))
MAPPED = (0.75, 0.4, 0.85, 1)


def scaled(x, y, z):
    return Matrix.Diagonal((x, y, z, 1))


def empty(columns, rows):
    """A black scene seen from above in cells of 2 x 2 metres."""
    b_scene = empty_scene(CELL * columns, CELL * rows, 2)
    b_scene.hybrid.samples = 2
    b_camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    b_camera.data.type, b_camera.data.ortho_scale, b_camera.location = "ORTHO", 2 * max(columns, rows), (0, 0, 10)
    b_scene.collection.objects.link(b_camera)
    b_scene.camera = b_camera
    return b_scene


def material(name, make):
    """One that glows in the colour n / 2 + 1 / 2 of the vector n at the output that `make` gives."""
    b_material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        b_material.use_nodes = True
    tree = b_material.node_tree
    tree.nodes.clear()
    b_output, b_glow = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeEmission")
    b_half = tree.nodes.new("ShaderNodeVectorMath")
    b_half.operation = "MULTIPLY_ADD"
    b_half.inputs[1].default_value = b_half.inputs[2].default_value = (0.5, 0.5, 0.5)
    tree.links.new(make(tree), b_half.inputs[0])
    tree.links.new(b_half.outputs[0], b_glow.inputs["Color"])
    tree.links.new(b_glow.outputs[0], b_output.inputs["Surface"])
    return b_material


def normal_map(tree, strength=1.0, uv_map="", space="TANGENT", convention="OPENGL"):
    b_node = tree.nodes.new("ShaderNodeNormalMap")
    b_node.inputs["Color"].default_value, b_node.inputs["Strength"].default_value = MAPPED, strength
    b_node.uv_map, b_node.space = uv_map, space
    if convention != "OPENGL":
        b_node.convention = convention
    return b_node.outputs[0]


def bump(tree):
    b_node, b_place = tree.nodes.new("ShaderNodeBump"), tree.nodes.new("ShaderNodeNewGeometry")
    b_split = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(b_place.outputs["Position"], b_split.inputs[0])
    tree.links.new(b_split.outputs[0], b_node.inputs["Height"])
    return b_node.outputs[0]


def ball(smooth=True, flipped=False):
    b_edit = bmesh.new()
    b_edit.loops.layers.uv.new("First")
    bmesh.ops.create_uvsphere(b_edit, u_segments=8, v_segments=6, radius=0.7, calc_uvs=True)
    return finished(b_edit, smooth, flipped)


def outline(points, smooth=False, bulge=0.0):
    """One face around points (x, y), and texture coordinates that turn and stretch; bulge: its middle is higher."""
    b_edit = bmesh.new()
    uv, second = (b_edit.loops.layers.uv.new(name) for name in ("First", "Second"))
    ring = [b_edit.verts.new((x, y, -bulge * (x * x + y * y))) for x, y in points]
    for b_loop in b_edit.faces.new(ring).loops:
        x, y, _ = b_loop.vert.co
        b_loop[uv].uv, b_loop[second].uv = (x + 0.4 * y, 0.7 * y), (y, -2 * x + 0.3 * x * x)
    return finished(b_edit, smooth)


def frame():
    """A square with a hole, of two faces of eight corners each."""
    b_edit = bmesh.new()
    uv = b_edit.loops.layers.uv.new("First")
    for side in (1, -1):
        points = [(0, 0.8), (-0.8, 0.8), (-0.8, -0.8), (0, -0.8), (0, -0.3), (-0.3, -0.3), (-0.3, 0.3), (0, 0.3)]
        ring = [b_edit.verts.new((side * x, side * y, 0)) for x, y in points]
        for b_loop in b_edit.faces.new(ring).loops:
            b_loop[uv].uv = b_loop.vert.co.x - b_loop.vert.co.y, b_loop.vert.co.y
    bmesh.ops.remove_doubles(b_edit, verts=b_edit.verts[:], dist=1e-4)
    return finished(b_edit)


def drum():
    """A smooth shaded cylinder whose caps have twelve corners: its normals are far from those of its faces."""
    b_edit = bmesh.new()
    b_edit.loops.layers.uv.new("First")
    bmesh.ops.create_cone(b_edit, cap_ends=True, segments=12, radius1=0.7, radius2=0.5, depth=0.6, calc_uvs=True)
    return finished(b_edit, smooth=True)


def finished(b_edit, smooth=False, flipped=False):
    b_mesh = bpy.data.meshes.new("Mesh")
    if flipped:
        bmesh.ops.reverse_faces(b_edit, faces=b_edit.faces[:])
    b_edit.to_mesh(b_mesh)
    b_edit.free()
    b_mesh.polygons.foreach_set("use_smooth", [smooth] * len(b_mesh.polygons))
    return b_mesh


def show(b_scene, number, columns, rows, b_mesh, b_material, matrix=TURNED):
    """Put it into a cell, row by row from below."""
    b_mesh.materials.clear()
    b_mesh.materials.append(b_material)
    b_object = bpy.data.objects.new(f"Object {number}", b_mesh)
    b_scene.collection.objects.link(b_object)
    x, y = 2 * (number % columns) - columns + 1, 2 * (number // columns) - rows + 1
    b_object.matrix_world = Matrix.Translation((x, y, 0)) @ matrix
    hybrid.mark(b_object)
    return b_object


def angles(b_scene, columns, rows, least=40):
    """Degrees between traced and EEVEE's vectors, where pixels show no edge: for each cell the largest but for 5 %."""
    hybrid.enable(b_scene)
    result = hybrid.render(mode="full")
    assert result.report["warnings"] == []
    pictures = [image[..., :3] * 2 - 1 for image in (result.image, hybrid.render(mode="raster").image)]
    ours, raster = (p / np.maximum(np.linalg.norm(p, axis=2, keepdims=True), 1e-9) for p in pictures)
    there = (np.abs(pictures[1] + 1).max(axis=2) > 0.02) & (np.abs(pictures[0] + 1).max(axis=2) > 0.02)
    for axis in (0, 1):
        for step in (1, -1):
            there &= np.abs(raster - np.roll(raster, step, axis)).max(axis=2) < 0.15
    angle = np.degrees(np.arccos(np.clip((ours * raster).sum(axis=2), -1, 1)))
    found = []
    for number in range(columns * rows):
        i, j = number % columns * CELL, number // columns * CELL
        cell = np.s_[j : j + CELL, i : i + CELL]
        assert there[cell].sum() > least, number
        found.append(float(np.percentile(angle[cell][there[cell]], 95)))
    return found


def test_mapped_normals_on_scaled_meshes_are_those_of_eevee(addon):
    """Whatever the scale: uneven, sheared, mirrored, flattened; on coarse smooth meshes, flat ones and back faces."""
    columns, rows = 4, 4
    b_scene = empty(columns, rows)
    plain, rising = material("Map", normal_map), material("Bump", bump)
    small = [ball() for _ in range(2)]
    for b_mesh, size in zip(small, (100, 0.01), strict=True):
        b_mesh.transform(scaled(size, size, size))
    green = "DIRECTX" if bpy.app.version >= (5, 0, 0) else "OPENGL"
    world = material("World", lambda tree: normal_map(tree, 0.7, space="WORLD"))
    world_green = material("World, green", lambda tree: normal_map(tree, space="WORLD", convention=green))
    tangent_green = material("Green", lambda tree: normal_map(tree, convention=green))
    cases = [
        (ball(), plain, TURNED),
        (small[0], plain, TURNED @ scaled(0.01, 0.01, 0.01)),
        (small[1], plain, TURNED @ scaled(100, 100, 100)),
        (ball(), plain, TURNED @ scaled(0.5, 1, 1.3) @ TURNED),
        (ball(), plain, TURNED @ scaled(-1.1, 0.8, 1) @ SHEAR),
        (ball(smooth=False), plain, TURNED @ scaled(-1, 1, 1)),
        (ball(flipped=True), plain, TURNED),
        (ball(flipped=True), plain, TURNED @ scaled(-1, 1, 0.6)),
        (ball(), material("Half", lambda tree: normal_map(tree, 0.5)), TURNED),
        (ball(), material("Twice", lambda tree: normal_map(tree, 2.0)), TURNED),
        (ball(), world, TURNED @ scaled(0.5, 1, 1.2)),
        (ball(flipped=True), world_green, TURNED),
        (ball(), rising, TURNED @ scaled(0.5, 1, 1.3)),
        (ball(flipped=True), rising, TURNED @ scaled(-1, 1, 1)),
        (outline([(-0.7, -0.7), (0.7, -0.7), (0.7, 0.7), (-0.7, 0.7)]), plain, TURNED @ scaled(1, 1, 0)),
        (ball(), tangent_green, TURNED),
    ]
    for number, (b_mesh, b_material, matrix) in enumerate(cases):
        show(b_scene, number, columns, rows, b_mesh, b_material, matrix)
    found = angles(b_scene, columns, rows)
    print([round(angle, 2) for angle in found])
    assert max(found) < 1


def output_of(kind, name):
    return lambda tree: tree.nodes.new(kind).outputs[name]


def test_normals_that_nodes_give_are_those_of_eevee(addon):
    """True Normal: of the flat face, on the eye's side. Texture Coordinate's Normal: in the object's own space."""
    columns, rows = 4, 3
    b_scene = empty(columns, rows)
    true = material("True", output_of("ShaderNodeNewGeometry", "True Normal"))
    own = material("Own", output_of("ShaderNodeTexCoord", "Normal"))
    cases = [
        (ball(smooth, flipped), b_material, matrix)
        for b_material in (true, own)
        for smooth, flipped, matrix in [
            (True, False, TURNED),
            (False, False, TURNED @ scaled(0.5, 1, 1.3)),
            (True, False, TURNED @ scaled(-1.1, 0.8, 1) @ SHEAR),
            (True, True, TURNED),
            (False, True, TURNED @ scaled(-1, 1, 0.6)),
            (True, False, TURNED @ scaled(1.2, 1.3, 0.9)),
        ]
    ]
    for number, (b_mesh, b_material, matrix) in enumerate(cases):
        show(b_scene, number, columns, rows, b_mesh, b_material, matrix)
    found = angles(b_scene, columns, rows, least=25)
    print([round(angle, 2) for angle in found])
    assert max(found) < 3  # edges between faces, by two samples a pixel; a wrong space is tens of degrees off


def test_faces_of_many_corners_keep_their_normal_maps(addon):
    """Convex, concave, with a hole, bent, smooth, mirrored, of a second UV map, instanced by nodes."""
    columns, rows = 4, 2
    b_scene = empty(columns, rows)
    first, second = (material(uv_map, lambda tree, u=uv_map: normal_map(tree, uv_map=u)) for uv_map in ("", "Second"))
    corners = np.arange(9) * 2 * np.pi / 9
    round_ = [(0.8 * np.cos(a), 0.8 * np.sin(a)) for a in corners]
    star = [
        (0.85 * r * np.cos(a), 0.85 * r * np.sin(a))
        for r, a in zip([1, 0.5] * 7, np.arange(14) * np.pi / 7, strict=True)
    ]
    bracket = [(-0.8, -0.8), (0.8, -0.8), (0.8, -0.2), (-0.2, -0.2), (-0.2, 0.2), (0.8, 0.2), (0.8, 0.8), (-0.8, 0.8)]
    source = show(b_scene, 7, columns, rows, outline(round_), first)
    hybrid.unmark(source)
    shown = [
        (outline(round_), first, TURNED),
        (outline(star), first, TURNED @ scaled(-1, 1, 1)),
        (outline(bracket), second, TURNED @ scaled(1, 0.7, 1)),
        (frame(), first, TURNED),
        (drum(), first, TURNED),
        (outline(round_, smooth=True, bulge=0.3), first, TURNED),
        (outline(star, smooth=True), second, TURNED),
    ]
    for number, (b_mesh, b_material, matrix) in enumerate(shown):
        show(b_scene, number, columns, rows, b_mesh, b_material, matrix)
    instanced(b_scene, source)
    found = angles(b_scene, columns, rows)
    print([round(angle, 2) for angle in found])
    assert max(found) < 1.5


def instanced(b_scene, b_source):
    """Replace an object by one that geometry nodes show in its place: an instance of its mesh."""
    tree = bpy.data.node_groups.new("Instance", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    b_info, b_output = tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("NodeGroupOutput")
    b_info.inputs["Object"].default_value, b_info.inputs["As Instance"].default_value = b_source, True
    b_info.transform_space = "RELATIVE"
    tree.links.new(b_info.outputs["Geometry"], b_output.inputs[0])
    b_object = bpy.data.objects.new("Instancer", bpy.data.meshes.new("Empty"))
    b_scene.collection.objects.link(b_object)
    b_object.modifiers.new("Nodes", "NODES").node_group = tree
    hybrid.mark(b_object)
    b_source.hide_render = True
