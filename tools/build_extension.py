# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the extension's zips and validates each, with Blender's own tool (it lies inside the bpy wheel).

Run as ``python tools/build_extension.py`` for one zip for each platform of the manifest and each Python of official
Blenders, what a release consists of, or with ``--python 3.14`` for one zip for this machine and for a Blender that is
built on that version of Python.
"""

from __future__ import annotations

import argparse
import importlib.util
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import manual_pages
from fetch_wheels import ROOT, WHEELS, fetch, known_hashes, manifest_wheels

# This machine as Blender's manifests name it, and the end of the names of the wheels that run on it.
PLATFORMS = {
    ("Linux", "x86_64"): ("linux-x64", "x86_64"),
    ("Windows", "AMD64"): ("windows-x64", "win_amd64"),
    ("Darwin", "arm64"): ("macos-arm64", "arm64"),
    ("Darwin", "x86_64"): ("macos-x64", "x86_64"),
}
# Blender's Pythons: how a zip for it is named, and the first Blender that has it, and the first that has it no longer.
BLENDERS = {"cp311": ("blender4.5", "4.5.0", "5.1.0"), "cp313": ("blender5.1", "5.1.0", "")}
NOT_SOURCE = shutil.ignore_patterns(".*", "__pycache__", "wheels", "build", "dist", "demo", "*.zip")


def blender_ext(*arguments: str | Path) -> None:
    """Run Blender's extension tool; it says what is wrong itself."""
    spec = importlib.util.find_spec("bpy")
    if spec is None or spec.origin is None:
        raise SystemExit("the bpy module is not installed: run this with the Python of .venv")
    (tool,) = Path(spec.origin).parent.glob("[0-9]*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    if subprocess.run([sys.executable, tool, *arguments]).returncode:
        raise SystemExit(f"blender_ext.py {arguments[0]}: failed")


def build_release(output: Path) -> None:
    """One zip for each platform and each Python that an official Blender is built on: LLVM is too large to be carried
    for all of them."""
    fetch(manifest_wheels())
    for tag, (name, first, until) in BLENDERS.items():
        with tempfile.TemporaryDirectory(dir=output) as folder:
            wheels = [wheel for wheel in manifest_wheels() if f"-{tag}-" in wheel]
            changes = {"blender_version_min": f'"{first}"'}
            if until:
                changes["blender_version_max"] = f'"{until}"'
            _build(wheels, changes, Path(folder), "--split-platforms")
            for archive in Path(folder).glob("*.zip"):
                archive.replace(output / f"{archive.stem}-{name}.zip")


def build_for(version: str, output: Path) -> None:
    """One zip for this machine's platform and one version of Python."""
    name, wheels = _local_wheels(f"cp{version.replace('.', '')}")
    if not any(wheel.startswith("numba-") for wheel in wheels):
        print(f"numba has no wheel for Python {version} on {name}: this zip goes without, numpy does all the work")
    fetch(wheels)
    _build(wheels, {"platforms": f'["{name}"]'}, output)


def _build(wheels: list[str], changes: dict[str, str], output: Path, *options: str) -> None:
    """Build with these wheels only, and with other values of some fields of the manifest. Not below `output`: that may
    lie among the sources, and a copy of them would hold itself."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        shutil.copytree(ROOT, source, ignore=NOT_SOURCE)
        manual_pages.write(source / "hybrid_addon" / "manual")
        (source / "wheels").mkdir()
        for wheel in wheels:
            shutil.copy(WHEELS / wheel, source / "wheels")
        manifest = source / "blender_manifest.toml"
        text = manifest.read_text(encoding="utf-8")
        for field, value in {**changes, "wheels": str([f"./wheels/{wheel}" for wheel in wheels])}.items():
            known = re.compile(rf'^{field} = (\[.*?\]|".*?")', re.M | re.S)
            line = f"{field} = {value}"
            text = (
                known.sub(line, text) if known.search(text) else text.replace("\nplatforms", f"\n{line}\nplatforms", 1)
            )
        manifest.write_text(text, encoding="utf-8")
        blender_ext("build", "--source-dir", source, "--output-dir", output, *options)


def _local_wheels(tag: str) -> tuple[str, list[str]]:
    """This machine's platform and its wheels' file names for the Python with this tag (cp314): those without which
    nothing works, and of the others those on record."""
    machine = (platform.system(), platform.machine())
    if machine not in PLATFORMS:
        raise SystemExit(f"the extension has no wheels for {' '.join(machine)}")
    name, suffix = PLATFORMS[machine]
    kind = {"Linux": "manylinux", "Windows": "win", "Darwin": "macosx"}[machine[0]]
    listed = [w for w in manifest_wheels() if w.endswith(f"{suffix}.whl") and f"-{kind}" in w]
    wanted = sorted({re.sub(r"cp\d+", tag, wheel) for wheel in listed})
    return name, [wheel for wheel in wanted if wheel.startswith("embreex-") or wheel in known_hashes()]


def main() -> None:
    """Build into a folder of its own first, so that the output folder only ever holds whole, valid zips."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--python", metavar="VERSION", help="one zip, for this machine and this Python (3.14)")
    parser.add_argument("--output-dir", type=Path, default=ROOT / "dist")
    options = parser.parse_args()
    options.output_dir.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=options.output_dir, prefix=".") as folder:
        if options.python:
            build_for(options.python, Path(folder))
        else:
            build_release(Path(folder))
        for archive in sorted(Path(folder).glob("*.zip")):
            blender_ext("validate", archive)
            suffix = f"-py{options.python}" if options.python else ""
            final = options.output_dir / f"{archive.stem}{suffix}.zip"
            archive.replace(final)
            print(final)


if __name__ == "__main__":
    main()
