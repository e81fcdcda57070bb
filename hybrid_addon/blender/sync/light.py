# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights -> scene lights. The only file where a light's watts are turned into radiometric units.

Sources: EEVEE's eevee_light.cc (Light::sync, shape_radiance_get, attenuation_radius_get) and blenkernel's light.cc
(BKE_light_power, BKE_light_color, BKE_light_area). All colours are scene-linear.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import bpy
import numpy as np

from ...scene import RGB, AreaLight, Float64, Light, PointLight, SpotLight, SunLight
from .messages import Warnings
from .nodes import uses_nodes

Falloff = Literal["EEVEE", "PHYSICAL"]

MIN_AREA_SIDES = 1e-5  # m^2, of the product of the half sides: EEVEE draws no area light below it
MIN_HALF_SIDE = 0.003  # m, and makes no side shorter than this
MIN_LIGHT_THRESHOLD = 1e-16  # EEVEE's clamp
MIN_SPOT_SCALE = 1e-8  # EEVEE's clamp


@dataclass(frozen=True)
class LightContext:
    """What a light needs to know of the scene: the falloff wanted, and EEVEE's `light_threshold` (W/m^2)."""

    falloff: Falloff
    threshold: float


def translate_light(
    b_object: bpy.types.Object, matrix_world: Float64, context: LightContext, warn: Warnings
) -> Light | None:
    """One light at `matrix_world` (4, 4); None, and a warning, where it can shine nowhere."""
    b_light = b_object.data
    _warn_of_ignored(b_object, warn)
    if not _is_placed(b_light, matrix_world):
        warn.add(f"light {b_object.name!r} is nowhere (its matrix is singular or not finite) and gives no light")
        return None
    return TRANSLATORS[b_light.type](b_object, matrix_world, context, warn)


# ------------------------------------------------------------------------------------------------ the four kinds


def _point(b_object: bpy.types.Object, matrix_world: Float64, context: LightContext, warn: Warnings) -> PointLight:
    return PointLight(**_point_fields(b_object, matrix_world, context))


def _point_fields(b_object: bpy.types.Object, matrix_world: Float64, context: LightContext) -> dict[str, Any]:
    b_light = b_object.data
    return {
        "name": b_object.name,
        "position": _vector(matrix_world[:3, 3]),
        "intensity": _scaled(power(b_light, matrix_world), 1.0 / (4.0 * math.pi)),
        "radius": b_light.shadow_soft_size,
        "range": light_range(b_light, context),
        "soft_falloff": b_light.use_soft_falloff,
        **_common_fields(b_object),
    }


def _spot(b_object: bpy.types.Object, matrix_world: Float64, context: LightContext, warn: Warnings) -> SpotLight:
    b_light = b_object.data
    return SpotLight(
        **_point_fields(b_object, matrix_world, context),
        world_to_light=_world_to_light(matrix_world),
        cos_cone=math.cos(0.5 * b_light.spot_size),
        blend=b_light.spot_blend,
    )


def _sun(b_object: bpy.types.Object, matrix_world: Float64, context: LightContext, warn: Warnings) -> SunLight:
    axes, _ = _axes_and_scale(matrix_world)
    return SunLight(
        direction=_vector(axes[:, 2]),
        irradiance=power(b_object.data, matrix_world),
        angle=b_object.data.angle,
        **_common_fields(b_object),
        name=b_object.name,
    )


def _area(b_object: bpy.types.Object, matrix_world: Float64, context: LightContext, warn: Warnings) -> AreaLight | None:
    axes, scale = _axes_and_scale(matrix_world)
    half_u, half_v = (0.5 * side for side in _area_sides(b_object.data, scale))
    if half_u * half_v < MIN_AREA_SIDES:
        warn.add(f"light {b_object.name!r} has no area and gives no light (EEVEE drops it, too)")
        return None
    half_u, half_v = max(half_u, MIN_HALF_SIDE), max(half_v, MIN_HALF_SIDE)
    area = 4.0 * half_u * half_v * _shape_factor(b_object.data)
    return AreaLight(
        name=b_object.name,
        position=_vector(matrix_world[:3, 3]),
        direction=_vector(-axes[:, 2]),
        axis_u=_vector(axes[:, 0] * half_u),
        axis_v=_vector(axes[:, 1] * half_v),
        radiance=_scaled(power(b_object.data, matrix_world), 1.0 / (math.pi * area)),
        shape="ELLIPSE" if _is_round(b_object.data) else "RECTANGLE",
        range=light_range(b_object.data, context),
        **_common_fields(b_object),
    )


Translator = Callable[[bpy.types.Object, Float64, LightContext, Warnings], Light | None]

TRANSLATORS: dict[str, Translator] = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}
"""By Blender's `Light.type`."""


def _common_fields(b_object: bpy.types.Object) -> dict[str, Any]:
    """EEVEE multiplies each lobe by the light's factor, and by the object's ray visibility (0 or 1)."""
    b_light = b_object.data
    return {
        "cast_shadow": b_light.use_shadow,
        "diffuse": b_light.diffuse_factor * b_object.visible_diffuse,
        "specular": b_light.specular_factor * b_object.visible_glossy,
        "transmission": b_light.transmission_factor * b_object.visible_transmission,
        "volume": b_light.volume_factor * b_object.visible_volume_scatter,
    }


# ------------------------------------------------------------------------------------------------ units


def power(b_light: bpy.types.Light, matrix_world: Float64) -> RGB:
    """RGB watts (W/m^2 for a sun), exposure, temperature and Normalize applied (BKE_light_power, _color, _area)."""
    watts = b_light.energy * 2.0**b_light.exposure
    if not b_light.normalize:
        watts *= _emitting_area(b_light, matrix_world)
    return _scaled(_color(b_light), watts)


def _color(b_light: bpy.types.Light) -> RGB:
    red, green, blue = b_light.color
    if not b_light.use_temperature:
        return red, green, blue
    tint = b_light.temperature_color
    return red * tint[0], green * tint[1], blue * tint[2]


def _emitting_area(b_light: bpy.types.Light, matrix_world: Float64) -> float:
    """m^2 for point, spot (scale ignored) and area lights; of the unit disc that a sun's angle cuts out, for suns."""
    if b_light.type == "AREA":
        width, height = _area_sides(b_light, _axes_and_scale(matrix_world)[1])
        return width * height * _shape_factor(b_light)
    if b_light.type == "SUN":
        half = 0.5 * b_light.angle
        return math.pi * math.sin(half) ** 2 if half > 0.0 else 1.0
    radius = b_light.shadow_soft_size
    return 4.0 * math.pi * radius**2 if radius > 0.0 else 4.0


def light_range(b_light: bpy.types.Light, context: LightContext) -> float:
    """Metres at which EEVEE ends the light (Light::attenuation_radius_get); inf with physical falloff."""
    if context.falloff == "PHYSICAL":
        return math.inf
    if b_light.use_custom_distance:
        return b_light.cutoff_distance
    strongest = max(_color(b_light)) * abs(b_light.energy * 2.0**b_light.exposure) / 100.0
    strongest *= max(b_light.diffuse_factor, b_light.specular_factor)
    return math.sqrt(max(strongest, 0.0) / max(context.threshold, MIN_LIGHT_THRESHOLD))


# ------------------------------------------------------------------------------------------------ shapes


def _area_sides(b_light: bpy.types.Light, scale: Float64) -> tuple[float, float]:
    size_y = b_light.size_y if b_light.shape in ("RECTANGLE", "ELLIPSE") else b_light.size
    return float(b_light.size * scale[0]), float(size_y * scale[1])


def _is_round(b_light: bpy.types.Light) -> bool:
    return b_light.shape in ("DISK", "ELLIPSE")


def _shape_factor(b_light: bpy.types.Light) -> float:
    return math.pi / 4.0 if _is_round(b_light) else 1.0


def _is_placed(b_light: bpy.types.Light, matrix_world: Float64) -> bool:
    directed = b_light.type in ("SUN", "AREA")
    return bool(np.isfinite(matrix_world).all() and (matrix_world[:3, 2].any() or not directed))


def _axes_and_scale(matrix_world: Float64) -> tuple[Float64, Float64]:
    """((3, 3) unit columns, (3,) their lengths); a column of length 0 stays 0."""
    columns = matrix_world[:3, :3]
    scale = np.linalg.norm(columns, axis=0)
    return columns / np.where(scale > 0, scale, 1.0), scale


def _world_to_light(matrix_world: Float64) -> Float64:
    """(3, 3): offset from the light -> light space with scale, so that |(x, y) / z| is the tangent within the cone."""
    axes, scale = _axes_and_scale(matrix_world)
    return axes.T / np.maximum(scale, MIN_SPOT_SCALE)[:, None]


def _vector(values: Float64) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])


def _scaled(color: RGB, factor: float) -> RGB:
    return color[0] * factor, color[1] * factor, color[2] * factor


# ------------------------------------------------------------------------------------------------ what is ignored


def _warn_of_ignored(b_object: bpy.types.Object, warn: Warnings) -> None:
    b_light = b_object.data
    if uses_nodes(b_light) and _has_own_nodes(b_light.node_tree):
        warn.add(f"light {b_object.name!r}: its nodes are ignored, as EEVEE ignores them; colour and power are used")


def _has_own_nodes(b_tree: bpy.types.NodeTree) -> bool:
    return any(b_node.bl_idname not in ("ShaderNodeEmission", "ShaderNodeOutputLight") for b_node in b_tree.nodes)
