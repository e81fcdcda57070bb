# SPDX-License-Identifier: GPL-3.0-or-later
"""What `blender -b FILE -f 1` and `-a` do when the ray tracer fails: no picture with a hole in it, and exit code 1.

Blender saves whatever a render engine leaves and exits with 0, and no script can hear of the failure there. So it is
told what Ctrl-C tells it: it drops the picture and the frames that follow. Scripts that render get an exception.
"""

from __future__ import annotations

import atexit
import os
import shutil
import signal
import sys
from pathlib import Path

import bpy

_RENDERS = {"-f", "--render-frame", "-a", "--render-anim"}
_leaving = False


def plain_render() -> None:
    """Stop the render that Blender's command line asks for; does nothing in any other."""
    global _leaving
    own = sys.argv[: sys.argv.index("--")] if "--" in sys.argv else sys.argv
    if bpy.app.module or not bpy.app.background or not _RENDERS.intersection(own):
        return
    signal.raise_signal(signal.SIGINT)  # Blender's handler for the background
    if not _leaving:
        _leaving = True
        atexit.register(_leave, Path(bpy.app.tempdir))


def _leave(temporary: Path) -> None:
    """Blender asks nobody for its exit code: leave when it ends Python, and remove its folder as it would next."""
    if temporary.name.startswith("blender_"):
        shutil.rmtree(temporary, ignore_errors=True)
    sys.stdout.flush()
    os._exit(1)
