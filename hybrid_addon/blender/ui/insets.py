# SPDX-License-Identifier: GPL-3.0-or-later
"""What a hybrid picture is made of, over the Render Result in the Image Editor: two small pictures, or a whole one.

A gizmo draws them, not a draw handler: Blender calls those while it holds the locks of the image. Python waits there
until the engine lets go of the interpreter, the engine, which reads the render result, for the locks: for ever.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import blf
import bpy
import numpy as np

from ...scene import Float32
from .. import session
from ..preview.display import Display
from ..session import Frame
from . import picker

PIXELS = 320
"""Largest width and height of the pictures that are kept for drawing."""

SHARE = 0.2
"""Width of an inset, as a share of the editor's."""

MARGIN, LABEL = 10, 11
"""Around each inset, and the size of its name, in pixels of a display of scale 1."""


@dataclass(eq=False)
class _Drawn:
    """What was drawn last, each with what it was made of; the same is not made again.

    pictures : (frame and display, what the insets look like).
    quads    : (the same and their rectangles, what is drawn).
    whole    : (frame, display, what is shown and where; what is drawn).
    """

    pictures: tuple[Any, dict[str, Float32]] | None = None
    quads: tuple[Any, list[tuple[str, Any]]] | None = None
    whole: tuple[Any, Any] | None = None


_drawn = _Drawn()


def redraw() -> None:
    """All image editors, soon."""
    for window in getattr(bpy.context.window_manager, "windows", ()):
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                area.tag_redraw()


class HYBRID_GT_insets(bpy.types.Gizmo):
    """Draws, and cannot be touched."""

    bl_idname = "HYBRID_GT_insets"

    def draw(self, context: bpy.types.Context) -> None:
        """In each redraw of an image editor."""
        frame = session.of(context.scene.name).frame
        if frame is None:
            return
        if context.scene.hybrid.shown != "PICTURE":
            _draw_whole(context, frame)
        if context.scene.hybrid.insets:
            _draw(context, frame)

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
        wanted = settings.insets or settings.shown != "PICTURE"
        return settings.enabled and wanted and picker.shows_render(context.space_data)

    def setup(self, _context: bpy.types.Context) -> None:
        """Once for each editor."""
        self.gizmos.new(HYBRID_GT_insets.bl_idname)


def _draw_whole(context: bpy.types.Context, frame: Frame) -> None:
    """One of the parts, exactly over the picture."""
    scene, region = context.scene, context.region
    x0, y0, x1, y1 = picker.shown_window(scene)
    corners = [((x - x0) / (x1 - x0), (y - y0) / (y1 - y0)) for x, y in (frame.window[:2], frame.window[2:])]
    rectangle = tuple(n for corner in corners for n in region.view2d.view_to_region(*corner, clip=False))
    key = (id(frame), Display.of(scene), scene.hybrid.shown, rectangle)
    if _drawn.whole is None or _drawn.whole[0] != key:
        pixels = part(frame, key[1], key[2])
        _drawn.whole = (key, None if pixels is None else _quad(pixels, rectangle))
    if _drawn.whole[1] is not None:
        _drawn.whole[1].draw((region.width, region.height))
        scale = context.preferences.system.ui_scale
        name = scene.hybrid.bl_rna.properties["shown"].enum_items[scene.hybrid.shown].name
        _label(name, rectangle[0] + 4 * scale, rectangle[3] - (LABEL + 3) * scale, scale)


def part(frame: Frame, display: Display, shown: str) -> Float32 | None:
    """What a part of a frame looks like: (h, w, 4) display values, opaque; None if there is none of it."""
    if shown == "MASK":
        gray = np.clip(frame.mask, 0, 1)
        return np.dstack([gray, gray, gray, np.ones_like(gray)])
    half = frame.raster if shown == "RASTER" else frame.traced
    return None if half is None else np.dstack([display.encode(half[..., :3]), np.ones_like(frame.mask)])


def _draw(context: bpy.types.Context, frame: Frame) -> None:
    key = (id(frame), Display.of(context.scene))
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
    mask, traced = (_shrink(plane) for plane in (frame.mask[..., None], frame.traced[..., :3]))
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
    from ..preview.draw import Quad
    from ..preview.job import Picture

    return Quad(Picture(pixels, rectangle, ""), sharp=True)


def forget() -> None:
    """Let go of the pictures."""
    _drawn.pictures = _drawn.quads = _drawn.whole = None


CLASSES = (HYBRID_GT_insets, HYBRID_GGT_insets)
