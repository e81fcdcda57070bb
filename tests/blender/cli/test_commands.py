# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: what it writes, and how it refuses. Mode full needs no EEVEE, so these are quick."""

from __future__ import annotations

import json
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
from hybrid_addon.blender.render import images
from hybrid_addon.presets import QUALITY

pytestmark = pytest.mark.blender
ROOT = Path(__file__).resolve().parents[3]


def save(path, change=lambda scene: None):
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.hybrid.samples = 32, 24, 1
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=0.5)
    change(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def blend(addon, tmp_path):
    return save(tmp_path / "scene é.blend")


def refuse(capfd, arguments, words):
    """Exit code 2, one line of ours, nothing written."""
    folder = Path(arguments[arguments.index("--output") + 1]).parent if "--output" in arguments else None
    before = sorted(folder.iterdir()) if folder and folder.is_dir() else []
    assert cli.main(arguments) == 2
    lines = [line for line in capfd.readouterr().err.splitlines() if line.startswith("hybrid: ")]
    assert len(lines) == 1, lines
    assert words in lines[0]
    assert (sorted(folder.iterdir()) if folder and folder.is_dir() else []) == before


def render(blend, output, *more, mode="full"):
    return ["render", str(blend), "--output", str(output), "--mode", mode, *more]


def test_render_writes_picture_report_and_passes(blend, tmp_path):
    before = blend.read_bytes()
    code = cli.main(
        render(blend, tmp_path / "o.exr", "--report", str(tmp_path / "r.json"), "--passes", str(tmp_path / "passes"))
    )
    assert code == 0
    assert blend.read_bytes() == before
    picture = next(iter(images.read_exr(tmp_path / "o.exr").values()))
    passes = {p.stem: next(iter(images.read_exr(p).values())) for p in (tmp_path / "passes").iterdir()}
    assert set(passes) == {"raster", "mask", "traced"}
    np.testing.assert_array_equal(picture, passes["raster"] + passes["traced"])
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["schema"] == 1
    assert report["resolution"] == [32, 24]
    assert report["rays"]["camera"] == 32 * 24


def test_png_and_resolution(blend, tmp_path):
    assert cli.main(render(blend, tmp_path / "o.png", "--resolution", "40x20", "--samples", "2")) == 0
    spec = oiio.ImageBuf(str(tmp_path / "o.png")).spec()
    assert (spec.width, spec.height, str(spec.format)) == (40, 20, "uint8")


def test_animation_numbers_its_frames(addon, tmp_path):
    blend = save(tmp_path / "a.blend", lambda scene: setattr(scene, "frame_end", 3))
    assert cli.main(render(blend, tmp_path / "shot_##.png", "--animation", "--report", str(tmp_path / "r.json"))) == 0
    assert sorted(p.name for p in tmp_path.glob("*.png")) == ["shot_01.png", "shot_02.png", "shot_03.png"]
    assert [f["frame"] for f in json.loads((tmp_path / "r.json").read_text())["frames"]] == [1, 2, 3]


def test_names_and_values_flag_other_objects(blend, tmp_path):
    def flag_both(scene):
        bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 3))
        bpy.context.object.name = "Ball"

    both = save(tmp_path / "both.blend", flag_both)
    passes = ["--passes", str(tmp_path)]
    assert cli.main(render(both, tmp_path / "a.exr", "--ray-traced", "Ball", "--reflectivity", "1", *passes)) == 0
    assert bpy.data.objects["Ball"].hybrid.reflectivity == 1.0
    assert not bpy.data.objects["Cube"].hybrid.ray_traced


def test_a_file_of_surface_programs_is_run_when_it_is_named(blend, tmp_path, capfd):
    path, broken = tmp_path / "mine.py", tmp_path / "broken.py"
    path.write_text("hybrid.programs.register('mine', lambda hits: hybrid.SurfaceAnswer(radiance=1.0))\n")
    broken.write_text("1 / 0\n")
    plan = ["plan", str(blend), "--surface"]
    refuse(capfd, [*plan, "Cube=mine"], "no surface program 'mine'")
    assert cli.main([*plan, "Cube=mine", "--surface-programs", str(path)]) == 0
    assert bpy.data.objects["Cube"].hybrid.program == "mine"
    hybrid.programs.forget("mine")
    refuse(capfd, [*plan, "Cube"], "write OBJECT=PROGRAM")
    refuse(capfd, [*plan, "Cubee=X-Ray"], "did you mean 'Cube'")
    refuse(capfd, [*plan, "Cube=X-Ray", "--surface-programs", str(broken)], "ZeroDivisionError: division by zero")


def test_a_word_that_is_given_twice_adds_to_itself(addon, tmp_path, capfd):
    """For plan as for render; and the values are there."""

    def add_ball(scene):
        bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 3))
        bpy.context.object.name = "Ball"
        hybrid.unmark(bpy.data.objects["Cube"])

    both = save(tmp_path / "both.blend", add_ball)
    assert cli.main(["plan", str(both), "--ray-traced", "Ball", "--ray-traced", "Cube", "--opacity", "0.5"]) == 0
    printed = capfd.readouterr().out
    assert "ray traced: Cube, Ball" in printed or "ray traced: Ball, Cube" in printed
    assert [ob.hybrid.opacity for ob in (bpy.data.objects["Ball"], bpy.data.objects["Cube"])] == [0.5, 0.5]
    words = ["--ray-traced", "Ball", "--reflectivity", "1"]
    assert cli.main(["advise", str(both), *words, "--json"]) == 0
    printed = capfd.readouterr().out
    advice = json.loads(printed[printed.index("{") :])
    assert [e["object"] for e in advice["objects"] if e["ray_traced"]] == ["Ball"]
    for verb in ("plan", "advise"):
        refuse(capfd, [verb, str(both), "--ray-traced", "Bal"], "did you mean 'Ball'")
        refuse(capfd, [verb, str(both), "--ior", "1.5"], "no object is ray traced")
    refuse(capfd, ["report", str(both), "--output", str(tmp_path / "r"), "--ray-traced", "Bal"], "did you mean 'Ball'")
    assert cli.main(["plan", str(both), "--ray-traced-materials", "Material", "--ior", "1.2"]) == 0
    assert "ray traced: material Material\n" in capfd.readouterr().out
    assert bpy.data.materials["Material"].hybrid.ior == pytest.approx(1.2)
    refuse(capfd, ["plan", str(both), "--ray-traced-materials", "Materiel"], "did you mean 'Material'")
    assert not (tmp_path / "r").exists()


def test_plan_names_what_is_traced_and_what_is_left_out(blend, capfd):
    assert cli.main(["plan", str(blend)]) == 0
    printed = capfd.readouterr().out
    assert "ray traced: Cube" in printed
    assert "left out: texture look-ups" in printed
    assert cli.main(["plan", str(blend), "--json"]) == 0
    printed = capfd.readouterr().out
    assert json.loads(printed[printed.index("{") :])["mode"] == "HYBRID"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["render"], "required"),
        (["paint", "x"], "paint"),
        (["render", "x.blend", "--output", "x.jpg"], ".png or .exr"),
        (["render", "x.blend", "--output", "x.png", "--opacity", "2"], "between 0 and 1"),
        (["render", "x.blend", "--output", "x.png", "--ior", "nan"], "between"),
        (["render", "x.blend", "--output", "x.png", "--resolution", "0x0"], "WIDTHxHEIGHT"),
        (["render", "no such.blend", "--output", "x.png"], "no such.blend"),
    ],
)
def test_usage_errors(addon, capfd, arguments, words):
    refuse(capfd, arguments, words)


def test_a_file_that_is_no_blend(addon, tmp_path, capfd):
    path = tmp_path / "fake.blend"
    path.write_bytes(b"this is not a blend file")
    refuse(capfd, render(path, tmp_path / "o.png"), "fake.blend")


def test_unknown_object(blend, tmp_path, capfd):
    refuse(capfd, render(blend, tmp_path / "o.png", "--ray-traced", "Cubee"), "did you mean 'Cube'")


def test_no_camera(addon, tmp_path, capfd):
    blend = save(tmp_path / "x.blend", lambda scene: setattr(scene, "camera", None))
    refuse(capfd, render(blend, tmp_path / "o.png"), "no camera")


def test_a_lamp_for_a_camera(addon, tmp_path, capfd):
    blend = save(tmp_path / "x.blend", lambda scene: setattr(scene, "camera", bpy.data.objects["Light"]))
    refuse(capfd, render(blend, tmp_path / "o.png"), "'Light', which is no camera")


def test_another_engine(addon, tmp_path, capfd):
    blend = save(tmp_path / "x.blend", lambda scene: setattr(scene.render, "engine", "BLENDER_WORKBENCH"))
    refuse(capfd, render(blend, tmp_path / "o.png"), "set Render Engine to EEVEE")


def test_unwritable_output(blend, tmp_path, capfd):
    refuse(capfd, render(blend, tmp_path / "nowhere" / "o.png"), "there is no such folder")


def test_values_without_a_flagged_object(addon, tmp_path, capfd):
    blend = save(tmp_path / "x.blend", lambda scene: hybrid.unmark(bpy.data.objects["Cube"]))
    refuse(capfd, render(blend, tmp_path / "o.png", "--opacity", "0"), "no object is ray traced")


def warnings_of(tmp_path, change):
    blend = save(tmp_path / "w.blend", change)
    assert cli.main(render(blend, tmp_path / "o.exr", "--report", str(tmp_path / "r.json"))) == 0
    report = json.loads((tmp_path / "r.json").read_text())
    picture = next(iter(images.read_exr(tmp_path / "o.exr").values()))
    assert np.isfinite(picture).all()
    return report["warnings"]


def test_a_missing_texture_is_named(addon, tmp_path):
    def change(scene):
        material = bpy.data.objects["Cube"].active_material
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.new("Gone", 4, 4)
        node.image.source, node.image.filepath = "FILE", "//gone.png"
        bsdf = material.node_tree.nodes["Principled BSDF"]
        material.node_tree.links.new(bsdf.inputs["Base Color"], node.outputs["Color"])

    assert any("Gone" in w and "gone.png" in w for w in warnings_of(tmp_path, change))


def test_a_mesh_with_nan_is_named_and_renders(addon, tmp_path):
    def change(scene):
        bpy.data.objects["Cube"].data.vertices[0].co.x = float("nan")

    assert any("Cube" in w for w in warnings_of(tmp_path, change))


def test_a_missing_library_is_named(addon, tmp_path):
    library = save(tmp_path / "library.blend", lambda scene: setattr(bpy.data.objects["Cube"], "name", "Linked Cube"))

    def change(scene):
        with bpy.data.libraries.load(str(library), link=True) as (_, into):
            into.objects = ["Linked Cube"]
        scene.collection.objects.link(into.objects[0])

    blend = save(tmp_path / "x.blend", change)
    library.unlink()
    assert cli.main(render(blend, tmp_path / "o.png", "--report", str(tmp_path / "r.json"))) == 0
    warnings = json.loads((tmp_path / "r.json").read_text())["warnings"]
    assert any("Linked Cube" in w and "library.blend" in w for w in warnings)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="EGL is Linux's road to OpenGL")
def test_without_opengl_hybrid_says_so_and_full_still_works(blend, tmp_path):
    """A process of its own: without a driver Blender itself would crash in the middle of the render."""
    environment = {k: v for k, v in os.environ.items() if k not in {"DISPLAY", "WAYLAND_DISPLAY"}}
    environment["__EGL_VENDOR_LIBRARY_FILENAMES"] = str(tmp_path / "no driver.json")

    def run(mode):
        command = [sys.executable, "-m", "hybrid_addon", *render(blend, tmp_path / f"{mode}.png", mode=mode)]
        return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=600)

    refused = run("hybrid")
    assert refused.returncode == 2
    (line,) = [line for line in refused.stderr.splitlines() if line.startswith("hybrid: ")]
    assert "libegl1" in line
    assert "mode full" in line
    assert not (tmp_path / "hybrid.png").exists()
    assert run("full").returncode == 0
    assert (tmp_path / "full.png").exists()


def test_plan_without_a_camera_is_one_line(addon, tmp_path, capfd):
    blend = save(tmp_path / "x.blend", lambda scene: setattr(scene, "camera", None))
    refuse(capfd, ["plan", str(blend)], "no camera")


def test_a_bare_name_goes_into_the_current_folder(blend, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(render(blend, "bare.png", "--report", "bare.json")) == 0
    assert (tmp_path / "bare.png").exists()
    assert (tmp_path / "bare.json").exists()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: hybrid.mark("Cube"), "'Cube' is neither an object nor a material"),
        (lambda: hybrid.enable(None), "None is not a scene"),
        (lambda: hybrid.render(mode="full", samples=0), "samples is 0"),
        (lambda: hybrid.render(mode="sketch"), "mode is 'SKETCH'"),
    ],
)
def test_the_api_refuses_in_one_line(blend, call, words):
    with pytest.raises(hybrid.HybridError, match=words):
        call()


def test_the_api_knows_no_other_settings(blend):
    with pytest.raises(TypeError, match=r"render\(\) has no setting 'sample'; did you mean 'samples'"):
        hybrid.render(mode="full", sample=1)


@pytest.mark.parametrize("words", [["--preset", "draft"], ["--preset", "final", "--samples", "5", "--adaptive", "0.1"]])
def test_a_preset_sets_the_quality_and_what_stands_beside_it_wins(blend, tmp_path, words):
    report = tmp_path / "r.json"
    assert cli.main(render(blend, tmp_path / "o.png", "--report", str(report), *words)) == 0
    settings = json.loads(report.read_text())["settings"]
    q = QUALITY[words[1].upper()][2].values()
    if "--samples" in words:
        q |= {"samples": 5, "adaptive": 0.1}
    assert {name: settings[name] for name in q} == pytest.approx(q)
    assert bpy.context.scene.hybrid.samples == 1  # the file's own


def test_the_panels_preset_is_the_commands(blend):
    bpy.ops.hybrid.quality_preset(preset="FINAL")
    held = {name: getattr(bpy.context.scene.hybrid, name) for name in QUALITY["FINAL"][2].values()}
    assert held == pytest.approx(QUALITY["FINAL"][2].values())


def test_a_time_budget_is_held_and_what_it_cost_is_said(blend, tmp_path):
    """A thousand times more samples than there is time for, on however busy a machine."""
    report = tmp_path / "r.json"
    words = ["--samples", "65536", "--time-budget", "0.5", "--resolution", "128x96", "--report", str(report)]
    assert cli.main(render(blend, tmp_path / "o.png", *words)) == 0
    told = json.loads(report.read_text())
    assert told["time"]["total"]["wall"] < 60  # all samples would take many minutes
    given_up = {entry["what"] for entry in told["skipped"] if "time budget" in entry["why"]}
    assert "samples" in given_up and given_up <= {"samples", "resolution"}  # a busy machine gives up more
    assert 0 < told["error"]["sampling"]["samples_mean"] < 65536


def test_a_time_budget_is_that_of_each_frame(blend, tmp_path):
    report = tmp_path / "r.json"
    words = ["--samples", "65536", "--time-budget", "0.3", "--frames", "1-3", "--report", str(report)]
    assert cli.main(render(blend, tmp_path / "o_####.png", *words, "--resolution", "128x96")) == 0
    frames = json.loads(report.read_text())["frames"]
    assert len(frames) == 3
    for told in frames:
        assert 0 < told["error"]["sampling"]["samples_mean"] < 65536
        assert any("time budget" in entry["why"] for entry in told["skipped"])


def test_a_budget_that_eevee_or_the_screen_exceeds_is_a_warning(blend, tmp_path):
    report = tmp_path / "r.json"
    words = ["--samples", "64", "--time-budget", "0.001", "--report", str(report)]
    assert cli.main(render(blend, tmp_path / "o.png", *words)) == 0
    told = json.loads(report.read_text())
    (line,) = (line for line in told["warnings"] if "Time Limit of 0.001 s" in line)
    assert "preparing the scene" in line and f"tracing {told['time']['trace']['wall']:.2f} s" in line
    assert (tmp_path / "o.png").is_file()
