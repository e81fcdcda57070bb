# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user has linked to the pipeline's nodes survives a save, a load, and Hybrid switched off and on."""

from __future__ import annotations

import bpy
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.pipeline import nodes

pytestmark = pytest.mark.blender


def ours(scene, role):
    return next(node for node in nodes.compositor_tree(scene).nodes if nodes.role(node) == role)


@pytest.fixture
def wired(scene):
    """A blur fed by the traced half's Mask and Depth, another by EEVEE's half; nodes moved about."""
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=1.0)
    scene.hybrid.passes = {"DEPTH"}
    hybrid.enable(scene)
    tree = nodes.compositor_tree(scene)
    for name in ("First", "Second"):
        node = tree.nodes.new("CompositorNodeBrightContrast")
        node.name = name
    trace = ours(scene, "trace")
    tree.links.new(trace.outputs["Depth"], tree.nodes["First"].inputs[0])
    tree.links.new(trace.outputs["Mask"], tree.nodes["First"].inputs[1])
    tree.links.new(ours(scene, "mask").outputs["Image"], tree.nodes["Second"].inputs[0])
    trace.location = (-111, -222)
    next(node for node in tree.nodes if nodes.is_stand_in(node)).location = (33, 44)
    return scene


def found(scene):
    """Who feeds the two nodes, and where ours stand."""
    tree = nodes.compositor_tree(scene)
    feeds = {
        (name, i): (nodes.role(link.from_node), link.from_socket.name)
        for name in ("First", "Second")
        for i in range(2)
        for link in tree.nodes[name].inputs[i].links
    }
    stand_in = next(node for node in tree.nodes if nodes.is_stand_in(node))
    return feeds, tuple(ours(scene, "trace").location), tuple(stand_in.location)


WIRED = (
    {("First", 0): ("trace", "Depth"), ("First", 1): ("trace", "Mask"), ("Second", 0): ("mask", "Image")},
    (-111, -222),
    (33, 44),
)


def test_links_and_places_outlive_a_save_and_a_load(wired, tmp_path):
    assert found(wired) == WIRED
    path = str(tmp_path / "wired.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    assert found(wired) == WIRED
    assert wired.hybrid.memory == ""
    bpy.ops.wm.open_mainfile(filepath=path)
    assert found(bpy.context.scene) == WIRED


def test_links_outlive_hybrid_switched_off_and_on(wired):
    hybrid.disable(wired)
    tree = nodes.compositor_tree(wired)
    assert not any(socket.is_linked for socket in tree.nodes["First"].inputs)
    hybrid.enable(wired)
    assert found(wired) == WIRED


def test_what_the_user_links_or_takes_away_meanwhile_is_his(wired):
    hybrid.disable(wired)
    tree = nodes.compositor_tree(wired)
    tree.nodes.remove(tree.nodes["Second"])
    tree.links.new(tree.nodes["First"].inputs[1], tree.nodes.new("CompositorNodeRGB").outputs[0])
    hybrid.enable(wired)
    assert tree.nodes["First"].inputs[0].links[0].from_socket.name == "Depth"
    assert tree.nodes["First"].inputs[1].links[0].from_node.bl_idname == "CompositorNodeRGB"
    assert wired.hybrid.memory == ""


def test_a_link_waits_for_its_pass(wired):
    hybrid.disable(wired)
    wired.hybrid.passes = set()
    hybrid.enable(wired)
    first = nodes.compositor_tree(wired).nodes["First"]
    assert not first.inputs[0].is_linked
    wired.hybrid.passes = {"DEPTH"}
    hybrid.disable(wired)
    hybrid.enable(wired)
    assert found(wired)[0] == WIRED[0]


@pytest.mark.parametrize(
    "forged", ["[", "[]", '{"links": 3, "places": []}', '{"places": {"trace": [NaN, 1e999]}, "links": [["trace", 1]]}']
)
def test_forged_memory_does_no_harm(scene, forged):
    hybrid.mark(bpy.data.objects["Cube"])
    scene.hybrid.memory = forged
    hybrid.enable(scene)
    assert tuple(ours(scene, "trace").location) == nodes.PLACES["trace"]
    hybrid.disable(scene)
    hybrid.enable(scene)
