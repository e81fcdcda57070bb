# SPDX-License-Identifier: GPL-3.0-or-later
"""What a part returns, and how it is shown: Markdown for people, a plain dict for machines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

Cell = str | int | float | None


@dataclass(frozen=True)
class Goal:
    """A number that has to be reached: at most `limit`, or at least."""

    what: str
    value: float
    limit: float
    at_least: bool = False

    @property
    def reached(self) -> bool:
        """Whether it is."""
        return self.value >= self.limit if self.at_least else self.value <= self.limit


@dataclass
class Table:
    """One table, with the goals that can be read from it and what must be known to read it."""

    title: str
    columns: Sequence[str]
    rows: list[Sequence[Cell]] = field(default_factory=list)
    note: str = ""
    goals: list[Goal] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        goals = [{**asdict(goal), "reached": goal.reached} for goal in self.goals]
        return {**asdict(self), "goals": goals}

    def markdown(self) -> str:
        """Title, table, note and goals."""
        lines = [f"### {self.title}", ""]
        lines.append("| " + " | ".join(self.columns) + " |")
        lines.append("| --- |" + " ---: |" * (len(self.columns) - 1))
        lines += ["| " + " | ".join(map(show, row)) + " |" for row in self.rows]
        lines += ["", self.note] if self.note else []
        lines += [""] if self.goals else []
        for goal in self.goals:
            mark = "reached" if goal.reached else "**missed**"
            lines.append(
                f"* {goal.what}: {show(goal.value)} ({'at least' if goal.at_least else 'at most'} "
                f"{show(goal.limit)}: {mark})"
            )
        return "\n".join(lines)


def show(cell: Cell) -> str:
    """Three significant digits."""
    if cell is None:
        return "-"
    if isinstance(cell, float):
        return f"{cell:,.0f}" if abs(cell) >= 1000 else f"{cell:.3g}"
    return f"{cell:,}" if isinstance(cell, int) else cell


def markdown(
    host: Mapping[str, Any], parts: Mapping[str, Sequence[Table]], command: str, missing: Sequence[str]
) -> str:
    """The whole page."""
    machine = ", ".join(f"{name} {value}" for name, value in host.items())
    lines = ["## Benchmarks", "", f"    {command}", "", f"{machine}.", ""]
    lines += ["Medians of runs in turn; times are wall seconds.", ""]
    lines += [f"* **NOT MEASURED**: {line}" for line in missing] + ([""] if missing else [])
    for tables in parts.values():
        for table in tables:
            lines += [table.markdown(), ""]
    return "\n".join(lines)
