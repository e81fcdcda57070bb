# SPDX-License-Identifier: GPL-3.0-or-later
"""The notes of a release are its section of CHANGELOG, under headings that people know."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tools.release_notes import notes

ROOT = Path(__file__).resolve().parent.parent
CHANGES = "# Changes\n\n## 0.2.0 (unreleased)\n\n- b\n\n## [0.1.0] - 2026-12-01\n\n### Added\n\n- a\n"


def test_the_notes_of_one_version() -> None:
    assert notes(CHANGES, "0.1.0") == ("2026-12-01", "### Added\n\n- a\n")
    assert notes(CHANGES, "0.2.0") == ("unreleased", "- b\n")
    with pytest.raises(LookupError, match=r"0\.3\.0"):
        notes(CHANGES, "0.3.0")


def test_the_changelog_sorts_its_entries() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^### (.+)$", text, flags=re.M)) <= {"Added", "Changed", "Fixed", "Removed"}


def test_the_tool_prints_the_notes_of_the_manifests_version() -> None:
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
    command = [sys.executable, str(ROOT / "tools" / "release_notes.py"), "--draft"]
    printed = subprocess.run([*command, f"v{version}"], capture_output=True, text=True, check=True).stdout
    assert printed.startswith(notes((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), version)[1][:80])
    other = subprocess.run([*command, "99.0.0"], capture_output=True, text=True)
    assert other.returncode and "99.0.0" in other.stderr
