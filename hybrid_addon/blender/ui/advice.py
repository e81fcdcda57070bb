# SPDX-License-Identifier: GPL-3.0-or-later
"""What needs rays: the list in the Hybrid panel, and the operators that fill it and flag what it suggests."""

# No `from __future__ import annotations` here: Blender reads the properties from the annotations themselves.

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, CollectionProperty, FloatProperty, IntProperty, PointerProperty, StringProperty
from bpy.types import PropertyGroup, WindowManager

from ...report.advice import cost
from .. import api
from ..errors import HybridError
from . import messages
from .layout import paragraph
from .translations import iface, sentence, translated


class HybridAdviceRow(PropertyGroup):
    """One object: `name` is its name."""

    coverage: FloatProperty(name="Coverage")  # type: ignore[valid-type]
    why: StringProperty(name="Why")  # type: ignore[valid-type]
    materials: StringProperty(name="Materials")  # type: ignore[valid-type] # names, one a line; empty: the object
    seconds: FloatProperty(name="Cost")  # type: ignore[valid-type]
    suggested: BoolProperty(name="Suggested")  # type: ignore[valid-type]


class HybridAdvice(PropertyGroup):
    """`WindowManager.hybrid_advice`: the last answer. It is not of the file: nothing of it is undone, nothing kept.

    Its rows are all objects in view; listed are those that need rays or are ticked, also since then.
    """

    scene: StringProperty()  # type: ignore[valid-type]
    note: StringProperty()  # type: ignore[valid-type]
    basis: StringProperty()  # type: ignore[valid-type]
    build: FloatProperty()  # type: ignore[valid-type]
    shadows: FloatProperty()  # type: ignore[valid-type]
    rows: CollectionProperty(type=HybridAdviceRow)  # type: ignore[valid-type]
    active: IntProperty(name="Active Suggestion")  # type: ignore[valid-type]

    @classmethod
    def register(cls) -> None:
        """Attach to bpy.types.WindowManager."""
        WindowManager.hybrid_advice = PointerProperty(type=cls, options={"SKIP_SAVE"})

    @classmethod
    def unregister(cls) -> None:
        """Detach again."""
        del WindowManager.hybrid_advice


class HYBRID_OT_advise(bpy.types.Operator):
    bl_idname = "hybrid.advise"
    bl_label = "What Needs Rays?"
    bl_description = "Find the objects that need rays: why, how much of the picture they cover, and the cost"
    bl_options = {"REGISTER"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            found = api.advise(context.scene)
        except HybridError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        advice = context.window_manager.hybrid_advice
        advice.rows.clear()
        advice.scene, advice.basis, advice.build = found["scene"], found["basis"], found["build"]
        advice.shadows = found["shadows"]
        advice.note = "\n".join(found["notes"])
        for entry in [*found["objects"], *found["others"]]:
            row = advice.rows.add()
            row.name, row.why = entry["object"], "\n".join(entry["why"])
            row.materials = "\n".join(entry["materials"])
            row.coverage, row.seconds, row.suggested = entry["coverage"], entry["seconds"], entry["suggested"]
        number = sum(row.suggested for row in advice.rows)
        self.report({"INFO"}, rpt_("Objects that need rays: {}").format(number))
        return {"FINISHED"}


def listed(context: bpy.types.Context) -> list[HybridAdviceRow]:
    """The rows that the list shows."""
    ticked = {b_object.name for b_object in context.scene.objects if b_object.hybrid.ray_traced}

    def is_ticked(row: HybridAdviceRow) -> bool:
        return row.name in ticked or any(b_id.hybrid.ray_traced for b_id in subjects(context, row))

    return [row for row in context.window_manager.hybrid_advice.rows if row.suggested or is_ticked(row)]


def subjects(context: bpy.types.Context, row: HybridAdviceRow) -> list[bpy.types.ID]:
    """What to tick for a row: the materials that it names, else its object; nothing of what is gone since."""
    if row.materials:
        found = [bpy.data.materials.get(name) for name in row.materials.splitlines()]
    else:
        found = [context.scene.objects.get(row.name)]
    return [b_id for b_id in found if b_id is not None]


class HYBRID_OT_flag_advised(bpy.types.Operator):
    bl_idname = "hybrid.flag_advised"
    bl_label = "Tick All Suggested"
    bl_description = "Make all suggested objects and materials ray traced"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        advice = context.window_manager.hybrid_advice
        return advice.scene == context.scene.name and any(row.suggested for row in advice.rows)

    def execute(self, context: bpy.types.Context) -> set[str]:
        rows = [row for row in context.window_manager.hybrid_advice.rows if row.suggested]
        chosen = [b_id for row in rows for b_id in subjects(context, row)]
        first = messages.is_first(context.scene)
        for b_id in chosen:
            if b_id.library is None:
                b_id.hybrid.ray_traced = True
        if first:
            messages.switch_on(context.scene)
        return {"FINISHED"}


class HYBRID_UL_advice(bpy.types.UIList):
    """One row: tick it to flag the object."""

    def draw_item(self, context, layout, _data, item, _icon, _active_data, _active_property, _index=0, _flt_flag=0):  # type: ignore[no-untyped-def]
        row = layout.row(align=True)
        ticks = subjects(context, item)
        if not ticks:  # deleted or renamed since
            row.active = False
            row.label(text=item.name, icon="GHOST_DISABLED")
            return
        for b_id in ticks:
            row.prop(b_id.hybrid, "ray_traced", text="")
        names = ", ".join([item.name, *item.materials.splitlines()])
        row.label(text=names, translate=False)
        number = row.row()
        number.alignment = "RIGHT"
        number.label(text=cost({"seconds": item.seconds}).removeprefix("about "), translate=False)

    def filter_items(self, context, data, name):  # type: ignore[no-untyped-def]
        shown = {row.name for row in listed(context)}
        return [self.bitflag_filter_item * (item.name in shown) for item in getattr(data, name)], []


class HYBRID_RENDER_PT_advice(bpy.types.Panel):
    bl_label = "What Needs Rays?"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_parent_id = "HYBRID_RENDER_PT_settings"
    bl_order = 1

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        advice = context.window_manager.hybrid_advice
        layout.operator("hybrid.advise", text="Analyse", icon="VIEWZOOM")
        if advice.scene != context.scene.name:
            return
        rows = listed(context)
        if not rows:
            paragraph(layout, context, iface("No object here needs rays"), icon="CHECKMARK")
        for note in advice.note.splitlines():
            paragraph(layout, context, sentence(note), icon="INFO")
        if not rows:
            return
        layout.template_list("HYBRID_UL_advice", "", advice, "rows", advice, "active", rows=3)
        if 0 <= advice.active < len(advice.rows):
            row = advice.rows[advice.active]
            paragraph(layout, context, f"{row.name}: " + "; ".join(map(translated, row.why.splitlines())))
            if row.materials:
                text = iface("Only some of its materials need rays: {}").format(", ".join(row.materials.splitlines()))
                paragraph(layout, context, text)
        layout.operator("hybrid.flag_advised", icon="CHECKMARK")
        total = sum(row.seconds for row in rows) + advice.shadows
        text = iface("All of them: {}, {:.2g} s to build").format(translated(cost({"seconds": total})), advice.build)
        if advice.shadows:
            text += "; " + iface("of which {:.2g} s for their shadows").format(advice.shadows)
        paragraph(layout, context, text + ". " + iface("An estimate from small pictures traced here"))


CLASSES = (
    HybridAdviceRow,
    HybridAdvice,
    HYBRID_OT_advise,
    HYBRID_OT_flag_advised,
    HYBRID_UL_advice,
    HYBRID_RENDER_PT_advice,
)
