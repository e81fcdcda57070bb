# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces of solids that cross, or nearly touch: what a ray passes there besides the surface that Embree named.

A new ray starts ORIGIN_OFFSET off the surface that was hit. What lies nearer behind that surface it never meets, and of
two surfaces within Embree's rounding either is named. Where two solids cross, that is a band along the curve where they
do: narrow where they cross steeply, and all of a face where they are tilted by a millionth. So pairs of triangles that
come so near are found beforehand. Where a ray hits one of a pair, its way is worked out in float64: from its origin to
the hit, and on to the new ray's origin, which is moved on until it is clear of all others. Every surface passed is a
medium entered or left; the light is bent once, from the first medium to the last.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Float64
from ..core.constants import CLEAR_OF, NEAR, ORIGIN_OFFSET, PUSHES
from ..core.rays import Rays, offset_origin
from ..core.stats import Stats
from ..core.vectors import ALL, dot, flatnonzero
from ..geometry.aggregate import barycentrics
from ..geometry.flatten import Geometry
from ..media.near import Sides
from ..media.nested import Media, Stack, innermost
from .interaction import Interaction

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]


def with_sides(geometry: Geometry, media: Media, rays: Rays, at: Interaction, t: Float64) -> Interaction:
    """The hits, at distances t (n,) along rays, with what else is passed, and new origins clear of all of it."""
    if media.near is None:
        return at
    hit, other = media.near.of(at.prim)
    if len(hit) == 0:
        return at
    facet, normal = geometry.facets[other].T, at.n_geometric[:, hit].astype(np.float64)
    origin, direction = rays.origin[:, hit].astype(np.float64), rays.direction[:, hit].astype(np.float64)
    point, scale = at.point[:, hit], (at.offset[hit] / ORIGIN_OFFSET).astype(np.float64)
    height = dot(facet[:3], point) - facet[3]
    u, v = barycentrics(geometry, other, point, clamp=False)
    over = (u >= 0) & (v >= 0) & (u + v <= 1) & (np.abs(height) <= NEAR * scale)
    chosen = flatnonzero(over)
    if len(chosen) == 0:
        return at
    hit, other, facet, normal = hit[chosen], other[chosen], facet[:, chosen], normal[:, chosen]
    origin, direction, scale, height = origin[:, chosen], direction[:, chosen], scale[chosen], height[chosen]

    # On which side of each other surface the ray begins, and whether it has passed it before it is at the hit.
    begins, toward = dot(facet[:3], origin) - facet[3], dot(facet[:3], direction)
    reached = -begins / toward
    passed = (reached > 0) & (reached <= t[hit])
    side = np.where(begins > 0, 1.0, -1.0) * np.where(passed, -1.0, 1.0)

    at = _cleared(at, hit, height / dot(facet[:3], normal), scale)
    columns, place = np.unique(hit, return_inverse=True)
    place = place.reshape(-1)
    before = rays.media[:, columns]
    u, v = barycentrics(geometry, other, origin + direction * reached, clamp=False)
    passed &= (u >= 0) & (v >= 0) & (u + v <= 1)
    came = _crossed(media, before, place, other, passed, toward < 0)
    own = at.prim[columns], at.entering[columns]
    result = []
    for stack, start in ((came, at.outer[:, columns]), (media.cross(came, *own, Stats()), at.inner(columns))):
        ends = dot(facet[:3], start[:, place].astype(np.float64)) - facet[3]
        result.append(_crossed(media, stack, place, other, (ends > 0) != (side > 0), side > 0))
    outer, inner = result
    around, beyond = media.ior[innermost(before, media.count)], media.ior[innermost(inner, media.count)]
    more = (outer != before).any(axis=0) | (inner != media.cross(before, *own, Stats())).any(axis=0)
    column = np.full(len(at.prim), -1)
    column[columns[more]] = np.arange(np.count_nonzero(more))
    sides = Sides(column, outer[:, more], inner[:, more], (beyond / around)[more])
    return replace(at, sides=sides, media=None if at.media is None else sides.amend(at.media, ALL, beyond=False))


def _cleared(at: Interaction, hit: Numbers, depth: Float64, scale: Float64) -> Interaction:
    """The hits with their offsets grown until origins on both sides are clear of surfaces (k,).

    depth : (k,) of these, behind or before the hits (k,) along their normals.   scale : (k,) largest coordinate there.
    """
    offset = at.offset.astype(np.float64)
    depth = np.abs(depth)
    for _ in range(PUSHES):
        close = flatnonzero(np.abs(offset[hit] - depth) < CLEAR_OF * scale)
        if len(close) == 0:
            break
        np.maximum.at(offset, hit[close], depth[close] + ORIGIN_OFFSET * scale[close])
    grown = offset.astype(np.float32)
    return replace(at, offset=grown, outer=offset_origin(at.point, at.n_geometric, grown))


def _crossed(media: Media, stack: Stack, place: Numbers, prim: Numbers, passes: Bools, entering: Bools) -> Stack:
    """Stacks (rows, m) behind the surfaces `prim` (k,) of those that pass them, at the columns `place` (k,)."""
    chosen = flatnonzero(passes)
    place, prim, entering = place[chosen], prim[chosen], entering[chosen]
    order = np.argsort(place, kind="stable")
    place, prim, entering = place[order], prim[order], entering[order]
    turn = np.arange(len(place)) - np.searchsorted(place, place)  # the first of each column, then the second, ...
    result = stack.copy()
    for number in range(int(np.max(turn, initial=-1)) + 1):
        now = flatnonzero(turn == number)
        result[:, place[now]] = media.cross(result[:, place[now]], prim[now], entering[now], Stats())
    return result
