# SPDX-License-Identifier: GPL-3.0-or-later
"""Without Embree, as with another system's zip: the add-on loads, and whatever traces says why not."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.blender

SCRIPT = """
import sys
from types import SimpleNamespace

sys.modules["embreex"] = None  # an import of it fails

import bpy

import hybrid_addon
from hybrid_addon.blender import preview

hybrid_addon.register()
hybrid_addon.mark(bpy.data.objects["Cube"])
bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 4
for work in (hybrid_addon.advise, lambda: hybrid_addon.explain(0, 0), lambda: hybrid_addon.render(mode="full")):
    try:
        work()
    except hybrid_addon.HybridError as error:
        print("SAID", error)
viewport = SimpleNamespace(view=None, shown=None, problem="")
assert preview._start(viewport) is None
print("SAID", viewport.problem)
hybrid_addon.unregister()
"""


def test_the_addon_loads_and_all_that_trace_say_the_same():
    top = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=top, capture_output=True, text=True, timeout=120)
    said = [line for line in done.stdout.splitlines() if line.startswith("SAID ")]
    assert done.returncode == 0 and len(said) == 4 and len(set(said)) == 1, done.stdout + done.stderr
    assert said[0].startswith("SAID Embree does not load on ") and said[0].endswith("install this system's zip")
