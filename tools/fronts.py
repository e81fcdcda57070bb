# SPDX-License-Identifier: GPL-3.0-or-later
"""`make fronts`: whether each preset is on the front of error against run time, in every sample scene.

python -m tools.fronts [SCENE ...] [--minutes N] [--resolution WxH] [--output DIR] [--page FILE]

Measures the scenes that are named (all five), one after the other in one process, with the presets and few settings
beside them, so that even the slowest preset has its time. Each report stays in DIR/SCENE; the table is of all that are
there, so a machine that has ten minutes at a time measures one scene at a time. `--minutes 0` measures nothing.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tools")]

import bpy  # noqa: E402
from leave import leave  # noqa: E402
from pages import blocks  # noqa: E402

import hybrid_addon as hybrid  # noqa: E402
from hybrid_addon.blender import cli  # noqa: E402
from hybrid_addon.blender.cli.common import open_file  # noqa: E402
from hybrid_addon.blender.measure import error_time  # noqa: E402
from hybrid_addon.measure.error_time import tables  # noqa: E402
from hybrid_addon.measure.error_time.findings import METRICS  # noqa: E402

SIZES = {
    "simple": (400, 300),
    "cornell_box": (320, 240),
    "intermediate": (160, 120),
    "complex": (320, 240),
    "studio": (64, 48),
}
"""Pixels at which 16 cores draw a reference, Reference and what else is compared in eight minutes: where glass stands
in glass, Reference takes a hundred times as long as Draft."""

AXES = error_time.Axes(samples=(4, 16, 64, 256), max_depth=(8, 32), cutoff=(1 / 255, 1 / 64))
"""Few, beside the presets: what is likely to beat them. The dearest cutoff is left to the reference."""


def main() -> int:
    """Measure, one report after the other, and print the table; 2 if something cannot be measured."""
    parser = argparse.ArgumentParser(prog="python -m tools.fronts", description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"some of: {', '.join(SIZES)} (all)")
    parser.add_argument("--minutes", type=float, default=8.0, metavar="N", help="for each scene (8)")
    parser.add_argument("--resolution", type=cli.resolution, metavar="WxH", help="instead of each scene's own")
    parser.add_argument("--output", type=Path, default=ROOT / "build" / "fronts", metavar="DIR")
    parser.add_argument("--page", type=Path, metavar="FILE", help="Markdown whose table of presets it replaces")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.scenes if name not in SIZES]
    if unknown:
        parser.error(f"no sample scene '{unknown[0]}': choose from {', '.join(SIZES)}")
    hybrid.register()
    for name in arguments.scenes or SIZES:
        if arguments.minutes <= 0:
            break
        folder = arguments.output / name
        folder.mkdir(parents=True, exist_ok=True)
        say(f"--- {name}")
        try:
            error_time.write(
                open_file(ROOT / "sample_scenes" / f"{name}.blend"), folder, AXES, mode=None,
                resolution=arguments.resolution or SIZES[name], minutes=arguments.minutes, cycles_samples=(), say=say,
            )  # fmt: skip
        except hybrid.HybridError as error:
            parser.error(f"{name}: {error}")
        say(table(reports(arguments.output)))
    found = reports(arguments.output)
    if not found:
        parser.error(f"no report in '{arguments.output}': measure a scene first")
    say(table(found))
    if arguments.page:
        blocks.write(arguments.page, {"presets": table(found)})
    return 0


def say(line: str) -> None:
    """Print at once: a run of minutes is watched."""
    print(line, flush=True)


def reports(folder: Path) -> dict[str, dict[str, Any]]:
    """Of each sample scene that was measured, its report.json."""
    paths = {name: folder / name / "report.json" for name in SIZES}
    return {name: json.loads(path.read_text(encoding="utf-8")) for name, path in paths.items() if path.exists()}


def table(found: Mapping[str, Mapping[str, Any]]) -> str:
    """Markdown: the machines, and a row for each scene and preset."""
    about = dict.fromkeys(
        f"{r['host']['cpu']}, {r['host']['cores']} cores, commit {r['commit']}" for r in found.values()
    )
    lines = [
        f"{'; '.join(about)}. Seconds of tracing.",
        "",
        "| Scene | Reference | Preset | Seconds | RMSE | FLIP | By RMSE | By FLIP |",
        "| --- | --- | --- | ---: | ---: | ---: | --- | --- |",
    ]
    for name, report in found.items():
        reference, size = report["reference"], "x".join(map(str, report["scene"]["resolution"]))
        depth = f"{size}, {reference['samples']} samples"
        for preset in report["presets"]:
            lines.append("| " + " | ".join([name, depth, *_row(report, preset)]) + " |")
    return "\n".join(lines)


def _row(report: Mapping[str, Any], preset: Mapping[str, Any]) -> Sequence[str]:
    """One preset's seconds, errors and verdicts, with what beats it."""
    if preset["point"] is None:
        return [preset["preset"], "", "", "", "no time", "no time"]
    point = report["points"][preset["point"]]
    error = point["error"]["all"]
    cells = [preset["preset"], tables.cell(point["time"]["trace"]["wall_med"])]
    cells += [tables.cell(error[metric]) for metric in METRICS]
    for metric in METRICS:
        found = preset["by"][metric]
        by = found["beaten_by"]
        cells.append(found["verdict"] + ("" if by is None else f" ({tables.name(report['points'][by])})"))
    return cells


if __name__ == "__main__":
    assert bpy.app.background
    leave(main())
