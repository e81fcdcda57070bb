# SPDX-License-Identifier: GPL-3.0-or-later
"""`make first-picture`: the fifteen scenes, sheets of EEVEE | Hybrid | Cycles, and how far from Cycles the two are."""

from __future__ import annotations

import argparse
import json
import statistics
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import bpy
from bench.measure import host
from bench.table import Table
from leave import leave
from pages import blocks

import hybrid_addon as hybrid
from hybrid_addon.blender import cli

from . import ROOT, everyday, products
from .draw import BOUNCES, Drawing

SCENES: dict[str, Callable[[], None]] = {
    "window_pane": everyday.window_pane,
    "pool": everyday.pool,
    "wine_glass": everyday.wine,
    "chrome_logo": everyday.chrome_logo,
    "mirror": everyday.mirror,
    "spectacles": everyday.spectacles,
    "skin_beside_glass": products.skin_beside_glass,
    "car_paint": products.car_paint,
    "teapot": everyday.teapot,
    "frosted": products.frosted,
    "studio_balls": products.studio_balls,
    "bottle": products.bottle,
    "gems": products.gems,
    "hair_behind_glass": products.hair_behind_glass,
    "smoke_behind_glass": products.smoke_behind_glass,
}


def main() -> int:
    """Draw what is missing; after each scene, write what there is."""
    parser = argparse.ArgumentParser(prog="python -m tools.first_picture", description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=SCENES, metavar="NAME", help=f"some of: {', '.join(SCENES)}")
    parser.add_argument("--size", type=cli.resolution, default=(288, 216), metavar="WxH")
    parser.add_argument("--samples", type=int, metavar="N", help="of EEVEE and Hybrid (16, and Hybrid's default)")
    parser.add_argument("--cycles-samples", type=int, default=4096, metavar="N", help="of Cycles (4096)")
    parser.add_argument("--output", type=Path, default=ROOT / "build" / "first_picture", metavar="DIR")
    parser.add_argument(
        "--page", type=Path, metavar="FILE", help="Markdown whose section it replaces when all are drawn"
    )
    arguments = parser.parse_args()
    hybrid.register()
    for name in arguments.only or SCENES:
        drawing = Drawing(SCENES[name], arguments.size, arguments.samples, arguments.output / name)
        found = drawing.draw(arguments.cycles_samples)
        path = arguments.output / name / "figures.json"
        path.write_text(json.dumps(found, indent=1), encoding="utf-8")
        print(f"{name}: {path.with_name('sheet.png')}", flush=True)
        text = write(arguments.output)
        if arguments.page and all((arguments.output / each / "figures.json").exists() for each in SCENES):
            blocks.write(arguments.page, {"first-picture": f"Commit {blocks.revision()}.\n\n{text}"})
    print(arguments.output / "first_picture.md", flush=True)
    return 0


def write(folder: Path) -> str:
    """The table of all scenes that are there, as Markdown and as JSON; returns the Markdown."""
    paths = {name: folder / name / "figures.json" for name in SCENES}
    figures = {name: json.loads(path.read_text(encoding="utf-8")) for name, path in paths.items() if path.exists()}
    table = tabulated(figures)
    machine = host()
    about = ", ".join(f"{name} {value}" for name, value in machine.items())
    text = f"{table.markdown()}\n\n{about}.\n"
    (folder / "first_picture.md").write_text(text, encoding="utf-8")
    data = {"schema": 1, "host": machine, "scenes": figures}
    (folder / "first_picture.json").write_text(json.dumps(data, indent=1), encoding="utf-8")
    return text


def tabulated(figures: Mapping[str, Mapping[str, Any]]) -> Table:
    """One row for each scene, and their means."""
    columns = {
        "of the picture": "ray traced",
        "RMSE EEVEE": "eevee rmse",
        "RMSE Hybrid": "hybrid rmse",
        "of Cycles' noise": "noise",
        "FLIP EEVEE": "eevee flip",
        "FLIP Hybrid": "hybrid flip",
        "EEVEE s": "eevee wall",
        "cpu s": "eevee cpu",
        "Hybrid s": "hybrid wall",
        "cpu s ": "hybrid cpu",
        "Cycles s": "cycles wall",
        "cpu s  ": "cycles cpu",
        "Cycles samples": "cycles samples",
    }
    table = Table(
        "First pictures: the ray traced pixels against Cycles",
        ["", *columns],
        note="As the file's view transform shows it, over the pixels that ray traced objects cover by more than half. "
        f"Cycles: no denoiser, {BOUNCES} bounces, nothing clamped; its noise is half of the RMSE between the two "
        "halves of its samples. Seconds: wall and of all processors, one run each.",
    )
    for name, found in figures.items():
        table.rows.append([name.replace("_", " "), *(found[key] for key in columns.values())])
    values = [[found[key] for found in figures.values()] for key in columns.values()]
    table.rows.append(["mean", *(None if None in column else statistics.fmean(column) for column in values)])
    return table


if __name__ == "__main__":
    assert bpy.app.background
    leave(main())
