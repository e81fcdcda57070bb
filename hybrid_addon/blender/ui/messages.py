# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist is told in the window: why a render failed, what a picture lacks, and what to do about it.

Panels say it as long as it holds. What a render came to is said once, too: a popup for a failure, else the status bar.
"""

# No `from __future__ import annotations` here: Blender reads operator properties from the annotations themselves.

import ast
import re
from functools import partial
from typing import Any

import bpy
from bpy.app.translations import pgettext_n as n_

from .. import api, session
from ..errors import HybridError, require_tracer
from ..flags import flagged_collections
from ..pipeline import scene_setup, transmission
from ..render import main_thread
from .image_editor import slots
from .layout import paragraph
from .translations import iface, sentence, translated


def draw_state(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """What stands between this scene and its picture, most important first; nothing where all is well."""
    scene = context.scene
    problem = scene_setup.why_inactive(scene)
    if problem:
        if scene.hybrid.enabled or context.engine == scene_setup.ENGINE:
            _draw_problem(layout, context, problem)
        return
    own = session.of(scene.name)
    if own.error:
        text = iface("The last render failed: {}").format(translated(str(own.error)))
        paragraph(layout, context, text, icon="ERROR")
    if not scene.hybrid.enabled:
        return
    refused = "" if own.error else _blind(scene)
    if refused:
        paragraph(layout, context, sentence(refused), icon="ERROR")
    hint = nothing_to_trace(scene)
    if hint:
        paragraph(layout, context, iface(hint), icon="INFO")
    elif own.report and own.report["warnings"] and not own.error:
        paragraph(layout, context, counted(len(own.report["warnings"])), icon="ERROR")


def _blind(scene: bpy.types.Scene) -> str:
    """Why nothing can be seen of this scene; "" if something can."""
    try:
        api.check_camera(scene, scene.camera)
    except HybridError as error:
        return str(error)
    return ""


def counted(warnings: int) -> str:
    """How many warnings the last picture has, and where they stand."""
    if warnings == 1:
        return iface("1 warning: see Report")
    return iface("{} warnings: see Report").format(warnings)


def nothing_to_trace(scene: bpy.types.Scene) -> str:
    """Why the ray tracer has nothing to draw, and the ways out; "" if it has."""
    if scene.hybrid.mode != "HYBRID":
        return ""
    hint: str = transmission.until_changed(("nothing", scene.session_uid), lambda: _nothing_rendered(scene))
    if hint:
        return hint
    report = session.of(scene.name).report
    if report and report["settings"].get("mode") == "HYBRID" and report["mask_pixels"] == 0:
        return n_("No ray traced object was in view in the last render: move the camera, or tick another object")
    return ""


def _nothing_rendered(scene: bpy.types.Scene) -> str:
    objects = scene_setup.ray_traced_objects(scene)
    if scene_setup.ray_traced_materials(scene):
        objects = []
    elif not objects:
        return n_("No object is ray traced: tick Hybrid in an object's properties, or press Analyse")
    if objects and all(b_object.hide_render for b_object in objects):
        return n_("All ray traced objects are hidden in renders: click their camera icons in the Outliner")
    return ""


def _draw_problem(layout: bpy.types.UILayout, context: bpy.types.Context, problem: str) -> None:
    """Why Hybrid does nothing here, and the way out where it is one click."""
    scene = context.scene
    if scene.library is not None or scene_setup.is_trace_scene(scene):
        paragraph(layout, context, sentence(problem), icon="ERROR")
        return
    paragraph(layout, context, iface("Hybrid needs EEVEE"), icon="ERROR")
    row = layout.row()
    row.use_property_split = False
    row.operator("hybrid.use_eevee")


def draw_report(layout: bpy.types.UILayout, context: bpy.types.Context, report: dict[str, Any] | None = None) -> None:
    """What a render did, and all that it warned of. report: of which; None: the last one."""
    report = report or session.of(context.scene.name).report
    if not report:
        paragraph(layout, context, iface("Nothing rendered yet"), icon="INFO")
        return
    time = {name: clock["wall"] for name, clock in report["time"].items()}
    facts = (
        iface("{:.1f} s, of which EEVEE {:.1f} s").format(time.get("total", 0.0), time.get("raster", 0.0)),
        iface("{:.2f} million rays").format(sum(report["rays"].values()) / 1e6),
        iface("{:.1f} % of the picture ray traced").format(report["mask_coverage"] * 100),
    )
    for fact in facts:
        paragraph(layout, context, fact)
    broken = sum(report["invariants"].values())
    if broken:
        text = iface("{} rays went astray: please report it, with the file").format(broken)
        paragraph(layout, context, text, icon="ERROR")
    if not report["warnings"]:
        paragraph(layout, context, iface("No warnings"), icon="CHECKMARK")
    for warning in report["warnings"]:
        _draw_warning(layout, context, warning)


def _draw_warning(layout: bpy.types.UILayout, context: bpy.types.Context, warning: str) -> None:
    """One of them; with a button that selects what it names, if it names something of this file."""
    named = subject(warning)
    if named is None:
        paragraph(layout, context, sentence(warning), icon="ERROR")
        return
    row = layout.row()
    paragraph(row, context, sentence(warning), icon="ERROR", taken=BUTTON)
    button = row.operator("hybrid.select_subject", text="", icon="RESTRICT_SELECT_OFF", emboss=False)
    button.kind, button.name = named


BUTTON = 1.3
"""Widget units of the button beside a warning."""

NAMED = re.compile(r"""\b(object|material|light|world|image|camera) ('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")""")
"""How a warning names a datablock: its kind, and its name as repr() writes it."""

KINDS = {"object": "objects", "light": "objects", "camera": "objects", "material": "materials"}


def subject(warning: str) -> tuple[str, str] | None:
    """Kind and name of the object or material that a warning speaks of first; None if there is none in this file."""
    for kind, quoted in NAMED.findall(warning):
        name = ast.literal_eval(quoted)
        if kind in KINDS and name in getattr(bpy.data, KINDS[kind]):
            return kind, name
    return None


class HYBRID_OT_select_subject(bpy.types.Operator):
    bl_idname = "hybrid.select_subject"
    bl_label = "Select"
    bl_description = "Select the object that the warning names, or all that wear the material"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    kind: bpy.props.StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]
    name: bpy.props.StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]

    def execute(self, context: bpy.types.Context) -> set[str]:
        found = [b_object for b_object in context.view_layer.objects if self._is_meant(b_object)]
        if not found:
            self.report({"WARNING"}, iface("{} is not in this view layer").format(self.name))
            return {"CANCELLED"}
        for b_object in context.view_layer.objects:
            b_object.select_set(b_object in found)
        context.view_layer.objects.active = found[0]
        if self.kind == "material":
            names = [b_slot.material.name if b_slot.material else "" for b_slot in found[0].material_slots]
            found[0].active_material_index = names.index(self.name)
        return {"FINISHED"}

    def _is_meant(self, b_object: bpy.types.Object) -> bool:
        if self.kind == "material":
            return any(
                b_slot.material is not None and b_slot.material.name == self.name for b_slot in b_object.material_slots
            )
        return bool(b_object.name == self.name)


class HYBRID_OT_use_eevee(bpy.types.Operator):
    bl_idname = "hybrid.use_eevee"
    bl_label = "Switch to EEVEE"
    bl_description = "Render this scene with EEVEE, which draws all that is not ray traced"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.scene.render.engine = scene_setup.eevee()
        return {"FINISHED"}


# ------------------------------------------------------------------------------------------------ said once

EDITORS = {"PROPERTIES", "IMAGE_EDITOR"}
"""Editors with panels that tell of the last render."""


class HYBRID_OT_notice(bpy.types.Operator):
    bl_idname = "hybrid.notice"
    bl_label = "Hybrid"
    bl_description = "Say in the status bar, or in a popup if it is an error, what a render came to"
    bl_options = {"INTERNAL"}

    level: bpy.props.StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]
    text: bpy.props.StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]
    _timer: Any = None

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Blender shows reports of operators that handle events, not of those that Python calls: wait for a timer's."""
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        self.report({self.level}, self.text)
        return {"FINISHED"}


def say(level: str, text: str) -> None:
    """A line of level INFO, WARNING or ERROR in the newest window. From the main thread, from a timer or a callback."""
    windows = [] if bpy.app.background else list(bpy.context.window_manager.windows)
    if not windows:
        return
    for window in windows:
        for area in window.screen.areas:
            if area.type in EDITORS:
                area.tag_redraw()
    with bpy.context.temp_override(window=windows[-1]):
        bpy.ops.hybrid.notice("INVOKE_DEFAULT", level=level, text=text)


_failed: set[str] = set()  # names of scenes of which a failure has been said since their render began


def render_begins(scene: bpy.types.Scene) -> None:
    """A render of this scene begins."""
    _failed.discard(scene.name)


def frame_begins(scene: bpy.types.Scene) -> None:
    """A frame begins, on the render's thread, and EEVEE's half comes first: what must fail after it is said now."""
    if bpy.app.background or not scene_setup.is_active(scene):
        return
    try:
        require_tracer()
        api.check_camera(scene, scene.camera)
    except HybridError as error:
        session.of(scene.name).fail(error)
        main_thread.post(partial(_tell, scene.name))


def render_ended(name: str) -> None:
    """The render of the scene of this name is over, on whichever thread: what it came to is said soon."""
    main_thread.post(partial(_tell, name))


def _tell(name: str) -> None:
    scene = bpy.data.scenes.get(name)
    if scene is None or not scene.hybrid.enabled:
        return
    slots.changed(scene)
    level, text = outcome(scene)
    if text and not (level == "ERROR" and name in _failed):
        say(level, f"Hybrid: {text}")
    if level == "ERROR":
        _failed.add(name)


def outcome(scene: bpy.types.Scene) -> tuple[str, str]:
    """Level and text of what is to be said of the scene's last render; no text if all is well."""
    own = session.of(scene.name)
    if own.error:
        return "ERROR", sentence(str(own.error))
    hint = nothing_to_trace(scene)
    if hint:
        return "WARNING", iface(hint)
    if own.frame is not None and own.frame.report["warnings"]:
        return "WARNING", counted(len(own.frame.report["warnings"]))
    return "INFO", ""


def is_first(scene: bpy.types.Scene, ticked: bpy.types.ID | None = None) -> bool:
    """Whether Hybrid, which could work in this scene, is off, and nothing but `ticked` is ticked."""
    if scene.hybrid.enabled or scene_setup.why_inactive(scene):
        return False
    there = [b_object for b_object in scene.objects if b_object.hybrid.ray_traced] + flagged_collections(scene)
    there += scene_setup.ray_traced_materials(scene)
    return all(b_id == ticked for b_id in there)


def switch_on(scene: bpy.types.Scene) -> None:
    """The first tick of a scene means that it is to be rendered so: Hybrid is on, in the same undo step."""
    scene.hybrid.enabled = True
    main_thread.post(partial(say, "INFO", iface("Hybrid is on: ticked objects are ray traced in renders")))


CLASSES = (HYBRID_OT_use_eevee, HYBRID_OT_select_subject, HYBRID_OT_notice)
