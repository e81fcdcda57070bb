# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/followed.md: what the traced half follows of Blender, as the tables of sync/coverage have it.

.venv/bin/python -m tools.followed        writes it; tests/blender/sync/test_coverage.py compares
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from hybrid_addon.blender.sync.coverage import (
    NODE_SETTINGS,
    OBJECT_TYPES,
    PROBE_TYPES,
    PROPERTIES,
    SOCKETS,
    Followed,
    Irrelevant,
    Named,
    Table,
    Within,
)

PAGE = Path(__file__).resolve().parents[1] / "docs" / "followed.md"

HEAD = """# What is followed, what is named, what does not matter

Every setting of Blender that a picture of EEVEE's may depend on, by its name in Python: *followed* by the ray tracer,
or *named* in a warning where it is not at its neutral value and counts, or neither, with the reason. Made from the
tables in `hybrid_addon/blender/sync/coverage` by `python -m tools.followed`; a test walks through all that the running
Blender has.
"""


def page() -> str:
    """The whole page."""
    parts = [HEAD, "## Settings\n", *_sections(PROPERTIES)]
    parts += ["## Objects of other kinds\n", *(f"- {kind}: {says}" for kind, says in OBJECT_TYPES.items())]
    parts += [*(f"- light probe, {kind}: {says}" for kind, says in PROBE_TYPES.items()), ""]
    parts += ["## Inputs of nodes\n", *_sections(SOCKETS)]
    parts += ["## Settings of nodes\n", "All others are followed.\n", *_sections(NODE_SETTINGS)]
    return "\n".join(parts).rstrip() + "\n"


def _sections(tables: dict[str, Table]) -> Iterator[str]:
    """One for each table; those that say the same are one."""
    alike: dict[tuple[str, ...], list[str]] = {}
    for kind, table in tables.items():
        alike.setdefault(tuple(_lines(table)), []).append(kind.removeprefix("ShaderNode"))
    for lines, kinds in alike.items():
        yield f"**{', '.join(kinds)}**\n"
        yield "\n".join(lines or ("- no inputs",)) + "\n"


def _lines(table: Table) -> Iterator[str]:
    simple = [name for name, status in table.items() if isinstance(status, Followed)]
    if simple:
        yield f"- followed: {', '.join(simple)}"
    for name, status in table.items():
        if isinstance(status, Named):
            covered = [n for n, other in table.items() if isinstance(other, Within) and other.of == name]
            also = f" (and with it {', '.join(covered)})" if covered else ""
            yield f"- named: {name or 'the whole node'}{also}: {status.says}"
    elsewhere: dict[str, list[str]] = {}
    for name, status in table.items():
        if isinstance(status, Irrelevant):
            elsewhere.setdefault(status.why, []).append(name)
        elif isinstance(status, Within) and not isinstance(table.get(status.of), Named):
            elsewhere.setdefault(f"of {status.of}, which is named", []).append(name)
    for why, names in elsewhere.items():
        yield f"- not needed, {why}: {', '.join(names)}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
