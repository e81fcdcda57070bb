# SPDX-License-Identifier: GPL-3.0-or-later
"""Light Path beside Cycles: what a card, and what a pane in the light, is told of the rays that see it."""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy
import numpy as np
import pytest

import hybrid_addon
from tests.blender.kit import new_world
from tests.blender.parity.test_materials import empty, material

pytestmark = pytest.mark.blender
SIZE = 64
SCALES = {"Ray Length": 0.05, "Ray Depth": 0.2}
OUTPUTS = (
    "Is Camera Ray", "Is Shadow Ray", "Is Diffuse Ray", "Is Glossy Ray", "Is Singular Ray", "Is Reflection Ray",
    "Is Transmission Ray", "Is Volume Scatter Ray", "Ray Length", "Ray Depth", "Diffuse Depth", "Glossy Depth",
    "Transparent Depth", "Transmission Depth",
)  # fmt: skip
PLACES = {"card": (30, 58), "glass": (10, 32), "pane": (25, 32), "two panes": (39, 32), "mirror": (54, 32)}
"""Where in the picture which way leads to the card."""


def shader(name, kind, **values):
    b_material, tree, b_output = material(name)
    b_shader = tree.nodes.new(f"ShaderNode{kind}")
    for socket, value in values.items():
        b_shader.inputs[socket].default_value = value
    tree.links.new(b_shader.outputs[0], b_output.inputs["Surface"])
    return b_material


def asking(name, kind, output):
    """A material that shows an output of Light Path as its colour."""
    b_material = shader(name, kind)
    tree = b_material.node_tree
    b_path, b_scale = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeVectorMath")
    b_scale.operation = "SCALE"
    b_scale.inputs["Scale"].default_value = SCALES.get(output, 0.7 if output.startswith("Is") else 0.2)
    tree.links.new(b_path.outputs[output], b_scale.inputs[0])
    b_shader = next(n for n in tree.nodes if n.bl_idname == f"ShaderNode{kind}")
    tree.links.new(b_scale.outputs[0], b_shader.inputs["Color"])
    return b_material


def plane(b_material, location, size, turn=(np.pi / 2, 0, 0)):
    bpy.ops.mesh.primitive_plane_add(size=1, location=location, rotation=turn)
    b_object = bpy.context.object
    b_object.scale = (*size, 1)
    b_object.data.materials.append(b_material)
    return b_object


def pictures(b_scene, samples):
    """(traced, Cycles'), (h, w, 3)."""
    hybrid_addon.enable(b_scene)
    for b_object in b_scene.objects:
        if b_object.type == "MESH":
            hybrid_addon.mark(b_object)
    traced = hybrid_addon.render(b_scene, mode="full", samples=4)
    assert traced.report["warnings"] == []
    hybrid_addon.disable(b_scene)
    b_scene.render.engine = "CYCLES"
    b_scene.cycles.samples, b_scene.cycles.use_denoising, b_scene.cycles.use_adaptive_sampling = samples, False, False
    return np.array(traced.image)[..., :3], by_blender(b_scene)


def by_blender(b_scene):
    """What the scene's own engine draws."""
    with tempfile.TemporaryDirectory() as folder:
        b_scene.render.filepath = str(Path(folder, "x.exr"))
        settings = b_scene.render.image_settings
        settings.file_format, settings.color_depth = "OPEN_EXR", "32"
        bpy.ops.render.render(write_still=True)
        b_image = bpy.data.images.load(b_scene.render.filepath)
        pixels = np.array(b_image.pixels[:], np.float32).reshape(SIZE, SIZE, -1)[..., :3]
    return pixels


@pytest.mark.parametrize("output", OUTPUTS)
def test_a_card_is_told_of_rays_as_cycles_tells_it(addon, output):
    """Seen itself, through glass, through one and two clear panes, and in a mirror."""
    b_scene = empty(SIZE, 1)
    plane(asking("Card", "Emission", output), (0, 4, 0), (30, 30))
    bpy.ops.mesh.primitive_cube_add(size=1, location=(-1.7, 0, 0))
    bpy.context.object.scale = (0.9, 0.3, 3)
    bpy.context.object.data.materials.append(shader("Glass", "BsdfGlass", Roughness=0.0, IOR=1.5))
    clear = shader("Clear", "BsdfTransparent")
    plane(clear, (-0.5, 0, 0), (0.9, 3))
    for y in (0, -0.7):
        plane(clear, (0.6, y, 0), (0.9, 3))
    plane(shader("Mirror", "BsdfAnisotropic", Roughness=0.0), (1.8, 0, 0), (0.9, 3), (np.pi / 2, 0, 1.0))
    b_scene.world = new_world()
    ours, theirs = pictures(b_scene, 16)
    wrong = {}
    for name, (x, y) in PLACES.items():
        a, b = (picture[y - 2 : y + 2, x - 1 : x + 2].mean() for picture in (ours, theirs))
        if abs(a - b) > 0.02:
            wrong[name] = float(a), float(b)
    assert wrong == {}


@pytest.mark.parametrize("output", ("Is Camera Ray", "Is Shadow Ray", "Is Glossy Ray", "Ray Length", "Ray Depth"))
def test_a_pane_in_the_light_is_told_of_shadow_rays_as_cycles_tells_it(addon, output):
    """The second of two panes on the way to the sun: lengths count from the floor."""
    b_scene = empty(SIZE, 1)
    plane(shader("Floor", "BsdfDiffuse"), (0, 0, 0), (30, 30))
    plane(asking("Pane", "BsdfTransparent", output), (0, -14, 0), (30, 30))
    plane(shader("Clear", "BsdfTransparent"), (0, -12, 0), (30, 30))
    b_sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    b_sun.rotation_euler, b_sun.data.energy, b_sun.data.angle = (np.pi / 2, 0, 0), 3.0, 0.0
    b_scene.collection.objects.link(b_sun)
    b_scene.eevee.use_shadows = True
    ours, theirs = pictures(b_scene, 4)
    a, b = (picture[20:44, 20:44].mean() for picture in (ours, theirs))
    assert a == pytest.approx(b, abs=0.02)
    assert (b > 0.05) == (output in ("Is Shadow Ray", "Ray Length", "Ray Depth"))
