# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render is asked for, what it looks at, and what it gives. Conventions: see the package."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from .numbers import Float32


@dataclass(frozen=True, eq=False)
class Raster:
    """What the rasteriser has drawn of the same frame, over the camera's window: everything but the ray traced objects.

    pixels : (height, width, 4) float32, scene-linear, associated alpha. Alpha is 1 exactly where a pixel and what its
             filter reaches show nothing that is held out (and, over a transparent film, no sky).
    depth  : (height, width) float32, metres along the view axis, not filtered: of one place in each pixel, the same in
             all. NO_DEPTH where there is only sky. Held-out objects have depth, blended materials have none.
    albedo : (height, width, 3) float32, its diffuse colour, black where held out; None: no light will be added to it.
    """

    pixels: Float32
    depth: Float32
    albedo: Float32 | None = None


@dataclass(frozen=True)
class Settings:
    """How to trace.

    samples       : camera rays for each pixel; 1 = one ray, not filtered (as EEVEE's one sample).
    max_depth     : number of bounces after the camera ray; 0 = local shading only.
    cutoff        : throughput that each camera sample may lose to rays that are not followed because they would bring
                    little, the smallest first; 0 = follow all. What is lost is in the residual. A sample becomes no
                    more than 256 rays, or 1 / cutoff if that is more: some of the lightest then stand for the others.
    filter_radius : of the pixel filter in pixels (Blender's Filter Size, EEVEE's Gaussian).
    see           : "RAY_TRACED": camera rays see `ray_traced` objects only (hybrid); "RASTER": everything else and the
                    world; "ALL": both.
    transparent   : where camera rays see the world, pixels where nothing is hit get alpha 0 (Film > Transparent).
    raster_shadows : work out, too, the shadows that ray traced objects cast on all others (`Film.shadow`).
    threads       : worker threads, 0 = all cores. chunk: camera rays a thread begins at once. Neither changes a pixel.
    processes     : as many forked processes do the work of the threads, where there are two or more, the system can
                    fork and the picture is worth it (`tracer.forks`). Changes no pixel.
    seed          : of the sampling pattern, together with the pixel's absolute position.
    first         : number of the first sample in that pattern: of a part of a picture's samples.
    fill          : pixels of the mask in which no sample met a ray traced object get a colour all the same.
    shadow_samples : rays to each light that has a size, for each hit, spread over the light; 0 = hard shadows.
    rough_samples : rays for each reflection and refraction of a rough surface that a camera ray meets; further on they
                    take one. 0 = rough surfaces mirror sharply.
    occlusion_samples : rays for each hit that the world lights, to find how much of it is hidden; 0 = it is in sight.
    occlusion_distance : metres, > 0; what is further away hides nothing.
    denoise       : light that came by random choices is denoised, where there is a denoiser (`film.denoised`); nothing
                    else changes. With `fill` off the film is a part of a picture: it keeps what that needs in its
                    passes, and is not denoised.
    adaptive      : 0 = all samples in every pixel; else pixels stop at 2 whose samples and neighbours agree in what
                    they met and, within this contrast, in colour, and at 8, 16, ... where, within it, the halves of
                    their samples and their neighbours' agree. What brings less than this share does not count.
    caustics      : "SIMPLE": shadows of what refracts are brighter in their middle, and darker at their rim, as if it
                    focused light (`scattering.simple_caustic`). "PHOTONS", with raster_shadows: such shadows are opaque
                    there, and `Film.caustic` has the light.
    photons       : how many.
    passes        : passes that are wanted: "depth", "normal", "samples"; "reflection" and "refraction", the light that
                    came by way of such a ray from the first surface; "raster_backed", the share of the light's way that
                    ended at raster-backed hits; "background" and "passed", the light of what is not ray traced and seen
                    straight through what is, and the throughput that it comes by.
    """

    samples: int = 16
    max_depth: int = 8
    filter_radius: float = 1.5
    camera_sees: Literal["RAY_TRACED", "RASTER", "ALL"] = "RAY_TRACED"
    transparent: bool = False
    threads: int = 0
    processes: bool = False
    chunk: int = 7 << 13
    seed: int = 0
    first: int = 0
    fill: bool = True
    cutoff: float = 0.0
    adaptive: float = 0.0
    passes: frozenset[str] = frozenset()
    shadow_samples: int = 1
    rough_samples: int = 0
    occlusion_samples: int = 0
    occlusion_distance: float = float("inf")
    raster_shadows: bool = False
    caustics: Literal["NONE", "SIMPLE", "PHOTONS"] = "NONE"
    photons: int = 1 << 19
    denoise: bool = False


NOTHING_RANDOM = "no light is random"
"""Why nothing was denoised where nothing had to be (`Film.denoising`)."""


@dataclass(frozen=True, eq=False)
class Film:
    """What was traced, over the camera's window.

    radiance   : (height, width, 3) float32, *not* multiplied by coverage: the mean over the samples that saw something.
    coverage   : (height, width) float32, the filtered share of samples that saw something (tracer's own mask).
    residual   : (height, width) float32, mean throughput of everything that was cut off (docs, Errors and plan).
    rays       : number of rays by kind: camera, reflected, refracted, shadow, dropped.
    time       : seconds by phase, wall and cpu: {"build": {"wall": s, "cpu": s}, ...}.
    invariants : counters that must be 0.
    skipped    : what the plan left out: [{"what", "why", "count"}].
    plan       : every pruning and whether it applied: [{"name", "class", "leaves_out", "when", "applies"}].
    sampling   : samples_mean, samples_max; rmse, the error to expect of them (None: unknown), and the slope that it
                 falls with; audit, of the pixels that adaptive sampling left alone.
    shadow     : (height, width, 3) float32, the light that the shadows of ray traced objects leave over on all that is
                 not ray traced, as a share of the light without them; exactly 1 where they take nothing. None: not
                 worked out.
    caustic    : (height, width, 3) float32, irradiance (W/m^2) of what is not ray traced by light that ray traced
                 objects bend or mirror there. None: not worked out.
    passes     : the passes that were asked for, by name: (height, width) or (height, width, 3) float32. Those of
                 light are means as radiance is.
    hits       : of secondary rays: "backed" by the raster, or "not_backed"; 0 both where nothing could be.
    ended      : what is missing because rays ended early: the share of the samples that lost more than `least` of their
                 light, what these lost in the mean, the mean radiance of what is around, what the cutoff took, and for
                 each object, by its number in `Scene.names`, the throughput that Max Bounces ended there.
    problems   : what went wrong in surface programs, a line for each object and reason.
    memory     : bytes by what for, of `trace` alone: "peak" of the process since it began (None: unknown), "meshes",
                 "geometry", "search_trees" (estimated), "film", "textures"; "by_texture", by name, the largest first.
    denoising  : {} where nobody asked; else "pixels", how many have light that was denoised, so that no error bound
                 holds there; "why_not", "" or why there are none; and if there are, "library", its version, "wall" and
                 "cpu" seconds, and "bytes", by which the process' peak has grown (None: unknown).
    """

    radiance: Float32
    coverage: Float32
    residual: Float32
    rays: dict[str, int]
    time: dict[str, dict[str, float]]
    invariants: dict[str, int]
    skipped: list[dict[str, object]]
    sampling: dict[str, object] = field(default_factory=dict)
    plan: list[dict[str, object]] = field(default_factory=list)
    passes: dict[str, Float32] = field(default_factory=dict)
    shadow: Float32 | None = None
    caustic: Float32 | None = None
    hits: dict[str, int] = field(default_factory=dict)
    ended: dict[str, object] = field(default_factory=dict)
    memory: dict[str, object] = field(default_factory=dict)
    denoising: dict[str, object] = field(default_factory=dict)
    problems: tuple[str, ...] = ()
