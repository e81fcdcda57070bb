# SPDX-License-Identifier: GPL-3.0-or-later
"""Many pictures from one command: cameras, scenes, frames; restart, kill, two writers. Mode full: no EEVEE needed."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import cli, files
from hybrid_addon.blender.cli import frames
from hybrid_addon.blender.render import images

pytestmark = pytest.mark.blender
ROOT = Path(__file__).resolve().parents[3]
HOSTILE = [
    "../../x",
    "%s {camera_name} ####",
    "a\nb\x1b[2J",
    "'\"; rm -rf $HOME `id`",
    "<script>",
    "x" * 63,
    "CON",
    ".",
    "‮é",
]


@pytest.fixture
def blend(addon, tmp_path):
    """Two scenes; the first has two cameras, three frames, and a marker that switches to the second camera."""
    bpy.ops.wm.read_factory_settings()
    first = bpy.context.scene
    first.name = "First"
    first.render.resolution_x, first.render.resolution_y, first.hybrid.samples = 24, 16, 1
    first.frame_start, first.frame_end = 1, 3
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=0.5)
    top = bpy.data.objects.new("Top", bpy.data.cameras.new("Top"))
    top.location = (0, 0, 12)
    first.collection.objects.link(top)
    bpy.ops.scene.new(type="LINK_COPY")
    bpy.context.scene.name = "Second"
    bpy.context.scene.camera = top
    bpy.context.window.scene = first
    bpy.data.scenes.new("No Camera")
    path = tmp_path / "batch.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def render(blend, output, *more):
    return ["render", str(blend), "--output", str(output), "--mode", "full", *map(str, more)]


def run(capfd, arguments, code=0):
    """Our own lines of the output."""
    assert cli.main(arguments) == code, capfd.readouterr()
    printed = capfd.readouterr()
    return [line.removeprefix("hybrid: ") for line in (printed.out + printed.err).splitlines() if "hybrid: " in line]


def read(path):
    return next(iter(images.read_exr(path).values()))


def names(folder, pattern="*"):
    return sorted(path.name for path in folder.glob(pattern))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("7", [7]),
        ("1-10x2,15", [1, 3, 5, 7, 9, 15]),
        ("1..4, 3", [1, 2, 3, 4]),
        ("1-7:3", [1, 4, 7]),
        ("-3--1,0", [-3, -2, -1, 0]),
    ],
)
def test_frames_as_people_write_them(text, expected):
    assert frames.parse(text) == expected


@pytest.mark.parametrize("text", ["", "1-", "a", "10-1", "1-5x0", "1;2", "9999999", "1-99999999999", "1,,2"])
def test_what_is_no_list_of_frames_is_refused(blend, tmp_path, capfd, text):
    (line,) = run(capfd, render(blend, tmp_path / "o.png", f"--frames={text}"), code=2)
    assert line.startswith("error: argument --frames: ")
    assert not list(tmp_path.glob("*.png"))


@pytest.mark.parametrize("name", [*HOSTILE, "é" * 200, "\udcff", ""])
def test_a_name_becomes_one_plain_part_of_a_file_name(name, tmp_path):
    safe = frames.safe(name)
    assert re.fullmatch(r"[\w\-. ]+", safe)
    assert len(safe.encode()) <= frames.NAME_LIMIT + 1
    assert safe.strip(". ") == safe
    path = frames.file_path(tmp_path / "{camera_name}_##.png", 7, {"camera_name": name}, numbered=True)
    assert path.parent == tmp_path
    assert path.name == f"{safe}_07.png"


def test_every_camera_and_frame_in_order(blend, tmp_path, capfd):
    output = tmp_path / "{camera_name}_##.exr"
    lines = run(capfd, render(blend, output, "--camera", "all", "--frames", "1-3x2", "--passes", tmp_path / "p"))
    assert names(tmp_path, "*.exr") == ["Camera_01.exr", "Camera_03.exr", "Top_01.exr", "Top_03.exr"]
    assert [line for line in lines if line.startswith("progress")] == [
        "progress 1/4 frame 1 camera Camera 25%",
        "progress 2/4 frame 3 camera Camera 50%",
        "progress 3/4 frame 1 camera Top 75%",
        "progress 4/4 frame 3 camera Top 100%",
    ]
    assert len(names(tmp_path / "p")) == 12
    np.testing.assert_array_equal(read(tmp_path / "Top_03.exr"), read(tmp_path / "p" / "traced_Top_0003.exr"))
    assert not np.array_equal(read(tmp_path / "Top_01.exr"), read(tmp_path / "Camera_01.exr"))


def test_the_data_passes_stand_beside_the_layers(blend, tmp_path, capfd):
    bpy.data.scenes["First"].hybrid.passes = {"DEPTH", "REFLECTION", "RESIDUAL"}
    bpy.ops.wm.save_mainfile()
    run(capfd, render(blend, tmp_path / "o.exr", "--passes", tmp_path / "p"))
    layers = ["depth.exr", "mask.exr", "raster.exr", "reflection.exr", "residual.exr", "traced.exr"]
    assert names(tmp_path / "p") == layers
    depth, mask, reflection = (read(tmp_path / "p" / f"{name}.exr") for name in ("depth", "mask", "reflection"))
    seen = mask[..., 0] == 1
    assert seen.any()
    assert (depth < 1e9).any()
    assert (reflection[..., :3] <= read(tmp_path / "p" / "traced.exr")[..., :3] + 1e-6).all()
    assert reflection.any()


def test_the_camera_asked_for_wins_over_markers_and_both_come_back(blend, tmp_path, capfd):
    scene = bpy.data.scenes["First"]
    marker = scene.timeline_markers.new("Cut", frame=1)
    marker.camera = bpy.data.objects["Top"]
    assert scene.camera.name == "Top"
    own = hybrid.render(scene, mode="full", frame=2, camera=bpy.data.objects["Camera"]).image
    assert (marker.camera.name, scene.camera.name) == ("Top", "Top")
    top = hybrid.render(scene, mode="full", frame=2).image
    marker.camera = None
    scene.camera = bpy.data.objects["Camera"]
    np.testing.assert_array_equal(own, hybrid.render(scene, mode="full", frame=2).image)
    assert not np.array_equal(own, top)


def test_every_scene_that_has_a_camera(blend, tmp_path, capfd):
    report = tmp_path / "r.json"
    run(capfd, render(blend, tmp_path / "{blend_name} {scene_name}.exr", "--scene", "all", "--report", report))
    assert names(tmp_path, "*.exr") == ["batch First.exr", "batch Second.exr"]
    found = json.loads(report.read_text())["frames"]
    assert [(f["scene"], f["camera"]) for f in found] == [("First", "Camera"), ("Second", "Top")]
    assert not np.array_equal(read(tmp_path / "batch First.exr"), read(tmp_path / "batch Second.exr"))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--camera", "all"], "put {camera_name} into"),
        (["--scene", "all"], "put {scene_name} into"),
        (["--camera", "Topp"], "did you mean 'Top'"),
        (["--scene", "Firts"], "did you mean 'First'"),
        (["--scene", "No Camera"], "has no camera"),
        (["--scene", "No Camera", "--camera", "all"], "has no camera"),
        (["--frames", "1", "--frame", "1"], "not allowed with"),
    ],
)
def test_refusals_leave_nothing(blend, tmp_path, capfd, more, words):
    (line,) = run(capfd, render(blend, tmp_path / "o.png", *more), code=2)
    assert words in line
    assert names(tmp_path) == ["batch.blend"]


def test_a_camera_of_cycles_is_rendered_as_eevee_draws_it(blend, tmp_path, capfd):
    bpy.data.objects["Top"].data.type = "PANO"
    bpy.ops.wm.save_mainfile()
    run(capfd, render(blend, tmp_path / "{camera_name}.png", "--camera", "all"))
    assert "Top.png" in names(tmp_path, "*.png")


def test_hostile_names_stay_in_the_folder_and_on_their_line(blend, tmp_path, capfd):
    scene = bpy.data.scenes["First"]
    for name in HOSTILE:
        camera = bpy.data.objects["Camera"].copy()
        camera.name = name
        scene.collection.objects.link(camera)
    bpy.data.objects["Cube"].name = HOSTILE[2]
    bpy.ops.wm.save_mainfile()
    folder, report = tmp_path / "out", tmp_path / "r.json"
    folder.mkdir()
    chosen = [ob.name for ob in scene.objects if ob.type == "CAMERA"]
    before = {path for path in tmp_path.rglob("*")}
    lines = run(capfd, render(blend, folder / "{camera_name}.png", "--camera", "all", "--report", report))
    written = {path for path in tmp_path.rglob("*")} - before - {report}
    assert len(written) == len(chosen) == len(HOSTILE) + 2
    assert {path.parent for path in written} == {folder}
    assert len([line for line in lines if re.fullmatch(r"progress \d+/11 frame 1 camera .* \d+%", line)]) == 11
    assert all(line.isprintable() for line in lines)
    assert {f["camera"] for f in json.loads(report.read_text())["frames"]} == set(chosen)
    assert cli.main(["plan", str(blend)]) == 0
    assert r"ray traced: a\nb\x1b[2J" in capfd.readouterr().out


def test_finished_frames_are_left_alone(blend, tmp_path, capfd):
    again = render(blend, tmp_path / "o##.png", "--animation", "--skip-existing", "--passes", tmp_path / "p",
                   "--report", tmp_path / "r.json")  # fmt: skip
    run(capfd, again)
    times = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.*") if path.suffix in {".png", ".exr"}}
    assert len(times) == 12
    (tmp_path / "p" / "mask_0002.exr").unlink()
    lines = run(capfd, again)
    redone = {path.name for path, when in times.items() if path.stat().st_mtime_ns != when}
    assert redone == {"o02.png", "raster_0002.exr", "mask_0002.exr", "traced_0002.exr"}
    assert [line for line in lines if "there already" in line] == [
        f"frame {n}: {tmp_path / f'o0{n}.png'} is there already" for n in (1, 3)
    ]
    assert lines[-1] == "progress 3/3 frame 3 camera Camera 100%"
    assert [f["frame"] for f in json.loads((tmp_path / "r.json").read_text())["frames"]] == [1, 2, 3]
    run(capfd, [word for word in again if word != "--skip-existing"])
    assert all(path.stat().st_mtime_ns != when for path, when in times.items())


def start(script, arguments):
    """A process of its own, which runs a line of Python before the command."""
    program = f"import sys, os, signal, time\nfrom hybrid_addon.blender import standalone\n{script}\nstandalone.main()"
    return subprocess.Popen(
        [sys.executable, "-c", program, *arguments],
        cwd=ROOT,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


KILL = """
replace = os.replace
def kill(source, target):
    if target.name == "o02.png":
        os.truncate(source, 50)  # as if only the first bytes had reached the disk
        os.kill(os.getpid(), signal.SIGKILL)
    replace(source, target)
os.replace = kill
"""


SLOW = """
from hybrid_addon.blender import api
render = api.render
api.render = lambda *given, **named: (time.sleep(0.3), render(*given, **named))[1]
"""


@pytest.mark.skipif(os.name == "nt", reason="kill -9")
def test_killed_in_the_middle_of_writing_it_goes_on_where_it_was(blend, tmp_path, capfd):
    arguments = render(blend, tmp_path / "o##.png", "--animation", "--skip-existing", "--report", tmp_path / "r.json")
    process = start(KILL, arguments)
    printed, _ = process.communicate(timeout=600)
    assert process.returncode == -signal.SIGKILL, printed
    assert names(tmp_path, "o*") == ["o01.png"]
    assert [f["frame"] for f in json.loads((tmp_path / "r.json").read_text())["frames"][:1] or [1]] == [1]
    (part,) = tmp_path.glob(".hybrid-*.part.png")
    assert len(list(tmp_path.glob(".hybrid-*.claim"))) == 1
    long_ago = time.time() - files.LITTER_AGE - 60
    os.utime(part, (long_ago, long_ago))
    files.sweep.cache_clear()
    lines = run(capfd, arguments)
    assert any("o01.png is there already" in line for line in lines)
    assert names(tmp_path) == ["batch.blend", "o01.png", "o02.png", "o03.png", "r.json"]
    for path in tmp_path.glob("*.png"):
        assert oiio.ImageInput.open(str(path)).read_image("uint8").shape[:2] == (16, 24)
    assert [f["frame"] for f in json.loads((tmp_path / "r.json").read_text())["frames"]] == [1, 2, 3]


def test_two_writers_share_the_frames(blend, tmp_path):
    """Each frame is rendered, and by one of them only."""
    arguments = render(blend, tmp_path / "o##.png", "--frames", "1-8", "--skip-existing")
    writers = [start(SLOW, arguments) for _ in range(2)]
    printed = [writer.communicate(timeout=600)[0] for writer in writers]
    assert [writer.returncode for writer in writers] == [0, 0], printed
    assert len(names(tmp_path, "o*.png")) == 8
    rendered = [re.findall(r"frame (\d+): \S+ \(", text) for text in printed]
    assert sorted(map(int, rendered[0] + rendered[1])) == list(range(1, 9))
    assert not list(tmp_path.glob(".hybrid-*"))


def test_a_lock_that_the_dead_left_is_no_claim(tmp_path):
    path = tmp_path / "o.png"
    with files.claim(path) as mine, files.claim(path) as yours, files.claim(tmp_path / "other.png") as other:
        assert (mine, yours, other) == (True, False, True)
        left = names(tmp_path, ".hybrid-*.claim")
        assert len(left) == 2
    assert names(tmp_path) == []
    for name in left:
        (tmp_path / name).touch()
    with files.claim(path) as mine:
        assert mine
    assert len(names(tmp_path)) == 1


def test_old_litter_is_swept_and_young_is_not(tmp_path, monkeypatch):
    """Parts beside the outputs, and scratch files in the temporary folders of Blenders that were killed."""
    session, other, elsewhere = tmp_path / "blender_me", tmp_path / "blender_other", tmp_path / "elsewhere"
    for folder in (session, other, elsewhere):
        folder.mkdir()
    (tmp_path / "blender_link").symlink_to(elsewhere)
    litter = [tmp_path / ".hybrid-0.part.png", other / "hybrid_x.exr", elsewhere / "hybrid_x.exr", other / "mine.exr"]
    for path in litter:
        path.touch()
        os.utime(path, (0, 0))
    young = tmp_path / ".hybrid-1.part.png"
    young.touch()
    files.sweep.cache_clear()
    files._sweep_sessions.cache_clear()
    monkeypatch.setattr(files, "bpy", type("bpy", (), {"app": type("app", (), {"tempdir": str(session)})}))
    with files.scratch() as name, files.atomic(tmp_path / "o.png") as part:
        assert Path(name).parent == session
        Path(part).touch()
    assert [path.exists() for path in litter] == [False, False, True, True]
    assert young.exists()
    assert names(session) == []


def test_outputs_that_fail_leave_no_part(tmp_path):
    with pytest.raises(RuntimeError), files.atomic(tmp_path / "o.png") as part:
        Path(part).touch()
        raise RuntimeError
    assert names(tmp_path) == []
