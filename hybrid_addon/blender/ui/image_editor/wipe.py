# SPDX-License-Identifier: GPL-3.0-or-later
"""The line between two pictures in the Image Editor, to be dragged: before and after."""

from __future__ import annotations

from typing import Any

import bpy

from . import slots

REACH = 8
"""Pixels of a display of scale 1 from the line, within which it is grasped."""

IDLE, GRASPED = (1.0, 1.0, 1.0, 0.7), (1.0, 0.75, 0.2, 1.0)


def is_shown(context: bpy.types.Context) -> bool:
    """Whether there is a line: another picture is chosen, and there."""
    scene = context.scene
    if scene.hybrid.shown == "PICTURE":
        return False
    if scene.hybrid.shown == slots.LAST_CHOICE:
        return not slots.problem(scene) and slots.other_picture(scene) is not None
    return slots.frame_shown(scene) is not None


def place(context: bpy.types.Context) -> float:
    """Where the line stands, in pixels from the region's left edge."""
    return float(context.region.view2d.view_to_region(context.scene.hybrid.wipe, 0.0, clip=False)[0])


class HYBRID_GT_wipe(bpy.types.Gizmo):
    """The line: it draws itself, and follows the mouse."""

    bl_idname = "HYBRID_GT_wipe"

    def draw(self, context: bpy.types.Context) -> None:
        """In each redraw of an image editor."""
        if not is_shown(context):
            return
        from ...preview.draw import line

        x, scale = place(context), context.preferences.system.ui_scale
        low, high = (context.region.view2d.view_to_region(0.0, y, clip=False)[1] for y in (0.0, 1.0))
        size = context.region.width, context.region.height
        line((x, low), (x, high), GRASPED if self.is_highlight or self.is_modal else IDLE, 1.5 * scale, size)

    def test_select(self, context: bpy.types.Context, location: Any) -> int:
        """Grasped near the line."""
        near = REACH * context.preferences.system.ui_scale
        return 0 if is_shown(context) and abs(location[0] - place(context)) <= near else -1

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Grasped."""
        self.before = context.scene.hybrid.wipe
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event, _tweak: Any) -> set[str]:
        """It follows."""
        u, _ = context.region.view2d.region_to_view(event.mouse_region_x, event.mouse_region_y)
        context.scene.hybrid.wipe = min(max(u, 0.0), 1.0)
        return {"RUNNING_MODAL"}

    def exit(self, context: bpy.types.Context, cancel: bool) -> None:
        """Let go of, or Esc: where it was."""
        if cancel:
            context.scene.hybrid.wipe = self.before


CLASSES = (HYBRID_GT_wipe,)
