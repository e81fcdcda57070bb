# SPDX-License-Identifier: GPL-3.0-or-later
"""Traced Shadows, Automatic: told from the file, as the translator finds it in what a render evaluates."""

from __future__ import annotations

import subprocess

import bpy
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import scan
from hybrid_addon.blender.pipeline import scene_setup, transmission
from hybrid_addon.blender.render.settings import tracer_settings
from hybrid_addon.scene import Expression

pytestmark = pytest.mark.blender


def socket(name, value):
    def change(material):
        material.node_tree.nodes["Principled BSDF"].inputs[name].default_value = value

    return change


def shader(kind, **values):
    def change(material):
        tree = material.node_tree
        node = tree.nodes.new(kind)
        for name, value in values.items():
            node.inputs[name].default_value = value
        tree.links.new(tree.nodes["Material Output"].inputs["Surface"], node.outputs[0])

    return change


def linked(name):
    """A texture that may be anything: its pixels are not looked at."""

    def change(material):
        tree = material.node_tree
        node = tree.nodes.new("ShaderNodeTexNoise")
        tree.links.new(tree.nodes["Principled BSDF"].inputs[name], node.outputs[0])

    return change


def unused(material):
    material.node_tree.nodes.new("ShaderNodeBsdfGlass")


def grouped(material):
    """Glass within a node group."""
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketShader")
    inside, end = group.nodes.new("ShaderNodeBsdfGlass"), group.nodes.new("NodeGroupOutput")
    group.links.new(end.inputs[0], inside.outputs[0])
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.links.new(tree.nodes["Material Output"].inputs["Surface"], node.outputs[0])


def custom(**values):
    def change(material):
        for name, value in values.items():
            setattr(material.hybrid, name, value)

    return change


MATERIALS = {
    "plain": (lambda material: None, False),
    "transmission": (socket("Transmission Weight", 0.2), True),
    "alpha": (socket("Alpha", 0.9), True),
    "metal, though transmissive": (lambda m: [socket(n, 1.0)(m) for n in ("Transmission Weight", "Metallic")], False),
    "roughness linked": (linked("Roughness"), False),
    "alpha linked": (linked("Alpha"), True),
    "transmission linked": (linked("Transmission Weight"), True),
    "glass": (shader("ShaderNodeBsdfGlass"), True),
    "refraction": (shader("ShaderNodeBsdfRefraction"), True),
    "transparent": (shader("ShaderNodeBsdfTransparent"), True),
    "diffuse": (shader("ShaderNodeBsdfDiffuse"), False),
    "glass that is not linked": (unused, False),
    "glass in a group": (grouped, True),
    "custom, clear": (custom(opacity=0.5), True),
    "custom, a mirror": (custom(opacity=0.0, reflectivity=1.0), False),
}


def found_by_translator(scene):
    """Whether any surface that a ray traced instance wears lets light through."""
    ours = scan.translated(scene).scene
    assigned = [ours.surfaces[s] for i in ours.instances if i.ray_traced for s in i.surfaces]
    return any(all(isinstance(v, Expression) or v < 1 for v in (s.opacity, s.reflectivity)) for s in assigned)


def agrees(scene, expected):
    return [scene_setup.traces_shadows(scene), found_by_translator(scene)] == [expected] * 2


@pytest.fixture
def cube(scene):
    scene.render.resolution_x = scene.render.resolution_y = 8
    hybrid.mark(bpy.data.objects["Cube"])
    return bpy.data.objects["Cube"]


@pytest.mark.parametrize("name", MATERIALS)
def test_a_material(scene, cube, name):
    change, expected = MATERIALS[name]
    change(cube.active_material)
    assert agrees(scene, expected)
    assert tracer_settings(scene).raster_shadows == expected
    hybrid.unmark(cube)
    assert not scene_setup.traces_shadows(scene)


def test_no_sky_is_drawn_to_tell(scene, cube, monkeypatch):
    """Another Blender would draw it, for seconds; panels ask at every redraw."""
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("another Blender"))
    tree = cube.active_material.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    tree.links.new(tree.nodes["Principled BSDF"].inputs["Alpha"], sky.outputs[0])
    assert isinstance(transmission.surface_of(cube.active_material, scene).opacity, Expression)
    assert scene_setup.traces_shadows(scene)


def test_an_objects_own_values_win(scene, cube):
    cube.hybrid.opacity = 0.5
    assert agrees(scene, True)
    cube.hybrid.opacity = 1.0
    shader("ShaderNodeBsdfGlass")(cube.active_material)
    assert agrees(scene, False)


def test_the_choice_wins_and_caustics_want_them(scene, cube):
    shader("ShaderNodeBsdfGlass")(cube.active_material)
    scene.hybrid.traced_shadows = "OFF"
    assert not scene_setup.traces_shadows(scene)
    scene.hybrid.traced_shadows = "AUTO"
    scene.hybrid.mode = "FULL"
    assert not scene_setup.traces_shadows(scene)  # there is nothing that EEVEE draws
    scene.hybrid.mode = "HYBRID"
    cube.active_material = None
    assert not scene_setup.traces_shadows(scene)
    scene.hybrid.traced_shadows = "ON"
    assert scene_setup.traces_shadows(scene)
    scene.hybrid.traced_shadows = "AUTO"
    scene.hybrid.caustics = "PHOTONS"
    assert scene_setup.traces_shadows(scene)


def hidden_glass():
    """An object with glass that no scene holds."""
    mesh = bpy.data.meshes.new_from_object(bpy.data.objects["Cube"])
    glass = bpy.data.objects.new("Glass", mesh)
    mesh.materials.clear()
    mesh.materials.append(bpy.data.materials.new("Glass"))
    if not mesh.materials[0].node_tree:
        mesh.materials[0].use_nodes = True
    shader("ShaderNodeBsdfGlass")(mesh.materials[0])
    return glass


def by_collection(scene, cube, glass):
    shown, empty = bpy.data.collections.new("Shown"), bpy.data.objects.new("Empty", None)
    below = bpy.data.collections.new("Below")
    shown.children.link(below)
    below.objects.link(glass)
    empty.instance_type, empty.instance_collection = "COLLECTION", shown
    scene.collection.objects.link(empty)
    shown.hybrid.ray_traced = True
    hybrid.unmark(cube)


def by_particles(scene, cube, glass):
    scene.collection.objects.link(glass)
    cube.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = cube.particle_systems[0].settings
    settings.type, settings.render_type, settings.instance_object, settings.count = "HAIR", "OBJECT", glass, 3


def by_faces(scene, cube, glass):
    scene.collection.objects.link(glass)
    glass.parent, cube.instance_type = cube, "FACES"


def node_group(kind, name, value):
    group = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    group.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, node, end = (group.nodes.new(k) for k in ("NodeGroupInput", kind, "NodeGroupOutput"))
    node.inputs[name].default_value = value
    if node.inputs[0].type == "GEOMETRY":
        group.links.new(node.inputs[0], start.outputs[0])
    group.links.new(end.inputs[0], next(s for s in node.outputs if s.type == "GEOMETRY"))
    return group


def by_material_node(scene, cube, glass):
    group = node_group("GeometryNodeSetMaterial", "Material", glass.data.materials[0])
    cube.modifiers.new("Nodes", "NODES").node_group = group


def by_object_node(scene, cube, glass):
    scene.collection.objects.link(glass)
    cube.modifiers.new("Nodes", "NODES").node_group = node_group("GeometryNodeObjectInfo", "Object", glass)


def by_nodes_input(scene, cube, glass):
    group = node_group("GeometryNodeSetMaterial", "Material", None)
    group.interface.new_socket("Material", in_out="INPUT", socket_type="NodeSocketMaterial")
    start = next(n for n in group.nodes if n.bl_idname == "NodeGroupInput")
    setter = next(n for n in group.nodes if n.bl_idname == "GeometryNodeSetMaterial")
    group.links.new(setter.inputs["Material"], start.outputs["Material"])
    modifier = cube.modifiers.new("Nodes", "NODES")
    modifier.node_group = group
    name = group.interface.items_tree["Material"].identifier
    if hasattr(modifier, "properties"):  # Blender 5.2
        getattr(modifier.properties.inputs, name).value = glass.data.materials[0]
    else:
        modifier[name] = glass.data.materials[0]


@pytest.mark.parametrize(
    "show", [by_collection, by_particles, by_faces, by_material_node, by_object_node, by_nodes_input]
)
def test_what_an_object_shows_counts(scene, cube, show):
    assert not scene_setup.traces_shadows(scene)
    show(scene, cube, hidden_glass())
    assert agrees(scene, True)


def test_a_flagged_collection(scene, cube):
    hybrid.unmark(cube)
    shader("ShaderNodeBsdfGlass")(cube.active_material)
    assert not scene_setup.traces_shadows(scene)
    cube.users_collection[0].hybrid.ray_traced = True
    assert agrees(scene, True)


@pytest.mark.parametrize("how", ["socket", "custom"])
def test_what_is_keyframed_may_be_anything_in_every_frame(scene, cube, how):
    """Opaque now, clear later: decided once for all frames, or shadows would jump."""
    tree = cube.active_material.node_tree
    owner, path = (tree.nodes["Principled BSDF"].inputs["Alpha"], "default_value") if how == "socket" else (
        cube.hybrid, "opacity")  # fmt: skip
    for frame, value in ((1, 1.0), (10, 0.2)):
        setattr(owner, path, value)
        owner.keyframe_insert(path, frame=frame)
    for frame, clear in ((1, False), (10, True)):
        scene.frame_set(frame)
        assert found_by_translator(scene) == clear
        assert scene_setup.traces_shadows(scene)


def test_what_is_not_rendered_does_not_count(scene, cube):
    shader("ShaderNodeBsdfGlass")(cube.active_material)
    cube.hide_render = True
    assert agrees(scene, False)
