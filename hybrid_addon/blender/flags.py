# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects are ray traced: by their own flag, or by that of a collection that they are in, or that they show.

And which materials are, whatever wears them.

The pipeline (what EEVEE holds out) and the translator (what camera rays see) both ask here: they must never differ.
"""

from __future__ import annotations

import bpy

from .instancing import not_held_out_in_copies


class Flags:
    """The flags of one scene as it stands."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        scene = scene.original
        sets = background_sets(scene)
        self._by_collection = {
            ob for owner in (scene, *sets) for collection in flagged_collections(owner) for ob in collection.all_objects
        }  # with all that lies in collections below
        of_sets = {ob for b_set in sets for ob in b_set.objects}.difference(scene.objects if sets else ())
        self._left_to_eevee = of_sets and of_sets & not_held_out_in_copies({*of_sets, *scene.objects})

    def is_ray_traced(self, b_object: bpy.types.Object) -> bool:
        """Of an object of the scene, original or evaluated."""
        b_object = b_object.original
        hybrid = getattr(b_object, "hybrid", None)  # the translator also works without the add-on
        if hybrid is None or b_object.type == "META":
            return False  # metaballs have no skin in a scene that has them as its background set: EEVEE draws them
        return self._is_flagged(b_object) and b_object not in self._left_to_eevee

    def missed(self) -> list[bpy.types.Object]:
        """The ticked objects of background scenes that cannot be: shown by others, showing others, or linked.

        EEVEE holds out an instance with its instancer only where that is in a collection of the scene's own view layer.
        """
        return sorted(filter(self._is_flagged, self._left_to_eevee), key=lambda b_object: b_object.name_full)

    def _is_flagged(self, b_object: bpy.types.Object) -> bool:
        hybrid = b_object.hybrid
        return hybrid.ray_traced or b_object in self._by_collection or shows_ray_traced(b_object)


def flagged_collections(scene: bpy.types.Scene) -> list[bpy.types.Collection]:
    """The scene's collections that make their objects ray traced."""
    everything = [scene.collection, *scene.collection.children_recursive]
    return [c for c in everything if getattr(c, "hybrid", None) is not None and c.hybrid.ray_traced]


def background_sets(scene: bpy.types.Scene) -> list[bpy.types.Scene]:
    """The scene's background scene, that one's, and so on."""
    found: list[bpy.types.Scene] = []
    b_set = scene.background_set
    while b_set is not None and b_set != scene and b_set not in found:
        found.append(b_set)
        b_set = b_set.background_set
    return found


def shows_ray_traced(b_object: bpy.types.Object) -> bool:
    """Whether the object instances a collection that is ray traced: what it shows is then ray traced."""
    shown = b_object.instance_collection if b_object.instance_type == "COLLECTION" else None
    return shown is not None and shown.hybrid.ray_traced


def is_traced_by_itself(b_material: bpy.types.Material) -> bool:
    """Whether all faces that wear a material, original or evaluated, are ray traced, whichever object they are of."""
    return is_ticked(b_material) and not why_not(b_material)


def is_ticked(b_material: bpy.types.Material) -> bool:
    """Whether the artist wants that of a material; the translator also works without the add-on."""
    hybrid = getattr(b_material.original, "hybrid", None)
    return hybrid is not None and hybrid.ray_traced


def why_not(b_material: bpy.types.Material) -> str:
    """Why a material cannot be ray traced by itself, as one line for people; "" if it can."""
    tree = b_material.original.node_tree
    if tree is None or (bpy.app.version < (5, 0, 0) and not b_material.use_nodes):  # later they all have nodes
        return "it has no nodes: tick Use Nodes to have it ray traced by itself"
    output = tree.get_output_node("EEVEE")
    if output is not None and output.inputs["Volume"].is_linked and not output.inputs["Surface"].is_linked:
        return "it is a volume: only surfaces can be ray traced by themselves"
    for b_object in bpy.data.objects:
        if b_object.type == "META" and b_material.original in {b_slot.material for b_slot in b_object.material_slots}:
            return f"metaball {b_object.name!r} wears it, which only EEVEE draws: give the metaball another one"
    return ""


def unsaved_overrides(scene: bpy.types.Scene) -> list[bpy.types.ID]:
    """Overrides whose settings of ours Blender drops when it saves: the linked datablock has never had any.

    Blender saves what differs from the linked datablock, and only of groups that this one holds in its file.
    """
    materials = {b_slot.material for b_object in scene.objects for b_slot in b_object.material_slots if b_slot.material}
    owners = [*scene.objects, *sorted(materials, key=lambda b_material: b_material.name_full)]
    return [
        b_id
        for b_id in owners
        if b_id.override_library is not None
        and (getattr(b_id.hybrid, "ray_traced", False) or b_id.hybrid.surface == "CUSTOM")
        and not _holds_settings(b_id.override_library.reference)
    ]


def _holds_settings(b_id: bpy.types.ID) -> bool:
    group = b_id.bl_system_properties_get() if hasattr(b_id, "bl_system_properties_get") else b_id
    return group is not None and "hybrid" in group.keys()


def clear(scene: bpy.types.Scene) -> None:
    """Nothing of the scene is ray traced any more. Linked data keeps its flags: its own file says so."""
    for collection in flagged_collections(scene):
        if collection.library is None:
            collection.hybrid.ray_traced = False
    for b_object in scene.objects:
        if b_object.hybrid.ray_traced and b_object.library is None:
            b_object.hybrid.ray_traced = False
        shown = b_object.instance_collection
        if shown is not None and shown.library is None and shown.hybrid.ray_traced:
            shown.hybrid.ray_traced = False
    here = {b_slot.material for b_object in scene.objects for b_slot in b_object.material_slots}
    others = (b_object for b_object in bpy.data.objects if b_object not in set(scene.objects))
    elsewhere = {b_slot.material for b_object in others for b_slot in b_object.material_slots}
    for b_material in bpy.data.materials:
        if is_ticked(b_material) and b_material.library is None and (b_material in here or b_material not in elsewhere):
            b_material.hybrid.ray_traced = False
