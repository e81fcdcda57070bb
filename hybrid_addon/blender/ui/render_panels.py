# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels of the Render tab: *Hybrid*, and what lies in it."""

from __future__ import annotations

import bpy

from ..pipeline import scene_setup
from . import messages
from .layout import field, ticked_field
from .presets import HYBRID_PT_quality_presets
from .translations import CONTEXT

COMPAT_ENGINES = {"BLENDER_EEVEE", "BLENDER_EEVEE_NEXT"}


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
        self.layout.operator("hybrid.manual", text="", icon="HELP", emboss=False)
        HYBRID_PT_quality_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.active = context.scene.hybrid.enabled or bool(scene_setup.why_inactive(context.scene))
        messages.draw_state(layout, context)
        layout.operator("hybrid.retrace", icon="FILE_REFRESH")


class SettingsPanel:
    """What the panels within Hybrid have in common; grey where Hybrid is off, or EEVEE does not draw."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_parent_id = "HYBRID_RENDER_PT_settings"
    bl_options = {"DEFAULT_CLOSED"}
    layout: bpy.types.UILayout

    def begin(self, context: bpy.types.Context) -> tuple[bpy.types.UILayout, bpy.types.PropertyGroup]:
        """The layout to draw into, and the scene's settings."""
        self.layout.active = context.scene.hybrid.enabled and scene_setup.is_eevee(context.scene)
        return self.layout.column(), context.scene.hybrid


class HYBRID_RENDER_PT_sampling(SettingsPanel, bpy.types.Panel):
    bl_label = "Sampling"
    bl_order = 2
    bl_options = set()

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        field(layout, context, settings, "samples")
        ticked_field(layout, context, settings, "use_adaptive", "adaptive")
        ticked_field(layout, context, settings, "use_time_budget", "time_budget")


class HYBRID_RENDER_PT_paths(SettingsPanel, bpy.types.Panel):
    bl_label = "Light Paths"
    bl_order = 3

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        field(layout, context, settings, "max_depth")
        field(layout, context, settings, "cutoff")
        field(layout, context, settings, "raster_backed")


class HYBRID_RENDER_PT_rough(SettingsPanel, bpy.types.Panel):
    bl_label = "Rough Surfaces"
    bl_order = 4

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        field(layout, context, settings, "rough_samples")
        field(layout, context, settings, "denoise")


class HYBRID_RENDER_PT_shadows(SettingsPanel, bpy.types.Panel):
    bl_label = "Shadows"
    bl_order = 5

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        field(layout, context, settings, "shadow_samples")
        field(layout, context, settings, "traced_shadows")
        column = layout.column()
        column.active = settings.traced_shadows != "OFF"
        field(column, context, settings, "caustics")
        if settings.caustics == "PHOTONS":
            field(column, context, settings, "photons")


class HYBRID_RENDER_PT_occlusion(SettingsPanel, bpy.types.Panel):
    bl_label = "Ambient Occlusion"
    bl_order = 6

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        field(layout, context, settings, "occlusion_samples")
        column = layout.column()
        column.active = settings.occlusion_samples > 0
        field(column, context, settings, "occlusion_distance")


class HYBRID_RENDER_PT_performance(SettingsPanel, bpy.types.Panel):
    bl_label = "Performance"
    bl_order = 7

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        field(layout, context, settings, "threads")


class HYBRID_RENDER_PT_passes(SettingsPanel, bpy.types.Panel):
    bl_label = "Passes"
    bl_order = 8

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        for choice in settings.bl_rna.properties["passes"].enum_items:
            field(layout, context, settings, f"pass_{choice.identifier.lower()}")


class HYBRID_RENDER_PT_viewport(SettingsPanel, bpy.types.Panel):
    bl_label = "Preview"
    bl_order = 9

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.hybrid, "preview", text="")

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        layout.active = settings.preview
        ticked_field(layout, context, settings, "use_preview_budget", "preview_budget")


class HYBRID_RENDER_PT_advanced(SettingsPanel, bpy.types.Panel):
    bl_label = "Advanced"
    bl_order = 10

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.begin(context)
        field(layout, context, settings, "mode")
        field(layout, context, settings, "light_falloff")


class HYBRID_RENDER_PT_report(SettingsPanel, bpy.types.Panel):
    bl_label = "Report"
    bl_translation_context = CONTEXT
    bl_order = 11

    def draw(self, context: bpy.types.Context) -> None:
        layout, _ = self.begin(context)
        messages.draw_report(layout, context)


CLASSES = (
    HYBRID_RENDER_PT_settings,
    HYBRID_RENDER_PT_sampling,
    HYBRID_RENDER_PT_paths,
    HYBRID_RENDER_PT_rough,
    HYBRID_RENDER_PT_shadows,
    HYBRID_RENDER_PT_occlusion,
    HYBRID_RENDER_PT_performance,
    HYBRID_RENDER_PT_passes,
    HYBRID_RENDER_PT_viewport,
    HYBRID_RENDER_PT_advanced,
    HYBRID_RENDER_PT_report,
)
