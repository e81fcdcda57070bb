# SPDX-License-Identifier: GPL-3.0-or-later
"""What the walks through Blender's settings have in common: changing any value, and telling scenes apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass

import numpy as np


def contents(value):
    """All that a part of a translated scene is made of, to compare."""
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if is_dataclass(value):
        return tuple((field.name, contents(getattr(value, field.name))) for field in fields(value))
    if isinstance(value, Mapping):
        return tuple((key, contents(item)) for key, item in value.items())
    if isinstance(value, list | tuple):
        return tuple(contents(item) for item in value)
    return value


def other_value(value):
    """Another value of the same kind, within usual ranges."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1
    if isinstance(value, float):
        return 0.6 * value + 0.07
    if isinstance(value, str):
        return value + "x"
    return [0.7 * part + 0.03 * (i + 1) for i, part in enumerate(value)]


def items_of(b_struct, name):
    """Of an enumeration those that can be set here, but what it has now."""
    now, found = getattr(b_struct, name), []
    for item in b_struct.bl_rna.properties[name].enum_items:
        try:
            setattr(b_struct, name, item.identifier)
        except TypeError:
            continue
        found.append(item.identifier)
    setattr(b_struct, name, now)
    return [item for item in found if item != now]
