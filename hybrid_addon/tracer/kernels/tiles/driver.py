# SPDX-License-Identifier: GPL-3.0-or-later
"""The wave loop of tiles: the twin of integrator/whitted.py, with the camera rays of some samples at once."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call,assignment,operator,arg-type,call-arg"

from __future__ import annotations

import numpy as np
from numba import types

from ...core.rays import CAMERA_RAY
from ...materials.columns import ROWS
from .. import interaction, packets, sampler
from ..declare import ArrayTypes, b1, f4, f8, i2, i4, i8, inlined, int64, kernel, stage, u4, written
from . import records as of
from .hits import camera_rays, nearest, take3
from .images import sky
from .light import direct_light
from .microfacets import roughen, share_lobes
from .skins import color_of, number_of, places, tint
from .spawn import (
    AHEAD,
    MAX_BRANCHES,
    TINT,
    cross,
    cut_off,
    draw_some,
    follow_all,
    mirror_directions,
    refracted_directions,
    share_out,
    within,
)  # fmt: skip
from .through import add_lamps
from .waves import (
    add_limited,
    branch_weights,
    chosen,
    drawn_weights,
    first_rays,
    followed_weights,
    highlit,
    keep_where,
    kinds_of,
    may_pass,
    new_rays,
    next_generation,
    note_escaped,
    note_hits,
    renewed,
    shading,
    some_weights,
    sorted_out,
    sound,
    still_going,
    view_cosines,
)  # fmt: skip

F, D, U = np.float32, np.float64, np.uint32
ZERO, ONE, MINUS_ONE, ONE2 = F(0), F(1), F(-1), np.int16(1)
TILE = 1024
"""Camera rays of a tile: what is known of its rays fits into a core's cache, and a wave is long beside its calls."""

BASE_COLOR, EMISSION_ROW, LOCAL_ROW = ROWS["base_color"].start, ROWS["emission"].start, ROWS["local"].start
hit_points, smooth_normals = stage(interaction.hit_points), stage(interaction.smooth_normals)
keyed = stage(sampler.keyed)


@stage
def add_escaped(scene, gone, buffer, counters):
    """whitted.add_escaped."""
    index = note_escaped(scene.rules, gone, len(scene.solids.ior) - 1, buffer, counters)
    if len(index) == 0 or scene.rules.whole[of.HAS_WORLD] == 0:
        return
    seen_by = 1 if gone.kind[index[0]] == CAMERA_RAY else 0
    light, mixed = sky(scene.world, scene.images, seen_by, take3(gone.direction, index)), False
    for i in index:
        mixed |= (gone.kind[i] == CAMERA_RAY) != (seen_by == 1)
    if mixed:
        other = sky(scene.world, scene.images, 1 - seen_by, take3(gone.direction, index))
        for k in range(len(index)):
            if (gone.kind[index[k]] == CAMERA_RAY) != (seen_by == 1):
                for c in range(3):
                    light[c, k] = other[c, k]
    for c in range(3):
        for k in range(len(index)):
            i = index[k]
            buffer.radiance[c, gone.sample[i]] += D(gone.throughput[c, i] * light[c, k])


@inlined
def find(scene, is_first, rays, counters):
    """whitted._closest_hits: prim, t, normal, toward."""
    trees, n = scene.trees, len(rays.t_max)
    if is_first:
        return nearest(scene.shapes, trees, of.FIRST, rays.origin, rays.direction, counters)
    camera, address = 0, trees.address
    for i in range(n):
        camera += rays.kind[i] == CAMERA_RAY
    same = address[of.CAMERA, 0] == address[of.LATER, 0] and address[of.CAMERA, 1] == address[of.LATER, 1]
    if camera == 0 or same:
        return nearest(scene.shapes, trees, of.LATER, rays.origin, rays.direction, counters)
    prim, t, normal, toward = np.empty(n, np.int32), np.empty(n), np.empty((3, n), F), np.empty(n)
    for which in range(2):
        some = np.nonzero((rays.kind == CAMERA_RAY) == (which == 0))[0]
        p, s, a, b = nearest(
            scene.shapes, trees, of.CAMERA + which, take3(rays.origin, some), take3(rays.direction, some), counters
        )
        for k in range(len(some)):
            i = some[k]
            prim[i], t[i], toward[i] = p[k], s[k], b[k]
            for c in range(3):
                normal[c, i] = a[c, k]
    return prim, t, normal, toward


@inlined
def add_light(
    scene, pixels, first, rays, prim, surface, entering, point, n_geometric, n_shading, weights, wo, offset, outer,
    place, share, buffer, counters,
):  # fmt: skip
    """whitted.add_light of hits (n,): what they emit, and what lights and the world bring them."""
    rules, skins, n = scene.rules, scene.skins, len(prim)
    emitted, brought, lit = np.zeros((3, n), F), np.zeros((3, n), F), np.zeros(n, np.uint32)
    if rules.whole[of.EMISSION]:
        light = color_of(skins, EMISSION_ROW, place, share)
        tint(scene.shapes, skins, scene.images, 3, prim, surface, point, light)
        keep_where(skins.flags[of.EMITS], surface, light, emitted)
    if rules.whole[of.LOCAL]:
        index = shading(skins.flags, surface)
        p, s, e, x = prim[index], surface[index], entering[index], take3(point, index)
        sample, at, part = rays.sample[index], place[index], share[index]
        count = len(pixels.u)
        key, number = keyed(pixels.key, first, count, sample, rays.path[index])
        local, weight = number_of(skins, LOCAL_ROW, at, part), take3(rays.throughput, index)
        for c in range(3):
            for k in range(len(index)):
                weight[c, k] = weight[c, k] * local[k]
        color = color_of(skins, BASE_COLOR, at, part)
        tint(scene.shapes, skins, scene.images, 0, p, s, x, color)
        reached = np.zeros(len(index) if len(buffer.signature) else 0, np.uint32)
        light = direct_light(
            scene, p, s, at, part, color, e, x, take3(n_geometric, index), take3(n_shading, index), take3(wo, index),
            offset[index], take3(outer, index), some_weights(weights, index), sample, weight, key, number, buffer,
            reached, counters,
        )  # fmt: skip
        for c in range(3):
            for k in range(len(index)):
                brought[c, index[k]] = local[k] * light[c, k]
        for k in range(len(reached)):
            lit[index[k]] = reached[k]
    add_limited(F(rules.real[of.INDIRECT_LIMIT]), rays, emitted, brought, buffer)
    if len(buffer.signature):
        note_hits(F(rules.real[of.IMPORTANCE]), scene.shapes.identity, rays, prim, entering, lit, buffer.signature)


@stage
def spawn(
    scene, pixels, first, rays, prim, surface, entering, point, n_geometric, n_shading, wo, offset, outer, t, place,
    share, buffer, ended, counters,
):  # fmt: skip
    """spawn.spawn of hits (n,): the next wave."""
    rules, skins, solids = scene.rules, scene.skins, scene.solids
    # Rough hits leave by microfacets, those of camera rays by several each.
    is_rough = rules.whole[of.ROUGH] != 0
    facets = roughen(
        skins, rules.whole[of.ROUGH], pixels.key, len(pixels.u), first, rays, surface, place, share, wo, n_shading,
        n_geometric,
    )  # fmt: skip
    if len(facets.index):
        index = facets.index
        rays = renewed(chosen(rays, index), facets.throughput, facets.path)
        prim, surface, entering, offset, t = prim[index], surface[index], entering[index], offset[index], t[index]
        point, n_geometric, n_shading = take3(point, index), take3(n_geometric, index), facets.normals
        wo, outer, place, share = take3(wo, index), take3(outer, index), place[index], share[index]
    n, cos_o = len(prim), view_cosines(wo, n_shading)
    tinted = color_of(skins, TINT, place, share)
    tint(scene.shapes, skins, scene.images, 6, prim, surface, point, tinted)
    reflected, transmitted, cos_i, eta, blurs = share_out(
        skins, solids, prim, surface, place, share, rays.throughput, entering, cos_o, rays.media, tinted,
        F(rules.real[of.INDIRECT]),
    )  # fmt: skip
    if is_rough:
        share_lobes(facets, rays.throughput, eta, reflected, transmitted)
        for i in range(n):
            blurs[i] = len(facets.index) > 0 and facets.is_rough[i]
    # Those with a weight, within depth; of these the smallest are cut, as far as the error budget goes.
    weight, sample, factor = followed_weights(rules.whole[of.MAX_DEPTH], rays, reflected, transmitted, eta)
    objects = scene.shapes.object
    within(weight[0], rays.depth < rules.whole[of.MAX_DEPTH], rays.sample, objects, prim, buffer, counters, ended)
    within(
        weight[1], may_pass(rules.whole[of.MAX_DEPTH], rays, eta), rays.sample, objects, prim, buffer, counters, ended
    )
    going = np.empty(2 * n, np.bool_)
    branches = branch_weights(rays.kind, weight, eta, going)
    if rules.whole[of.LIMIT]:
        cut_off(sample, branches, rules.whole[of.LIMIT], rules.released, buffer, counters)
        still_going(weight, rays.kind, eta, branches, going)
    if (rules.whole[of.MOST_RAYS] or 2 * n > MAX_BRANCHES) and not follow_all(
        sample,
        branches,
        buffer.followed,
        buffer.scratch,
        rules.whole[of.MOST_BRANCHES],
        rules.whole[of.MOST_RAYS],
        AHEAD,
    ):
        draw_some(
            pixels.key, len(pixels.u), first, sample, branches, factor, rules.whole[of.MOST_BRANCHES],
            rules.whole[of.MOST_RAYS], buffer, counters,
        )  # fmt: skip
        drawn_weights(factor, reflected, transmitted, going)
    mirrored, bent, through = kinds_of(rules, eta, going)
    counters[of.N_REFLECTED] += len(mirrored)
    counters[of.N_REFRACTED] += len(bent)
    counters[of.N_STRAIGHT] += len(through)
    vacuum = len(solids.ior) - 1
    curved = is_rough or len(scene.shapes.normals) > 0
    back = mirror_directions(take3(wo, mirrored), take3(n_shading, mirrored), take3(n_geometric, mirrored), curved)
    on = refracted_directions(
        take3(wo, bent), take3(n_shading, bent), take3(n_geometric, bent), cos_i[bent], eta[bent], curved
    )
    unlit = highlit(skins.flags[of.REFRACTS], surface, entering, blurs)
    children = new_rays(
        rays, mirrored, bent, through, outer, point, n_geometric, offset, back, on, reflected, transmitted, t, unlit
    )
    cross(rays.media, mirrored, bent, through, prim, entering, solids.rank, vacuum, children.media, counters)
    return children


def _record(record, *fields):
    return types.NamedTuple(fields, record)


_u8 = ArrayTypes(types.uint64)
_SCENE = _record(
    of.Scene,
    _record(
        of.Shapes, f8[2], f8[2], f4[1], f4[2], f4[2], b1[1], i8[1], i8[1], b1[1], b1[1], b1[1], f4[2], u4[1]
    ),
    _record(of.Trees, _u8[2], i8[2], i4[1]),
    _record(of.Skins, f4[2], f4[2], i8[1], f4[1], f8[1], b1[2], i8[2]),
    _record(of.Images, _u8[1], i8[2], f8[2], f4[2]),
    _record(of.World, i8[1], f4[2], f4[3], f4[1], f4[1], f4[2], f4[4]),
    _record(of.Solids, i4[1], f8[1], i8[1]),
    _record(of.Lamps, i8[1], u4[1], b1[2], f8[2], f8[3]),
    _record(of.Lamps, i8[1], u4[1], b1[2], f8[2], f8[3]),
    _record(of.Rules, i8[1], f8[1], f8[1], i8[1]),
)  # fmt: skip
_PIXELS = _record(of.Pixels, *map(written, (u4[1], i8[1], i8[1], f8[1], f8[1])))
_BUFFER = _record(
    of.Buffer, written(f8[2]), *[written(f8[1])] * 3, *[written(i8[1])] * 4, written(i2[1]), written(u4[1])
)


_ARGUMENTS = _SCENE, _PIXELS, int64, int64, int64, _BUFFER, written(i8[1]), written(i8[1])
_of_tiles = kernel("tracer.integrator.tiles.trace_tiles", [_ARGUMENTS], tables=(6, 7), late=True)


@(_of_tiles if packets.HAS_QUERIES else lambda function: function)
def trace_tiles(scene, pixels, first, start, stop, buffer, ended, counters):
    """See there."""
    if stop <= start:
        return True
    rules, shapes, count = scene.rules, scene.shapes, len(pixels.u)
    size, vacuum = max(TILE // count, 1), len(scene.solids.ior) - 1
    for p in range(start, stop, size):
        q = min(p + size, stop)
        origin, direction, t_max = camera_rays(rules.camera, pixels.x[p:q], pixels.y[p:q], pixels.u, pixels.v)
        rays = first_rays(origin, direction, t_max, p * count, scene.solids.rows[0], vacuum)
        counters[of.N_CAMERA] += len(t_max)
        wave = 0
        while len(rays.t_max):
            if wave:
                next_generation(rays.sample, wave, buffer)
            index = sound(rays, buffer, counters)
            if len(index) < len(rays.t_max):
                rays = chosen(rays, index)
            prim4, t, normal, toward = find(scene, wave == 0, rays, counters)
            hit, gone = sorted_out(rules, shapes.ray_traced, wave == 0, rays.sample, rays.t_max, prim4, t, buffer)
            if wave and len(scene.met.kind):
                add_lamps(
                    scene.met, F(rules.real[of.DIRECT_LIMIT]), rules.real[of.INDIRECT], F(rules.real[of.IMPORTANCE]),
                    rays, t, buffer, counters,
                )  # fmt: skip
            if len(gone):
                add_escaped(scene, chosen(rays, gone), buffer, counters)
            rays = chosen(rays, hit)
            if len(hit) == 0:
                break
            # Recompute the hits from the exact geometry.
            t = t[hit]
            prim, surface, entering, point, n_geometric, offset, wo, outer = hit_points(
                shapes.surface,
                shapes.extent,
                prim4[hit],
                t,
                take3(normal, hit),
                toward[hit],
                rays.origin,
                rays.direction,
            )
            n_shading, weights = n_geometric, np.empty((2, 0))
            if len(shapes.normals):
                _, n_shading, weights = smooth_normals(
                    shapes.smooth, shapes.normals, shapes.weights, prim, point, n_geometric, entering
                )
            place, share = places(scene.skins, surface, view_cosines(wo, n_shading))
            add_light(
                scene, pixels, first, rays, prim, surface, entering, point, n_geometric, n_shading, weights, wo, offset,
                outer, place, share, buffer, counters,
            )  # fmt: skip
            if not (rules.whole[of.HAS_REFLECTION] or rules.whole[of.HAS_REFRACTION]):
                break
            rays = spawn(
                scene, pixels, first, rays, prim, surface, entering, point, n_geometric, n_shading, wo, offset, outer,
                t, place, share, buffer, ended, counters,
            )  # fmt: skip
            wave += 1
    return True
