# SPDX-License-Identifier: GPL-3.0-or-later
"""See-through surfaces in mode Hybrid: what is behind them is there once, and as bright as it is."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid

pytestmark = [pytest.mark.blender, pytest.mark.render]
BEHIND = np.array((0.2, 0.6, 0.9))
CARDS = {
    "alpha": 0.5 * np.array((1, 0, 0)) + 0.5 * BEHIND,  # Principled, half there, glowing red
    "glow": np.array((0.5, 0, 0)) + BEHIND,  # added to Transparent: EEVEE's mask is 0
    "tint": np.array((0.8, 0.2, 0.2)) * BEHIND,
    "both": 0.25 * np.array((0, 0, 1)) + 0.75 * BEHIND,  # Mix of Emission and Transparent
}


def nodes(name, **kinds):
    b_material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        b_material.use_nodes = True
    b_tree = b_material.node_tree
    for b_node in list(b_tree.nodes):
        if b_node.bl_idname != "ShaderNodeOutputMaterial":
            b_tree.nodes.remove(b_node)
    made = []
    for kind, values in kinds.items():
        b_node = b_tree.nodes.new(f"ShaderNode{kind}")
        for key, value in values.items():
            b_node.inputs[key.replace("_", " ") if isinstance(key, str) else key].default_value = value
        made.append(b_node)
    *shaders, last = made
    places = [i for i, b_input in enumerate(last.inputs) if b_input.type == "SHADER"]
    for b_shader, place in zip(shaders, places, strict=False):
        b_tree.links.new(b_shader.outputs[0], last.inputs[place])
    b_tree.links.new(last.outputs[0], b_tree.nodes["Material Output"].inputs["Surface"])
    return b_material


def glow(*color, strength=1.0):
    return {"Color": (*color, 1), "Strength": strength}


@pytest.fixture(scope="module")
def result(addon):
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    for b_object in list(scene.objects):
        if b_object.type != "CAMERA":
            bpy.data.objects.remove(b_object)
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 64, 100
    scene.eevee.taa_render_samples, scene.eevee.use_shadows = 4, False
    scene.view_settings.view_transform = "Raw"
    scene.camera.location, scene.camera.rotation_euler = (0, 0, 5), (0, 0, 0)
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 4
    materials = {
        "alpha": nodes("alpha", BsdfPrincipled={
            "Alpha": 0.5, "Base_Color": (0, 0, 0, 1), "Specular_IOR_Level": 0.0, "Emission_Color": (1, 0, 0, 1),
            "Emission_Strength": 1.0,
        }),
        "glow": nodes("glow", BsdfTransparent={}, Emission=glow(1, 0, 0, strength=0.5), AddShader={}),
        "tint": nodes("tint", BsdfTransparent={"Color": (0.8, 0.2, 0.2, 1)}),
        "both": nodes("both", BsdfTransparent={}, Emission=glow(0, 0, 1), MixShader={0: 0.25}),
    }  # fmt: skip
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 0, -1))
    bpy.context.object.data.materials.append(nodes("behind", Emission=glow(*BEHIND)))
    for number, name in enumerate(CARDS):
        bpy.ops.mesh.primitive_plane_add(size=1.4, location=(-1 + 2 * (number % 2), -1 + 2 * (number // 2), 0))
        bpy.context.object.data.materials.append(materials[name])
        hybrid.mark(bpy.context.object)
    hybrid.enable(scene)
    return hybrid.render(scene, samples=16)


@pytest.mark.parametrize("name", CARDS)
def test_what_is_behind_is_there_once(result, name):
    number = list(CARDS).index(name)
    x, y = 16 + 32 * (number % 2), 16 + 32 * (number // 2)
    seen = result.image[y - 6 : y + 6, x - 6 : x + 6]
    assert seen[..., :3].reshape(-1, 3) == pytest.approx(np.tile(CARDS[name], (144, 1)), abs=0.01)
    assert seen[..., 3] == pytest.approx(1)
    assert result.mask[y, x] == pytest.approx(1)


def test_beside_the_cards_the_picture_is_eevees_bit_by_bit(result):
    beside = result.mask == 0
    assert np.count_nonzero(beside) > 1000
    assert (result.image[beside] == result.raster[beside]).all()
