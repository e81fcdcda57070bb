# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of docs/stability.md, from what the verb `stability` has measured.

``make stability`` runs both; by hand: ``python -m tools.pages.stability build/stability/stability.json``. The tables
hold no measured values, so they change only with the cases.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from . import blocks

PAGE = blocks.ROOT / "docs" / "stability.md"


def stability_blocks(measured: Mapping[str, Any]) -> dict[str, str]:
    """The blocks of the page, from the content of stability.json."""
    results: Sequence[Mapping[str, Any]] = measured["results"]
    themes = list(dict.fromkeys(result["theme"] for result in results))
    rows = [(theme, [result for result in results if result["theme"] == theme]) for theme in themes]
    lines = ["| Theme | Situations | Cases | Pass | with tolerance 0 |", "| --- | --- | ---: | ---: | ---: |"]
    lines += [_theme(theme, found) for theme, found in rows]
    lines += [_theme("**All**", results, situations=f"{len({result['number'] for result in results})} of them")]
    cases = ["| Situation | Case | Measured | Right answer | Tolerance |", "| --- | --- | --- | --- | ---: |"]
    cases += [
        f"| {r['number']}: {r['situation']} | `{r['name']}` | {_cell(r['what'])} | {_cell(r['answer'])} "
        f"| {r['tolerance']:g} {r['unit']} |"
        for r in results
    ]
    return {"themes": "\n".join(lines), "cases": "\n".join(cases)}


def _theme(title: str, results: Sequence[Mapping[str, Any]], situations: str = "") -> str:
    numbers = situations or ", ".join(map(str, sorted({result["number"] for result in results})))
    passed = [result for result in results if result["passed"]]
    exact = sum(result["tolerance"] == 0 for result in passed)
    return f"| {title} | {numbers} | {len(results)} | {len(passed)} | {exact} |"


def _cell(text: str) -> str:
    """Text without the sign that ends a cell."""
    return text.replace("|", "\\|").replace("<", "&lt;")


if __name__ == "__main__":
    blocks.write(PAGE, stability_blocks(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))))
