# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that a program answers for, as sums: to all tables the program is a closure."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ...scene import BLACK, Closure, Surface, SurfaceProgram

IDLE = Surface(name="program", base_color=BLACK)
"""Stands where a program answers."""


def with_program(surface: Surface) -> Surface:
    """Its program as its first closure, which as a surface does nothing, and its material as those after it."""
    if surface.program is None:
        return surface
    own = surface.closures or (Closure(1.0, replace(surface, program=None)),)
    return replace(surface, closures=(Closure(1.0, IDLE), *own))


def allow_program(program: SurfaceProgram | None, flags: dict[str, Any], number: int) -> None:
    """Let a surface's `number` in the table do what its program may: send rays of both kinds, and let shadows pass."""
    if program is not None:
        flags["reflects"][number] = flags["transmits"][number] = True
        flags["shadow_opaque"][number] &= program.shadow is None
