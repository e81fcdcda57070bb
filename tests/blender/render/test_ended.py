# SPDX-License-Identifier: GPL-3.0-or-later
"""Glass that needs more bounces than it has: the render says so, by the objects' names."""

from __future__ import annotations

import bpy
import pytest

import hybrid_addon as hybrid

pytestmark = pytest.mark.blender


@pytest.fixture
def panes(scene):
    """Four thick panes of glass where the factory cube was, in a gray world."""
    cube = bpy.data.objects["Cube"]
    made = bpy.data.materials.new("Glass")
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    for name, value in (("Transmission Weight", 1.0), ("Roughness", 0.0), ("IOR", 1.5)):
        shader.inputs[name].default_value = value
    cube.data.materials.clear()
    cube.data.materials.append(made)
    for k in range(4):
        pane = cube.copy()
        pane.name, pane.location, pane.scale = f"Pane {k}", (0.9 * k, 0, 0), (0.3, 1, 1)
        scene.collection.objects.link(pane)
        hybrid.mark(pane)
    bpy.data.objects.remove(cube)
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 32, 24, 100
    scene.hybrid.samples = 1
    hybrid.enable(scene)
    return scene


@pytest.mark.parametrize(("bounces", "dark"), [(3, True), (32, False)])
def test_black_glass_is_a_warning(panes, bounces, dark):
    panes.hybrid.max_depth = bounces
    lines = [w for w in hybrid.render(panes, mode="full").report["warnings"] if "Max Bounces" in w]
    assert len(lines) == dark
    assert all("Pane" in line and f"more than {bounces} bounces" in line for line in lines)
