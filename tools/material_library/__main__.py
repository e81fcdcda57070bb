# SPDX-License-Identifier: GPL-3.0-or-later
"""Forty materials as artists build them: EEVEE, Hybrid at its defaults and Cycles; a table and contact sheets.

python -m tools.material_library [--only N ...] [--size 96] [--cycles-samples 128] [--output DIR]

EEVEE's and Cycles' pictures are kept until a material or the stage changes. --save writes the stages as .blend files.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy
from bench.table import Table
from leave import leave

import hybrid_addon as hybrid

from . import ROOT, pictures, stage


def main() -> int:
    """Draw all sheets or some; the table is of all that is there."""
    sheets = stage.groups()
    parser = argparse.ArgumentParser(prog="python -m tools.material_library", description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", type=int, choices=range(1, len(sheets) + 1), metavar="N", help="sheets")
    parser.add_argument("--size", type=int, default=96, help="pixels that each material is wide")
    parser.add_argument("--cycles-samples", type=int, default=128)
    parser.add_argument("--output", type=Path, default=ROOT / "build" / "materials" / bpy.app.version_string[:3])
    parser.add_argument("--save", action="store_true", help="save the stages as .blend files, and draw nothing")
    arguments = parser.parse_args()
    folder = arguments.output.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    hybrid.register()
    for number in arguments.only or range(1, len(sheets) + 1):
        stem = folder / f"sheet{number}"
        if arguments.save:
            scene, _ = stage.build(sheets[number - 1], arguments.size)
            scene.hybrid.enabled = True
            bpy.ops.wm.save_as_mainfile(filepath=str(stem.with_suffix(".blend")), compress=True)
            continue
        found = pictures.draw(sheets[number - 1], arguments.size, arguments.cycles_samples, stem)
        stem.with_suffix(".json").write_text(json.dumps(found, indent=1), encoding="utf-8")
        for name, figures in found.items():
            print(f"{name}: {len(figures['warnings'])} warnings", *figures["warnings"], sep="\n  ", flush=True)
    if not arguments.save:
        print(write(folder, len(sheets)))
    return 0


def write(folder: Path, sheets: int) -> str:
    """The table of all materials whose figures are in the folder, as Markdown; written to materials.md, too."""
    found: dict[str, Any] = {}
    for number in range(1, sheets + 1):
        path = folder / f"sheet{number}.json"
        found |= json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    text = tabulated(found).markdown()
    (folder / "materials.md").write_text(text + "\n", encoding="utf-8")
    return text


def tabulated(found: Mapping[str, Mapping[str, Any]]) -> Table:
    """One row for each material: against EEVEE, against Cycles, and these two against one another."""
    pairs = {"EEVEE": "eevee", "Cycles": "cycles", "both": "apart"}
    measures = ("light", "mean", "flip")
    clean = sum(not figures["warnings"] for figures in found.values())
    table = Table(
        f"Materials: {clean} of {len(found)} without a warning",
        ["", "warnings", *(f"{measure} {pair}" for pair in pairs for measure in measures)],
        note="Over the pixels that the thing covers: light over the other's less 1, mean difference over the other's "
        "mean, FLIP as the view transform shows them. *both*: EEVEE against Cycles.",
    )
    for name, figures in found.items():
        cells = [figures[key][measure] for key in pairs.values() for measure in measures]
        table.rows.append([name.replace("_", " "), len(figures["warnings"]), *cells])
    return table


if __name__ == "__main__":
    assert bpy.app.background
    leave(main())
