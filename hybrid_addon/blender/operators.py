"""Operators: they read the context, call a plain function, and say in one line what happened."""

# No `from __future__ import annotations` here: Blender reads operator properties from the annotations themselves.

import bpy

from ..presets import QUALITY
from .api import GEOMETRY, mark

# name: (reflectivity, opacity, ior, tooltip). IOR of glass and water at 589 nm, 20 C; diamond 2.417.
PRESETS = {
    "MIRROR": ("Mirror", 1.0, 1.0, 1.5, "Reflects everything"),
    "GLASS": ("Glass", 0.0, 0.0, 1.5, "Clear glass: IOR 1.5"),
    "WATER": ("Water", 0.0, 0.0, 1.333, "Clear water: IOR 1.333"),
    "DIAMOND": ("Diamond", 0.0, 0.0, 2.417, "Diamond: IOR 2.417"),
}


class HYBRID_OT_surface_preset(bpy.types.Operator):
    bl_idname = "hybrid.surface_preset"
    bl_label = "Surface Preset"
    bl_description = "Make the selected objects ray traced, with the values of a common surface"
    bl_options = {"REGISTER", "UNDO"}

    preset: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Preset",
        items=[(key, name, tooltip) for key, (name, *_, tooltip) in PRESETS.items()],
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.object is not None and context.object.type in GEOMETRY:
            return True
        cls.poll_message_set("Select an object with a surface")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        _, reflectivity, opacity, ior, _ = PRESETS[self.preset]
        chosen = {context.object, *context.selected_objects}
        for b_object in chosen:
            if b_object.type in GEOMETRY and b_object.library is None:
                mark(b_object, reflectivity=reflectivity, opacity=opacity, ior=ior)
        return {"FINISHED"}


class HYBRID_OT_quality_preset(bpy.types.Operator):
    bl_idname = "hybrid.quality_preset"
    bl_label = "Quality Preset"
    bl_description = "Set samples, adaptive sampling, bounces and cutoff together"
    bl_options = {"REGISTER", "UNDO"}

    preset: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Preset",
        items=[(key, name, tooltip) for key, (name, tooltip, _) in QUALITY.items()],
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        for name, value in QUALITY[self.preset][2].values().items():
            setattr(context.scene.hybrid, name, value)
        return {"FINISHED"}


CLASSES = (HYBRID_OT_surface_preset, HYBRID_OT_quality_preset)
