# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects are likely to be elsewhere, or of another shape, in the next frame: a hint by which search trees are
divided. It says the same in every frame of a file. Where it is wrong a frame takes longer, and looks the same.
"""

from __future__ import annotations

import bpy

ALWAYS = {
    "ARMATURE", "BUILD", "CLOTH", "DYNAMIC_PAINT", "EXPLODE", "FLUID", "HOOK", "MESH_CACHE", "MESH_SEQUENCE_CACHE",
    "OCEAN", "PARTICLE_INSTANCE", "SOFT_BODY", "SURFACE_DEFORM", "WAVE",
}  # fmt: skip
"""Modifiers that are there to change a shape over time, or by what moves."""


def moves(b_object: bpy.types.Object) -> bool:
    """Whether anything that is animated, driven, constrained or simulated decides place or shape of an object."""
    b_object = b_object.original
    return any(_is_animated(b_owner) for b_owner in _with_parents(b_object)) or _changes_shape(b_object)


def _with_parents(b_object: bpy.types.Object) -> list[bpy.types.Object]:
    found = [b_object]
    while found[-1].parent is not None and found[-1].parent not in found:
        found.append(found[-1].parent)
    return found


def _is_animated(b_object: bpy.types.Object) -> bool:
    body = b_object.rigid_body
    is_free = body is not None and body.type == "ACTIVE"
    return bool(_has_motion(b_object) or len(b_object.constraints) or is_free)


def _changes_shape(b_object: bpy.types.Object) -> bool:
    b_data = b_object.data
    keys = getattr(b_data, "shape_keys", None)
    if (b_data is not None and _has_motion(b_data)) or (keys is not None and _has_motion(keys)):
        return True
    return any(b_modifier.type in ALWAYS for b_modifier in b_object.modifiers)


def _has_motion(b_id: bpy.types.ID) -> bool:
    data = getattr(b_id, "animation_data", None)
    return data is not None and bool(data.action or len(data.drivers) or len(data.nla_tracks))
