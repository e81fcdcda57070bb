# SPDX-License-Identifier: GPL-3.0-or-later
"""Stiff and extreme cases, each a number with a tolerance: what an engineer can run to see whether the tracer holds.

    case.py                 Case, Result
    build.py compare.py     small scenes; numbers out of pairs of pictures
    invariance.py ...       the cases, one theme a file
    table.py                all of them; running, summary
    page.py                 the page

Pure numpy over `scene` and `tracer`. The cases that need Blender are in `blender/measure/stability.py`.
"""

from __future__ import annotations

from .case import Case, Measured, Result, Theme
from .table import CASES, SITUATIONS, run, to_json

__all__ = ["CASES", "SITUATIONS", "Case", "Measured", "Result", "Theme", "run", "to_json"]
