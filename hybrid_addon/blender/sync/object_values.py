# SPDX-License-Identifier: GPL-3.0-or-later
"""What surfaces read of the instance that wears them (scene.Instance.values), and of other datablocks by name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import bpy
import numpy as np

from ...procedural.hashes import jenkins

RGBA = tuple[float, float, float, float]
TO_UNIT = 1 / 0xFFFFFFFF  # from 32 random bits to 0..1
MATRICES = ("OBJECT_TO_WORLD", "WORLD_TO_OBJECT")


def values_of(b_instance: bpy.types.DepsgraphObjectInstance, keys: Iterable[str]) -> dict[str, tuple[float, ...]]:
    """Those of these keys (expressions.INSTANCE) that it has; the tracer knows its matrices itself."""
    found = {key: _value(b_instance, key) for key in sorted(keys) if key not in MATRICES}
    return {key: value for key, value in found.items() if value is not None}


def _value(b_instance: bpy.types.DepsgraphObjectInstance, key: str) -> tuple[float, ...] | None:
    b_object = b_instance.object
    kind, _, name = key.partition(":")
    if kind in ("object", "instancer"):
        return _named(b_instance, name, kind == "instancer")
    if kind == "location":
        return tuple(b_instance.matrix_world.translation)
    if kind == "color":
        return tuple(b_object.color)[:3]
    if kind == "alpha":
        return (b_object.color[3],)
    if kind == "index":
        return (float(b_object.pass_index),)
    return (_random(b_instance),)


def _random(b_instance: bpy.types.DepsgraphObjectInstance) -> float:
    """Blender's own: of an instance its number, of any other object a hash of its name (ObjectInfos::sync of EEVEE)."""
    if b_instance.is_instance:
        return (b_instance.random_id & 0xFFFFFFFF) * TO_UNIT
    number = 0
    for letter in b_instance.object.name.encode():
        number = (number * 37 + letter) & 0xFFFFFFFF  # BLI_hash_string
    hashed = jenkins(np.array([number], np.uint32), np.zeros(1, np.uint32))
    return int(hashed[0]) * TO_UNIT


def _named(b_instance: bpy.types.DepsgraphObjectInstance, name: str, of_instancer: bool) -> RGBA | None:
    """An attribute by name, looked for where EEVEE looks (BKE_object_dupli_find_rgba_attribute)."""
    places: list[Any] = [b_instance.object, b_instance.object.data]
    if of_instancer and b_instance.is_instance:
        found = next((value for value in _of_geometry(b_instance, name)), None)
        if found is not None:
            return found
        b_system = b_instance.particle_system
        places = [*([b_system.settings] if b_system else []), b_instance.parent, *places]
    return next(filter(None, (rgba_in(b_place, name) for b_place in places if b_place is not None)), None)


def _of_geometry(b_instance: bpy.types.DepsgraphObjectInstance, name: str) -> Iterator[RGBA]:
    """What Geometry Nodes left on the instance, outermost instances alone (Blender 5 shows them to scripts)."""
    b_parent = b_instance.parent
    if not name or b_parent is None or not hasattr(b_parent, "evaluated_geometry"):
        return
    b_points = b_parent.evaluated_geometry().instances_pointcloud()
    b_attribute = b_points.attributes.get(name) if b_points is not None else None
    number = b_instance.persistent_id[0]
    if b_attribute is not None and 0 <= number < len(b_attribute.data):
        b_item = b_attribute.data[number]
        value = _rgba(next((getattr(b_item, field) for field in FIELDS if hasattr(b_item, field)), None))
        if value is not None:
            yield value


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
