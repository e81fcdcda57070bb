# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample scenes: rendered by Blender, as F12 does, or translated once for the tracer alone."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import bpy

import hybrid_addon as hybrid
from hybrid_addon.blender import session
from hybrid_addon.blender.pipeline import opengl, scene_setup
from hybrid_addon.blender.render.settings import tracer_settings
from hybrid_addon.blender.sync import translate
from hybrid_addon.presets import Quality
from hybrid_addon.scene import Float32, Scene, Settings
from hybrid_addon.tracer import SceneCache, trace

from .measure import ROOT

THESIS = ("simple", "intermediate", "complex")
Size = tuple[int, int]


def open_scene(name: str, size: Size) -> bpy.types.Scene:
    """A sample scene with Hybrid on, at this size."""
    hybrid.disable(bpy.context.scene)
    path = ROOT / "sample_scenes" / f"{name}.blend"
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    hybrid.enable(scene)
    return scene


def without_opengl() -> str:
    """Why EEVEE cannot draw here, or ""."""
    return opengl.missing() or ""


def render(scene: bpy.types.Scene, mode: str, eevee: int, samples: int, **others: float) -> dict[str, Any]:
    """One frame through Blender's render pipeline; the report of what was traced, {} in mode RASTER.

    others : of the quality's settings (`presets.Quality`) what is not as a new scene has it. Every pixel has all its
    samples unless they say otherwise.
    """
    for name in (field.name for field in fields(Quality)):
        scene.hybrid.property_unset(name)
    for name, value in {"mode": mode, "samples": samples, "adaptive": 0.0, **others}.items():
        setattr(scene.hybrid, name, value)
    scene.eevee.taa_render_samples = eevee
    scene_setup.sync(scene)
    bpy.ops.render.render(scene=scene.name)
    own = session.of(scene.name)
    if own.error:
        raise RuntimeError(own.error)
    frame = own.frame
    return frame.report if frame else {}


def warm_up(scene: bpy.types.Scene, mode: str = "HYBRID") -> None:
    """Let EEVEE compile its shaders and load its textures, on a small picture."""
    size = scene.render.resolution_x, scene.render.resolution_y
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    render(scene, mode, 1, 1)
    scene.render.resolution_x, scene.render.resolution_y = size


def translated(name: str, size: Size) -> tuple[Scene, Settings]:
    """A sample scene as plain data, and its settings; every pixel has all its samples."""
    scene = open_scene(name, size)
    layer = scene.view_layers[0]
    layer.update()
    translation = translate(layer.depsgraph, scene, size, (0, 0, *size), light_falloff=scene.hybrid.light_falloff)
    return translation.scene, replace(tracer_settings(scene), adaptive=0.0)


def traced(
    scene: Scene, settings: Settings, mask: Float32 | None = None, cache: SceneCache | None = None
) -> dict[str, Any]:
    """Trace, and keep of the film what it cost. cache: what this frame leaves for the next."""
    film = trace(scene, settings, mask, cache=cache)
    return {"time": film.time, "rays": film.rays}


def all_flagged(scene: Scene) -> Scene:
    """The same with every object ray traced."""
    return replace(scene, instances=tuple(replace(instance, ray_traced=True) for instance in scene.instances))
