# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist is told in the window: why a render failed, what a picture lacks, and what to do about it."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_n as n_

from ...report.frame import summary
from .. import session
from ..pipeline import scene_setup
from .layout import paragraph
from .translations import iface, sentence


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
        paragraph(layout, context, sentence(str(own.error)), icon="ERROR")
    if not scene.hybrid.enabled:
        return
    hint = _nothing_to_trace(scene)
    if hint:
        paragraph(layout, context, iface(hint), icon="INFO")
    elif own.report and own.report["warnings"] and not own.error:
        paragraph(layout, context, counted(len(own.report["warnings"])), icon="ERROR")


def counted(warnings: int) -> str:
    """How many warnings the last picture has, and where they stand."""
    if warnings == 1:
        return iface("1 warning: see Report")
    return iface("{} warnings: see Report").format(warnings)


def _nothing_to_trace(scene: bpy.types.Scene) -> str:
    """Why the ray tracer has nothing to draw, and the ways out; "" if it has."""
    if scene.hybrid.mode != "HYBRID":
        return ""
    collection = scene_setup.own_collection(scene)
    objects = list(collection.objects) if collection is not None else []
    if not objects:
        return n_("No object is ray traced: tick Hybrid in an object's properties, or press Analyse")
    if all(b_object.hide_render for b_object in objects):
        return n_("All ray traced objects are hidden in renders: click their camera icons in the Outliner")
    report = session.of(scene.name).report
    if report and report["settings"].get("mode") == "HYBRID" and report["mask_pixels"] == 0:
        return n_("No ray traced object was in view in the last render: move the camera, or tick another object")
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


def draw_report(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """What the last render did, and all that it warned of."""
    report = session.of(context.scene.name).report
    if not report:
        paragraph(layout, context, iface("Nothing rendered yet"), icon="INFO")
        return
    first, second = summary(report)
    paragraph(layout, context, first)
    if not report["warnings"]:
        paragraph(layout, context, second)
    for warning in report["warnings"]:
        paragraph(layout, context, sentence(warning), icon="ERROR")


class HYBRID_OT_use_eevee(bpy.types.Operator):
    bl_idname = "hybrid.use_eevee"
    bl_label = "Switch to EEVEE"
    bl_description = "Render this scene with EEVEE, which draws all that is not ray traced"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.scene.render.engine = scene_setup.eevee()
        return {"FINISHED"}


CLASSES = (HYBRID_OT_use_eevee,)
