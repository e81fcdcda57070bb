# SPDX-License-Identifier: GPL-3.0-or-later
"""How panels are laid out so that no word is cut: settings beside their labels where there is room, and wrapped text.

Blender cuts what does not fit into an ellipsis. At its default width a Properties editor has room for eight letters in
the column of labels. There the labels stand within the fields, or above them; for all of our panels alike.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import blf
import bpy

from ...settings_table import SCENE, SURFACE
from . import translations

UNIT = 20
"""Height of a button, and what widths are multiples of, in pixels of a display of scale 1 (Blender's widget unit)."""

MARGIN = 1.7
"""Units left and right of what a panel shows: the panel's own, and the scroll bar's."""

LABEL_SHARE = 0.4
"""Of the width that Blender gives to labels beside their fields (UI_ITEM_PROP_SEP_DIVIDE)."""

PADDING = 0.65
"""Units that a label does not have for its letters (UI_TEXT_MARGIN_X and UI_TEXT_CLIP_MARGIN)."""

ICON = 1.0
"""Units of an icon or a tick before a label."""

LINE = 0.75
"""Height of a line of wrapped text, as a share of a button's."""

BESIDE = {
    "samples": "Samples",
    "adaptive": "Threshold",
    "time_budget": "Time Limit",
    "max_depth": "Bounces",
    "cutoff": "Min Light",
    "rough_samples": "Samples",
    "traced_shadows": "Traced",
    "shadow_samples": "Samples",
    "occlusion_samples": "Samples",
    "occlusion_distance": "Distance",
    "raster_backed": "Use EEVEE Pixels",
    "light_falloff": "Falloff",
    "preview_budget": "Time Limit",
    "mode": "Trace",
}
"""What a setting is called under the title of its panel, where that is shorter than its own name."""


def unit() -> float:
    """Pixels of a widget unit on this display."""
    return UNIT * _scale()


def _scale() -> float:
    """Of the display; without a window Blender has none."""
    return float(bpy.context.preferences.system.ui_scale) or 1.0


def text_width(text: str) -> float:
    """Pixels of a text in the interface's own letters."""
    blf.size(0, _letters())
    return float(blf.dimensions(0, text)[0])


def _letters() -> float:
    """Size of the interface's letters, in pixels."""
    preferences = bpy.context.preferences
    style = preferences.ui_styles[0].widget if preferences.ui_styles else None
    return (style.points if style else 11.0) * _scale()


@lru_cache(maxsize=8)
def _longest(texts: tuple[str, ...], _size: float, _font: str) -> float:
    """Pixels of the longest of these in letters of that size and font: measured once, not for each field drawn."""
    return max(map(text_width, texts))


def room(context: bpy.types.Context) -> float:
    """Pixels that a panel of this region has for what it shows."""
    width = context.region.width if context.region is not None else 0
    return max(0.0, width - MARGIN * unit())


def label_of(settings: bpy.types.PropertyGroup, name: str) -> str:
    """A setting's label in a panel, in the user's language."""
    return translations.iface(BESIDE.get(name, settings.bl_rna.properties[name].name))


def splits(width: float) -> bool:
    """Whether the longest label fits beside its field in a panel of this width."""
    names = [BESIDE.get(row.name, row.label) for row in (*SURFACE, *SCENE) if row.kind in {"INT", "FLOAT", "ENUM"}]
    preferences = bpy.context.preferences
    longest = _longest(tuple(map(translations.iface, names)), _letters(), preferences.view.font_path_ui)
    return longest <= LABEL_SHARE * width - PADDING * unit()


def field(layout: bpy.types.UILayout, context: bpy.types.Context, settings: Any, name: str) -> None:
    """One setting, with its label where that fits."""
    label, kind = label_of(settings, name), settings.bl_rna.properties[name].type
    layout.use_property_decorate = False
    layout.use_property_split = beside = splits(room(context))
    if kind == "ENUM" and not beside:
        column = layout.column(align=True)
        column.label(text=label, translate=False)
        column.prop(settings, name, text="")
    else:
        layout.prop(settings, name, text=label, translate=False)


def ticked_field(layout: bpy.types.UILayout, context: bpy.types.Context, settings: Any, tick: str, name: str) -> None:
    """A setting whose 0 means off: a tick, and a number that is grey without it."""
    label = label_of(settings, name)
    layout.use_property_decorate = False
    layout.use_property_split = False
    beside = splits(room(context))
    if beside:
        split = layout.split(factor=LABEL_SHARE, align=True)
        left = split.row()
        left.alignment = "RIGHT"
        left.label(text=label, translate=False)
        row = split.row(align=True)
    else:
        row = layout.row(align=True)
    row.prop(settings, tick, text="")
    value = row.row(align=True)
    value.active = getattr(settings, tick)
    value.prop(settings, name, text="" if beside else label, translate=False)


def paragraph(
    layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE", taken: float = 0.0
) -> None:
    """A text in as many lines as the panel's width asks for. It is in the user's language already.

    icon  : before the first line.   taken : widget units that something else beside it has.
    """
    indent = ICON * unit() if icon != "NONE" else 0.0
    column = layout.column(align=True)
    column.scale_y = LINE
    for number, line in enumerate(wrapped(text, room(context) - indent - (taken + PADDING) * unit())):
        mark = icon if number == 0 or icon == "NONE" else "BLANK1"
        column.label(text=line, icon=mark, translate=False)


def wrapped(text: str, width: float) -> Iterable[str]:
    """Lines of at most so many pixels; a word that is longer is broken."""
    lines: list[str] = []
    for word in text.split():
        joined = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(joined) <= width:
            lines[-1] = joined
        else:
            lines.extend(_broken(word, width))
    return lines or [""]


def _broken(word: str, width: float) -> Iterable[str]:
    while text_width(word) > width and len(word) > 1:
        end = next((n for n in range(len(word) - 1, 1, -1) if text_width(word[:n]) <= width), 1)
        yield word[:end]
        word = word[end:]
    yield word
