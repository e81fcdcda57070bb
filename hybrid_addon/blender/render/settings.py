"""The settings of a scene, as the tracer takes them and as the report tells them."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from typing import Any

import bpy

from ...scene import Settings
from ..pipeline import scene_setup


def tracer_settings(scene: bpy.types.Scene) -> Settings:
    """The tracer's settings of a scene."""
    return Settings(
        samples=scene.hybrid.samples,
        max_depth=scene.hybrid.max_depth,
        cutoff=scene.hybrid.cutoff,
        adaptive=scene.hybrid.adaptive,
        shadow_samples=scene.hybrid.shadow_samples,
        rough_samples=scene.hybrid.rough_samples,
        occlusion_samples=scene.hybrid.occlusion_samples,
        occlusion_distance=scene.hybrid.occlusion_distance or scene.eevee.fast_gi_distance or math.inf,
        raster_shadows=scene_setup.traces_shadows(scene),
        caustics="NONE" if scene.hybrid.traced_shadows == "OFF" else scene.hybrid.caustics,
        photons=scene.hybrid.photons,
        passes=frozenset(name.lower() for name in scene.hybrid.passes) - {"shadow", "residual"},
        filter_radius=scene.render.filter_size,
        camera_sees="ALL" if scene.hybrid.mode == "FULL" else "RAY_TRACED",
        transparent=scene.render.film_transparent,
        threads=scene.hybrid.threads,
        processes=True,
    )


def preview_settings(scene: bpy.types.Scene) -> Settings:
    """The same for a viewport, with a processor left for the interface."""
    settings = tracer_settings(scene)
    threads = settings.threads or max(1, (os.cpu_count() or 2) - 1)
    return replace(  # no processes: starting them would take longer than such a small picture
        settings,
        camera_sees="RAY_TRACED",
        transparent=False,
        raster_shadows=False,
        passes=frozenset(),
        threads=threads,
        processes=False,
    )


def public_settings(scene: bpy.types.Scene) -> dict[str, Any]:
    """What the report says of the settings."""
    names = (
        "mode",
        "samples",
        "max_depth",
        "cutoff",
        "adaptive",
        "time_budget",
        "shadow_samples",
        "rough_samples",
        "occlusion_samples",
        "occlusion_distance",
        "traced_shadows",
        "caustics",
        "photons",
        "raster_backed",
        "light_falloff",
        "threads",
    )
    return {
        **{name: getattr(scene.hybrid, name) for name in names},
        "passes": sorted(scene.hybrid.passes),
        "eevee_samples": scene.eevee.taa_render_samples,
        "filter_size": scene.render.filter_size,
        "film_transparent": scene.render.film_transparent,
    }
