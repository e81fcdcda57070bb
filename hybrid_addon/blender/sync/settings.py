"""The artist's settings of an object (`Object.hybrid`), read so that the translator also works without the add-on."""

from __future__ import annotations

from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class CustomSurface:
    """The three numbers that replace the materials' (`surface` = CUSTOM)."""

    reflectivity: float
    opacity: float
    ior: float


@dataclass(frozen=True)
class ObjectSettings:
    """Whether the object is ray traced, and its own surface, if it has one."""

    ray_traced: bool = False
    custom: CustomSurface | None = None


def instance_settings(b_instance: bpy.types.DepsgraphObjectInstance) -> ObjectSettings:
    """Of one appearance. Whether it is ray traced its instancer decides, as it decides what EEVEE holds out.

    The surface is the object's own where it is flagged itself, else the instancer's.
    """
    own = object_settings(b_instance.object)
    if b_instance.parent is None:
        return own
    instancer = object_settings(b_instance.parent)
    custom = own.custom if own.ray_traced or not instancer.ray_traced else instancer.custom
    return ObjectSettings(instancer.ray_traced, custom)


def object_settings(b_object: bpy.types.Object) -> ObjectSettings:
    """Of an evaluated object, so with animated values."""
    b_hybrid = getattr(b_object, "hybrid", None)
    if b_hybrid is None:
        return ObjectSettings()
    return ObjectSettings(ray_traced=b_hybrid.ray_traced, custom=_custom(b_hybrid))


def _custom(b_hybrid: bpy.types.PropertyGroup) -> CustomSurface | None:
    if b_hybrid.surface != "CUSTOM":
        return None
    return CustomSurface(b_hybrid.reflectivity, b_hybrid.opacity, b_hybrid.ior)
