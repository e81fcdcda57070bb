# SPDX-License-Identifier: GPL-3.0-or-later
"""HYBRID_TRACER: the render engine of the trace scene.

Blender calls it after EEVEE has finished the user's scene, at the same frame, size and border. It reads EEVEE's mask
layer, translates the scene, traces the masked pixels and hands the traced half to the compositor.
"""

from __future__ import annotations

import math
import platform
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import bpy
import numpy as np

from ...clock import Clock
from ...memory import REFUSED
from ...report.ended import ended_warnings
from ...report.frame import frame_report
from ...scene import Film, Raster
from .. import lines as lines_drawn
from .. import session
from ..errors import HybridError, TooLarge, require_tracer
from ..flags import unsaved_overrides
from ..pipeline import compositor_setup, eevee_shadows, evaluated, others_handlers, scene_setup, trace_scenes
from ..session import Frame, Half
from ..sync.camera import Eye
from ..view_layers import in_work, part, source_layers, views
from . import abort, eevee_half, growing, motion_blur, passes, retrace
from .settings import denoising_warnings, find_denoiser, public_settings, tracer_settings, with_background

Progress = Callable[[str, float], bool]
Window = tuple[int, int, int, int]

RETRACED = {"what": "EEVEE's half of the picture", "why": "retraced: it is the last render's", "count": 1}

GREASE_PENCIL = "Grease Pencil lies over EEVEE's picture, but is not in its depth"

USE_EEVEE = "has the add-on's internal engine: set Render Engine to EEVEE and tick Hybrid"


class HybridTracer(bpy.types.RenderEngine):
    """Ray traces the ray traced objects of the scene that this one has as its background set."""

    bl_idname = scene_setup.ENGINE
    bl_label = "Hybrid (internal)"  # it stands in the list of engines: nobody should choose it
    bl_use_preview = False
    bl_use_shading_nodes_custom = False
    _said = ""
    _grows: growing.Growing | None = None

    def update_render_passes(self, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
        """Declare the passes, or compositor trees lose their sockets."""
        self.register_pass(scene, view_layer, "Combined", 4, "RGBA", "COLOR")
        for name, channels in passes.names(trace_scenes.owner(scene)).items():
            self.register_pass(scene, view_layer, name, len(channels), channels, passes.PASS_TYPES[channels])

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Trace one frame. An error is one line in the interface and in the console, and leaves no picture."""
        trace_scenes.shown()
        if evaluated.EMPTY_MARK in depsgraph.scene:
            evaluated.seen(depsgraph)
            self.end_result(self.begin_result(0, 0, self.resolution_x, self.resolution_y))
            return
        others_handlers.show()
        scene = trace_scenes.owner(depsgraph.scene)
        if scene is None:
            self._fail("", HybridError(f"scene '{depsgraph.scene.name}' {USE_EEVEE}"))
            return
        try:
            require_tracer()
        except HybridError as error:
            self._fail(scene.name, error)
            return
        for name, channels in passes.names(scene).items():
            self.add_pass(name, len(channels), channels)
        layer = trace_scenes.layer_of(depsgraph.scene, scene)
        for view in views(scene):
            with in_work(scene, layer, view):
                if not self._render(scene, depsgraph, view):
                    break

    def _render(self, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, view: str) -> bool:
        """Trace one view; "" is the only one. Whether there is a picture."""
        from ...tracer import Cancelled

        if view:
            self.active_view_set(view)
        resolution = (self.resolution_x, self.resolution_y)
        target = self.begin_result(0, 0, *resolution, view=view)
        delivered = False
        try:
            window = _window(scene, resolution, (target.resolution_x, target.resolution_y))
            self._grows = growing.begin(scene, window)
            eye = self._eye if view else None
            frame, film = trace_frame(
                scene, depsgraph, resolution, window, self._progress, self._evaluate, self._grows, eye
            )
            passes.deliver(target, frame, film)
            session.of(scene.name).deliver(frame, part(scene))
            delivered = True
        except Cancelled:
            growing.stopped(scene)
        except MemoryError as error:
            self._fail(scene.name, TooLarge(str(error) or f"{REFUSED}: lower the resolution or the samples"))
        except ValueError as error:  # our checks, the translator's and the tracer's: one line each
            self._fail(scene.name, error if isinstance(error, HybridError) else HybridError(str(error)))
        except Exception as error:  # a bug of ours: Blender prints it
            session.of(scene.name).fail(RuntimeError(f"the ray tracer failed: {type(error).__name__}: {error}"))
            abort.plain_render()
            raise
        finally:
            self.end_result(target, cancel=not delivered)
        return delivered

    def _eye(self, b_camera: bpy.types.Object) -> tuple[Any, float]:
        return self.camera_model_matrix(b_camera), self.camera_shift_x(b_camera)

    def _progress(self, phase: str, fraction: float) -> bool:
        left = "" if self._grows is None else self._grows.told(phase, fraction)
        text = phase if fraction <= 0 else f"{phase} {fraction * 100:.0f} %{left}"
        if text != self._said:  # in the background each call is a line of output
            self._said = text
            self.update_stats("Hybrid", text)
            self.update_progress(fraction)
        return not self.test_break()

    def _evaluate(self, moment: float) -> None:
        """Have the depsgraph of this render show a frame, or what is between two."""
        frame = math.floor(moment)
        self.frame_set(frame, subframe=moment - frame)
        trace_scenes.shown()

    def _fail(self, scene: str, error: HybridError) -> None:
        session.of(scene).fail(error)
        self.report({"ERROR"}, f"Hybrid: {error}")
        self.error_set(f"Hybrid: {error}")
        abort.plain_render()


def trace_frame(
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    resolution: tuple[int, int],
    window: Window,
    progress: Progress,
    evaluate: Callable[[float], None],
    grows: growing.Growing | None = None,
    eye: Eye | None = None,
) -> tuple[Frame, Film]:
    """Read the mask, translate, trace, premultiply: everything between EEVEE and the compositor.

    evaluate : has `depsgraph` show another frame, for motion blur.   grows : where to show the picture meanwhile.
    eye : where the view in work has the camera; None: there is one view only.
    """
    from ...compositor import black_out, lay_over, light_up, premultiply, see_through, shade
    from ...tracer import trace
    from ...tracer.materials.textures import sample_texture
    from ..sync import translate

    own = session.of(scene.name)
    timing = {"raster": own.since_start()}
    mode = scene.hybrid.mode

    clock = Clock()
    again = held = retrace.held(scene)
    half = again.half if again is not None else Half()
    if again is None and mode != "FULL":
        reading = "Reading EEVEE's picture"
        half = eevee_half.read(scene, window, partial(_going_on, progress, reading))
        held = retrace.hold(scene, window, half)
    drawn, mask, depth, albedo, lines = half
    timing["mask read"] = clock.read()
    if grows is not None:
        grows.begins_with(drawn, mask)

    clock, left = Clock(), session.caches_of(scene.name)
    translated = partial(
        translate, depsgraph, scene, resolution, window, light_falloff=scene.hybrid.light_falloff, kept=left.meshes,
        sample=sample_texture, eye=eye,
    )  # fmt: skip
    _going_on(progress, "Translating the scene")
    translation = translated()
    timing["translate"] = clock.read()
    if held is not None:
        retrace.check_drawn(held, translation.scene)
    traced_scene, unfit = translation.scene, "" if depth is None else eevee_half.unfit_to_back(scene)
    if drawn is not None and depth is not None and not unfit:
        traced_scene = replace(
            traced_scene, raster=Raster(drawn, eevee_half.without_sky(depth, traced_scene.camera), albedo)
        )

    settings = tracer_settings(scene, None if held is None else held.shadows)
    settings, seen_through = with_background(settings, scene, traced_scene, drawn is not None)
    find_denoiser()
    _going_on(progress, "Building")
    pixels, parts = (window[2] - window[0]) * (window[3] - window[1]), len(source_layers(scene)) * len(views(scene))
    deadline = own.deadline(scene.hybrid.time_budget, pixels, parts)
    tracing, times = partial(progress, "Tracing"), motion_blur.moments(scene, settings.samples)
    if len(times) == 1:
        film = trace(traced_scene, settings, mask, tracing, deadline, left.trees, None if grows is None else grows.show)
    else:
        work = partial(trace, mask=mask, cache=left.trees)
        try:
            film = motion_blur.trace_moments(times, evaluate, translated, work, settings, mask, tracing, deadline)
        finally:
            evaluate(scene.frame_current + scene.frame_subframe)
    own.sampled(film.time["develop"]["wall"])
    mask = film.coverage if mask is None else mask
    traced, rest, cover = premultiply(film.radiance, mask), drawn, mask
    if drawn is not None and "background" in film.passes:
        traced, rest, cover = see_through(traced, drawn, mask, film)
    if rest is not None and not eevee_half.may_scatter(scene):
        traced = black_out(traced, rest, mask)
    if rest is not None and film.shadow is not None:
        traced = shade(traced, rest, film.shadow)
    if albedo is not None and film.caustic is not None:
        traced = light_up(traced, film.caustic, albedo)
    if drawn is not None and lines is not None:
        drawn, traced = lay_over(drawn, lines), lay_over(traced, lines, of_both=False)
    notes = [RETRACED] if again else []
    if not unfit and mode == "HYBRID" and scene.hybrid.raster_backed and lines_drawn.draws_grease_pencil(scene):
        unfit = GREASE_PENCIL
    notes += [{"what": "raster-backed hits", "why": unfit, "count": 1}] if unfit else []
    report = frame_report(
        versions=versions(),
        settings=public_settings(scene),
        frame=scene.frame_current,
        resolution=resolution,
        mask=cover,
        film=film,
        counts=translation.counts,
        time=timing,
        warnings=[
            *(*scene_warnings(scene), *motion_blur.warnings(scene, settings.samples), *seen_through),
            *translation.warnings,
            *film.problems,
            *budget_warnings(scene, timing, film),
            *denoising_warnings(film),
            *ended_warnings(
                film.ended, settings, traced_scene.names, float(np.mean(cover != 0)) if cover.size else 0.0
            ),
        ],
        skipped=[*notes, *left.skipped()],
    )
    planes = passes.data_passes(scene, film, cover)
    return Frame(window, drawn, cover, traced, report, planes, growing.frame_of(scene)), film


def budget_warnings(scene: bpy.types.Scene, timing: dict[str, dict[str, float]], film: Film) -> list[str]:
    """What a time budget cost beyond samples, and by what it was not held. timing: the phases before the tracer's."""
    budget, eevee = scene.hybrid.time_budget, timing["raster"]["wall"]
    if budget <= 0:
        return []
    if budget < eevee and scene.hybrid.mode != "FULL":
        return [f"EEVEE alone took {eevee:.1f} s of the Time Limit of {budget:g} s: lower its samples"]
    others = {name: clock["wall"] for name, clock in timing.items() if name != "raster"}
    ready, spent = sum(others.values()) + film.time["build"]["wall"], session.of(scene.name).since_start()["wall"]
    if spent > budget:
        return [
            f"the frame took {spent:.2f} s, over its Time Limit of {budget:g} s: before the tracer {eevee:.2f} s, "
            f"exporting and preparing the scene {ready:.2f} s, tracing {film.time['trace']['wall']:.2f} s"
        ]
    if any(entry["what"] == "resolution" for entry in film.skipped):
        return [f"the Time Limit of {budget:g} s cost resolution: raise it, or lower Max Bounces"]
    return []


def scene_warnings(scene: bpy.types.Scene) -> list[str]:
    """What the pipeline itself cannot do in this scene."""
    warnings, settings = [], scene.hybrid
    source = scene_setup.source_layer(scene)
    if compositor_setup.feeds_nothing(scene, source):
        warnings.append(f"the compositor does not use view layer '{source.name}': the ray traced half does not show")
    if settings.traced_shadows != "OFF" and settings.caustics == "PHOTONS" and settings.mode == "FULL":
        warnings.append("Photons light what EEVEE draws, and it draws nothing: use Simple caustics")
    warnings += [
        f"{b_id.bl_rna.name.lower()} '{b_id.name}' is a library override; Blender will not save its Hybrid settings: "
        f"tick and untick Ray Traced once in {b_id.override_library.reference.library.filepath}, and save that file"
        for b_id in unsaved_overrides(scene)
    ]
    return [
        *warnings,
        *trace_scenes.warnings(scene),
        *scene_setup.missed(scene),
        *lines_drawn.warnings(scene),
        *eevee_shadows.warnings(scene),
    ]


def versions() -> dict[str, str]:
    """Versions of what took part."""
    from ...tracer.geometry.embree import embree_version
    from ...tracer.kernels import loading

    own = {"embree": embree_version(), "kernels": loading.line()}
    return {"blender": bpy.app.version_string, **own, "platform": platform.platform()}


# ------------------------------------------------------------------------------------------------ small parts


def _going_on(progress: Progress, phase: str) -> None:
    """Say what is done now; raises Cancelled if it is no longer wanted."""
    from ...tracer import Cancelled

    if not progress(phase, 0.0):
        raise Cancelled


def border(scene: bpy.types.Scene, resolution: tuple[int, int]) -> Window:
    """The render border in pixels. Blender multiplies in single precision and truncates (render/intern/pipeline.cc)."""
    b_render = scene.render
    width, height = map(np.float32, resolution)
    low, high = (b_render.border_min_x, b_render.border_min_y), (b_render.border_max_x, b_render.border_max_y)
    (x0, y0), (x1, y1) = ((int(np.float32(x) * width), int(np.float32(y) * height)) for x, y in (low, high))
    return (x0, y0, x1, y1)


def _window(scene: bpy.types.Scene, resolution: tuple[int, int], size: tuple[int, int]) -> Window:
    """The part of the frame that Blender asks for, which has the size that it says."""
    if size == resolution and not scene.render.use_border:
        return (0, 0, *resolution)
    x0, y0, _, _ = border(scene, resolution)
    return (x0, y0, x0 + size[0], y0 + size[1])


CLASSES = (HybridTracer,)
