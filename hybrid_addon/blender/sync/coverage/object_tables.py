# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of objects, materials and lights."""

from __future__ import annotations

import math
from typing import Any

from .scene_tables import CYCLES, GONE, GREASE_PENCIL, INTERFACE, PASSES, PROBES
from .status import LAST, Named, Table, followed, irrelevant

PLACE = "Blender works it into the object's matrix or geometry, which is followed"
SHADOWS = "how well EEVEE draws shadows"
ANIMATED = "followed as its values change from frame to frame"

OBJECT_TYPES: dict[str, str] = {
    "GREASEPENCIL": "Grease Pencil is not ray traced",
    "META": "metaballs are not ray traced: convert them to meshes",
}
"""Objects that EEVEE draws and rays do not meet, and what is said of each."""

PROBE_TYPES: dict[str, str] = {
    "VOLUME": "what it has baked lights EEVEE's half alone: ray traced objects have the world's light",
    "SPHERE": "rough reflections of ray traced objects show the world instead of it",
}
"""Light probes that change EEVEE's picture of what rays do not find by themselves. (A plane's mirror they do.)"""


def _has_faces(b_object: Any) -> bool:
    return b_object.type in ("MESH", "CURVE", "SURFACE", "FONT")


def _blends(b_material: Any) -> bool:
    return b_material.surface_render_method == "BLENDED"


OBJECT: Table = {
    **followed(
        "type, data, material_slots, matrix_world, hide_render, visible_camera, visible_shadow, visible_diffuse,"
        "visible_raycast, visible_glossy, visible_transmission, light_linking, instance_collection"
    ),
    "is_holdout": Named("is not traced; it is solid in reflections", False, _has_faces),
    **irrelevant(
        PLACE,
        "parent, parent_*, use_parent_final_indices, track_axis, up_axis, location, rotation_*, scale, dimensions,"
        "delta_*, matrix_local, matrix_basis, matrix_parent_inverse, modifiers, constraints, vertex_groups,"
        "instance_type, use_instance_*, instance_faces_scale, show_instancer_for_render, bound_box, pose,"
        "is_instancer, active_shape_key, show_only_shape_key, active_shape_key_index, add_rest_position_attribute",
    ),
    **irrelevant(
        "simulated by Blender, which works it into the geometry",
        "field, collision, soft_body, rigid_body, rigid_body_constraint, use_simulation_cache, particle_systems",
    ),
    **followed("visible_volume_scatter, color, pass_index"),
    **irrelevant(PROBES, "hide_probe_*"),
    **irrelevant(
        CYCLES, "is_shadow_catcher, shadow_terminator_geometry_offset, shadow_terminator_shading_offset, cycles"
    ),
    **irrelevant("it moves EEVEE's shadows less than can be seen", "shadow_terminator_normal_offset"),
    **irrelevant(PASSES, "lightgroup"),
    **irrelevant(GREASE_PENCIL, "shader_effects, use_grease_pencil_lights, lineart"),
    **irrelevant("of empties that show images, in the viewport alone", "empty_*, image_user, show_empty_*"),
    **irrelevant("of empties that show images, in the viewport alone", "use_empty_image_alpha"),
    **irrelevant(
        INTERFACE,
        "mode, active_material, active_material_index, lock_*, hide_viewport, hide_select, hide_surface_pick,"
        "display, display_type, display_bounds_type, show_bounds, show_name, show_axis, show_texture_space, show_wire,"
        "show_all_edges, show_transparent, show_in_front, show_instancer_for_viewport, use_shape_key_edit_mode,"
        "use_dynamic_topology_sculpting, is_from_instancer, is_from_set, use_mesh_mirror_*, use_camera_lock_parent,"
        "animation_visualization, motion_path, selection_sets, active_selection_set",
    ),
    **irrelevant(ANIMATED, "animation_data"),
}

MATERIAL: Table = {
    **followed(
        "node_tree, use_nodes, diffuse_color, roughness, metallic, specular_intensity,"
        "use_backface_culling, use_backface_culling_shadow, pass_index, displacement_method"
    ),
    "use_transparency_overlap": Named(
        "is off: ray traced, all of its layers show through one another", True, _blends, label="Transparency Overlap"
    ),
    **irrelevant("by which EEVEE knows what may be in sight", "max_vertex_displacement"),
    **irrelevant("EEVEE's guesses of a thickness, which rays find", "use_sss_translucency, use_thickness_from_shadow"),
    **irrelevant(
        "how EEVEE approximates refraction, which rays follow exactly",
        "surface_render_method, use_raytrace_refraction, thickness_mode, refraction_depth, use_screen_refraction",
    ),
    **irrelevant(
        "EEVEE's shadows are its own; traced ones are tinted by what they go through (docs, Shadows and caustics)",
        "use_transparent_shadow",
    ),
    **irrelevant(GONE, "blend_method, alpha_threshold, show_transparent_back"),
    **irrelevant(PROBES, "use_backface_culling_lightprobe_volume, lightprobe_volume_single_sided"),
    **irrelevant("how EEVEE finds the inside of fog; rays find it by their crossings", "volume_intersection_method"),
    **irrelevant(GREASE_PENCIL, "grease_pencil, is_grease_pencil, line_color, line_priority, lineart"),
    **irrelevant(
        INTERFACE,
        "preview_render_type, use_preview_world, texture_paint_*, paint_*, specular_color",
    ),
    **irrelevant(CYCLES, "cycles"),
    **irrelevant(ANIMATED, "animation_data"),
}

LIGHT: Table = {
    **followed(
        "type, color, use_temperature, temperature, temperature_color, exposure, normalize, use_shadow,"
        "diffuse_factor, specular_factor, transmission_factor, volume_factor, use_custom_distance, cutoff_distance"
    ),
    **irrelevant("EEVEE has no nodes of lights; they are named where there are any", "node_tree, use_nodes"),
    **irrelevant(CYCLES, "cycles"),
    **irrelevant(ANIMATED, "animation_data"),
}
SHADOW = irrelevant(
    SHADOWS,
    "shadow_buffer_clip_start, shadow_filter_radius, shadow_maximum_resolution, use_shadow_jitter,"
    "shadow_jitter_overblur, use_absolute_resolution",
)
POINT: Table = {**followed("energy, shadow_soft_size, use_soft_falloff"), **SHADOW}
SPOT: Table = {
    **POINT,
    **followed("spot_blend, spot_size"),
    **irrelevant("EEVEE draws a square spot round, as the tracer does", "use_square"),
    **irrelevant(INTERFACE, "show_cone"),
}
SUN: Table = {
    **followed("energy, angle"),
    **SHADOW,
    **irrelevant(GONE, "shadow_soft_size, shadow_cascade_*"),
}
AREA: Table = {
    **followed("energy, shape, size, size_y"),
    **SHADOW,
    **irrelevant("of other kinds of light", "shadow_soft_size"),
    "spread": Named("is not followed, as in EEVEE: it shines to all sides of its front", math.pi, rank=LAST),
}

OBJECT_TABLES: dict[str, Table] = {
    "Object": OBJECT,
    "Material": MATERIAL,
    "Light": LIGHT,
    "PointLight": POINT,
    "SpotLight": SPOT,
    "SunLight": SUN,
    "AreaLight": AREA,
}
