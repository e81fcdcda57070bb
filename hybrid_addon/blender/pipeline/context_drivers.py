# SPDX-License-Identifier: GPL-3.0-or-later
"""Drivers that read a property of "the active scene", or of its view layer (Context Properties; asset rigs have them).

The active scene of the traced half's dependency graph is the trace scene. It gets the values that such drivers read.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

Path = tuple[str, str]
"""Which of "ACTIVE_SCENE" and "ACTIVE_VIEW_LAYER", and the path of a property of it."""


def paths() -> list[Path]:
    """All that drivers of this file read so, each once."""
    found: dict[Path, None] = {}
    for b_driver in _drivers():
        for b_variable in b_driver.driver.variables:
            if b_variable.type == "CONTEXT_PROP":
                b_target = b_variable.targets[0]
                found[b_target.context_property, b_target.data_path] = None
    return list(found)


def _drivers() -> Iterator[bpy.types.FCurve]:
    for b_property in bpy.data.bl_rna.properties:
        if b_property.type != "COLLECTION":
            continue
        for b_id in getattr(bpy.data, b_property.identifier):
            for b_owner in (b_id, getattr(b_id, "node_tree", None), getattr(b_id, "shape_keys", None)):
                data = getattr(b_owner, "animation_data", None)
                if data is not None:
                    yield from data.drivers


def copy(wanted: list[Path], scene: bpy.types.Scene, layer: bpy.types.ViewLayer, trace: bpy.types.Scene) -> list[str]:
    """Give the trace scene the values that these paths have in a scene and its layer; the paths of which it cannot."""
    failed = []
    for which, path in wanted:
        b_from, b_to = (scene, trace) if which == "ACTIVE_SCENE" else (layer, trace.view_layers[0])
        try:
            value = b_from.path_resolve(path)
        except ValueError:  # the driver reads nothing in the user's own scene, either
            continue
        if not _assign(b_to, path, value):
            failed.append(path)
    return failed


def _assign(owner: Any, path: str, value: Any) -> bool:
    """Set the property at a path; False if it cannot be. No pointers: the trace scene is in another database."""
    if isinstance(value, bpy.types.bpy_struct):
        return False
    value = value if isinstance(value, (bool, int, float, str)) else tuple(value)
    try:
        index: int | None = None
        if path.endswith("]") and not path.endswith(('"]', "']")):  # an element of an array
            path, _, number = path[:-1].rpartition("[")
            index = int(number)
        if path.endswith(('"]', "']")):
            start = max(path.rfind('["'), path.rfind("['"))
            holder, key = path[:start], path[start + 2 : -2]
            target = owner.path_resolve(holder) if holder else owner
            if target is None or target.id_data != owner.id_data:
                return target is not None
            if index is None:
                if target.get(key) != value:
                    target[key] = value
            else:
                values = list(target.get(key, ()))
                values += [value] * (index + 1 - len(values))
                values[index] = value
                target[key] = values
            return True
        holder, _, name = path.rpartition(".")
        target = owner.path_resolve(holder) if holder else owner
        if target.id_data != owner.id_data:  # of the camera, which is the user's own
            return True
        if index is not None:
            getattr(target, name)[index] = value
        elif getattr(target, name) != value:
            setattr(target, name, value)
    except (AttributeError, KeyError, TypeError, ValueError, IndexError):
        return False
    return True
