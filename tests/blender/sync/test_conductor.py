# SPDX-License-Identifier: GPL-3.0-or-later
"""Fresnel's reflectance of metals, and the node that asks for it."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from hybrid_addon.blender.sync import Warnings
from hybrid_addon.blender.sync.conductor import conductor_fresnel, conductor_tints
from hybrid_addon.blender.sync.image import Images
from hybrid_addon.blender.sync.material import translate_material
from hybrid_addon.blender.sync.texture import FrameFacts

pytestmark = pytest.mark.blender
N, K = np.array([0.18, 0.42, 1.37]), np.array([3.42, 2.35, 1.77])  # gold


def test_reflectance_at_normal_and_grazing_incidence_and_of_a_dielectric():
    f0 = ((N - 1) ** 2 + K**2) / ((N + 1) ** 2 + K**2)
    np.testing.assert_allclose(conductor_fresnel(1.0, N, K), f0, rtol=1e-12)
    np.testing.assert_allclose(conductor_fresnel(1e-9, N, K), 1.0, atol=1e-7)
    sine = np.sqrt(1 - 0.5**2)
    inside = np.sqrt(1 - (sine / 1.5) ** 2)  # Snell
    s, p = (0.5 - 1.5 * inside) / (0.5 + 1.5 * inside), (1.5 * 0.5 - inside) / (1.5 * 0.5 + inside)
    np.testing.assert_allclose(conductor_fresnel(0.5, np.array([1.5]), np.zeros(1)), [(s**2 + p**2) / 2], rtol=1e-9)


def test_a_metallic_node_by_complex_index_has_its_tints(scene):
    b_material = bpy.data.materials.new("Gold")
    if bpy.app.version < (5, 0, 0):
        b_material.use_nodes = True
    tree = b_material.node_tree
    tree.nodes.clear()
    b_node, b_output = tree.nodes.new("ShaderNodeBsdfMetallic"), tree.nodes.new("ShaderNodeOutputMaterial")
    b_node.fresnel_type = "PHYSICAL_CONDUCTOR"
    b_node.inputs["IOR"].default_value, b_node.inputs["Extinction"].default_value = N, K
    tree.links.new(b_node.outputs[0], b_output.inputs["Surface"])
    warn = Warnings()
    surface = translate_material(b_material, Images(warn), warn, FrameFacts())
    tint, edge = conductor_tints(N, K)
    assert surface.reflection_tint == pytest.approx(tint, rel=1e-5)
    assert surface.edge_tint == pytest.approx(edge, rel=1e-5)
    assert tint[0] > tint[1] > tint[2]
    assert surface.reflectivity == 1.0
    assert list(warn) == []
