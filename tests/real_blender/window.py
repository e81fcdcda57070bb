# SPDX-License-Identifier: GPL-3.0-or-later
"""What every script for a Blender with a window stands on: steps by timer, a screenshot, and an end in every case.

A timer whose function raises is only dropped, and a window without work stays open: so a step that raises ends Blender
with its traceback, and one that hangs is ended with the stacks of all threads.
"""

import faulthandler
import os
import subprocess
import sys
import traceback
from collections.abc import Callable

import bpy

PATIENCE = 190  # seconds for a whole script


def limit(seconds: float = PATIENCE) -> None:
    """End Blender with exit code 1 and the stacks of all threads unless it has ended by then."""
    faulthandler.dump_traceback_later(seconds, exit=True, file=sys.stderr)


def soon(step: Callable[[], float | None], seconds: float = 1.0, persistent: bool = False) -> None:
    """Run this later, as often as it returns seconds to wait; if it raises, print the traceback and end Blender."""

    def guarded() -> float | None:
        try:
            return step()
        except BaseException as error:  # not print_exc: it looks into objects that an undo may have removed
            print("".join(traceback.format_tb(error.__traceback__)), type(error).__name__, error, flush=True)
            os._exit(1)

    bpy.app.timers.register(guarded, first_interval=seconds, persistent=persistent)


def shoot(picture: str) -> None:
    """The whole screen, by ImageMagick: on software OpenGL Blender's own screenshot operator gives a black picture."""
    subprocess.run(["import", "-window", "root", picture], check=True, timeout=30)


bpy.context.preferences.view.show_splash = False
limit()
