# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's settings of an object (`Object.hybrid`), read so that the translator also works without the add-on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy

from ...scene import Arriving
from ..flags import Flags
from ..view_layers import source_layer
from .surface_programs import NamedProgram, named_program


@dataclass(frozen=True)
class CustomSurface:
    """What an object, or a material, has of its own.

    values     : reflectivity, opacity and IOR that replace the nodes' (`surface` = CUSTOM); None: the nodes' count.
    dispersion : 20 / Abbe number, beside whichever IOR counts.
    program    : the surface program that answers for it; None: there is none.
    """

    values: tuple[float, float, float] | None
    dispersion: float = 0.0
    program: NamedProgram | None = None

    def over(self, other: CustomSurface) -> CustomSurface:
        """These, and the other's where there are none."""
        return CustomSurface(
            self.values or other.values, self.dispersion or other.dispersion, self.program or other.program
        )


NOTHING_OF_ITS_OWN = CustomSurface(None)


@dataclass(frozen=True)
class ObjectSettings:
    """Whether the object is ray traced, and its own surface, if it has one."""

    ray_traced: bool = False
    custom: CustomSurface = NOTHING_OF_ITS_OWN


def instance_settings(b_instance: bpy.types.DepsgraphObjectInstance, flags: Flags) -> ObjectSettings:
    """Of one appearance. Whether it is ray traced its instancer decides, as it decides what EEVEE holds out.

    The surface is the object's own where it is ray traced itself, else the instancer's.
    """
    own = object_settings(b_instance.object, flags)
    if b_instance.parent is None:
        return own
    instancer = object_settings(b_instance.parent, flags)
    custom = own.custom if own.ray_traced or not instancer.ray_traced else instancer.custom
    return ObjectSettings(instancer.ray_traced, custom)


def object_settings(b_object: bpy.types.Object, flags: Flags) -> ObjectSettings:
    """Of an evaluated object, so with animated values."""
    return ObjectSettings(ray_traced=flags.is_ray_traced(b_object), custom=custom_surface(b_object))


def custom_surface(b_id: bpy.types.Object | bpy.types.Material | None) -> CustomSurface:
    """The numbers of an evaluated object or material that stand in for those of its nodes, or beside them."""
    b_hybrid = getattr(b_id, "hybrid", None)
    if b_hybrid is None:
        return NOTHING_OF_ITS_OWN
    is_custom = b_hybrid.surface == "CUSTOM"
    values = (b_hybrid.reflectivity, b_hybrid.opacity, b_hybrid.ior) if is_custom else None
    return CustomSurface(values, b_hybrid.dispersion, named_program(b_id))


def rough_samples(b_scene: bpy.types.Scene) -> int:
    """Rays for each reflection and refraction of a rough surface; 0: it shows the world's blurred image."""
    return getattr(getattr(b_scene, "hybrid", None), "rough_samples", 0)


def material_override(b_scene: bpy.types.Scene, b_depsgraph: bpy.types.Depsgraph) -> bpy.types.Material | None:
    """The material that all objects of the view layer wear instead of their own. EEVEE of Blender 4.5 has none."""
    b_material = source_layer(b_scene).material_override if bpy.app.version >= (5, 0, 0) else None
    return b_material.evaluated_get(b_depsgraph) if b_material else None


def direct_strength(b_scene: bpy.types.Scene) -> float:
    """*Light Strength > Direct* (Blender 5.1 and later): all light of lights is multiplied by it."""
    return getattr(b_scene.eevee, "direct_light_intensity", 1.0)


def arriving(b_scene: bpy.types.Scene) -> Arriving:
    """*Light Strength > Indirect*, and *Clamping* of surfaces; EEVEE clamps first, then multiplies by the strength."""
    b_eevee = b_scene.eevee
    direct, indirect = b_eevee.clamp_surface_direct, b_eevee.clamp_surface_indirect
    return Arriving(
        indirect=getattr(b_eevee, "indirect_light_intensity", 1.0),
        direct_limit=direct * direct_strength(b_scene) if direct > 0.0 else math.inf,
        indirect_limit=indirect if indirect > 0.0 else math.inf,
    )
