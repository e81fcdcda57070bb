# SPDX-License-Identifier: GPL-3.0-or-later
"""Which frames, and what their files are called: text in, numbers and names out."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

FRAME_LIMIT = 1048574  # Blender's MAXFRAME
NAME_LIMIT = 100  # bytes of a name of the file's that go into a file name; most file systems allow 255 in all
_PART = re.compile(r"(-?\d+)(?:(?:-|\.\.)(-?\d+)(?:[x:](\d+))?)?")
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)  # devices on Windows


def parse(text: str) -> list[int]:
    """'1-10x2,15' -> [1, 3, 5, 7, 9, 15], in the order given, each once. Raises ValueError with a reason.

    `1..10` (Blender's -f) and `1-10:2` (Open Job Description) are read too.
    """
    found: dict[int, None] = {}
    for part in text.replace(" ", "").split(","):
        match = _PART.fullmatch(part)
        if not match:
            raise ValueError(f"'{part}' is no frame, no range 1-10 and no range with a step 1-10x2")
        first, step = int(match[1]), int(match[3] or 1)
        last = int(match[2]) if match[2] else first
        if max(abs(first), abs(last)) > FRAME_LIMIT:
            raise ValueError(f"'{part}' goes beyond frame {FRAME_LIMIT}")
        if last < first or step < 1:
            raise ValueError(f"'{part}' holds no frame: write first-last, and a step of 1 or more")
        found.update(dict.fromkeys(range(first, last + 1, step)))
    return list(found)


def file_path(path: Path, frame: int, names: Mapping[str, str], *, numbered: bool) -> Path:
    """One picture's path. In its name #### is the frame number and {camera_name} the camera's, as in Blender's own.

    names : what the file's name may say in braces. numbered : put the number before the extension where no # is.
    """
    hashes = re.search(r"#+", path.name)
    if hashes:
        name = path.name[: hashes.start()] + f"{frame:0{len(hashes.group())}d}" + path.name[hashes.end() :]
    else:
        name = f"{path.stem}{frame:04d}{path.suffix}" if numbered else path.name
    return path.with_name(re.sub(r"\{(\w+)\}", lambda m: safe(names[m[1]]) if m[1] in names else m[0], name))


def safe(name: str) -> str:
    """A name from an untrusted file as a part of a file name: no separators, no control characters, not too long."""
    plain = re.sub(r"[^\w\-. ]", "_", name).strip(". ").encode("utf-8", "ignore")[:NAME_LIMIT].decode("utf-8", "ignore")
    plain = plain.rstrip(". ")
    return f"_{plain}" if not plain or _RESERVED.fullmatch(plain) else plain
