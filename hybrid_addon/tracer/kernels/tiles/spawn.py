# SPDX-License-Identifier: GPL-3.0-or-later
"""Of a tile: how hits share out light and what rays they send on. Twins of shading/spawn.py and media/nested.py."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call,assignment,operator,arg-type,call-arg"

from __future__ import annotations

import numpy as np

from ...core import constants
from ...core.rays import UNLIMITED
from ...film.branch_selection import HEAVIEST
from ...film.ended_rays import MOST, UNIT
from ...film.samples import LOT
from ...materials.columns import ROWS
from ...media import nested
from .. import sampler, spawn, sums
from ..declare import clip, helper, largest_component, stage
from . import records as of

F, D, U = np.float32, np.float64, np.uint32
ZERO, ONE = F(0), F(1)
RANKS, AGAIN, BITS, DEEPEST = int(nested.RANKS), int(nested.AGAIN), constants.RANK_BITS, nested.DEEPEST
INTERFACE, TINT, INTERFACE_TINT, MIRROR, ROUGHNESS = (
    ROWS[name].start for name in ("interface", "tint", "interface_tint", "mirror", "lobe_roughness")
)
MIRROR_ROUGHNESS, MAX_STRAIGHT = F(constants.MIRROR_ROUGHNESS), constants.MAX_STRAIGHT_CROSSINGS
BUDGET_UNIT, MAX_BRANCHES, AHEAD = constants.BUDGET_UNIT, constants.MAX_BRANCHES, constants.RAYS_AHEAD
hash32, permute, units = sampler.hash32, sampler.permute, sums.units
R2_X, SCALE = sampler.R2_X, sampler.SCALE
mirror_directions, refracted_directions = stage(spawn.mirror_directions), stage(spawn.refracted_directions)
candidates, lightest, follow_all = stage(sums.candidates), stage(sums.lightest), stage(sums.follow_all)


@helper
def relative_index(stack, i, own, ior, entering, iors):
    """Media.eta of one hit."""
    if len(stack) == 0:
        return ior if entering else 1 / ior
    vacuum = len(iors) - 1
    lowest, within = vacuum, False
    for r in range(len(stack)):
        row = np.int64(stack[r, i])
        rank = row & RANKS
        backwards = row < 0
        if backwards and rank == own and (not entering or row < -AGAIN - AGAIN):
            within = True
        out = (row == own and not entering) or backwards
        lowest = min(lowest, vacuum if out else rank)
    if own == vacuum:
        return ior if entering else 1.0 / ior
    if own >= lowest or within:
        return 1.0
    outer = iors[lowest]
    return ior / outer if entering else outer / ior


@stage
def share_out(skins, media, prim, surface, place, share, throughput, entering, cos_o, stack, tinted, indirect):
    """spawn.share_out without thin walls and films: reflected, transmitted (3, n), cos_i, eta (n,), blurs (n,)."""
    n = len(prim)
    reflected, transmitted = np.empty((3, n), F), np.empty((3, n), F)
    cos_i, eta, blurs = np.zeros(n), np.ones(n), np.empty(n, np.bool_)
    for i in range(n):
        s, p, w = surface[i], place[i], share[i]
        interface = skins.values[INTERFACE, p] + skins.more[INTERFACE, p] * w
        rough = skins.values[ROUGHNESS, p] + skins.more[ROUGHNESS, p] * w
        blurs[i] = rough > MIRROR_ROUGHNESS
        f = ZERO
        if interface > ZERO:
            cos_i[i] = D(clip(cos_o[i], ZERO, ONE))
            eta[i] = relative_index(
                stack, i, media.rank[prim[i]] if len(media.rank) else 0, skins.ior[s], entering[i], media.ior
            )
            f = F(spawn.fresnel_of(cos_i[i], eta[i], 0.0, 0.5, 1.0))
        back = interface * f
        on = interface * (ONE - f if not skins.flags[of.GLOSSLESS, s] or f >= ONE else ONE)
        for c in range(3):
            mirror = skins.values[MIRROR + c, p] + skins.more[MIRROR + c, p] * w
            coat = skins.values[INTERFACE_TINT + c, p] + skins.more[INTERFACE_TINT + c, p] * w
            reflected[c, i] = throughput[c, i] * (mirror + coat * back)
            transmitted[c, i] = throughput[c, i] * (tinted[c, i] * on)
    if indirect != ONE:
        for c in range(3):
            for i in range(n):
                reflected[c, i] = reflected[c, i] * indirect
                transmitted[c, i] = transmitted[c, i] * (indirect if eta[i] != 1 else ONE)
    return reflected, transmitted, cos_i, eta, blurs


@helper
def in_units(weight):
    """ended_rays.in_units of one weight."""
    w = D(weight)
    w = w if w == w and abs(w) < np.inf else 0.0
    return np.int64(np.rint(clip(w, 0.0, MOST) / UNIT))


@helper
def note(signature, importance, throughput, path, sample, i, node):
    """Signatures._add of one node."""
    if largest_component(throughput[0, i], throughput[1, i], throughput[2, i]) >= importance:
        signature[sample[i]] = U(signature[sample[i]] + hash32(U(path[i] ^ hash32(node))))


@stage
def within(weight, limit, sample, objects, prim, buffer, counters, ended):
    """spawn._within: weights (n,) of what is to go on; 0 for what has none, or is beyond its limit (n,) bool."""
    for i in range(len(weight)):
        w = weight[i]
        if w == ZERO:
            counters[of.N_WEIGHTLESS] += 1
        elif not limit[i]:
            buffer.residual[sample[i]] += D(w)
            if w < UNLIMITED:
                buffer.spent[sample[i]] += units(w)
            ended[objects[prim[i]]] += in_units(w)
            weight[i] = ZERO


@stage
def cut_off(sample, weight, limit, released, buffer, counters):
    """The branches (2n,) that the error budget lets go: their weights are 0 then (spawn._followed)."""
    heaviest = np.empty(1, F)
    heaviest[0] = F(limit * BUDGET_UNIT)
    key, index = candidates(sample, weight, buffer.generation, released, buffer.spent, heaviest)
    if len(key) == 0:
        return
    gone = lightest(key, np.sort(key), buffer.generation, released, buffer.spent, buffer.scratch)
    for k in range(len(key)):
        if gone[k]:
            i = index[k]
            counters[of.N_ENDED] += 1
            counters[of.N_LOST] += in_units(weight[i])
            buffer.residual[sample[i]] += D(weight[i])
            buffer.spent[sample[i]] += units(weight[i])
            weight[i] = ZERO


@stage
def draw_some(pixels_key, count, first, sample, weight, factor, most_branches, most_rays, buffer, counters):
    """SampleBuffer.drawn where some sample has too many branches: by what each is multiplied, into factor (2n,)."""
    n = len(weight)
    for i in range(n):
        if weight[i] > ZERO:
            buffer.scratch[sample[i]] += 1
    done = np.zeros(n, np.bool_)
    index, cost = np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(n):
        if done[i] or not weight[i] > ZERO:
            continue
        owner = sample[i]
        number, most = buffer.scratch[owner], most_branches
        if most_rays:
            most = max(min(most, -(-(most_rays - buffer.followed[owner]) // AHEAD)), 1)
        m = 0
        for j in range(i, n):
            if sample[j] == owner and weight[j] > ZERO:
                index[m], done[j] = j, True
                m += 1
                if m == number:
                    break
        if number <= most:
            buffer.followed[owner] += number
            continue
        # The heaviest first; of like ones the first.
        total = np.int64(0)
        for k in range(m):
            c, j = min(units(weight[index[k]]), HEAVIEST), index[k]
            total += c
            q = k
            while q > 0 and cost[q - 1] < c:
                cost[q], index[q] = cost[q - 1], index[q - 1]
                q -= 1
            cost[q], index[q] = c, j
        kept, before = m, np.int64(0)
        for k in range(m):
            if D(cost[k]) * (most - k) < total - before:
                kept = k
                break
            before += cost[k]
        pixel = owner // count
        key = hash32(U(pixels_key[pixel] ^ hash32(U(buffer.generation[owner]))))
        key = hash32(U(key ^ LOT))
        place = permute(U(first + owner - pixel * count), hash32(key))
        chance = D(F(U(key + U(place * R2_X))) * SCALE) * (1 - BUDGET_UNIT) + BUDGET_UNIT / 2
        start = before
        for k in range(kept, m):
            threshold = (total - start) / max(most - kept, 1)
            at_start = (before - start) / threshold + chance
            before += cost[k]
            at_end = (before - start) / threshold + chance
            j = index[k]
            if np.floor(at_end) > np.floor(at_start):
                factor[j] = threshold / cost[k]
            else:
                factor[j] = 0.0
                counters[of.N_CROWDED] += 1
                buffer.residual[owner] += D(weight[j])
                buffer.stood_for[owner] += D(weight[j])
        for k in range(m):
            buffer.followed[owner] += 1 if factor[index[k]] > 0 else 0
    for i in range(n):
        buffer.scratch[sample[i]] = 0


@stage
def cross(stack, mirrored, bent, through, prim, entering, rank, vacuum, result, counters):
    """The media of new rays, into result (rows, n): those of the old ones, or behind the surface (Media.cross)."""
    rows, a, b = len(stack), len(mirrored), len(mirrored) + len(bent)
    if rows == 0:
        return
    for k in range(result.shape[1]):
        i = mirrored[k] if k < a else (bent[k - a] if k < b else through[k - b])
        for r in range(rows):
            result[r, k] = stack[r, i]
        if k < a:
            continue
        own = np.int64(rank[prim[i]])
        step = AGAIN if entering[i] else -AGAIN
        pending = own < vacuum
        for r in range(rows):
            row = np.int64(stack[r, i])
            if pending and (row & RANKS) == own:
                pending = False
                if abs((row >> BITS) + 1) >= DEEPEST:
                    counters[of.N_LOST_MEDIA] += 1
                else:
                    row = row + step
                result[r, k] = vacuum if row >> BITS == -1 else row
        new = own if entering[i] else own - AGAIN - AGAIN
        for r in range(rows):
            if pending and result[r, k] == vacuum:
                result[r, k] = new
                pending = False
        if pending:
            counters[of.N_LOST_MEDIA] += 1
