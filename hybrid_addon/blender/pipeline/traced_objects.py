# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects are rendered, which of them are ray traced, and how EEVEE holds those out.

An object is held out in the evaluated copy that one render of a mask layer has of it, which Blender throws away with
it: nothing of the user's data is written to, and objects of background scenes have one, too. But an instance has the
flag of the object that it shows, whoever shows it, and the collections of its instancer; and Blender does not let
copies of linked objects be written to at once. So what shows others, is shown by others, or is linked is held out by a
collection of ours in that layer.
"""

from __future__ import annotations

import bpy

from ..flags import Flags, background_sets
from ..instancing import not_held_out_in_copies
from ..sync.messages import Warnings
from ..view_layers import MASK_MARK, imitated_by, rendered_layers

COLLECTION_MARK = "hybrid_collection"  # custom property on our collections: the number of their hybrid layer


def rendered_objects(scene: bpy.types.Scene, layer: bpy.types.ViewLayer | None = None) -> list[bpy.types.Object]:
    """The scene's own objects whose collections the layer renders, each once, in the order of these.

    Only through collections that are neither excluded from the layer nor disabled for rendering: linking an object
    into our collection must not bring back what the user has switched off. layer : None for all that the user renders.
    """
    found: dict[str, bpy.types.Object] = {}

    def walk(layer_collection: bpy.types.LayerCollection) -> None:
        collection = layer_collection.collection
        if COLLECTION_MARK in collection or collection.hide_render:
            return
        if not layer_collection.exclude:
            found.update((ob.name_full, ob) for ob in collection.objects)
        for child in layer_collection.children:
            walk(child)

    for each in rendered_layers(scene) if layer is None else [layer]:
        if each.layer_collection is None:  # a scene that Blender has just made
            each.update()
        walk(each.layer_collection)
    return list(found.values())


def ray_traced_objects(scene: bpy.types.Scene, layer: bpy.types.ViewLayer | None = None) -> list[bpy.types.Object]:
    """The ray traced ones of them, and of the background scenes, which every layer shows. layer : None for all."""
    flags = Flags(scene)
    found = rendered_objects(scene, layer)
    for b_set in background_sets(scene):  # of which Blender shows the first layer
        found += rendered_objects(b_set, rendered_layers(b_set)[0])
    return [b_object for b_object in dict.fromkeys(found) if flags.is_ray_traced(b_object)]


def held_out_by_collection(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """The ray traced objects of a layer that show others, that others show, or that are linked."""
    others = not_held_out_in_copies(scene.objects)
    return [b_object for b_object in ray_traced_objects(scene, layer) if b_object in others]


def hold_out(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Hold out the other ones, in the depsgraph of a render of a mask layer; in others that Blender keeps, none."""
    if depsgraph.mode != "RENDER":
        return
    wanted = set[bpy.types.Object]()
    if MASK_MARK in depsgraph.view_layer:
        wanted = set(ray_traced_objects(scene, imitated_by(scene, depsgraph.view_layer)))
        wanted = wanted and wanted - not_held_out_in_copies(scene.objects)
    if wanted or scene.render.use_persistent_data:
        b_objects = [b_object.original for b_object in depsgraph.objects]
        # An assignment would have Blender evaluate all again, without its handlers: `foreach_set` tags nothing.
        depsgraph.objects.foreach_set("is_holdout", [ob.is_holdout or ob in wanted for ob in b_objects])


def missed(scene: bpy.types.Scene) -> list[str]:
    """Warnings of objects that are ticked, rendered, and yet not ray traced."""
    told = Warnings()
    for ob in (ob for ob in Flags(scene).missed() if not ob.hide_render):
        told.add(
            f"object {ob.name!r} of background scene {scene.background_set.name!r} instances others, is instanced, or "
            f"is linked: only EEVEE draws it; link it to scene {scene.name!r} to have it ray traced"
        )
    return list(told)
