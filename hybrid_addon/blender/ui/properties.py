# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist can set, per object and per scene, made from `settings_table`; docs/manual/settings.md tells it."""

# No `from __future__ import annotations` here: Blender reads the properties from the annotations themselves.

from collections.abc import Callable, Iterable
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty
from bpy.types import Collection, Context, Material, Object, PropertyGroup, Scene

from ... import programs
from ...settings_table import SCENE, SURFACE, Setting
from .. import preview, session
from ..pipeline import scene_setup
from . import defaults, messages
from .image_editor import slots


def _is_click(context: Context) -> bool:
    """Whether a property is changed in our panels: a script says itself what else it wants."""
    return context.area is not None and context.area.type == "PROPERTIES"


def _flag_changed(settings: "HybridObjectSettings", context: Context) -> None:
    scene_setup.object_changed(settings.id_data)
    if _is_click(context) and settings.ray_traced and messages.is_first(context.scene, settings.id_data):
        messages.switch_on(context.scene)


def _collection_changed(settings: "HybridCollectionSettings", context: Context) -> None:
    scene_setup.collection_changed()
    if _is_click(context) and settings.ray_traced and messages.is_first(context.scene, settings.id_data):
        messages.switch_on(context.scene)


def _material_changed(settings: "HybridMaterialSettings", context: Context) -> None:
    scene_setup.collection_changed()
    if _is_click(context) and settings.ray_traced and messages.is_first(context.scene, settings.id_data):
        messages.switch_on(context.scene)


def _value_changed(settings: "HybridObjectSettings | HybridMaterialSettings", _context: Context) -> None:
    settings.surface = "CUSTOM"  # whoever moves a slider, or sets a value from Python, means it


def _program_names(_settings: Any, _context: Context, _typed: str) -> list[str]:
    return programs.names()


def _program_changed(settings: "HybridObjectSettings | HybridMaterialSettings", _context: Context) -> None:
    scene_setup.collection_changed()  # EEVEE may have to draw what lies behind


def _enabled_changed(settings: "HybridSceneSettings", context: Context) -> None:
    defaults.stamp(settings.id_data)
    _scene_changed(settings, context)
    if not settings.enabled and not bpy.app.background:  # there `render` switches it on and off again for each frame
        session.of(settings.id_data.name).release()
        preview.forget()


def _scene_changed(settings: "HybridSceneSettings", _context: Context) -> None:
    scene_setup.scene_changed(settings.id_data)


def _passes_changed(settings: "HybridSceneSettings", _context: Context) -> None:
    scene_setup.passes_changed(settings.id_data)


def _preview_changed(_settings: "HybridSceneSettings", _context: Context) -> None:
    preview.setting_changed()


def _insets_changed(settings: "HybridSceneSettings", _context: Context) -> None:
    slots.changed(settings.id_data)


# What is brought up to date when a setting of the table changes, by its `changes`.
_CHANGED: dict[str, Callable[[Any, Context], None]] = {
    "SURFACE": _value_changed,
    "SWITCH": _enabled_changed,
    "SCENE": _scene_changed,
    "PASSES": _passes_changed,
    "PREVIEW": _preview_changed,
    "EDITOR": _insets_changed,
}

OVERRIDABLE = {"LIBRARY_OVERRIDABLE"}
"""Blender keeps values of a library override only where the group and all of its pointers can be overridden."""

_PROPERTIES: dict[str, Callable[..., Any]] = {
    "BOOL": BoolProperty,
    "INT": IntProperty,
    "FLOAT": FloatProperty,
    "ENUM": EnumProperty,
    "FLAGS": EnumProperty,
}


def made(settings: Iterable[Setting]) -> dict[str, Any]:
    """Annotations from which Blender makes a property of each setting."""
    return {setting.name: _made(setting) for setting in settings}


def _made(setting: Setting) -> Any:
    options = {"ANIMATABLE"} if setting.animatable else set()
    choices = [
        (choice.key, choice.label, choice.description, number if choice.number is None else choice.number)
        for number, choice in enumerate(setting.choices)
    ]
    flags = setting.kind == "FLAGS"
    keywords = {
        "name": setting.label,
        "description": setting.description,
        "default": set(setting.default) if isinstance(setting.default, frozenset) else setting.default,
        "min": setting.low,
        "max": setting.high,
        "soft_min": setting.soft_low,
        "soft_max": setting.soft_high,
        "step": setting.step,
        "precision": setting.precision,
        "unit": setting.unit,
        "subtype": setting.subtype,
        "items": choices or None,
        "options": options | {"ENUM_FLAG"} if flags else options,
        "override": OVERRIDABLE,
        "update": _CHANGED.get(setting.changes),
    }
    given = {name: value for name, value in keywords.items() if value is not None}  # None: Blender's own default
    return _PROPERTIES[setting.kind](**given)


def _switch(setting: Setting) -> Any:
    """A tick for a number whose 0 means off. It holds nothing itself: unticked the number is 0, and comes back."""
    name = setting.name

    def get(settings: Any) -> bool:
        return bool(getattr(settings, name) > 0)

    def put(settings: Any, on: bool) -> None:
        value = getattr(settings, name)
        key = (settings.id_data.session_uid, name)
        if value > 0:
            _last[key] = value
        setattr(settings, name, _last.get(key, setting.on) if on else 0.0)

    return BoolProperty(name=setting.label, description=setting.description, get=get, set=put, options=HIDDEN)


def _member(setting: Setting, number: int) -> Any:
    """A tick for one of a set of choices."""
    choice = setting.choices[number]

    def get(settings: Any) -> bool:
        return choice.key in getattr(settings, setting.name)

    def put(settings: Any, on: bool) -> None:
        chosen = getattr(settings, setting.name)
        setattr(settings, setting.name, chosen | {choice.key} if on else chosen - {choice.key})

    return BoolProperty(name=choice.label, description=choice.description, get=get, set=put, options=HIDDEN)


HIDDEN = {"HIDDEN", "SKIP_SAVE"}
"""Options of what stands for another property: it is in no list of properties, and in no file."""

_last: dict[tuple[int, str], float] = {}
"""Of (scene, setting) the number before it was switched off."""


def ticks(settings: Iterable[Setting]) -> dict[str, Any]:
    """Annotations of the ticks that panels show: `use_NAME` beside a number whose 0 is off, `pass_NAME` of passes."""
    made_ticks = {f"use_{setting.name}": _switch(setting) for setting in settings if setting.on}
    for setting in settings:
        if setting.kind == "FLAGS":
            made_ticks |= {f"pass_{key.lower()}": _member(setting, i) for i, key in enumerate(setting.keys)}
    return made_ticks


def _program_property(description: str) -> Any:
    """The name of a surface program, of an object or a material."""
    return StringProperty(
        name="Surface Program",
        description=description,
        search=_program_names,
        search_options={"SUGGESTION"},
        override=OVERRIDABLE,
        update=_program_changed,
    )


class SurfaceValues:
    """The numbers that an object or a material may have of its own. Blender finds them in base classes, too."""

    __annotations__ = made(SURFACE)


class HybridObjectSettings(SurfaceValues, PropertyGroup):
    """`Object.hybrid`: whether the object is ray traced, and how its surface answers light."""

    ray_traced: BoolProperty(  # type: ignore[valid-type]
        name="Ray Traced",
        description="Draw this object with the ray tracer; EEVEE draws everything else",
        default=False,
        options=set(),  # not animatable: a view layer's holdout cannot change between frames
        override=OVERRIDABLE,
        update=_flag_changed,
    )
    surface: EnumProperty(  # type: ignore[valid-type]
        name="Surface",
        description="Where reflectivity, opacity and IOR come from",
        items=(
            ("MATERIAL", "From Material", "Read them from the object's materials (metallic, transmission, alpha, IOR)"),
            ("CUSTOM", "Custom", "Use the values below instead of the materials'"),
        ),
        default="MATERIAL",
        override=OVERRIDABLE,
    )

    program: _program_property(  # type: ignore[valid-type]
        "A registered function that answers for this object instead of its material"
    )

    @classmethod
    def register(cls) -> None:
        """Attach to bpy.types.Object."""
        Object.hybrid = PointerProperty(name="Hybrid", description="Hybrid ray tracing", type=cls, override=OVERRIDABLE)

    @classmethod
    def unregister(cls) -> None:
        """Detach again."""
        del Object.hybrid


class HybridMaterialSettings(SurfaceValues, PropertyGroup):
    """`Material.hybrid`: whether all that wears it is ray traced, and how it answers light, slot by slot."""

    ray_traced: BoolProperty(  # type: ignore[valid-type]
        name="Ray Traced",
        description="Draw all faces that wear this material with the ray tracer, and EEVEE the rest of their objects",
        default=False,
        options=set(),  # as for objects
        override=OVERRIDABLE,
        update=_material_changed,
    )
    surface: EnumProperty(  # type: ignore[valid-type]
        name="Surface",
        description="Where reflectivity, opacity and IOR of this material come from",
        items=(
            ("MATERIAL", "From Nodes", "Read them from the shader nodes (metallic, transmission, alpha, IOR)"),
            ("CUSTOM", "Custom", "Use the values below instead of the nodes'; an object's own Custom wins over them"),
        ),
        default="MATERIAL",
        override=OVERRIDABLE,
    )

    program: _program_property(  # type: ignore[valid-type]
        "A registered function that answers for what wears this material; an object's own wins over it"
    )

    @classmethod
    def register(cls) -> None:
        """Attach to bpy.types.Material."""
        Material.hybrid = PointerProperty(
            name="Hybrid", description="Hybrid ray tracing", type=cls, override=OVERRIDABLE
        )

    @classmethod
    def unregister(cls) -> None:
        """Detach again."""
        del Material.hybrid


class HybridCollectionSettings(PropertyGroup):
    """`Collection.hybrid`: whether all its objects are ray traced."""

    ray_traced: BoolProperty(  # type: ignore[valid-type]
        name="Ray Traced",
        description="Draw all objects in this collection, in those below it, and its instances with the ray tracer",
        default=False,
        options=set(),  # as for objects
        override=OVERRIDABLE,
        update=_collection_changed,
    )

    @classmethod
    def register(cls) -> None:
        """Attach to bpy.types.Collection."""
        Collection.hybrid = PointerProperty(
            name="Hybrid", description="Hybrid ray tracing", type=cls, override=OVERRIDABLE
        )

    @classmethod
    def unregister(cls) -> None:
        """Detach again."""
        del Collection.hybrid


class HybridSceneSettings(PropertyGroup):
    """`Scene.hybrid`: the settings of the table, and (hidden) what the pipeline made in this scene."""

    # Of the defaults that these settings were made with (defaults.py).
    version: IntProperty(options={"HIDDEN"})  # type: ignore[valid-type]
    # What the pipeline has to put back (JSON).
    restore: StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]
    # What the user has linked to our nodes, while these are away (JSON).
    memory: StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]

    @classmethod
    def register(cls) -> None:
        """Attach to bpy.types.Scene."""
        Scene.hybrid = PointerProperty(name="Hybrid", description="Hybrid ray tracing", type=cls, override=OVERRIDABLE)

    @classmethod
    def unregister(cls) -> None:
        """Detach again."""
        del Scene.hybrid


HybridSceneSettings.__annotations__ = {**made(SCENE), **ticks(SCENE), **HybridSceneSettings.__annotations__}

CLASSES = (HybridObjectSettings, HybridMaterialSettings, HybridCollectionSettings, HybridSceneSettings)
