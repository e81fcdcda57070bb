# SPDX-License-Identifier: GPL-3.0-or-later
"""The words in which the tables of this folder speak: what becomes of each setting, and how the artist is told."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase as fnmatch
from typing import Any

FIRST, USUAL, LAST = 0, 1, 2
"""Ranks of warnings: the whole picture, or a whole object; one surface or light; what is hard to see."""


@dataclass(frozen=True)
class Followed:
    """The traced half follows it."""


@dataclass(frozen=True)
class Named:
    """It changes EEVEE's picture (or Cycles'), and the traced half does not follow: a warning names it.

    says    : the rest of the line after the setting's own name: what is done instead, and what helps.
    neutral : the value at which it changes nothing; None: nothing linked, or no pointer.
    matters : of the datablock or `nodes.Node` that has it, whether it counts beside the other values.
    rank    : of its warning.   label : how the line calls it, if not as the interface does.
    """

    says: str
    neutral: Any = None
    matters: Callable[[Any], bool] = lambda owner: True
    rank: int = USUAL
    label: str = ""


@dataclass(frozen=True)
class Within:
    """It counts only where something else is named, and that line says it all. of: what, as the table calls it."""

    of: str


@dataclass(frozen=True)
class Irrelevant:
    """It changes no rendered picture of EEVEE's, or nothing that the traced half could get wrong. why: the reason."""

    why: str


Status = Followed | Named | Within | Irrelevant
Table = dict[str, Status]

FOLLOWED = Followed()


def each(names: str, status: Status) -> Table:
    """The same of several, their names between commas or in lines."""
    return dict.fromkeys(_split(names), status)


def nodes(names: str, table: Table) -> dict[str, Table]:
    """The same table for several nodes, of which the names are given without "ShaderNode"."""
    return {f"ShaderNode{name}": table for name in _split(names)}


def _split(names: str) -> list[str]:
    return [name.strip() for name in names.split(",")]


def followed(names: str) -> Table:
    """These are followed."""
    return each(names, FOLLOWED)


def irrelevant(why: str, names: str) -> Table:
    """These are irrelevant, all for one reason."""
    return each(names, Irrelevant(why))


def within(of: str, names: str) -> Table:
    """These are named by the line of another."""
    return each(names, Within(of))


def status_of(table: Table, name: str) -> Status | None:
    """Of one setting: under its own name, or under one with a star that fits; None: the table does not know it."""
    if name in table:
        return table[name]
    return next((status for pattern, status in table.items() if "*" in pattern and fnmatch(name, pattern)), None)


def named(table: Table) -> Iterator[tuple[str, Named]]:
    """What a table names."""
    return ((name, status) for name, status in table.items() if isinstance(status, Named))
