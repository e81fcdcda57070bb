# SPDX-License-Identifier: GPL-3.0-or-later
"""Coloured media through Blender: volume nodes, glTF as Blender imports it, and Cycles' picture of the same file."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from types import SimpleNamespace

import addon_utils
import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.render import images
from hybrid_addon.blender.scan import translated

pytestmark = pytest.mark.blender


def material(name="Medium", surface="BsdfGlass"):
    """Glass, or nothing, with an output to link a volume to."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    if surface:
        node = tree.nodes.new(f"ShaderNode{surface}")
        node.inputs["Roughness"].default_value = 0.0
        node.inputs["Color"].default_value = (1, 1, 1, 1)
        node.inputs["IOR"].default_value = 1.5
        tree.links.new(output.inputs["Surface"], node.outputs[0])
    return SimpleNamespace(b=made, tree=tree, volume=output.inputs["Volume"])


def node(made, kind, **inputs):
    b_node = made.tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        b_node.inputs[name.replace("_", " ")].default_value = value
    return b_node


@pytest.fixture
def absorption(scene):
    """What a volume node on the factory cube comes to, and what is said about it."""

    def of(kind, surface="BsdfGlass", **inputs):
        made = material(surface=surface)
        made.tree.links.new(made.volume, node(made, kind, **inputs).outputs[0])
        bpy.data.objects["Cube"].data.materials[0] = made.b
        translation = translated(scene)
        (surface,) = translation.scene.surfaces
        return surface, "\n".join(translation.warnings)

    return of


def test_volume_absorption(absorption):
    surface, told = absorption("VolumeAbsorption", Color=(0.9, 0.5, 0.1, 1), Density=2.0)
    assert surface.absorption == pytest.approx((0.2, 1.0, 1.8)) and surface.ior == pytest.approx(1.5)
    assert "olume" not in told


def test_principled_volume_absorbs_what_it_neither_scatters_nor_lets_pass(absorption):
    values = {"Density": 2.0, "Absorption_Color": (0.25, 0, 1, 1)}
    surface, told = absorption("VolumePrincipled", Color=(0, 0, 0, 1), **values)
    assert surface.absorption == pytest.approx((1.0, 2.0, 0.0)) and "olume" not in told
    surface, told = absorption("VolumePrincipled", Color=(0.5, 0.5, 0.5, 1), **values)
    assert surface.absorption == pytest.approx((0.5, 1.0, 0.0)) and "behind a surface scattering is not traced" in told


def test_what_is_not_traced_is_named(absorption):
    assert "behind a surface scattering is not traced" in absorption("VolumeScatter")[1]
    surface, told = absorption("VolumeCoefficients", Absorption_Coefficients=(1, 2, 3), Scatter_Coefficients=(0, 0, 0))
    assert surface.absorption == (1, 2, 3) and "olume" not in told
    assert "behind a surface emission is not traced" in absorption("Emission")[1]
    assert "is not traced" in absorption("BsdfDiffuse", Color=(1, 0, 0, 1))[1]


def test_mixed_and_added(scene):
    made = material()
    first = node(made, "VolumeAbsorption", Color=(0, 0, 0, 1), Density=1.0)
    second = node(made, "VolumeAbsorption", Color=(0, 1, 0, 1), Density=4.0)
    both = node(made, "AddShader")
    for i, part in enumerate((first, second)):
        made.tree.links.new(both.inputs[i], part.outputs[0])
    made.tree.links.new(made.volume, both.outputs[0])
    bpy.data.objects["Cube"].data.materials[0] = made.b
    assert translated(scene).scene.surfaces[0].absorption == pytest.approx((5, 1, 5))


# ------------------------------------------------------------------------------------------------ glTF


def gltf(path):
    """A box of 2 m of IOR 1.7 whose attenuation takes 0.5 m to (0.9, 0.5, 0.1)."""
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = "013 032 467 475 045 051 237 276 026 064 157 173"
    data = b"".join(struct.pack("<3f", *p) for p in corners) + b"".join(
        struct.pack("<3H", *map(int, face)) for face in faces.split()
    )
    extensions = {
        "KHR_materials_transmission": {"transmissionFactor": 1.0},
        "KHR_materials_ior": {"ior": 1.7},
        "KHR_materials_volume": {
            "thicknessFactor": 1.0, "attenuationDistance": 0.5, "attenuationColor": [0.9, 0.5, 0.1],
        },
    }  # fmt: skip
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "Gem"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{
            "name": "Tinted",
            "pbrMetallicRoughness": {"roughnessFactor": 0.0, "metallicFactor": 0.0},
            "extensions": extensions,
        }],
        "extensionsUsed": list(extensions),
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [-1] * 3, "max": [1] * 3},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
        "buffers": [{
            "byteLength": len(data),
            "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
        }],
    }))  # fmt: skip


def test_gltf_arrives_as_it_is_and_is_advised(scene, tmp_path):
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    addon_utils.enable("io_scene_gltf2")
    gltf(tmp_path / "gem.gltf")
    bpy.ops.import_scene.gltf(filepath=str(tmp_path / "gem.gltf"))
    translation = translated(scene)
    (surface,) = translation.scene.surfaces
    assert (surface.opacity, surface.reflectivity) == (0, 0) and surface.ior == pytest.approx(1.7)
    assert surface.absorption == pytest.approx((0.2, 1.0, 1.8))
    assert not translation.warnings
    (entry,) = hybrid.advise(scene)["objects"]
    assert entry["object"] == "Gem" and entry["suggested"]
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
    scene.world.node_tree.nodes["Background"].inputs[1].default_value = 1.0
    scene.camera.location, scene.camera.rotation_euler, scene.camera.data.angle = (0, 0, 9), (0, 0, 0), 0.002
    scene.render.resolution_x = scene.render.resolution_y = 8
    seen = hybrid.render(scene, mode="full", samples=1, cutoff=0).image[4, 4, :3]
    f, a = (0.7 / 2.7) ** 2, np.exp(-2 * np.array((0.2, 1.0, 1.8)))
    expected = f + (1 - f) ** 2 * a * (1 + f * a) / (1 - f * f * a * a)
    np.testing.assert_allclose(seen, expected, rtol=1e-3)


# ------------------------------------------------------------------------------------------------ Cycles


def ball(name, made, location, radius=1.0):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, segments=64, ring_count=32, location=location)
    bpy.ops.object.shade_smooth()
    bpy.context.object.name = name
    bpy.context.object.data.materials.append(made)


@pytest.mark.render
def test_tinted_balls_are_those_of_cycles(scene, request):
    """Glass and smoke before two glowing walls: no lights, so Cycles is all but free of noise."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.data.objects.remove(bpy.data.objects["Light"])
    for name, surface, x in (("Glass", "BsdfGlass", -1.2), ("Smoke", None, 1.2)):
        made = material(name, surface)
        medium = node(made, "VolumeAbsorption", Color=(0.8, 0.5, 0.1, 1), Density=0.7)
        made.tree.links.new(made.volume, medium.outputs[0])
        ball(name, made.b, (x, 0, 0))
        bpy.context.object.hybrid.ray_traced = True
    for x, color in ((-5, (1, 0.8, 0.6, 1)), (5, (0.5, 0.7, 1, 1))):
        bpy.ops.mesh.primitive_plane_add(size=10, location=(x, 4, 0), rotation=(1.5708, 0, 0))
        wall = material(f"Wall {x}", None)
        glow = node(wall, "Emission", Color=color)
        wall.tree.links.new(wall.tree.nodes["Material Output"].inputs["Surface"], glow.outputs[0])
        bpy.context.object.data.materials.append(wall.b)
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.3, 0.3, 0.3, 1)
    scene.camera.location, scene.camera.rotation_euler = (0, -7, 0), (1.5708, 0, 0)
    scene.render.resolution_x, scene.render.resolution_y = 96, 56
    ours = hybrid.render(scene, mode="full", samples=16, cutoff=0).image[..., :3]
    scene.render.engine = "CYCLES"
    c = scene.cycles
    c.device, c.samples, c.use_adaptive_sampling, c.use_denoising = "CPU", 64, False, False
    c.max_bounces = c.glossy_bounces = c.transmission_bounces = c.transparent_max_bounces = 32
    c.pixel_filter_type, c.filter_width, c.blur_glossy = "BOX", 1.0, 0.0
    bpy.ops.render.render(scene=scene.name)
    theirs = next(v for k, v in images.read_render_result(scene).items() if k.endswith("Combined"))[..., :3]
    pair = np.concatenate([ours, theirs], axis=1)  # pytest --basetemp=DIR keeps it
    images.write_exr(Path(request.config._tmp_path_factory.getbasetemp()) / "tinted.exr", pair)
    for box in (np.s_[20:36, 20:40], np.s_[20:36, 56:76]):  # within the glass, within the smoke
        np.testing.assert_allclose(ours[box].mean((0, 1)), theirs[box].mean((0, 1)), rtol=0.01)
        assert np.median(np.abs(ours[box] - theirs[box])) < 0.01
