"""Finding the solids of a scene: closed bodies that transmit, their order, and those too thin to be solids.

Solids that touch are made to overlap: where two surfaces coincide, Embree finds either, and a ray's new origin lies
beyond both. So among solids whose bounds meet the smaller one swells by SWELLING, more than an origin's offset and less
than any pixel; it then displaces the larger one (see `media`), and what was a lottery is one clean interface. Likewise
a glass that stands on a table swells into it: its foot is then below the table top, which rays in it meet first.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..scene import Float64, Int32, Scene, TriangleMesh
from .constants import (
    MAX_MEDIA,
    MAX_PILE,
    MAX_SWELLING,
    NEIGHBOUR_SWELLING,
    SWELLING,
    THIN_CLEARANCE,
    THIN_WALL,
)
from .geometry import Geometry
from .media import Media
from .soup import corner_bounds, facets_of, used_of
from .surfaces import SurfaceTable
from .touching import Bodies, neighbour_extent, primitives_of
from .vectors import cross, dot

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]


def find_solids(scene: Scene, geometry: Geometry, table: SurfaceTable) -> tuple[Geometry, Media]:
    """The media of a scene, and its geometry with touching solids swollen and thin walls marked by a larger extent."""
    transmits = table.bounds_solids[geometry.surface]
    if not (transmits & (table.refracts | table.absorbs)[geometry.surface]).any():
        return geometry, Media()
    bodies = _bodies(scene, geometry, transmits)
    is_thin = np.abs(bodies.thickness) < THIN_WALL * bodies.extent
    thin = np.zeros(len(transmits), bool)
    thin[primitives_of(bodies.take(np.flatnonzero(is_thin)))] = True
    if thin.any():
        geometry = replace(geometry, extent=np.where(thin, THIN_CLEARANCE * geometry.extent, geometry.extent))
    solids = bodies.take(np.flatnonzero((bodies.thickness > 0) & ~is_thin))
    diagonal = ((solids.high - solids.low) ** 2).sum(axis=1)
    solids = solids.take(np.lexsort((solids.first, diagonal)))
    geometry, rows = _swell(geometry, solids)
    rank = np.full(len(transmits), len(solids.first), np.int32)
    rank[primitives_of(solids)] = np.repeat(np.arange(len(solids.first)), solids.size)
    inside = _inside_of(geometry, transmits, solids)
    return geometry, Media(
        rank,
        np.append(table.ior[inside], 1.0),
        rows,
        thin if thin.any() else None,
        solids.low,
        solids.high,
        *_absorption(geometry, table, solids, inside),
    )


def _inside_of(geometry: Geometry, transmits: Bools, solids: Bodies) -> Numbers:
    """The surface (b,) that says what each solid is made of: that of its first primitive that transmits."""
    clear = np.flatnonzero(transmits)
    first = clear[np.searchsorted(clear, solids.first)] if len(solids.first) else solids.first
    return geometry.surface[first].astype(np.intp)


def _absorption(
    geometry: Geometry, table: SurfaceTable, solids: Bodies, inside: Numbers
) -> tuple[Float64 | None, Float64 | None]:
    """Of solids and of vacuum (3, b + 1), for all rays and for shadow rays; None where nothing absorbs.

    Shadow rays do not meet the surface of a solid that casts no shadow, hence do not know when they are in it.
    """
    if not table.absorbs[inside].any():
        return None, None
    absorption = np.append(table.absorption[:, inside] * table.absorbs[inside], np.zeros((3, 1)), axis=1)
    return absorption, absorption * np.append(geometry.shadow[solids.first], False)


def _bodies(scene: Scene, geometry: Geometry, transmits: Bools) -> Bodies:
    """Closed bodies that transmit and that all rays can see."""
    g, nt, ns = geometry, geometry.triangle_count, geometry.sphere_count
    seen = g.camera & g.secondary
    start = np.flatnonzero(np.diff(g.object[:nt], prepend=-1))
    size = np.diff(start, append=nt)
    clear = np.logical_or.reduceat(transmits[:nt], start) if len(start) else np.zeros(0, bool)
    chosen = np.flatnonzero(clear & seen[start])
    closed: dict[int, bool] = {}
    for body in g.object[start[chosen]].tolist():
        mesh = scene.instances[body].mesh
        if mesh not in closed:
            closed[mesh] = is_closed(scene.meshes[mesh])
    kept = [i for i in chosen.tolist() if closed[scene.instances[g.object[start[i]]].mesh]]
    start, size = start[kept], size[kept]
    low, high, extent, thickness = _measure(g, start, size)
    balls = np.flatnonzero((transmits & seen)[nt : nt + ns])
    center, radius = g.sphere_center[balls], g.sphere_radius[balls]
    return Bodies(
        np.concatenate([start, balls + nt]),
        np.concatenate([size, np.ones(len(balls), np.intp)]),
        np.concatenate([low, center - radius[:, None]]),
        np.concatenate([high, center + radius[:, None]]),
        np.concatenate([extent, g.extent[balls + nt]]),
        np.concatenate([thickness, radius * (2 / 3)]),
    )


def _measure(g: Geometry, start: Numbers, size: Numbers) -> tuple[Float64, Float64, Float64, Float64]:
    """Bounds (b, 3), extents (b,) and signed thicknesses 2 V / A (b,) of meshes given by their runs of triangles."""
    if len(start) == 0:
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0)
    prims = np.concatenate([np.arange(f, f + n) for f, n in zip(start.tolist(), size.tolist(), strict=True)])
    low, high, extent = _bounds(g, prims)
    corners = g.vertices[g.triangles[prims]].astype(np.float64)
    a, b, c = ((corners[:, i] - np.repeat((low + high) / 2, size, axis=0)).T for i in range(3))
    normal = cross(b - a, c - a)
    runs = np.concatenate([[0], np.cumsum(size)[:-1]])
    area2 = np.add.reduceat(np.sqrt(dot(normal, normal)), runs)
    volume6 = np.add.reduceat(dot(a, cross(b, c)), runs)
    return low, high, extent, 2 / 3 * volume6 / area2


def _bounds(g: Geometry, prims: Numbers) -> tuple[Float64, Float64, Float64]:
    """Bounds (b, 3) and extents (b,) of the objects whose triangles `prims` are, in order."""
    if len(prims) == 0:
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)
    runs = np.flatnonzero(np.diff(g.object[prims], prepend=-1))
    low, high = corner_bounds(g.vertices, g.triangles[prims])
    low = np.minimum.reduceat(low, runs, axis=0).astype(np.float64)
    high = np.maximum.reduceat(high, runs, axis=0).astype(np.float64)
    return low, high, np.maximum.reduceat(g.extent[prims], runs).astype(np.float64)


def is_closed(mesh: TriangleMesh) -> bool:
    """Whether every edge is walked once each way: by vertex numbers, or else by the places of the vertices."""
    used = mesh.vertices[used_of(mesh.triangles)]
    if not np.isfinite(used).all():
        return False
    if _edges_match(mesh.triangles, len(mesh.vertices)):
        return True
    _, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return _edges_match(place.reshape(-1)[mesh.triangles].astype(np.int32), len(mesh.vertices))


def _edges_match(triangles: Int32, nv: int) -> bool:
    a, b = triangles.astype(np.int64).ravel(), triangles[:, [1, 2, 0]].astype(np.int64).ravel()
    return bool((np.sort(a * nv + b) == np.sort(b * nv + a)).all())


# ------------------------------------------------------------------------------------------------ touching solids


def _swell(geometry: Geometry, solids: Bodies) -> tuple[Geometry, int]:
    """Let solids swell into larger ones and into other things that they may touch; and how many a ray may be in."""
    count = len(solids.first)
    if count == 0:
        return geometry, 0
    if count > MAX_PILE:
        return geometry, MAX_MEDIA
    gap = SWELLING * solids.extent[:, None]
    low, high = solids.low - gap, solids.high + gap
    meets = (low[:, None] <= solids.high).all(axis=2) & (high[:, None] >= solids.low).all(axis=2)
    meets = meets | meets.T
    np.fill_diagonal(meets, False)
    rows = min(MAX_MEDIA, 2 + int(np.max(meets.sum(axis=1))))  # a solid may overlap itself
    neighbour = neighbour_extent(geometry, solids)
    level = (neighbour > 0).astype(float)
    for i in range(count - 2, -1, -1):
        level[i] = max(level[i], 1 + np.max(level[i + 1 :], where=meets[i, i + 1 :], initial=-1.0))
    scale = np.maximum(np.max(np.where(meets, solids.extent, 0.0), axis=1), solids.extent)
    amount = level * SWELLING * scale + NEIGHBOUR_SWELLING * neighbour
    diagonal = np.sqrt(((solids.high - solids.low) ** 2).sum(axis=1))
    return _swollen(geometry, solids, np.minimum(amount, MAX_SWELLING * diagonal)), rows


def _swollen(g: Geometry, solids: Bodies, amount: Float64) -> Geometry:
    """Move the vertices of solids outward by `amount` (b,), along the mean normals of their places."""
    vertices, facets, weights = g.vertices.copy(), g.facets.copy(), g.weights.copy()
    extent, radius = g.extent.copy(), g.sphere_radius.copy()
    for body in np.flatnonzero(amount).tolist():
        prims = slice(int(solids.first[body]), int(solids.first[body] + solids.size[body]))
        if prims.start >= g.triangle_count:
            radius[prims.start - g.triangle_count] += amount[body]
            continue
        triangles = g.triangles[prims]
        used = used_of(triangles)
        number = np.empty(int(used[-1] - used[0]) + 1, np.intp)
        number[used - used[0]] = np.arange(len(used))
        points = g.vertices[used].astype(np.float64)
        normal = _place_normals(points, number[triangles - used[0]])
        vertices[used] = (points + amount[body] * normal).astype(np.float32)
        moved, shares, size, sound = facets_of(vertices[triangles])
        facets[prims] = np.where(sound[:, None], moved, facets[prims])
        weights[prims] = np.where(sound[:, None], shares, weights[prims])
        extent[prims] = np.maximum(size, extent[prims])
    return replace(g, vertices=vertices, facets=facets, weights=weights, extent=extent, sphere_radius=radius)


def _place_normals(points: Float64, triangles: Numbers) -> Float64:
    """Unit normals (n, 3) of vertices, area weighted over all triangles that touch their place."""
    a, b, c = (points[triangles[:, i]].T for i in range(3))
    face = cross(b - a, c - a)
    place = np.arange(len(points))
    if not _edges_match(triangles.astype(np.int32), len(points)):
        place = np.unique(points, axis=0, return_inverse=True)[1].reshape(-1)
    total = np.stack(
        [
            np.bincount(place[triangles].ravel(), np.repeat(face[i], 3), minlength=int(np.max(place)) + 1)
            for i in range(3)
        ]
    )
    length = np.sqrt(dot(total, total))
    return np.asarray((total / np.where(length > 0, length, 1.0)).T[place])
