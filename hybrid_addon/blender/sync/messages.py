"""What the translator tells the artist: one short line each, naming the object, material or node."""

from __future__ import annotations

from collections.abc import Iterator

from ..errors import HybridError


class UnsupportedError(HybridError):
    """The scene cannot be rendered at all; the message is one line that says what is wrong and what to do."""


class Warnings:
    """Lines in the order in which they first came up, each kept once."""

    def __init__(self) -> None:
        self._lines: dict[str, None] = {}

    def add(self, line: str) -> None:
        """Keep `line` unless it is there already."""
        self._lines.setdefault(line)

    def __iter__(self) -> Iterator[str]:
        return iter(self._lines)
