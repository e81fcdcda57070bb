# SPDX-License-Identifier: GPL-3.0-or-later
"""What surfaces read of the instance that wears them (scene.Instance.values), and of other datablocks by name."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy
import numpy as np

from ...procedural.hashes import jenkins
from .messages import Warnings

RGBA = tuple[float, float, float, float]
TO_UNIT = 1 / 0xFFFFFFFF  # from 32 random bits to 0..1
MATRICES = ("OBJECT_TO_WORLD", "WORLD_TO_OBJECT")


class ObjectValues:
    """Reads them, of one frame."""

    def __init__(self, warn: Warnings) -> None:
        self._warn = warn
        self._of_geometry: dict[tuple[int, str], list[RGBA | None]] = {}  # by instancer and name, of each instance

    def of(self, b_instance: bpy.types.DepsgraphObjectInstance, keys: Iterable[str]) -> dict[str, tuple[float, ...]]:
        """Those of these keys (expressions.INSTANCE) that it has; the tracer knows its matrices itself."""
        found = {key: self._value(b_instance, key) for key in sorted(keys) if key not in MATRICES}
        return {key: value for key, value in found.items() if value is not None}

    def _value(self, b_instance: bpy.types.DepsgraphObjectInstance, key: str) -> tuple[float, ...] | None:
        b_object = b_instance.object
        kind, _, name = key.partition(":")
        if kind in ("object", "instancer"):
            return self._named(b_instance, name, kind == "instancer")
        if kind == "location":
            return tuple(b_instance.matrix_world.translation)
        if kind == "color":
            return tuple(b_object.color)[:3]
        if kind == "alpha":
            return (b_object.color[3],)
        if kind == "index":
            return (float(b_object.pass_index),)
        return (_random(b_instance),)

    def _named(self, b_instance: bpy.types.DepsgraphObjectInstance, name: str, of_instancer: bool) -> RGBA | None:
        """An attribute by name, looked for where EEVEE looks (BKE_object_dupli_find_rgba_attribute)."""
        places: list[Any] = [b_instance.object, b_instance.object.data]
        if of_instancer and b_instance.is_instance:
            found = self._by_geometry(b_instance, name)
            if found is not None:
                return found
            b_system = b_instance.particle_system
            places = [*([b_system.settings] if b_system else []), b_instance.parent, *places]
        value = next(filter(None, (rgba_in(b_place, name) for b_place in places if b_place is not None)), None)
        if value is None and of_instancer and b_instance.is_instance and name:
            shown = b_instance.object.name
            self._warn.add(f"object {shown!r}: attribute {name!r} of its instances cannot be read; it is 0 there")
        return value

    def _by_geometry(self, b_instance: bpy.types.DepsgraphObjectInstance, name: str) -> RGBA | None:
        """What Geometry Nodes left on the instance; of nested ones on the outermost, which scripts see."""
        b_parent = b_instance.parent
        number = [n for n in b_instance.persistent_id if n != UNUSED][-1]
        if not name or b_parent is None or b_parent.type == "EMPTY" or not hasattr(b_parent, "evaluated_geometry"):
            return None
        key = b_parent.as_pointer(), name
        if key not in self._of_geometry:
            b_geometry = b_parent.evaluated_geometry()  # what it hands out lives as long as it does
            b_points = b_geometry.instances_pointcloud()
            b_attribute = None if b_points is None else b_points.attributes.get(name)
            self._of_geometry[key] = [] if b_attribute is None else [_of_item(b_item) for b_item in b_attribute.data]
        known = self._of_geometry[key]
        return known[number] if 0 <= number < len(known) else None


def _random(b_instance: bpy.types.DepsgraphObjectInstance) -> float:
    """Blender's own: of an instance its number, of any other object a hash of its name (ObjectInfos::sync of EEVEE)."""
    if b_instance.is_instance:
        return (b_instance.random_id & 0xFFFFFFFF) * TO_UNIT
    number = 0
    for letter in b_instance.object.name.encode():
        number = (number * 37 + letter) & 0xFFFFFFFF  # BLI_hash_string
    hashed = jenkins(np.array([number], np.uint32), np.zeros(1, np.uint32))
    return int(hashed[0]) * TO_UNIT


def _of_item(b_item: Any) -> RGBA | None:
    return _rgba(next((getattr(b_item, field) for field in FIELDS if hasattr(b_item, field)), None))


UNUSED = 0x7FFFFFFF  # of the numbers of an instance, the innermost first

FIELDS = ("color", "vector", "value")


def rgba_in(b_struct: bpy.types.bpy_struct, name: str) -> RGBA | None:
    """A custom property, or else any property by its path, as shaders read it: grey for a number, alpha 1 for three.

    None: there is none of that name that is made of at most four numbers. After find_rna_property_rgba
    (blenkernel/intern/object_dupli.cc).
    """
    if not name:
        return None
    value = b_struct.get(name) if hasattr(b_struct, "get") else None
    if value is None:
        try:
            value = b_struct.path_resolve(name)
        except (ValueError, TypeError):
            return None
    return _rgba(value)


def _rgba(value: Any) -> RGBA | None:
    if isinstance(value, bool | int | float):
        return (float(value),) * 3 + (1.0,)
    if value is None or isinstance(value, str | bytes) or not hasattr(value, "__len__") or not 0 < len(value) <= 4:
        return None
    try:
        given = [float(v) for v in value]
    except (TypeError, ValueError):
        return None
    red, green, blue, alpha = given + [0.0, 0.0, 0.0, 1.0][len(given) :]
    return red, green, blue, alpha
