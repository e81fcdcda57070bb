# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python interface: enable, disable, mark, unmark, surface, advise, render, retrace, plan, explain."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import bpy
import numpy as np

from .. import programs
from ..presets import QUALITY
from ..report.frame import frame_report
from ..scene import Float32, SurfaceAnswer, SurfaceHits
from ..scene.programs import Answer, Passes
from ..settings_table import RENDER, RETRACE, SURFACE, Setting, checked, described
from . import session
from .errors import HybridError
from .flags import why_not
from .pipeline import opengl, scene_setup
from .render import engine, images
from .render import retrace as again
from .render.settings import public_settings
from .scan import advise, explain, plan
from .view_layers import part_of, source_layers, views

__all__ = [
    "HybridError", "HybridResult", "SurfaceAnswer", "SurfaceHits", "advise", "disable", "enable", "explain", "mark",
    "plan", "render", "retrace", "surface", "unmark",
]  # fmt: skip

enable = scene_setup.enable


def disable(scene: bpy.types.Scene) -> None:
    """Switch hybrid rendering off; the scene is then as it was before `enable`; nothing is kept for a next render."""
    scene_setup.disable(scene)
    session.of(scene.name).release()


@dataclass(frozen=True, eq=False)
class HybridResult:
    """One rendered frame, scene-linear, associated alpha, row 0 at the bottom.

    image, raster, traced : (height, width, 4) float32. mask : (height, width) float32, coverage of the traced objects.
    image = raster + traced, unless your own compositor nodes follow. Of several hybrid view layers the halves, mask and
    passes are those of the first. report : a plain dict (docs/manual/report.md).
    passes : of `scene.hybrid.passes`, by name in small letters, (height, width) or (height, width, 3); none where the
             tracer was not called.
    views  : with Stereoscopy the result of each view, by its name; this one is that of the first. Else empty.
    """

    image: Float32
    raster: Float32
    mask: Float32
    traced: Float32
    report: dict[str, Any]
    passes: dict[str, Float32] = field(default_factory=dict)
    views: dict[str, HybridResult] = field(default_factory=dict)


def mark(
    obj: bpy.types.Object | bpy.types.Material,
    *,
    reflectivity: float | None = None,
    opacity: float | None = None,
    ior: float | None = None,
    dispersion: float | None = None,
) -> None:
    """Flag an object as ray traced, or a material: then all faces that wear it are, whichever objects they are of.

    Reflectivity, opacity or IOR make its surface Custom; else its materials, or its nodes, decide.
    dispersion : 20 / Abbe number; it counts beside the nodes' IOR, too.

    Raises HybridError for an object that has no surface (a light, a camera), a material that cannot be ray traced by
    itself, and for a value out of range.
    """
    _check_mark(obj)
    given = {"reflectivity": reflectivity, "opacity": opacity, "ior": ior, "dispersion": dispersion}
    values = _given(SURFACE, given, "mark()")
    for name, value in values.items():
        setattr(obj.hybrid, name, value)
    obj.hybrid.ray_traced = True


def surface(
    obj: bpy.types.Object | bpy.types.Material,
    program: Answer | str | None,
    *,
    shadow: Passes | None = None,
    name: str = "",
) -> None:
    """Let a function answer for the surface of an object, or of all that wears a material, and ray trace it.

    program : a function of `SurfaceHits` that returns a `SurfaceAnswer`, or the name of one that is registered already
              (`hybrid.programs`); None: the material answers again.
    shadow  : of `SurfaceHits`, returns what share of the light of lamps passes, (3, n), 0..1; None: as much as passes
              the material.
    name    : by which the function is registered, and which the file saves; "": its own name.

    Raises HybridError for what `mark` refuses, a name that is not registered, and what is no function.
    """
    _check_mark(obj)
    if program is None:
        obj.hybrid.program = ""
        return
    try:
        if isinstance(program, str):
            name = programs.known(program, shadow)
        else:
            name = programs.register(name or getattr(program, "__name__", ""), program, shadow).name
    except ValueError as error:
        raise HybridError(str(error)) from None
    obj.hybrid.program = name
    obj.hybrid.ray_traced = True


def _check_mark(obj: bpy.types.ID) -> None:
    if not isinstance(obj, (bpy.types.Object, bpy.types.Material)):
        raise HybridError(f"{obj!r} is neither an object nor a material: pass bpy.data.objects['NAME']")
    if obj.library is not None:
        raise HybridError(f"'{obj.name}' is linked from {obj.library.filepath}: make a library override first")
    if isinstance(obj, bpy.types.Material):
        if why_not(obj):
            raise HybridError(f"material '{obj.name}': {why_not(obj)}")
        return
    if obj.type == "META":
        raise HybridError(f"'{obj.name}' is a metaball: convert it to a mesh (Object > Convert) to ray trace it")
    if obj.type not in GEOMETRY:
        raise HybridError(f"'{obj.name}' is a {obj.type.lower()}: only objects with a surface can be ray traced")


def unmark(obj: bpy.types.Object | bpy.types.Material) -> None:
    """Let EEVEE draw the object, or what wears the material, again. Its values stay for the next time."""
    obj.hybrid.ray_traced = False


GEOMETRY = {"MESH", "CURVE", "SURFACE", "FONT", "EMPTY"}  # an empty may show a collection


def render(
    scene: bpy.types.Scene | None = None,
    *,
    frame: int | None = None,
    mode: str | None = None,
    preset: str | None = None,
    resolution: tuple[int, int] | None = None,
    camera: bpy.types.Object | None = None,
    **settings: Any,
) -> HybridResult:
    """Render one frame through Blender's own pipeline, exactly as F12 does, and return it.

    What is given overrides the scene's setting for this render only; a scene that is not enabled is for its duration.
    mode: "hybrid", "raster" or "full". preset: "draft", "final" or "reference"; settings beside it win. resolution:
    (width, height) in pixels. camera: instead of the scene's and its markers'. settings: of `scene.hybrid`, by name, as
    listed below; True and False for traced_shadows are "on" and "off". Raises HybridError (one line) for what cannot be
    rendered and for a value out of range, TypeError for a setting that there is not, RuntimeError if the render itself
    failed or was cancelled.
    """
    scene = scene or bpy.context.scene
    overrides = {**quality(preset), **_given(RENDER, {"mode": mode, **settings}, "render()")}
    with _seen_by(scene, camera), _overridden(scene, overrides, frame, resolution):
        check(scene)
        return _rendered(scene)


def retrace(
    scene: bpy.types.Scene | None = None,
    *,
    preset: str | None = None,
    resolution: tuple[int, int] | None = None,
    camera: bpy.types.Object | None = None,
    **settings: Any,
) -> HybridResult:
    """Trace again over what EEVEE drew in the scene's last render: the same, bit for bit, as `render` at its frame.

    settings: of `render`, all that are the tracer's (not `mode`, `frame`), for this picture only. Reflectivity, opacity
    and IOR of objects and materials may have changed, too. What was given to that render in resolution, camera and
    shadows must be given again. Raises HybridError, one line, if there is no such render or if EEVEE would draw
    anything else now; TypeError for a setting that there is not.
    """
    scene = scene or bpy.context.scene
    overrides = {**quality(preset), **_given(RETRACE, settings, "retrace()")}
    with _seen_by(scene, camera), _overridden(scene, overrides, again.frame_of(scene), resolution):
        scene.view_layers[0].update()  # so that what a script has just changed is told of
        with again.retracing(scene):
            return _rendered(scene)


def _given(settings: Collection[Setting], values: Mapping[str, Any], caller: str) -> dict[str, Any]:
    """What is not None of the values, as properties take them; HybridError for one that cannot be."""
    try:
        return checked(settings, values, caller)
    except ValueError as error:
        raise HybridError(str(error)) from None


render.__doc__ = f"{render.__doc__}\n{described(RENDER)}\n"


def _rendered(scene: bpy.types.Scene) -> HybridResult:
    """Render the scene as it is set up."""
    try:
        bpy.ops.render.render(scene=scene.name)
    except RuntimeError as error:
        raise _reason(scene, str(error)) from error
    failed = session.of(scene.name).error
    if failed is not None:
        raise failed
    return _collect(scene)


def quality(preset: str | None) -> dict[str, float]:
    """The settings of a quality preset by its name, none for None; HybridError for a name that there is not."""
    if preset is None:
        return {}
    if preset.upper() not in QUALITY:
        raise HybridError(f"preset is {preset!r}: it must be one of {', '.join(QUALITY).lower()}")
    return QUALITY[preset.upper()][2].values()


def check(scene: bpy.types.Scene) -> None:
    """Raise HybridError, before anything is rendered, for what would fail or mislead."""
    check_camera(scene, scene.camera)
    if scene_setup.effective_mode(scene) != "FULL":
        opengl.require()


def check_camera(scene: bpy.types.Scene, camera: bpy.types.Object | None) -> None:
    """Raise HybridError if this scene, or this camera of it, cannot be rendered hybrid at all."""
    reason = scene_setup.why_inactive(scene)
    if reason:
        raise HybridError(reason)
    if camera is None:
        raise HybridError(f"scene '{scene.name}' has no camera: add one and make it the active camera")
    if camera.type != "CAMERA":
        raise HybridError(
            f"scene '{scene.name}' looks through '{camera.name}', which is no camera but of type {camera.type}: "
            "choose a camera"
        )


# ------------------------------------------------------------------------------------------------ small parts


@contextmanager
def _seen_by(scene: bpy.types.Scene, camera: bpy.types.Object | None) -> Iterator[None]:
    """Render with this camera; the scene's own and its markers' come back."""
    if camera is None:
        yield
        return
    markers = [(marker, marker.camera) for marker in scene.timeline_markers if marker.camera]
    before = scene.camera
    try:
        for marker, _ in markers:
            marker.camera = None
        scene.camera = camera
        yield
    finally:
        for marker, own in markers:
            marker.camera = own
        scene.camera = before


@contextmanager
def _overridden(
    scene: bpy.types.Scene, values: dict[str, Any], frame: int | None, resolution: tuple[int, int] | None
) -> Iterator[None]:
    """Set what is given, render, put everything back, whatever happened."""
    settings, b_render = scene.hybrid, scene.render
    before = {name: getattr(settings, name) for name in values}
    size = (b_render.resolution_x, b_render.resolution_y, b_render.resolution_percentage)
    frame_before, enabled = scene.frame_current, settings.enabled
    try:
        for name, value in values.items():
            setattr(settings, name, value)
        if resolution is not None:
            b_render.resolution_x, b_render.resolution_y = resolution
            b_render.resolution_percentage = 100
        if not enabled:
            scene_setup.enable(scene)
        if frame is not None:
            scene.frame_set(frame)
        scene_setup.sync(scene)
        yield
    finally:
        for name, value in before.items():
            setattr(settings, name, value)
        b_render.resolution_x, b_render.resolution_y, b_render.resolution_percentage = size
        if not enabled:
            scene_setup.disable(scene)
        if frame is not None:
            scene.frame_set(frame_before)


def _collect(scene: bpy.types.Scene) -> HybridResult:
    planes = images.read_render_result(scene)
    found = {view: _collect_view(scene, images.of_view(planes, view), view) for view in views(scene)}
    first = next(iter(found.values()))
    return first if "" in found else replace(first, views=found)


def _collect_view(scene: bpy.types.Scene, planes: Mapping[str, Float32], view: str) -> HybridResult:
    image = planes.get("Composite.Combined")
    if image is None:
        raise RuntimeError("Blender's render gave no composite: it was cancelled")
    height, width = image.shape[:2]
    frame = session.of(scene.name).frame
    if view:
        frame = session.of(scene.name).frames.get(part_of(source_layers(scene)[0], view))
    if frame is None:  # RASTER mode, or nothing ray traced: the tracer was never called
        report = _raster_report(scene, (width, height))
        session.of(scene.name).report = report
        empty = np.zeros((height, width), np.float32)
        return HybridResult(image, image, empty, np.zeros_like(image), report)
    mask, traced = (images.place(part, frame.window, (height, width)) for part in (frame.mask, frame.traced))
    raster = np.zeros_like(image) if frame.raster is None else images.place(frame.raster, frame.window, (height, width))
    passes = {name: images.place(plane, frame.window, (height, width)) for name, plane in frame.passes.items()}
    return HybridResult(image, raster, mask, traced, frame.report, passes)


def _raster_report(scene: bpy.types.Scene, resolution: tuple[int, int]) -> dict[str, Any]:
    timing = session.of(scene.name).since_start()
    nothing_flagged = scene.hybrid.mode == "HYBRID"
    return frame_report(
        versions=engine.versions(),
        settings=public_settings(scene),
        frame=scene.frame_current,
        resolution=resolution,
        mask=np.zeros((1, 1), np.float32),
        film=None,
        counts={},
        time={"raster": timing, "total": timing},
        warnings=(scene_setup.missed(scene) or ["no object is ray traced: tick Hybrid in an object's properties"])
        if nothing_flagged
        else [],
        skipped=[
            {"what": "tracing", "why": "no object is ray traced" if nothing_flagged else "mode RASTER", "count": 1}
        ],
    )


def _reason(scene: bpy.types.Scene, message: str) -> Exception:
    """The engine's own if it has one, else Blender's first line."""
    return session.of(scene.name).error or RuntimeError(message.strip().splitlines()[0].removeprefix("Error: "))
