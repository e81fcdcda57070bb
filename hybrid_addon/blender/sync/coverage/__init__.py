# SPDX-License-Identifier: GPL-3.0-or-later
"""What the traced half follows of Blender, setting by setting: tables, and the warnings that come from them.

    status.py                 Followed, Named, Within, Irrelevant
    scene_tables.py           of the scene: EEVEE's settings, render settings, view layers, world, camera
    object_tables.py          of objects, materials and lights
    shader_tables.py          sockets of shaders and outputs
    value_tables.py           sockets of nodes of numbers, colours and textures; settings of nodes

Every setting that EEVEE's picture may depend on stands in one of them: a test walks through all that the running
Blender has (tests/blender/sync/test_coverage.py), so that a new version's new settings are noticed.
"""

from __future__ import annotations

from math import isclose
from typing import Any

import bpy

from ..messages import Warnings
from .object_tables import OBJECT_TABLES, OBJECT_TYPES, PROBE_TYPES
from .scene_tables import SCENE_TABLES
from .shader_tables import SHADERS
from .status import FIRST, FOLLOWED, Followed, Irrelevant, Named, Status, Table, Within, named, status_of
from .value_tables import NODE_SETTINGS, VALUES

__all__ = [
    "FIRST",
    "FOLLOWED",
    "NODE_SETTINGS",
    "OBJECT_TYPES",
    "PROBE_TYPES",
    "PROPERTIES",
    "SOCKETS",
    "Followed",
    "Irrelevant",
    "Named",
    "Status",
    "Table",
    "Within",
    "name_object",
    "name_settings",
    "name_sockets",
    "named",
    "status_of",
]

PROPERTIES: dict[str, Table] = {**SCENE_TABLES, **OBJECT_TABLES}
"""By the name of the type in `bpy.types`; a type's table has what it adds to its base type (PointLight to Light)."""

SOCKETS: dict[str, Table] = {**SHADERS, **VALUES}
"""By the node's identifier: its inputs, by name. A node that is not followed has one entry, ""."""


def name_settings(b_struct: bpy.types.bpy_struct, owner: str, warn: Warnings) -> None:
    """Warn, in the owner's name, of what of a datablock or a struct is named, counts, and is not neutral."""
    for b_type in reversed(type(b_struct).__mro__):
        for name, status in named(PROPERTIES.get(b_type.__name__, {})):
            if _differs(getattr(b_struct, name, status.neutral), status.neutral) and status.matters(b_struct):
                label = status.label or b_struct.bl_rna.properties[name].name
                text = f"{label} {status.says}"
                if isinstance(b_struct, bpy.types.Material | bpy.types.World):
                    warn.add(text, status.rank, owner)
                else:
                    warn.add(f"{owner}: {text}", status.rank)


def name_object(b_object: bpy.types.Object, warn: Warnings) -> None:
    """The same of an object of a kind that rays do not meet, if EEVEE draws its kind."""
    says = OBJECT_TYPES.get(b_object.type)
    if b_object.type == "LIGHT_PROBE":
        says = PROBE_TYPES.get(b_object.data.type)
    if says is not None:
        warn.add(f"object {b_object.name!r}: {says}", FIRST)


def name_sockets(node: Any, reader: Any) -> None:
    """The same of the inputs of a node (`sync.nodes.Node`), through its reader."""
    for name, status in named(SOCKETS.get(node.kind, {})):
        if name and node.has_input(name) and _counts(node.input(name), status) and status.matters(node):
            reader.warn(f"{name!r} of node {node.name!r} {status.says}", status.rank)
    for name, status in named(NODE_SETTINGS.get(node.kind, {})):
        if _differs(getattr(node.b_node, name, status.neutral), status.neutral) and status.matters(node):
            label = status.label or node.b_node.bl_rna.properties[name].name
            reader.warn(f"{label} of node {node.name!r} {status.says}", status.rank)


def _counts(socket: Any, status: Named) -> bool:
    """Whether something is linked to a socket, or its value is not the neutral one."""
    if not socket.is_constant():
        return True
    return status.neutral is not None and _differs(socket.value(), status.neutral)


def _differs(value: Any, neutral: Any) -> bool:
    """Numbers by more than single precision rounds them."""
    if isinstance(value, float) and isinstance(neutral, float):
        return not isclose(value, neutral, rel_tol=1e-6, abs_tol=1e-9)
    return bool(value != neutral)
