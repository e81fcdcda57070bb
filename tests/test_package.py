# SPDX-License-Identifier: GPL-3.0-or-later
"""The zip that users install: what is in it, what Blender's own validator says, and that it leaves nothing behind."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
MANIFEST = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
TOP = {"blender_manifest.toml", "__init__.py", "LICENSE"}
SUFFIXES = {".py", ".html", ".npy", ".typed", ".blend", ".txt"}


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The zip for this machine and this Python, built and validated by Blender's own tool."""
    pytest.importorskip("bpy", reason="Blender's extension tool comes with bpy")
    output = tmp_path_factory.mktemp("dist")
    version = "{}.{}".format(*sys.version_info)
    command = [sys.executable, ROOT / "tools" / "build_extension.py", "--python", version, "--output-dir", output]
    process = subprocess.run(command, capture_output=True, text=True)
    assert process.returncode == 0, process.stdout + process.stderr
    assert "Success parsing TOML" in process.stdout
    (built,) = output.glob("*.zip")
    return built


@pytest.fixture(scope="module")
def life(archive: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What happened while the zip was installed, used and removed in a fresh Blender."""
    folder = tmp_path_factory.mktemp("life")
    (folder / "user").mkdir()
    report = folder / "report.json"
    command = [sys.executable, ROOT / "tests" / "package_driver.py", archive, report]
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(folder / "user")}
    process = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder, timeout=600)
    assert process.returncode == 0, process.stdout + process.stderr
    assert "Traceback" not in process.stderr, process.stderr
    return json.loads(report.read_text(encoding="utf-8"))


def test_zips_may_be_built_among_the_sources(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The copy that a zip is made of holds neither itself, nor the zips that are there already."""
    monkeypatch.syspath_prepend(ROOT / "tools")
    import build_extension as tool

    def blender_ext(command: str, *arguments: Any) -> None:
        if command == "build":
            source, output = Path(arguments[1]), Path(arguments[3])
            seen.extend(sorted(path.relative_to(source).as_posix() for path in source.rglob("*")))
            (output / "new.zip").touch()

    seen: list[str] = []
    zips = tmp_path / "zips"
    zips.mkdir()
    (zips / "old.zip").touch()
    (tmp_path / "blender_manifest.toml").write_text('platforms = ["a"]\nwheels = ["b"]\n')
    for name, fake in {
        "ROOT": tmp_path, "blender_ext": blender_ext, "fetch": list, "_local_wheels": lambda tag: ("linux-x64", []),
    }.items():  # fmt: skip
        monkeypatch.setattr(tool, name, fake)
    monkeypatch.setattr(tool.manual_pages, "write", lambda target: None)
    monkeypatch.setattr(sys, "argv", ["build_extension.py", "--python", "3.13", "--output-dir", str(zips)])
    tool.main()
    assert seen == ["blender_manifest.toml", "wheels", "zips"]
    assert sorted(path.name for path in zips.iterdir()) == ["new-py3.13.zip", "old.zip"]


def differences(before: Any, after: Any, path: str = "") -> list[str]:
    """Where two JSON values differ, leaf by leaf."""
    if isinstance(before, dict) and isinstance(after, dict) and before.keys() == after.keys():
        return [line for key in before for line in differences(before[key], after[key], f"{path}/{key}")]
    if isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        pairs = enumerate(zip(before, after, strict=True))
        return [line for i, (old, new) in pairs for line in differences(old, new, f"{path}/{i}")]
    if isinstance(before, list) and isinstance(after, list):
        before, after = [x for x in before if x not in after], [x for x in after if x not in before]
        return [f"{path}: gone {before}, new {after}"]
    return [] if before == after else [f"{path}: {before} -> {after}"]


@pytest.mark.blender
def test_the_zip_holds_the_product_and_nothing_else(archive: Path) -> None:
    names = set(zipfile.ZipFile(archive).namelist())
    package = {path.relative_to(ROOT).as_posix() for path in (ROOT / "hybrid_addon").rglob("*") if path.is_file()}
    package = {name for name in package if Path(name).suffix in SUFFIXES}
    wheels = {name for name in names if name.startswith("wheels/") and name.endswith(".whl")}
    tag = "cp{}{}".format(*sys.version_info)
    assert sorted(name.split("/")[1].split("-")[0] for name in wheels) == ["embreex", "llvmlite", "numba"]
    assert {name.split("-")[2] for name in wheels} == {tag}
    manual = {name for name in names if name.startswith("hybrid_addon/manual/")}
    assert {"hybrid_addon/manual/manual/settings.html", "hybrid_addon/manual/panels.png"} < manual
    assert names == TOP | package | wheels | manual


@pytest.mark.blender
def test_wheels_in_the_zip_are_those_from_the_index(archive: Path) -> None:
    """Stored, not repacked: its bytes are those whose hash is on record."""
    import hashlib

    known = dict(reversed(line.split()) for line in (ROOT / "tools" / "wheels.sha256").read_text().splitlines())
    with zipfile.ZipFile(archive) as content:
        for wheel in (name for name in content.namelist() if name.endswith(".whl")):
            assert hashlib.sha256(content.read(wheel)).hexdigest() == known[Path(wheel).name]


def test_every_platform_has_a_wheel_for_each_python_of_blender() -> None:
    """4.5 LTS is Python 3.11, 5.2 LTS is 3.13; every listed wheel has its hash on record."""
    wheels = [Path(wheel).name for wheel in MANIFEST["wheels"]]
    kinds = {"-manylinux": 3, "-win_amd64": 3, "_arm64": 3, "macosx_13_0_x86_64": 1}  # the last: without numba
    for kind, libraries in kinds.items():
        named = [name.split("-") for name in wheels if kind in name]
        assert len(named) == 2 * libraries == 2 * len({parts[0] for parts in named})
        assert {parts[2] for parts in named} == {"cp311", "cp313"}
    recorded = {line.split()[1] for line in (ROOT / "tools" / "wheels.sha256").read_text().splitlines()}
    assert set(wheels) <= recorded
    requirements = (ROOT / "tools" / "requirements.txt").read_text()
    for name in ("embreex", "numba"):
        (version,) = {wheel.split("-")[1] for wheel in wheels if wheel.startswith(f"{name}-")}
        assert f"{name}=={version}\n" in requirements, f"tests must run the {name} that ships"


def test_the_changelog_knows_the_version() -> None:
    assert f"\n## {MANIFEST['version']}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


@pytest.mark.blender
def test_the_extension_installs_and_works(life: dict[str, Any]) -> None:
    assert life["enabled"]
    assert life["used"]["ray_traced"] and life["used"]["enabled"]
    assert life["used"]["reflectivity"] == 1.0
    assert len(life["wheel"]) == 1, "the zip brings its own Embree"


@pytest.mark.blender
def test_blender_finds_no_policy_violation(life: dict[str, Any]) -> None:
    assert life["warnings"] == {}


@pytest.mark.blender
def test_removing_it_leaves_no_trace(life: dict[str, Any]) -> None:
    """Although it was removed from under a scene that was set up for hybrid rendering."""
    layers = life["before"]["scenes"][0]["view layers"]
    assert life["used"]["layers"] > len(layers), "nothing was set up, so nothing was tested"
    assert differences(life["before"], life["after"]) == []
    assert life["left"] == []


def test_the_door_opens_for_a_package_only() -> None:
    """In a folder with a dot in its name pytest loads it as a file of no package, and asks it for names."""
    door: dict[str, Any] = {"__name__": "", "__package__": ""}
    exec((ROOT / "__init__.py").read_text(encoding="utf-8"), door)
    with pytest.raises(AttributeError):
        door["__getattr__"]("pytest_plugins")


def test_every_file_names_its_licence() -> None:
    tops = ("hybrid_addon", "tools", "tests", "sample_scenes")
    files = [ROOT / "__init__.py", *(path for top in tops for path in (ROOT / top).rglob("*.py"))]
    line = "# SPDX-License-Identifier: GPL-3.0-or-later\n"
    assert not [path for path in files if not path.read_text(encoding="utf-8").startswith(line)]
