# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender without the add-on makes of a hand-off: the same picture, from files alone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import cli
from hybrid_addon.blender.pipeline import nodes
from hybrid_addon.blender.render import images

pytestmark = [pytest.mark.blender, pytest.mark.render]
PLAIN = """
import bpy, os, sys
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
scene = bpy.context.scene
assert not hasattr(scene, "hybrid") and len(bpy.data.scenes) == 1 and len(scene.view_layers) == 1
assert not [c.name for c in bpy.data.collections if "Hybrid" in c.name]
scene.render.filepath = sys.argv[2]
print("FRAMES", scene.frame_start, scene.frame_end, scene.frame_step)
bpy.ops.render.render(animation=scene.frame_end != 250, write_still=True)
sys.stdout.flush()
os._exit(0)
"""


def make(path, change=lambda scene, tree: None):
    """A cube that moves and is traced, in front of one that is not; the user's compositor inverts the picture."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.hybrid.samples = 48, 32, 1
    scene.eevee.taa_render_samples, scene.eevee.use_shadows = 1, False  # most of the time of software OpenGL
    scene.view_settings.exposure, scene.view_settings.view_transform = 0.5, "AgX"
    cube = bpy.data.objects["Cube"]
    other = cube.copy()
    other.location.x = -3
    scene.collection.objects.link(other)
    for frame, x in ((1, 0.0), (5, 2.0)):
        cube.location.x = x
        cube.keyframe_insert("location", frame=frame)
    hybrid.mark(cube, reflectivity=0.3)
    change(scene, compositor(scene))
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def compositor(scene):
    if bpy.app.version >= (5, 0):
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Mine", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        output = tree.nodes.new("NodeGroupOutput")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
        output = tree.nodes.new("CompositorNodeComposite")
    layers, invert = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeInvert")
    layers.name = "Mine"
    tree.links.new(invert.inputs["Color"], layers.outputs["Image"])
    tree.links.new(output.inputs[0], invert.outputs[0])
    return tree


def composite(blend, output):
    """Render it in a process that has never heard of the add-on."""
    environment = {k: v for k, v in os.environ.items() if k not in {"DISPLAY", "WAYLAND_DISPLAY", "PYTHONPATH"}}
    process = subprocess.run(
        [sys.executable, "-c", PLAIN, blend, output], cwd=output.parent, env=environment, text=True, timeout=600,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    assert process.returncode == 0, process.stdout
    return process.stdout


def read(path):
    return oiio.ImageInput.open(str(path)).read_image("uint8").astype(int)[..., :3]


def test_plain_blender_composites_the_same_pictures(addon, tmp_path):
    """In another folder than they were made in, with the user's own nodes, exposure and view transform."""
    blend = make(tmp_path / "shot.blend")
    made, moved = tmp_path / "made", tmp_path / "moved away"
    code = cli.main(["render", str(blend), "--output", str(tmp_path / "o_####.png"), "--frames", "1-5x4",
                     "--passes", str(made), "--handoff"])  # fmt: skip
    assert code == 0
    made.rename(moved)
    printed = composite(moved / "composite.blend", tmp_path / "plain_####.png")
    assert "FRAMES 1 5 4" in printed
    pictures = [read(tmp_path / f"o_{n:04d}.png") for n in (1, 5)]
    for number, picture in zip((1, 5), pictures, strict=True):
        assert np.abs(picture - read(tmp_path / f"plain_{number:04d}.png")).max() <= 1
        raster, mask, traced = (
            next(iter(images.read_exr(moved / f"{name}_{number:04d}.exr").values()))
            for name in ("raster", "mask", "traced")
        )
        assert 0.02 < mask.mean() < 0.5
        assert raster[..., :3].max() > 0.02
        assert traced[..., :3].max() > 0.02
    assert np.abs(pictures[0] - pictures[1]).max() > 15
    assert pictures[0].std() > 2


def test_one_picture_and_passes_that_still_need_a_render(addon, tmp_path):
    """Without a frame number; the user's node that takes Depth from the render stays, one that took Image rests."""

    def change(scene, tree):
        scene.view_layers[0].use_pass_z = True
        depth, viewer = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeViewer")
        depth.name = "Depth"
        tree.links.new(viewer.inputs[0], depth.outputs["Depth"])

    blend = make(tmp_path / "shot.blend", change)
    code = cli.main(["render", str(blend), "--output", str(tmp_path / "o.png"), "--mode", "full", "--frame", "1",
                     "--resolution", "40x30", "--passes", str(tmp_path), "--handoff"])  # fmt: skip
    assert code == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "composite.blend"))
    scene = bpy.context.scene
    tree = nodes.compositor_tree(scene)
    assert [(node.name, node.mute) for node in tree.nodes if node.type == "R_LAYERS"] == [
        ("Mine", True),
        ("Depth", False),
    ]
    assert (scene.hybrid.enabled, scene.hybrid.restore, len(bpy.data.scenes)) == (False, "", 1)
    assert (scene.render.resolution_x, scene.render.resolution_y) == (40, 30)
    tree.nodes.remove(tree.nodes["Depth"])
    bpy.ops.wm.save_mainfile()
    composite(tmp_path / "composite.blend", tmp_path / "plain.png")
    assert np.abs(read(tmp_path / "o.png") - read(tmp_path / "plain.png")).max() <= 1


def test_what_cannot_be_handed_over_is_said_at_once(addon, tmp_path, capfd):
    blend = make(tmp_path / "shot.blend")
    start = ["render", str(blend), "--output", str(tmp_path / "{camera_name}.png"), "--mode", "full", "--handoff"]
    for more, words in (
        ([], "--passes DIR"),
        (["--passes", str(tmp_path), "--frames=-3-2"], "from 0 on"),
    ):
        assert cli.main([*start, *more]) == 2
        assert words in capfd.readouterr().err
    assert sorted(path.name for path in Path(tmp_path).iterdir()) == ["shot.blend"]
