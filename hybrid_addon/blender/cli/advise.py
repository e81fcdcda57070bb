# SPDX-License-Identifier: GPL-3.0-or-later
"""`hybrid advise`: which objects need rays, why, and what that would cost."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from ...report.advice import sentence
from .. import api
from . import marks
from .common import Verbs, open_file, say


def add(verbs: Verbs) -> None:
    """Add the verb to the parser."""
    advise = verbs.add_parser("advise", help="say which objects need rays, why, and what they would cost")
    advise.set_defaults(verb=_advise)
    advise.add_argument("file", type=Path, metavar="FILE")
    marks.add(advise)
    advise.add_argument("--json", action="store_true", help="as JSON")


def _advise(arguments: argparse.Namespace) -> None:
    scene = open_file(arguments.file)
    marks.apply(scene, arguments)
    advice = api.advise(scene)
    for line in json.dumps(advice, indent=1).splitlines() if arguments.json else _lines(advice):
        say(line, prefix="")


def _lines(advice: dict[str, Any]) -> list[str]:
    lines = [("ray traced  " if e["ray_traced"] else "suggested   ") + sentence(e) for e in advice["objects"]]
    total = sum(entry["seconds"] for entry in advice["objects"]) + advice["shadows"]
    shadows = f" ({advice['shadows']:.2g} s of them for their shadows)" if advice["shadows"] else ""
    return [
        f"scene {advice['scene']}: " + (advice["basis"] if lines else "nothing here that EEVEE cannot draw"),
        *lines,
        *([f"all of them: about {total:.2g} s{shadows}, and {advice['build']:.2g} s to build"] if lines else []),
        *(f"note: {note}" for note in advice["notes"]),
        *(f"warning: {warning}" for warning in advice["warnings"]),
    ]
