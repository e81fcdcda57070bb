# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur: the traced half as the shutter sees it, moment by moment, at the times at which EEVEE draws its half.

EEVEE renders the whole scene at `motion_blur_steps` moments, evenly spaced under the shutter curve, and blurs each over
the time between its neighbours by what pixels move (eevee_motion_blur.cc). So its half moves evenly however few steps
it takes. Rays have no such blur: they take at least MOMENTS moments, a multiple of EEVEE's steps, and share the
samples of a pixel among them. Moments in which nothing has moved are traced as one.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...scene import Film, Float32, Float64, Settings
from ..sync.cache import same
from ..view_layers import source_layer

if TYPE_CHECKING:
    from ..sync import Translation

MOMENTS = 8
"""As few as still look like one movement, and not like several pictures on top of one another."""

SAMPLES_EACH = 2
"""Of a moment, at least: a single one is not filtered (`Settings.samples`)."""

FEWEST = 2
"""Moments, be they of one sample: one alone would stand still on a blurred background."""

CURVE_STEPS = 256
"""Into which the shutter curve is cut to be integrated; Blender's own table of it has as many."""

Tracer = Callable[..., Film]
"""`tracer.trace`: scene, settings; progress, deadline."""


def is_blurred(scene: bpy.types.Scene) -> bool:
    """Whether EEVEE draws the scene's hybrid view layer with motion blur."""
    layer = source_layer(scene)
    return bool(scene.render.use_motion_blur and getattr(layer, "use_motion_blur", True))


def warnings(scene: bpy.types.Scene, samples: int) -> list[str]:
    """What is not blurred."""
    if samples >= FEWEST or not is_blurred(scene):
        return []
    return [f"with {samples} sample ray traced objects stand still, without motion blur: take {FEWEST} or more"]


def moments(scene: bpy.types.Scene, samples: int) -> list[float]:
    """Frames, with their fractions, at which the picture is traced; the current one alone without motion blur."""
    now = scene.frame_current + scene.frame_subframe
    if not is_blurred(scene):
        return [now]
    steps = max(1, scene.eevee.motion_blur_steps)
    affordable = max(samples // SAMPLES_EACH, min(samples, FEWEST))
    count = min(steps * math.ceil(MOMENTS / steps), affordable)
    if count == 1:
        return [now]
    shift = {"START": 0.0, "CENTER": -0.5, "END": -1.0}[scene.render.motion_blur_position]
    opening = under_curve(scene, (np.arange(count) + 0.5) / count)
    return [now + (float(x) + shift) * scene.render.motion_blur_shutter for x in opening]


def under_curve(scene: bpy.types.Scene, share: Float64) -> Float64:
    """Times (n,), 0..1 of the shutter time, until which the shutter has let in these shares (n,) of the light."""
    b_curve = scene.render.motion_blur_shutter_curve
    b_curve.initialize()
    x = np.linspace(0, 1, CURVE_STEPS + 1)
    height = [max(b_curve.evaluate(b_curve.curves[0], v), 0.0) for v in (x[1:] + x[:-1]) / 2]
    light = np.concatenate([[0.0], np.cumsum(height)])
    if not light[-1] > 0:
        return share
    return np.interp(share, light / light[-1], x)


def trace_moments(
    times: list[float],
    at: Callable[[float], None],
    translated: Callable[[], Translation],
    trace: Tracer,
    settings: Settings,
    mask: Float32 | None,
    progress: Callable[[float], bool],
    deadline: float,
) -> Film:
    """The film of all moments. Of several scenes only two are held at a time.

    at       : have Blender evaluate everything at a frame.
    translated : the scene as it is then, in the tracer's words.
    trace    : `tracer.trace` of it, which takes mask and cache by itself.
    """
    from ...tracer import Cancelled
    from ...tracer.film.denoised import denoised
    from ...tracer.film.shutter import OpenShutter

    film = OpenShutter()
    for start, stop, translation in _runs(times, at, translated):
        first, last = (math.floor(k * settings.samples / len(times)) for k in (start, stop))
        part = replace(settings, first=first, samples=last - first, fill=False, adaptive=0.0)

        def told(done: float, start: int = start, stop: int = stop) -> bool:
            return progress((start + done * (stop - start)) / len(times))

        now = time.perf_counter()
        until = now + (deadline - now) * (stop - start) / (len(times) - start) if deadline < math.inf else deadline
        found = trace(translation.scene, part, progress=told, deadline=until)
        film.add(found, stop - start, middle=start <= len(times) // 2 < stop)
    result = film.result(None if mask is None else mask != 0, settings.camera_sees == "RAY_TRACED")
    if not settings.denoise:
        return result

    def check() -> None:
        if not progress(1.0):
            raise Cancelled

    return denoised(result, settings.threads, check)


def _runs(
    times: list[float], at: Callable[[float], None], translated: Callable[[], Translation]
) -> Iterator[tuple[int, int, Translation]]:
    """Moments start .. stop - 1, in which nothing moves, and the scene as it is in them."""
    held: Translation | None = None
    start = 0
    for number, moment in enumerate(times):
        at(moment)
        found = translated()
        if held is None or not same(held.scene, found.scene):
            if held is not None:
                yield start, number, held
            held, start = found, number
    assert held is not None
    yield start, len(times), held
