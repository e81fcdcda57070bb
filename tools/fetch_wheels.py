# SPDX-License-Identifier: GPL-3.0-or-later
"""Fetches the wheels that the extension carries into wheels/, unmodified, and checks each against tools/wheels.sha256.

Run as ``python tools/fetch_wheels.py`` (every wheel of the manifest; what is there already is only checked) or with the
file names of single wheels.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WHEELS = ROOT / "wheels"


def manifest_wheels() -> list[str]:
    """File names of the wheels that the manifest lists."""
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    return [Path(wheel).name for wheel in manifest["wheels"]]


def known_hashes() -> dict[str, str]:
    """File name of each wheel on record -> its sha256."""
    lines = (ROOT / "tools" / "wheels.sha256").read_text(encoding="utf-8").split("\n")
    return {name: digest for digest, name in (line.split() for line in lines if line)}


def fetch(names: Iterable[str]) -> None:
    """Make sure that wheels/ holds these files, each with its known hash."""
    known = known_hashes()
    for name in names:
        path = WHEELS / name
        if not path.exists():
            _download(name)
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        if known.get(name) != digest:
            raise SystemExit(f"{path}: sha256 {digest} is not the one in tools/wheels.sha256")


def _download(name: str) -> None:
    """Let pip fetch the one wheel of this name: everything that it must ask for stands in the name."""
    distribution, version, python, abi, platforms = name.removesuffix(".whl").split("-")
    WHEELS.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=WHEELS) as folder:
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:", "--dest", folder]
        tags = ["--implementation", python[:2], "--python-version", f"{python[2]}.{python[3:]}", "--abi", abi]
        tags += [option for platform in platforms.split(".") for option in ("--platform", platform)]
        subprocess.run([*pip, *tags, f"{distribution}=={version}"], check=True)
        os.replace(Path(folder) / name, WHEELS / name)


if __name__ == "__main__":
    fetch(sys.argv[1:] or manifest_wheels())
