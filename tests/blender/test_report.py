"""The `report` verb: what it writes and how it refuses; and the same file through Cycles. Mode full needs no EEVEE."""

from __future__ import annotations

import json

import bpy
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import cli

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
    assert report["schema"] == 1
    assert {p["preset"] for p in report["points"]} >= {"Draft", "Final", "Reference"}
    for point in report["points"]:
        assert set(point["error"]) == {"interior", "edges", "all"}
        assert point["time"]["trace"]["wall_med"] > 0
        assert not any(point["invariants"].values())
    by_samples = {p["settings"]["samples"]: p["error"]["all"]["rmse"] for p in report["points"] if p["alone"]}
    assert by_samples[16] < by_samples[1] / 2
    assert report["pareto"]
    assert report["slopes"]["aa_all"]["fit"] < -0.4


def test_cycles_draws_the_same_picture(report):
    """Inside the objects both references agree in the mean: materials, lights and falloff were carried over."""
    reference = report["cycles"]["reference"]
    assert abs(reference["difference"]["bias"]) < 0.1 * reference["mean"]
    assert [p["samples"] for p in report["cycles"]["points"]] == [1, 8]
    errors = [p["rmse"] for p in report["cycles"]["points"]]
    assert errors[0] > errors[1] > 0


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


def test_nothing_to_trace_is_bad_input(blend, tmp_path, capfd):
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    hybrid.unmark(bpy.data.objects["Cube"])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "plain.blend"))
    assert cli.main(["report", str(tmp_path / "plain.blend"), "--output", str(tmp_path / "out")]) == 2
    assert "nothing is ray traced" in capfd.readouterr().err
