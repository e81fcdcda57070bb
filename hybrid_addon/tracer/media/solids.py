# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding the solids of a scene: closed bodies that transmit, their order, and those too thin to be solids.

What is closed is asked of each part of a mesh for itself (see `parts`). The parts of one object that are made of the
same are one solid, and those turned inside out that lie within it are its cavities: the inside of a bottle. The others
that are turned inside out are no solids.

Solids that touch are made to overlap: where two surfaces coincide, Embree finds either, and a ray's new origin lies
beyond both. So among solids whose bounds meet the smaller one swells by SWELLING, more than an origin's offset and less
than any pixel; it then displaces the larger one (see `media`), and what was a lottery is one clean interface. Likewise
a glass that stands on a table swells into it: its foot is then below the table top, which rays in it meet first.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64, Scene, TriangleMesh
from ..core.constants import MAX_MEDIA, MAX_PILE, MAX_SWELLING, NEIGHBOUR_SWELLING, SWELLING, THIN_CLEARANCE, THIN_WALL
from ..core.vectors import cross, dot
from ..geometry.flatten import Geometry
from ..geometry.parts import Parts, closed_by_number, closed_parts
from ..geometry.triangles import corner_bounds, facets_of, used_of
from ..materials.surfaces import SurfaceTable
from .near import Near, find_near
from .nested import Media
from .touching import Bodies, neighbour_extent

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]


def find_solids(scene: Scene, geometry: Geometry, table: SurfaceTable) -> tuple[Geometry, Media]:
    """The media of a scene, and its geometry with touching solids swollen and thin walls marked by a larger extent."""
    transmits = table.bounds_solids[geometry.surface]
    if not (transmits & (table.refracts | table.absorbs)[geometry.surface]).any():
        return geometry, Media()
    geometry, bodies = _bodies(scene, geometry, transmits)
    is_thin = np.abs(bodies.thickness) < THIN_WALL * bodies.extent
    thin = np.zeros(len(transmits), bool)
    thin[bodies.take(np.flatnonzero(is_thin)).prims] = True
    if thin.any():
        of_flattened = thin[: geometry.flattened_count]
        geometry = replace(geometry, extent=np.where(of_flattened, THIN_CLEARANCE * geometry.extent, geometry.extent))
    parts = bodies.take(np.flatnonzero(~is_thin))
    solids = _grouped(geometry, parts)
    geometry, rows = _swell(geometry, solids)
    rank = np.full(len(transmits), len(solids), np.int32)
    rank[solids.prims] = np.repeat(np.arange(len(solids)), solids.size)
    return geometry, Media(
        rank,
        np.append(table.ior[solids.surface], 1.0),
        rows,
        thin if thin.any() else None,
        solids.low,
        solids.high,
        *_absorption(geometry, table, solids),
        _near(geometry, parts, rank < len(solids)),
    )


def _near(geometry: Geometry, parts: Bodies, is_solid: Bools) -> Near | None:
    """The triangles of those parts that are solids, where they come near one another."""
    first = parts.prims[parts.starts] if len(parts) else parts.size
    meshes = parts.take(np.flatnonzero(is_solid[first] & (first < geometry.triangle_count)))
    return find_near(geometry, meshes.prims, meshes.size)


def _absorption(geometry: Geometry, table: SurfaceTable, solids: Bodies) -> tuple[Float64 | None, Float64 | None]:
    """Of solids and of vacuum (3, b + 1), for all rays and for shadow rays; None where nothing absorbs.

    Shadow rays do not meet the surface of a solid that casts no shadow, hence do not know when they are in it.
    """
    inside = solids.surface
    if not table.absorbs[inside].any():
        return None, None
    absorption = np.append(table.absorption[:, inside] * table.absorbs[inside], np.zeros((3, 1)), axis=1)
    return absorption, absorption * np.append(geometry.shadow[solids.prims[solids.starts]], False)


# ------------------------------------------------------------------------------------------------ closed bodies


def _bodies(scene: Scene, g: Geometry, transmits: Bools) -> tuple[Geometry, Bodies]:
    """Closed bodies that transmit and that all rays can see, and the geometry with their seams welded."""
    seen, nt, ns = g.camera & g.secondary, g.triangle_count, g.sphere_count
    start = np.flatnonzero(np.diff(g.object[:nt], prepend=-1))
    stop = np.append(start[1:], nt)
    clear = np.logical_or.reduceat(transmits[:nt], start) if len(start) else np.zeros(0, bool)
    known: dict[int, Parts] = {}
    vertices, prims, part, parts = g.vertices, [np.zeros(0, np.intp)], [np.zeros(0, np.intp)], 0
    for i in np.flatnonzero(clear & seen[start]).tolist():
        run = np.arange(start[i], stop[i])
        number = scene.instances[g.object[start[i]]].mesh
        mesh = scene.meshes[number]
        if number not in known:
            known[number] = closed_parts(mesh)
        found = known[number].part[g.source[run]]
        there = np.flatnonzero(found >= 0)
        if len(there) == 0:
            continue
        prims.append(run[there])
        part.append(parts + found[there])
        parts += int(np.max(known[number].part)) + 1
        vertices = _welded(g, vertices, run, mesh, known[number].place)
    g = _moved(g, vertices)
    of_meshes = _measured(g, np.concatenate(prims), np.concatenate(part), transmits)
    balls = np.flatnonzero((transmits & seen)[nt : nt + ns])
    center, radius = g.sphere_center[balls], g.sphere_radius[balls]
    return g, Bodies(
        np.concatenate([of_meshes.prims, balls + nt]),
        np.concatenate([of_meshes.size, np.ones(len(balls), np.intp)]),
        np.concatenate([of_meshes.low, center - radius[:, None]]),
        np.concatenate([of_meshes.high, center + radius[:, None]]),
        np.concatenate([of_meshes.extent, g.extent[balls + nt]]),
        np.concatenate([of_meshes.thickness, radius * (2 / 3)]),
        np.concatenate([of_meshes.surface, g.surface[balls + nt]]),
    )


def _measured(g: Geometry, prims: Numbers, part: Numbers, transmits: Bools) -> Bodies:
    """Parts, of triangles `prims` (p,) with the part (p,) that each belongs to; not those that transmit nowhere."""
    _, part = np.unique(part, return_inverse=True)
    part = part.reshape(-1)
    clear = (np.bincount(part, transmits[prims]) > 0)[part]
    prims, part = prims[clear], part[clear]
    order = np.argsort(part, kind="stable")
    prims, runs = prims[order], np.flatnonzero(np.diff(part[order], prepend=-1))
    size = np.diff(runs, append=len(prims))
    if len(prims) == 0:
        nothing = np.zeros((0, 3))
        return Bodies(prims, size, nothing, nothing, nothing[:, 0], nothing[:, 0], prims)
    low, high = corner_bounds(g.vertices, g.triangles[prims])
    low = np.minimum.reduceat(low, runs, axis=0).astype(np.float64)
    high = np.maximum.reduceat(high, runs, axis=0).astype(np.float64)
    corners = g.vertices[g.triangles[prims]].astype(np.float64)
    a, b, c = ((corners[:, i] - np.repeat((low + high) / 2, size, axis=0)).T for i in range(3))
    normal = cross(b - a, c - a)
    area2 = np.add.reduceat(np.sqrt(dot(normal, normal)), runs)
    volume6 = np.add.reduceat(dot(a, cross(b, c)), runs)
    first = np.minimum.reduceat(np.where(transmits[prims], prims, len(transmits)), runs)
    extent = np.maximum.reduceat(g.extent[prims], runs).astype(np.float64)
    return Bodies(prims, size, low, high, extent, 2 / 3 * volume6 / area2, g.surface[first])


def _grouped(g: Geometry, parts: Bodies) -> Bodies:
    """Solids out of parts, the smallest first: what counts is the size of their largest part.

    Parts of one object and surface are one, with those parts turned inside out that lie within: of their own surface,
    or else the smallest.
    """
    owner = g.object[parts.prims[parts.starts]] if len(parts) else parts.size
    outward = np.flatnonzero(parts.thickness > 0)
    key = owner * (int(np.max(g.surface, initial=0)) + 1) + parts.surface
    _, group = np.unique(key[outward], return_inverse=True)
    group = group.reshape(-1)
    count = int(np.max(group, initial=-1)) + 1
    low, high, size = np.full((count, 3), np.inf), np.full((count, 3), -np.inf), np.zeros(count)
    np.minimum.at(low, group, parts.low[outward])
    np.maximum.at(high, group, parts.high[outward])
    np.maximum.at(size, group, ((parts.high - parts.low) ** 2).sum(axis=1)[outward])
    of_part = np.full(len(parts), -1)
    of_part[outward] = group
    first = np.full(count, len(parts))
    np.minimum.at(first, group, outward)
    for hole in np.flatnonzero(parts.thickness < 0).tolist():
        around = (low <= parts.low[hole]) & (high >= parts.high[hole])
        able = np.flatnonzero(around.all(axis=1) & (owner[first] == owner[hole]))
        if len(able):
            other = parts.surface[first[able]] != parts.surface[hole]
            of_part[hole] = able[np.lexsort((size[able], other))[0]]
    order = np.lexsort((parts.prims[parts.starts[first]], size)) if count else np.zeros(0, np.intp)
    rank = np.empty(count, np.intp)
    rank[order] = np.arange(count)
    kept = np.flatnonzero(of_part >= 0)
    of_prim = np.repeat(np.where(of_part >= 0, rank[of_part] if count else -1, -1), parts.size)
    sorted_prims = np.lexsort((parts.prims, of_prim))[np.count_nonzero(of_prim < 0) :]
    chosen = parts.take(kept)
    extent = np.zeros(count)
    np.maximum.at(extent, rank[of_part[kept]], chosen.extent)
    return Bodies(
        parts.prims[sorted_prims],
        np.bincount(of_prim[of_prim >= 0], minlength=count),
        low[order],
        high[order],
        extent,
        parts.thickness[first[order]],
        parts.surface[first[order]],
    )


# ------------------------------------------------------------------------------------------------ moving vertices


def _welded(g: Geometry, vertices: Float32, run: Numbers, mesh: TriangleMesh, place: Numbers | None) -> Float32:
    """The vertices of a scene, those of the instance with the triangles `run` (n,) where `place` (nv,) puts them."""
    if place is None:
        return vertices
    source = g.source[run]
    base = g.triangles[run, 0] - mesh.triangles[source, 0]
    whole = (
        np.bincount(source, minlength=len(mesh.triangles))[source] == 1
    )  # split triangles have vertices of their own
    moved = np.flatnonzero(place != np.arange(len(place)))
    if not whole.any() or len(moved) == 0:
        return vertices
    first = int(np.min(base[whole]))
    vertices = vertices.copy()
    vertices[first + moved] = vertices[first + place[moved]]
    return vertices


def _moved(g: Geometry, vertices: Float32) -> Geometry:
    """The geometry with its vertices elsewhere (nv, 3)."""
    changed = (vertices != g.vertices).any(axis=1)
    if not changed.any():
        return g
    prims = np.flatnonzero(changed[g.triangles].any(axis=1))
    facets, weights, extent = g.facets.copy(), g.weights.copy(), g.extent.copy()
    moved, shares, size, sound = facets_of(vertices[g.triangles[prims]])
    facets[prims] = np.where(sound[:, None], moved, facets[prims])
    weights[prims] = np.where(sound[:, None], shares, weights[prims])
    extent[prims] = np.maximum(size, extent[prims])
    return replace(g, vertices=vertices, facets=facets, weights=weights, extent=extent)


# ------------------------------------------------------------------------------------------------ touching solids


def _swell(geometry: Geometry, solids: Bodies) -> tuple[Geometry, int]:
    """Let solids swell into larger ones and into other things that they may touch; and how many a ray may be in."""
    count = len(solids)
    if count == 0:
        return geometry, 0
    if count > MAX_PILE:
        return geometry, MAX_MEDIA
    gap = SWELLING * solids.extent[:, None]
    low, high = solids.low - gap, solids.high + gap
    meets = (low[:, None] <= solids.high).all(axis=2) & (high[:, None] >= solids.low).all(axis=2)
    meets = meets | meets.T
    np.fill_diagonal(meets, False)
    neighbour = neighbour_extent(geometry, solids)
    level = (neighbour > 0).astype(float)
    for i in range(count - 2, -1, -1):
        level[i] = max(level[i], 1 + np.max(level[i + 1 :], where=meets[i, i + 1 :], initial=-1.0))
    scale = np.maximum(np.max(np.where(meets, solids.extent, 0.0), axis=1), solids.extent)
    amount = level * SWELLING * scale + NEIGHBOUR_SWELLING * neighbour
    diagonal = np.sqrt(((solids.high - solids.low) ** 2).sum(axis=1))
    amount = np.minimum(amount, MAX_SWELLING * diagonal)
    reach = np.maximum(amount, gap[:, 0])[:, None]
    return _swollen(geometry, solids, amount), _most_at_once(solids.low - reach, solids.high + reach)


def _most_at_once(low: Float64, high: Float64) -> int:
    """In how many of the boxes (b, 3) a place can be at once, or MAX_MEDIA if that is less.

    The first such place in all three directions lies in three planes, each the lowest of some box.
    """
    most = 0
    for i in range(len(low)):
        there = (low <= high[i]).all(axis=1) & (high >= low[i]).all(axis=1)
        there &= low[:, 2] <= low[i, 2]
        bottom, top = low[there], high[there]
        if len(bottom) <= most:
            continue
        within = [(bottom[:, None, k] <= bottom[:, k]) & (bottom[:, k] <= top[:, None, k]) for k in (0, 1)]
        most = max(most, int(np.max(within[0].T.astype(np.float32) @ within[1].astype(np.float32))))
        if most >= MAX_MEDIA:
            return MAX_MEDIA
    return most


def _swollen(g: Geometry, solids: Bodies, amount: Float64) -> Geometry:
    """Move the vertices of solids outward by `amount` (b,), along the mean normals of their places."""
    vertices, radius = g.vertices.copy(), g.sphere_radius.copy()
    for body in np.flatnonzero(amount).tolist():
        prims = solids.of(body)
        if prims[0] >= g.triangle_count:
            radius[prims[0] - g.triangle_count] += amount[body]
            continue
        triangles = g.triangles[prims]
        used = used_of(triangles)
        number = np.empty(int(used[-1] - used[0]) + 1, np.intp)
        number[used - used[0]] = np.arange(len(used))
        points = g.vertices[used].astype(np.float64)
        normal = _place_normals(points, number[triangles - used[0]])
        vertices[used] = (points + amount[body] * normal).astype(np.float32)
    return replace(_moved(g, vertices), sphere_radius=radius)


def _place_normals(points: Float64, triangles: Numbers) -> Float64:
    """Unit normals (n, 3) of vertices, area weighted over all triangles that touch their place."""
    a, b, c = (points[triangles[:, i]].T for i in range(3))
    face = cross(b - a, c - a)
    place = np.arange(len(points))
    if not closed_by_number(triangles):
        place = np.unique(points, axis=0, return_inverse=True)[1].reshape(-1)
    total = np.stack(
        [
            np.bincount(place[triangles].ravel(), np.repeat(face[i], 3), minlength=int(np.max(place)) + 1)
            for i in range(3)
        ]
    )
    length = np.sqrt(dot(total, total))
    return np.asarray((total / np.where(length > 0, length, 1.0)).T[place])
