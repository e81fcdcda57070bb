# SPDX-License-Identifier: GPL-3.0-or-later
"""The world by direction: a colour, an environment image, or an expression; and its sums over all directions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...expressions import ATTRIBUTE_WIDTHS, Evaluation, walk
from ...procedural import elementary
from ...scene import Expression, Float32, Float64, SunLight, Texture, World, WorldSun
from ...scene.texels import texels_of
from ..core.vectors import Array, matrix_times, no_brighter
from ..materials.textures import sample_equirect, sample_texture

PANORAMA_ROWS = (256, 1024)
"""Rows of the image that an expression is worked out to, for its light: those of its largest image, within these."""
TEXEL_CHUNK = 1 << 18  # texels that an expression is worked out for at once
ROW_CHUNK = 64  # rows that are summed at once: they stay in a core's cache


class Directions:
    """What an expression reads of n directions (expressions.Hits): a world has no surface, and is all around."""

    def __init__(self, direction: Array) -> None:
        self._direction = direction / np.sqrt((direction * direction).sum(axis=0))

    def image(self, texture: Texture, uv: Array | None) -> Float32:
        """RGBA (4, n)."""
        u, v = np.zeros((2, self._direction.shape[1])) if uv is None else uv[:2]
        return sample_texture(texture, u.astype(np.float64), v.astype(np.float64))

    def attribute(self, key: str) -> Float32:
        """(width, n): the direction for "generated", "object" and "position"; it is seen from straight above."""
        if key in ("generated", "object", "position"):
            return self._direction.astype(np.float32)
        if key in ("normal", "interpolated_normal", "true_normal", "object_normal", "incoming"):
            return -self._direction.astype(np.float32)
        rows = 1 if key in ("cosine", "backfacing") else ATTRIBUTE_WIDTHS.get(key.partition(":")[0], 3)
        return np.full((rows, self._direction.shape[1]), key == "cosine", np.float32)

    def raycast(self, _position: Array, _direction: Array, length: Array, _only_local: bool) -> Array:
        """Nothing is hit: there is no scene yet."""
        return np.concatenate([np.zeros((2, 1)), np.atleast_2d(length)[:, :1], np.zeros((6, 1))])

    def gradient(self, value: Callable[[Any], Array], _on_facet: bool = False) -> Float32:
        """(3, n): none."""
        return np.zeros((3, self._direction.shape[1]), np.float32)


class Sky:
    """One world, its `backdrop` left aside. Its largest channel is no more than `limit`, nor, if it is not the
    same all around, than `threshold`.

    uniform  : it is the same all around.
    panorama : of one that is not, an equirectangular image; times `factor` (3, 1) and `limited` it is the radiance.
               An expression is worked out to one where it is first asked for.
    """

    def __init__(self, world: World, threshold: float = float("inf"), limit: float = float("inf")) -> None:
        self._threshold, self._limit = np.float32(threshold), np.float32(min(threshold, limit))
        self._rotation, self._environment = np.asarray(world.rotation, np.float64), world.environment
        self._expression = world.radiance if isinstance(world.radiance, Expression) else None
        self.factor = np.array((1, 1, 1) if self._expression else world.radiance, np.float32)[:, None]
        self.is_black = not self.factor.any()
        self.uniform = self.is_black or (self._expression is None and world.environment is None)
        if self.uniform:
            self.factor = no_brighter(self.factor, limit)

    @cached_property
    def panorama(self) -> Texture:
        """Of one that is not uniform."""
        if self._expression is not None:
            return _panorama(self._expression)
        assert self._environment is not None
        return self._environment

    def radiance(self, direction: Array) -> Float32:
        """(3, n) or (3, 1) from directions (3, n)."""
        if self.uniform:
            return self.factor
        if self._expression is not None:
            return self.limited(_worked_out(self._expression, direction))
        return self.limited(self.factor * sample_equirect(self.panorama, self.turned(direction)))

    def limited(self, radiance: Float32) -> Float32:
        """(3, n) as rays see it."""
        return no_brighter(radiance, self._limit)

    def turned(self, direction: Array) -> Array:
        """Directions (3, n) of the world as those of the panorama."""
        return direction if self._expression is not None else matrix_times(self._rotation, direction)

    @property
    def is_image(self) -> bool:
        """It is an image, neither a colour nor an expression."""
        return not self.uniform and self._expression is None

    @property
    def rotation(self) -> Float64:
        """(3, 3), see `turned`."""
        return self._rotation

    @property
    def limit(self) -> np.float32:
        """See the class."""
        return self._limit

    def rows(self, chosen: slice) -> Float32:
        """Some rows (h, w, 3 or 4) of the panorama with factor and limit in its colours."""
        seen = self._tinted(chosen)
        row, column = _brighter(seen, self._limit)
        if len(row):
            seen[row, column, :3] = no_brighter(seen[row, column, :3].T, self._limit).T
        return seen

    def _tinted(self, rows: slice) -> Float32:
        """The same without the limit. As rows of numbers: three at a time they take ten times as long."""
        pixels = texels_of(self.panorama.pixels).rgba(rows)
        factor = np.append(self.factor[:, 0], np.float32(1))[: pixels.shape[2]]
        tinted: Float32 = pixels.reshape(len(pixels), -1) * np.tile(factor, pixels.shape[1])
        return tinted.reshape(pixels.shape)

    def sums(self) -> Sums:
        """Over all directions of the world."""
        total, (height, width) = Sums.of_nothing(), self.panorama.pixels.shape[:2]
        longitude = -2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
        sine, cosine = elementary.sincos(longitude)
        around = np.stack([np.ones(width), cosine, sine])
        latitude = (np.arange(height) + 0.5) / height * np.pi - np.pi / 2
        share = np.diff(elementary.sin(np.linspace(-np.pi / 2, np.pi / 2, height + 1))) * (2 * np.pi / width)
        for start in range(0, height, ROW_CHUNK):
            rows = slice(start, start + ROW_CHUNK)
            kept = self._kept(self._tinted(rows), latitude[rows], longitude, share[rows], total)
            total.add(np.matmul(around, kept.astype(np.float64))[..., :3], latitude[rows], share[rows])
        if self._expression is None:
            total.toward, total.excess_toward = total.toward @ self._rotation, total.excess_toward @ self._rotation
        return total

    def _kept(self, full: Float32, latitude: Array, longitude: Array, share: Array, total: Sums) -> Float32:
        """Rows (h, w, 3 or 4), made no brighter than the threshold; what is over it goes to the sums."""
        row, column = _brighter(full, self._threshold)
        if len(row) == 0:
            return full
        bright = full[row, column, :3].T
        dimmed = no_brighter(bright, self._threshold)
        full[row, column, :3] = dimmed.T
        excess = (bright - dimmed).astype(np.float64)
        (level, flat), (sine, cosine) = elementary.sincos(latitude[row]), elementary.sincos(longitude[column])
        direction = np.stack([flat * cosine, flat * sine, level])
        total.add_excess(excess, direction, share[row])
        return full

    def sun(self, sums: Sums, like: WorldSun) -> SunLight | None:
        """What is over the threshold, as one light from the mean of its directions; None if nothing is."""
        toward = sums.excess_toward
        length = float(np.sqrt((toward * toward).sum()))
        if not sums.excess.any() or length == 0.0:
            return None
        x, y, z = (toward / length).tolist()
        red, green, blue = (sums.excess * like.strength).tolist()
        return SunLight("World", (x, y, z), (red, green, blue), like.angle, cast_shadow=like.cast_shadow)


def _brighter(image: Float32, limit: np.float32) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the texels of an image (h, w, 3 or 4) whose largest colour channel is over the limit."""
    if not np.isfinite(limit) or not np.max(image, initial=0) > limit:
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    # Not `max` over the last axis, which is short: five times slower.
    brightest = np.maximum(np.maximum(image[..., 0], image[..., 1]), image[..., 2])
    row, column = np.nonzero(brightest > limit)
    return row, column


@dataclass(eq=False)
class Sums:
    """Integrals over directions w: of the radiance L (rgb,), of L w (rgb, xyz), of what is over the threshold (rgb,),
    and of |that| w (xyz,)."""

    radiance: Float64
    toward: Float64
    excess: Float64
    excess_toward: Float64

    @classmethod
    def of_nothing(cls) -> Sums:
        """All 0."""
        return cls(np.zeros(3), np.zeros((3, 3)), np.zeros(3), np.zeros(3))

    def add(self, around: Float64, latitude: Float64, share: Float64) -> None:
        """Rows of a panorama: their sums over longitude of L, L cos, L sin (h, 3, rgb), and solid angles of texels."""
        flat = share * elementary.cos(latitude)
        self.radiance += share @ around[:, 0]
        self.toward += np.stack(
            [flat @ around[:, 1], flat @ around[:, 2], (share * elementary.sin(latitude)) @ around[:, 0]], 1
        )

    def add_excess(self, excess: Float64, direction: Float64, share: Float64) -> None:
        """n texels: what is over the threshold (3, n), directions (3, n), solid angles (n,)."""
        self.excess += excess @ share
        self.excess_toward += direction @ (np.sqrt((excess * excess).sum(axis=0)) * share)


def directions(height: int, width: int, start: int, stop: int) -> Float64:
    """(3, rows, width) of the middles of texels of an equirectangular image, from row `start` to before `stop`."""
    latitude = (np.arange(start, stop) + 0.5)[:, None] / height * np.pi - np.pi / 2
    longitude = -2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)[None]
    (level, flat), (sine, cosine) = elementary.sincos(latitude), elementary.sincos(longitude)
    return np.stack([flat * cosine, flat * sine, level + 0 * longitude])


def _worked_out(expression: Expression, direction: Array) -> Float32:
    value = np.nan_to_num(Evaluation(Directions(direction))(expression))
    return np.broadcast_to(np.maximum(value, 0), (3, direction.shape[1])).astype(np.float32)


def _panorama(expression: Expression) -> Texture:
    """An equirectangular image of an expression."""
    tall = [e.data.pixels.shape[0] for e in walk(expression) if isinstance(e.data, Texture)]
    height = min(max(PANORAMA_ROWS[0], *tall, 0), PANORAMA_ROWS[1])
    width, rows = 2 * height, max(1, TEXEL_CHUNK // (2 * height))
    pixels = np.ones((height, width, 4), np.float32)
    for start in range(0, height, rows):
        stop = min(start + rows, height)
        chunk = directions(height, width, start, stop).reshape(3, -1)
        pixels[start:stop, :, :3] = _worked_out(expression, chunk).T.reshape(stop - start, width, 3)
    return Texture("world", pixels)


def brightest(world: World) -> float:
    """The largest radiance of any channel in any direction, of the world or its backdrop."""
    skies = [Sky(w) for w in (world, world.backdrop) if w is not None]
    return max(float(np.max(sky.factor[:, 0] * image)) for sky in skies for image in _colors(sky))


def _colors(sky: Sky) -> Iterator[Float32]:
    """All of its panorama's, (rows, width, 3) at a time; of one that is uniform, white."""
    if sky.uniform:
        yield np.ones(3, np.float32)
        return
    for rows in texels_of(sky.panorama.pixels).bands():
        yield rows[..., :3]
