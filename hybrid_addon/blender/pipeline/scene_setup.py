# SPDX-License-Identifier: GPL-3.0-or-later
"""What a hybrid scene has that a plain one has not: set up, kept in step, taken away again without a trace.

    for each view layer with ray traced objects:
    user's scene                                      "Hybrid Trace" scene (engine HYBRID_TRACER; trace_scenes.py)
      view layer "Hybrid Mask"                          in a render: background_set = the user's scene, so that it
        holds the ray traced ones out                   shows its objects without linking one of them
      compositor: Render Layers (mask) + Render Layers (trace) -> Hybrid -> whatever the user's Render Layers fed

`sync(scene)` is idempotent: it compares what is there with what should be there and writes only the differences, so
it can run after any change, undo, load, copy or append. `tear_down(scene)` is its inverse. Nothing else edits the
scene. Both run on the main thread only, never from a render handler in a window (that crashes Blender).
"""

from __future__ import annotations

from collections.abc import Collection

import bpy

from .. import session
from ..errors import HybridError
from ..flags import background_sets
from ..lines import draws_freestyle, draws_grease_pencil
from ..view_layers import (
    choose_sources,
    in_work,
    mask_layers,
    mask_of,
    number_of,
    own_layers,
    release_source,
    rendered_layers,
    set_,
    set_use,
    source_layers,
    sync_mask_layer,
)
from ..view_layers import mask_layer as mask_layer  # for who asks here
from ..view_layers import source_layer as source_layer
from . import compositor_setup, opengl, trace_scenes
from .guard import guard, is_busy
from .held_out import ray_traced_materials as ray_traced_materials
from .restore import Restore
from .trace_scenes import ENGINE as ENGINE
from .trace_scenes import is_trace_scene as is_trace_scene
from .traced_objects import COLLECTION_MARK, held_out_by_collection
from .traced_objects import missed as missed
from .traced_objects import ray_traced_objects as ray_traced_objects
from .traced_objects import rendered_objects as rendered_objects
from .transmission import transmit

COLLECTION = "Hybrid Traced"
FREESTYLE = "freestyle_as_render_pass"  # of what was changed in the user's layer


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
    """The trace scene of this scene's hybrid layer in work, else of its first one; None."""
    return trace_scenes.find(scene, source_layer(scene))


def own_collections(scene: bpy.types.Scene) -> list[bpy.types.Collection]:
    """The scene's collections of held-out objects."""
    return [child for child in scene.collection.children if COLLECTION_MARK in child]


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
    for scene in _own_scenes():
        if not {scene, *background_sets(scene)}.isdisjoint(b_object.users_scene):
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
            for source in source_layers(scene) if is_active(scene) else ():
                if mask_of(scene, source) is not None:
                    compositor_setup.rejoin(scene, source, trace_scenes.ensure(scene, source))


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
        choose_sources(scene, _hybrid_layers(scene, mode))
        held_out = {source: _sync_collection(scene, source) for source in source_layers(scene)}
        _remove_collections(scene, keep=held_out.values())
        halves = [_sync_layer(scene, source, collection, restore, mode) for source, collection in held_out.items()]
        _sync_render(scene, restore)
        drawn = "RETRACE" if session.of(scene.name).retracing else mode
        compositor_setup.sync(scene, halves, drawn, restore)
        for source, mask, _ in halves:
            set_(mask, "use", mode == "HYBRID")
            set_use(source, compositor_setup.needs_source(scene, source, mode) or mode == "FULL")
        trace_scenes.release_others(scene, {number_of(half.source) for half in halves})
        restore.save()


def tear_down(scene: bpy.types.Scene) -> None:
    """Remove everything that `sync` made, put back everything that it changed. Does nothing in a clean scene."""
    if is_trace_scene(scene) or scene.library is not None:
        return
    if not (scene.hybrid.restore or own_collections(scene) or trace_scene(scene) or mask_layers(scene)):
        return
    with guard() as entered:
        if not entered:
            return
        _disown_copies(scene)
        restore = Restore(scene)
        compositor_setup.tear_down(scene, restore)
        for mask in mask_layers(scene):
            scene.view_layers.remove(mask)
        for layer in own_layers(scene):
            freestyle = restore.get(f"{FREESTYLE} {number_of(layer)}")
            if freestyle is not None:
                set_(layer.freestyle_settings, "as_render_pass", bool(freestyle))
            release_source(layer)
        _remove_collections(scene)
        trace_scenes.release(scene)
        restore.clear()


# ------------------------------------------------------------------------------------------------ the parts


def _hybrid_layers(scene: bpy.types.Scene, mode: str) -> list[bpy.types.ViewLayer]:
    """The view layers that are hybrid in this mode: all in which something is traced."""
    layers = rendered_layers(scene)
    if mode == "HYBRID":
        return [each for each in layers if ray_traced_objects(scene, each) or ray_traced_materials(scene, each)]
    return layers if mode == "FULL" else layers[:1]


def _sync_layer(
    scene: bpy.types.Scene,
    source: bpy.types.ViewLayer,
    held_out: bpy.types.Collection | None,
    restore: Restore,
    mode: str,
) -> compositor_setup.Halves:
    with in_work(scene, source):
        name = f"{FREESTYLE} {number_of(source)}"
        if draws_freestyle(scene) and (mode == "HYBRID" or restore.get(name) is not None):
            restore.remember(name, source.freestyle_settings.as_render_pass)
            set_(source.freestyle_settings, "as_render_pass", mode == "HYBRID" or bool(restore.get(name)))
        depth = needs_raster(scene) or (source.use_pass_z and draws_grease_pencil(scene))
        ours, albedo = own_collections(scene), needs_albedo(scene)
        mask = sync_mask_layer(scene, source, held_out, ours, depth=depth, albedo=albedo)
        return compositor_setup.Halves(source, mask, trace_scenes.ensure(scene, source))


def _sync_collection(scene: bpy.types.Scene, source: bpy.types.ViewLayer) -> bpy.types.Collection | None:
    """The collection of what a layer holds out by it; None: nothing."""
    wanted, number = held_out_by_collection(scene, source), number_of(source)
    if not wanted:
        return None
    collection = next((c for c in own_collections(scene) if c[COLLECTION_MARK] == number), None)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
        collection[COLLECTION_MARK] = number
        scene.collection.children.link(collection)
    there = set(collection.objects)  # not by name: a linked object may have that of a local one
    for b_object in there.difference(wanted):
        collection.objects.unlink(b_object)
    for b_object in [b_object for b_object in wanted if b_object not in there]:
        collection.objects.link(b_object)
    return collection


def _remove_collections(scene: bpy.types.Scene, keep: Collection[bpy.types.Collection | None] = ()) -> None:
    for collection in own_collections(scene):
        if collection not in keep:
            bpy.data.collections.remove(collection)


def _sync_render(scene: bpy.types.Scene, restore: Restore) -> None:
    restore.remember("use_single_layer", scene.render.use_single_layer)
    set_(scene.render, "use_single_layer", False)  # with it on Blender skips the trace scene
    _sync_compositor(scene, restore)


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
    others = [c for other in _own_scenes() if other != scene for c in own_collections(other)]
    for collection in own_collections(scene):
        if collection in others:
            scene.collection.children.unlink(collection)


def _remove_orphans() -> None:
    """What belonged to scenes that are gone."""
    trace_scenes.release_lost()
    collections = {collection for scene in _own_scenes() for collection in own_collections(scene)}
    for scene in [s for s in bpy.data.scenes if is_trace_scene(s) and s.library is None]:
        if len(bpy.data.scenes) > 1:  # of a file that an older release left one in
            bpy.data.scenes.remove(scene)
    for collection in list(bpy.data.collections):
        if COLLECTION_MARK in collection and collection not in collections and collection.library is None:
            bpy.data.collections.remove(collection)
    compositor_setup.remove_orphans()
