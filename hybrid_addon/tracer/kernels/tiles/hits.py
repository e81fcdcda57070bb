# SPDX-License-Identifier: GPL-3.0-or-later
"""Of a tile: camera rays, nearest hits, and where they are. Twins of core/camera.py and geometry/aggregate.py."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call,assignment,operator,arg-type,call-arg"

from __future__ import annotations

import numpy as np

from ...core import constants
from .. import hits as refining
from .. import packets
from ..declare import dot, largest, largest_component, stage
from . import records as of

F, D = np.float32, np.float64
MISS = constants.MISS
STEP, GROWTH, RETRACES = F(constants.RETRACE_STEP), D(constants.RETRACE_GROWTH), constants.MAX_RETRACES
GRAZING, SLACK, ULP = D(constants.GRAZING_COSINE), D(constants.BARYCENTRIC_SLACK), D(constants.FLOAT32_ULP)

nearest_of, occluded_of = stage(packets.nearest_of), stage(packets.occluded_of)
refine = stage(refining.refine)


@stage
def camera_rays(cam, x, y, u, v):
    """camera.generate_rays through places u, v (count,) of pixels x, y (m,): origin, direction (3, n), t_max (n,)."""
    m, count = len(x), len(u)
    n = m * count
    origin, direction, t_max = np.empty((3, n), F), np.empty((3, n), F), np.empty(n, F)
    left, right, bottom, top = cam[of.PLANE], cam[of.PLANE + 1], cam[of.PLANE + 2], cam[of.PLANE + 3]
    width, height = cam[of.RESOLUTION], cam[of.RESOLUTION + 1]
    perspective = cam[of.PERSPECTIVE] != 0
    d, foot = np.empty(3), np.empty(3)
    for p in range(m):
        for s in range(count):
            i = p * count + s
            plane_x = left + (right - left) * ((x[p] + 0.5 + u[s]) / width)
            plane_y = bottom + (top - bottom) * ((y[p] + 0.5 + v[s]) / height)
            for c in range(3):
                axis_x, axis_y, axis_z = cam[of.VIEW_X + c], cam[of.VIEW_Y + c], cam[of.VIEW_Z + c]
                if perspective:
                    d[c] = plane_x * axis_x + plane_y * axis_y - axis_z
                    foot[c] = cam[of.EYE + c]
                else:
                    d[c] = -axis_z
                    foot[c] = cam[of.EYE + c] + plane_x * axis_x + plane_y * axis_y
            length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
            for c in range(3):
                d[c] = d[c] / length
            near, far = cam[of.CLIP_START] * length, cam[of.CLIP_END] * length
            nearest = -(foot[0] * d[0] + foot[1] * d[1] + foot[2] * d[2])
            start = largest(near, nearest - cam[of.BALL])
            aim = largest(start, nearest)
            for c in range(3):
                unit = F(d[c])
                direction[c, i] = unit
                origin[c, i] = F((aim * d[c] + foot[c]) - (aim - start) * D(unit))
            t_max[i] = F(far - start)
    return origin, direction, t_max


@stage
def one_tree(trees, which, part, origin, direction):
    """embree.TriangleScene.intersect: (n,) int32."""
    n, address, start = origin.shape[1], trees.address[which, part], trees.start[which, part]
    found = np.empty((3, n), np.int32)
    if address == 0:
        found[0] = MISS
        return found[0]
    nearest_of(address, origin, direction, found)
    if start >= 0:
        for i in range(n):
            found[0, i] = trees.ids[start + found[0, i]] if found[0, i] >= 0 else MISS
    return found[0]


@stage
def intersect(facets, trees, which, origin, direction):
    """The same of all that a kind of ray may hit: trees.TwoTrees.intersect, where there are two."""
    found = one_tree(trees, which, 0, origin, direction)
    if trees.address[which, 1] == 0:
        return found
    other = one_tree(trees, which, 1, origin, direction)
    t, _, _ = refine(facets, found, origin, direction)
    t_other, _, _ = refine(facets, other, origin, direction)
    for i in range(len(found)):
        if other[i] < 0:
            continue
        if found[i] < 0 or t_other[i] < t[i] or (t_other[i] == t[i] and other[i] < found[i]):
            found[i] = other[i]
    return found


@stage
def occluded(trees, which, origin, direction, t_max):
    """PrimitiveSet.occluded among triangles: (n,) bool."""
    blocked, other = np.zeros(len(t_max), np.bool_), np.zeros(len(t_max), np.bool_)
    if len(t_max) == 0:
        return blocked
    for part in range(2):
        if trees.address[which, part] != 0:
            occluded_of(trees.address[which, part], origin, direction, t_max, other)
            for i in range(len(t_max)):
                blocked[i] |= other[i]
    return blocked


@stage
def nearest(shapes, trees, which, origin, direction, counters):
    """PrimitiveSet.nearest among triangles: prim, t, normal, toward."""
    prim = intersect(shapes.facets, trees, which, origin, direction)
    n = len(prim)
    t, normal, toward = refine(shapes.facets, prim, origin, direction)
    for i in range(n):
        if not t[i] >= 0:
            counters[of.N_SELF_HITS] += 1
            _retrace(shapes, trees, which, origin, direction, prim, t, normal, toward, i)
    for i in range(n):
        if (
            prim[i] >= 0
            and abs(toward[i]) < GRAZING
            and _is_outside(shapes.weights, prim[i], origin, direction, t[i], toward[i], i)
        ):
            counters[of.N_GRAZING] += 1
    return prim, t, normal, toward


@stage
def _retrace(shapes, trees, which, origin, direction, prim, t, normal, toward, i):
    """PrimitiveSet._retrace, of one ray."""
    start, d = origin[:, i : i + 1].copy(), direction[:, i : i + 1].copy()
    step = D(STEP * largest_component(start[0, 0], start[1, 0], start[2, 0]))
    for _ in range(RETRACES):
        moved = np.empty((3, 1), F)
        for c in range(3):
            moved[c, 0] = F(start[c, 0] + d[c, 0] * step)
        again = intersect(shapes.facets, trees, which, moved, d)
        t1, normal1, toward1 = refine(shapes.facets, again, start, d)
        if t1[0] >= 0 or again[0] == MISS:
            prim[i], t[i], toward[i] = again[0], t1[0], toward1[0]
            for c in range(3):
                normal[c, i] = normal1[c, 0]
            return
        step *= GROWTH
    prim[i], t[i] = MISS, np.inf


@stage
def _is_outside(weights, prim, origin, direction, t, toward, i):
    """PrimitiveSet._check_grazing, of one hit."""
    x = origin[0, i] + t * direction[0, i]
    y = origin[1, i] + t * direction[1, i]
    z = origin[2, i] + t * direction[2, i]
    u = weights[prim, 0] * x + weights[prim, 1] * y + weights[prim, 2] * z + weights[prim, 3]
    v = weights[prim, 4] * x + weights[prim, 5] * y + weights[prim, 6] * z + weights[prim, 7]
    slack = SLACK + ULP / abs(toward)
    return u < -slack or v < -slack or u + v > 1 + slack


@stage
def shadow_origins(shapes, prim, entering, point, n_geometric, offset, outer, weights):
    """interaction.shadow_origin of all hits: (3, n)."""
    n = len(prim)
    result = outer.copy()
    if len(shapes.normals) == 0:
        return result
    one = F(1)
    for i in range(n):
        p = prim[i]
        if not shapes.smooth[p]:
            continue
        sign = one if entering[i] else -one
        u, v = F(weights[0, i]), F(weights[1, i])
        x, y, z = F(point[0, i]), F(point[1, i]), F(point[2, i])
        lx, ly, lz = n_geometric[0, i] * offset[i], n_geometric[1, i] * offset[i], n_geometric[2, i] * offset[i]
        for k in range(3):
            weight = one - u - v if k == 0 else (u if k == 1 else v)
            nx, ny, nz = shapes.normals[p, 3 * k], shapes.normals[p, 3 * k + 1], shapes.normals[p, 3 * k + 2]
            above = largest((shapes.heights[p, k] - dot(nx, ny, nz, x, y, z)) * sign, F(0))
            above *= weight * sign
            lx, ly, lz = lx + nx * above, ly + ny * above, lz + nz * above
        result[0, i], result[1, i], result[2, i] = F(lx + point[0, i]), F(ly + point[1, i]), F(lz + point[2, i])
    return result


@stage
def take3(a, index):
    """Columns of (3, n)."""
    result = np.empty((3, len(index)), a.dtype)
    for c in range(3):
        for k in range(len(index)):
            result[c, k] = a[c, index[k]]
    return result
