# SPDX-License-Identifier: GPL-3.0-or-later
"""The preview: as soon as a rendered viewport rests, its ray traced objects are traced over EEVEE's image.

    view.py     the viewport's camera
    job.py      the work, on a thread of its own
    display.py  the scene's colour management
    draw.py     the picture on the screen, below Blender's overlays
    reproject.py    the last picture while the view moves
    icon.py     the button's
    tint.py     what is ray traced, in color, as an overlay

The main thread only looks, translates the scene when it has changed, and draws. The first movement of the view drops
the work on a picture, the first change of the scene the picture, too.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import blf
import bpy
from bpy.app.handlers import persistent

from ..errors import HybridError, require_tracer
from ..flags import Flags
from ..pipeline import scene_setup
from ..render.settings import preview_settings
from ..session import FrameCaches
from . import icon, tint
from .display import Display
from .draw import Layer
from .job import Job
from .view import View

REST_SECONDS = 0.25
"""A view that has not moved for so long is at rest."""

TICK_SECONDS = 0.05
"""How often pictures are fetched from the work."""

CHANGES = ("depsgraph_update_post", "frame_change_post", "load_post", "undo_post", "redo_post")
"""Handlers that hear of a changed scene."""


@dataclass(eq=False)
class _Viewport:
    """One region of one 3D viewport."""

    view: View
    shown: frozenset[str] | None
    since: float
    edits: int
    job: Job | None = None
    layer: Layer | None = None
    moved: Layer | None = None  # the last one, of another view of the same scene
    status: str = ""
    problem: str = ""  # why there is no (further) picture; not tried again before anything changes


@dataclass(eq=False)
class _Preview:
    """What the preview remembers: of all viewports, and of the scene that they show.

    viewports  : by the address of their region.
    edits      : changes of the scene so far.
    translated : (edits, scene's name and what of it a view shows, the scene translated at that time).
    compiled   : (translated scene, the same ready to trace).
    caches     : (scene's name, what its last translation has left).
    draw       : Blender's handles of `_draw` and `_write`, while they are registered.
    say        : puts a line into the user's language.
    """

    viewports: dict[int, _Viewport] = field(default_factory=dict)
    edits: int = 0
    translated: tuple[int, tuple[str, frozenset[str] | None], Any] | None = None
    compiled: tuple[Any, Any] | None = None
    caches: tuple[str, FrameCaches] | None = None
    draw: tuple[Any, Any] | None = None
    say: Callable[[str], str] = str


_preview = _Preview()


def why_not(scene: bpy.types.Scene, space: bpy.types.SpaceView3D) -> str:
    """Why this viewport shows no preview, as one line for people; "" if it does."""
    if not (scene.hybrid.enabled and scene.hybrid.preview):
        return "the preview is off"
    if scene_setup.why_inactive(scene):
        return scene_setup.why_inactive(scene)
    shading = space.shading
    if shading.type != "RENDERED":
        return "set Viewport Shading to Rendered"
    if not (shading.use_scene_lights_render and shading.use_scene_world_render):
        return "switch Scene Lights and Scene World on in Viewport Shading"
    edited = _edited(scene)
    if edited:
        return f"'{edited}' is being edited: leave its mode"
    return ""


def _edited(scene: bpy.types.Scene) -> str:
    """The name of a ray traced object in a mode in which one works on it, so that it must be seen as it is."""
    active = getattr(bpy.context, "object", None)
    if active is None or active.mode in {"OBJECT", "POSE"}:
        return ""
    if scene.hybrid.mode == "FULL":
        return str(active.name)
    in_mode, traced = {active, *getattr(bpy.context, "objects_in_mode", ())}, Flags(scene).is_ray_traced
    return next((b_object.name for b_object in in_mode if traced(b_object)), "")


def shown_in(space: bpy.types.SpaceView3D, scene: bpy.types.Scene) -> frozenset[str] | None:
    """Full names of the objects that a viewport shows, in local view or with local collections; None: all."""
    if space.local_view is None and not space.use_local_collections:
        return None
    return frozenset(b_object.name_full for b_object in scene.objects if b_object.visible_in_viewport_get(space))


def status(context: bpy.types.Context) -> str:
    """Why the viewport of this context shows no preview, for its header; "" if it does, and says so over the view."""
    return why_not(context.scene, context.space_data)


# ------------------------------------------------------------------------------------------------ the viewport draws


def _draw() -> None:
    """Called by Blender in each redraw of each 3D viewport, after the scene."""
    context = bpy.context
    region, space, scene = context.region, context.space_data, context.scene
    _draw_picture(region, space, scene)
    if scene.hybrid.tint and space.overlay.show_overlays and scene_setup.is_active(scene):
        tint.draw(context, _preview.edits, shown_in(space, scene))


def _draw_picture(region: bpy.types.Region, space: bpy.types.SpaceView3D, scene: bpy.types.Scene) -> None:
    key = region.as_pointer()
    if why_not(scene, space):
        _forget(key)
        return
    viewport = _look(key, View.of(region, space, scene), shown_in(space, scene))
    size = region.width, region.height
    if viewport.layer is not None:
        viewport.layer.draw(size)
    elif viewport.moved is not None:
        viewport.moved.draw_moved(size, space.region_3d.perspective_matrix)


def _write() -> None:
    """Called by Blender after it, in pixels: how far the picture is, or why there is none."""
    context = bpy.context
    viewport = _preview.viewports.get(context.region.as_pointer())
    if viewport is None:
        return
    text = f"Hybrid {viewport.status}" if viewport.status and context.space_data.overlay.show_overlays else ""
    if viewport.problem:  # without overlays too: else nobody knows why there is no picture
        text = f"Hybrid: {_preview.say(viewport.problem)}"
    if not text:
        return
    scale = context.preferences.system.ui_scale
    tools = next((region.width for region in context.area.regions if region.type == "TOOLS"), 0)
    blf.size(0, 11 * scale)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 3, 0.0, 0.0, 0.0, 1.0)
    blf.color(0, 1.0, 1.0, 1.0, 1.0)
    blf.position(0, tools + 16 * scale, 14 * scale, 0)
    blf.draw(0, text)
    blf.disable(0, blf.SHADOW)


def _look(key: int, view: View, shown: frozenset[str] | None) -> _Viewport:
    """The viewport as it is now; what shows another view or an older scene is dropped."""
    viewport = _preview.viewports.get(key)
    same = viewport is not None and viewport.edits == _preview.edits and viewport.shown == shown
    if viewport is None or viewport.view != view or not same:
        moved = None
        if viewport is not None and same:
            moved = viewport.layer or viewport.moved
        _forget(key)
        viewport = _Viewport(view, shown, time.perf_counter(), _preview.edits, moved=moved)
        _preview.viewports[key] = viewport
        _wake()
    return viewport


def _forget(key: int) -> None:
    viewport = _preview.viewports.pop(key, None)
    if viewport is not None and viewport.job is not None:
        viewport.job.drop()


@persistent
def _on_change(*args: Any) -> None:
    _preview.edits += 1
    depsgraph = args[1] if len(args) > 1 else None
    if isinstance(depsgraph, bpy.types.Depsgraph):
        for b_update in depsgraph.updates:
            tint.touch(b_update)
    else:  # another file, undo: nothing is as it was
        tint.forget()


def forget() -> None:
    """Let go of what is kept of the scene for the next change of it."""
    _preview.translated = _preview.compiled = _preview.caches = None


def setting_changed() -> None:
    """A setting changed that the picture depends on, or the toggle: look again."""
    _preview.edits += 1
    for window in getattr(bpy.context.window_manager, "windows", ()):
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


# ------------------------------------------------------------------------------------------------ the timer works


def _wake() -> None:
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=TICK_SECONDS)


def _tick() -> float | None:
    """Begin work on views at rest, fetch pictures; sleeps when there is nothing to do."""
    if bpy.app.is_job_running("RENDER"):
        return 1.0
    alive = {}
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "WINDOW" and region.as_pointer() in _preview.viewports:
                        alive[region.as_pointer()] = (window, area, region)
    for key in set(_preview.viewports) - set(alive):
        _forget(key)
    waits = [_attend(_preview.viewports[key], *place) for key, place in alive.items()]
    return TICK_SECONDS if any(waits) else None


def _attend(viewport: _Viewport, window: Any, area: Any, region: Any) -> bool:
    """One step for one viewport; whether it waits for another."""
    job = viewport.job
    if job is None:
        if viewport.problem:
            return False
        if time.perf_counter() - viewport.since < REST_SECONDS:
            return True
        with bpy.context.temp_override(window=window, area=area, region=region):
            viewport.job = _start(viewport)
        if viewport.problem:
            area.tag_redraw()
        return viewport.job is not None
    done = job.done  # before the picture is taken: the last one comes before it
    picture = job.take_picture()
    if picture is not None:
        viewport.layer, viewport.status = Layer(picture, job.surface), picture.label
        area.tag_redraw()
    _keep(job)
    if job.problem and not viewport.problem:
        viewport.problem, viewport.moved = job.problem, None
        area.tag_redraw()
    return not done


def _start(viewport: _Viewport) -> Job | None:
    """Translate if the scene has changed, and set to work."""
    scene = bpy.context.scene
    try:
        require_tracer()
        translated = _translate(scene, viewport.view, viewport.shown)
    except (HybridError, MemoryError) as error:
        viewport.problem, viewport.moved = str(error) or "not enough memory for the preview", None
        return None
    compiled = _preview.compiled[1] if _preview.compiled is not None and _preview.compiled[0] is translated else None
    settings = preview_settings(scene)
    trees = None if _preview.caches is None else _preview.caches[1].trees
    return Job(translated, viewport.view, settings, Display.of(scene), scene.hybrid.preview_budget, compiled, trees)


def _translate(scene: bpy.types.Scene, view: View, shown: frozenset[str] | None) -> Any:
    from ...tracer.materials.textures import sample_texture
    from ..sync import MeshCache, translate

    of = (scene.name, shown)
    if _preview.translated is None or _preview.translated[:2] != (_preview.edits, of):
        depsgraph = bpy.context.evaluated_depsgraph_get()
        if _preview.caches is None or _preview.caches[0] != scene.name:
            _preview.caches = (scene.name, FrameCaches(MeshCache(learns=True)))
        translation = translate(
            depsgraph, scene, (1, 1), (0, 0, 1, 1),
            light_falloff=scene.hybrid.light_falloff, camera=view.camera(1), kept=_preview.caches[1].meshes,
            sample=sample_texture,
            shown=shown,
        )  # fmt: skip
        _preview.translated = (_preview.edits, of, translation.scene)
    return _preview.translated[2]


def _keep(job: Job) -> None:
    """Keep what has been prepared to trace for the next view of the same scene."""
    if job.compiled is not None:
        _preview.compiled = (job.scene, job.compiled)


# ------------------------------------------------------------------------------------------------ on and off


def register(say: Callable[[str], str]) -> None:
    """Add the draw handler; nothing runs in the background. say: puts a line into the user's language."""
    if bpy.app.background:
        return
    _preview.say = say
    icon.register()
    add = bpy.types.SpaceView3D.draw_handler_add
    _preview.draw = add(_draw, (), "WINDOW", "POST_VIEW"), add(_write, (), "WINDOW", "POST_PIXEL")
    for name in CHANGES:
        getattr(bpy.app.handlers, name).append(_on_change)


def unregister() -> None:
    """Remove it, and stop all work."""
    if _preview.draw is None:
        return
    for handle in _preview.draw:
        bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
    _preview.draw = None
    icon.unregister()
    for name in CHANGES:
        getattr(bpy.app.handlers, name).remove(_on_change)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    jobs = [viewport.job for viewport in _preview.viewports.values() if viewport.job is not None]
    _preview.viewports.clear()
    for job in jobs:
        job.join()
    forget()
    tint.forget()
