# SPDX-License-Identifier: GPL-3.0-or-later
"""The farms' files in farm/, run by what farms run: Open Job Description's own tool, and Flamenco's JavaScript.

In place of Blender stands a program of its name that runs the same command by the bpy module.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import cli

pytestmark = pytest.mark.blender
ROOT = Path(__file__).resolve().parents[3]
OPENJD = [sys.executable, "-c", "from openjd.cli import main; main()"]
FLAMENCO = """
const vm = require("vm"), fs = require("fs");
const tasks = [];
const context = {
  author: {
    Task: (name, type) => ({ name, type, commands: [], addCommand(c) { this.commands.push(c); } }),
    Command: (name, parameters) => ({ name, parameters }),
  },
  frameChunker: (frames, size) => frames === "1-3,7" && size === 2 ? ["1,2", "3,7"] : undefined,
  formatTimestampLocal: (time) => `stamp ${time}`,
};
vm.runInNewContext(fs.readFileSync(process.argv[1], "utf8") + "\\nthis.JOB_TYPE = JOB_TYPE;", context);
const settings = JSON.parse(process.argv[2]);
for (const s of context.JOB_TYPE.settings) if (!(s.key in settings)) settings[s.key] = s.default;
context.compileJob({ settings, created: "now", addTask: (task) => tasks.push(task) });
console.log(JSON.stringify({ settings, tasks, type: context.JOB_TYPE }));
"""


@pytest.fixture
def blend(addon, tmp_path):
    """Three frames, mode full (no EEVEE), in a folder with a name that people give."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 24, 16
    scene.hybrid.samples, scene.hybrid.mode = 1, "FULL"
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=0.5)
    folder = tmp_path / "Müllers Küche"
    folder.mkdir()
    path = folder / "a shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def program(tmp_path):
    """`blender --command hybrid ...`"""
    path = tmp_path / "blender"
    path.write_text(
        f'#!/bin/sh\n[ "$1 $2" = "--command hybrid" ] || exit 9\nshift 2\ncd {shlex.quote(str(ROOT))} || exit 9\n'
        f'exec {shlex.quote(sys.executable)} -m hybrid_addon "$@"\n'
    )
    path.chmod(0o755)
    return path


def openjd(*arguments):
    process = subprocess.run(
        [*OPENJD, *map(str, arguments)], text=True, timeout=600, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    return process.returncode, process.stdout


@pytest.mark.parametrize("name", ["render.yaml", "environment.yaml"])
def test_open_job_description_calls_the_template_valid(name):
    code, printed = openjd("check", ROOT / "farm" / "openjd" / name)
    assert code == 0, printed


@pytest.mark.skipif(os.name == "nt", reason="a shell script stands for Blender")
def test_open_job_description_renders_the_frames_in_chunks(blend, program, tmp_path):
    """Two starts of Blender for three frames; its progress is understood, and a bad file fails the task."""
    folder = tmp_path / "out put"

    def run(file):
        values = {"BlenderFile": file, "Frames": "1-5:2", "FramesPerTask": 2, "OutputFolder": folder,
                  "Blender": program}  # fmt: skip
        given = [word for name, value in values.items() for word in ("--job-param", f"{name}={value}")]
        return openjd("run", ROOT / "farm" / "openjd" / "render.yaml", *given)

    code, printed = run(blend)
    assert code == 0, printed
    assert sorted(path.name for path in folder.iterdir()) == [f"a shot_{n:04d}.png" for n in (1, 3, 5)]
    assert re.findall(r"openjd_progress: (\d+)", printed) == ["50", "100", "100"]
    assert "Chunks run: 2" in printed
    code, printed = run(blend.with_name("none.blend"))
    assert code != 0
    assert "hybrid: error: no file" in printed


@pytest.mark.skipif(not shutil.which("node"), reason="needs a JavaScript engine: node")
def test_flamenco_job_type_makes_commands_that_render(blend, tmp_path, capfd):
    """What its worker runs, {exe} {exeArgs} {argsBefore} {blendfile} {args}, is our command, with the files it says."""
    output = tmp_path / "renders of {timestamp}" / "######"
    settings = {"frames": "1-3,7", "chunk_size": 2, "blendfile": str(blend), "scene": "Scene",
                "render_output_path": str(output)}  # fmt: skip
    process = subprocess.run(
        ["node", "-e", FLAMENCO, ROOT / "farm" / "flamenco" / "hybrid_render.js", json.dumps(settings)],
        text=True, timeout=600, capture_output=True,
    )  # fmt: skip
    assert process.returncode == 0, process.stderr
    compiled = json.loads(process.stdout)
    folder = tmp_path / "renders of stamp now"
    assert compiled["settings"]["render_output_path"] == str(folder / "######")
    assert [(task["name"], task["type"]) for task in compiled["tasks"]] == [
        ("render-1,2", "blender"), ("render-3,7", "blender"),
    ]  # fmt: skip
    for task in compiled["tasks"]:
        (command,) = task["commands"]
        assert command["name"] == "blender-render"
        words = command["parameters"]
        assert (words["exe"], words["exeArgs"]) == ("{blender}", "{blenderArgs}")
        door, name, *verb = words["argsBefore"]
        assert (door, name) == ("--command", "hybrid")
        assert cli.main([*verb, words["blendfile"], *words["args"]]) == 0, capfd.readouterr()
    assert sorted(path.name for path in folder.iterdir()) == [f"{n:06d}.png" for n in (1, 2, 3, 7)]


def test_flamenco_knows_all_settings_that_it_is_asked_for():
    """Every {…} and settings.… of the script is a setting that it declares, or Flamenco's own."""
    script = (ROOT / "farm" / "flamenco" / "hybrid_render.js").read_text(encoding="utf-8")
    declared = set(re.findall(r'key: "(\w+)"', script))
    assert set(re.findall(r"settings\.(\w+)", script)) <= declared
    assert set(re.findall(r'"\{(\w+)\}"', script)) == {"blender", "blenderArgs", "timestamp"}
