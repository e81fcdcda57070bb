# SPDX-License-Identifier: GPL-3.0-or-later
"""The stability table: every case passes under its own name, the page says so, and a broken tracer is caught."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from hybrid_addon.measure.stability import CASES, SITUATIONS, Case, Measured, Result, page, run, to_json
from hybrid_addon.tracer.core import rays
from hybrid_addon.tracer.geometry import flatten
from hybrid_addon.tracer.integrator import whitted
from hybrid_addon.tracer.media import nested

ROOT = Path(__file__).resolve().parents[2]
VERSIONS = {"blender": "5.2", "a<b": 'c"d&e'}
BLENDER_CASES = (
    "sensor-fit-and-shift",
    "nested-mirrored-collections",
    "frame-and-back",
    "edit-hide-show",
    "odd-scales",
)


@pytest.mark.once
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_case(case: Case) -> None:
    result = case.run()
    assert result.passed, f"{case.what}: {result.value:.3g} > {case.tolerance:g} {case.unit}; {result.detail}"


def test_every_situation_has_a_case_and_every_case_a_name_of_its_own() -> None:
    assert set(SITUATIONS) == set(range(1, len(SITUATIONS) + 1))
    assert {case.number for case in CASES} == set(SITUATIONS)
    names = Counter(case.name for case in CASES)
    assert max(names.values()) == 1
    assert all(name == name.lower() and " " not in name for name in names)
    assert all(case.what and case.answer and case.unit and case.tolerance >= 0 for case in CASES)


def test_the_page_lists_every_case_with_its_situation() -> None:
    text = (ROOT / "docs" / "stability.md").read_text(encoding="utf-8")
    listed = {row.split("`")[1]: row for row in text.splitlines() if row.startswith("| ") and "`" in row}
    assert {case.name for case in CASES} == listed.keys() - set(BLENDER_CASES)
    for case in CASES:
        assert listed[case.name].startswith(f"| {case.number}: {SITUATIONS[case.number]} | `{case.name}` | ")
        assert listed[case.name].endswith(f" | {case.tolerance:g} {case.unit} |")
    themes = {row.split(" | ")[0].removeprefix("| ") for row in text.splitlines() if row.startswith("| ")}
    assert {case.theme for case in CASES} <= themes


# ------------------------------------------------------------------------------------------------ a broken tracer


def without_offset(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rays, "ORIGIN_OFFSET", 0.0)


def without_recentring(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flatten, "_center", lambda *_: np.zeros(3))


def without_the_mask_of_bad_rays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(whitted, "traceable", lambda origin, _: np.ones(origin.shape[1], bool))


def without_the_case_of_ior_one(monkeypatch: pytest.MonkeyPatch) -> None:
    eta = nested.Media.eta
    monkeypatch.setattr(nested.Media, "eta", lambda *arguments: np.nextafter(eta(*arguments), 2))


@pytest.mark.once
@pytest.mark.parametrize(
    ("mutation", "caught_by"),
    [
        (without_offset, "no-self-shadow-at-any-scale"),
        (without_recentring, "move-exactly"),
        (without_the_mask_of_bad_rays, "rays-that-are-none"),
        (without_the_case_of_ior_one, "matched-index-vanishes"),
    ],
)
def test_a_broken_tracer_is_caught(monkeypatch: pytest.MonkeyPatch, mutation, caught_by: str) -> None:
    case = next(case for case in CASES if case.name == caught_by)
    mutation(monkeypatch)
    assert not case.run().passed


@pytest.mark.parametrize("value", [2.0, float("nan"), float("inf")])
def test_what_is_not_within_the_tolerance_fails(value: float) -> None:
    case = replace(CASES[0], measure=lambda: Measured(value), tolerance=1.0)
    assert not case.run().passed
    assert replace(case, measure=lambda: Measured(1.0)).run().passed


def test_a_case_that_raises_has_failed_and_says_why() -> None:
    result = replace(CASES[0], measure=lambda: 1 / 0).run()
    assert not result.passed and np.isnan(result.value)
    assert result.detail == "ZeroDivisionError: division by zero"


# ------------------------------------------------------------------------------------------------ page and JSON


def invented() -> list[tuple[Case, Result]]:
    """Results of all cases without running them: every seventh failed, some with pictures, one with odd text."""
    picture = np.linspace(0, 1.5, 6 * 8 * 3, dtype=np.float32).reshape(6, 8, 3)
    results = []
    for number, case in enumerate(CASES):
        failed = number % 7 == 3
        value = (np.nan if number % 2 else 2 * case.tolerance + 1) if failed else case.tolerance / 2
        shown = picture if number % 5 == 0 else None
        result = Result(value, not failed, '<script>alert("&")</script>' if number == 0 else "", shown, 0.25)
        results.append((case, result))
    return results


class Outline(HTMLParser):
    """Checks that tags are balanced; collects ids, headings, pictures and everything that a browser would fetch."""

    VOID = ("meta", "br", "img", "col", "line", "circle", "link")

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.tags: Counter[str] = Counter()
        self.sources: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.tags[tag] += 1
        for name, value in attrs:
            if name == "id":
                self.ids.append(value)
            if name in ("src", "href", "data"):
                self.sources.append(value)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag


def test_the_page_is_well_formed_shows_every_case_and_fetches_nothing() -> None:
    results = invented()
    html = page.render(results, VERSIONS)
    outline = Outline()
    outline.feed(html)
    outline.close()
    assert outline.open == []
    assert set(outline.ids) >= {case.name for case, _ in results}
    assert len(outline.ids) == len(set(outline.ids))
    assert outline.tags["script"] == outline.tags["link"] == 0
    assert outline.tags["img"] == sum(result.picture is not None for _, result in results)
    assert all(source.startswith(("#", "data:image/png;base64,")) for source in outline.sources)
    assert all(source[1:] in outline.ids for source in outline.sources if source.startswith("#"))
    assert "&lt;script&gt;" in html and "c&quot;d&amp;e" in html and "@import" not in html and "url(" not in html
    assert page.summary(results) in html


def test_the_json_is_plain_and_complete() -> None:
    results = invented()
    table = json.loads(json.dumps(to_json(results, VERSIONS), allow_nan=False))
    assert [entry["name"] for entry in table["results"]] == [case.name for case in CASES]
    assert table["passed"] == sum(entry["passed"] for entry in table["results"]) < table["cases"] == len(CASES)
    assert {entry["number"] for entry in table["results"]} == set(SITUATIONS)
    assert any(entry["value"] is None for entry in table["results"])


def test_pictures_are_png_files_the_right_way_up(tmp_path: Path) -> None:
    oiio = pytest.importorskip("OpenImageIO")
    picture = np.zeros((5, 4, 3), np.float32)
    picture[0, 1] = 1, 0.5, np.nan
    (tmp_path / "p.png").write_bytes(page.png(picture))
    pixels = oiio.ImageBuf(str(tmp_path / "p.png")).get_pixels(oiio.UINT8)
    assert pixels.shape == (5, 4, 3)
    np.testing.assert_array_equal(pixels[4, 1], [255, 188, 0])
    assert np.count_nonzero(pixels) == 2


def test_a_line_for_the_terminal() -> None:
    case, result = next(run([next(case for case in CASES if case.name == "matched-index-reflects-nothing")]))
    line = page.line(case, result)
    assert line.startswith("pass   6  matched-index-reflects-nothing ") and "(tolerance 0)" in line


# ------------------------------------------------------------------------------------------------ the command

needs_blender = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="needs the bpy module")


def command(*arguments: str, before: str = "") -> subprocess.CompletedProcess[str]:
    """`python -m hybrid_addon stability ...`; `before` is run first."""
    script = f"import sys; {before}\nsys.argv[1:] = {['stability', *arguments]!r}\nimport hybrid_addon.__main__"
    return subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=600)


@pytest.fixture(scope="module")
def through_blender(tmp_path_factory) -> tuple[subprocess.CompletedProcess[str], Path]:
    folder = tmp_path_factory.mktemp("stability") / "new folder"
    theme = "Through Blender: cameras, instances, edits"
    return command("--output", str(folder), "--only", theme, "impossible-index"), folder


@pytest.mark.blender
@needs_blender
@pytest.mark.parametrize("name", BLENDER_CASES)
def test_blender_case(through_blender, name: str) -> None:
    _, folder = through_blender
    entry = next(e for e in json.loads((folder / "stability.json").read_text())["results"] if e["name"] == name)
    assert entry["passed"], entry


@pytest.mark.blender
@needs_blender
def test_the_command_writes_page_and_json(through_blender) -> None:
    process, folder = through_blender
    assert process.returncode == 0, process.stderr
    assert sorted(p.name for p in folder.iterdir()) == ["stability.html", "stability.json"]
    table = json.loads((folder / "stability.json").read_text())
    assert {entry["name"] for entry in table["results"]} == {*BLENDER_CASES, "impossible-index"}
    assert set(table["versions"]) >= {"blender", "embree", "python", "numpy"}
    lines = [line for line in process.stdout.splitlines() if line.startswith(("pass ", "FAIL "))]
    assert len(lines) == table["cases"] == 6
    assert "6 of 6 cases pass" in process.stdout


@pytest.mark.blender
@needs_blender
def test_the_command_refuses_a_case_that_is_not_there(tmp_path: Path) -> None:
    process = command("--output", str(tmp_path / "new"), "--only", "impossible-indx")
    assert process.returncode == 2
    lines = [line for line in process.stderr.splitlines() if line.startswith("hybrid: ")]
    assert lines == ["hybrid: error: no case 'impossible-indx'; did you mean 'impossible-index'?"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.blender
@needs_blender
def test_the_command_fails_if_a_case_does(tmp_path: Path) -> None:
    broken = "from hybrid_addon.tracer.core import rays; rays.ORIGIN_OFFSET = 0.0"
    process = command("--output", str(tmp_path), "--only", "no-self-shadow-at-any-scale", before=broken)
    assert process.returncode == 1
    assert "hybrid: failed: 1 case is not within its tolerance" in process.stderr
    assert json.loads((tmp_path / "stability.json").read_text())["passed"] == 0
