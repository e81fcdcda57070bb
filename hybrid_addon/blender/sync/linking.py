# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's light linking: the collections of a light that name what it lights, and what casts shadows in its light.

What lies in such a collection is included or excluded, as its switch there says; for all that lies in a collection in
it, at any depth, that one's switch counts. If nothing is included all is, and then what is excluded is taken out
(blenkernel's light_linking.cc). Instances are linked as their instancer is, whatever they show; so does EEVEE.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import bpy

from ...scene import Light


@dataclass(frozen=True)
class Link:
    """Names (name_full) of the objects in a linking collection."""

    included: frozenset[str]
    excluded: frozenset[str]

    def numbers(self, owners: Sequence[str]) -> frozenset[int]:
        """Of the instances, each known by the name of its instancer or else its object, those that are linked."""
        return frozenset(
            number
            for number, name in enumerate(owners)
            if (not self.included or name in self.included) and name not in self.excluded
        )


@dataclass(frozen=True)
class Links:
    """What a light lights, and what blocks its light; None: everything."""

    receivers: Link | None
    blockers: Link | None


def links_of(b_light: bpy.types.Object) -> Links:
    """The links of a light object."""
    b_linking = b_light.light_linking
    return Links(_link(b_linking.receiver_collection), _link(b_linking.blocker_collection))


def linked(light: Light, links: Links, owners: Sequence[str]) -> Light:
    """The light with the numbers of the instances that it is linked to."""
    if links.receivers is None and links.blockers is None:
        return light
    pair = (links.receivers, links.blockers)
    receivers, blockers = (None if link is None else link.numbers(owners) for link in pair)
    return replace(light, receivers=receivers, blockers=blockers)


def _link(b_collection: bpy.types.Collection | None) -> Link | None:
    """What a linking collection says; None where there is none, or one that says nothing."""
    if b_collection is None:
        return None
    found: dict[str, set[str]] = {"INCLUDE": set(), "EXCLUDE": set()}
    for state, name in _entries(b_collection):
        found[state].add(name)
    link = Link(frozenset(found["INCLUDE"]), frozenset(found["EXCLUDE"]))
    return link if link.included or link.excluded else None


def _entries(b_collection: bpy.types.Collection) -> Iterator[tuple[str, str]]:
    """The switch and the name of all that lies in a linking collection."""
    for b_entry, b_object in zip(b_collection.collection_objects, b_collection.objects, strict=True):
        yield b_entry.light_linking.link_state, b_object.name_full
    for b_entry, b_child in zip(b_collection.collection_children, b_collection.children, strict=True):
        for b_object in b_child.all_objects:
            yield b_entry.light_linking.link_state, b_object.name_full
