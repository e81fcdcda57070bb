# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials against EEVEE's own pictures: nodes on emitting tiles, and Principled on balls under an environment."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

import hybrid_addon
from tests.blender.kit import empty_scene, new_world

pytestmark = pytest.mark.blender
TILES = 5  # on each side of the board


def empty(size, samples):
    """A scene without objects, square, seen by an orthographic camera from -y."""
    b_scene = empty_scene(size, size, samples)
    b_camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    b_camera.data.type, b_camera.data.ortho_scale = "ORTHO", float(TILES)
    b_camera.location, b_camera.rotation_euler = (0, -10, 0), (math.pi / 2, 0, 0)
    b_scene.collection.objects.link(b_camera)
    b_scene.camera = b_camera
    return b_scene


def material(name):
    """(tree, output node) of a new material."""
    b_material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        b_material.use_nodes = True
    b_material.node_tree.nodes.clear()
    return b_material, b_material.node_tree, b_material.node_tree.nodes.new("ShaderNodeOutputMaterial")


def both(b_scene, samples=None):
    """(EEVEE's picture, the traced one), (h, w, 3), with every mesh ray traced."""
    hybrid_addon.enable(b_scene)
    for b_object in b_scene.objects:
        if b_object.type == "MESH":
            hybrid_addon.mark(b_object)
            b_object.hybrid.surface = "MATERIAL"
    raster = hybrid_addon.render(b_scene, mode="raster")
    traced = hybrid_addon.render(b_scene, mode="hybrid", samples=samples or b_scene.eevee.taa_render_samples)
    return np.array(raster.image)[..., :3], np.array(traced.image)[..., :3], traced.report["warnings"]


# ------------------------------------------------------------------------------------------------ nodes


def mixed(kind):
    def build(tree, point, tint):
        b_mix = tree.nodes.new("ShaderNodeMix")
        b_mix.data_type, b_mix.blend_type = "RGBA", kind
        b_mix.inputs["Factor"].default_value = 0.7
        b_mix.inputs[7].default_value = (0.3, 0.6, 0.2, 1)
        tree.links.new(tint, b_mix.inputs[6])
        return b_mix.outputs[2]

    return build


def computed(kind):
    def build(tree, point, tint):
        b_math = tree.nodes.new("ShaderNodeMath")
        b_math.operation, b_math.inputs[1].default_value = kind, 0.37
        tree.links.new(tint, b_math.inputs[0])
        return b_math.outputs[0]

    return build


def passed(kind, into="Color", **values):
    def build(tree, point, tint):
        b_node = tree.nodes.new(kind)
        for name, value in values.items():
            b_node.inputs[name].default_value = value
        tree.links.new(point if into == "Vector" else tint, b_node.inputs[into])
        return b_node.outputs[0]

    return build


def ramped(tree, point, tint):
    b_ramp = tree.nodes.new("ShaderNodeValToRGB")
    b_ramp.color_ramp.elements.new(0.4).color = (1, 0.2, 0, 1)
    b_ramp.color_ramp.interpolation = "EASE"
    tree.links.new(tint, b_ramp.inputs[0])
    return b_ramp.outputs[0]


def curved(tree, point, tint):
    b_curves = tree.nodes.new("ShaderNodeRGBCurve")
    b_curves.mapping.curves[0].points.new(0.3, 0.7)
    b_curves.mapping.curves[3].points.new(0.5, 0.4)
    b_curves.mapping.update()
    tree.links.new(tint, b_curves.inputs["Color"])
    return b_curves.outputs[0]


def textured(kind, output, **values):
    """Socket values by name, settings of the node in lower case."""

    def build(tree, point, tint):
        b_node = tree.nodes.new(kind)
        for name in (name for name in values if name.islower()):
            setattr(b_node, name, values[name])
        for name in (name for name in values if not name.islower()):
            b_node.inputs[name].default_value = values[name]
        tree.links.new(point, b_node.inputs["Vector"])
        return b_node.outputs[output]

    return build


def speckled(tree, point, tint):
    """White noise of 4 x 4 fields."""
    b_snap, b_noise = tree.nodes.new("ShaderNodeVectorMath"), tree.nodes.new("ShaderNodeTexWhiteNoise")
    b_snap.operation, b_snap.inputs[1].default_value = "SNAP", (0.25, 0.25, 0.25)
    tree.links.new(point, b_snap.inputs[0])
    tree.links.new(b_snap.outputs[0], b_noise.inputs["Vector"])
    return b_noise.outputs["Color"]


NODES = {
    **{kind: mixed(kind) for kind in ("MULTIPLY", "SCREEN", "OVERLAY", "SOFT_LIGHT", "DODGE", "DIFFERENCE")},
    **{f"math {kind}": computed(kind) for kind in ("POWER", "MODULO", "PINGPONG", "GREATER_THAN")},
    "checker": passed("ShaderNodeTexChecker", "Vector", Scale=3.0),
    "gradient": passed("ShaderNodeTexGradient", "Vector"),
    "invert": passed("ShaderNodeInvert"),
    "hue": passed("ShaderNodeHueSaturation", Hue=0.7, Saturation=1.3, Value=0.8),
    "gamma": passed("ShaderNodeGamma", Gamma=2.2),
    "contrast": passed("ShaderNodeBrightContrast", Contrast=0.3),
    "grey": passed("ShaderNodeRGBToBW"),
    "separate": passed("ShaderNodeSeparateColor"),
    "ramp": ramped,
    "curves": curved,
    "noise": textured("ShaderNodeTexNoise", "Color", Scale=1.5, Detail=1.5, Distortion=0.7, noise_dimensions="4D"),
    "voronoi": textured("ShaderNodeTexVoronoi", "Color", Scale=2.0, Smoothness=0.5, feature="SMOOTH_F1"),
    "wave": textured("ShaderNodeTexWave", "Color", Scale=0.3, Distortion=1.0, wave_type="RINGS"),
    "bricks": textured("ShaderNodeTexBrick", "Color", Scale=1.0, Color1=(0.9, 0.2, 0.1, 1), Color2=(0.1, 0.6, 0.3, 1)),
    "white noise": speckled,
}


def tile(number, build):
    """A tile that glows with what the nodes make of its place in 0..1."""
    b_mesh = bpy.data.meshes.new("Tile")
    x, z = number % TILES - TILES / 2, number // TILES - TILES / 2
    b_mesh.from_pydata([(x, 0, z), (x + 1, 0, z), (x + 1, 0, z + 1), (x, 0, z + 1)], [], [(0, 1, 2, 3)])
    b_mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))
    b_material, tree, b_output = material(f"Tile {number}")
    b_uv, b_parts, b_tint, b_glow = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("UVMap", "SeparateXYZ", "CombineXYZ", "Emission")
    )
    tree.links.new(b_uv.outputs[0], b_parts.inputs[0])
    tree.links.new(b_parts.outputs[0], b_tint.inputs[0])
    tree.links.new(b_parts.outputs[1], b_tint.inputs[1])
    b_tint.inputs[2].default_value = 0.4
    tree.links.new(build(tree, b_uv.outputs[0], b_tint.outputs[0]), b_glow.inputs["Color"])
    tree.links.new(b_glow.outputs[0], b_output.inputs["Surface"])
    b_mesh.materials.append(b_material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(f"Tile {number}", b_mesh))


def test_nodes_give_what_eevee_gives(addon):
    b_scene = empty(80, 1)
    for number, build in enumerate(NODES.values()):
        tile(number, build)
    raster, traced, warnings = both(b_scene)
    assert warnings == []
    wrong = {}
    for number, name in enumerate(NODES):
        i, j = number % TILES * 16, number // TILES * 16
        inside = np.s_[j + 2 : j + 14, i + 2 : i + 14]
        difference = np.abs(raster[inside] - traced[inside]).max(axis=2)
        assert raster[inside].max() > 0.05, name
        # EEVEE's one ray is jittered by half a pixel, and edges of checks fall where it falls.
        if np.percentile(difference, 75) > 0.045:
            wrong[name] = float(np.percentile(difference, 75))
    assert wrong == {}


# ------------------------------------------------------------------------------------------------ surfaces


def environment(b_scene):
    """A soft sky with three glows, without a pixel over 5."""
    height, width = 32, 64
    latitude = ((np.arange(height) + 0.5) / height * np.pi - np.pi / 2)[:, None]
    longitude = ((0.5 - (np.arange(width) + 0.5) / width) * 2 * np.pi)[None]
    cos = np.cos(latitude)
    d = np.stack([cos * np.cos(longitude), cos * np.sin(longitude), np.sin(latitude) + 0 * longitude], axis=2)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = np.array([0.5, 0.55, 0.6]) + 0.3 * d[..., 2:] * np.array([0.6, 0.9, 1.0])
    glows = (
        ((-0.5, -0.7, 0.5), (2, 1.6, 1.2), 30),
        ((0.8, -0.4, 0.1), (0.4, 0.8, 1.6), 12),
        ((0, 0.9, 0.3), (0.6, 0.3, 0.2), 6),
    )
    for center, color, sharp in glows:
        toward = np.array(center) / np.linalg.norm(center)
        pixels[..., :3] += np.exp(sharp * (d @ toward - 1))[..., None] * np.array(color)
    b_image = bpy.data.images.new("Sky", width, height, float_buffer=True)
    b_image.pixels.foreach_set(pixels.ravel())
    b_world = new_world()
    tree = b_world.node_tree
    tree.nodes.clear()
    b_output, b_background, b_picture = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("OutputWorld", "Background", "TexEnvironment")
    )
    b_picture.image = b_image
    tree.links.new(b_picture.outputs[0], b_background.inputs["Color"])
    tree.links.new(b_background.outputs[0], b_output.inputs["Surface"])
    b_world.sun_threshold = 0.0
    b_scene.world = b_world


def picture(name, pixels, *, data):
    b_image = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0], float_buffer=True)
    b_image.colorspace_settings.name = "Non-Color" if data else b_image.colorspace_settings.name
    rgba = np.ones((*pixels.shape[:2], 4), np.float32)
    rgba[..., :3] = pixels
    b_image.pixels.foreach_set(rgba.ravel())
    return b_image


def waves():
    """A normal map of soft waves."""
    v, u = np.mgrid[0:64, 0:64] / 64 * 2 * np.pi
    x, y = 0.4 * np.sin(4 * u), 0.4 * np.sin(3 * v)
    return np.stack([x, y, np.sqrt(1 - x * x - y * y)], axis=2) / 2 + 0.5


def smooth_colors():
    v, u = np.mgrid[0:64, 0:64] / 64 * 2 * np.pi
    return np.stack([0.5 + 0.4 * np.sin(3 * u), 0.5 + 0.4 * np.sin(2 * v), 0.5 + 0.4 * np.sin(u + v)], axis=2)


BALLS = {
    "plastic": {"Base Color": (0.7, 0.2, 0.1, 1), "Roughness": 0.5},
    "polished": {"Base Color": (0.7, 0.2, 0.1, 1), "Roughness": 0.05},
    "metal": {"Base Color": (0.9, 0.6, 0.3, 1), "Metallic": 1.0, "Roughness": 0.0, "Specular Tint": (0.6, 0.8, 1, 1)},
    "rough metal": {"Base Color": (0.9, 0.6, 0.3, 1), "Metallic": 1.0, "Roughness": 0.3},
    "rougher metal": {"Base Color": (0.9, 0.6, 0.3, 1), "Metallic": 1.0, "Roughness": 0.5},
    "coat": {"Base Color": (0.1, 0.2, 0.6, 1), "Coat Weight": 1.0, "Roughness": 0.5},
    "tinted coat": {
        "Base Color": (0.8, 0.8, 0.8, 1), "Coat Weight": 1.0, "Coat Roughness": 0.4, "Coat Tint": (0.9, 0.4, 0.2, 1),
    },
    "sheen": {"Base Color": (0.1, 0.2, 0.6, 1), "Sheen Weight": 1.0},
    "textured": {"Roughness": 0.5},
    "normal map": {"Base Color": (0.6, 0.6, 0.6, 1), "Roughness": 0.6},
}  # fmt: skip


def ball(number, name, values):
    x, z = number % TILES - TILES / 2 + 0.5, number // TILES - TILES / 2 + 0.5
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.48, location=(x, 0, z))
    b_object = bpy.context.object
    b_object.visible_shadow = b_object.visible_glossy = b_object.visible_transmission = False
    b_object.data.shade_smooth()
    b_material, tree, b_output = material(name)
    b_shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
    for socket, value in values.items():
        b_shader.inputs[socket].default_value = value
    tree.links.new(b_shader.outputs[0], b_output.inputs["Surface"])
    if name in ("textured", "normal map"):
        b_picture = tree.nodes.new("ShaderNodeTexImage")
        b_picture.image = picture(name, waves() if name == "normal map" else smooth_colors(), data=name != "textured")
        if name == "textured":
            tree.links.new(b_picture.outputs[0], b_shader.inputs["Base Color"])
        else:
            b_map = tree.nodes.new("ShaderNodeNormalMap")
            tree.links.new(b_picture.outputs[0], b_map.inputs["Color"])
            tree.links.new(b_map.outputs[0], b_shader.inputs["Normal"])
    b_object.data.materials.append(b_material)
    return x, z


def test_balls_under_an_environment_look_as_eevee_draws_them(addon):
    """At most 2 % of the mean, ball by ball. (EEVEE's do not mirror each other, so ours must not.)

    Rough metals of EEVEE are its world's blurred image, with the error of that.
    """
    b_scene = empty(160, 8)
    environment(b_scene)
    for number, (name, values) in enumerate(BALLS.items()):
        ball(number, name, values)
    b_scene.hybrid.rough_samples = 8
    raster, traced, warnings = both(b_scene)
    assert warnings == []
    y, x = (np.mgrid[0:32, 0:32] + 0.5) / 32 - 0.5
    inside = x * x + y * y < 0.4**2
    found = {}
    for number, name in enumerate(BALLS):
        i, j = number % TILES * 32, number // TILES * 32
        a, b = raster[j : j + 32, i : i + 32][inside], traced[j : j + 32, i : i + 32][inside]
        found[name] = float(abs(b.mean() / a.mean() - 1)), float(np.abs(b - a).mean() / a.mean())
    print(found)
    most = {name: 0.05 if name.startswith("rough") else 0.03 for name in BALLS}
    assert {name: value for name, value in found.items() if value[0] > 0.02 or value[1] > most[name]} == {}


def test_a_world_of_nodes_lights_as_in_eevee(addon):
    """The sky times noise, so bright that its glows are a sun, behind a switch: the camera sees another world."""
    b_scene = empty(160, 8)
    environment(b_scene)
    b_scene.world.sun_threshold = 1.5
    tree = b_scene.world.node_tree
    b_output, b_background, b_picture = (
        tree.nodes[name] for name in ("World Output", "Background", "Environment Texture")
    )
    b_noise, b_tint, b_path, b_switch, b_other = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexNoise", "Mix", "LightPath", "MixShader", "Background")
    )
    b_noise.inputs["Scale"].default_value = 1.5
    b_tint.data_type, b_tint.blend_type = "RGBA", "MULTIPLY"
    tree.links.new(b_picture.outputs[0], b_tint.inputs[6])
    tree.links.new(b_noise.outputs["Color"], b_tint.inputs[7])
    tree.links.new(b_tint.outputs[2], b_background.inputs["Color"])
    b_background.inputs["Strength"].default_value = 2.0
    b_other.inputs["Color"].default_value = (1, 0, 1, 1)
    for number, output in enumerate((b_path.outputs["Is Camera Ray"], b_background.outputs[0], b_other.outputs[0])):
        tree.links.new(output, b_switch.inputs[number])
    tree.links.new(b_switch.outputs[0], b_output.inputs["Surface"])
    names = ("plastic", "coat")
    for number, name in enumerate(names):
        ball(number, name, BALLS[name])
    raster, traced, warnings = both(b_scene, samples=256)
    assert warnings == []
    y, x = (np.mgrid[0:32, 0:32] + 0.5) / 32 - 0.5
    inside = x * x + y * y < 0.4**2
    found = {}
    for number, name in enumerate(names):
        a, b = (picture[:32, number * 32 : number * 32 + 32][inside] for picture in (raster, traced))
        found[name] = float(abs(b.mean() / a.mean() - 1)), float(np.abs(b - a).mean() / a.mean())
    # The sun's highlight on the coat is smaller than a pixel, and EEVEE takes 8 samples: 1.6 % (5.2), 2.3 % (4.5).
    assert {name: value for name, value in found.items() if value[0] > 0.03 or value[1] > 0.03} == {}
