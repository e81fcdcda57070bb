# SPDX-License-Identifier: GPL-3.0-or-later
"""Which light is random, for a denoiser: what came by a way that was drawn, and what shadows take that are.

A picture's noise is in two kinds of light alone. Light that came by a way drawn at random (microfacets of rough
surfaces, places in fog and below skin, points of a lens) is told by its ray from there on: `Rays.branch`, row DRAWN.
With it goes what would have arrived had each such way brought radiance 1: a picture without noise, in which all edges
and colours of what is rough lie. And light of lamps that have a size, and of the world where things may occlude it, is
told with its shadows and without them; without them there is no noise, either.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Camera, Float32, Float64
from ..core.camera import project
from ..core.rays import BACKGROUND, DRAWN, NO_BRANCH, REFLECTION, REFRACTION, WAY, Rays
from ..core.vectors import Index, flatnonzero, take
from ..film.path_hash import REFLECTED
from ..film.samples import SampleBuffer, is_surely_seen
from ..geometry.hits import Hits
from .direct import DirectLight

Bools = NDArray[np.bool_]

LEAST_BLUR = 0.5
"""Pixels, of the radius of what a lens makes of a point: what it blurs less is as sharp as the pixel filter lets it be.
"""


def asks(sample_buffer: SampleBuffer) -> bool:
    """Whether light that came by random ways is to be told apart."""
    return "drawn" in sample_buffer.aovs


def asks_light(sample_buffer: SampleBuffer) -> bool:
    """Whether what is random of the light that falls on hits is to be told apart."""
    return asks(sample_buffer) or "shadowed" in sample_buffer.aovs


def child_branch(branch: NDArray[np.uint8], kind: np.uint32, drawn: Bools | None = None) -> NDArray[np.uint8]:
    """Branches (rows, n) of new rays: the first surface decides. drawn: (n,) those that left at random; None: none."""
    if len(branch) == 0:
        return branch
    result = branch.copy()
    result[WAY, branch[WAY] == NO_BRANCH] = REFLECTION if kind == REFLECTED else REFRACTION
    if drawn is not None and len(branch) > DRAWN:
        result[DRAWN, drawn] = 1
    return result


def note_ways(rays: Rays, drawn: Bools, weight: Float32, sample_buffer: SampleBuffer) -> None:
    """From hits of rays (n,) ways go on that carry `weight` (3, n), `drawn` ones at random: note those that are the
    first such."""
    index = flatnonzero(drawn & is_surely_seen(rays.branch))
    if len(index):
        sample_buffer.add_drawn(rays.sample[index], take(weight, index))


def note_light(rays: Rays, index: Index, light: Float32, weight: Float32, sample_buffer: SampleBuffer) -> None:
    """Light (3, m) that rays `index` bring, and that was added, came by random ways of weight (3, m) from there."""
    branch = take(rays.branch, index)
    surely = flatnonzero(is_surely_seen(branch))
    if len(surely):
        sample = take(rays.sample, index)[surely]
        sample_buffer.add_drawn_light(sample, light[:, surely])
        sample_buffer.add_drawn(sample, weight[:, surely])


def note_random(rays: Rays, index: Index, weight: Float32, direct: DirectLight, sample_buffer: SampleBuffer) -> None:
    """What of the light of lamps and the world is random that rays `index` (m,) bring, and that was added, each by
    `weight` (3, m): its shadows, or the places that it comes from."""
    if "shadowed" in sample_buffer.aovs and direct.soft is not None:
        surely = flatnonzero(is_surely_seen(take(rays.branch, index)) & (direct.soft[1] != 0).any(axis=0))
        sample, factor = take(rays.sample, index)[surely], weight[:, surely]
        sample_buffer.add_shadowed(sample, factor * direct.soft[0][:, surely], factor * direct.soft[1][:, surely])
    if asks(sample_buffer) and direct.spread is not None:
        spread, albedo = direct.spread
        place = np.arange(len(rays))[index][spread]
        note_light(
            rays, place, weight[:, spread] * direct.radiance[:, spread], weight[:, spread] * albedo, sample_buffer
        )


def through_lens(
    camera: Camera, center: Float64, rays: Rays, hits: Hits, hit: Bools, sample_buffer: SampleBuffer
) -> Rays:
    """Camera rays, of which those that a lens blurs where they hit, or in the sky, are drawn at random."""
    if camera.lens is None or not asks(sample_buffer):
        return rays
    far = np.where(hit, hits.t, rays.t_max)
    start = rays.origin.astype(np.float64) + center[:, None]
    direction = rays.direction.astype(np.float64)
    blurred = _blur(camera, start + direction * np.where(np.isfinite(far), far, camera.clip_end)) > LEAST_BLUR
    note_ways(rays, blurred, rays.throughput, sample_buffer)
    branch = rays.branch.copy()
    branch[DRAWN, blurred & (branch[WAY] != BACKGROUND)] = 1
    return replace(rays, branch=branch)


def _blur(camera: Camera, point: Float64) -> Float64:
    """(n,) pixels by which a point (3, n) leaves its place on the film where the rim of the lens sees it."""
    assert camera.lens is not None
    x, y, _ = project(camera, point)
    reach = np.full(point.shape[1], camera.lens.radius)
    aside, _, _ = project(camera, point, (reach / camera.lens.ratio, np.zeros_like(reach)))
    _, below, _ = project(camera, point, (np.zeros_like(reach), reach))
    return np.asarray(np.maximum(np.abs(aside - x), np.abs(below - y)))
