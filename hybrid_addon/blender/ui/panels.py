# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: Ray Tracing of objects, materials, collections; Hybrid of the scene; and entries in Blender's menus."""

from __future__ import annotations

import bpy

from ...report.frame import summary
from .. import preview, session
from ..api import GEOMETRY
from ..flags import Flags
from ..pipeline import scene_setup
from . import picker

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
    layout.prop(settings, "dispersion")


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
        return context.engine in {*COMPAT_ENGINES, scene_setup.ENGINE} or context.scene.hybrid.enabled

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.hybrid, "enabled", text="")

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        self.layout.menu("HYBRID_MT_quality_presets", text="", icon="PRESET")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        scene = context.scene
        settings = scene.hybrid
        problem = scene_setup.why_inactive(scene)
        layout.active = settings.enabled or bool(problem)
        if problem and (settings.enabled or context.engine == scene_setup.ENGINE):
            _draw_problem(layout, scene, problem)
        layout.prop(settings, "mode")
        column = layout.column()
        for name in ("samples", "max_depth", "adaptive", "cutoff", "time_budget"):
            column.prop(settings, name)
        layout.operator("hybrid.retrace", icon="FILE_REFRESH")
        report = session.of(scene.name).report
        if report:
            column = layout.column(align=True)
            for line in summary(report):
                column.label(text=line)


class SettingsPanel:
    """What the panels within Hybrid have in common; grey where Hybrid is off."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_parent_id = "HYBRID_RENDER_PT_settings"
    bl_options = {"DEFAULT_CLOSED"}
    layout: bpy.types.UILayout

    def begin(self, context: bpy.types.Context) -> tuple[bpy.types.UILayout, bpy.types.PropertyGroup]:
        """The layout to draw into, and the scene's settings."""
        self.layout.use_property_split = True
        self.layout.active = context.scene.hybrid.enabled
        return self.layout, context.scene.hybrid


class HYBRID_RENDER_PT_light(SettingsPanel, bpy.types.Panel):
    bl_label = "Light"
    bl_order = 2

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        layout.prop(settings, "light_falloff")
        layout.prop(settings, "raster_backed")
        layout.prop(settings, "shadow_samples")
        layout.prop(settings, "rough_samples")
        layout.prop(settings, "occlusion_samples")
        column = layout.column()
        column.active = settings.enabled and settings.occlusion_samples > 0
        column.prop(settings, "occlusion_distance")
        layout.prop(settings, "traced_shadows")
        column = layout.column()
        column.active = settings.enabled and settings.traced_shadows != "OFF"
        column.prop(settings, "caustics")
        if settings.caustics == "PHOTONS":
            column.prop(settings, "photons")


class HYBRID_RENDER_PT_passes(SettingsPanel, bpy.types.Panel):
    bl_label = "Data Passes"
    bl_order = 3

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        layout.use_property_split = False
        layout.column(align=True).prop(settings, "passes")


class HYBRID_RENDER_PT_viewport(SettingsPanel, bpy.types.Panel):
    bl_label = "Viewport Preview"
    bl_order = 4

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.hybrid, "preview", text="")

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        layout.active = settings.enabled and settings.preview
        layout.prop(settings, "preview_budget")


def _draw_problem(layout: bpy.types.UILayout, scene: bpy.types.Scene, problem: str) -> None:
    """Why Hybrid does nothing here, and the way out where it is one click."""
    if scene.library is not None or scene_setup.is_trace_scene(scene):
        layout.label(text=problem[0].upper() + problem[1:], icon="ERROR")
        return
    row = layout.row()
    row.use_property_split = False
    row.label(text="EEVEE draws the other half", icon="ERROR")
    row.prop_enum(scene.render, "engine", scene_setup.eevee())


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
        layout.operator("hybrid.retrace", icon="FILE_REFRESH")
        layout.operator("hybrid.explain_pixel", icon="EYEDROPPER")
        layout.prop(context.scene.hybrid, "shown")
        layout.prop(context.scene.hybrid, "insets")


CLASSES = (
    HYBRID_MT_surface_presets,
    HYBRID_MT_quality_presets,
    HYBRID_MT_object,
    HYBRID_OBJECT_PT_settings,
    HYBRID_MATERIAL_PT_settings,
    HYBRID_COLLECTION_PT_settings,
    HYBRID_RENDER_PT_settings,
    HYBRID_RENDER_PT_light,
    HYBRID_RENDER_PT_passes,
    HYBRID_RENDER_PT_viewport,
    HYBRID_IMAGE_PT_settings,
)


def _draw_view3d_header(self: bpy.types.Header, context: bpy.types.Context) -> None:
    """The preview's toggle, beside the shading of viewports that it works in; why it shows nothing, if so."""
    scene, space = context.scene, context.space_data
    if not (scene.hybrid.enabled and scene_setup.is_eevee(scene) and space.shading.type == "RENDERED"):
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
