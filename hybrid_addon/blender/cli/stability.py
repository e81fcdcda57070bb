# SPDX-License-Identifier: GPL-3.0-or-later
"""`hybrid stability`: the table of extreme cases."""

from __future__ import annotations

import argparse
from pathlib import Path

from .common import Verbs, check_outputs, say


def add(verbs: Verbs) -> None:
    """Add the verb to the parser."""
    table = verbs.add_parser("stability", help="run the stiff and extreme cases: value, tolerance, pass")
    table.set_defaults(verb=_stability)
    table.add_argument(
        "--output", type=Path, required=True, metavar="DIR", help="for stability.html and stability.json"
    )
    table.add_argument(
        "--only", nargs="+", action="extend", default=[], metavar="NAME", help="these cases or themes only"
    )


def _stability(arguments: argparse.Namespace) -> None:
    from ..measure import (
        stability,  # it imports the tracer: a missing library must not keep Blender from loading the add-on
    )

    stability.choose(arguments.only)  # a name that is not there: found out before a folder is made
    check_outputs([], arguments.output)
    failed = stability.write(arguments.output, arguments.only, lambda text: say(text, prefix=""))
    if failed:
        some = "1 case is not within its" if failed == 1 else f"{failed} cases are not within their"
        raise RuntimeError(f"{some} tolerance")
