# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of balls of docs/reference/parity.md: prints it, and writes it there once both Blenders have drawn it.

python -m tools.ball_table [--only WORDS] [--page]

EEVEE's and Cycles' pictures, and the figures of each version of Blender, are kept in build/balls. --only draws those
balls in whose label WORDS are, and keeps and writes nothing.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import bpy
from leave import leave
from pages import blocks

import hybrid_addon

from . import ROOT, pictures, rows, stage

FOLDER = ROOT / "build" / "balls"
PAGE = ROOT / "docs" / "reference" / "parity.md"
VERSIONS = ("4.5", "5.2")


def main() -> int:
    """Draw, print, keep; 1 if a ball is off without a reason."""
    parser = argparse.ArgumentParser(prog="python -m tools.ball_table", description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", metavar="WORDS", help="the balls in whose label they are")
    parser.add_argument("--page", action="store_true", help="write the table into docs/reference/parity.md")
    arguments = parser.parse_args()
    hybrid_addon.register()
    version = bpy.app.version_string[:3]
    keep = None if arguments.only else FOLDER / version
    scene = stage.build(lambda label, value: arguments.only in f"{label} {value}")
    found = pictures.compared(*scene, keep=keep)
    for row in found:
        if arguments.only or row.nearer > pictures.WITHIN:
            said = "warned of" if row.warned else rows.WHY.get(row.label, "")
            print(f"{row.label} {row.value}: EEVEE {row.eevee:.1%}, Cycles {row.cycles:.1%} {said}")
    if keep is not None:
        kept = [{"label": r.label, "value": str(r.value), **_figures(r)} for r in found]
        (FOLDER / f"{version}.json").write_text(json.dumps(kept, indent=1), encoding="utf-8")
        known = {v: json.loads(_path(v).read_text(encoding="utf-8")) for v in VERSIONS if _path(v).exists()}
        print(text := written(known))
        if arguments.page:
            blocks.write(PAGE, {"balls": text})
    return int(not all(row.explained for row in found))


def _path(version: str) -> Path:
    return FOLDER / f"{version}.json"


def _figures(row: pictures.Row) -> dict[str, Any]:
    return {"eevee": row.eevee, "cycles": row.cycles, "warned": row.warned}


def written(known: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """The table as Markdown: of each label the value that is furthest from the nearer of the two, in any version."""
    counts = [
        f"{version}: {sum(_nearer(ball) <= pictures.WITHIN for ball in balls)} of {len(balls)} within "
        f"{pictures.WITHIN:.0%}"
        for version, balls in known.items()
    ]
    head = ["", *(f"{version}, {engine}" for version in known for engine in ("EEVEE", "Cycles")), "at", ""]
    lines = ["; ".join(counts) + ".", "", "| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for label in dict.fromkeys(ball["label"] for balls in known.values() for ball in balls):
        of_label = {v: {b["value"]: b for b in balls if b["label"] == label} for v, balls in known.items()}
        everywhere = [ball for balls in of_label.values() for ball in balls.values()]
        worst = max(everywhere, key=_nearer)
        same = [of_label[version].get(worst["value"]) for version in known]
        shares = [f"{ball[engine]:.1%}" if ball else "" for ball in same for engine in ("eevee", "cycles")]
        off = _nearer(worst) > pictures.WITHIN
        said = "" if not off else "warned of" if worst["warned"] else rows.WHY.get(label, "")
        lines.append("| " + " | ".join([label, *shares, worst["value"].replace("None", ""), said]) + " |")
    return "\n".join(lines)


def _nearer(ball: Mapping[str, Any]) -> float:
    return min(ball["eevee"], ball["cycles"])


if __name__ == "__main__":
    assert bpy.app.background
    leave(main())
