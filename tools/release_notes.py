# SPDX-License-Identifier: GPL-3.0-or-later
"""Print the notes of one version from CHANGELOG.md: ``python tools/release_notes.py v0.1.0``.

Ends with an error if the manifest has another version, or if CHANGELOG has no dated section for it (``--draft`` takes
one that says "unreleased"). Needs the standard library only.
"""

from __future__ import annotations

import argparse
import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def notes(changelog: str, version: str) -> tuple[str, str]:
    """What stands beside the version in its heading ("2026-12-01"), and the text below it.

    Raises LookupError if there is no such heading.
    """
    parts = re.split(r"^## +(\S+) *(.*)$", changelog, flags=re.M)[1:]
    for number, beside, text in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
        if number.strip("[]") == version:
            return beside.strip(" -()"), text.strip() + "\n"
    raise LookupError(f"CHANGELOG.md has no section '## {version}'")


def main() -> None:
    """Print the notes, or say in one line why there are none."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("version", help="as 0.1.0 or v0.1.0")
    parser.add_argument("--draft", action="store_true", help="take a section that has no date yet")
    options = parser.parse_args()
    version = options.version.removeprefix("v")
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
    if version != manifest:
        raise SystemExit(f"blender_manifest.toml has version {manifest}, not {version}")
    try:
        beside, text = notes((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), version)
    except LookupError as error:
        raise SystemExit(str(error)) from None
    if not (options.draft or re.fullmatch(r"\d{4}-\d\d-\d\d", beside)):
        raise SystemExit(f"CHANGELOG.md: the heading of {version} needs its date, as in '## {version} - 2026-12-01'")
    print(text, end="")


if __name__ == "__main__":
    main()
