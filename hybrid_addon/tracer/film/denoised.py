# SPDX-License-Identifier: GPL-3.0-or-later
"""A film whose random light is denoised, and nothing else (`shading.random_light` tells which it is).

Light by ways drawn at random is W L: of the weights W of the ways there is no noise, and L is the mean of what they
bring. So is light with random shadows U V: U without them, V the share that they leave over. A denoiser gets each
pixel's own mean of W L (with W as albedo) and of V, which share no samples with the neighbours', as it wants them. Its
answers' L and V then multiply W and U of the picture, with their own edges, textures and pixel filter.

Where W is 0 nothing changes, nor where shadows all around take the same share: 0 or 1. Those pixels keep their bits.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import memory
from ...scene import Film, Float32
from ...scene.film import NOTHING_RANDOM
from ..core.constants import FAILED_PIXEL
from .denoiser import Denoiser, DenoiserError
from .samples import DRAWN_LIGHT, SHADOWED_LIGHT
from .so_far import fill_coarse

Bools = NDArray[np.bool_]

LEAST_WEIGHT = 1e-6
"""Of a way: what carries less lights no pixel that can be seen, and nothing is divided by it."""

AROUND = 3
"""Pixels: where shadows all around, so far to each side, take all or nothing, the pixel is not in a penumbra. With a
sample or two a penumbra has such places; they keep what they have, which is right there on the whole."""

RIM = 2
"""Pixels around the mask that continue it, so that no darkness from beyond gets in. Between what is rough and what is
not a denoiser gets the edge as it is: measured, a picture that goes on there has a quarter more error."""


def denoised(film: Film, threads: int = 0, check: Callable[[], None] | None = None) -> Film:
    """The film without the noise of its random light, where its passes tell of any; they are none of its passes then.

    threads : 0 = all.   check : called now and then; raises to stop.

    `Film.denoising` says what was done, or why it was not: then the film is as it was.
    """
    told = DRAWN_LIGHT | SHADOWED_LIGHT
    passes = {name: picture for name, picture in film.passes.items() if name not in told}
    rest = replace(film, passes=passes)
    if len(passes) == len(film.passes):
        return replace(rest, denoising={"pixels": 0, "why_not": NOTHING_RANDOM})
    began, cpu, peak = time.perf_counter(), time.process_time(), memory.peak()
    try:
        with Denoiser(threads, check) as denoiser:
            radiance, changed = _radiance(film, denoiser)
            version = denoiser.version
    except DenoiserError as error:
        return replace(rest, denoising={"pixels": 0, "why_not": str(error)})
    grown = memory.peak()
    return replace(
        rest,
        radiance=radiance,
        denoising={
            "pixels": int(np.count_nonzero(changed)),
            "why_not": "",
            "library": version,
            "wall": time.perf_counter() - began,
            "cpu": time.process_time() - cpu,
            "bytes": None if grown is None or peak is None else grown - peak,
        },
    )


def _radiance(film: Film, denoiser: Denoiser) -> tuple[Float32, Bools]:
    """The film's radiance with its random light denoised, and the pixels (h, w) that have changed."""
    radiance, passes = film.radiance.copy(), film.passes
    failed = ~np.isfinite(film.radiance).all(axis=2) | (film.radiance == np.array(FAILED_PIXEL, np.float32)).all(axis=2)
    changed = np.zeros(failed.shape, bool)
    if "drawn" in passes:
        index = (passes["drawn_weight"] > LEAST_WEIGHT).any(axis=2) & ~failed
        if index.any():
            radiance[index] += (_light(film, denoiser) - passes["drawn"])[index]
            changed |= index
    if "shadowed" in passes:
        share, varies = _shares(passes, denoiser)
        index = varies & (passes["unshadowed"] != 0).any(axis=2) & ~failed
        if index.any():
            radiance[index] += (passes["unshadowed"] * share - passes["shadowed"])[index]
            changed |= index
    return radiance, changed


def _light(film: Film, denoiser: Denoiser) -> Float32:
    """(h, w, 3) light by random ways, denoised."""
    light, weight = film.passes["drawn_unfiltered"], film.passes["drawn_weight_unfiltered"]
    # Pixels of the mask whose own samples missed it, and a rim around it, continue what is beside them.
    covered = film.coverage > 0
    known = covered & ((weight > LEAST_WEIGHT).any(axis=2) | (film.passes["drawn_weight"] <= LEAST_WEIGHT).all(axis=2))
    rim = _extreme(covered, np.maximum, RIM) & ~known
    light, weight = (
        np.where((known | rim)[..., None], fill_coarse(np.where(known[..., None], a, 0), known), 0).astype(np.float32)
        for a in (np.maximum(light, 0), weight)
    )
    clean = denoiser(light, np.clip(weight, 0, 1))
    brings = weight > LEAST_WEIGHT
    mean = np.where(brings, clean / np.where(brings, weight, 1), 0)
    return np.asarray(film.passes["drawn_weight"] * mean, np.float32)


def _shares(passes: dict[str, Float32], denoiser: Denoiser) -> tuple[Float32, Bools]:
    """(h, w, 3) shares that random shadows leave over, denoised; and the pixels (h, w) around which they differ."""
    shadowed, unshadowed = passes["shadowed_unfiltered"], passes["unshadowed_unfiltered"]
    brings = np.abs(unshadowed) > LEAST_WEIGHT
    there = brings.any(axis=2)
    share = np.where(brings, shadowed / np.where(brings, unshadowed, 1), np.where(there[..., None], np.nan, 0))
    # A channel without light is like the others.
    with np.errstate(all="ignore"):
        known = np.where(np.isfinite(share), share, 0).sum(axis=2) / np.maximum(brings.sum(axis=2), 1)
    share = np.clip(np.where(np.isfinite(share), share, known[..., None]), 0, 1).astype(np.float32)
    return _without_noise(share, there, denoiser)


def denoised_shadow(
    shadow: Float32, own: Float32, there: Bools, threads: int, check: Callable[[], None] | None
) -> Float32:
    """`Film.shadow` (h, w, 3) without noise, where there is a denoiser; else as it is.

    own : (h, w, 3) the same of each pixel's own samples.   there : (h, w) where shadows were worked out; 1 elsewhere.
    threads, check : see `denoised`.
    """
    try:
        with Denoiser(threads, check) as denoiser:
            clean, differs = _without_noise(np.clip(own, 0, 1), there, denoiser)
    except DenoiserError:
        return shadow
    return np.where(differs[..., None], clean, shadow)


def _without_noise(share: Float32, there: Bools, denoiser: Denoiser) -> tuple[Float32, Bools]:
    """Shares (h, w, 3) of light denoised; and the pixels (h, w) around which they differ. there: (h, w), some is."""
    differs = np.zeros(there.shape, bool)
    for of_channel in np.moveaxis(share, 2, 0):
        least = _extreme(np.where(there, of_channel, np.float32(np.inf)), np.minimum, AROUND)
        most = _extreme(np.where(there, of_channel, np.float32(-np.inf)), np.maximum, AROUND)
        differs |= there & (least < most)
    if not differs.any():
        return share, differs
    return np.clip(denoiser(fill_coarse(share, there)), 0, 1), differs


def _extreme(picture: NDArray[Any], which: np.ufunc, around: int) -> NDArray[Any]:
    """Of a picture (h, w) the least, or the most, within so many pixels to each side."""
    for axis in (0, 1):
        padded = np.pad(picture, [(around, around) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * around + 1, axis=axis)
        picture = which.reduce(windows, axis=-1)
    return picture
