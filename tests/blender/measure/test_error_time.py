# SPDX-License-Identifier: GPL-3.0-or-later
"""The `report` verb: what it writes and how it refuses; and the same file through Cycles. Mode full needs no EEVEE."""

from __future__ import annotations

import json
import warnings

import bpy
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import cli
from hybrid_addon.measure.error_time import tables
from tools import fronts

pytestmark = pytest.mark.blender


@pytest.fixture(scope="module")
def blend(addon, tmp_path_factory):
    """A mirror cube that stands over nothing, lit by a lamp."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.world.color = (0.2, 0.3, 0.4)
    bpy.ops.mesh.primitive_plane_add(size=8, location=(0, 0, -1))
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=0.5, opacity=1.0)
    path = tmp_path_factory.mktemp("report") / "cube.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture(scope="module")
def written(blend):
    """One run over few settings, with Cycles."""
    folder = blend.parent / "out"
    few = ["--samples", "1", "16", "--max-depth", "1", "2", "--cutoff", "0.01", "--adaptive", "0", "0.05"]
    quick = ["--resolution", "64x48", "--reference-samples", "512", "--repeats", "1", "--cycles", "1", "8"]
    assert cli.main(["report", str(blend), "--output", str(folder), "--mode", "full", *few, *quick]) == 0
    return folder


@pytest.fixture
def report(written):
    return json.loads((written / "report.json").read_text())


def test_points_hold_what_they_cost_and_how_wrong_they_are(report):
    assert report["schema"] == 3
    assert {p["preset"] for p in report["points"]} >= {"Draft", "Final", "Reference"}
    for point in report["points"]:
        assert set(point["error"]) == {"interior", "edges", "all"}
        assert point["time"]["trace"]["wall_med"] > 0
        assert not any(point["invariants"].values())
    by_samples = {p["settings"]["samples"]: p["error"]["all"]["rmse"] for p in report["points"] if p["alone"]}
    assert by_samples[16] < by_samples[1] / 2
    assert report["pareto"]
    fit = report["slopes"]["aa_all"]["fit"]
    assert fit < -0.4 if len(by_samples) > 2 else fit is None  # how many points there are hangs on the time they take


def test_a_table_of_presets_says_what_beats_each(report):
    lines = fronts.table({"cube": report}).splitlines()
    rows = {cells[2]: cells for cells in ([c.strip() for c in line.split("|")[1:-1]] for line in lines[4:])}
    assert set(rows) == {"Draft", "Final", "Reference"}
    for preset in report["presets"]:
        by = preset["by"]["rmse_shown"]
        point, beaten_by = report["points"][preset["point"]], by["beaten_by"]
        assert rows[preset["preset"]][4] == tables.cell(point["error"]["all"]["rmse_shown"])
        assert by["verdict"] in rows[preset["preset"]][6]
        assert (beaten_by is None) == ("(" not in rows[preset["preset"]][6])


def test_the_report_says_what_it_was_made_with_and_what_it_checked(report):
    assert report["version"][0].isdigit()
    assert report["host"]["cpu"]
    assert {p["name"] for p in report["plan"]} >= {"unlit", "any-hit", "adaptive"}
    applies = {p["name"]: p["applies"] for p in report["plan"]}
    assert applies["any-hit"]
    assert not applies["adaptive"]  # as in the picture that is shown, Final; the file has it on
    assert report["skipped"]
    assert report["invariants"]["nan_pixels"] == {"value": 0, "tol": 0, "pass": True}
    assert [p["preset"] for p in report["presets"]] == ["Draft", "Final", "Reference"]
    assert all(verdict["verdict"] for p in report["presets"] for verdict in p["by"].values())
    assert set(report["time"]) >= {"translate", "build"}
    assert set(report["minutes"]["spent"]) == {"reference", "knobs", "points", "cycles"}
    assert report["left_out"] == []


def test_cycles_draws_the_same_picture(report):
    """Inside the objects both references agree in the mean: materials, lights and falloff were carried over."""
    reference = report["cycles"]["reference"]
    inside = reference["difference"]["interior"]
    assert abs(inside["bias"]) < 0.1 * reference["mean"]["interior"]
    for errors in (reference["difference"], reference["floor"], *(p["error"] for p in report["cycles"]["points"])):
        assert set(errors) == {"interior", "edges", "all"}
        assert {"rmse", "relmse_tev", "p999", "max", "flip_ldr"} <= set(errors["edges"])
    assert reference["floor"]["interior"]["rmse"] < inside["rmse"]
    assert [p["samples"] for p in report["cycles"]["points"]] == [1, 8]
    errors = [p["error"]["all"]["rmse"] for p in report["cycles"]["points"]]
    assert errors[0] > errors[1] > 0
    assert all(e["ratio"] or e["why"] for e in report["cycles"]["equal_error"])


def test_the_page_stands_alone(written):
    page = (written / "report.html").read_text()
    assert "Error against run time: Scene" in page
    assert page.count("data:image/png;base64,") == 3
    assert "http://" not in page.replace("http://www.w3.org", "").replace("http://purl.org", "").replace(
        "http://creativecommons.org", ""
    )
    assert sorted(p.name for p in written.iterdir()) == ["report.html", "report.json"]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["no such.blend"], "no such.blend"),
        (["{blend}", "--samples", "0"], "between 1 and"),
        (["{blend}", "--mode", "raster"], "invalid choice"),
    ],
)
def test_bad_input_is_one_line(blend, tmp_path, capfd, more, words):
    arguments = [word.replace("{blend}", str(blend)) for word in more]
    assert cli.main(["report", *arguments, "--output", str(tmp_path / "out")]) == 2
    lines = [line for line in capfd.readouterr().err.splitlines() if line.startswith("hybrid: ")]
    assert len(lines) == 1
    assert words in lines[0]
    assert not (tmp_path / "out").exists()


def unmark():
    hybrid.unmark(bpy.data.objects["Cube"])


def remove_camera():
    bpy.data.objects.remove(bpy.data.objects["Camera"])


def through_a_lamp():
    bpy.context.scene.camera = bpy.data.objects["Light"]


def raster():
    bpy.context.scene.hybrid.mode = "RASTER"


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (unmark, "nothing is ray traced"),
        (remove_camera, "camera"),
        (through_a_lamp, "camera"),
        (raster, "nothing is ray traced"),
    ],
)
def test_nothing_to_trace_is_bad_input(blend, tmp_path, capfd, spoil, words):
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    spoil()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "plain.blend"))
    refused(tmp_path, capfd, words)


@pytest.mark.render
def test_an_object_out_of_view_is_bad_input(blend, tmp_path, capfd):
    """Only EEVEE's mask tells."""
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    bpy.data.objects["Cube"].location = (0, 0, 500)
    bpy.context.scene.eevee.taa_render_samples = 1
    bpy.context.scene.eevee.use_shadows = False  # most of the time of software OpenGL
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "plain.blend"))
    refused(tmp_path, capfd, "no ray traced object is in the picture")


def refused(tmp_path, capfd, words):
    """One line, exit code 2, and no folder that was made for nothing, except one that was there."""
    (tmp_path / "there").mkdir()
    arguments = ["report", str(tmp_path / "plain.blend"), "--resolution", "32x24", "--output"]
    assert cli.main([*arguments, str(tmp_path / "there" / "new" / "out")]) == 2
    lines = [line for line in capfd.readouterr().err.splitlines() if line.startswith("hybrid: ")]
    assert len(lines) == 1
    assert words in lines[0]
    assert list((tmp_path / "there").iterdir()) == []


@pytest.mark.parametrize("hide", [False, True])
def test_a_black_picture_has_a_page_and_no_warnings(blend, tmp_path, hide):
    """No light, and even nothing in sight: no error has a place on logarithmic axes."""
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    scene = bpy.context.scene
    scene.world = None
    for b_object in list(scene.objects):
        if b_object.type == "LIGHT":
            bpy.data.objects.remove(b_object)
        elif b_object.type == "MESH" and hide:
            b_object.location.z += 500
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "black.blend"))
    few = ["--samples", "1", "4", "--max-depth", "1", "--cutoff", "0.01", "--adaptive", "0", "--repeats", "1"]
    quick = ["--mode", "full", "--resolution", "32x24", "--reference-samples", "4", "--cycles"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert cli.main(["report", str(tmp_path / "black.blend"), "--output", str(tmp_path / "out"), *few, *quick]) == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["pareto"] == []
    assert report["pareto_why"]
    assert report["slopes"]["aa_all"]["why"]


@pytest.mark.render
def test_a_short_time_is_kept_and_what_it_leaves_out_is_said(blend, tmp_path, capfd):
    """Six seconds for settings that ask for much more: whatever fits is there, with its page."""
    many = ["--resolution", "320x240", "--samples", "1", "4096", "--minutes", "0.1", "--mode", "full", "--cycles"]
    assert cli.main(["report", str(blend), "--output", str(tmp_path / "out"), *many]) == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert any(entry["what"].startswith("samples 4096") for entry in report["left_out"])
    assert [p["preset"] for p in report["presets"]] == ["Draft", "Final", "Reference"]
    out, page = capfd.readouterr().out, (tmp_path / "out" / "report.html").read_text()
    assert "left out: " in out
    assert "left out: samples 4096" in page


def test_a_picture_is_called_what_it_is():
    """Where there was no time for Final another picture is shown, and says so."""
    from hybrid_addon.blender.measure.error_time import _chosen
    from hybrid_addon.measure.error_time.sweep import Point
    from hybrid_addon.presets import QUALITY

    draft, final = (Point(quality, label, film=label) for label, _, quality in list(QUALITY.values())[:2])
    deep = type("Deep", (), {"films": ("half", "half"), "quality": None})
    assert _chosen([draft, final], deep) == ("Final", "Final", final.quality)
    assert _chosen([draft], deep) == ("Draft (there was no time for Final)", "Draft", draft.quality)
    assert _chosen([], deep)[0].startswith("Half of the reference")
