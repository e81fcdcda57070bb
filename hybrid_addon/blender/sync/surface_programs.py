# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface programs that objects and materials name, and the custom properties that these read.

A file has a name. What it stands for is looked up among what is registered in this Blender; no text is ever run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

from ... import programs
from ...scene import Surface
from .messages import Warnings


@dataclass(frozen=True)
class NamedProgram:
    """A name, whose it is, and the owner's custom properties, so that two are equal that do the same."""

    name: str
    owner: str
    values: tuple[tuple[str, Any], ...]


def named_program(b_id: bpy.types.ID) -> NamedProgram | None:
    """What an evaluated object or material names; None: nothing."""
    name = b_id.hybrid.program.strip()
    if not name:
        return None
    kind = "material" if isinstance(b_id, bpy.types.Material) else "object"
    found = ((key, _plain(b_id[key])) for key in sorted(b_id.keys()))
    values = tuple((key, value) for key, value in found if value is not None)
    return NamedProgram(name, f"{kind} {b_id.name!r}", values)


def _plain(value: Any) -> Any:
    """A custom property as a number, a text, numbers, or the world matrix of the object that it points to, as four
    tuples; None: it is something else."""
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, bpy.types.Object):
        return tuple(tuple(row) for row in value.matrix_world)
    if hasattr(value, "to_list") and all(isinstance(part, (bool, int, float)) for part in value.to_list()):
        return tuple(value.to_list())
    return None


def programmed(surface: Surface, named: NamedProgram | None, warn: Warnings) -> Surface:
    """The surface with its program, if there is one of that name; else the artist is told."""
    if named is None:
        return surface
    program = programs.find(named.name)
    if program is None:
        known = ", ".join(programs.names())
        warn.add(
            f"{named.owner}: there is no surface program {named.name!r}: drawn with its material (registered: {known})"
        )
        return surface
    values = {key: np.array(value) if _is_matrix(value) else value for key, value in named.values}
    return replace(surface, program=replace(program, values=values))


def _is_matrix(value: Any) -> bool:
    return isinstance(value, tuple) and len(value) == 4 and isinstance(value[0], tuple)
