# SPDX-License-Identifier: GPL-3.0-or-later
"""`hybrid plan`: what would be traced, what is left out, and why."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from ...memory import amount
from .. import api
from . import marks
from .common import Verbs, open_file, say

LARGEST = 3
"""Images that are named."""


def add(verbs: Verbs) -> None:
    """Add the verb to the parser."""
    plan = verbs.add_parser("plan", help="say what would be traced and what is left out; traces nothing")
    plan.set_defaults(verb=_plan)
    plan.add_argument("file", type=Path, metavar="FILE")
    marks.add(plan)
    plan.add_argument("--json", action="store_true", help="as JSON")


def _plan(arguments: argparse.Namespace) -> None:
    scene = open_file(arguments.file)
    marks.apply(scene, arguments)
    plan = api.plan(scene)
    for line in json.dumps(plan, indent=1).splitlines() if arguments.json else _lines(plan):
        say(line, prefix="")


def _applies(pruning: dict[str, Any]) -> str:
    return "applies" if pruning["applies"] else "does not apply"


def _memory(found: dict[str, Any]) -> str:
    """What a frame is expected to take, for the most part; and of that, which images are the largest."""
    expected, textures = found["expected"], list(found["by_texture"].items())[:LARGEST]
    parts = ", ".join(f"{name} {amount(size)}" for name, size in expected.items())
    named = f" ({', '.join(f'{name} {amount(size)}' for name, size in textures)})" if textures else ""
    free = "" if found["free"] is None else f"; {amount(found['free'])} are free"
    return f"memory: about {amount(sum(expected.values()))} if all pixels are traced: {parts}{named}{free}"


def _lines(plan: dict[str, Any]) -> list[str]:
    materials = [f"material {name}" for name in plan["ray_traced_materials"]]
    return [
        f"scene {plan['scene']}: mode {plan['mode'].lower()}" + (f" ({plan['why']})" if plan["why"] else ""),
        "ray traced: " + (", ".join([*plan["ray_traced"], *materials]) or "nothing"),
        "settings: " + ", ".join(f"{name} {value}" for name, value in plan["settings"].items()),
        "counts: " + ", ".join(f"{name} {value}" for name, value in plan["counts"].items()),
        _memory(plan["memory"]),
        *(f"left out: {item['what']}: {item['why']}" for item in plan["skipped"]),
        *(
            f"{_applies(item)}: {item['name']}: {item['leaves_out']} ({item['class']}): {item['when']}"
            for item in plan["prunings"]
        ),
        *(f"warning: {warning}" for warning in plan["warnings"]),
    ]
