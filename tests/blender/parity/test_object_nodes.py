# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that know the object, the camera or a spectrum, against EEVEE's own pictures: a board of glowing tiles."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

from tests.blender.parity.test_materials import both, empty, material

pytestmark = pytest.mark.blender
SIDE = 6  # tiles on each side of the board
PIXELS = 12  # of a tile


def node(tree, kind, **settings):
    b_node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in settings.items():
        setattr(b_node, name, value)
    return b_node


def output(kind, name, **settings):
    """Of a node without inputs."""
    return lambda tree, uv: node(tree, kind, **settings).outputs[name]


def together(*builds):
    """Three numbers as one colour: each material more costs EEVEE of 4.5 some seconds."""

    def built(tree, uv):
        b_join = node(tree, "CombineXYZ")
        for build, b_input in zip(builds, b_join.inputs, strict=True):
            tree.links.new(build(tree, uv), b_input)
        return b_join.outputs[0]

    return built


def signed(build):
    """What may be less than 0, as a colour."""

    def built(tree, uv):
        b_scale = node(tree, "VectorMath", operation="MULTIPLY_ADD")
        b_scale.inputs[1].default_value, b_scale.inputs[2].default_value = (0.2,) * 3, (0.5,) * 3
        tree.links.new(build(tree, uv), b_scale.inputs[0])
        return b_scale.outputs[0]

    return built


def scaled(build, low, high):
    """(0, 1) along the tile becomes (low, high)."""

    def built(tree, uv):
        b_range, b_node = node(tree, "MapRange"), build(tree, uv)
        b_range.inputs["To Min"].default_value, b_range.inputs["To Max"].default_value = low, high
        b_parts = node(tree, "SeparateXYZ")
        tree.links.new(uv, b_parts.inputs[0])
        tree.links.new(b_parts.outputs[0], b_range.inputs[0])
        tree.links.new(b_range.outputs[0], b_node.inputs[0])
        return b_node.outputs[0]

    return built


def fed(kind, into, out, values=None, **settings):
    """A node that the tile's own coordinates are linked to."""

    def built(tree, uv):
        b_node = node(tree, kind, **settings)
        for name, value in (values or {}).items():
            b_node.inputs[name].default_value = value
        tree.links.new(uv, b_node.inputs[into])
        return b_node.outputs[out]

    return built


def turned_normal(tree, uv):
    b_node = fed("Normal", "Normal", "Dot")(tree, uv)
    b_node.node.outputs["Normal"].default_value = (0.6, 0.0, 0.8)
    return b_node


def curved(tree, uv):
    b_out = fed("VectorCurve", "Vector", "Vector")(tree, uv)
    b_out.node.mapping.curves[0].points.new(0.4, 0.9)
    b_out.node.mapping.curves[1].points.new(0.2, -0.3)
    b_out.node.mapping.update()
    return b_out


def mapped(space):
    return signed(fed("NormalMap", "Color", "Normal", {"Strength": 0.8}, space=space))


def moved(kind, start, end):
    return signed(fed("VectorTransform", 0, 0, vector_type=kind, convert_from=start, convert_to=end))


TILES = {
    "location": signed(output("ObjectInfo", "Location")),
    "color": output("ObjectInfo", "Color"),
    "numbers": together(*(output("ObjectInfo", name) for name in ("Alpha", "Object Index", "Material Index"))),
    "more numbers": together(
        output("ObjectInfo", "Random"),
        output("Attribute", "Alpha", attribute_type="OBJECT", attribute_name="tint"),
        output("Attribute", "Color", attribute_type="OBJECT", attribute_name="nothing"),
    ),
    "of the object": output("Attribute", "Color", attribute_type="OBJECT", attribute_name="tint"),
    "of its mesh": output("Attribute", "Vector", attribute_type="OBJECT", attribute_name="of mesh"),
    "by its path": output("Attribute", "Color", attribute_type="OBJECT", attribute_name="rotation_euler"),
    "of the instancer": output("Attribute", "Color", attribute_type="INSTANCER", attribute_name="tint"),
    "of the view layer": output("Attribute", "Color", attribute_type="VIEW_LAYER", attribute_name="mood"),
    "of edges": output("Attribute", "Color", attribute_name="on edges"),
    "view vector": signed(output("CameraData", "View Vector")),
    "depths": signed(
        together(*(output("CameraData", name) for name in ("View Z Depth", "View Distance", "View Distance")))
    ),
    "tangent": signed(output("NewGeometry", "Tangent")),
    "parametric": output("NewGeometry", "Parametric"),
    "constants": together(
        output("NewGeometry", "Pointiness"),
        output("NewGeometry", "Random Per Island"),
        output("NewGeometry", "Backfacing"),
    ),
    "radial x": signed(output("Tangent", 0, direction_type="RADIAL", axis="X")),
    "uv tangent": signed(output("Tangent", 0, direction_type="UV_MAP", uv_map="UVMap")),
    "to object": moved("POINT", "WORLD", "OBJECT"),
    "to world": moved("VECTOR", "OBJECT", "WORLD"),
    "to camera": moved("POINT", "OBJECT", "CAMERA"),
    "from camera": moved("VECTOR", "CAMERA", "WORLD"),
    "normal to world": moved("NORMAL", "OBJECT", "WORLD"),
    "blackbody": scaled(lambda tree, uv: node(tree, "Blackbody"), 1000.0, 9000.0),
    "hot": scaled(lambda tree, uv: node(tree, "Blackbody"), 9000.0, 14000.0),
    "wavelength": scaled(lambda tree, uv: node(tree, "Wavelength"), 390.0, 700.0),
    "normal": turned_normal,
    "curves": signed(curved),
    **{f"map {space}": mapped(space) for space in ("OBJECT", "WORLD", "BLENDER_OBJECT", "BLENDER_WORLD")},
    "bevel": signed(output("Bevel", 0)),
    "falloff": fed("LightFalloff", "Strength", "Linear"),
    "fresnel": fed("Fresnel", "Normal", 0),
    "facing": fed("LayerWeight", "Normal", "Facing", {"Blend": 0.3}),
    "layer fresnel": fed("LayerWeight", "Normal", "Fresnel", {"Blend": 0.6}),
}


def tile(number, build):
    """A tile that glows with what the nodes make of it: an object of its own, turned, scaled and with data."""
    b_mesh = bpy.data.meshes.new("Tile")
    b_mesh.from_pydata([(0, 0, 0), (0.5, 0.1, 0), (0.5, 0.1, 1), (0, 0, 1)], [], [(0, 1, 2, 3)])
    b_mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))
    b_edges = b_mesh.attributes.new("on edges", "FLOAT", "EDGE")
    b_edges.data.foreach_set("value", np.array([0.1, 0.9, 0.4, 0.2], np.float32))
    b_mesh["of mesh"] = [0.3, 0.7]
    b_material, tree, b_output = material(f"Tile {number}")
    b_material.pass_index = 1
    b_uv, b_glow = node(tree, "UVMap"), node(tree, "Emission")
    tree.links.new(build(tree, b_uv.outputs[0]), b_glow.inputs["Color"])
    tree.links.new(b_glow.outputs[0], b_output.inputs["Surface"])
    b_mesh.materials.append(b_material)
    b_object = bpy.data.objects.new(f"Tile {number}é", b_mesh)
    b_object.location = (number % SIDE - SIDE / 2, 0, number // SIDE - SIDE / 2)
    b_object.scale, b_object.rotation_euler[0] = (2, 3, 1), 0.3
    b_object.color, b_object.pass_index = (0.2, 0.6, 0.9, 0.7), 1
    b_object["tint"] = [0.8, 0.3, 0.5, 0.4]
    bpy.context.scene.collection.objects.link(b_object)


def test_nodes_of_objects_give_what_eevee_gives(addon):
    b_scene = empty(SIDE * PIXELS, 1)
    b_scene.camera.data.type, b_scene.camera.data.angle = "PERSP", 2 * math.atan(SIDE / 20)
    b_scene["mood"] = 0.35
    for number, build in enumerate(TILES.values()):
        tile(number, build)
    raster, traced, warnings = both(b_scene)
    assert warnings == []
    wrong = {}
    for number, name in enumerate(TILES):
        i, j = number % SIDE * PIXELS, number // SIDE * PIXELS
        inside = np.s_[j + 3 : j + PIXELS - 3, i + 2 : i + PIXELS - 2]
        difference = np.percentile(np.abs(raster[inside] - traced[inside]), 90)
        if not difference < 0.03:
            wrong[name] = float(difference), raster[inside].mean(axis=(0, 1)), traced[inside].mean(axis=(0, 1))
    assert wrong == {}


# ------------------------------------------------------------------------------------------------ instances


def shows(name, kind, out, **settings):
    b_material, tree, b_output = material(name)
    b_glow = node(tree, "Emission")
    tree.links.new(node(tree, kind, **settings).outputs[out], b_glow.inputs["Color"])
    tree.links.new(b_glow.outputs[0], b_output.inputs["Surface"])
    return b_material


def square(name, b_material):
    b_mesh = bpy.data.meshes.new(name)
    b_mesh.from_pydata([(-0.4, 0, -0.4), (0.4, 0, -0.4), (0.4, 0, 0.4), (-0.4, 0, 0.4)], [], [(0, 1, 2, 3)])
    b_mesh.materials.append(b_material)
    return bpy.data.objects.new(name, b_mesh)


def scattered(name, b_square, z, as_instance=True):
    """Instances by Geometry Nodes on a line of three points, each with its own `tint`; of the object or its mesh."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    b_line, b_info, b_on, b_store, b_index, b_scale, b_out = (
        tree.nodes.new(kind)
        for kind in (
            "GeometryNodeMeshLine", "GeometryNodeObjectInfo", "GeometryNodeInstanceOnPoints",
            "GeometryNodeStoreNamedAttribute", "GeometryNodeInputIndex", "ShaderNodeMath", "NodeGroupOutput",
        )
    )  # fmt: skip
    b_line.inputs["Count"].default_value = 3
    b_line.inputs["Start Location"].default_value = (-1, 0, z)
    b_line.inputs["Offset"].default_value = (1, 0, 0)
    b_info.inputs["Object"].default_value = b_square
    b_info.inputs["As Instance"].default_value = as_instance
    b_store.domain, b_store.data_type = "INSTANCE", "FLOAT"
    b_store.inputs["Name"].default_value = "tint"
    b_scale.operation, b_scale.inputs[1].default_value, b_scale.inputs[2].default_value = "MULTIPLY_ADD", 0.3, 0.2
    value = next(s for s in b_store.inputs if s.name == "Value" and s.enabled)
    for start, end in (
        (b_line.outputs[0], b_on.inputs["Points"]), (b_info.outputs["Geometry"], b_on.inputs["Instance"]),
        (b_on.outputs[0], b_store.inputs["Geometry"]), (b_index.outputs[0], b_scale.inputs[0]),
        (b_scale.outputs[0], value), (b_store.outputs[0], b_out.inputs[0]),
    ):  # fmt: skip
        tree.links.new(start, end)
    b_object = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    b_object.modifiers.new("Nodes", "NODES").node_group = tree
    bpy.context.scene.collection.objects.link(b_object)
    return b_object


def test_instances_have_their_own_values(addon):
    """Of a collection and of Geometry Nodes: what the instancer gives, and a number by chance."""
    b_scene = empty(60, 1)
    tinted = shows("Tinted", "Attribute", "Color", attribute_type="INSTANCER", attribute_name="tint")
    chance = shows("Chance", "ObjectInfo", "Random")
    b_collection = bpy.data.collections.new("Kept")
    for row, b_material in enumerate((tinted, chance)):
        b_square = square(b_material.name, b_material)
        b_collection.objects.link(b_square)
        scattered(f"Scattered {row}", b_square, 1.0 - row)
        scattered(f"Spread {row}", b_square, 2.0 - 4 * row, as_instance=False)
        b_square.location = (0, 0, -row)
    for column in range(2):
        b_empty = bpy.data.objects.new(f"Empty {column}", None)
        b_empty.instance_type, b_empty.instance_collection = "COLLECTION", b_collection
        b_empty.location, b_empty["tint"] = (column, 0, -1), [0.9, 0.4 * column, 0.1]
        b_scene.collection.objects.link(b_empty)
        addon.mark(b_empty)
    raster, traced, warnings = both(b_scene)
    assert warnings == []
    off = np.abs(raster - traced)[6:54, 6:54].max(axis=2)
    assert raster.max() > 0.5 and len(np.unique(raster[30, :, 0])) > 3
    assert np.percentile(off, 90) < 0.01, off[5::12, 5::12]
