# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that vary from place to place: what they are at points, and rays cut into steps in which they are constant.

EEVEE marches through all fog in steps, in each of which it is what it is at one place of it (eevee_volume_*). Here rays
are cut only where such a medium lies on their way: what a ray crosses of it, in `Fog.steps` parts of one length, each
taken in its middle. So nothing is random, and what follows knows constant media alone (`fog.FogPath`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ... import expressions as ex
from ...scene import Expression, Float32, Float64, FogBody, Medium, Texture, VoxelGrid
from ..core.vectors import Array
from ..materials.textures import sample_texture

EXTINCTION, SCATTERING, EMISSION, TURNED = slice(0, 3), slice(3, 6), slice(6, 9), 9
"""Rows of a medium's numbers; the last is its mean scattering times its anisotropy."""
ROWS = 10

MOST_ANISOTROPIC = 0.99
"""Of an anisotropy that varies: EEVEE's own limit. At 1 all light would go on in one direction, which no lamp is in."""


def numbers_of(medium: Medium) -> Float64:
    """(ROWS,) of a medium that is the same everywhere; 0 of one that varies."""
    return np.zeros(ROWS) if medium.varies else _rows(medium, ex.Evaluation(_Nowhere()), 1)[:, 0]


def _rows(medium: Medium, evaluate: ex.Evaluation, n: int) -> Float64:
    """(ROWS, n) of a medium at n points."""
    absorption, scattering, emission = (
        _colors(value, evaluate, n) for value in (medium.absorption, medium.scattering, medium.emission)
    )
    turned = medium.anisotropy
    if isinstance(turned, Expression):
        found = np.nan_to_num(evaluate(turned)[0].astype(np.float64))
        g = np.clip(found, -MOST_ANISOTROPIC, MOST_ANISOTROPIC)
    else:
        g = np.array(float(turned))
    rows = np.empty((ROWS, n))
    np.add(absorption, scattering, out=rows[EXTINCTION])
    rows[SCATTERING], rows[EMISSION] = scattering, emission
    np.multiply(scattering.mean(axis=0), g, out=rows[TURNED])
    return rows


def _colors(value: object, evaluate: ex.Evaluation, n: int) -> Float64:
    """(3, n), not negative; what is no number is 0."""
    if not isinstance(value, Expression):
        return np.broadcast_to(np.array(value, np.float64).reshape(3, 1), (3, n))
    found = np.nan_to_num(evaluate(value).astype(np.float64), posinf=ex.FINITE)
    return np.broadcast_to(np.maximum(found, 0.0), (3, n))


class VaryingMedia:
    """Those of a scene's media that vary, numbered; all points are relative to the scene's centre."""

    def __init__(self, media: list[tuple[Medium, FogBody | None]], center: Float64, steps: int) -> None:
        """media : each with the body that it fills; None: the world's.   center : (3,)   steps : see `scene.Fog`."""
        self._media, self._center, self.steps = media, np.asarray(center, np.float64)[:, None], max(steps, 1)

    def __len__(self) -> int:
        return len(self._media)

    def at(self, number: int, point: Float64, direction: Float64) -> Float64:
        """(ROWS, n) of one of them at points (3, n) on rays of these directions (3, n)."""
        medium, body = self._media[number]
        points = _Points(body, point + self._center, direction)
        return _rows(medium, ex.Evaluation(points), point.shape[1])

    def marched(
        self, start: Float64, length: Float64, filled: Float64, origin: Float32, direction: Array
    ) -> tuple[Float64, Float64, Float64]:
        """Stretches of rays (3, n) in which all media are constant: start, length (m, n) and numbers (ROWS, m, n).

        start, length : (k, n) of stretches one after the other, between surfaces.
        filled        : (ROWS + v, k, n), the numbers of the constant media, then how often each of v lies there.
        """
        own = np.where((filled[ROWS:] > 0.5).any(axis=0), length, 0.0)
        total = own.sum(axis=0)
        if not total.any():
            return start, length, filled[:ROWS]
        starts = self._cut(start, own, total)
        end = start[-1] + length[-1]
        lengths = np.maximum(np.diff(starts, axis=0, append=end[None]), 0.0)
        middle = starts + 0.5 * lengths
        place = np.zeros(starts.shape, np.intp)
        for begins in start[1:]:
            place += begins <= middle
        media = np.take_along_axis(filled, place[None], axis=1)
        for number in range(len(self)):
            step, ray = np.nonzero((media[ROWS + number] > 0.5) & (lengths > 0))
            along = direction[:, ray].astype(np.float64)
            point = origin[:, ray] + along * middle[step, ray]
            media[:ROWS, step, ray] += self.at(number, point, along) * media[ROWS + number, step, ray]
        return starts, lengths, media[:ROWS]

    def _cut(self, start: Float64, own: Float64, total: Float64) -> Float64:
        """(k + steps - 1, n): `start` and the ends of steps between, in order. own: (k, n) what each stretch has of
        the way `total` (n,) through media that vary."""
        before = np.cumsum(own, axis=0) - own
        way = np.arange(1, self.steps)[:, None] * (total / self.steps)
        cuts = np.broadcast_to(start[0], way.shape).copy()  # of rays that meet nothing of them: a step of no length
        for begins, first, here in zip(start, before, own, strict=True):
            inside = (way >= first) & (way <= first + here) & (here > 0)
            np.copyto(cuts, begins + (way - first), where=inside)
        return np.sort(np.concatenate([start, cuts]), axis=0)


class _Nowhere:
    """No points: a medium that is the same everywhere asks for nothing (expressions.Hits)."""

    def image(self, texture: Texture, uv: Array | None) -> Array:
        raise AssertionError(texture)

    def attribute(self, key: str) -> Array:
        raise AssertionError(key)

    def raycast(self, position: Array, direction: Array, length: Array, only_local: bool) -> Array:
        raise AssertionError(length)

    def gradient(self, value: Callable[[object], Array], on_facet: bool = False) -> Array:
        raise AssertionError(value)


class _Points:
    """n points within a medium (expressions.Hits): they know where they are, in the world and in their body.

    There is no surface: what nodes ask of one is 0, as are texture coordinates of its own.
    """

    def __init__(self, body: FogBody | None, point: Float64, direction: Float64) -> None:
        """point : (3, n) in the world.   direction : (3, n) of the rays."""
        self._body, self._point, self._direction = body, point, direction
        self._local = point if body is None else _affine(_inverse(body.matrix_world)[:3], point)

    def image(self, texture: Texture, uv: Array | None) -> Array:
        """RGBA (4, n)."""
        u, v = np.zeros((2, self._point.shape[1])) if uv is None else uv[:2]
        return sample_texture(texture, np.asarray(u), np.asarray(v))

    def attribute(self, key: str) -> Array:
        """(width, n) float32."""
        kind, _, name = key.partition(":")
        n = self._point.shape[1]
        if key == "position":
            found = self._point
        elif key == "object":
            found = self._local
        elif key == "generated" and self._body is not None:  # EEVEE knows none of a world's
            found = _affine(self._body.to_generated, self._local)
        elif key == "incoming":
            found = -self._direction
        elif key == ex.RAY + "Is Camera Ray":  # EEVEE fills space with fog once, for its camera
            found = np.ones((1, n))
        elif key.startswith(ex.INSTANCE):
            found = self._of_instance(key.removeprefix(ex.INSTANCE))
        elif kind == ex.VOLUME and self._body is not None and name in self._body.grids:
            return sample_voxels(self._body.grids[name], self._local)
        else:
            found = np.zeros((ex.ATTRIBUTE_WIDTHS.get(kind, 1 if key.startswith(ex.RAY) else 3), n))
        return found.astype(np.float32)

    def raycast(self, position: Array, direction: Array, length: Array, only_local: bool) -> Array:
        """(9, n) of rays that hit nothing: EEVEE casts them from surfaces alone, by its depth buffer."""
        n = self._point.shape[1]
        result = np.zeros((9, n), np.float32)
        result[2] = np.broadcast_to(length[0], n)
        return result

    def gradient(self, value: Callable[[object], Array], on_facet: bool = False) -> Array:
        """(3, n) zeros: there is no surface along which anything grows."""
        return np.zeros((3, self._point.shape[1]), np.float32)

    def _of_instance(self, key: str) -> Float64:
        matrix = np.eye(4) if self._body is None else np.asarray(self._body.matrix_world, np.float64)
        if key in ("OBJECT_TO_WORLD", "WORLD_TO_OBJECT"):
            rows = (matrix if key == "OBJECT_TO_WORLD" else _inverse(matrix))[:3].reshape(12)
        else:
            rows = np.array(() if self._body is None else self._body.values.get(key, ()), np.float64)
            rows = rows if len(rows) else np.zeros(4)
        return np.repeat(rows[:, None], self._point.shape[1], axis=1)


def sample_voxels(grid: VoxelGrid, local: Float64) -> Float32:
    """(width, n) float32 of a grid at local positions (3, n), linear between the middles of its voxels."""
    size = np.array(grid.values.shape[:3])
    at = _affine(grid.from_local, local) * size[:, None] - 0.5
    at = np.clip(np.nan_to_num(at), 0.0, (size - 1)[:, None])
    low = np.minimum(at.astype(np.intp), np.maximum(size - 2, 0)[:, None])
    part = (at - low).astype(np.float32)
    step = np.where(size > 1, 1, 0) * np.array([size[1] * size[2], size[2], 1])
    first = (low[0] * size[1] + low[1]) * size[2] + low[2]
    values = grid.values.reshape(-1, grid.values.shape[3])
    found = np.zeros((values.shape[1], local.shape[1]), np.float32)
    for corner in range(8):
        high = [bool(corner >> axis & 1) for axis in range(3)]
        weight = np.prod([part[axis] if high[axis] else 1 - part[axis] for axis in range(3)], axis=0)
        index = first + sum(int(step[axis]) for axis in range(3) if high[axis])
        found += values.take(index, axis=0).T * weight
    return found


def _affine(matrix: Float64, points: Float64) -> Float64:
    """(3, n) of points (3, n) by a matrix (3, 4)."""
    return np.asarray(matrix[:, :3] @ points + matrix[:, 3:])


def _inverse(matrix: Float64) -> Float64:
    """(4, 4); a body without thickness has no inside (see `fog`), so this is not asked for one that has no inverse."""
    return np.asarray(np.linalg.inv(np.asarray(matrix, np.float64)))
