# SPDX-License-Identifier: GPL-3.0-or-later
"""What objects show beside themselves, as far as it can be told before anything is evaluated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import bpy

Shown = tuple[bpy.types.Object | None, bpy.types.Material | None]  # a material that nodes assign has no object


def shown(b_owner: bpy.types.Object) -> Iterator[Shown]:
    """All that an object may show with what it wears: itself, what it instances, what its nodes make."""
    queue: list[bpy.types.ID] = [b_owner]
    seen: set[bpy.types.ID] = set()
    while queue:
        b_id = queue.pop()
        if b_id in seen:
            continue
        seen.add(b_id)
        if isinstance(b_id, bpy.types.Material):
            yield None, b_id
        elif isinstance(b_id, bpy.types.Object):
            for b_material in [b_slot.material for b_slot in b_id.material_slots] or [None]:
                yield b_id, b_material
            queue += _instanced(b_id)
        elif isinstance(b_id, bpy.types.Collection):
            queue += b_id.all_objects
        elif isinstance(b_id, bpy.types.NodeTree):
            for b_node in b_id.nodes:
                values = [getattr(b_socket, "default_value", None) for b_socket in b_node.inputs]
                queue += _ids([getattr(b_node, "node_tree", None), *values])


def shared(b_objects: Iterable[bpy.types.Object]) -> set[bpy.types.Object]:
    """Those that may show other objects, and the objects that they may show."""
    found: set[bpy.types.Object] = set()
    for b_owner in b_objects:
        if _instanced(b_owner):
            others = {b_object for b_object, _ in shown(b_owner) if b_object not in (None, b_owner)}
            found |= others | {b_owner} if others else set()
    return found


def not_held_out_in_copies(b_objects: Iterable[bpy.types.Object]) -> set[bpy.types.Object]:
    """Those that cannot be held out in the evaluated copies that a render has of them: they show others, or are shown
    by others, or are linked, whose copies `foreach_set` leaves as they are."""
    b_objects = list(b_objects)
    return shared(b_objects) | {b_object for b_object in b_objects if b_object.library is not None}


def _instanced(b_object: bpy.types.Object) -> list[bpy.types.ID]:
    """What an object shows beside itself: objects, collections, node groups."""
    found: list[Any] = list(b_object.children) if b_object.instance_type in {"VERTS", "FACES"} else []
    found += [b_object.instance_collection if b_object.instance_type == "COLLECTION" else None]
    for b_system in b_object.particle_systems:
        found += [b_system.settings.instance_object, b_system.settings.instance_collection]
    for b_modifier in b_object.modifiers:
        if isinstance(b_modifier, bpy.types.NodesModifier):
            found += [b_modifier.node_group, *node_inputs(b_modifier)]
    return _ids(found)


def node_inputs(b_modifier: bpy.types.NodesModifier) -> list[Any]:
    """What is given to a modifier's nodes: custom properties in Blender 4.5, in 5.2 properties of their own."""
    if not hasattr(b_modifier, "properties"):
        return list(b_modifier.values())
    b_inputs = b_modifier.properties.inputs
    return [getattr(getattr(b_inputs, name), "value", None) for name in b_inputs.bl_rna.properties.keys()]


def _ids(values: Iterable[Any]) -> list[bpy.types.ID]:
    return [value for value in values if isinstance(value, bpy.types.ID)]
