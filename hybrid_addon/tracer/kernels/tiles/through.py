# SPDX-License-Identifier: GPL-3.0-or-later
"""Of a tile: what passes through surfaces on its way to a lamp, and lamps that rays meet.

Twins of shading/shadows.py and shading/lamps.py.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call,assignment,operator,arg-type,call-arg"

from __future__ import annotations

import numpy as np

from ...core import constants
from ...core.rays import REFLECTED_RAY
from ..declare import dot, inlined, largest, largest_component, stage
from ..spawn import fresnel_of
from . import records as of
from .highlights import spot_factor
from .hits import nearest, occluded, take3
from .images import dimmed
from .lamps import shadow_directions, square
from .skins import color_of, places, tint
from .spawn import INTERFACE, TINT, note

F, D = np.float32, np.float64
ZERO, HALF, ONE, INF = F(0), F(0.5), F(1), F(np.inf)
CROSSINGS, REACH, OFFSET = constants.MAX_SHADOW_CROSSINGS, constants.SHADOW_REACH, F(constants.ORIGIN_OFFSET)


@stage
def shares(skins, surface, place, share, toward, tinted):
    """shadows._passed_closures, without thin walls, films and caustics: tints (3, m) of which it makes shares."""
    for i in range(len(surface)):
        s, p = surface[i], place[i]
        f = fresnel_of(F(abs(toward[i])), F(skins.ior[s]), ZERO, HALF, ONE)
        interface = skins.values[INTERFACE, p] + skins.more[INTERFACE, p] * share[i]
        on = interface * (ONE - f if not skins.flags[of.GLOSSLESS, s] or f >= ONE else ONE)
        for c in range(3):
            tinted[c, i] = tinted[c, i] * on


@stage
def arrive(opaque, prim, t, active, reach, left, visible):
    """Which shadow rays (m,) go on, as numbers (k,): what they get is written of the others, which end or arrive."""
    found, going = np.empty(len(prim), np.int64), 0
    for k in range(len(prim)):
        if not t[k] < reach[k]:
            for c in range(3):
                visible[c, active[k]] = left[c, k]
        elif opaque[prim[k]]:
            for c in range(3):
                visible[c, active[k]] = ZERO
        else:
            found[going] = k
            going += 1
    return found[:going].copy()


@stage
def go_on(extent, some, prim, t, normal, toward, origin, wi, active, reach, left, passed, visible):
    """The rays `some` (k,) behind what they cross: origin, wi, active, reach, left of those that keep anything."""
    n, going = len(some), 0
    start, way, rest = np.empty((3, n), F), np.empty((3, n), F), np.empty((3, n), F)
    number, far = np.empty(n, np.int64), np.empty(n)
    for k in range(n):
        i = some[k]
        r, g, b = left[0, i] * passed[0, k], left[1, i] * passed[1, k], left[2, i] * passed[2, k]
        if not (r > ZERO or g > ZERO or b > ZERO):
            for c in range(3):
                visible[c, active[i]] = ZERO
            continue
        x = wi[0, i] * t[i] + origin[0, i]
        y = wi[1, i] * t[i] + origin[1, i]
        z = wi[2, i] * t[i] + origin[2, i]
        offset = OFFSET * largest(extent[prim[i]], largest_component(F(x), F(y), F(z)))
        offset = offset * F(np.sign(toward[i]))
        start[0, going], start[1, going], start[2, going] = (
            F(normal[0, i] * offset + x), F(normal[1, i] * offset + y), F(normal[2, i] * offset + z),
        )  # fmt: skip
        rest[0, going], rest[1, going], rest[2, going] = r, g, b
        for c in range(3):
            way[c, going] = wi[c, i]
        number[going], far[going] = active[i], reach[i] - t[i]
        going += 1
    return (
        start[:, :going].copy(), way[:, :going].copy(), number[:going].copy(), far[:going].copy(),
        rest[:, :going].copy(),
    )  # fmt: skip


@stage
def transmitted_light(scene, origin, wi, t_max, active, visible, cut, counters):
    """shadows._transmittance of shadow rays (m,) that meet something: into the columns `active` of visible (3, k).

    cut : (k,) bool, of which too many surfaces are crossed.
    """
    shapes, skins = scene.shapes, scene.skins
    reach, left = t_max.astype(np.float64), np.ones(wi.shape, F)
    for _ in range(CROSSINGS):
        if len(active) == 0:
            break
        counters[of.N_STEPS] += len(active)
        prim, t, normal, toward = nearest(shapes, scene.trees, of.SHADOW, origin, wi, counters)
        some = arrive(shapes.opaque, prim, t, active, reach, left, visible)
        crossed, point = prim[some].astype(np.int64), np.empty((3, len(some)))
        for c in range(3):
            for k in range(len(some)):
                point[c, k] = origin[c, some[k]] + wi[c, some[k]] * t[some[k]]
        surface = shapes.surface[crossed]
        place, share = places(skins, surface, np.abs(toward[some]).astype(np.float32))
        passed = color_of(skins, TINT, place, share)
        tint(shapes, skins, scene.images, 6, crossed, surface, point, passed)
        shares(skins, surface, place, share, toward[some], passed)
        origin, wi, active, reach, left = go_on(
            shapes.extent, some, prim, t, normal, toward, origin, wi, active, reach, left, passed, visible
        )
    counters[of.N_EXHAUSTED] += len(active)
    for k in range(len(active)):
        cut[active[k]] = True
        for c in range(3):
            visible[c, active[k]] = ZERO


@stage
def add_lamps(lamps, limit, indirect, importance, rays, t, buffer, counters):
    """lamps.add_lamps, where all that is in the way casts shadows."""
    origin, direction, throughput, sample = rays.origin, rays.direction, rays.throughput, rays.sample
    kind, unlit, path = rays.kind, rays.unlit, rays.path
    strength = F(1 / indirect) if indirect != 0 else ZERO
    for lamp in range(len(lamps.kind)):
        numbers, shape, falloff = lamps.numbers[lamp], lamps.kind[lamp], lamps.flags[lamp, of.FALLOFF]
        px, py, pz = D(F(numbers[of.PLACE])), D(F(numbers[of.PLACE + 1])), D(F(numbers[of.PLACE + 2]))
        radius2 = numbers[of.RADIUS] * numbers[of.RADIUS]
        for i in range(len(t)):
            if kind[i] == 0 or unlit[i]:
                continue
            dx, dy, dz = D(direction[0, i]), D(direction[1, i]), D(direction[2, i])
            meets, distance = False, np.inf
            if shape == of.SUN:
                along = dot(px, py, pz, dx, dy, dz)
                ox, oy, oz = dx - px * along, dy - py * along, dz - pz * along
                width = numbers[of.RADIUS] * along
                meets = along > 0 and dot(ox, oy, oz, ox, oy, oz) <= width * width
            else:
                tx, ty, tz = px - D(origin[0, i]), py - D(origin[1, i]), pz - D(origin[2, i])
                along = dot(tx, ty, tz, dx, dy, dz)
                if shape <= of.SPOT and falloff:
                    distance = dot(tx, ty, tz, tx, ty, tz) / along
                    ox, oy, oz = dx * distance - tx, dy * distance - ty, dz * distance - tz
                    meets = along > 0 and dot(ox, oy, oz, ox, oy, oz) <= radius2
                elif shape <= of.SPOT:
                    ox, oy, oz = tx - dx * along, ty - dy * along, tz - dz * along
                    half = radius2 - dot(ox, oy, oz, ox, oy, oz)
                    inside = dot(tx, ty, tz, tx, ty, tz) < radius2
                    distance = along - np.sqrt(half)
                    meets = inside or (half >= 0 and distance > 0)
                    distance = 0.0 if inside else distance
                else:
                    sx, sy, sz = numbers[of.AXIS], numbers[of.AXIS + 1], numbers[of.AXIS + 2]
                    against = -dot(sx, sy, sz, dx, dy, dz)
                    distance = -dot(sx, sy, sz, tx, ty, tz) / against
                    ox, oy, oz = dx * distance - tx, dy * distance - ty, dz * distance - tz
                    a, b = of.OVER_U, of.OVER_V
                    u = dot(numbers[a], numbers[a + 1], numbers[a + 2], ox, oy, oz)
                    v = dot(numbers[b], numbers[b + 1], numbers[b + 2], ox, oy, oz)
                    inside = u * u + v * v <= 1 if shape == of.DISK else abs(u) <= 1 and abs(v) <= 1
                    meets = against > 0 and distance > 0 and inside
            if not (meets and distance * REACH <= t[i]):
                continue
            factor = F(numbers[of.OF_SPECULAR]) if kind[i] == REFLECTED_RAY else F(numbers[of.OF_TRANSMISSION])
            if shape != of.SUN:
                x, y, z = (
                    origin[0, i] - F(numbers[of.PLACE]), origin[1, i] - F(numbers[of.PLACE + 1]),
                    origin[2, i] - F(numbers[of.PLACE + 2]),
                )  # fmt: skip
                if numbers[of.OVER_RANGE2] > 0:
                    s = dot(x, y, z, x, y, z) * F(numbers[of.OVER_RANGE2])
                    w = largest(ONE - s * s, ZERO)
                    factor = factor * (w * w)
                if shape == of.SPOT:
                    factor = factor * spot_factor(numbers, x, y, z)
            r, g, b = (
                F(numbers[of.RADIANCE] * factor), F(numbers[of.RADIANCE + 1] * factor),
                F(numbers[of.RADIANCE + 2] * factor),
            )  # fmt: skip
            if r == ZERO and g == ZERO and b == ZERO:
                continue
            counters[of.N_LAMPS] += 1
            r, g, b = (
                throughput[0, i] * (r * strength),
                throughput[1, i] * (g * strength),
                throughput[2, i] * (b * strength),
            )
            if np.isfinite(limit):
                dimming = dimmed(r, g, b, limit)
                r, g, b = r * dimming, g * dimming, b * dimming
            buffer.radiance[0, sample[i]] += D(r)
            buffer.radiance[1, sample[i]] += D(g)
            buffer.radiance[2, sample[i]] += D(b)
            if len(buffer.signature):
                note(buffer.signature, importance, throughput, path, sample, i, lamps.key[lamp])


@stage
def sent_rays(origin, wi, inside, counters):
    """Shadow rays (k,) that can be sent: numbers of those that are asked whether they meet anything, and of all."""
    m, sent, asked = origin.shape[1], 0, 0
    some, index = np.empty(m, np.int64), np.empty(m, np.int64)
    for i in range(m):
        probe = (origin[0, i] + origin[1, i] + origin[2, i]) * ZERO
        probe += dot(wi[0, i], wi[1, i], wi[2, i], wi[0, i], wi[1, i], wi[2, i])
        if (probe > ZERO) & (probe < INF):
            index[sent] = i
            sent += 1
            if not inside[i]:
                some[asked] = i
                asked += 1
    counters[of.N_DROPPED] += m - sent
    counters[of.N_SHADOW] += sent
    return some[:asked].copy(), index[:sent].copy()


@inlined
def arriving_shares(scene, origin, wi, distance, inside, visible, cut, counters):
    """shadows.visibility of shadow rays (k,): into visible (3, k). cut : (k,) bool, not followed to their ends."""
    tints = scene.rules.whole[of.TINTS] != 0
    some, sent = sent_rays(origin, wi, inside, counters)
    t_max = np.empty(len(distance), F)
    for k in range(len(distance)):
        t_max[k], cut[k] = distance[k] * F(REACH), True
        visible[0, k], visible[1, k], visible[2, k] = ZERO, ZERO, ZERO
    blocked = occluded(scene.trees, of.SHADOW, take3(origin, some), take3(wi, some), t_max[some])
    for k in sent:
        cut[k] = False
    free = 0
    for k in range(len(some)):
        if not blocked[k]:
            i = some[k]
            visible[0, i], visible[1, i], visible[2, i] = ONE, ONE, ONE
            free += 1
    counters[of.N_ANY_HIT] += free if tints else len(some)
    if tints:
        # Of those that meet something, follow the ray through all that tints it.
        left, met = np.empty(len(sent), np.int64), 0
        for k in sent:
            if visible[0, k] == ZERO:
                left[met] = k
                met += 1
        left = left[:met].copy()
        transmitted_light(
            scene, take3(origin, left), take3(wi, left), t_max[left], left, visible, cut, counters
        )  # fmt: skip


@inlined
def visibility(
    scene, lamp, kind, falloff, numbers, index, surface, entering, origin, n_geometric, key, number, cut_off, counters
):
    """shadows.visible_shares of the hits `index` (k,): (3, k)."""
    found, lamps, samples = len(index), scene.lamps, scene.rules.whole[of.SHADOW_SAMPLES]
    start, normal, inside = take3(origin, index), take3(n_geometric, index), np.empty(found, np.bool_)
    for k in range(found):
        i = index[k]
        inside[k] = scene.rules.whole[of.TINTS] and not entering[i] and scene.skins.flags[of.TRANSMITS, surface[i]]
    soft = lamps.flags[lamp, of.SOFT] and samples > 0
    total, visible, cut = np.zeros((3, found), F), np.empty((3, found), F), np.empty(found, np.bool_)
    keys, numbers_of, parts = key[index], number[index], (samples if soft else 1)
    for part in range(parts):
        u, v = square(keys, numbers_of, lamps.key[lamp], part, samples if soft else 1)
        wi, distance = shadow_directions(kind, falloff, soft, numbers, start, normal, u, v)
        arriving_shares(scene, start, wi, distance, inside, visible, cut, counters)
        for c in range(3):
            for k in range(found):
                total[c, k] += visible[c, k]
        for k in range(found):
            cut_off[index[k]] |= cut[k]
    if parts > 1:
        for c in range(3):
            for k in range(found):
                total[c, k] = total[c, k] / F(parts)
    return total
