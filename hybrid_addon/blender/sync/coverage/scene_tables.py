# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of scenes, view layers, worlds and cameras."""

from __future__ import annotations

from typing import Any

from ...flags import Flags, is_traced_by_itself
from .status import FIRST, FOLLOWED, LAST, Named, Table, followed, irrelevant, within

NOISE = "how well EEVEE samples its own half"
VOLUMES = "how finely EEVEE marches through its own half's fog"
SCREEN = "of EEVEE's Raytracing, which is named as a whole"
GONE = "EEVEE reads it no longer: it is of versions before 4.2"
PROBES = "how EEVEE stores what light probes see; the probes are named"
VIEWS = "of several views: each is traced, seen from where Blender has its camera"
INTERFACE = "of the interface and the viewport alone"
CYCLES = "of Cycles alone"
PASSES = "of passes beside the picture, which EEVEE draws"
AFTER = "done to the composite, after both halves are there"
OUTPUT = "where, when and how files are written"
BAKING = "of baking alone"
LINKS = "a list or pointer with a table or a test of its own"
GREASE_PENCIL = "of Grease Pencil, which is named"
FREESTYLE = "of Freestyle, whose lines lie over both halves"
SOUND = "of sound, playback or physics"
SIMPLIFY = "the trace scene takes it over before Blender evaluates the objects"


def _is_hybrid(b_eevee: Any) -> bool:
    """Whether EEVEE draws a half of the picture."""
    return getattr(getattr(b_eevee.id_data, "hybrid", None), "mode", "") == "HYBRID"


def _leaves_mirrors(b_eevee: Any) -> bool:
    """Whether EEVEE draws a surface in which its Raytracing, which knows EEVEE's half alone, shows reflections."""
    if not _is_hybrid(b_eevee):
        return False
    b_scene, flags = b_eevee.id_data.original, Flags(b_eevee.id_data)
    drawn = (b_object for b_object in b_scene.objects if not (b_object.hide_render or flags.is_ray_traced(b_object)))
    worn = {b_slot.material for b_object in drawn for b_slot in b_object.material_slots if b_slot.material}
    materials = (b_material for b_material in worn if not is_traced_by_itself(b_material))
    limit = b_eevee.ray_tracing_options.trace_max_roughness
    return any(_is_glossy(b_material.node_tree, limit) for b_material in materials)


def _is_glossy(b_tree: Any, limit: float, depth: int = 0) -> bool:
    """Whether a shader of these nodes, or of groups among them, may be smoother than this."""
    for b_node in b_tree.nodes if b_tree is not None and depth < DEEPEST else ():
        if b_node.type == "GROUP" and _is_glossy(b_node.node_tree, limit, depth + 1):
            return True
        b_roughness = b_node.inputs.get("Roughness") if b_node.type in GLOSSY else None
        if b_roughness is not None and (b_roughness.is_linked or b_roughness.default_value < limit):
            return True
    return False


GLOSSY = {"BSDF_PRINCIPLED", "BSDF_GLOSSY", "BSDF_GLASS", "BSDF_REFRACTION", "BSDF_ANISOTROPIC"}
"""Shaders that EEVEE's Raytracing reflects or refracts in."""

DEEPEST = 16
"""Groups in groups; Blender allows no circles, a broken file may have them."""


def _is_blurred(b_eevee: Any) -> bool:
    b_camera = b_eevee.id_data.camera
    return b_camera is not None and b_camera.type == "CAMERA" and b_camera.data.dof.use_dof


def _has_strips(b_render: Any) -> bool:
    b_editor = b_render.id_data.sequence_editor
    return b_editor is not None and len(b_editor.strips_all) > 0


def _has_thin_hair(b_render: Any) -> bool:
    return b_render.hair_type == "STRAND" and any(
        b_object.type == "CURVES" or any(b_system.settings.type == "HAIR" for b_system in b_object.particle_systems)
        for b_object in b_render.id_data.objects
    )


EEVEE: Table = {
    **followed(
        "light_threshold, use_shadows, direct_light_intensity, indirect_light_intensity, clamp_surface_direct,"
        "clamp_surface_indirect, fast_gi_distance, use_volumetric_shadows,"
        "volumetric_start, volumetric_end, use_volume_custom_range, volumetric_samples"
    ),
    "use_raytracing": Named(
        "leaves ray traced objects out: flag what should mirror or refract them, too",
        False, _leaves_mirrors, FIRST, "EEVEE's Raytracing",
    ),
    "bokeh_max_size": Named(
        "limits the blur of EEVEE's half alone, not that of ray traced objects: set it to 100 px",
        100.0, _is_blurred, LAST,
    ),
    **irrelevant(
        NOISE,
        "taa_samples, taa_render_samples, use_taa_reprojection, use_shadow_jitter_viewport, bokeh_threshold,"
        "bokeh_neighbor_max, bokeh_overblur, use_bokeh_jittered, shadow_pool_size, shadow_ray_count,"
        "shadow_step_count, shadow_resolution_scale, use_overscan, overscan_size",
    ),
    **irrelevant(
        VOLUMES,
        "volumetric_tile_size, volumetric_sample_distribution,"
        "volumetric_ray_depth, volumetric_light_clamp, volumetric_shadow_samples, clamp_volume_direct,"
        "clamp_volume_indirect",
    ),
    **irrelevant(
        SCREEN,
        "ray_tracing_method, use_fast_gi, fast_gi_thickness_near, fast_gi_thickness_far, fast_gi_quality,"
        "fast_gi_step_count, fast_gi_ray_count, fast_gi_method, fast_gi_bias, fast_gi_resolution",
    ),
    **irrelevant(GONE, "gi_glossy_clamp, use_gtao, gtao_quality, gtao_distance, motion_blur_max"),
    **irrelevant(
        PROBES, "gi_diffuse_bounces, gi_cubemap_resolution, gi_visibility_resolution, gi_irradiance_pool_size"
    ),
    **followed("motion_blur_steps"),
    **irrelevant("how EEVEE blurs its own half between its steps", "motion_blur_depth_scale"),
    **irrelevant(LINKS, "ray_tracing_options"),
}  # fmt: skip

RAYTRACE: Table = irrelevant(
    SCREEN,
    "resolution_scale, use_denoise, denoise_spatial, denoise_temporal, denoise_bilateral, use_backface_hit,"
    "backface_radiance_scale, screen_trace_thickness, trace_max_roughness, screen_trace_quality",
)

RENDER: Table = {
    **followed(
        "resolution_x, resolution_y, resolution_percentage, pixel_aspect_x, pixel_aspect_y, filter_size,"
        "film_transparent, use_border, border_min_x, border_min_y, border_max_x, border_max_y"
    ),
    **followed("use_motion_blur, motion_blur_shutter, motion_blur_position"),
    **irrelevant(LINKS, "motion_blur_shutter_curve"),
    **irrelevant(VIEWS, "use_multiview, views, stereo_views, views_format"),
    "use_sequencer": Named(
        "replaces the rendered picture: switch Post Processing > Sequencer off", False, _has_strips, FIRST
    ),
    **irrelevant("of panoramic cameras, which are named", "use_spherical_stereo"),
    **irrelevant(
        SIMPLIFY,
        "use_simplify, simplify_subdivision, simplify_child_particles, simplify_subdivision_render,"
        "simplify_child_particles_render, simplify_volumes, use_simplify_normals, frame_map_old, frame_map_new,"
        "fps, fps_base",
    ),
    **irrelevant(GREASE_PENCIL, "simplify_gpencil"),
    **irrelevant(
        GREASE_PENCIL,
        "simplify_gpencil_onplay, simplify_gpencil_antialiasing, simplify_gpencil_view_fill,"
        "simplify_gpencil_modifier, simplify_gpencil_shader_fx, simplify_gpencil_tint",
    ),
    **irrelevant(FREESTYLE, "use_freestyle, line_thickness_mode, line_thickness"),
    **irrelevant(
        AFTER,
        "dither_intensity, use_compositing, compositor_device, compositor_precision, compositor_denoise_device,"
        "compositor_denoise_preview_quality, compositor_denoise_final_quality, use_crop_to_border",
    ),
    **irrelevant(
        "of the accuracy of EEVEE's own half",
        "use_high_quality_normals, anisotropic_filter, use_texture_cache, use_auto_generate_texture_cache",
    ),
    "hair_subdiv": FOLLOWED,
    "hair_type": Named(
        "is Strand: EEVEE draws hair one pixel wide, and rays meet its radius: set it to Strip",
        "STRIP",
        _has_thin_hair,
        LAST,
        "Curves > Shape",
    ),
    **irrelevant(BAKING, "bake, bake_bias, bake_margin, bake_margin_type, bake_samples, bake_type, bake_user_scale"),
    **irrelevant(
        BAKING,
        "use_bake_clear, use_bake_lores_mesh, use_bake_multires, use_bake_selected_to_active, use_bake_user_scale",
    ),
    **irrelevant(
        OUTPUT,
        "image_settings, ppm_factor, ppm_base, ffmpeg, use_placeholder, use_overwrite, use_file_extension, filepath,"
        "file_extension, is_movie_format, use_render_cache, save_output, use_single_layer, metadata_input, engine,"
        "has_multiple_engines, threads, threads_mode, use_persistent_data, use_lock_interface",
    ),
    **irrelevant(
        "text that Blender writes over the finished picture",
        "use_stamp, use_stamp_time, use_stamp_date, use_stamp_frame, use_stamp_frame_range, use_stamp_camera,"
        "use_stamp_lens, use_stamp_scene, use_stamp_note, use_stamp_marker, use_stamp_filename,"
        "use_stamp_sequencer_strip, use_stamp_render_time, use_stamp_labels, use_stamp_memory, use_stamp_hostname,"
        "stamp_note_text, stamp_font_size, stamp_foreground, stamp_background",
    ),
    **irrelevant(INTERFACE, "preview_pixel_size, sequencer_gl_preview, use_sequencer_override_scene_strip"),
    **irrelevant(INTERFACE, "time_jump_unit, time_jump_delta"),
}

LAYER: Table = {
    **followed("use, material_override, world_override, use_sky, use_strand, use_motion_blur"),
    "use_solid": Named("is off: EEVEE draws no surfaces and tells of none, so none is traced", True, rank=FIRST),
    **within("object types", "use_volumes, use_grease_pencil"),  # other fog stays without use_volumes
    **irrelevant(CYCLES, "samples, pass_alpha_threshold, use_ao, cycles, lightgroups, active_lightgroup"),
    **irrelevant(CYCLES, "active_lightgroup_index, use_pass_shadow"),
    **irrelevant(FREESTYLE, "use_freestyle, freestyle_settings"),
    **irrelevant(PASSES, "aovs, active_aov, active_aov_index, use_pass_*, pass_cryptomatte_depth"),
    **irrelevant(LINKS, "eevee, layer_collection, objects, depsgraph"),
    **irrelevant(INTERFACE, "name, active_layer_collection, has_export_collections"),
}

LAYER_EEVEE: Table = irrelevant(PASSES, "use_pass_*, ambient_occlusion_distance")

LAYER_COLLECTION: Table = {
    **followed("exclude"),
    "holdout": Named("is not traced: its objects are solid in reflections and refractions", False),
    **irrelevant("EEVEE draws what is in it all the same", "indirect_only"),
    **irrelevant(INTERFACE, "name, hide_viewport, is_visible"),
    **irrelevant(LINKS, "collection, children"),
}

WORLD: Table = {
    **followed("color, node_tree, use_nodes, sun_threshold, sun_angle, use_sun_shadow"),
    **irrelevant("EEVEE draws the same fog with it", "use_eevee_finite_volume"),
    **irrelevant(
        "how well EEVEE stores the world, and the shadows of its sun",
        "probe_resolution, sun_shadow_maximum_resolution, sun_shadow_filter_radius, use_sun_shadow_jitter,"
        "sun_shadow_jitter_overblur",
    ),
    **irrelevant(PASSES, "mist_settings, lightgroup"),
    **irrelevant(GONE, "light_settings"),
    **irrelevant(CYCLES, "cycles, cycles_visibility"),
    **irrelevant("followed as its values change from frame to frame", "animation_data"),
}

CAMERA: Table = {
    **followed(
        "sensor_fit, clip_start, clip_end, lens, sensor_width, sensor_height, ortho_scale, shift_x, shift_y,"
        "angle_x, angle_y, angle, type"
    ),
    **irrelevant(
        "of panoramic and custom cameras, which EEVEE draws as perspective ones: named; panoramas are "
        "followed with Trace: Everything",
        "panorama_type, fisheye_*, latitude_*, longitude_*, central_cylindrical_*, custom_*",
    ),
    **irrelevant(
        INTERFACE,
        "passepartout_alpha, display_size, show_*, lens_unit, background_images, composition_guide_color",
    ),
    **irrelevant(VIEWS, "stereo"),
    **irrelevant(CYCLES, "cycles, cycles_custom"),
    **irrelevant(LINKS, "dof"),
    **irrelevant("followed as its values change from frame to frame", "animation_data"),
}

FOCUS: Table = {
    **followed("use_dof, focus_object, focus_distance, aperture_fstop, aperture_blades, aperture_rotation"),
    "aperture_ratio": FOLLOWED,
    "focus_subtarget": FOLLOWED,
}

SCENE_TABLES: dict[str, Table] = {
    "SceneEEVEE": EEVEE,
    "RaytraceEEVEE": RAYTRACE,
    "RenderSettings": RENDER,
    "ViewLayer": LAYER,
    "ViewLayerEEVEE": LAYER_EEVEE,
    "LayerCollection": LAYER_COLLECTION,
    "World": WORLD,
    "Camera": CAMERA,
    "CameraDOFSettings": FOCUS,
}
