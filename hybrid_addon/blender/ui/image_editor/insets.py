# SPDX-License-Identifier: GPL-3.0-or-later
"""What a hybrid picture is made of, over the Render Result in the Image Editor: two small pictures, or a whole one.

A gizmo draws them, not a draw handler: Blender calls those while it holds the locks of the image. Python waits there
until the engine lets go of the interpreter, the engine, which reads the render result, for the locks: for ever.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any
from weakref import ref

import blf
import bpy
import numpy as np

from ....scene import Float32
from ... import session
from ...preview.display import Display
from ...render import growing
from ...session import Frame, SoFar
from ..translations import iface, sentence
from . import picker, slots, wipe

PIXELS = 320
"""Largest width and height of the pictures that are kept for drawing."""

SHARE = 0.2
"""Width of an inset, as a share of the editor's."""

MARGIN, LABEL = 10, 11
"""Around each inset, and the size of its name, in pixels of a display of scale 1."""

MARKER = 9
"""Least width of the frame around a pixel that was asked for, likewise."""

BAR = 3
"""Height of the bar that says how far a render is, likewise."""


@dataclass(eq=False)
class _Drawn:
    """What was drawn last, each with what it was made of; the same is not made again.

    pictures : (frame and display, what the insets look like).
    quads    : (the same and their rectangles, what is drawn).
    part     : (frame, display and what is shown; what that looks like).
    whole    : (the same and where, what is drawn).
    growing  : (picture so far, display, what it looks like; where, what is drawn).

    A frame is known by a weak reference: its planes are large, and the address of one that is gone is another's soon.
    """

    pictures: tuple[Any, dict[str, Float32]] | None = None
    quads: tuple[Any, list[tuple[str, Any]]] | None = None
    part: tuple[Any, Float32 | None] | None = None
    whole: tuple[Any, Any] | None = None
    growing: tuple[Float32, Display, Float32, Any, Any] | None = None


_drawn = _Drawn()


class HYBRID_GT_insets(bpy.types.Gizmo):
    """Draws, and cannot be touched."""

    bl_idname = "HYBRID_GT_insets"

    def draw(self, context: bpy.types.Context) -> None:
        """In each redraw of an image editor."""
        so_far = growing_in(context)
        if so_far is not None:
            _draw_growing(context, so_far)
            return
        frame = slots.frame_shown(context.scene)
        if wipe.is_shown(context):
            _draw_whole(context, frame)
        if frame is not None and context.scene.hybrid.insets:
            _draw(context, frame)
        _draw_marker(context)

    def test_select(self, _context: bpy.types.Context, _location: Any) -> int:
        """Never hit."""
        return -1


class HYBRID_GGT_insets(bpy.types.GizmoGroup):
    """Where the insets are shown: in image editors with the Render Result, if the scene wants them."""

    bl_idname = "HYBRID_GGT_insets"
    bl_label = "Hybrid Insets"
    bl_space_type = "IMAGE_EDITOR"
    bl_region_type = "WINDOW"
    bl_options = {"PERSISTENT"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether this editor has them."""
        settings = context.scene.hybrid
        wanted = settings.insets or settings.shown != "PICTURE" or growing_in(context) is not None
        wanted = wanted or picker.answered(context.scene) is not None
        return settings.enabled and wanted and picker.shows_render(context.space_data)

    def setup(self, _context: bpy.types.Context) -> None:
        """Once for each editor."""
        self.gizmos.new(HYBRID_GT_insets.bl_idname)
        line = self.gizmos.new(wipe.HYBRID_GT_wipe.bl_idname)
        line.use_draw_modal = True


def growing_in(context: bpy.types.Context) -> SoFar | None:
    """What a render of this scene, that runs or was stopped, has to show in the slot that is shown; None: nothing.

    Once stopped it is not shown over another resolution or render border, where its pixels would lie wrong.
    """
    so_far = session.of(context.scene.name).so_far  # once: the render's thread puts another one there at any time
    image = bpy.data.images.get("Render Result")
    if so_far is None or image is None or image.render_slots.active_index != so_far.slot:
        return None
    return so_far if so_far.frame == growing.frame_of(context.scene) else None


def _draw_growing(context: bpy.types.Context, so_far: SoFar) -> None:
    """The picture so far over whatever Blender shows of it, and how far it is along its lower edge."""
    region, scale = context.region, context.preferences.system.ui_scale
    rectangle = _rectangle(context, so_far.window)
    if so_far.picture is not None:
        display, last = Display.of(context.scene), _drawn.growing
        if last is None or last[0] is not so_far.picture or last[1] != display:
            shown = display.encode_by_table(so_far.picture)
            pixels = np.dstack([shown, np.ones_like(shown[..., :1])])
            last = _drawn.growing = (so_far.picture, display, pixels, rectangle, _quad(pixels, rectangle))
        elif last[3] != rectangle:
            last = _drawn.growing = (*last[:3], rectangle, _quad(last[2], rectangle))
        last[4].draw((region.width, region.height))
    x0, y0, x1, _ = rectangle
    if so_far.fraction is not None:
        height, until = BAR * scale, x0 + (x1 - x0) * so_far.fraction
        for right, color in ((x1, (0.0, 0.0, 0.0, 1.0)), (until, (0.3, 0.55, 1.0, 1.0))):
            bar = np.broadcast_to(np.array(color, np.float32), (1, 1, 4))
            _quad(bar, (x0, y0, max(right, x0 + 1), y0 + height)).draw((region.width, region.height))
    if so_far.text:
        _label(f"Hybrid: {sentence(so_far.text)}", x0 + 6 * scale, y0 + (BAR + 6) * scale, scale)


def _rectangle(context: bpy.types.Context, window: tuple[int, int, int, int]) -> tuple[int, ...]:
    """Where a part of the frame lies in the region, (x0, y0, x1, y1) in its pixels."""
    x0, y0, x1, y1 = picker.shown_window(context.scene)
    corners = [((x - x0) / (x1 - x0), (y - y0) / (y1 - y0)) for x, y in (window[:2], window[2:])]
    return tuple(n for corner in corners for n in context.region.view2d.view_to_region(*corner, clip=False))


def _draw_whole(context: bpy.types.Context, frame: Frame | None) -> None:
    """One of the parts, or another slot's picture, over the picture's left part, up to the wipe."""
    scene, region, settings = context.scene, context.region, context.scene.hybrid
    display = Display.of(scene)
    if settings.shown == slots.LAST_CHOICE:
        pixels, window = slots.other_picture(scene), picker.shown_window(scene)
        name = iface("Slot {}").format(settings.compare_slot)
        key: Any = id(pixels)
    elif frame is not None:
        key, window = (ref(frame), display, settings.shown), frame.window
        if _drawn.part is None or _drawn.part[0] != key:
            _drawn.part = (key, part(frame, display, settings.shown))
        pixels = _drawn.part[1]
        name = iface(settings.bl_rna.properties["shown"].enum_items[settings.shown].name)
    else:
        return
    x0, y0, x1, y1 = rectangle = _rectangle(context, window)
    until = min(max(round(wipe.place(context)), x0), x1)
    if pixels is None or until <= x0:
        return
    if _drawn.whole is None or _drawn.whole[0] != (key, rectangle, until):
        columns = min(max(1, round(pixels.shape[1] * (until - x0) / (x1 - x0))), pixels.shape[1])
        shown = x0 + (x1 - x0) * columns / pixels.shape[1]
        quad = _quad(np.ascontiguousarray(pixels[:, :columns]), (x0, y0, shown, y1))
        _drawn.whole = ((key, rectangle, until), quad)
    _drawn.whole[1].draw((region.width, region.height))
    scale = context.preferences.system.ui_scale
    _label(name, max(x0, 0) + 4 * scale, min(y1, region.height) - (LABEL + 3) * scale, scale)


def _draw_marker(context: bpy.types.Context) -> None:
    """Around the pixel of which the panel tells."""
    from ...preview.draw import line

    answer = picker.answered(context.scene)
    if answer is None:
        return
    scale, size = context.preferences.system.ui_scale, (context.region.width, context.region.height)
    x0, y0, x1, y1 = _rectangle(context, (answer.x, answer.y, answer.x + 1, answer.y + 1))
    wider = max(0.0, (MARKER * scale - (x1 - x0)) / 2)
    x0, y0, x1, y1 = x0 - wider, y0 - wider, x1 + wider, y1 + wider
    corners = ((x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0))
    for color, width in (((0.0, 0.0, 0.0, 1.0), 3.0), ((1.0, 1.0, 1.0, 1.0), 1.0)):
        for start, end in pairwise(corners):
            line(start, end, color, width * scale, size)


def part(frame: Frame, display: Display, shown: str) -> Float32 | None:
    """What a part of a frame looks like: (h, w, 4) display values, opaque; None if there is none of it."""
    if shown == "MASK":
        gray = np.clip(np.asarray(frame.mask, np.float32), 0, 1)
        return np.dstack([gray, gray, gray, np.ones_like(gray)])
    half = frame.raster if shown == "RASTER" else frame.traced
    if half is None:
        return None
    return np.dstack([display.encode(np.asarray(half[..., :3], np.float32)), np.ones(frame.mask.shape, np.float32)])


def _draw(context: bpy.types.Context, frame: Frame) -> None:
    key = (ref(frame), Display.of(context.scene))
    if _drawn.pictures is None or _drawn.pictures[0] != key:
        _drawn.pictures = (key, pictures(frame, key[1]))
    scale = context.preferences.system.ui_scale
    rectangles = _rectangles(context, frame.mask.shape, round(MARGIN * scale))
    if _drawn.quads is None or _drawn.quads[0] != (key, rectangles):
        _drawn.quads = ((key, rectangles), _make_quads(_drawn.pictures[1], rectangles))
    for (name, quad), (x0, _, _, y1) in zip(_drawn.quads[1], rectangles, strict=True):
        quad.draw((context.region.width, context.region.height))
        _label(name, x0 + 4 * scale, y1 - (LABEL + 3) * scale, scale)


def _label(text: str, x: float, y: float, scale: float) -> None:
    """Small white letters with a shadow."""
    blf.size(0, LABEL * scale)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 3, 0.0, 0.0, 0.0, 1.0)
    blf.color(0, 1.0, 1.0, 1.0, 1.0)
    blf.position(0, x, y, 0)
    blf.draw(0, text)
    blf.disable(0, blf.SHADOW)


def pictures(frame: Frame, display: Display) -> dict[str, Float32]:
    """What a frame's insets look like, small: (h, w, 4) display values, opaque."""
    planes = (frame.mask[..., None], frame.traced[..., :3])
    mask, traced = (_shrink(np.asarray(plane, np.float32)) for plane in planes)
    gray = np.repeat(np.clip(mask, 0, 1), 3, axis=2)
    opaque = np.ones_like(mask)
    return {name: np.dstack([rgb, opaque]) for name, rgb in (("Mask", gray), ("Traced", display.encode(traced)))}


def _shrink(plane: Float32) -> Float32:
    """Means of blocks, so that at most PIXELS are left either way; what does not fill a block is left out."""
    step = -(-max(plane.shape[:2]) // PIXELS)
    rows, columns = (max(1, n // step) for n in plane.shape[:2])
    if step == 1:
        return plane
    block = plane[: rows * step, : columns * step]
    height, width = min(step, block.shape[0]), min(step, block.shape[1])
    return block.reshape(rows, height, columns, width, -1).mean(axis=(1, 3), dtype=np.float32)


def _rectangles(context: Any, shape: tuple[int, ...], margin: int) -> tuple[tuple[int, int, int, int], ...]:
    """Where they are drawn in the region: its lower right corner, beside the sidebar."""
    region = context.region
    sidebar = next((r for r in context.area.regions if r.type == "UI"), None)
    right = region.width - margin - (sidebar.width if sidebar is not None and sidebar.width > 1 else 0)
    width = round(region.width * SHARE)
    height = min(round(width * shape[0] / shape[1]), region.height // 2)
    width = round(height * shape[1] / shape[0])
    lefts = (right - 2 * width - margin, right - width)
    return tuple((x0, margin, x0 + width, margin + height) for x0 in lefts)


def _make_quads(shown: dict[str, Float32], rectangles: Any) -> list[tuple[str, Any]]:
    return [(name, _quad(pixels, box)) for (name, pixels), box in zip(shown.items(), rectangles, strict=True)]


def _quad(pixels: Float32, rectangle: Any) -> Any:
    from ...preview.draw import Quad
    from ...preview.job import Picture

    return Quad(Picture(pixels, rectangle, ""), sharp=True)


def forget() -> None:
    """Let go of the pictures."""
    _drawn.pictures = _drawn.quads = _drawn.part = _drawn.whole = _drawn.growing = None


CLASSES = (HYBRID_GT_insets, HYBRID_GGT_insets)
