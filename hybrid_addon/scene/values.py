# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers and colours, constant or varying from place to place. Conventions: see the package."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .numbers import RGB


@dataclass(frozen=True, eq=False)
class Expression:
    """A number or colour that varies over a surface; expressions.py has the operations and works it out at each hit.

    operation : its name there: "image", "attribute", "multiply", "ramp", ...
    inputs    : numbers, colours and expressions.
    data      : what the operation needs besides: the Texture of an image, the key of an attribute, a ramp's table.
    """

    operation: str
    inputs: tuple[Value, ...] = ()
    data: Any = None


Value = float | RGB | Expression
Number = float | Expression
Color = RGB | Expression
