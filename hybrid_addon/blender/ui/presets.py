# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of quality, for a scene, and of surfaces, for objects. Blender keeps the artist's own, with + and -."""

# No `from __future__ import annotations` here: Blender reads operator properties from the annotations themselves.

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ...presets import QUALITY
from ..api import GEOMETRY, mark
from . import messages

# name: (reflectivity, opacity, ior, dispersion, tooltip). IOR of glass and water at 589 nm, 20 C; of diamond 2.417,
# Abbe number 55.
SURFACES = {
    "MIRROR": ("Mirror", 1.0, 1.0, 1.5, 0.0, "Reflects everything"),
    "GLASS": ("Glass", 0.0, 0.0, 1.5, 0.0, "Clear glass: IOR 1.5"),
    "WATER": ("Water", 0.0, 0.0, 1.333, 0.0, "Clear water: IOR 1.333"),
    "DIAMOND": ("Diamond", 0.0, 0.0, 2.417, 0.362, "Diamond: IOR 2.417, and its fire (Abbe number 55)"),
}


class HYBRID_OT_surface_preset(bpy.types.Operator):
    bl_idname = "hybrid.surface_preset"
    bl_label = "Surface Preset"
    bl_description = "Make the selected objects ray traced, with the values of a common surface"
    bl_options = {"REGISTER", "UNDO"}

    preset: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Preset",
        items=[(key, name, tooltip) for key, (name, *_, tooltip) in SURFACES.items()],
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return SURFACES[properties.preset][-1]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.object is not None and context.object.type in GEOMETRY:
            return True
        cls.poll_message_set("Select an object with a surface")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        _, reflectivity, opacity, ior, dispersion, _ = SURFACES[self.preset]
        chosen = {context.object, *context.selected_objects}
        first = messages.is_first(context.scene)
        for b_object in chosen:
            if b_object.type in GEOMETRY and b_object.library is None:
                mark(b_object, reflectivity=reflectivity, opacity=opacity, ior=ior, dispersion=dispersion)
        if first:
            messages.switch_on(context.scene)
        return {"FINISHED"}


class HYBRID_OT_quality_preset(bpy.types.Operator):
    bl_idname = "hybrid.quality_preset"
    bl_label = "Quality Preset"
    bl_description = "Set everything that makes the picture better or faster together"
    bl_options = {"REGISTER", "UNDO"}

    preset: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Preset",
        items=[(key, name, tooltip) for key, (name, tooltip, _) in QUALITY.items()],
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return QUALITY[properties.preset][1]

    def execute(self, context: bpy.types.Context) -> set[str]:
        for name, value in QUALITY[self.preset][2].values().items():
            setattr(context.scene.hybrid, name, value)
        return {"FINISHED"}


class OurPresets(PresetPanel):
    """A list of presets: ours first, then the artist's own."""

    operator = ""

    def draw(self, context: bpy.types.Context) -> None:
        """Ours by an operator, which knows what each is for; those in files as Blender draws them, with + and -."""
        column = self.layout.column()
        column.emboss = "PULLDOWN_MENU"
        column.operator_enum(self.operator, "preset")
        super().draw(context)


class HYBRID_PT_quality_presets(OurPresets, bpy.types.Panel):
    bl_label = "Quality Presets"
    operator = "hybrid.quality_preset"
    preset_subdir = "hybrid/quality"
    preset_operator = "script.execute_preset"
    preset_add_operator = "hybrid.quality_preset_add"


class HYBRID_PT_surface_presets(OurPresets, bpy.types.Panel):
    bl_label = "Surface Presets"
    operator = "hybrid.surface_preset"
    preset_subdir = "hybrid/surface"
    preset_operator = "script.execute_preset"
    preset_add_operator = "hybrid.surface_preset_add"


class HYBRID_OT_quality_preset_add(AddPresetBase, bpy.types.Operator):
    bl_idname = "hybrid.quality_preset_add"
    bl_label = "Add Quality Preset"
    bl_description = "Save the sampling of this scene as a preset, or remove one"
    preset_menu = "HYBRID_PT_quality_presets"
    preset_subdir = HYBRID_PT_quality_presets.preset_subdir
    preset_defines = ["hybrid = bpy.context.scene.hybrid"]
    preset_values = [f"hybrid.{name}" for name in next(iter(QUALITY.values()))[2].values()]


class HYBRID_OT_surface_preset_add(AddPresetBase, bpy.types.Operator):
    bl_idname = "hybrid.surface_preset_add"
    bl_label = "Add Surface Preset"
    bl_description = "Save this object's own values as a preset, or remove one"
    preset_menu = "HYBRID_PT_surface_presets"
    preset_subdir = HYBRID_PT_surface_presets.preset_subdir
    preset_defines = ["hybrid = bpy.context.object.hybrid"]
    preset_values = [
        f"hybrid.{name}" for name in ("reflectivity", "opacity", "ior", "dispersion", "surface", "ray_traced")
    ]  # a value sets Custom: `surface` after them


CLASSES = (
    HYBRID_OT_surface_preset,
    HYBRID_OT_quality_preset,
    HYBRID_OT_quality_preset_add,
    HYBRID_OT_surface_preset_add,
    HYBRID_PT_quality_presets,
    HYBRID_PT_surface_presets,
)
