"""The world: radiance seen by rays that leave the scene, and its diffuse light on a surface."""

from __future__ import annotations

import numpy as np

from ..scene import Float32, Float64, Texture, World
from .blur import BLUR_ROUGHNESS, blurred, levels
from .textures import equirect_coordinates, lookup, sample_equirect
from .vectors import Array, matrix_times, select, take

BAND = 64
"""Rows of an image that are worked on at once: they stay in a core's cache."""


class CompiledWorld:
    """World radiance by direction, and its irradiance to the first order of spherical harmonics, as EEVEE lights with.

    is_black : no ray can bring anything back from it.
    """

    def __init__(self, world: World) -> None:
        self._radiance = np.array(world.radiance, np.float32)[:, None]
        self._environment = world.environment
        self._rotation = np.asarray(world.rotation, np.float64)
        self.is_black = not self._radiance.any()
        self.has_environment = world.environment is not None and not self.is_black
        self._constant = np.array(world.radiance, np.float64)[:, None]
        self._linear: Float64 | None = None
        self._blurred: dict[int, Texture] | None = None
        if self.has_environment:
            self._project()

    def radiance(self, direction: Float32) -> Float32:
        """Radiance (3, n) or (3, 1) from directions (3, n)."""
        if not self.has_environment or self._environment is None:
            return self._radiance
        return self._radiance * sample_equirect(self._environment, matrix_times(self._rotation, direction))

    def glossy(self, direction: Float32, roughness: Float32) -> Float32:
        """Radiance (3, n) from around directions (3, n), as a lobe of that roughness (n,) sees it."""
        if self._blurred is None:
            return self._radiance
        u, v = equirect_coordinates(matrix_times(self._rotation, direction))
        level = levels(roughness)
        lower = np.minimum(level.astype(np.intp), len(BLUR_ROUGHNESS) - 2)
        result = np.zeros(direction.shape, np.float32)
        for i in np.flatnonzero(np.bincount(lower)).tolist():
            here = select(lower == i)
            t = (take(level, here) - i).astype(np.float32)
            for image, weight in ((self._blurred[i], 1 - t), (self._blurred[i + 1], t)):
                found = lookup(image.pixels, take(u, here), take(v, here), "REPEAT", "EXTEND")
                result[:, here] += weight * found[:3]
        return self._radiance * result

    def prepare_glossy(self, low: float, high: float) -> None:
        """Blur the environment for `glossy` of roughnesses from `low` to `high`."""
        if self._environment is not None and self.has_environment:
            self._blurred = blurred(self._environment, low, high)

    def irradiance_over_pi(self, normal: Float32) -> Float32:
        """E / pi, (3, n) or (3, 1), on surfaces of normal (3, n): what a white diffuse surface sends on."""
        if self._linear is None:
            return self._constant.astype(np.float32)
        n = matrix_times(self._rotation, normal)
        k = self._linear.astype(np.float32)
        c = self._constant.astype(np.float32)
        e = np.stack([c[i] + k[i, 0] * n[0] + k[i, 1] * n[1] + k[i, 2] * n[2] for i in range(3)])
        return np.maximum(e, 0)

    def _project(self) -> None:
        """Project the image: E / pi = L00 Y00 + (2/3) sum L1m Y1m(n) (Ramamoorthi & Hanrahan 2001, A1 = 2/3 A0).

        With the mean radiance m = 1/4pi int L and the mean vector v = 1/4pi int L w dw this is m + 2 v.n.
        """
        assert self._environment is not None
        pixels = self._environment.pixels
        height, width = pixels.shape[:2]
        edges = np.linspace(-np.pi / 2, np.pi / 2, height + 1)
        latitude, longitude = (edges[:-1] + edges[1:]) / 2, -2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
        share = np.diff(np.sin(edges)) / 2 / width  # of the sphere, for each texel of a row
        basis = np.stack([np.ones(width), np.cos(longitude), np.sin(longitude)])
        bands = (pixels[i : i + BAND].astype(np.float64) for i in range(0, height, BAND))
        sums = np.concatenate([np.matmul(basis, band) for band in bands])[..., :3]  # (h, 3, rgb)
        rows, horizontal = sums[:, 0], (sums[:, 1], sums[:, 2])
        vector: Array = np.stack(
            [
                ((share * np.cos(latitude))[:, None] * horizontal[0]).sum(0),
                ((share * np.cos(latitude))[:, None] * horizontal[1]).sum(0),
                ((share * np.sin(latitude))[:, None] * rows).sum(0),
            ],
            axis=1,
        )  # (rgb, xyz)
        self._constant = self._constant * (share[:, None] * rows).sum(0)[:, None]
        self._linear = 2 * vector * self._radiance.astype(np.float64)
