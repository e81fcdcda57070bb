# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of Markdown pages that a program writes: what lies between ``<!-- table: NAME -->`` and ``<!-- end: NAME -->``.

The text around them is written by hand and stays.
"""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def fill(page: str, blocks: Mapping[str, str]) -> str:
    """The page with these blocks, by name, in place of what it had there.

    Raises LookupError for a block that the page has no place for.
    """
    for name, body in blocks.items():
        begin, end = f"<!-- table: {name} -->", f"<!-- end: {name} -->"
        before, found, rest = page.partition(begin)
        _, closed, after = rest.partition(end)
        if not (found and closed):
            raise LookupError(f"the page has no place for '{name}': {begin} {end}")
        page = f"{before}{begin}\n\n{body.strip()}\n\n{end}{after}"
    return page


def write(path: Path, blocks: Mapping[str, str]) -> None:
    """Fill the blocks of a file."""
    path.write_text(fill(path.read_text(encoding="utf-8"), blocks), encoding="utf-8")


def revision() -> str:
    """The commit of the working tree, for figures to be marked with; "" outside of a repository."""
    command = ["git", "-C", str(ROOT), "describe", "--always", "--dirty", "--tags"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
