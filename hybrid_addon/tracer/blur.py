"""The environment as rough reflections see it: blurred by the GGX lobe, once for each of a few roughnesses.

The lobe is that of a surface seen from straight above (n = v = r), as in split-sum shading (Karis 2013): radiance from
l weighs D(h) n.l, with h half way between n and l. Over longitude this is a convolution, done by Fourier transform;
over latitude it is summed.
"""

from __future__ import annotations

import numpy as np

from ..scene import Float32, Float64, Texture

BLUR_ROUGHNESS = (0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0)
"""Steps even in roughness; between them it is interpolated."""
BLUR_ROWS = 64
"""Rows of the blurred images: 2.8 degrees each, the narrowest lobe is 7 wide."""


def blurred(environment: Texture) -> list[Texture]:
    """One equirectangular image for each of BLUR_ROUGHNESS."""
    small = reduced(environment.pixels[..., :3], BLUR_ROWS)
    return [
        Texture(f"{environment.name}, roughness {roughness:g}", _lobe_sums(small, roughness))
        for roughness in BLUR_ROUGHNESS
    ]


def reduced(pixels: Float32, rows: int) -> Float64:
    """Means over the texels of an equirectangular image in (rows, 2 rows) fields, weighted by solid angle."""
    height, width = pixels.shape[:2]
    edges = np.linspace(-np.pi / 2, np.pi / 2, height + 1)
    area = np.diff(np.sin(edges))
    tall = _overlaps(height, rows) * area
    tall /= tall.sum(axis=1, keepdims=True)
    wide = _overlaps(width, 2 * rows)
    wide /= wide.sum(axis=1, keepdims=True)
    result = np.zeros((rows, 2 * rows, pixels.shape[2]))
    for c in range(pixels.shape[2]):
        result[..., c] = tall @ pixels[..., c].astype(np.float64) @ wide.T
    return result


def _overlaps(fine: int, coarse: int) -> Float64:
    """(coarse, fine): share of each of `fine` even parts of a line in each of `coarse` ones."""
    low, high = np.arange(coarse)[:, None] / coarse, np.arange(1, coarse + 1)[:, None] / coarse
    start, end = np.arange(fine)[None] / fine, np.arange(1, fine + 1)[None] / fine
    return np.maximum(np.minimum(high, end) - np.maximum(low, start), 0) * fine


def _lobe_sums(image: Float64, roughness: float) -> Float32:
    """(rows, 2 rows, 4): the image under the lobe, at each of its own directions."""
    rows, columns = image.shape[:2]
    latitude = (np.arange(rows) + 0.5) / rows * np.pi - np.pi / 2
    turn = np.arange(columns) / columns * 2 * np.pi
    area = np.diff(np.sin(np.linspace(-np.pi / 2, np.pi / 2, rows + 1)))
    spectrum = np.fft.rfft(image * area[:, None, None], axis=1)
    flat = np.fft.rfft(np.broadcast_to(area[:, None, None], (rows, columns, 1)), axis=1)
    result = np.empty((rows, columns, 4), np.float32)
    a2 = roughness**4
    for i in range(rows):
        cos = np.sin(latitude[i]) * np.sin(latitude)[:, None]
        cos = cos + np.cos(latitude[i]) * np.cos(latitude)[:, None] * np.cos(turn)
        half2 = (1 + cos) / 2
        lobe = np.maximum(cos, 0) * (a2 / (half2 * (a2 - 1) + 1)) ** 2
        kernel = np.fft.rfft(lobe, axis=1)[..., None]
        total = np.fft.irfft((kernel * spectrum).sum(0), columns, axis=0)
        result[i, :, :3] = total / np.fft.irfft((kernel * flat).sum(0), columns, axis=0)
    result[..., 3] = 1
    return np.maximum(result, 0)
