# SPDX-License-Identifier: GPL-3.0-or-later
"""Of a tile: rough hits, whose rays leave by the mirrors of microfacets. Twins of shading/microfacets.py."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call,assignment,operator,arg-type,call-arg"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core import constants
from ...core.sampler import FACET, LOBE, TRY
from ...materials.columns import ROWS
from ..declare import Array, dot, helper, largest, largest_component, stage
from ..elementary import SHORT
from ..sampler import OTHER, R2_X, R2_Y, SCALE, hash32, permute
from ..spawn import leaving, turned, unit
from .lamps import basis4

F, U = np.float32, np.uint32
ZERO, ONE, TWO, TWO_PI = F(0), F(1), F(2), F(2 * np.pi)
FAINT, LEAST, MIRROR_ROUGHNESS = F(constants.FAINT), F(constants.LEAST_COSINE), F(constants.MIRROR_ROUGHNESS)
TRIES = constants.MICROFACET_TRIES
INTERFACE, MIRROR, COAT, COAT_BLURRED, LOBE_ROUGHNESS, COAT_ROUGHNESS = (
    ROWS[name].start for name in ("interface", "mirror", "coat", "coat_blurred", "lobe_roughness", "coat_roughness")
)
sincos = SHORT.sincos


class Microfacets(NamedTuple):
    """Hits (k,), rough ones of camera rays as often as they count: see `microfacets.SampledMicrofacets`.

    index : (k,) which of the n hits they are; no numbers where all are mirrors: then there is nothing else, too.
    throughput, normals : (3, k).   path : (k,) uint32.   coat, chance : (k,).   is_coat, is_rough : (k,) bool.
    """

    index: Array
    throughput: Array
    path: Array
    normals: Array
    coat: Array
    is_coat: Array
    is_rough: Array
    chance: Array


@helper
def point_of(key, number, dimension):
    """Draws.square of one place in a ray tree."""
    k = hash32(U(key ^ dimension))
    m = permute(number, hash32(k))
    return F(U(k + U(m * R2_X))) * SCALE, F(U(hash32(U(k ^ OTHER)) + U(m * R2_Y))) * SCALE


@helper
def reflecting(w, n, up):
    """scattering.reflecting_normal of one hit."""
    twice = TWO * dot(w[0], w[1], w[2], n[0], n[1], n[2])
    x, y, z = n[0] * twice - w[0], n[1] * twice - w[1], n[2] * twice - w[2]
    lowest = leaving(w, up)
    return turned(w, n, up, lowest) if dot(x, y, z, up[0], up[1], up[2]) < lowest else n


@helper
def visible_normal(w, n, alpha, u, v):
    """microfacets.visible_normal of one hit that is not brushed."""
    tx, ty, tz, bx, by, bz = basis4(n[0], n[1], n[2])
    x, y = dot(w[0], w[1], w[2], tx, ty, tz) * alpha, dot(w[0], w[1], w[2], bx, by, bz) * alpha
    z = dot(w[0], w[1], w[2], n[0], n[1], n[2])
    length = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    cap = ONE - v * (ONE + z)
    sin = np.sqrt(largest(ONE - cap * cap, ZERO))
    sin_phi, cos_phi = sincos(TWO_PI * u)
    hx, hy, hz = (sin * cos_phi + x) * alpha, (sin * sin_phi + y) * alpha, largest(cap + z, ZERO)
    return unit(tx * hx + bx * hy + n[0] * hz, ty * hx + by * hy + n[1] * hz, tz * hx + bz * hy + n[2] * hz, ONE)


@helper
def masking(cos, alpha):
    """principled.masking of one hit."""
    a = alpha * alpha
    return TWO * cos / (cos + np.sqrt(a + (ONE - a) * cos * cos))


@helper
def microfacet(w, n, alpha, redraw, key, number):
    """microfacets._microfacets of one hit."""
    h = n
    for salt in range(TRIES):
        u, v = point_of(key, number, U(FACET + U(salt)))
        h = visible_normal(w, n, alpha, u, v)
        twice = TWO * dot(w[0], w[1], w[2], h[0], h[1], h[2])
        cosine = dot(h[0] * twice - w[0], h[1] * twice - w[1], h[2] * twice - w[2], n[0], n[1], n[2])
        passes = masking(largest(cosine, LEAST), alpha) if cosine > ZERO else ZERO
        if not (redraw and point_of(key, number, U(TRY + U(salt)))[0] >= passes):
            break
    return h


@stage
def lobes_at(skins, surface, place, share):
    """Rows (4, n) of what reflects: roughness of base and coat, what the coat has of the weight, what the rest has."""
    n = len(surface)
    found = np.empty((4, n), F)
    for i in range(n):
        p, w, v, more = place[i], share[i], skins.values, skins.more
        found[0, i] = v[LOBE_ROUGHNESS, p] + more[LOBE_ROUGHNESS, p] * w
        found[1, i] = v[COAT_ROUGHNESS, p] + more[COAT_ROUGHNESS, p] * w
        coated = (v[COAT, p] + more[COAT, p] * w) - (v[COAT_BLURRED, p] + more[COAT_BLURRED, p] * w)
        bent = v[INTERFACE, p] + more[INTERFACE, p] * w if skins.ior[surface[i]] != 1 else ZERO
        mirror = largest_component(
            v[MIRROR, p] + more[MIRROR, p] * w, v[MIRROR + 1, p] + more[MIRROR + 1, p] * w,
            v[MIRROR + 2, p] + more[MIRROR + 2, p] * w,
        )  # fmt: skip
        rest = mirror - coated + bent
        found[2, i], found[3, i] = coated, rest if rest > FAINT else ZERO
    return found


@stage
def roughen(skins, parts, pixels, count, first, rays, surface, place, share, wo, n_shading, n_geometric):
    """microfacets.roughen of hits (n,). parts: as how many a camera ray's first hit counts, 0: none is rough.

    pixels, count, first : see `core.sampler.Sampler`.
    """
    n = len(surface) if parts else 0
    lobes = lobes_at(skins, surface, place, share)
    times, wide, total, any_wide = np.ones(n, np.int64), np.zeros(n, np.bool_), 0, False
    for i in range(n):
        lobe, coat, coated, rest = lobes[0, i], lobes[1, i], lobes[2, i], lobes[3, i]
        wide[i] = (rest > ZERO and lobe > MIRROR_ROUGHNESS) or (coated > ZERO and coat > MIRROR_ROUGHNESS)
        any_wide |= wide[i]
        if wide[i] and rays.depth[i] == 0 and rays.straight[i] == 0:
            apart = coated > ZERO and rest > ZERO and lobe != coat and coat <= MIRROR_ROUGHNESS
            times[i] = parts + (1 if apart else 0)
        total += times[i]
    total = total if any_wide else 0
    index, path = np.empty(total, np.int64), np.empty(total, np.uint32)
    throughput, normals = np.empty((3, total), F), np.empty((3, total), F)
    of_coat, chance = np.zeros(total, F), np.ones(total, F)
    is_coat, is_rough = np.zeros(total, np.bool_), np.zeros(total, np.bool_)
    k = 0
    for i in range(n if any_wide else 0):
        lobe, coat, coated, rest = lobes[0, i], lobes[1, i], lobes[2, i], lobes[3, i]
        both = wide[i] and coated > ZERO and rest > ZERO and lobe != coat
        apart = both and rays.depth[i] == 0 and rays.straight[i] == 0 and coat <= MIRROR_ROUGHNESS
        pixel = rays.sample[i] // count
        key, number = hash32(U(pixels[pixel] ^ hash32(rays.path[i]))), U(first + rays.sample[i] - pixel * count)
        w = wo[0, i], wo[1, i], wo[2, i]
        normal = n_shading[0, i], n_shading[1, i], n_shading[2, i]
        if wide[i]:
            normal = reflecting(w, normal, (n_geometric[0, i], n_geometric[1, i], n_geometric[2, i]))
        for part in range(times[i]):
            # The part of its hit that it is.
            is_last, shared = part == times[i] - 1, times[i]
            if apart:
                shared = 1 if is_last else times[i] - 1
            index[k], path[k] = i, rays.path[i]
            for c in range(3):
                throughput[c, k] = rays.throughput[c, i]
                if shared > 1:
                    throughput[c, k] = throughput[c, k] / F(shared)
            if part > 0:
                path[k] = hash32(U(path[k] + U(part)))
            own = U(U(number * U(shared)) + U(part if shared > 1 else 0))
            # Its lobe.
            odds = coated / (coated + rest) if both else (ONE if rest <= ZERO else ZERO)
            drawn = point_of(key, own, LOBE)[0]
            by_coat = is_last if apart else drawn < odds
            if wide[i] and not (apart and is_last):
                path[k] = hash32(U(path[k] ^ U(F(drawn).view(U))))
            if both:
                of_coat[k], is_coat[k] = coated, by_coat
                if not apart:
                    chance[k] = odds if by_coat else ONE - odds
            # Its microfacet.
            rough, h = coat if by_coat else lobe, normal
            is_rough[k] = wide[i] and rough > MIRROR_ROUGHNESS
            if is_rough[k] and dot(w[0], w[1], w[2], normal[0], normal[1], normal[2]) > ZERO:
                p = place[i]
                redraw = skins.values[INTERFACE, p] + skins.more[INTERFACE, p] * share[i] == ZERO
                h = microfacet(w, normal, rough * rough, redraw, key, own)
            normals[0, k], normals[1, k], normals[2, k] = h
            k += 1
    return Microfacets(index, throughput, path, normals, of_coat, is_coat, is_rough, chance)


@stage
def share_lobes(facets, throughput, eta, reflected, transmitted):
    """SampledMicrofacets.share: of what all lobes reflect and transmit (3, k) that of those which were drawn."""
    for i in range(len(facets.coat)):
        if facets.coat[i] == ZERO:
            continue
        for c in range(3):
            coat = throughput[c, i] * facets.coat[i]
            rest = largest(reflected[c, i] - coat, ZERO)
            reflected[c, i] = (coat if facets.is_coat[i] else rest) / facets.chance[i]
            if eta[i] != 1:
                transmitted[c, i] = ZERO if facets.is_coat[i] else transmitted[c, i] / facets.chance[i]
