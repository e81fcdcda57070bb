# SPDX-License-Identifier: GPL-3.0-or-later
"""Of a tile: its waves of rays, and sums of their samples.

Twins of core/rays.py, integrator/whitted.py and shading/spawn.py.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call,assignment,operator,arg-type,call-arg"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core import constants
from ...core.rays import CAMERA_RAY, REFLECTED_RAY, TRANSMITTED_RAY, UNLIMITED
from ...film.path_hash import ESCAPED, INSIDE, REFLECTED, TRANSMITTED
from ..declare import Array, dot, largest, largest_component, stage
from . import records as of
from .hits import take3
from .light import charge
from .spawn import hash32, note

F, D, U = np.float32, np.float64, np.uint32
ZERO, ONE = F(0), F(1)
MAX_STRAIGHT = constants.MAX_STRAIGHT_CROSSINGS


class Rays(NamedTuple):
    """A wave of a tile: see `core.rays.Rays`."""

    origin: Array
    direction: Array
    throughput: Array
    sample: Array
    depth: Array
    straight: Array
    t_max: Array
    media: Array
    kind: Array
    unlit: Array
    path: Array


@stage
def chosen(rays, index):
    """Rays.take."""
    media = np.empty((len(rays.media), len(index)), np.int32)
    for r in range(len(media)):
        for k in range(len(index)):
            media[r, k] = rays.media[r, index[k]]
    return Rays(
        take3(rays.origin, index), take3(rays.direction, index), take3(rays.throughput, index), rays.sample[index],
        rays.depth[index], rays.straight[index], rays.t_max[index], media, rays.kind[index], rays.unlit[index],
        rays.path[index],
    )  # fmt: skip


@stage
def renewed(rays, throughput, path):
    """The same rays with other throughputs and paths."""
    return Rays(
        rays.origin, rays.direction, throughput, rays.sample, rays.depth, rays.straight, rays.t_max, rays.media,
        rays.kind, rays.unlit, path,
    )  # fmt: skip


@stage
def highlit(refracts, surface, entering, blurs):
    """(n,) whether lamps light what rays would see that hits reflect, in their highlights."""
    n = len(surface)
    result = np.empty(n, np.bool_)
    for i in range(n):
        result[i] = blurs[i] and (entering[i] or not refracts[surface[i]])
    return result


@stage
def new_rays(
    rays, mirrored, bent, through, outer, point, n_geometric, offset, back, on, reflected, transmitted, t, unlit
):
    """The rays that hits reflect (a,), that they bend (b,) and that pass straight on (c,): spawn._child, _straight.

    back, on : directions of the first and the second.   Their media are left to be written.
    """
    a, b = len(mirrored), len(mirrored) + len(bent)
    n = b + len(through)
    origin, direction, throughput = np.empty((3, n), F), np.empty((3, n), F), np.empty((3, n), F)
    sample, depth, straight = np.empty(n, np.int64), np.empty(n, np.int16), np.empty(n, np.int16)
    t_max, media, kind = np.empty(n, F), np.empty((len(rays.media), n), np.int32), np.empty(n, np.uint8)
    is_unlit, path = np.empty(n, np.bool_), np.empty(n, np.uint32)
    for k in range(n):
        reflects, bends = k < a, a <= k and k < b
        i = mirrored[k] if reflects else (bent[k - a] if bends else through[k - b])
        for c in range(3):
            if reflects:
                origin[c, k], direction[c, k], throughput[c, k] = outer[c, i], back[c, k], reflected[c, i]
            else:
                origin[c, k] = F(n_geometric[c, i] * -offset[i] + point[c, i])
                direction[c, k] = on[c, k - a] if bends else rays.direction[c, i]
                throughput[c, k] = transmitted[c, i]
        sample[k] = rays.sample[i]
        depth[k] = rays.depth[i] + (1 if k < b else 0)
        straight[k] = rays.straight[i] + (0 if k < b else 1)
        t_max[k] = UNLIMITED if k < b else F(D(rays.t_max[i]) - t[i])
        kind[k] = REFLECTED_RAY if reflects else (TRANSMITTED_RAY if bends else rays.kind[i])
        is_unlit[k] = unlit[i] if reflects else rays.unlit[i]
        path[k] = hash32(U(rays.path[i] ^ (REFLECTED if reflects else TRANSMITTED)))
    return Rays(origin, direction, throughput, sample, depth, straight, t_max, media, kind, is_unlit, path)


@stage
def sound(rays, buffer, counters):
    """Numbers of the rays that Embree can digest (whitted._drop_untraceable)."""
    n, left = len(rays.t_max), 0
    index = np.empty(n, np.int64)
    for i in range(n):
        probe = (rays.origin[0, i] + rays.origin[1, i] + rays.origin[2, i]) * ZERO
        x, y, z = rays.direction[0, i], rays.direction[1, i], rays.direction[2, i]
        probe += dot(x, y, z, x, y, z)
        if (probe > ZERO) & (probe < UNLIMITED):
            index[left] = i
            left += 1
        else:
            counters[of.N_DROPPED] += 1
            lost = largest_component(rays.throughput[0, i], rays.throughput[1, i], rays.throughput[2, i])
            buffer.residual[rays.sample[i]] += D(lost)
            buffer.spent[rays.sample[i]] += charge(lost)
    return index[:left].copy()


@stage
def sorted_out(rules, ray_traced, is_first, sample, t_max, prim, t, buffer):
    """Which rays hit, and which escape, as numbers; of the first ones only those that count (_count_camera_rays)."""
    sees, transparent, n = rules.whole[of.CAMERA_SEES], rules.whole[of.TRANSPARENT], len(prim)
    hit, gone, met, escaped = np.empty(n, np.int64), np.empty(n, np.int64), 0, 0
    for i in range(n):
        hits = prim[i] >= 0 and not t[i] > t_max[i]
        if is_first:
            of_ours = hits and (sees == of.SEES_ALL or ray_traced[prim[i]])
            counts = of_ours if sees == of.SEES_RAY_TRACED else (hits or not transparent)
            if not counts or (sees == of.SEES_RASTER and of_ours):
                continue
            buffer.seen[sample[i]] += 1.0
        if hits:
            hit[met] = i
            met += 1
        else:
            gone[escaped] = i
            escaped += 1
    return hit[:met].copy(), gone[:escaped].copy()


@stage
def note_escaped(rules, rays, vacuum, buffer, counters):
    """Of whitted.add_escaped what is counted: which rays (n,) see the world, and which of these are the camera's."""
    n, left = len(rays.t_max), 0
    index = np.empty(n, np.int64)
    straight = rules.whole[of.TRANSPARENT] != 0 and rules.whole[of.CAMERA_SEES] != of.SEES_RAY_TRACED
    for i in range(n):
        if len(buffer.signature):
            note(buffer.signature, F(rules.real[of.IMPORTANCE]), rays.throughput, rays.path, rays.sample, i, ESCAPED)
        if rays.kind[i] != CAMERA_RAY:
            lost = False
            for r in range(len(rays.media)):
                lost |= rays.media[r, i] != vacuum
            counters[of.N_LOST_MEDIA] += lost
        elif straight:
            a, b, c = rays.throughput[0, i], rays.throughput[1, i], rays.throughput[2, i]
            buffer.seen[rays.sample[i]] += D(-max(a, b, c))
            continue
        index[left] = i
        left += 1
    return index[:left].copy()


@stage
def first_rays(origin, direction, t_max, start, rows, vacuum):
    """camera.camera_rays of samples from `start` on."""
    n = len(t_max)
    none, media = np.zeros(n, np.int16), np.full((rows, n), np.int32(vacuum))
    return Rays(
        origin, direction, np.ones((3, n), F), np.arange(start, start + n), none, none, t_max, media,
        np.zeros(n, np.uint8), np.zeros(n, np.bool_), np.zeros(n, np.uint32),
    )  # fmt: skip


@stage
def next_generation(sample, number, buffer):
    """SampleBuffer.next_generation: samples (n,) are that many bounces on."""
    for s in sample:
        buffer.generation[s] = number


@stage
def keep_where(flags, surface, values, result):
    """Colours (3, n) of the hits on surfaces that have a flag; of the others what was there."""
    for c in range(3):
        for i in range(len(surface)):
            if flags[surface[i]]:
                result[c, i] = values[c, i]


@stage
def shading(flags, surface):
    """Numbers of the hits whose surfaces lights or the world shade."""
    index, found = np.empty(len(surface), np.int64), 0
    for i in range(len(surface)):
        s = surface[i]
        if flags[of.AMBIENT, s] or flags[of.DIFFUSE, s] or flags[of.SPECULAR, s]:
            index[found] = i
            found += 1
    return index[:found].copy()


@stage
def some_weights(weights, index):
    """Columns of (2, n)."""
    result = np.empty((2, len(index)))
    for c in range(2):
        for k in range(len(index)):
            result[c, k] = weights[c, index[k]] if weights.shape[1] else 0.0
    return result


@stage
def add_limited(limit, rays, emitted, brought, buffer):
    """What hits send, (3, n) by themselves and (3, n) of lights, no brighter than whitted._dimming says."""
    for i in range(len(rays.t_max)):
        s, dimming = rays.sample[i], ONE
        if np.isfinite(limit) and rays.kind[i] != CAMERA_RAY:
            brightest = emitted[0, i] + brought[0, i]
            for c in range(1, 3):
                brightest = largest(brightest, emitted[c, i] + brought[c, i])
            if brightest > limit:
                dimming = limit / largest(brightest, limit)
        for c in range(3):
            buffer.radiance[c, s] += D(rays.throughput[c, i] * emitted[c, i] * dimming)
            buffer.radiance[c, s] += D(rays.throughput[c, i] * brought[c, i] * dimming)


@stage
def note_hits(importance, identity, rays, prim, entering, lit, signature):
    """Signatures.add_hits."""
    for i in range(len(prim)):
        node = U(identity[prim[i]] + lit[i])
        if not entering[i]:
            node = U(node + INSIDE)
        note(signature, importance, rays.throughput, rays.path, rays.sample, i, node)


@stage
def followed_weights(_depth, rays, reflected, transmitted, _eta):
    """The largest channels (2, n) of what is reflected and transmitted, the samples (2n,), and factors 1 (2n,)."""
    n = len(rays.t_max)
    weight = np.empty((2, n), F)
    for i in range(n):
        weight[0, i] = largest_component(reflected[0, i], reflected[1, i], reflected[2, i])
        weight[1, i] = largest_component(transmitted[0, i], transmitted[1, i], transmitted[2, i])
    return weight, np.concatenate((rays.sample, rays.sample)), np.ones(2 * n)


@stage
def may_pass(depth, rays, eta):
    """(n,) which may go on behind the surface."""
    n = len(eta)
    result = np.empty(n, np.bool_)
    for i in range(n):
        result[i] = rays.depth[i] < depth if eta[i] != 1 else rays.straight[i] < MAX_STRAIGHT
    return result


@stage
def branch_weights(kind, weight, eta, going):
    """Weights (2n,) of the branches that may be cut, 0 of others; going: (2n,) which are to be followed."""
    n = len(eta)
    result = np.empty(2 * n, F)
    for i in range(n):
        result[i], result[n + i] = weight[0, i], weight[1, i]
        going[i], going[n + i] = weight[0, i] != ZERO, weight[1, i] != ZERO
        if eta[i] == 1 and kind[i] == CAMERA_RAY:
            result[n + i] = ZERO
    return result


@stage
def still_going(weight, kind, eta, branches, going):
    """Which branches are left after some were cut."""
    n = len(eta)
    for i in range(n):
        going[i] &= branches[i] != ZERO
        if not (eta[i] == 1 and kind[i] == CAMERA_RAY):
            going[n + i] &= branches[n + i] != ZERO


@stage
def drawn_weights(factor, reflected, transmitted, going):
    """What branches carry after some were drawn that stand for others."""
    n = reflected.shape[1]
    for i in range(n):
        left, through = F(factor[i]), F(factor[n + i])
        going[i] &= left > ZERO
        going[n + i] &= through > ZERO
        for c in range(3):
            reflected[c, i] = reflected[c, i] * left
            transmitted[c, i] = transmitted[c, i] * through


@stage
def kinds_of(rules, eta, going):
    """Numbers of the hits that reflect, that refract, and that rays pass straight."""
    n, a, b, d = len(eta), 0, 0, 0
    mirrored, bent, through = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(n):
        if going[i] and rules.whole[of.HAS_REFLECTION]:
            mirrored[a] = i
            a += 1
        if going[n + i] and rules.whole[of.HAS_REFRACTION]:
            if eta[i] != 1:
                bent[b] = i
                b += 1
            else:
                through[d] = i
                d += 1
    return mirrored[:a].copy(), bent[:b].copy(), through[:d].copy()


@stage
def view_cosines(wo, n_shading):
    """(n,) between wo and the shading normals."""
    n = wo.shape[1]
    cos = np.empty(n, F)
    for i in range(n):
        cos[i] = dot(wo[0, i], wo[1, i], wo[2, i], n_shading[0, i], n_shading[1, i], n_shading[2, i])
    return cos
