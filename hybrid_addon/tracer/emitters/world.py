# SPDX-License-Identifier: GPL-3.0-or-later
"""The world: radiance seen by rays that leave the scene, and its diffuse light on a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64, SunLight, World
from ..core.vectors import add, count, flatnonzero, normalize, select, take, write
from ..materials.textures import equirect_coordinates, lookup
from .environment import Sky
from .prefilter import BLUR_ROUGHNESS, Images, blurred, levels, needed_levels

FIRST_ORDER = 0.488602512  # of the spherical harmonics along an axis
DERING_LENGTH = 4 * np.pi * FIRST_ORDER * (FIRST_ORDER * 2 / 3 + 0.05)
"""Of EEVEE 5: the second order stays below the first by its weight in diffuse light, and a little."""


class CompiledWorld:
    """World radiance by direction, and its irradiance to the first order of spherical harmonics, as EEVEE lights with.

    is_black : no ray can bring anything back from it.   gives_light : it has more than a backdrop.
    suns     : lights that were taken out of it.
    """

    def __init__(self, world: World) -> None:
        sky = Sky(world, world.sun.threshold if world.sun else np.inf, world.limit)
        self._sky, self._backdrop = sky, Sky(world.backdrop or world)
        self.gives_light = not sky.is_black
        self.is_black = sky.is_black and self._backdrop.is_black
        self.suns: list[SunLight] = []
        self._mean: Float64 = sky.factor.astype(np.float64)
        self._linear: Float64 | None = None
        self._blurred: Images = {}
        if not sky.uniform:
            sums = sky.sums()
            mean, vector = sums.radiance / (4 * np.pi), sums.toward / (4 * np.pi)
            self._mean, self._linear = lambert(mean, vector, world.limit, world.dering)
            sun = sky.sun(sums, world.sun) if world.sun else None
            self.suns = [sun] if sun else []
        unlimited = bool((sky.factor == self._backdrop.factor).all()) if sky.uniform else not np.isfinite(world.limit)
        if world.backdrop is None and unlimited and (sky.uniform or not world.sun):
            self._backdrop = sky

    @property
    def skies(self) -> tuple[Sky, Sky]:
        """The one that lights, and the one that cameras see."""
        return self._sky, self._backdrop

    @property
    def diffuse(self) -> tuple[Float64, Float64 | None]:
        """(3, 1) and (3, 3) of `lambert`; no second one where the world is the same all around."""
        return self._mean, self._linear

    @property
    def blurred(self) -> Images:
        """Its blurred images, as far as `prepare_glossy` made them."""
        return self._blurred

    def radiance(self, direction: Float32) -> Float32:
        """Radiance (3, n) or (3, 1) from directions (3, n), for rays that were reflected or refracted."""
        return self._sky.radiance(direction)

    def seen(self, direction: Float32, camera: NDArray[np.bool_]) -> Float32:
        """The same where `camera` (n,) is False; else what a camera sees there."""
        if self._backdrop is self._sky or not camera.any():
            return self.radiance(direction)
        result = np.empty(direction.shape, np.float32)
        for sky, those in ((self._sky, select(~camera)), (self._backdrop, select(camera))):
            n = count(those, len(camera))
            if n:
                write(result, those, np.broadcast_to(sky.radiance(take(direction, those)), (3, n)))
        return result

    def glossy(self, direction: Float32, roughness: Float32) -> Float32:
        """Radiance (3, n) from around directions (3, n), as a lobe of that roughness (n,) sees it."""
        if self._sky.uniform:
            return self._sky.factor
        u, v = equirect_coordinates(self._sky.turned(direction))
        level = levels(roughness)
        lower = np.minimum(level.astype(np.intp), len(BLUR_ROUGHNESS) - 2)
        result = np.zeros(direction.shape, np.float32)
        for i in flatnonzero(np.bincount(lower)).tolist():
            here = select(lower == i)
            t = (take(level, here) - i).astype(np.float32)
            for image, weight in ((self._blurred[i], 1 - t), (self._blurred[i + 1], t)):
                found = lookup(image, take(u, here), take(v, here), "REPEAT", "EXTEND")
                add(result, here, weight * found[:3])
        # What is smoother than the least blurred image lies between it and the sharp one.
        sharper = select(roughness < BLUR_ROUGHNESS[0])
        if count(sharper, len(roughness)):
            share = take(roughness, sharper) / np.float32(BLUR_ROUGHNESS[0])
            sharp = self._sky.radiance(normalize(take(direction, sharper)))
            write(result, sharper, take(result, sharper) * share + sharp * (1 - share))
        return result

    def prepare_glossy(self, low: float, high: float) -> None:
        """Blur the environment for `glossy` of roughnesses from `low` to `high`."""
        missing = [] if self._sky.uniform else [i for i in needed_levels(low, high) if i not in self._blurred]
        if missing:
            height, width = self._sky.panorama.pixels.shape[:2]
            self._blurred |= blurred(self._sky.rows, (height, width), missing)

    def irradiance_over_pi(self, normal: Float32) -> Float32:
        """E / pi, (3, n) or (3, 1), on surfaces of normal (3, n): what a white diffuse surface sends on."""
        m = self._mean.astype(np.float32)
        if self._linear is None:
            return m
        k = self._linear.astype(np.float32)
        e = np.stack([m[i] + k[i, 0] * normal[0] + k[i, 1] * normal[1] + k[i, 2] * normal[2] for i in range(3)])
        result: Float32 = np.maximum(e, 0)
        return result


def lambert(mean: Float64, vector: Float64, limit: float, dering: str) -> tuple[Float64, Float64]:
    """(3, 1) and (3, 3) of E / pi = m + k n, from the mean radiance m (rgb,) and the mean of L w, v (rgb, xyz).

    The first two orders of spherical harmonics, k = 2 v (Ramamoorthi & Hanrahan 2001, A1 = 2/3 A0), and what EEVEE
    does to them: the second is made no larger than would go below 0, and the radiance that both stand for, m + 3 |v| at
    most, no brighter than the limit (eevee_spherical_harmonics: dering, clamp_energy).
    """
    length = np.sqrt((vector * vector).sum(axis=1))
    largest = 3 * np.max(np.abs(vector), axis=1) if dering == "AXES" else DERING_LENGTH * length
    shares = mean[largest > 0] / largest[largest > 0]
    share = min(1.0, float(np.min(shares, initial=1.0)))
    vector, peak = vector * share, float(np.max(mean + 3 * length * share))
    dimmed = limit / peak if peak > limit else 1.0
    return mean[:, None] * dimmed, 2 * vector * dimmed
