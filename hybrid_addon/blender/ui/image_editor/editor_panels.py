# SPDX-License-Identifier: GPL-3.0-or-later
"""The Image Editor's tab *Hybrid*: retrace, what is shown, why a pixel is as it is, the report."""

from __future__ import annotations

import bpy

from ... import session
from .. import messages
from ..layout import field, paragraph
from ..translations import CONTEXT, iface, sentence
from . import picker, slots

BRANCH = 0.6
"""Widget units by which what a ray became is set in."""

SPACE = 1.0
"""Widget units that Blender leaves around what is set in."""

DEEPEST = 4
"""From this many bounces on nothing is set in further: the sidebar is narrow."""

LINES = 24
"""As many rays of a pixel are shown; the text has them all."""


class EditorPanel:
    """What the panels of this tab have in common."""

    bl_space_type = "IMAGE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Hybrid"


class HYBRID_IMAGE_PT_settings(EditorPanel, bpy.types.Panel):
    bl_label = "Hybrid"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene.hybrid.enabled and picker.shows_render(context.space_data)

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.hybrid
        messages.draw_state(layout, context)
        layout.operator("hybrid.retrace", icon="FILE_REFRESH")
        layout.operator("hybrid.explain_pixel", text="Why This Pixel?", icon="EYEDROPPER")
        field(layout, context, settings, "shown")
        if settings.shown == slots.LAST_CHOICE:
            field(layout, context, settings, "compare_slot")
        problem = slots.problem(context.scene)
        if problem:
            paragraph(layout, context, sentence(problem), icon="INFO")
        elif settings.shown != "PICTURE":
            field(layout, context, settings, "wipe")
        field(layout, context, settings, "insets")


class HYBRID_IMAGE_PT_pixel(EditorPanel, bpy.types.Panel):
    bl_label = "Why This Pixel?"
    bl_parent_id = "HYBRID_IMAGE_PT_settings"
    bl_order = 1

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return picker.answered(context.scene) is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout, answer = self.layout, picker.answered(context.scene)
        if answer is None:
            return
        for line in answer.lines[:LINES]:
            text = line.lstrip("└├│ ")
            deep = min((len(line) - len(text)) // 2, DEEPEST)
            row = layout.row()
            if deep:
                row.separator(factor=deep * BRANCH / 0.3)  # Blender's separator is 0.3 units at factor 1
            icon, taken = ("DOT", deep * BRANCH + SPACE) if deep else ("NONE", 0.0)
            paragraph(row, context, sentence(text), icon=icon, taken=taken)
        if len(answer.lines) > LINES:
            text = iface("{} more lines: text '{}'").format(len(answer.lines) - LINES, picker.TEXT)
            paragraph(layout, context, text)


class HYBRID_IMAGE_PT_report(EditorPanel, bpy.types.Panel):
    bl_label = "Report"
    bl_translation_context = CONTEXT
    bl_parent_id = "HYBRID_IMAGE_PT_settings"
    bl_order = 2

    def draw(self, context: bpy.types.Context) -> None:
        frame = session.of(context.scene.name).frame_in(slots.active())
        messages.draw_report(self.layout, context, None if frame is None else frame.report)


CLASSES = (HYBRID_IMAGE_PT_settings, HYBRID_IMAGE_PT_pixel, HYBRID_IMAGE_PT_report)
