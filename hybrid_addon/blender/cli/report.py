# SPDX-License-Identifier: GPL-3.0-or-later
"""`hybrid report`: error against run time for one .blend."""

from __future__ import annotations

import argparse
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...settings_table import BY_NAME
from ..errors import HybridError
from . import marks, setting_flags
from .common import Verbs, check_outputs, number, open_file, resolution, say

CYCLES = (1, 4, 16, 64, 256)


def add(verbs: Verbs) -> None:
    """Add the verb to the parser."""
    report = verbs.add_parser("report", help="measure error against run time for this scene: one page, and JSON")
    report.set_defaults(verb=_report)
    report.add_argument("file", type=Path, metavar="FILE")
    report.add_argument("--output", type=Path, required=True, metavar="DIR", help="for report.html and report.json")
    report.add_argument("--mode", choices=("hybrid", "full"), help="default: the file's own")
    report.add_argument("--resolution", type=resolution, metavar="WxH", help="default: the file's, made smaller")
    setting_flags.add(report, [BY_NAME["threads"]])
    marks.add(report)
    several: dict[str, Any] = {"nargs": "+", "action": "extend"}
    value_of = setting_flags.value_of
    report.add_argument("--samples", **several, type=value_of("samples"), metavar="N", help="to measure")
    report.add_argument("--max-depth", **several, type=value_of("max_depth"), metavar="N", help="bounces to measure")
    report.add_argument("--cutoff", **several, type=value_of("cutoff"), metavar="X", help="to measure")
    report.add_argument("--adaptive", **several, type=value_of("adaptive"), metavar="X", help="to measure")
    report.add_argument(
        "--reference-samples",
        type=number(2, 65536, int),
        metavar="N",
        help="of what everything is compared with, however long they take (2048, or what there is time for)",
    )
    report.add_argument("--minutes", type=number(0.1, 10000), default=5.0, metavar="N", help="to measure in (5)")
    report.add_argument("--repeats", type=number(1, 100, int), metavar="N", help="timed runs of each setting")
    report.add_argument(
        "--cycles", nargs="*", action="extend", type=number(1, 65536, int), metavar="N",
        help=f"Cycles' samples to measure ({' '.join(map(str, CYCLES))}); none: leave Cycles out",
    )  # fmt: skip


def _report(arguments: argparse.Namespace) -> None:
    from ..measure import (
        error_time,  # it imports the tracer: a missing library must not keep Blender from loading the add-on
    )

    lists = ("samples", "max_depth", "cutoff", "adaptive")
    given = {name: tuple(dict.fromkeys(getattr(arguments, name) or ())) for name in lists}
    single = {name: getattr(arguments, name) for name in ("reference_samples", "repeats")}
    axes = error_time.Axes(**{name: value for name, value in {**given, **single}.items() if value})
    if arguments.reference_samples:
        axes = replace(axes, patient=True)
    if not arguments.file.is_file():
        raise HybridError(f"no file '{arguments.file}'")  # before a folder is made for it
    scene, folder = open_file(arguments.file), arguments.output
    marks.apply(scene, arguments)
    if arguments.threads is not None:
        scene.hybrid.threads = arguments.threads
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        check_outputs([], folder)
        written = error_time.write(
            scene, folder, axes, mode=arguments.mode, resolution=arguments.resolution, minutes=arguments.minutes,
            cycles_samples=CYCLES if arguments.cycles is None else arguments.cycles, say=say,
        )  # fmt: skip
    except BaseException:
        with suppress(OSError):  # the folders that were made for nothing, from the innermost
            for path in made:
                path.rmdir()
        raise
    say(f"{written} and report.json")
