# SPDX-License-Identifier: GPL-3.0-or-later
"""What scripts do between two renders: the next one renders, hybrid where it is on, and Blender lives.

Each script runs in a process of its own: what is tested is that it does not crash.
"""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

pytestmark = [pytest.mark.blender, pytest.mark.render]
ROOT = Path(__file__).resolve().parents[3]

START = """
    import os, sys
    import bpy
    import hybrid_addon as hybrid
    from hybrid_addon.blender import session

    hybrid.register()
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    scene.eevee.taa_render_samples, scene.eevee.use_shadows, scene.hybrid.samples = 1, False, 1
    scene.cycles.samples = 1
    eevee = scene.render.engine
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=1.0)
    hybrid.enable(scene)

    def render(which=scene):
        session.of(which.name).frame = None
        bpy.ops.render.render(scene=which.name)
        print("rendered", "hybrid" if session.of(which.name).frame else "plain", flush=True)
"""

SCRIPTS = {
    "Cycles, and EEVEE again": (
        """
        for engine in ("CYCLES", eevee, "CYCLES", eevee):
            scene.render.engine = engine
            render()
        """,
        ["plain", "hybrid", "plain", "hybrid"],
    ),
    "a copy of the scene": (
        """
        render()
        copy = scene.copy()
        render(copy)
        render()
        bpy.data.scenes.remove(copy)
        render()
        """,
        ["hybrid"] * 4,
    ),
    "all other scenes removed": (
        """
        render()
        for other in [s for s in bpy.data.scenes if s != scene]:
            bpy.data.scenes.remove(other)
        render()
        """,
        ["hybrid"] * 2,
    ),
    "view layers, nodes and collections removed": (
        """
        for layer in list(scene.view_layers)[1:]:
            scene.view_layers.remove(layer)
        render()
        tree = scene.compositing_node_group if hasattr(scene, "compositing_node_group") else scene.node_tree
        tree.nodes.clear()
        render()
        for collection in [c for c in bpy.data.collections if c.name.startswith("Hybrid")]:
            bpy.data.collections.remove(collection)
        render()
        """,
        ["hybrid"] * 3,
    ),
}


@pytest.mark.parametrize("name", SCRIPTS)
def test_blender_lives_and_renders(name: str) -> None:
    script, wanted = SCRIPTS[name]
    code = textwrap.dedent(START) + textwrap.dedent(script) + "\nsys.stdout.flush()\nos._exit(0)\n"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    found = [line.split()[1] for line in done.stdout.splitlines() if line.startswith("rendered ")]
    assert (done.returncode, found) == (0, wanted), done.stderr[-500:]
