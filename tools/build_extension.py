# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the extension's zips and validates each, with Blender's own tool (it lies inside the bpy wheel).

Run as ``python tools/build_extension.py`` for one zip per platform of the manifest, what a release consists of, or with
``--python 3.14`` for one zip for this machine and for a Blender that is built on that version of Python.
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

from fetch_wheels import ROOT, WHEELS, fetch, manifest_wheels

# This machine as Blender's manifests name it, and the end of the names of the wheels that run on it.
PLATFORMS = {
    ("Linux", "x86_64"): ("linux-x64", "x86_64"),
    ("Windows", "AMD64"): ("windows-x64", "win_amd64"),
    ("Darwin", "arm64"): ("macos-arm64", "arm64"),
    ("Darwin", "x86_64"): ("macos-x64", "x86_64"),
}
NOT_SOURCE = shutil.ignore_patterns(".*", "__pycache__", "wheels", "build", "dist", "demo")


def blender_ext(*arguments: str | Path) -> None:
    """Run Blender's extension tool; it says what is wrong itself."""
    spec = importlib.util.find_spec("bpy")
    if spec is None or spec.origin is None:
        raise SystemExit("the bpy module is not installed: run this with the Python of .venv")
    (tool,) = Path(spec.origin).parent.glob("[0-9]*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    if subprocess.run([sys.executable, tool, *arguments]).returncode:
        raise SystemExit(f"blender_ext.py {arguments[0]}: failed")


def build_release(output: Path) -> None:
    """One zip per platform, each with the wheels of every Python that an official Blender is built on."""
    fetch(manifest_wheels())
    blender_ext("build", "--source-dir", ROOT, "--output-dir", output, "--split-platforms")


def build_for(version: str, output: Path) -> None:
    """One zip for this machine's platform and one version of Python."""
    name, wheel = _local_wheel(f"cp{version.replace('.', '')}")
    fetch([wheel])
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        shutil.copytree(ROOT, source, ignore=NOT_SOURCE)
        (source / "wheels").mkdir()
        shutil.copy(WHEELS / wheel, source / "wheels")
        manifest = source / "blender_manifest.toml"
        text = manifest.read_text(encoding="utf-8")
        text = re.sub(r"^platforms = \[.*?\]", f'platforms = ["{name}"]', text, flags=re.M | re.S)
        text = re.sub(r"^wheels = \[.*?\]", f'wheels = ["./wheels/{wheel}"]', text, flags=re.M | re.S)
        manifest.write_text(text, encoding="utf-8")
        blender_ext("build", "--source-dir", source, "--output-dir", output)


def _local_wheel(tag: str) -> tuple[str, str]:
    """This machine's platform and its wheel's file name for the Python with this tag (cp314)."""
    machine = (platform.system(), platform.machine())
    if machine not in PLATFORMS:
        raise SystemExit(f"the extension has no wheels for {' '.join(machine)}")
    name, suffix = PLATFORMS[machine]
    kind = {"Linux": "manylinux", "Windows": "win", "Darwin": "macosx"}[machine[0]]
    listed = next(w for w in manifest_wheels() if w.endswith(f"{suffix}.whl") and f"-{kind}" in w)
    return name, re.sub(r"cp\d+", tag, listed)


def main() -> None:
    """Build into a folder of its own first, so that the output folder only ever holds whole, valid zips."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--python", metavar="VERSION", help="one zip, for this machine and this Python (3.14)")
    parser.add_argument("--output-dir", type=Path, default=ROOT / "dist")
    options = parser.parse_args()
    options.output_dir.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=options.output_dir) as folder:
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
