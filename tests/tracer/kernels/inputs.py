# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments that each kernel is compared on: by the numpy function's name, made of random numbers and stiff ones.

A new kernel needs one function here: it takes a `Source` and gives the arguments.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from hybrid_addon.tracer.geometry.embree import OwnScene

STIFF = (0.0, -0.0, 1.0, -1.0, 0.5, np.inf, -np.inf, np.nan, 1e-45, -1e-40, 1e-38, 1e38, -1e38, 3e-4, 1 - 2.0**-24)
"""Zeros of both signs, infinities, NaN, denormals, numbers whose squares are too large or too small, an ulp below 1."""


@dataclass
class Source:
    """Of n columns each. stiff: the share of stiff numbers among the random ones."""

    rng: np.random.Generator
    n: int
    stiff: float = 0.0

    def numbers(self, *shape: int, dtype: Any = np.float32, low: float = -3, high: float = 3) -> np.ndarray:
        """(*shape, n) random ones."""
        a = self.rng.uniform(low, high, (*shape, self.n)).astype(dtype)
        chosen = self.rng.random(a.shape) < self.stiff
        with np.errstate(over="ignore"):
            a[chosen] = self.rng.choice(STIFF, np.count_nonzero(chosen)).astype(dtype)
        return a

    def units(self, dtype: Any = np.float32) -> np.ndarray:
        """(3, n) unit vectors, of which some lie along an axis."""
        a = self.rng.normal(size=(3, self.n))
        along = self.rng.random(self.n) < self.stiff
        a[:, along] = np.eye(3)[:, self.rng.integers(0, 3, np.count_nonzero(along))]
        return (a / np.sqrt((a * a).sum(0))).astype(dtype)

    def whole(self, low: int, high: int, *shape: int, dtype: Any = np.int64) -> np.ndarray:
        """(*shape, n) random integers of low .. high - 1."""
        return self.rng.integers(low, high, (*shape, self.n)).astype(dtype)

    def of(self, n: int) -> Source:
        """The same for another number of columns."""
        return Source(self.rng, n, self.stiff)

    def bools(self, share: float = 0.5) -> np.ndarray:
        """(n,) of which that share is True."""
        return self.rng.random(self.n) < share


Arguments = Callable[[Source], tuple[Any, ...]]
INPUTS: dict[str, Arguments] = {}


def arguments_of(name: str) -> Callable[[Arguments], Arguments]:
    """Note a function that makes arguments of the marked function `name`."""

    def note(function: Arguments) -> Arguments:
        INPUTS[name] = function
        return function

    return note


MEANINGLESS: dict[str, Callable[..., dict[int, np.ndarray]]] = {}
"""Functions of whose results some columns mean nothing -> of the arguments: number of a result -> which, (n,) bool."""

PRIMITIVES, SAMPLES = 40, 30


@arguments_of("tracer.geometry.aggregate.refine")
def _(s: Source) -> tuple[Any, ...]:
    facets = s.of(4).numbers(PRIMITIVES, dtype=np.float64)
    return facets, s.whole(-1, PRIMITIVES, dtype=np.int32), s.numbers(3), s.units()


MEANINGLESS["tracer.geometry.aggregate.refine"] = lambda facets, prim, *_: {1: prim < 0, 2: prim < 0}


@arguments_of("tracer.geometry.aggregate.barycentric_weights")
def _(s: Source) -> tuple[Any, ...]:
    planes = s.of(4).numbers(2 * PRIMITIVES, dtype=np.float64)
    kind = np.int32 if s.n % 2 else np.int64
    return planes, s.whole(-1, PRIMITIVES + 3, dtype=kind), s.numbers(3, dtype=np.float64)


def _no_triangle(planes: np.ndarray, prim: np.ndarray, *_: Any) -> dict[int, np.ndarray]:
    return {0: (prim < 0) | (prim >= PRIMITIVES)}


MEANINGLESS["tracer.geometry.aggregate.barycentric_weights"] = _no_triangle


@arguments_of("tracer.core.vectors.dot")
def _(s: Source) -> tuple[Any, ...]:
    first, second = s.rng.choice([np.float32, np.float64], 2)
    return s.numbers(3, dtype=first), s.numbers(3, dtype=second)


@arguments_of("tracer.core.vectors.largest_component")
def _(s: Source) -> tuple[Any, ...]:
    return (s.numbers(3),)


@arguments_of("tracer.core.vectors.normalize")
def _(s: Source) -> tuple[Any, ...]:
    return (s.numbers(3, dtype=s.rng.choice([np.float32, np.float64])),)


@arguments_of("tracer.core.vectors.orthonormal_basis")
def _(s: Source) -> tuple[Any, ...]:
    return (s.units(s.rng.choice([np.float32, np.float64])),)


@arguments_of("tracer.core.rays.traceable")
def _(s: Source) -> tuple[Any, ...]:
    return s.numbers(3), s.numbers(3)


@arguments_of("tracer.core.rays.offset_origin")
def _(s: Source) -> tuple[Any, ...]:
    return s.numbers(3, dtype=np.float64), s.units(), s.numbers()


@arguments_of("tracer.shading.interaction.hit_points")
def _(s: Source) -> tuple[Any, ...]:
    tables = s.of(PRIMITIVES).whole(0, 9), s.of(PRIMITIVES).numbers(low=0)
    hits = s.whole(0, PRIMITIVES, dtype=np.int32), s.numbers(dtype=np.float64, low=0), s.units(), s.numbers(dtype=float)
    return *tables, *hits, s.numbers(3), s.units()


@arguments_of("tracer.shading.interaction.smooth_normals")
def _(s: Source) -> tuple[Any, ...]:
    share = s.rng.choice([0.0, 0.3, 0.8, 1.0])
    tables = s.of(PRIMITIVES).bools(share), s.of(9).numbers(PRIMITIVES), s.of(8).numbers(PRIMITIVES, dtype=float)
    prim = s.whole(0, PRIMITIVES)
    return *tables, prim, s.numbers(3, dtype=float), s.units(), s.bools()


def _flat(smooth: np.ndarray, normals: np.ndarray, planes: np.ndarray, prim: np.ndarray, *_: Any) -> dict:
    return {2: ~smooth[prim]}


MEANINGLESS["tracer.shading.interaction.smooth_normals"] = _flat


@arguments_of("procedural.fresnel.fresnel_dielectric")
def _(s: Source) -> tuple[Any, ...]:
    kind = s.rng.choice([np.float32, np.float64])
    return s.numbers(low=-0.1, high=1.1, dtype=kind), s.numbers(low=0.3, dtype=kind)


@arguments_of("tracer.shading.scattering.shares")
def _(s: Source) -> tuple[Any, ...]:
    colors = [s.numbers(3, low=0, high=1) for _ in range(4)]
    return *colors, s.numbers(low=0, high=1), s.numbers(low=0, high=1.1), s.bools()


@arguments_of("tracer.shading.scattering.mirror_directions")
def _(s: Source) -> tuple[Any, ...]:
    n = s.units()
    facing = n if s.rng.random() < 0.2 else s.units()
    return s.units(), n, facing, bool(s.rng.random() < 0.8)


@arguments_of("tracer.shading.scattering.refracted_directions")
def _(s: Source) -> tuple[Any, ...]:
    cosine, eta = s.numbers(low=0, high=1, dtype=float), s.numbers(low=0.4, dtype=float)
    return s.units(), s.units(), s.units(), cosine, eta, bool(s.rng.random() < 0.8)


@arguments_of("tracer.film.samples.add_at")
def _(s: Source) -> tuple[Any, ...]:
    rows = int(s.rng.integers(1, 4))
    return s.of(SAMPLES).numbers(rows, dtype=float), s.whole(0, SAMPLES), s.numbers(rows)


def _budgets(s: Source) -> tuple[np.ndarray, ...]:
    """Generations, what is released after each, and what is spent, of each sample."""
    each = s.of(SAMPLES)
    return (
        each.whole(0, 6, dtype=np.int16),
        np.cumsum(s.of(5).whole(0, 1 << 33)),
        each.whole(0, 1 << 34),
    )


@arguments_of("tracer.film.error_budget.candidates")
def _(s: Source) -> tuple[Any, ...]:
    weight = np.abs(s.numbers(low=0, high=0.02))
    return s.whole(0, SAMPLES), weight, *_budgets(s), np.array([0.01], np.float32)


@arguments_of("tracer.film.error_budget.lightest")
def _(s: Source) -> tuple[Any, ...]:
    key = s.whole(0, SAMPLES) << 40 | s.whole(1, 1 << s.rng.integers(1, 34))
    generation, released, spent = _budgets(s)
    spent = np.minimum(spent, released[0])
    return key, np.sort(key), generation, released, spent, np.zeros(SAMPLES, np.int64)


@arguments_of("tracer.film.samples.follow_all")
def _(s: Source) -> tuple[Any, ...]:
    weight = np.where(s.bools(), s.numbers(low=0), np.float32(0))
    most, most_rays = int(s.rng.choice([2, 1000])), int(s.rng.choice([0, 200, 1 << 16]))
    followed = s.of(SAMPLES).whole(0, 100)
    return s.whole(0, SAMPLES), weight, followed, np.zeros(SAMPLES, np.int64), most, most_rays, 8


@arguments_of("tracer.film.pixels.give")
def _(s: Source) -> tuple[Any, ...]:
    count, layers, rows = int(s.rng.integers(1, 6)), int(s.rng.integers(1, 4)), int(s.rng.integers(5, 9))
    pixels = np.sort(s.rng.choice(s.n + 9, s.n, replace=False)) if s.rng.random() < 0.5 else np.arange(2, s.n + 2)
    weights = s.of(count).whole(0, 3, layers).astype(np.float32) / 2
    values = s.of(s.n * count).numbers(rows)
    return s.of(s.n + 9).numbers(layers, rows), pixels, values, weights, int(s.rng.choice([0, 0, 1, 2, 9]))


@cache
def embree_scene() -> OwnScene:
    """Slivers and grains of very different sizes, on and off a ball."""
    rng = np.random.default_rng(3)
    middle = rng.normal(size=(400, 1, 3)) * np.exp(rng.normal(size=(400, 1, 1)))
    corners = middle + rng.normal(size=(400, 3, 3)) * np.exp(2 * rng.normal(size=(400, 3, 1)) - 1)
    return OwnScene(corners.reshape(-1, 3).astype(np.float32), np.arange(1200, dtype=np.int32).reshape(-1, 3))


def _rays(s: Source) -> tuple[np.ndarray, np.ndarray]:
    """Of which some meet a corner, some start in a plane; Embree is not sent what is no number."""
    vertices, _ = embree_scene()._triangles
    origin, direction = Source(s.rng, s.n).numbers(3), s.units()
    ends = vertices[s.whole(0, len(vertices))].T
    origin = np.where(s.bools(s.stiff / 3), ends, origin)
    to = ends - origin
    length = np.sqrt((to * to).sum(0))
    meets = s.bools(s.stiff) & (length > 0)
    return origin, np.where(meets, to / np.where(meets, length, 1), direction).astype(np.float32)


@arguments_of("tracer.geometry.embree.nearest_of")
def _(s: Source) -> tuple[Any, ...]:
    return embree_scene().address, *_rays(s), np.zeros((3, s.n), np.int32)


@arguments_of("tracer.geometry.embree.occluded_of")
def _(s: Source) -> tuple[Any, ...]:
    t_max = s.numbers(low=0, high=9)
    t_max[~(t_max > 0)] = np.inf
    return embree_scene().address, *_rays(s), t_max, np.zeros(s.n, bool)
