# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory over instances: what a trace of many instances of one mesh takes, each in a process of its own."""

from __future__ import annotations

import subprocess
import sys

import instance_memory

from .measure import ROOT, Bench
from .table import Goal, Table

MOST = 150.0  # MB that 1000 instances of 5120 triangles may take


def instances(bench: Bench) -> list[Table]:
    """Memory and time of a thousand and of a million instances, kept once and flattened."""
    table = Table(
        "Memory over instances",
        ["instances", "MB", "processor s"],
        note="What the process grew by while it traced 64x64 pixels, one sample: search trees included, numba and what "
        "a small trace takes are not.",
    )
    for name in instance_memory.FIELDS:
        if bench.is_over(table):
            break
        bench.say(name)
        command = [sys.executable, "-m", "tools.instance_memory", name]
        done = subprocess.run(command, check=True, cwd=ROOT, capture_output=True, text=True)
        megabytes, _, seconds, _ = done.stdout.splitlines()[-1].removeprefix(name).split()
        table.rows.append((name, float(megabytes), float(seconds)))
        if name == next(iter(instance_memory.FIELDS)):
            table.goals.append(Goal(f"MB of {name}", float(megabytes), MOST))
    return [table]
