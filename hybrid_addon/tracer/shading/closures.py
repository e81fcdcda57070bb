# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums: one hit for each closure that answers a ray.

A surface is a sum of weighted closures (`scene.Closure`). A hit on several becomes as many hits of the same place, each
with the throughput of its ray times its closure's weight: whatever follows knows single closures only. Where they are
many, the heaviest are kept and some of the others drawn, which stand for the rest (see `branch_selection`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Expression, Float32, Float64
from ..core.constants import MOST_CLOSURES, MOST_FIRST_CLOSURES
from ..core.rays import Rays, RayState
from ..core.sampler import Draws, hash32
from ..core.vectors import flatnonzero, largest_component
from ..film.branch_selection import draw
from ..film.error_budget import budget_units
from ..geometry.flatten import Geometry
from ..materials.columns import HitValues
from ..materials.dispersion import spectral_ior
from ..materials.enclosure import wall_shares
from ..materials.fields import fields_of, limited
from ..materials.surfaces import SurfaceTable
from ..prepare.compiled import CompiledScene
from .evaluate import hit_groups, resolve
from .interaction import Interaction
from .programs import answers_at, weighted, without

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]
UInt32 = NDArray[np.uint32]

CLOSURE, SPECTRUM = np.uint32(0x6A09E667), np.uint32(0x3C6EF372)
"""Dimensions of the sampler that closures are drawn in, where they are too many, and wavelengths."""
LEAST_CHANCE = 1e-6
"""Random numbers keep so far from 0 and 1: what is drawn with them stays finite."""


@dataclass(frozen=True, eq=False)
class ClosureHits:
    """Hits (m,) of single closures, with all that new rays and light ask.

    rays, at, t : the rays carry the weights of the closures; t (m,) float64 along them.
    owner       : (m,) intp ascending, which of the hits each stands at; None: each at its own.
    weight      : (3, m) float32, of the closures; None: all are 1.
    left_out    : samples (k,) and weights (k,) of closures that others stand for; None: all are there.
    """

    rays: Rays
    at: Interaction
    t: Float64
    owner: Numbers | None = None
    weight: Float32 | None = None
    left_out: tuple[Numbers, Float32] | None = None


def closures_at(
    scene: CompiledScene, rays: Rays, at: Interaction, t: Float64, most: int = 0, chance: Float64 | None = None,
    wavelength: Float64 | None = None,
) -> ClosureHits:  # fmt: skip
    """One hit for each closure that answers rays (n,) at their hits, at distances t (n,).

    most : closures for each hit; 0: MOST_FIRST_CLOSURES for camera rays, MOST_CLOSURES for all others.
    chance, wavelength : (n,) random numbers between 0 and 1 that they, and their wavelengths where they disperse, are
    drawn by; None: those of the hits, and of their samples.
    """
    table = at.table
    if not table.closure_count.take(at.surface).any():
        let_in = _let_in(scene.geometry, at, t)
        return ClosureHits(rays, resolve(scene.geometry, at if let_in is None else replace(at, let_in=let_in), t), t)
    # Each closure, and its weight here.
    owner, row, part = table.closures_of(at.surface)
    way = at.face, at.surface, at.point, at.entering, at.n_shading, at.wo, t, at.came
    weight = closure_weights(scene.geometry, table, *way, owner, row, part)
    let_in = _let_in(scene.geometry, at, t, (owner, row, weight))
    if len(rays.closure):
        weight = _as_entered(table, rays, at, owner, row, weight)
    answers = answers_at(scene, at, t, rays.depth)
    if answers is not None:
        at, weight = replace(at, answers=answers), weighted(answers, table, at, owner, part, weight)
    # Those that bring something; of too many, those that are drawn.
    brings = flatnonzero((weight * rays.throughput[:, owner] > 0).any(axis=0))
    owner, row, part, weight = owner[brings], row[brings], part[brings], weight[:, brings]
    left_out = None
    factor = _drawn(rays, at, owner, weight, most, chance)
    if factor is not None:
        gone, kept = flatnonzero(factor == 0), flatnonzero(factor)
        left_out = rays.sample[owner[gone]], largest_component(weight[:, gone] * rays.throughput[:, owner[gone]])
        weight = (weight[:, kept] * factor[kept]).astype(np.float32)
        owner, row, part = owner[kept], row[kept], part[kept]
    # One hit for each.
    rays_of = rays.take(owner)
    rays_of = replace(rays_of, throughput=rays_of.throughput * weight, path=closure_path(rays_of.path, part))
    of = replace(at, let_in=let_in).take(owner)
    of = replace(of, surface=row, values=HitValues(table.columns, row), share=_shares(owner, weight))
    of = resolve(scene.geometry, of if answers is None else without(of, part), t[owner])
    if table.disperses:
        of = _dispersed(of, None if wavelength is None else wavelength[owner])
    return ClosureHits(rays_of, of, t[owner], owner, weight, left_out)


def _let_in(
    geometry: Geometry, at: Interaction, t: Float64, closures: tuple[Numbers, Numbers, Float32] | None = None
) -> Float32 | None:
    """(3, n) of the world's light, what gets to hits (n,) on insides of closed bodies, as if all of the body were as it
    is there (see `enclosure`). None: all of it, everywhere.

    closures : which of the hits each closure is at, its column, and its weight (3, m); None: each hit's own surface.
    """
    if geometry.enclosed is None:
        return None
    inside = geometry.enclosed.take(geometry.object.take(at.prim)) & ~at.entering & at.table.admits.take(at.surface)
    if not inside.any():
        return None
    alone = np.arange(len(inside)), at.surface, np.ones((3, len(inside)), np.float32)
    owner, row, weight = alone if closures is None else closures
    own = flatnonzero(inside[owner])
    owner, row, weight = owner[own], row[own], weight[:, own]
    place = at.take(owner)
    way = place.face, row, place.point, place.entering, place.n_shading, place.wo, t[owner], place.came
    groups = {one.number: one.evaluate for one in hit_groups(geometry, at.table, *way)}
    passed, lost, total = np.zeros((3, *at.wo.shape))
    for number in np.unique(row).tolist():  # each has a column of its own: no hit comes twice
        some = flatnonzero(row == number)
        shares = wall_shares(fields_of(at.table.surfaces[number], groups.get(number), at.table.known[0][number]))
        passed[:, owner[some]] += weight[:, some] * shares[0]
        lost[:, owner[some]] += weight[:, some] * shares[1]
        total[:, owner[some]] += weight[:, some]
    lost = np.maximum(lost + 1 - total, 0)  # what no closure answers is black, and a sum above 1 glows
    return np.where(passed > 0, passed / np.where(passed > 0, passed + lost, 1), 1).astype(np.float32)


def _drawn(
    rays: Rays, at: Interaction, owner: Numbers, weight: Float32, most: int, chance: Float64 | None
) -> Float64 | None:
    """By what closures (m,) of weights (3, m) at hits `owner` are to be multiplied: 0 for those that are not drawn.

    None: no hit has too many. most, chance: see `closures_at`.
    """
    first = (rays.depth == 0) & (rays.straight == 0)
    limit = np.full(len(rays), most) if most else np.where(first, MOST_FIRST_CLOSURES, MOST_CLOSURES)
    crowded = flatnonzero((np.bincount(owner, minlength=len(rays)) > limit)[owner])
    if len(crowded) == 0:
        return None
    if chance is None:
        chance = np.full(len(rays), 0.5) if at.draws is None else at.draws.square(CLOSURE)[0].astype(np.float64)
    some = owner[crowded]
    chances = np.clip(chance[some], LEAST_CHANCE, 1 - LEAST_CHANCE)
    factor = np.ones(len(owner))
    factor[crowded] = draw(some, budget_units(largest_component(weight[:, crowded])), limit[some], chances)
    return factor


def _dispersed(at: Interaction, chance: Float64 | None) -> Interaction:
    """The hits with the IORs of the wavelengths of their samples, by their random numbers (n,); None: of their own."""
    band = at.table.band.take(at.surface)
    split = flatnonzero(band >= 0)
    if len(split) == 0:
        return at
    if chance is None:
        draws = at.draws
        chance = np.full(len(band), 0.5)
        if draws is not None:  # of the sample, whatever its way
            chance = (
                Draws(draws.sampler, draws.sample, np.zeros_like(draws.path)).square(SPECTRUM)[0].astype(np.float64)
            )
    ior = at.ior.copy()
    dispersion = at.table.dispersion.take(at.surface[split])
    ior[split] = spectral_ior(ior[split], dispersion, band[split], chance[split])
    return replace(at, values=replace(at.values, ior=ior))


def closure_path(path: UInt32, part: Numbers) -> UInt32:
    """Paths (rows, n) of the hits on closures `part` (n,), or (1,) for all, of the surfaces that rays met."""
    return np.where(part > 0, hash32(path ^ hash32(part.astype(np.uint32))), path) if len(path) else path


def _shares(owner: Numbers, weight: Float32) -> Float32:
    """(m,) of the weights (3, m) of all closures at one hit, each's."""
    heaviest = largest_component(weight).astype(np.float64)
    total = np.bincount(owner, heaviest)[owner]
    return np.asarray(heaviest / total, np.float32)


def _as_entered(
    table: SurfaceTable, rays: Rays, at: Interaction, owner: Numbers, row: Numbers, weight: Float32
) -> Float32:
    """The weights (3, m), where rays leave a solid of several glasses by the one by which they have entered it.

    So a solid that is half of one glass and half of another looks like the mean of both, as EEVEE draws it, and not
    like a solid that is of one glass in front and of the other behind. That one passes as much as all would.
    """
    entered = rays.closure[0].take(owner)
    known = (
        (entered >= 0) & ~at.entering.take(owner) & (table.owner.take(entered, mode="wrap") == at.surface.take(owner))
    )
    bends = flatnonzero(known & table.refracts.take(row))
    total = np.zeros((3, len(rays)), np.float32)
    np.add.at(total, (slice(None), owner[bends]), weight[:, bends] * table.tint[:, row[bends]])
    mine = bends[row[bends] == entered[bends]]
    tint = table.tint[:, row[mine]]
    result = weight.copy()
    result[:, bends] = 0
    result[:, mine] = np.where(tint > 0, total[:, owner[mine]] / np.where(tint > 0, tint, 1), 0)
    return result


def closure_weights(
    geometry: Geometry, table: SurfaceTable, prim: Numbers, surface: Numbers, point: Float64, entering: Bools,
    normal: Float32, wo: Float32, distance: Float64, came: RayState | None, owner: Numbers, row: Numbers, part: Numbers,
) -> Float32:  # fmt: skip
    """(3, m) float32, >= 0, of the closures `row` (m,), the `part`-th (m,) of the surfaces at places `owner` (m,).

    prim, surface, point, entering, normal, wo, distance, came : of the n places, as in `Interaction`.
    """
    weight: Float32 = table.closure_weight.take(row, axis=1)
    for one in hit_groups(geometry, table, prim, surface, point, entering, normal, wo, distance, came):
        for number, closure in enumerate(one.surface.closures):
            if isinstance(closure.weight, Expression):
                values = np.zeros((3, len(prim)), np.float32)
                values[:, one.hits] = limited("weight", one.evaluate(closure.weight))
                place = flatnonzero((surface[owner] == one.number) & (part == number))
                weight[:, place] = values[:, owner[place]]
    return weight
