# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that leaves a body elsewhere than it fell on it: subsurface scattering, and closed bodies that are translucent.

A hit's diffuse light is then that of other places of the same body, which probe rays find:

- Scattering: places around the hit, as far off as Burley's diffusion profile has it (Burley 2015, Extending the Disney
  BRDF to a BSDF; Christensen and Burley 2015, Approximate Reflectance Profiles): at distance r the share
  (exp(-r / d) + exp(-r / 3 d)) / (8 pi d r), with d = l / s, s = 1.9 - A + 3.5 (A - 0.8)^2 for an albedo A, l = radius
  / 4 pi, as in EEVEE. The profile is a sum of two exponentials in r, so it is drawn exactly. Each channel has
  places of its own, so no colour noise comes from it.
- Translucent: what comes through the other walls of the body. Its inside is lit by nothing else, so a probe leaves
  inwards as dense as its cosine, and what it meets sends in the light that falls on it from outside.

Where a probe finds nothing of the body, the hit's own light counts: light is neither lost nor won.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ...procedural import elementary
from ...scene import Float32
from ..core.constants import LEAST_COSINE, MISS
from ..core.rays import traceable
from ..core.sampler import disk
from ..core.stats import Stats
from ..core.vectors import ALL, flatnonzero, largest_component, orthonormal_basis
from ..geometry.flatten import Geometry
from ..geometry.hits import Hits
from ..prepare.compiled import CompiledScene
from .interaction import Interaction, seen_at

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]

PROBE, CHOICE = np.uint32(0x2545F491), np.uint32(0x9E6C63D0)
"""Dimensions of the sampler: where probes go, and by which of the profile's exponentials."""
PROBE_HEIGHT = 1.0
"""Probes start so far above the tangent plane, in their distances from the hit, and end so far below it: they find what
rises or falls by up to 45 degrees."""


PROBE_TRIES = 4
"""Of probes that find nothing of their body, each half as far off as the last."""
FURTHEST = 16.0
"""Of the profile, in d: what lies beyond is 0.4 % of it."""
CHANNELS = 3
ALL_CHANNELS = CHANNELS
"""Stands for a channel where light of all of them comes from one place."""


def scatters(scene: CompiledScene, hit: Interaction) -> Numbers:
    """Which of the hits (n,) get light from elsewhere of their bodies."""
    table, draws = scene.surfaces, hit.draws
    if draws is None or scene.bodies is None:
        return np.zeros(0, np.intp)
    found = table.scatters.take(hit.surface) & (hit.value("scatter") > 0)
    return flatnonzero(found | _enclosed(scene.geometry, hit))


def _enclosed(geometry: Geometry, hit: Interaction) -> Bools:
    """(n,) hits on closed bodies that are translucent there."""
    if geometry.enclosed is None:
        return np.zeros(len(hit.prim), bool)
    return hit.table.translucent.take(hit.surface) & geometry.enclosed.take(geometry.object.take(hit.prim))


Light = Callable[[Interaction], Float32]


def gathered(scene: CompiledScene, hit: Interaction, light: Light, stats: Stats) -> tuple[Float32, Float32]:
    """Diffuse light (3, n) of hits that `scatters` has found, from elsewhere; and what share (3, n) their own has.

    light : what falls on other places, times their base colour.
    """
    probes = max(scene.settings.rough_samples, 1)
    inside = _enclosed(scene.geometry, hit)
    radiance, own = np.zeros_like(hit.outer), np.ones_like(hit.outer)
    for part in range(probes):
        probe = _around(hit, flatnonzero(~inside), part, probes).and_(_within(hit, flatnonzero(inside), part, probes))
        found, hits = _met(scene, hit, probe, stats)
        if len(found) == 0:
            continue
        met = probe.take(found)
        # What of the light there gets here: of one channel, or of all.
        through = met.channel == ALL_CHANNELS
        taken = np.where(through | (np.arange(CHANNELS)[:, None] == met.channel), hit.value("scatter", met.which), 0)
        taken[:, through] = 1
        weight = np.where(through, hit.value("base_color", met.which), taken).astype(np.float32)
        place = seen_at(scene.geometry, hit.take(met.which), hits, met.origin(1.0), met.direction)
        factor = place.values.factors.get("base_color", np.float32(1)) * weight * np.float32(1 / probes)
        values = replace(place.values, factors={**place.values.factors, "base_color": factor})
        there = light(replace(place, values=values))
        for block in range(CHANNELS):  # in each of them a hit comes once
            mine = flatnonzero((met.channel == block) | (through & (block == 0)))
            radiance[:, met.which[mine]] += there[:, mine]
            own[:, met.which[mine]] -= (taken[:, mine] * (1 / probes)).astype(np.float32)
    stats.add("subsurface", probes * len(hit.prim))
    return radiance, np.maximum(own, np.float32(0))


@dataclass(eq=False)
class _Probes:
    """Probe rays (m,): of which hits, for which channel, from where, (3, m), and how far (m,).

    aside : (3, m) from `start`, to where they begin.
    """

    which: Numbers
    channel: Numbers
    start: Float32
    aside: Float32
    direction: Float32
    reach: Float32

    def origin(self, share: Float32 | float) -> Float32:
        """(3, m), with a share of what they are aside."""
        return np.asarray(self.start + self.aside * share, np.float32)

    def and_(self, others: _Probes) -> _Probes:
        """These and others."""
        pairs = ((getattr(self, field.name), getattr(others, field.name)) for field in fields(self))
        return _Probes(*(np.concatenate(pair, axis=-1) for pair in pairs))

    def take(self, index: Numbers) -> _Probes:
        """Some of them."""
        return _Probes(*(getattr(self, field.name).take(index, axis=-1) for field in fields(self)))

    def nearer(self, index: Numbers) -> None:
        """Let some begin half as far aside, and reach half as far."""
        self.aside[:, index] *= np.float32(0.5)
        self.reach[index] *= np.float32(0.5)


def _around(hit: Interaction, index: Numbers, part: int, parts: int) -> _Probes:
    """From above the surface around the hits `index` down on it, for each channel."""
    assert hit.draws is not None
    draws = hit.draws.take(index)
    u, v = draws.square(PROBE, part, parts)
    wide = draws.square(CHOICE, part, parts)[0] >= np.float32(1 / 4)
    step = np.minimum(-elementary.log1p(-u) * np.where(wide, np.float32(3), np.float32(1)), np.float32(FURTHEST))
    radius = diffusion_length(hit.value("scatter_radius", index), hit.value("base_color", index)) * step
    n = hit.n_geometric[:, index]
    sin, cos = elementary.sincos(np.float32(2 * np.pi) * v)
    tangent, bitangent = orthonormal_basis(n)
    aside = tangent * cos + bitangent * sin + n * np.float32(PROBE_HEIGHT)
    start = hit.point[:, index].astype(np.float32)
    return _Probes(
        np.tile(index, CHANNELS),
        np.repeat(np.arange(CHANNELS), len(index)),
        np.tile(start, CHANNELS),
        np.concatenate([aside * radius[c] for c in range(CHANNELS)], axis=1).astype(np.float32),
        np.tile(-n, CHANNELS),
        (radius * np.float32(2 * PROBE_HEIGHT)).ravel(),
    )


def _within(hit: Interaction, index: Numbers, part: int, parts: int) -> _Probes:
    """From the hits `index` into the body, as dense as the cosine."""
    assert hit.draws is not None
    x, y = disk(*hit.draws.take(index).square(PROBE, part, parts))
    n = -hit.n_geometric[:, index]
    tangent, bitangent = orthonormal_basis(n)
    up = np.sqrt(np.maximum(1 - x * x - y * y, np.float32(LEAST_COSINE)))
    direction = (tangent * x + bitangent * y + n * up).astype(np.float32)
    channel, reach = np.full(len(index), ALL_CHANNELS), np.full(len(index), np.inf, np.float32)
    return _Probes(index, channel, hit.inner(index), np.zeros_like(direction), direction, reach)


def _met(scene: CompiledScene, hit: Interaction, probe: _Probes, stats: Stats) -> tuple[Numbers, Hits]:
    """Which of the probes (m,) find the body of their hit, from the right side, ascending, and what.

    Those around that find nothing are tried again nearer: on a body that is small for its radius, light from all of it
    gets to each place.
    """
    assert scene.bodies is not None
    body, of_hits = scene.geometry.object, hit.prim.take(probe.which)
    through = probe.channel == ALL_CHANNELS
    behind = through | ~hit.entering.take(probe.which)
    left, everything = np.arange(len(probe.which)), Hits.empty(len(probe.which), scene.geometry)
    everything.drop(ALL)
    for _ in range(PROBE_TRIES):
        origin, direction, reach = probe.origin(1.0)[:, left], probe.direction[:, left], probe.reach[left]
        sound = flatnonzero(traceable(origin, direction) & (reach > 0))
        left = left[sound]
        if len(left) == 0:
            break
        hits = scene.bodies.nearest(origin[:, sound], direction[:, sound], stats)
        there = (hits.prim != MISS) & (hits.t <= reach[sound]) & ((hits.toward > 0) == behind[left])
        there &= body.take(hits.prim, mode="wrap") == body.take(of_hits[left])
        found = flatnonzero(there)
        everything.store(left[found], hits.take(found))
        left = left[flatnonzero(~there & ~through[left])]
        probe.nearer(left)
    met = flatnonzero(everything.prim != MISS)
    return met, everything.take(met)


def diffusion_length(radius: Float32, color: Float32) -> Float32:
    """Burley's d (3, n), in metres, for a radius (3, n) of Blender's and the colour (3, n) of the surface."""
    albedo = color / np.maximum(largest_component(color), np.float32(LEAST_COSINE))
    shape = np.float32(1.9) - albedo + np.float32(3.5) * (albedo - np.float32(0.8)) ** 2
    return np.asarray(radius * np.float32(0.25 / np.pi) / shape, np.float32)
