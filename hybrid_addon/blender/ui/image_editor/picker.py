# SPDX-License-Identifier: GPL-3.0-or-later
"""Why is this pixel like this: click one in the Image Editor, read its ray tree beside it, in the sidebar."""

# No `from __future__ import annotations` here: Blender reads operator properties from the annotations themselves.

import contextlib
from dataclasses import dataclass

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ... import api, scan
from ...errors import HybridError
from ...render import engine, growing, main_thread
from ..translations import translated

TEXT = "Hybrid Pixel"
"""Name of the text datablock that holds the last answer."""


@dataclass(frozen=True, eq=False)
class Answer:
    """What was last said of a pixel. of: scene's name, and what its size came from; x, y: of the full frame."""

    of: tuple[object, ...]
    x: int
    y: int
    lines: tuple[str, ...]


_last: list[Answer] = []


def answered(scene: bpy.types.Scene) -> Answer | None:
    """What was last said of a pixel of this scene, unless its size or its border has changed since then."""
    return _last[0] if _last and _last[0].of == (scene.name, growing.frame_of(scene)) else None


def forget() -> None:
    """Another file: let go of the answer."""
    _last.clear()


def refusal(scene: bpy.types.Scene) -> str:
    """Why no pixel of this scene can be explained, as one line for people; "" if it can."""
    if not scene.hybrid.enabled:
        return "Hybrid is off in this scene"
    try:
        api.check_camera(scene, scene.camera)
    except HybridError as error:
        return str(error)
    if scene.render.use_multiview:
        return f"scene '{scene.name}' renders several views: switch Stereoscopy off (Properties > Output)"
    return ""


def shown_window(scene: bpy.types.Scene) -> tuple[int, int, int, int]:
    """The part of the frame that the Render Result shows, in pixels: all of it, unless it is cropped to the border."""
    width, height = scan.full_size(scene)
    if not (scene.render.use_border and scene.render.use_crop_to_border):
        return (0, 0, width, height)
    return engine.border(scene, (width, height))


def pixel_at(scene: bpy.types.Scene, u: float, v: float) -> tuple[int, int]:
    """The frame's pixel at (u, v) of the picture as shown, 0..1 from its lower left; HybridError beside the picture."""
    if not (0 <= u < 1 and 0 <= v < 1):
        raise HybridError("click within the picture")
    x0, y0, x1, y1 = shown_window(scene)
    return x0 + int(u * (x1 - x0)), y0 + int(v * (y1 - y0))


def shows_render(space: bpy.types.Space | None) -> bool:
    """Whether this editor shows Blender's Render Result."""
    return space is not None and space.type == "IMAGE_EDITOR" and getattr(space.image, "type", "") == "RENDER_RESULT"


class HYBRID_OT_explain_pixel(bpy.types.Operator):
    bl_idname = "hybrid.explain_pixel"
    bl_label = "Why Is This Pixel Like This?"
    bl_description = "Click a pixel to read its rays: the objects that they hit, and the light that each contributes"
    bl_options = {"REGISTER", "UNDO"}

    x: bpy.props.IntProperty(name="X", description="From the left edge of the frame", min=0)  # type: ignore[valid-type]
    y: bpy.props.IntProperty(name="Y", description="From the lower edge of the frame", min=0)  # type: ignore[valid-type]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        reason = refusal(context.scene)
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if not shows_render(context.space_data):
            return context.window_manager.invoke_props_dialog(self)
        context.window_manager.modal_handler_add(self)
        context.window.cursor_modal_set("EYEDROPPER")
        context.workspace.status_text_set(iface_("Click a pixel of the picture.  Esc: Cancel"))
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self._leave(context)
            return {"CANCELLED"}
        if event.type != "LEFTMOUSE" or event.value != "PRESS":
            return {"PASS_THROUGH"}  # zoom and pan
        self._leave(context)
        region = next(region for region in context.area.regions if region.type == "WINDOW")
        try:
            u, v = region.view2d.region_to_view(event.mouse_x - region.x, event.mouse_y - region.y)
            self.x, self.y = pixel_at(context.scene, u, v)
        except HybridError as error:
            self.report({"WARNING"}, str(error))
            return {"CANCELLED"}
        result = self.execute(context)
        if result == {"FINISHED"}:
            _show_beside(context, event.mouse_x - region.x)
        return result

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            answer = scan.explained(self.x, self.y, context.scene, translated)
        except HybridError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        text = bpy.data.texts.get(TEXT) or bpy.data.texts.new(TEXT)
        text.from_string(answer)
        _last[:] = [Answer((context.scene.name, growing.frame_of(context.scene)), self.x, self.y,
                           tuple(answer.splitlines()))]  # fmt: skip
        self.report({"INFO"}, f"{answer.splitlines()[0]} (text '{TEXT}')")
        return {"FINISHED"}

    def _leave(self, context: bpy.types.Context) -> None:
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)


def _show_beside(context: bpy.types.Context, x: float) -> None:
    """Open the sidebar at our tab, and move the picture out from under it if the pixel, `x` pixels to the right, is
    there."""
    area, space = context.area, context.space_data
    region = next(region for region in area.regions if region.type == "WINDOW")
    sidebar = next((region for region in area.regions if region.type == "UI"), None)
    space.show_region_ui = True
    if sidebar is None:
        return
    main_thread.post(lambda: _choose_tab(area, sidebar))
    hidden = x - (region.width - SIDEBAR * context.preferences.system.ui_scale)
    if context.preferences.system.use_region_overlap and hidden > 0:
        with context.temp_override(area=area, region=region):
            bpy.ops.image.view_pan("EXEC_DEFAULT", offset=(hidden / max(space.zoom[0], 1e-3), 0.0))


SIDEBAR = 270
"""Pixels of a display of scale 1 at the right edge that the sidebar may hide."""


def _choose_tab(area: bpy.types.Area, sidebar: bpy.types.Region) -> None:
    """Once the sidebar is open: a closed one has no tabs yet."""
    with contextlib.suppress(ReferenceError, TypeError, AttributeError):
        sidebar.active_panel_category = "Hybrid"
        area.tag_redraw()


CLASSES = (HYBRID_OT_explain_pixel,)
