# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing with care: our own edits of a scene must not call us again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

_inside = False


def is_busy() -> bool:
    """Whether a change must wait: we are inside one, or a render job is reading the scene on another thread."""
    return _inside or (not bpy.app.background and bpy.app.is_job_running("RENDER"))


@contextmanager
def guard() -> Iterator[bool]:
    """Keep our own edits from calling us again through update callbacks and depsgraph handlers.

    Yields whether the caller may write; it may not while anything `is_busy`.
    """
    global _inside
    if is_busy():
        yield False
        return
    _inside = True
    try:
        yield True
    finally:
        _inside = False
