# SPDX-License-Identifier: GPL-3.0-or-later
"""How every program that has used bpy ends."""

import os
import sys
from typing import NoReturn


def leave(code: int = 0) -> NoReturn:
    """End this process now, with what it has printed: bpy's static destructors can wait for ever after an EEVEE render
    (4.5). Functions registered with `atexit` are not called."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
