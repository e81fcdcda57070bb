# SPDX-License-Identifier: GPL-3.0-or-later
"""What the translator tells the artist: few short lines, naming the object, material or node.

All that is to be said of one material, or of one world, is one line, and so is what holds for several things alike: 11
missing images, or 200 objects without a UV map.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from ..errors import HybridError

QUOTED = re.compile(r"""(?<!\w)('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")(?!\w)""")
"""A name as repr() writes it; apostrophes within words are none."""
LISTED = 4
"""So many names of things alike are listed."""


class UnsupportedError(HybridError):
    """The scene cannot be rendered at all; the message is one line that says what is wrong and what to do."""


class Warnings:
    """Lines, the most important first, else in the order in which they first came up.

    Those that differ in names alone are one, with their number; so are those of one owner, as a list.
    """

    def __init__(self) -> None:
        self._told: dict[tuple[str, str], int] = {}  # (owner, text) -> rank

    def add(self, text: str, rank: int = 1, owner: str = "") -> None:
        """Keep `text` unless it is there already.

        rank  : the lower, the earlier it is told (`coverage.status`).
        owner : "material 'Glass'", of whose lines one is made; "": the text says whose it is.
        """
        self._told.setdefault((owner, text), rank)

    def each(self) -> Iterator[str]:
        """Every single line, in the order in which they came up."""
        return (f"{owner}: {text}" if owner else text for owner, text in self._told)

    def __iter__(self) -> Iterator[str]:
        by_rank = sorted(self._told, key=self._told.__getitem__)
        alike: dict[tuple[str, str], list[str]] = {}
        for owner, text in by_rank:
            alike.setdefault((owner, QUOTED.sub("''", text)), []).append(text)
        lines: dict[tuple[str, str], list[str]] = {}  # those of one owner together; of no owner each by itself
        for (owner, shape), texts in alike.items():
            lines.setdefault((owner, "" if owner else shape), []).append(_as_one(texts))
        for (owner, _), texts in lines.items():
            count = f", {len(texts)} things" if len(texts) > 1 else ""
            yield f"{owner}{count}: {'; '.join(texts)}" if owner else texts[0]


def _as_one(texts: list[str]) -> str:
    """The first of some texts that differ in names alone, with the names of the others."""
    if len(texts) == 1:
        return texts[0]
    names = [QUOTED.findall(text) for text in texts]
    differs = next(i for i, column in enumerate(zip(*names, strict=True)) if len(set(column)) > 1)
    others = list(dict.fromkeys(row[differs] for row in names[1:]))
    more = f" and {len(others) - LISTED} others" if len(others) > LISTED else ""
    return f"{texts[0]} ({len(texts)} such: {', '.join([names[0][differs], *others[:LISTED]])}{more})"
