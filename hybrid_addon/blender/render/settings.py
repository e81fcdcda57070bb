# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of a scene, as the tracer takes them and as the report tells them."""

from __future__ import annotations

import math
import os
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import bpy

from ...scene import Film, Fog, Scene, Settings
from ...scene.film import NOTHING_RANDOM
from ...settings_table import RENDER
from ..pipeline import scene_setup

NAMED = 3
"""Bodies that a warning names."""


def tracer_settings(scene: bpy.types.Scene, raster_shadows: bool | None = None) -> Settings:
    """The tracer's settings of a scene: what both have by the same name, and what follows from several of them.

    raster_shadows : whether it traces shadows on what EEVEE draws, where that is known; None: the scene is asked.
    """
    own = {field.name for field in fields(Settings)} & {setting.name for setting in RENDER}
    values = {name: getattr(scene.hybrid, name) for name in own}
    values["occlusion_distance"] = scene.hybrid.occlusion_distance or scene.eevee.fast_gi_distance or math.inf
    values["caustics"] = "NONE" if scene.hybrid.traced_shadows == "OFF" else scene.hybrid.caustics
    return Settings(
        **values,
        raster_shadows=scene_setup.traces_shadows(scene) if raster_shadows is None else raster_shadows,
        passes=frozenset(name.lower() for name in scene.hybrid.passes) - {"shadow", "residual"},
        filter_radius=scene.render.filter_size,
        camera_sees="ALL" if scene.hybrid.mode == "FULL" else "RAY_TRACED",
        transparent=scene.render.film_transparent,
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
        denoise=False,
        threads=threads,
        processes=False,
    )


def public_settings(scene: bpy.types.Scene) -> dict[str, Any]:
    """What the report says of the settings."""
    return {
        **{setting.name: getattr(scene.hybrid, setting.name) for setting in RENDER},
        "passes": sorted(scene.hybrid.passes),
        "eevee_samples": scene.eevee.taa_render_samples,
        "filter_size": scene.render.filter_size,
        "film_transparent": scene.render.film_transparent,
    }


def with_background(
    settings: Settings, scene: bpy.types.Scene, traced: Scene, is_hybrid: bool
) -> tuple[Settings, list[str]]:
    """The settings that tell the tracer's background apart where one sees straight through what is ray traced
    (`compositor.see_through`); and what is to be warned of. is_hybrid: there is a half of EEVEE's."""
    from ...tracer.materials.surfaces import shows_background

    warnings = body_warnings(traced)
    if not (is_hybrid and shows_background(traced)):
        return settings, warnings
    if scene.render.film_transparent:
        return settings, [
            *warnings,
            "the film is transparent: see-through ray traced surfaces are as opaque as EEVEE draws them, and light "
            "that is added to them is lost where EEVEE draws nothing",
        ]
    if any(not medium.is_nothing for medium in traced.fog.media):
        warnings.append("fog lies about see-through ray traced surfaces: what is behind them is too bright or too dark")
    return replace(settings, passes=settings.passes | {"background", "passed"}), warnings


def find_denoiser() -> None:
    """Tell the tracer where Blender keeps Open Image Denoise: beside its module, or by system in lib (Linux),
    blender.shared (Windows) or Contents/Resources/lib (macOS)."""
    from ...tracer.film.denoiser import look_in

    homes = [Path(bpy.__file__).parent, *([Path(bpy.app.binary_path).parent] if bpy.app.binary_path else [])]
    look_in(home / inner for home in homes for inner in ("", "lib", "blender.shared", "../Resources/lib"))


def denoising_warnings(film: Film) -> list[str]:
    """Whether a picture that was to be denoised is not."""
    why = film.denoising.get("why_not", "")
    return [f"not denoised: {why}"] if why and why != NOTHING_RANDOM else []


def body_warnings(traced: Scene) -> list[str]:
    """What depends on whether meshes are closed: fog that is in none."""
    return _open_fog(traced.fog)


def _open_fog(fog: Fog) -> list[str]:
    """A warning of the bodies of fog that hold none: names of NAMED of them, and how many more."""
    from ...tracer.media.fog import sorted_out

    _, names = sorted_out(fog)
    if not names:
        return []
    return [f"fog of {_told(names)} is not traced: the mesh is open or flat, and only a closed one has an inside"]


def _told(names: list[str]) -> str:
    """NAMED of the names, and how many more."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(map(repr, names[:NAMED])) + more
