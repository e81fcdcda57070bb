# SPDX-License-Identifier: GPL-3.0-or-later
"""Voronoi Texture: octaves of cellular noise, and the node's outputs. Source: gpu_shader_material_fractal_voronoi."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .hashes import Array
from .noise import points
from .voronoi import Kind, Octave, distance_to_edge, f1, f2, n_sphere_radius, smooth_f1

MAX_DETAIL = 15.0
FAR = 8.0  # what the distance to an edge starts from, before the first octave
DISTANCE, COLOR, POSITION, W, RADIUS = (0, 1), (1, 4), (4, 7), (7, 8), (8, 9)
"""Rows of the outputs in what `voronoi_rows` gives."""


@dataclass(frozen=True, eq=False)
class Fractal:
    """detail, roughness, lacunarity (1 or n,); furthest: the largest distance of one octave, to normalize by."""

    detail: Array
    roughness: Array
    lacunarity: Array
    furthest: Array
    normalize: bool

    @property
    def single(self) -> Array:
        """Where there is only one octave."""
        result: Array = (self.detail == 0) | (self.roughness == 0) | (self.lacunarity == 0)
        return result

    @property
    def count(self) -> int:
        """Octaves to work out."""
        return 1 if self.single.all() else int(np.ceil(self.detail.max())) + 1

    def share(self, octave: int) -> Array:
        """(1 or n,) how much of that octave counts: 1, the rest of a detail that is not whole, or 0."""
        rest = self.detail - np.floor(self.detail)
        share = np.where(octave <= self.detail, 1, np.where(octave <= np.ceil(self.detail), rest, 0))
        return np.asarray(np.where(self.single, octave == 0, share), np.float32)


def voronoi_rows(*inputs: Any) -> Array:
    """(9, n): distance, colour, position, W and radius, those that the feature has. See DISTANCE, COLOR, ...

    Inputs: vector, w, scale, detail, roughness, lacunarity, smoothness, exponent, randomness;
    data: (dimensions, feature, metric, normalize, hash); see `voronoi.Kind`.
    """
    vector, w, scale, detail, roughness, lacunarity, smoothness, exponent, randomness = (
        np.asarray(a, np.float32) for a in inputs[:-1]
    )
    dimensions, feature, metric, normalize, hashed = inputs[-1]
    kind = Kind(metric, exponent[0], np.clip(randomness[0], 0, 1), np.clip(smoothness[0] / 2, 0, 0.5), hashed)
    p = points(vector, w, dimensions) * scale
    p = np.broadcast_to(p, (dimensions, max(a.shape[1] for a in (p, detail, roughness, lacunarity, randomness))))
    reach = 0.5 + 0.5 * kind.randomness
    corner = np.broadcast_to(reach, (dimensions, reach.shape[-1]))
    furthest = reach if feature == "DISTANCE_TO_EDGE" else kind.distance(np.zeros_like(corner), corner)
    furthest = furthest * 2 if feature == "F2" else furthest
    details = np.clip(np.nan_to_num(detail[0]), 0, MAX_DETAIL)
    fractal = Fractal(details, np.clip(roughness[0], 0, 1), lacunarity[0], furthest, normalize)
    result = np.zeros((9, p.shape[1]), np.float32)
    if feature == "N_SPHERE_RADIUS":
        result[slice(*RADIUS)] = n_sphere_radius(p, kind)
    elif feature == "DISTANCE_TO_EDGE":
        result[slice(*DISTANCE)] = _edges(p, kind, fractal)
    else:
        octave = _octaves(p, kind, fractal, feature)
        result[slice(*DISTANCE)], result[slice(*COLOR)] = octave.distance, octave.color
        position = np.where(scale != 0, octave.position / np.where(scale != 0, scale, 1), 0)
        first = POSITION[0] if dimensions > 1 else W[0]
        result[first : first + dimensions] = position
    return result


def _octave(p: Array, kind: Kind, feature: str) -> Octave:
    if feature == "F2":
        return f2(p, kind)
    if feature == "SMOOTH_F1" and kind.smoothness.any():
        return smooth_f1(p, kind)
    return f1(p, kind)


def _octaves(p: Array, kind: Kind, fractal: Fractal, feature: str) -> Octave:
    amplitude: Array = np.ones(1, np.float32)
    total, scale = np.zeros_like(amplitude), np.ones_like(amplitude)
    distance: Array = np.zeros(1, np.float32)
    color: Array = np.zeros((3, 1), np.float32)
    position = np.zeros_like(p)
    for i in range(fractal.count):
        share, octave = fractal.share(i), _octave(p * scale, kind, feature)
        total = total + share * amplitude
        distance = distance + share * amplitude * octave.distance
        color = color + share * amplitude * octave.color
        position = position + share * amplitude * (octave.position / scale - position)
        scale, amplitude = scale * fractal.lacunarity, amplitude * fractal.roughness
    if fractal.normalize:
        distance, color = distance / (total * fractal.furthest), color / total
    return Octave(np.asarray(distance), np.asarray(color), np.asarray(position))


def _edges(p: Array, kind: Kind, fractal: Fractal) -> Array:
    """As the octaves of `_octaves`, but the nearest edge of all."""
    amplitude: Array = np.ones(1, np.float32)
    scale = np.ones_like(amplitude)
    furthest, distance = fractal.furthest, np.full_like(fractal.furthest, FAR)
    for i in range(fractal.count):
        share, here = fractal.share(i), distance_to_edge(p * scale, kind) / scale
        distance = distance + share * amplitude * (np.minimum(distance, here) - distance)
        furthest = furthest + share * amplitude * (fractal.furthest / scale - furthest)
        scale, amplitude = scale * fractal.lacunarity, amplitude * fractal.roughness
    return np.asarray(distance / furthest if fractal.normalize else distance)
