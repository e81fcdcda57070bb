# SPDX-License-Identifier: GPL-3.0-or-later
"""Whatever a script does between two renders, the next one renders, or says in one line why not: a few random walks."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.blender, pytest.mark.render]
HERE = Path(__file__).resolve().parent

SEEDS = ("1", "7", "205")
"""In 7 a scene is copied, and another one made by the operator: 5.2 crashed. In 205 one layer is rendered."""


@pytest.mark.parametrize("seeds", SEEDS)
def test_scripts_that_do_anything_render_or_hear_why_not(seeds: str) -> None:
    """All of 1-300: `python tests/blender/pipeline/script_walk.py 1-300`, or `make walks`."""
    environment = {**os.environ, "PYTHONPATH": str(HERE.parents[2])}
    command = [sys.executable, str(HERE / "script_walk.py"), seeds, "3"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, errors="replace", timeout=600)
    last = [line for line in done.stdout.splitlines() if line.startswith(("seed", "WRONG", "WALKED"))][-3:]
    assert done.returncode == 0, (last, done.stdout[-1500:])
