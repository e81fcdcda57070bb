"""Panels: Properties > Object > Ray Tracing, and Properties > Render > Hybrid."""

from __future__ import annotations

import bpy

from ..report.frame import summary
from . import pipeline, preview, results
from .api import GEOMETRY

COMPAT_ENGINES = {"BLENDER_EEVEE", "BLENDER_EEVEE_NEXT"}


class HYBRID_MT_surface_presets(bpy.types.Menu):
    bl_label = "Surface Presets"

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.operator_enum("hybrid.surface_preset", "preset")


class HYBRID_MT_quality_presets(bpy.types.Menu):
    bl_label = "Quality Presets"

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.operator_enum("hybrid.quality_preset", "preset")


class HYBRID_OBJECT_PT_settings(bpy.types.Panel):
    bl_label = "Ray Tracing"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in COMPAT_ENGINES and context.object is not None and context.object.type in GEOMETRY

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.object.hybrid, "ray_traced", text="")

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        self.layout.menu("HYBRID_MT_surface_presets", text="", icon="PRESET")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        settings = context.object.hybrid
        layout.active = settings.ray_traced
        layout.prop(settings, "surface")
        column = layout.column()
        column.active = settings.surface == "CUSTOM"
        column.prop(settings, "reflectivity")
        column.prop(settings, "opacity")
        column.prop(settings, "ior")
        if settings.ray_traced and not context.scene.hybrid.enabled:
            row = layout.row()
            row.label(text="Hybrid is off in this scene", icon="INFO")
            row.prop(context.scene.hybrid, "enabled", text="Enable", toggle=True)


class HYBRID_RENDER_PT_settings(bpy.types.Panel):
    bl_label = "Hybrid"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in COMPAT_ENGINES or context.scene.hybrid.enabled

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.hybrid, "enabled", text="")

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        self.layout.menu("HYBRID_MT_quality_presets", text="", icon="PRESET")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        scene = context.scene
        settings = scene.hybrid
        layout.active = settings.enabled
        problem = pipeline.why_inactive(scene)
        if settings.enabled and problem:
            layout.label(text=problem[0].upper() + problem[1:], icon="ERROR")
        layout.prop(settings, "mode")
        column = layout.column()
        column.prop(settings, "samples")
        column.prop(settings, "max_depth")
        column.prop(settings, "adaptive")
        column.prop(settings, "cutoff")
        column.prop(settings, "time_budget")
        column.prop(settings, "light_falloff")
        column = layout.column(heading="Viewport")
        column.prop(settings, "preview")
        row = column.row()
        row.active = settings.preview
        row.prop(settings, "preview_budget")
        report = results.reports.get(scene.name)
        if report:
            column = layout.column(align=True)
            for line in summary(report):
                column.label(text=line)


CLASSES = (HYBRID_MT_surface_presets, HYBRID_MT_quality_presets, HYBRID_OBJECT_PT_settings, HYBRID_RENDER_PT_settings)


def _draw_view3d_header(self: bpy.types.Header, context: bpy.types.Context) -> None:
    """The preview's toggle, beside the shading of viewports that it works in; why it shows nothing, if so."""
    scene, space = context.scene, context.space_data
    if not (scene.hybrid.enabled and pipeline.is_eevee(scene) and space.shading.type == "RENDERED"):
        return
    row = self.layout.row(align=True)
    row.prop(scene.hybrid, "preview", text="", icon="SHADING_RENDERED")
    if scene.hybrid.preview:
        row.label(text=preview.status(context))


def register() -> None:
    """Add what is shown in Blender's own headers."""
    bpy.types.VIEW3D_HT_header.append(_draw_view3d_header)


def unregister() -> None:
    """Take it away again."""
    bpy.types.VIEW3D_HT_header.remove(_draw_view3d_header)
