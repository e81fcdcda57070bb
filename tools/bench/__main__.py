# SPDX-License-Identifier: GPL-3.0-or-later
"""The command: which parts, for how long, and where the tables go."""

from __future__ import annotations

import argparse
import json
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tools")]

import bpy  # noqa: E402
from leave import leave  # noqa: E402
from pages import blocks  # noqa: E402

import hybrid_addon  # noqa: E402
from hybrid_addon.tracer.kernels import loading  # noqa: E402

from . import (  # noqa: E402
    cycles,
    equal_error,
    instances,
    kernels,
    povray,
    preview,
    prunings,
    scaling,
    slope,
    speed,
    thesis,
)  # fmt: skip
from .measure import Bench, host  # noqa: E402
from .table import Table, markdown  # noqa: E402

PARTS: dict[str, Callable[[Bench], list[Table]]] = {
    "thesis": thesis.thesis,
    "hybrid": thesis.hybrid,
    "preview": preview.preview,
    "kernels": kernels.kernels,
    "rays": speed.rays,
    "threads": speed.threads,
    "tiles": speed.tiles,
    "cycles": cycles.against_cycles,
    "equal-error": equal_error.equal_error,
    "povray": povray.against_povray,
    "coverage": scaling.coverage,
    "prunings": prunings.prunings,
    "slope": slope.slope,
    "triangles": scaling.triangles,
    "lights": scaling.lights,
    "depth": scaling.depth,
    "resolution": scaling.resolution,
    "instances": instances.instances,
}


def main() -> int:
    """Run the parts; after each, write what there is."""
    parser = argparse.ArgumentParser(prog="python -m tools.bench", description="What it costs, side by side.")
    parser.add_argument("--only", nargs="+", choices=PARTS, metavar="PART", help=f"some of: {', '.join(PARTS)}")
    parser.add_argument("--quick", action="store_true", help="small pictures, few points: does everything run?")
    parser.add_argument("--repeats", type=int, default=5, metavar="N", help="counted runs of each (5)")
    parser.add_argument("--patience", type=float, metavar="S", help="seconds for the runs of one comparison (60)")
    parser.add_argument("--limit", type=float, default=float("inf"), metavar="S", help="seconds for everything")
    parser.add_argument("--output", type=Path, default=ROOT / "build" / "bench", metavar="DIR")
    parser.add_argument("--page", type=Path, metavar="FILE", help="Markdown whose sections of these parts it replaces")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    hybrid_addon.register()
    loading.load()  # else the first parts would be timed with fewer of them than the last
    patience = arguments.patience or (5.0 if arguments.quick else 60.0)
    began = time.perf_counter()
    bench = Bench(arguments.quick, arguments.repeats, patience, began + arguments.limit, say)
    machine = {"opengl": _renderer(), **host(), "kernels": loading.line()}
    tables: dict[str, list[Table]] = {}
    missing: list[str] = []
    for name in arguments.only or PARTS:
        if bench.left <= 0:
            missing.append(f"{name}: the time limit was reached")
            continue
        say(f"--- {name} ({PARTS[name].__doc__})")
        try:
            tables[name] = PARTS[name](bench)
            for table in tables[name]:
                table.goals = [] if bench.quick else table.goals  # they are for pictures of full size
        except RuntimeError as error:  # something that this machine does not have
            missing.append(f"{name}: {error}")
        except Exception as error:
            traceback.print_exc()
            missing.append(f"{name}: it failed: {error}")
        for line in missing[-1:] if name not in tables else [table.markdown() for table in tables[name]]:
            say(line)
        write(arguments.output, machine, tables, missing)
    write(arguments.output, machine, tables, missing)
    if arguments.page and not arguments.quick:
        about = ", ".join(f"{name} {value}" for name, value in {"commit": blocks.revision(), **machine}.items())
        sections = {name: "\n\n".join([f"{about}.", *(t.markdown() for t in found)]) for name, found in tables.items()}
        blocks.write(arguments.page, sections)
    for line in missing:
        say(f"NOT MEASURED: {line}")
    say(f"{time.perf_counter() - began:.0f} s: {arguments.output / 'bench.md'} and bench.json")
    return 0


def say(line: str) -> None:
    """Print at once: a run of half an hour is watched."""
    print(line, flush=True)


def write(folder: Path, machine: dict[str, object], tables: dict[str, list[Table]], missing: list[str]) -> None:
    """Both files, as far as it got."""
    command = "python -m tools.bench " + " ".join(sys.argv[1:])
    page = markdown(machine, tables, command.strip(), missing)
    parts = {name: [table.as_dict() for table in found] for name, found in tables.items()}
    data = {"schema": 1, "command": command.strip(), "host": machine, "parts": parts, "missing": missing}
    (folder / "bench.md").write_text(page, encoding="utf-8")
    (folder / "bench.json").write_text(json.dumps(data, indent=1), encoding="utf-8")


def _renderer() -> str:
    """What draws for EEVEE. Asked after a small render: before it there is no OpenGL in the background."""
    from hybrid_addon.blender.pipeline import opengl

    if opengl.missing():
        return f"none: {opengl.missing()}"
    import gpu

    try:
        gpu.init()
        return str(gpu.platform.renderer_get())
    except (AttributeError, SystemError, RuntimeError):
        return "unknown"


if __name__ == "__main__":
    assert bpy.app.background
    leave(main())
