# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels named Hybrid of objects, materials and collections; and entries in Blender's menus."""

from __future__ import annotations

import bpy

from .. import preview
from ..api import GEOMETRY
from ..flags import Flags, is_traced_by_itself, why_not
from ..pipeline import scene_setup
from ..pipeline.transmission import shown_surface
from ..sync.camera import panorama_settings
from ..sync.material import customised
from ..sync.settings import custom_surface
from .image_editor import picker
from .layout import field, paragraph, room, splits
from .presets import HYBRID_PT_surface_presets
from .render_panels import COMPAT_ENGINES
from .surface_words import described
from .translations import iface, sentence

PANORAMA_SETTINGS: dict[str, tuple[dict[str, str], ...]] = {
    "EQUIRECTANGULAR": (
        {"latitude_min": "Latitude Min", "latitude_max": "Max"},
        {"longitude_min": "Longitude Min", "longitude_max": "Max"},
    ),
    "FISHEYE_EQUIDISTANT": ({"fisheye_fov": "Field of View"},),
    "FISHEYE_EQUISOLID": ({"fisheye_lens": "Lens", "fisheye_fov": "Field of View"},),
    "FISHEYE_LENS_POLYNOMIAL": (
        {"fisheye_fov": "Field of View"},
        {f"fisheye_polynomial_k{power}": f"K{power}" for power in range(5)},
    ),
    "CENTRAL_CYLINDRICAL": (
        {"central_cylindrical_range_v_min": "Height Min", "central_cylindrical_range_v_max": "Max"},
        {"central_cylindrical_range_u_min": "Longitude Min", "central_cylindrical_range_u_max": "Max"},
        {"central_cylindrical_radius": "Radius"},
    ),
}
"""Of each kind of panorama the settings that it reads, in groups, with Blender's words for them."""

MATERIALS_SHOWN = 3
"""Of an object with many materials, in its panel."""


class HYBRID_OBJECT_PT_settings(bpy.types.Panel):
    bl_label = "Hybrid"
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
        HYBRID_PT_surface_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        layout, b_object = self.layout, context.object
        settings = b_object.hybrid
        ray_traced = Flags(context.scene).is_ray_traced(b_object)
        if ray_traced and not context.scene.hybrid.enabled:
            _draw_switched_off(layout, context)
        if ray_traced and not settings.ray_traced:
            paragraph(layout, context, iface("Ray traced by its collection"), icon="OUTLINER_COLLECTION")
        ticked = any(b_slot.material and is_traced_by_itself(b_slot.material) for b_slot in b_object.material_slots)
        if ticked and not ray_traced:
            paragraph(layout, context, iface("Some of its materials are ray traced"), icon="MATERIAL")
        column = layout.column()
        column.active = ray_traced or ticked
        _draw_surface(column, context, settings)
        if settings.surface == "MATERIAL":
            _draw_materials(column, context, b_object)
        field(column, context, settings, "dispersion")
        field(column, context, settings, "program")


class HYBRID_MATERIAL_PT_settings(bpy.types.Panel):
    bl_label = "Hybrid"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        b_material = context.material
        return context.engine in COMPAT_ENGINES and b_material is not None and not b_material.grease_pencil

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.material.hybrid, "ray_traced", text="")

    def draw(self, context: bpy.types.Context) -> None:
        layout, b_material = self.layout, context.material
        settings = b_material.hybrid
        problem = why_not(b_material) if settings.ray_traced else ""
        if problem:
            paragraph(layout, context, sentence(problem), icon="ERROR")
        elif settings.ray_traced and not context.scene.hybrid.enabled:
            _draw_switched_off(layout, context)
        if context.object is not None and context.object.hybrid.surface == "CUSTOM":
            paragraph(layout, context, iface("The object's own Custom values are used"), icon="INFO")
        _draw_surface(layout, context, settings)
        if settings.surface == "MATERIAL":
            for line in described(shown_surface(b_material, context)):
                paragraph(layout, context, line)
        field(layout, context, settings, "dispersion")
        field(layout, context, settings, "program")


class HYBRID_COLLECTION_PT_settings(bpy.types.Panel):
    bl_label = "Hybrid"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "collection"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in COMPAT_ENGINES and context.collection is not None

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.collection.hybrid, "ray_traced", text="")

    def draw(self, context: bpy.types.Context) -> None:
        layout, collection = self.layout, context.collection
        if not collection.hybrid.ray_traced:
            text = iface("Its objects follow their own ticks")
        else:
            count = sum(b_object.type in GEOMETRY for b_object in collection.all_objects)
            text = iface("All objects in here are ray traced: {}").format(count)
        paragraph(layout, context, text)


class HYBRID_CAMERA_PT_panorama(bpy.types.Panel):
    """Settings of a panorama, which Blender shows with Cycles only."""

    bl_label = "Hybrid"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        b_camera = context.camera
        if context.engine not in COMPAT_ENGINES or b_camera is None or b_camera.type != "PANO":
            return False
        return context.scene.hybrid.enabled and panorama_settings(b_camera) is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout, b_mapping = self.layout, panorama_settings(context.camera)
        if context.scene.hybrid.mode != "FULL":
            paragraph(layout, context, iface("Drawn as Perspective, as EEVEE draws it"), icon="INFO")
            field(layout, context, context.scene.hybrid, "mode")
            return
        layout.prop(b_mapping, "panorama_type", text="")
        layout.use_property_split, layout.use_property_decorate = splits(room(context)), False
        for group in PANORAMA_SETTINGS.get(b_mapping.panorama_type, ()):
            column = layout.column(align=True)
            for name, text in group.items():
                column.prop(b_mapping, name, text=text)


def _draw_switched_off(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    paragraph(layout, context, iface("Hybrid is off in this scene"), icon="INFO")
    layout.prop(context.scene.hybrid, "enabled", text="Switch On", toggle=True)


def _draw_surface(layout: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup) -> None:
    """Where the values come from, and the values if they are these."""
    field(layout, context, settings, "surface")
    if settings.surface == "CUSTOM":
        for name in ("reflectivity", "opacity", "ior"):
            field(layout, context, settings, name)


def _draw_materials(layout: bpy.types.UILayout, context: bpy.types.Context, b_object: bpy.types.Object) -> None:
    """What its materials say: the values that are used."""
    materials = list(dict.fromkeys(b_slot.material for b_slot in b_object.material_slots))
    for b_material in materials[:MATERIALS_SHOWN] or [None]:
        if len(materials) > 1:
            layout.label(text=b_material.name if b_material else "", icon="MATERIAL", translate=False)
        surface = customised(shown_surface(b_material, context), custom_surface(b_material))
        for line in described(surface):
            paragraph(layout, context, line)
    if len(materials) > MATERIALS_SHOWN:
        text = iface("and {} more materials").format(len(materials) - MATERIALS_SHOWN)
        paragraph(layout, context, text)


class HYBRID_MT_object(bpy.types.Menu):
    bl_label = "Hybrid"

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


CLASSES = (
    HYBRID_MT_object,
    HYBRID_OBJECT_PT_settings,
    HYBRID_MATERIAL_PT_settings,
    HYBRID_COLLECTION_PT_settings,
    HYBRID_CAMERA_PT_panorama,
)


def _draw_view3d_header(self: bpy.types.Header, context: bpy.types.Context) -> None:
    """The preview's toggle, beside the shading of viewports that it works in; why it shows nothing, if so."""
    scene, space = context.scene, context.space_data
    if not (scene.hybrid.enabled and scene_setup.is_eevee(scene) and space.shading.type == "RENDERED"):
        return
    row = self.layout.row(align=True)
    row.prop(scene.hybrid, "preview", text="", icon_value=preview.icon.icon_id())
    if scene.hybrid.preview:
        row.label(text=sentence(preview.status(context)), translate=False)


def _draw_overlays(self: bpy.types.Panel, context: bpy.types.Context) -> None:
    """A tick in the popover of the viewport's overlays."""
    if context.scene.hybrid.enabled:
        self.layout.prop(context.scene.hybrid, "tint")


def _draw_outliner_header(self: bpy.types.Header, context: bpy.types.Context) -> None:
    """Whether the active object is ray traced. Rows of the Outliner have no place for icons of add-ons."""
    b_object = context.object
    if context.scene.hybrid.enabled and b_object is not None and b_object.type in GEOMETRY:
        self.layout.prop(b_object.hybrid, "ray_traced", text="", icon_value=preview.icon.icon_id())


def _draw_render_menu(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    if context.scene.hybrid.enabled:
        self.layout.separator()
        self.layout.operator("hybrid.render_cameras", icon="OUTLINER_OB_CAMERA")


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
    "VIEW3D_PT_overlay_object": _draw_overlays,
    "OUTLINER_HT_header": _draw_outliner_header,
    "TOPBAR_MT_render": _draw_render_menu,
}


_FIRST = {"OUTLINER_HT_header"}
"""Where nothing fits behind what Blender draws: at its default width the Outliner's header is full."""


def register() -> None:
    """Add what is shown in Blender's own headers and menus."""
    for name, draw in _EXTENDED.items():
        kind = getattr(bpy.types, name)
        (kind.prepend if name in _FIRST else kind.append)(draw)


def unregister() -> None:
    """Take it away again."""
    for name, draw in _EXTENDED.items():
        getattr(bpy.types, name).remove(draw)
