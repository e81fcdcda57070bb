# SPDX-License-Identifier: GPL-3.0-or-later
"""Which words of a panel Blender would cut: the panel draws into a recorder, which knows how wide each word may be.

The widths are those of Blender's layout: equal parts of a row, 40 % of it for labels beside fields, units for icons,
ticks and margins. `tests/real_blender/panels.py` measures by it in a window, too, and its picture shows that it holds.
"""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import bpy

_UI = next(name for name in sys.modules if name.endswith("hybrid_addon.blender.ui"))  # an extension's name is longer
ours, translations = sys.modules[f"{_UI}.layout"], sys.modules[f"{_UI}.translations"]
SettingsPanel = sys.modules[f"{_UI}.render_panels"].SettingsPanel

DEFAULT_WIDTH = 187.0
"""Of a Properties editor's region in a window of 1280 pixels, in pixels of a display of scale 1."""

MARGINS = 0.65
"""Units that no button has for its letters."""


class Layout:
    """A `UILayout` that draws nothing: it keeps what it is told, and how wide that is."""

    def __init__(self, flow: str = "column", share: float = 0.0) -> None:
        self.__dict__.update(flow=flow, share=share, parts=[], use_property_split=False)

    def _add(self, part: Any) -> Any:
        self.parts.append(part)
        return part

    def row(self, **_: Any) -> Layout:
        child = self._add(Layout("row"))
        child.use_property_split = self.use_property_split
        return child

    def column(self, **_: Any) -> Layout:
        child = self._add(Layout())
        child.use_property_split = self.use_property_split
        return child

    box = column

    def split(self, factor: float = 0.5, **_: Any) -> Layout:
        return self._add(Layout("split", factor))

    def label(self, text: str = "", icon: str = "NONE", translate: bool = True, **_: Any) -> None:
        self._add((translations.iface(text) if translate else text, icon != "NONE", text != ""))

    def operator(self, name: str, text: str | None = None, icon: str = "NONE", translate: bool = True, **_: Any) -> Any:
        kind = next(c for c in bpy.types.Operator.__subclasses__() if c.bl_idname == name)
        text = kind.bl_label if text is None else text
        self._add((translations.iface(text) if translate else text, icon != "NONE", text != ""))
        return SimpleNamespace()

    def prop(self, data: Any, name: str, text: str | None = None, translate: bool = True, **_: Any) -> None:
        rna = data.bl_rna.properties[name]
        text = rna.name if text is None else text
        text = translations.iface(text) if translate else text
        choices = [""]
        if rna.type == "ENUM":
            choices = [translations.iface(item.name) for item in rna.enum_items]
        elif rna.type in {"INT", "FLOAT"}:
            digits = min(rna.precision, 6) if rna.type == "FLOAT" else 0
            choices = [f"{getattr(data, name):.{digits}f}"]
        longest = max(choices, key=ours.text_width)
        if self.use_property_split and text and rna.type == "BOOLEAN":
            split = self.split(factor=ours.LABEL_SHARE)
            split.label()
            split._add((text, True, True))
        elif self.use_property_split and text:
            split = self.split(factor=ours.LABEL_SHARE)
            split.label(text=text, translate=False)
            split._add((longest, rna.type == "ENUM", True))
        elif rna.type == "BOOLEAN":
            self._add((text, True, text != ""))
        else:
            self._add((f"{text}   {longest}" if text else longest, True, True))

    def template_list(self, *_: Any, **__: Any) -> None:
        pass

    popover = menu = separator = template_list

    def __setattr__(self, name: str, value: Any) -> None:
        self.__dict__[name] = value

    def cut(self, width: float) -> list[str]:
        """What does not fit into so many pixels."""
        unit = ours.unit()
        if self.flow == "split":
            widths = [width * self.share, width * (1 - self.share)]
        elif self.flow == "row":
            small = [isinstance(part, tuple) and not part[2] for part in self.parts]
            rest = width - unit * sum(small)
            widths = [unit if is_small else rest / max(1, small.count(False)) for is_small in small]
        else:
            widths = [width] * len(self.parts)
        found = []
        for part, room in zip(self.parts, widths, strict=False):
            if isinstance(part, Layout):
                found += part.cut(room)
            elif ours.text_width(part[0]) > room - unit * (MARGINS * (part[0] != "") + part[1]) and part[2]:
                found.append(part[0])
        return found


def cut(panel: Any, context: Any) -> list[str]:
    """The words of a panel that do not fit into the context's region."""
    layout = Layout()
    drawn = SimpleNamespace(layout=layout)
    drawn.begin = lambda given: SettingsPanel.begin(drawn, given)
    panel.draw(drawn, context)
    found = layout.cut(ours.room(context))
    title = translations.iface(panel.bl_label)
    return found + ([title] if ours.text_width(title) > ours.room(context) - ours.unit() else [])
