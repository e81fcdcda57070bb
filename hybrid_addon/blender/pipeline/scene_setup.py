# SPDX-License-Identifier: GPL-3.0-or-later
"""What a hybrid scene has that a plain one has not: set up, kept in step, taken away again without a trace.

    user's scene                                      "Hybrid Trace" scene (engine HYBRID_TRACER; trace_scenes.py)
      view layer "Hybrid Mask"                          in a render: background_set = the user's scene, so that it
        collection "Hybrid Traced", held out            shows its objects without linking one of them
      compositor: Render Layers (mask) + Render Layers (trace) -> Hybrid -> whatever the user's Render Layers fed

`sync(scene)` is idempotent: it compares what is there with what should be there and writes only the differences, so
it can run after any change, undo, load, copy or append. `tear_down(scene)` is its inverse. Nothing else edits the
scene. Both run on the main thread only, never from a render handler in a window (that crashes Blender).
"""

from __future__ import annotations

import bpy

from .. import session
from ..errors import HybridError
from ..flags import Flags
from ..lines import draws_freestyle, draws_grease_pencil
from ..sync.messages import Warnings
from ..view_layers import MASK_MARK, SOURCE_MARK, mask_layer, set_, source_layer, sync_mask_layer
from . import compositor_setup, opengl, trace_scenes
from .guard import guard, is_busy
from .held_out import ray_traced_materials as ray_traced_materials
from .restore import Restore
from .trace_scenes import ENGINE as ENGINE  # for who asks here
from .trace_scenes import is_trace_scene as is_trace_scene
from .transmission import transmit

COLLECTION = "Hybrid Traced"
FREESTYLE = "freestyle_as_render_pass"  # of what was changed in the user's layer
COLLECTION_MARK = "hybrid_collection"  # custom property on our collections


# ------------------------------------------------------------------------------------------------ questions


def eevee() -> str:
    """EEVEE's engine id, which differs between Blender versions: the one that Blender itself starts with."""
    return str(bpy.types.RenderSettings.bl_rna.properties["engine"].enum_items[0].identifier)


def is_eevee(scene: bpy.types.Scene) -> bool:
    """Whether EEVEE draws this scene."""
    return bool(scene.render.engine == eevee())


def is_active(scene: bpy.types.Scene) -> bool:
    """Whether the pipeline should stand in this scene."""
    return bool(scene.hybrid.enabled and scene.library is None and not is_trace_scene(scene) and is_eevee(scene))


def why_inactive(scene: bpy.types.Scene) -> str:
    """Why an enabled scene has no pipeline, as one line for people; "" if it has one."""
    if scene.library is not None:
        return f"scene '{scene.name}' is linked from {scene.library.filepath}: enable Hybrid in that file"
    if is_trace_scene(scene):
        return f"scene '{scene.name}' belongs to the add-on: choose your own scene"
    if not is_eevee(scene):
        return (
            f"scene '{scene.name}' renders with {scene.render.engine}: set Render Engine to EEVEE for hybrid rendering"
        )
    return ""


def trace_scene(scene: bpy.types.Scene) -> bpy.types.Scene | None:
    """The trace scene of this scene, or None."""
    return trace_scenes.find(scene)


def own_collection(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """The scene's collection of held-out objects, or None."""
    return next((child for child in scene.collection.children if COLLECTION_MARK in child), None)


def effective_mode(scene: bpy.types.Scene) -> str:
    """The mode, but RASTER where nothing is ray traced: an empty mask costs nothing."""
    mode = scene.hybrid.mode
    return mode if mode != "HYBRID" or ray_traced_objects(scene) or ray_traced_materials(scene) else "RASTER"


def needs_raster(scene: bpy.types.Scene) -> bool:
    """Whether the tracer asks for EEVEE's picture and its depth, `Scene.raster`, beside the mask.

    Not where Grease Pencil lies over that picture: it has no part in the depth, whose pass decides what hides it.
    """
    wanted = scene.hybrid.raster_backed and effective_mode(scene) == "HYBRID"
    return bool(wanted and not draws_grease_pencil(scene))


def traces_shadows(scene: bpy.types.Scene) -> bool:
    """Whether the tracer, not EEVEE, draws the shadows of ray traced objects on what EEVEE draws.

    The same for all frames: EEVEE must know before anything is evaluated.
    """
    choice = scene.hybrid.traced_shadows
    if choice == "OFF" or effective_mode(scene) != "HYBRID":
        return False
    traced = (ray_traced_objects(scene), ray_traced_materials(scene))
    return choice == "ON" or scene.hybrid.caustics != "NONE" or transmit(scene, *traced)


def needs_albedo(scene: bpy.types.Scene) -> bool:
    """Whether light is brought to EEVEE's picture, which depends on the colour of what it shows."""
    return scene.hybrid.caustics == "PHOTONS" and traces_shadows(scene)


def ray_traced_objects(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The ray traced ones of them."""
    flags = Flags(scene)
    return [b_object for b_object in rendered_objects(scene) if flags.is_ray_traced(b_object)]


def missed(scene: bpy.types.Scene) -> list[str]:
    """Warnings of objects that are ticked, rendered, and yet not ray traced."""
    told, source = Warnings(), source_layer(scene)
    for ob in (ob for ob in Flags(scene).missed() if not ob.hide_render):
        told.add(
            f"object {ob.name!r} belongs to background scene {scene.background_set.name!r}: only EEVEE draws it; "
            f"link it to scene {scene.name!r} to have it ray traced"
        )
    for layer, names in other_layers(scene).items():
        if names:
            told.add(
                f"only view layer {source.name!r} is hybrid; in {layer!r} EEVEE draws {', '.join(names)}: "
                f"show them in {source.name!r}, or make {layer!r} the first layer"
            )
    return list(told)


def other_layers(scene: bpy.types.Scene) -> dict[str, list[str]]:
    """The view layers that are rendered beside the hybrid one; of each what is ticked there, but not shown in that."""
    flags, source, there = Flags(scene), source_layer(scene), set(rendered_objects(scene))
    return {
        layer.name: [ob.name for ob in layer.objects if ob not in there and flags.is_ray_traced(ob)]
        for layer in scene.view_layers
        if layer != source and layer.use and MASK_MARK not in layer
    }


def rendered_objects(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The objects whose collections the user's layer renders, each once, in the order of these.

    Only through collections that are neither excluded from the layer nor disabled for rendering: linking an object
    into our collection must not bring back what the user has switched off.
    """
    found: dict[str, bpy.types.Object] = {}
    ours = own_collection(scene)

    def walk(layer_collection: bpy.types.LayerCollection) -> None:
        collection = layer_collection.collection
        if collection == ours or collection.hide_render:
            return
        if not layer_collection.exclude:
            found.update((ob.name_full, ob) for ob in collection.objects)
        for child in layer_collection.children:
            walk(child)

    walk(source_layer(scene).layer_collection)
    return list(found.values())


# ------------------------------------------------------------------------------------------------ doors


def enable(scene: bpy.types.Scene) -> None:
    """Switch hybrid rendering on. Raises HybridError with the reason where the scene cannot be rendered hybrid."""
    if not isinstance(scene, bpy.types.Scene):
        raise HybridError(f"{scene!r} is not a scene: pass bpy.context.scene")
    reason = why_inactive(scene)
    if reason:
        raise HybridError(reason)
    scene.hybrid.enabled = True  # its update callback calls sync
    sync(scene)


def disable(scene: bpy.types.Scene) -> None:
    """Switch hybrid rendering off; the scene is then as it was before `enable`."""
    scene.hybrid.enabled = False
    sync(scene)


def object_changed(b_object: bpy.types.Object) -> None:
    """A ray traced flag changed: bring every scene that shows the object in step."""
    for scene in b_object.users_scene:
        scene_changed(scene)


def collection_changed() -> None:
    """A collection's flag changed: it may be in any scene, or shown in one."""
    for scene in _own_scenes():
        scene_changed(scene)


def scene_changed(scene: bpy.types.Scene) -> None:
    """A scene setting changed."""
    if not is_busy():
        sync(scene)


def passes_changed(scene: bpy.types.Scene) -> None:
    """Other passes are wanted: the node of the ray traced half gets their sockets."""
    trace = trace_scene(scene)
    if trace is None or is_busy():
        return
    for owner in (trace, scene):  # 4.5 updates the nodes in the compositor of the owner, 5.x those that show it
        owner.view_layers[0].update_render_passes()


def sync_all() -> None:
    """Bring every scene in step and remove what belonged to scenes that are gone."""
    for scene in _own_scenes():
        sync(scene)
    if not is_busy():
        _remove_orphans()


def rejoin_all() -> None:
    """Blender has gone one step through its history, which does not hold the trace scenes."""
    with guard() as entered:
        for scene in _own_scenes() if entered else ():
            if is_active(scene) and mask_layer(scene) is not None:
                compositor_setup.rejoin(scene, trace_scenes.ensure(scene))


def tear_down_all() -> None:
    """Take the pipeline out of every scene; their settings stay."""
    for scene in _own_scenes():
        tear_down(scene)


def _own_scenes() -> list[bpy.types.Scene]:
    """The user's scenes. Not ours: those come and go while one walks through this list."""
    return [scene for scene in bpy.data.scenes if not is_trace_scene(scene)]


def sync(scene: bpy.types.Scene) -> None:
    """Make the scene hold exactly the pipeline that its settings ask for; write nothing where it already does."""
    if not is_active(scene):
        tear_down(scene)
        return
    with guard() as entered:
        if not entered:
            return
        _disown_copies(scene)
        restore = Restore(scene)
        mode = effective_mode(scene)
        source = _sync_source(scene, restore, mode)
        collection = _sync_collection(scene)
        depth = needs_raster(scene) or (source.use_pass_z and draws_grease_pencil(scene))
        mask = sync_mask_layer(scene, source, collection, depth=depth, albedo=needs_albedo(scene))
        trace = trace_scenes.ensure(scene)
        drawn = "RETRACE" if session.of(scene.name).retracing else mode
        compositor_setup.sync(scene, source, mask, trace, drawn, restore)
        _sync_compositor(scene, restore)
        set_(mask, "use", mode == "HYBRID")
        set_(source, "use", compositor_setup.needs_source(scene, source, mode) or mode == "FULL")
        restore.save()


def tear_down(scene: bpy.types.Scene) -> None:
    """Remove everything that `sync` made, put back everything that it changed. Does nothing in a clean scene."""
    if is_trace_scene(scene) or scene.library is not None:
        return
    if not (scene.hybrid.restore or own_collection(scene) or trace_scene(scene) or mask_layer(scene)):
        return
    with guard() as entered:
        if not entered:
            return
        _disown_copies(scene)
        restore = Restore(scene)
        compositor_setup.tear_down(scene, restore)
        mask = mask_layer(scene)
        if mask is not None:
            scene.view_layers.remove(mask)
        for layer in scene.view_layers:
            if SOURCE_MARK in layer:
                set_(layer, "use", bool(restore.get("source_use", True)))
                if restore.get(FREESTYLE) is not None:
                    set_(layer.freestyle_settings, "as_render_pass", bool(restore.get(FREESTYLE)))
                del layer[SOURCE_MARK]
        collection = own_collection(scene)
        if collection is not None:
            bpy.data.collections.remove(collection)
        trace_scenes.release(scene)
        restore.clear()


# ------------------------------------------------------------------------------------------------ the parts


def _sync_source(scene: bpy.types.Scene, restore: Restore, mode: str) -> bpy.types.ViewLayer:
    source = source_layer(scene)
    if SOURCE_MARK not in source:
        source[SOURCE_MARK] = True
        restore.remember("source_use", source.use)
    if draws_freestyle(scene) and (mode == "HYBRID" or restore.get(FREESTYLE) is not None):
        restore.remember(FREESTYLE, source.freestyle_settings.as_render_pass)
        set_(source.freestyle_settings, "as_render_pass", mode == "HYBRID" or bool(restore.get(FREESTYLE)))
    restore.remember("use_single_layer", scene.render.use_single_layer)
    set_(scene.render, "use_single_layer", False)  # with it on Blender skips the trace scene
    return source


def _sync_collection(scene: bpy.types.Scene) -> bpy.types.Collection:
    collection = own_collection(scene)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
        collection[COLLECTION_MARK] = True
        scene.collection.children.link(collection)
    wanted = ray_traced_objects(scene)
    there = set(collection.objects)  # not by name: a linked object may have that of a local one
    for b_object in there.difference(wanted):
        collection.objects.unlink(b_object)
    for b_object in [b_object for b_object in wanted if b_object not in there]:
        collection.objects.link(b_object)
    return collection


def _sync_compositor(scene: bpy.types.Scene, restore: Restore) -> None:
    """Without a window, have the processor composite where that of the graphics card may end Blender.

    On Mesa's software OpenGL it does so in one of some hundred pictures: a shader that has been freed is taken for a
    new one at its address, and not bound (Mesa 22.3, llvmpipe). Without any OpenGL, in mode Full, it does so at once.
    """
    if bpy.app.background and opengl.draws_on_processor():
        restore.remember("compositor_device", scene.render.compositor_device)
        set_(scene.render, "compositor_device", "CPU")


def _disown_copies(scene: bpy.types.Scene) -> None:
    """A linked copy of a scene shares its collections: let go of ours where another scene holds it too."""
    collection = own_collection(scene)
    if collection is not None and collection in [own_collection(b) for b in _own_scenes() if b != scene]:
        scene.collection.children.unlink(collection)


def _remove_orphans() -> None:
    """What belonged to scenes that are gone."""
    trace_scenes.release_lost()
    collections = {own_collection(scene) for scene in _own_scenes()}
    for scene in [s for s in bpy.data.scenes if is_trace_scene(s) and s.library is None]:
        if len(bpy.data.scenes) > 1:  # of a file that an older release left one in
            bpy.data.scenes.remove(scene)
    for collection in list(bpy.data.collections):
        if COLLECTION_MARK in collection and collection not in collections and collection.library is None:
            bpy.data.collections.remove(collection)
    compositor_setup.remove_orphans()
