# SPDX-License-Identifier: GPL-3.0-or-later
"""Putting the two halves of the picture together: arrays in, arrays out.

Pictures are (height, width, 4) float32, scene-linear, with associated alpha; masks are (height, width) float32, 0..1.
"""

from __future__ import annotations

import numpy as np

from .scene import Film, Float32

LEAST_THROUGHPUT = 1e-6
"""Below it nothing is seen through: no quotient by less is asked for."""


def premultiply(radiance: Float32, mask: Float32) -> Float32:
    """The traced layer: radiance (h, w, 3) that covers `mask` of each pixel, alpha = mask.

    Where the mask is 0 the layer is exactly 0, whatever the radiance there (0 times infinity is no colour).
    """
    _same_size(radiance, mask)
    picture = np.zeros((*mask.shape, 4), np.float32)
    covered = mask != 0
    for channel in range(3):  # a fifth of the time that pixels gathered by `covered` take
        np.multiply(radiance[..., channel], mask, out=picture[..., channel], where=covered)
    picture[..., 3] = mask
    return picture


def see_through(traced: Float32, raster: Float32, mask: Float32, film: Film) -> tuple[Float32, Float32, Float32]:
    """The traced layer, the raster and the mask where one sees straight through ray traced surfaces.

    There EEVEE's picture, in which they are held out as far as they are opaque, has the background already: as much of
    it as EEVEE lets through. Of a film with c coverage, T throughput to the background of radiance B and radiance L
    with it, and t what EEVEE lets through of c: the traced layer is c (L - min(1, t / T) B), and of the raster
    (1 - c + c min(T, t)) / (1 - c + c t) is left. So each has its own part, their sum does not hang on what EEVEE made
    of the material, and an additive glow, of which EEVEE's mask is 0, stays. Elsewhere nothing changes.

    Returns the layer (alpha stays 1 less that of the raster), the raster that is left, and the mask as large as c.
    """
    _same_size(traced, raster)
    passed, background = film.passes["passed"], film.passes["background"]
    shows = (passed > 0).any(axis=2) & (film.coverage > 0)
    if not shows.any():
        return traced, raster, mask
    c, m = film.coverage[shows][:, None], mask[shows][:, None]
    through, light = passed[shows], film.radiance[shows]
    by_eevee = np.clip((c - m) / c, 0, 1)
    share = np.minimum(by_eevee / np.maximum(through, LEAST_THROUGHPUT), 1)
    left = (1 - c + c * np.minimum(through, by_eevee)) / np.maximum(1 - c + c * by_eevee, LEAST_THROUGHPUT)
    result, rest, cover = traced.copy(), raster.copy(), mask.copy()
    rest[shows, :3] = raster[shows, :3] * left
    result[shows, :3] = c * (light - share * background[shows]) + rest[shows, :3] - raster[shows, :3]
    cover[shows] = np.maximum(mask[shows], film.coverage[shows])
    return result, rest, cover


def shade(traced: Float32, raster: Float32, shadow: Float32) -> Float32:
    """The traced layer with what it takes from the raster beside its own objects, so that their sum is in shadow.

    shadow : (h, w, 3) share of the raster's light that is left. Where it is exactly 1 the layer stays as it is, and the
             raster so too, bit for bit; elsewhere it may be negative.
    """
    _same_size(traced, raster)
    _same_size(traced, shadow)
    result = traced.copy()
    concerned = shadow != 1
    result[..., :3][concerned] += (raster[..., :3] * (shadow - 1))[concerned]
    return result


def lay_over(half: Float32, lines: Float32, of_both: bool = True) -> Float32:
    """One of the two halves with lines (h, w, 4), associated alpha, that lie over their sum.

    of_both : this half gets the lines' own light; the other one is only hidden by them. Where there are no lines both
              stay as they are, bit for bit.
    """
    _same_size(half, lines)
    hidden = half * (1 - lines[..., 3:])
    return hidden + lines if of_both else hidden


def light_up(traced: Float32, irradiance: Float32, albedo: Float32) -> Float32:
    """The traced layer with the light that it brings to the raster: irradiance (h, w, 3) times albedo over pi.

    albedo : (h, w, >= 3) of what the raster shows, 0 where it is held out. Where there is no such light the layer stays
             as it is.
    """
    _same_size(traced, irradiance)
    _same_size(traced, albedo)
    result = traced.copy()
    lit = irradiance != 0
    result[..., :3][lit] += (irradiance * albedo[..., :3])[lit] * np.float32(1 / np.pi)
    return result


def black_out(traced: Float32, raster: Float32, mask: Float32) -> Float32:
    """The traced layer less what the raster shows where all is held out, so that the sum is the traced layer.

    Where ray traced objects cover a pixel whole, EEVEE leaves up to a few hundredths of the highlight of their coat:
    its holdout forgets the third of three closures. There the layer may be negative; elsewhere it stays as it is.
    """
    _same_size(traced, raster)
    _same_size(traced, mask)
    wrong = (raster[..., 0] != 0) | (raster[..., 1] != 0) | (raster[..., 2] != 0)  # 5 times as fast as any(axis=2)
    wrong &= mask == 1
    if not wrong.any():
        return traced
    result = traced.copy()
    result[..., :3][wrong] -= raster[..., :3][wrong]
    return result


def mask_from_alpha(mask_layer: Float32, user_layer: Float32 | None = None) -> Float32:
    """Coverage of the held-out objects, from the alpha (h, w) of the layer in which they are held out.

    Over an opaque film everything else has alpha 1: the mask is 1 - alpha. Over a transparent film (`user_layer`, the
    alpha of the layer without holdouts, is given) the sky has alpha 0 too: the mask is what the holdout took away.
    """
    reference = np.float32(1) if user_layer is None else user_layer
    if user_layer is not None:
        _same_size(user_layer, mask_layer)
    result: Float32 = np.clip(reference - mask_layer, 0, 1).astype(np.float32)
    return result


def _same_size(a: Float32, b: Float32) -> None:
    if a.shape[:2] != b.shape[:2]:
        raise ValueError(f"compositor: pictures differ in size: {a.shape[:2]} and {b.shape[:2]}")
