# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of quality, for a scene, and of surfaces, for objects. Blender keeps the artist's own, with + and -."""

# No `from __future__ import annotations` here: Blender reads operator properties from the annotations themselves.

from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel
from bpy.app.translations import pgettext_n as n_

from ...presets import QUALITY
from ..api import GEOMETRY
from . import messages
from .translations import iface

ASSETS = Path(__file__).parents[2] / "assets"
"""Folder of the asset library that comes with the add-on (tools/asset_library.py makes it)."""

LIBRARY = ASSETS / "hybrid_assets.blend"

# key: (the material's name there, tooltip)
SURFACES = {
    "MIRROR": (n_("Mirror"), n_("Silver, as behind the glass of a mirror")),
    "CHROME": (n_("Chrome"), n_("Polished chrome: reflectance measured")),
    "GOLD": (n_("Gold"), n_("Polished gold: reflectance measured")),
    "COPPER": (n_("Copper"), n_("Polished copper: reflectance measured")),
    "GLASS": (n_("Glass"), n_("Clear crown glass: IOR 1.517, Abbe number 64")),
    "WINDOW": (n_("Window"), n_("Float glass: IOR 1.52, a little green at its edge")),
    "FROSTED": (n_("Frosted"), n_("Etched glass: IOR 1.517, roughness 0.35")),
    "WATER": (n_("Water"), n_("Clear water: IOR 1.333, blue in metres of it")),
    "ICE": (n_("Ice"), n_("Clear ice: IOR 1.309")),
    "DIAMOND": (n_("Diamond"), n_("Diamond: IOR 2.417, and its fire (Abbe number 55)")),
    "RUBY": (n_("Ruby"), n_("Ruby: IOR 1.766, red for a stone of 1 cm")),
    "CAR_PAINT": (n_("Car Paint"), n_("Red paint under a clear coat")),
}


def preset_material(name: str) -> bpy.types.Material | None:
    """The material of this name from the asset library, appended; the one that is in the file already, if it is.

    None: the library, or the material in it, is missing.
    """
    if not LIBRARY.is_file():
        return None
    there = [b_material for b_material in bpy.data.materials if _is_from_library(b_material, name)]
    return min(there, key=lambda b_material: b_material.name != name, default=None) or _appended(name)


ORIGIN = "preset"
"""Key within `Material.hybrid`, by which a preset finds its material again under any name. Copies have it, too."""


def _appended(name: str) -> bpy.types.Material | None:
    """Not by Blender's operator, which no mode but Object Mode lets run, and which changes the selection."""
    with bpy.data.libraries.load(str(LIBRARY)) as (there, wanted):
        wanted.materials = [name] if name in there.materials else []
    for b_material in wanted.materials:
        b_material.asset_clear()  # it is an asset there: here it would fill the artist's own library
        b_material.hybrid[ORIGIN] = name
        return b_material
    return None


def _is_from_library(b_material: bpy.types.Material, name: str) -> bool:
    if b_material.library is not None:
        return False
    origin = b_material.library_weak_reference  # of what Blender's Asset Browser has appended
    dropped = origin is not None and origin.id_name == f"MA{name}" and Path(origin.filepath).name == LIBRARY.name
    return dropped or b_material.hybrid.get(ORIGIN) == name


def _wear(b_object: bpy.types.Object, b_material: bpy.types.Material) -> bool:
    """Put the material into the object's active slot; False if it can have none."""
    if b_object.material_slots:
        b_slot = b_object.material_slots[b_object.active_material_index]
        if b_object.data.library is not None:
            b_slot.link = "OBJECT"
        b_slot.material = b_material
        return True
    if not hasattr(b_object.data, "materials") or b_object.data.library is not None:
        return False
    b_object.data.materials.append(b_material)
    return True


def _chosen(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The selected objects; where none is, the active one."""
    active = [context.object] if context.object is not None else []
    return list(context.selected_objects) or active


class HYBRID_OT_surface_preset(bpy.types.Operator):
    bl_idname = "hybrid.surface_preset"
    bl_label = "Surface Preset"
    bl_description = "Make the selected objects ray traced, with a common material in their active slot"
    bl_options = {"REGISTER", "UNDO"}

    preset: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Preset",
        items=[(key, name, tooltip) for key, (name, tooltip) in SURFACES.items()],
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return iface(SURFACES[properties.preset][1])

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any(b_object.type in GEOMETRY for b_object in _chosen(context)):
            return True
        cls.poll_message_set("Select an object with a surface")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        chosen = [ob for ob in _chosen(context) if ob.type in GEOMETRY and not ob.library]
        if not chosen:
            self.report({"WARNING"}, iface("They are linked from another file: nothing was changed"))
            return {"CANCELLED"}
        name = SURFACES[self.preset][0]
        b_material = preset_material(name)
        if b_material is None:
            self.report({"ERROR"}, iface("{} is missing: install the add-on again").format(f"{LIBRARY.name}: {name}"))
            return {"CANCELLED"}
        first, worn = messages.is_first(context.scene), 0
        for b_object in chosen:
            if not _wear(b_object, b_material):
                self.report({"WARNING"}, iface("{} can wear no material").format(b_object.name))
                continue
            b_object.hybrid.dispersion, b_object.hybrid.surface = 0.0, "MATERIAL"
            b_object.hybrid.ray_traced = True
            worn += 1
        if first and worn:
            messages.switch_on(context.scene)
        self.report({"INFO"}, iface("Objects that wear {} now: {}").format(b_material.name, worn))
        return {"FINISHED"}


class HYBRID_OT_add_asset_library(bpy.types.Operator):
    bl_idname = "hybrid.add_asset_library"
    bl_label = "Add Asset Library"
    bl_description = "Show the materials and light rigs of the add-on (CC0) in the Asset Browser"
    bl_options = {"REGISTER", "INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        if not has_asset_library(context):
            context.preferences.filepaths.asset_libraries.new(name="Hybrid", directory=str(ASSETS))
        self.report({"INFO"}, iface("Materials and light rigs are in the Asset Browser: library Hybrid"))
        return {"FINISHED"}


def has_asset_library(context: bpy.types.Context) -> bool:
    """Whether Blender shows our library."""
    return any(Path(library.path) == ASSETS for library in context.preferences.filepaths.asset_libraries)


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
        return iface(QUALITY[properties.preset][1])

    def execute(self, context: bpy.types.Context) -> set[str]:
        for name, value in QUALITY[self.preset][2].values().items():
            setattr(context.scene.hybrid, name, value)
        return {"FINISHED"}


class OurPresets(PresetPanel):
    """A list of presets: ours first, then the artist's own."""

    operator = preset_subdir = preset_add_operator = ""

    def draw(self, context: bpy.types.Context) -> None:
        """Ours by an operator, which knows what each is for; those in files as Blender draws them, with + and -."""
        column = self.layout.column()
        column.emboss = "PULLDOWN_MENU"
        column.operator_enum(self.operator, "preset")
        if bpy.utils.preset_paths(self.preset_subdir):
            super().draw(context)
            return
        row = self.layout.row(align=True)  # Blender says "Missing Paths" where nobody has saved one yet
        row.operator_context = "EXEC_DEFAULT"  # as Blender does: at once, by the name that stands there
        row.prop(context.window_manager, "preset_name", text="")
        row.operator(self.preset_add_operator, text="", icon="ADD").name = context.window_manager.preset_name


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

    def draw(self, context: bpy.types.Context) -> None:
        super().draw(context)
        if not has_asset_library(context):
            self.layout.separator()
            self.layout.operator("hybrid.add_asset_library", icon="ASSET_MANAGER")


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
    # A value sets Custom: `surface` after them.
    preset_values = [f"hybrid.{name}" for name in ("reflectivity", "opacity", "ior", "dispersion", "surface")]


CLASSES = (
    HYBRID_OT_surface_preset,
    HYBRID_OT_add_asset_library,
    HYBRID_OT_quality_preset,
    HYBRID_OT_quality_preset_add,
    HYBRID_OT_surface_preset_add,
    HYBRID_PT_quality_presets,
    HYBRID_PT_surface_presets,
)
