# SPDX-License-Identifier: GPL-3.0-or-later
"""Of a tile: the light that lamps and the world bring to hits. Twins of shading/direct.py, shadows.py and emitters/."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call,assignment,operator,arg-type,call-arg"

from __future__ import annotations

import math

import numpy as np

from ...core import constants
from ...materials.columns import ROWS
from .. import highlights, sampler, sums
from ..declare import dot, helper, inlined, largest, largest_component, stage
from ..elementary import SHORT
from . import records as of
from .highlights import highlight, lobe_frames
from .hits import shadow_origins, take3
from .images import glossy, limit_to
from .lamps import add_phong, illuminate
from .skins import color_of, number_of
from .through import visibility

F, D, U = np.float32, np.float64, np.uint32
ZERO, HALF, ONE, TWO, THREE = F(0), F(0.5), F(1), F(2), F(3)
PI, INVERSE_PI, OVER_TWO_PI, QUARTER = F(np.pi), F(1 / np.pi), F(1 / (2 * np.pi)), F(0.25)
LEAST, LEAST2, LEAST_LOG = F(constants.LEAST_COSINE), F(constants.LEAST_COSINE**2), F(constants.LEAST_COSINE - 1)
MIRROR, NEAR_BALL = F(constants.MIRROR_ROUGHNESS), F(constants.NEAR_BALL)
REACH, UNIT, FAINT = F(constants.SHADOW_REACH), constants.BUDGET_UNIT, constants.FAINT_LIGHT
EIGHTH, LEAST_RADIUS = F(math.pi / 4), F(constants.LEAST_RADIUS)
INF = F(np.inf)
(
    BASE_COLOR, LOCAL, AMBIENT, DIFFUSE, SPECULAR, EXPONENT, LOBE, COAT, LOBE_BLURRED, COAT_BLURRED, LOBE_ROUGHNESS,
    COAT_ROUGHNESS,
) = (
    ROWS[name].start for name in (
        "base_color", "local", "ambient", "diffuse", "specular", "exponent", "lobe", "coat", "lobe_blurred",
        "coat_blurred", "lobe_roughness", "coat_roughness",
    )
)  # fmt: skip
near_0, phong_of = SHORT.sincos_near_0, highlights.phong_of
hash32, permute, units = sampler.hash32, sampler.permute, sums.units
R2_X, R2_Y, SCALE, OTHER = sampler.R2_X, sampler.R2_Y, sampler.SCALE, sampler.OTHER


@helper
def mirrored_share(r):
    """By how much a rough reflection turns from the normal to the mirror's direction (scattering.mirrored)."""
    smooth = ONE - r * r
    return smooth * (np.sqrt(smooth) + r * r)


@inlined
def add_blurred(world, images, wo, n, weight, roughness, radiance):
    """The world's blurred image in reflections of these weights (3, n), where they have one: direct._add_ambient."""
    m, found = len(roughness), 0
    index = np.empty(m, np.int64)
    for i in range(m):
        if weight[0, i] != 0 or weight[1, i] != 0 or weight[2, i] != 0:
            index[found] = i
            found += 1
    if found == 0:
        return
    direction, wide = np.empty((3, found), F), np.empty(found, F)
    for k in range(found):
        i = index[k]
        wide[k] = roughness[i]
        x, y, z, wx, wy, wz = n[0, i], n[1, i], n[2, i], wo[0, i], wo[1, i], wo[2, i]
        twice, share = TWO * dot(wx, wy, wz, x, y, z), mirrored_share(wide[k])
        direction[0, k] = x + (x * twice - wx - x) * share
        direction[1, k] = y + (y * twice - wy - y) * share
        direction[2, k] = z + (z * twice - wz - z) * share
    image = glossy(world, images, direction, wide)
    for c in range(3):
        for k in range(found):
            radiance[c, index[k]] += weight[c, index[k]] * image[c, k]


@stage
def add_ambient(scene, surface, place, share, color, wo, n, radiance):
    """direct._add_ambient, without occlusion."""
    skins, world = scene.skins, scene.world
    m, blurs = len(surface), False
    weight = number_of(skins, AMBIENT, place, share)
    for i in range(m):
        blurs |= skins.flags[of.BLURS, surface[i]]
        if not skins.flags[of.AMBIENT, surface[i]]:
            continue
        for c in range(3):
            e = world.mean[c]
            if len(world.linear):
                k = world.linear
                e = largest(e + k[c, 0] * n[0, i] + k[c, 1] * n[1, i] + k[c, 2] * n[2, i], ZERO)
            radiance[c, i] += color[c, i] * weight[i] * e
    if not blurs:
        return
    base, coat = color_of(skins, LOBE_BLURRED, place, share), number_of(skins, COAT_BLURRED, place, share)
    coats = np.empty((3, m), F)
    for i in range(m):
        for c in range(3):
            here = skins.flags[of.BLURS, surface[i]]
            base[c, i], coats[c, i] = (base[c, i], coat[i]) if here else (ZERO, ZERO)
    add_blurred(world, scene.images, wo, n, base, number_of(skins, LOBE_ROUGHNESS, place, share), radiance)
    add_blurred(world, scene.images, wo, n, coats, number_of(skins, COAT_ROUGHNESS, place, share), radiance)


@helper
def charge(lost):
    """What error_budget.ErrorBudget.charge takes for so much throughput."""
    return units(lost) if lost < INF else np.int64(0)


@stage
def faint_light(limit, sample, weight, share, wanted, unlit, scratch, residual):
    """whitted._cut_light and SampleBuffer.cut_light: those of hits `wanted` (n,) whose light may be left out no longer
    are. share: (3, n), of what a white wall would send on; weight: (3, n). Returns how many."""
    n, found = len(sample), 0
    least = F(FAINT * limit * UNIT)
    lost, index = np.empty(n, F), np.empty(n, np.int64)
    for i in range(n):
        s = largest_component(weight[0, i] * share[0, i], weight[1, i] * share[1, i], weight[2, i] * share[2, i])
        if s > ZERO and s <= least:
            lost[found], index[found] = s, i
            scratch[sample[i]] += units(s)
            found += 1
    cut = 0
    for k in range(found):
        owner = sample[index[k]]
        if unlit[owner] + scratch[owner] <= limit:
            wanted[index[k]] = False
            index[cut], lost[cut] = index[k], lost[k]
            cut += 1
    for i in range(n):
        scratch[sample[i]] = 0
    for k in range(cut):
        owner = sample[index[k]]
        unlit[owner] += units(lost[k])
        residual[owner] += D(lost[k])
    return cut


@stage
def direct_light(
    scene, prim, surface, place, share, color, entering, point, n_geometric, n, wo, offset, outer, weights, sample,
    weight, key, number, buffer, lit, counters,
):  # fmt: skip
    """direct.direct_light of m hits: (3, m).

    weight : (3, m), throughput and share of local light.   buffer : of all samples.
    lit : (m,) uint32, keys of the lamps that reach each are added; no numbers: nobody asks.
    """
    m, rules, skins, lamps = len(prim), scene.rules, scene.skins, scene.lamps
    radiance = np.zeros((3, m), F)
    if rules.whole[of.HAS_AMBIENT]:
        add_ambient(scene, surface, place, share, color, wo, n, radiance)
        for c in range(3):
            for i in range(m):
                radiance[c, i] *= F(rules.real[of.INDIRECT])
    limit = F(rules.real[of.DIRECT_LIMIT])
    of_world = radiance.copy() if np.isfinite(limit) else radiance
    if not (rules.whole[of.HAS_DIFFUSE] or rules.whole[of.HAS_SPECULAR]):
        return radiance
    place4, albedo, cos_o = np.empty((3, m), F), np.empty((3, m), F), np.empty(m, F)
    strength = number_of(skins, DIFFUSE, place, share)
    for i in range(m):
        cos_o[i] = dot(wo[0, i], wo[1, i], wo[2, i], n[0, i], n[1, i], n[2, i])
        strength[i] = strength[i] * INVERSE_PI
    for c in range(3):
        for i in range(m):
            place4[c, i], albedo[c, i] = F(point[c, i]), color[c, i] * strength[i]
    # The rough lobes of layered surfaces: of the base, then of the coat.
    base, coat = lobes_of(scene, surface, place, share, entering, wo, n)
    origin = shadow_origins(scene.shapes, prim, entering, point, n_geometric, offset, outer, weights)
    cut_off = np.zeros(m, np.bool_)
    for number_of_lamp in range(len(lamps.kind)):
        add_lamp(
            scene, number_of_lamp, prim, surface, place, share, entering, place4, albedo, n_geometric, n, wo, cos_o,
            offset, origin, base, coat, sample, weight, key, number, buffer, lit, cut_off, radiance, counters,
        )  # fmt: skip
    if np.isfinite(limit):
        for i in range(m):
            for c in range(3):
                radiance[c, i] = radiance[c, i] - of_world[c, i]
        limit_to(radiance, limit)
        for i in range(m):
            for c in range(3):
                radiance[c, i] = of_world[c, i] + radiance[c, i]
    for i in range(m):
        if cut_off[i]:
            lost = largest_component(weight[0, i], weight[1, i], weight[2, i])
            buffer.residual[sample[i]] += D(lost)
            buffer.spent[sample[i]] += charge(lost)
    return radiance


@inlined
def lobes_of(scene, surface, place, share, entering, wo, n):
    """direct._glossy: of base and coat each the hits (k,) that have a rough lobe, its colour (3, k), its shape."""
    base, base_color, rough = one_lobe(scene.skins, LOBE, 3, LOBE_ROUGHNESS, surface, place, share, entering)
    base_shape = lobe_frames(take3(wo, base), take3(n, base), rough, scene.lamps.ltc)
    coat, coat_color, rough = one_lobe(scene.skins, COAT, 1, COAT_ROUGHNESS, surface, place, share, entering)
    return (base, base_color, base_shape), (
        coat, coat_color, lobe_frames(take3(wo, coat), take3(n, coat), rough, scene.lamps.ltc),
    )  # fmt: skip


@stage
def one_lobe(skins, row, width, rough_row, surface, place, share, entering):
    """Of one of them the hits (k,), its colour (3, k) and roughness (k,); width: rows of its colour."""
    m, found = len(surface), 0
    index, color, rough = np.empty(m, np.int64), np.empty((3, m), F), np.empty(m, F)
    for i in range(m):
        s, p = surface[i], place[i]
        if not (skins.flags[of.LAYERED, s] and skins.flags[of.SPECULAR, s]):
            continue
        if not entering[i] and skins.flags[of.REFRACTS, s]:
            continue
        wide = skins.values[rough_row, p] + skins.more[rough_row, p] * share[i]
        some = False
        for c in range(3):
            r = row + (c if width == 3 else 0)
            color[c, found] = skins.values[r, p] + skins.more[r, p] * share[i]
            some |= color[c, found] != ZERO
        if some and wide > MIRROR:
            index[found], rough[found] = i, wide
            found += 1
    return index[:found].copy(), color[:, :found].copy(), rough[:found].copy()


@inlined
def add_lamp(
    scene, lamp, prim, surface, place, share, entering, point, albedo, n_geometric, n, wo, cos_o, offset, origin, base,
    coat, sample, weight, key, number, buffer, lit, cut_off, radiance, counters,
):  # fmt: skip
    """direct._lit_by and _add_lit of one lamp."""
    m, rules, lamps, numbers, skins = len(prim), scene.rules, scene.lamps, scene.lamps.numbers[lamp], scene.skins
    kind, casts, falloff = lamps.kind[lamp], lamps.flags[lamp, of.CASTS], lamps.flags[lamp, of.FALLOFF]
    # What the surface sends on of it: diffuse, then its highlights.
    wi, cosine, diffuse, specular = illuminate(kind, falloff, numbers, point, n, offset)
    arriving, strength = np.empty((3, m), F), F(numbers[of.OF_DIFFUSE])
    for c in range(3):
        for i in range(m):
            arriving[c, i] = albedo[c, i] * (diffuse[i] * strength)
    if rules.whole[of.HAS_SPECULAR] and numbers[of.OF_SPECULAR] != 0:
        add_phong(skins, numbers, surface, place, share, wo, n, cos_o, wi, cosine, specular, arriving)
        add_highlight(kind, falloff, numbers, base, point, n_geometric, offset, arriving)
        add_highlight(kind, falloff, numbers, coat, point, n_geometric, offset, arriving)
    wanted = np.empty(m, np.bool_)
    for i in range(m):
        if casts and not scene.shapes.casts[prim[i]]:
            # What casts no shadow, not even on itself, gets no light through its back.
            gx, gy, gz = n_geometric[0, i], n_geometric[1, i], n_geometric[2, i]
            is_flat = n[0, i] == gx and n[1, i] == gy and n[2, i] == gz
            if not (is_flat or dot(wi[0, i], wi[1, i], wi[2, i], gx, gy, gz) > ZERO):
                for c in range(3):
                    arriving[c, i] = arriving[c, i] * ZERO
        any_light = arriving[0, i] != ZERO or arriving[1, i] != ZERO or arriving[2, i] != ZERO
        wanted[i] = any_light or rules.whole[of.UNLIT] != 0
    # Shadow rays are traced only where something would arrive, and enough of it.
    traces = casts and rules.whole[of.HAS_SHADOWS] != 0
    if traces and rules.whole[of.FAINT]:
        on_white = np.empty((3, m), F)
        for c in range(3):
            for i in range(m):
                on_white[c, i] = arriving[c, i] * (PI / specular[i])
        counters[of.N_CUT] += faint_light(
            rules.whole[of.LIGHT_LIMIT],
            sample,
            weight,
            on_white,
            wanted,
            buffer.unlit,
            buffer.scratch,
            buffer.residual,
        )
    index = np.nonzero(wanted)[0]
    found = len(index)
    light = take3(arriving, index)
    for c in range(3):
        for k in range(found):
            light[c, k] = light[c, k] * F(numbers[of.COLOR + c])
    if traces:
        counters[of.N_NOT_NEEDED] += m - found
        visible = visibility(
            scene,
            lamp,
            kind,
            falloff,
            numbers,
            index,
            surface,
            entering,
            origin,
            n_geometric,
            key,
            number,
            cut_off,
            counters,
        )
        for c in range(3):
            for k in range(found):
                light[c, k] = light[c, k] * visible[c, k]
        if len(lit):
            for k in range(found):
                if visible[0, k] > ZERO or visible[1, k] > ZERO or visible[2, k] > ZERO:
                    lit[index[k]] = U(lit[index[k]] + lamps.key[lamp])
    for c in range(3):
        for k in range(found):
            radiance[c, index[k]] += light[c, k]


@inlined
def add_highlight(kind, falloff, numbers, lobes, point, n_geometric, offset, arriving):
    """What rough lobes reflect of a lamp; lobes: of `one_lobe`."""
    index, color, shape = lobes
    if len(index) == 0:
        return
    seen = highlight(kind, falloff, numbers, shape, take3(point, index), take3(n_geometric, index), offset[index])
    strength = F(numbers[of.OF_SPECULAR])
    for c in range(3):
        for k in range(len(index)):
            arriving[c, index[k]] += color[c, k] * (seen[k] * strength)
