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


MEANINGLESS: dict[str, Callable[..., np.ndarray]] = {}
"""Of which functions some columns of the results mean nothing -> which ones, (n,) bool, of the arguments."""

PRIMITIVES = 40


@arguments_of("tracer.geometry.aggregate.refine")
def _(s: Source) -> tuple[Any, ...]:
    facets = Source(s.rng, 4, s.stiff).numbers(PRIMITIVES, dtype=np.float64)
    return facets, s.whole(-1, PRIMITIVES, dtype=np.int32), s.numbers(3), s.units()


MEANINGLESS["tracer.geometry.aggregate.refine"] = lambda facets, prim, origin, direction: prim < 0


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
