"""Panels: Ray Tracing of objects, materials, collections; Hybrid of the scene; and entries in Blender's menus."""

from __future__ import annotations

import bpy

from ..report.frame import summary
from . import picker, pipeline, preview, results
from .api import GEOMETRY
from .flags import Flags

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
        ray_traced = Flags(context.scene).is_ray_traced(context.object)
        layout.active = ray_traced
        _draw_surface(layout, settings)
        if ray_traced and not settings.ray_traced:
            layout.label(text="Ray traced by its collection", icon="OUTLINER_COLLECTION")
        if ray_traced and not context.scene.hybrid.enabled:
            row = layout.row()
            row.label(text="Hybrid is off in this scene", icon="INFO")
            row.prop(context.scene.hybrid, "enabled", text="Enable", toggle=True)


class HYBRID_MATERIAL_PT_settings(bpy.types.Panel):
    bl_label = "Ray Tracing"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in COMPAT_ENGINES and context.material is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        _draw_surface(layout, context.material.hybrid)
        if context.object is not None and context.object.hybrid.surface == "CUSTOM":
            layout.label(text="The object's own Custom values are used", icon="INFO")


class HYBRID_COLLECTION_PT_settings(bpy.types.Panel):
    bl_label = "Ray Tracing"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "collection"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in COMPAT_ENGINES and context.collection is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(context.collection.hybrid, "ray_traced")


def _draw_surface(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """Where the values come from, and the values."""
    layout.prop(settings, "surface")
    column = layout.column()
    column.active = settings.surface == "CUSTOM"
    for name in ("reflectivity", "opacity", "ior"):
        column.prop(settings, name)


class HYBRID_MT_object(bpy.types.Menu):
    bl_label = "Ray Tracing"

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.operator("hybrid.ray_traced_set", text="Set Ray Traced").ray_traced = True
        layout.operator("hybrid.ray_traced_set", text="Clear Ray Traced").ray_traced = False
        layout.operator("hybrid.clear_all")
        layout.separator()
        layout.operator_menu_enum("hybrid.surface_preset", "preset", text="Surface Preset")
        layout.operator("hybrid.copy_to_selected")
        layout.separator()
        layout.operator("hybrid.select_ray_traced")
        layout.operator("hybrid.advise")


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
        column.prop(settings, "shadow_samples")
        column.prop(settings, "traced_shadows")
        row = column.row()
        row.active = settings.traced_shadows
        row.prop(settings, "caustics")
        if settings.caustics == "PHOTONS":
            row = column.row()
            row.active = settings.traced_shadows
            row.prop(settings, "photons")
        column.prop(settings, "raster_backed")
        column.prop(settings, "light_falloff")
        layout.column(heading="Data Passes").prop(settings, "passes", text="")
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


class HYBRID_IMAGE_PT_settings(bpy.types.Panel):
    bl_label = "Hybrid"
    bl_space_type = "IMAGE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Hybrid"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene.hybrid.enabled and picker.shows_render(context.space_data)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.operator("hybrid.explain_pixel", icon="EYEDROPPER")
        layout.prop(context.scene.hybrid, "insets")


CLASSES = (
    HYBRID_MT_surface_presets,
    HYBRID_MT_quality_presets,
    HYBRID_MT_object,
    HYBRID_OBJECT_PT_settings,
    HYBRID_MATERIAL_PT_settings,
    HYBRID_COLLECTION_PT_settings,
    HYBRID_RENDER_PT_settings,
    HYBRID_IMAGE_PT_settings,
)


def _draw_view3d_header(self: bpy.types.Header, context: bpy.types.Context) -> None:
    """The preview's toggle, beside the shading of viewports that it works in; why it shows nothing, if so."""
    scene, space = context.scene, context.space_data
    if not (scene.hybrid.enabled and pipeline.is_eevee(scene) and space.shading.type == "RENDERED"):
        return
    row = self.layout.row(align=True)
    row.prop(scene.hybrid, "preview", text="", icon="SHADING_RENDERED")
    if scene.hybrid.preview:
        row.label(text=preview.status(context))


def _draw_object_menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.menu("HYBRID_MT_object")


def _draw_collection_menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.operator("hybrid.collection_toggle")


def _draw_image_menu(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    if context.scene.hybrid.enabled and picker.shows_render(context.space_data):
        self.layout.separator()
        self.layout.operator("hybrid.explain_pixel", icon="EYEDROPPER")


_EXTENDED = {
    "VIEW3D_HT_header": _draw_view3d_header,
    "VIEW3D_MT_object": _draw_object_menu,
    "OUTLINER_MT_object": _draw_object_menu,
    "OUTLINER_MT_collection": _draw_collection_menu,
    "IMAGE_MT_image": _draw_image_menu,
}


def register() -> None:
    """Add what is shown in Blender's own headers and menus."""
    for name, draw in _EXTENDED.items():
        getattr(bpy.types, name).append(draw)


def unregister() -> None:
    """Take it away again."""
    for name, draw in _EXTENDED.items():
        getattr(bpy.types, name).remove(draw)
