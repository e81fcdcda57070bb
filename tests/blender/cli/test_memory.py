# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory on the command line: what a plan expects, and how a scene that does not fit ends."""

from __future__ import annotations

import bpy
import pytest

import hybrid_addon as hybrid
from hybrid_addon import memory
from hybrid_addon.blender import cli
from hybrid_addon.blender.errors import TooLarge

pytestmark = pytest.mark.blender


@pytest.fixture
def file(scene, tmp_path):
    """A saved scene with a ray traced ball that wears an image, and a camera."""
    b_image = bpy.data.images.new("Bark", 64, 64)
    b_material = bpy.data.materials.new("Bark")
    if bpy.app.version < (5, 0, 0):
        b_material.use_nodes = True
    b_node = b_material.node_tree.nodes.new("ShaderNodeTexImage")
    b_node.image = b_image
    b_material.node_tree.links.new(b_node.outputs[0], b_material.node_tree.nodes["Principled BSDF"].inputs[0])
    bpy.ops.mesh.primitive_uv_sphere_add()
    bpy.context.object.data.materials.append(b_material)
    hybrid.mark(bpy.context.object)
    if scene.camera is None:
        bpy.ops.object.camera_add(location=(0, 0, 8))
        scene.camera = bpy.context.object
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_a_plan_says_what_to_expect(file, capfd):
    assert cli.main(["plan", str(file)]) == 0
    (line,) = [line for line in capfd.readouterr().out.splitlines() if line.startswith("memory: ")]
    assert "geometry" in line
    assert "(Bark 0.0 MB)" in line


def test_a_scene_that_does_not_fit_ends_with_1_in_one_line(file, capfd, monkeypatch, tmp_path):
    monkeypatch.setattr(memory, "available", lambda: 1 << 16)  # the image, not the triangles
    output = tmp_path / "out.png"
    assert cli.main(["render", str(file), "--output", str(output), "--mode", "full", "--resolution", "32x24"]) == 1
    said = [line for line in capfd.readouterr().err.splitlines() if line.startswith("hybrid: failed: ")]
    assert len(said) == 1
    assert said[0].startswith("hybrid: failed: not enough memory: ")
    assert not output.exists()
    with pytest.raises(TooLarge, match="not enough memory"):
        hybrid.advise()
    monkeypatch.setattr(memory, "available", lambda: 1 << 17)
    assert any("cannot be rendered here" in line for line in hybrid.plan()["warnings"])


def test_python_s_own_lack_of_memory_has_a_line(monkeypatch, capfd):
    def parser():
        raise MemoryError

    monkeypatch.setattr(cli, "_parser", parser)
    assert cli.main([]) == 1
    assert capfd.readouterr().err == f"hybrid: failed: {memory.REFUSED}\n"
