# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: they read the context, call a plain function, and say in one line what happened."""

# No `from __future__ import annotations` here: Blender reads operator properties from the annotations themselves.

from collections.abc import Iterable
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from .. import flags
from ..api import GEOMETRY
from ..errors import HybridError
from ..render import retrace
from . import messages


def _surfaces(objects: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """Those of the objects that can be ray traced and that this file owns."""
    return [ob for ob in objects if ob.type in GEOMETRY and ob.library is None]


class HYBRID_OT_ray_traced_set(bpy.types.Operator):
    bl_idname = "hybrid.ray_traced_set"
    bl_label = "Set Ray Traced"
    bl_description = "Draw the selected objects with the ray tracer, or with EEVEE again"
    bl_options = {"REGISTER", "UNDO"}

    ray_traced: bpy.props.BoolProperty(name="Ray Traced", default=True)  # type: ignore[valid-type]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if _surfaces(context.selected_objects):
            return True
        cls.poll_message_set("Select an object with a surface")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        chosen = _surfaces(context.selected_objects)
        first = self.ray_traced and messages.is_first(context.scene)
        for b_object in chosen:
            b_object.hybrid.ray_traced = self.ray_traced
        if first:
            messages.switch_on(context.scene)
        left_out = len(context.selected_objects) - len(chosen)
        if left_out:
            text = rpt_("{} of the selected have no surface or are linked: left as they are")
            self.report({"INFO"}, text.format(left_out))
        return {"FINISHED"}


class HYBRID_OT_copy_to_selected(bpy.types.Operator):
    bl_idname = "hybrid.copy_to_selected"
    bl_label = "Copy Hybrid to Selected"
    bl_description = "Give the selected objects the active object's tick, surface and values"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.object is not None and any(ob != context.object for ob in _surfaces(context.selected_objects)):
            return True
        cls.poll_message_set("Select objects to copy to, and last the one to copy from")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        source = context.object.hybrid
        for b_object in _surfaces(context.selected_objects):
            if b_object != context.object:
                for name in (
                    "reflectivity",
                    "opacity",
                    "ior",
                    "dispersion",
                    "program",
                    "surface",
                    "ray_traced",
                ):  # a value sets Custom: first
                    setattr(b_object.hybrid, name, getattr(source, name))
        return {"FINISHED"}


class HYBRID_OT_select_ray_traced(bpy.types.Operator):
    bl_idname = "hybrid.select_ray_traced"
    bl_label = "Select All Ray Traced"
    bl_description = "Select all objects that are ray traced, by themselves or by a collection"
    bl_options = {"REGISTER", "UNDO"}

    extend: bpy.props.BoolProperty(name="Extend", description="Keep what is selected")  # type: ignore[valid-type]

    def execute(self, context: bpy.types.Context) -> set[str]:
        own, count = flags.Flags(context.scene), 0
        for b_object in context.view_layer.objects:
            wanted = b_object.type in GEOMETRY and own.is_ray_traced(b_object)
            if wanted or not self.extend:
                b_object.select_set(wanted)
            count += wanted
        text = rpt_("1 object is ray traced") if count == 1 else rpt_("{} objects are ray traced").format(count)
        self.report({"INFO"}, text)
        return {"FINISHED"}


class HYBRID_OT_clear_all(bpy.types.Operator):
    bl_idname = "hybrid.clear_all"
    bl_label = "Clear All Ray Traced"
    bl_description = "Let EEVEE draw every object of this scene again: clears the ticks of objects and collections"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        flags.clear(context.scene)
        return {"FINISHED"}


class HYBRID_OT_collection_toggle(bpy.types.Operator):
    bl_idname = "hybrid.collection_toggle"
    bl_label = "Toggle Ray Traced Collection"
    bl_description = "Ray trace all objects of the active collection, or stop it"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.collection is not None and context.collection.library is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = context.collection.hybrid
        first = not settings.ray_traced and messages.is_first(context.scene)
        settings.ray_traced = not settings.ray_traced
        if first:
            messages.switch_on(context.scene)
        on, off = rpt_("{}: all its objects are ray traced"), rpt_("{}: its objects follow their own ticks")
        self.report({"INFO"}, (on if settings.ray_traced else off).format(context.collection.name))
        return {"FINISHED"}


class HYBRID_OT_retrace(bpy.types.Operator):
    bl_idname = "hybrid.retrace"
    bl_label = "Retrace"
    bl_description = "Trace the ray traced objects again over the last render; EEVEE draws nothing again"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if bpy.app.is_job_running("RENDER"):
            cls.poll_message_set("A render is running")
            return False
        reason = retrace.why_not(context.scene)
        if reason:
            cls.poll_message_set(reason[0].upper() + reason[1:])
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self._run(context.scene, "EXEC_DEFAULT")

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return self._run(context.scene, "INVOKE_DEFAULT")

    def _run(self, scene: bpy.types.Scene, how: str) -> set[str]:
        name, state = scene.name, {"CANCELLED"}
        try:
            retrace.begin(scene)
        except HybridError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        try:
            state = bpy.ops.render.render(how, scene=name)
        except RuntimeError as error:
            self.report({"ERROR"}, str(error).strip())
        finally:
            if state != {"RUNNING_MODAL"}:
                retrace.end(name)
        return {"FINISHED"} if state in ({"RUNNING_MODAL"}, {"FINISHED"}) else {"CANCELLED"}


MANUAL = Path(__file__).parents[2] / "manual"
"""The pages in the zip (tools/manual_pages.py); a checkout has their sources in docs/."""

PAGES = (
    ("bpy.types.hybridscenesettings.preview*", "preview-and-retrace.html#preview-in-the-viewport"),
    ("bpy.types.hybridscenesettings.tint", "preview-and-retrace.html#preview-in-the-viewport"),
    ("bpy.types.hybridscenesettings.shown", "passes-and-compositing.html#in-the-image-editor"),
    ("bpy.types.hybridscenesettings.wipe", "passes-and-compositing.html#in-the-image-editor"),
    ("bpy.types.hybridscenesettings.compare_slot", "passes-and-compositing.html#in-the-image-editor"),
    ("bpy.types.hybridscenesettings.insets", "passes-and-compositing.html#in-the-image-editor"),
    ("bpy.types.hybridscenesettings.pass*", "passes-and-compositing.html#passes-for-the-compositor"),
    ("bpy.types.hybridscenesettings*", "settings.html#scene"),
    ("bpy.types.hybrid*settings*", "first-render.html#where-the-surface-comes-from"),
    ("bpy.ops.hybrid.*advise*", "what-needs-rays.html"),
    ("bpy.ops.hybrid.retrace*", "preview-and-retrace.html#retrace"),
    ("bpy.ops.hybrid.explain_pixel*", "passes-and-compositing.html#in-the-image-editor"),
    ("bpy.ops.hybrid.render_cameras*", "passes-and-compositing.html#in-the-image-editor"),
    ("bpy.ops.hybrid.*", "first-render.html#which-objects-are-ray-traced"),
)
"""Which page tells of what, the first that fits: for *Online Manual* in the menu of a right click, and F1."""


def manual_map() -> tuple[str, tuple[tuple[str, str], ...]]:
    """Where the pages lie, and which they are, as `bpy.utils.register_manual_map` asks for."""
    return f"{(MANUAL / 'manual').as_uri()}/", PAGES


class HYBRID_OT_manual(bpy.types.Operator):
    bl_idname = "hybrid.manual"
    bl_label = "Hybrid Manual"
    bl_description = "Open the manual of this add-on in a browser: it lies in the add-on, no network is needed"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        if MANUAL.is_dir():
            return True
        cls.poll_message_set("The zip has the manual; here it is in docs/manual")
        return False

    def execute(self, _context: bpy.types.Context) -> set[str]:
        bpy.ops.wm.url_open(url=f"{manual_map()[0]}first-render.html")
        return {"FINISHED"}


CLASSES = (
    HYBRID_OT_manual,
    HYBRID_OT_ray_traced_set,
    HYBRID_OT_copy_to_selected,
    HYBRID_OT_select_ray_traced,
    HYBRID_OT_clear_all,
    HYBRID_OT_collection_toggle,
    HYBRID_OT_retrace,
)
