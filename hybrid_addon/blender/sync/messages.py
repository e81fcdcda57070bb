# SPDX-License-Identifier: GPL-3.0-or-later
"""What the translator tells the artist: one short line each, naming the object, material or node."""

from __future__ import annotations

from collections.abc import Iterator

from ..errors import HybridError


class UnsupportedError(HybridError):
    """The scene cannot be rendered at all; the message is one line that says what is wrong and what to do."""


class Warnings:
    """Lines, each kept once: the most important first, else in the order in which they first came up."""

    def __init__(self) -> None:
        self._lines: dict[str, int] = {}

    def add(self, line: str, rank: int = 1) -> None:
        """Keep `line` unless it is there already. rank: the lower, the earlier it is told (`coverage.status`)."""
        self._lines.setdefault(line, rank)

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(self._lines, key=self._lines.__getitem__))
