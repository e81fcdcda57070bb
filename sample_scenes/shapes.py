# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes from profiles, sections and sweeps; where a modifier can do the work, the file stays small."""

from __future__ import annotations

import math

import bpy
import numpy as np


def link(obj, parent=None):
    """Put `obj` into the scene, below `parent` if given."""
    bpy.context.scene.collection.objects.link(obj)
    obj.parent = parent
    return obj


def mesh(name, vertices, faces, mat=None, uv=None, smooth=False, at=(0, 0, 0)):
    """An object of vertices and polygons; `uv` holds (u, v) for each vertex."""
    data = bpy.data.meshes.new(name)
    data.from_pydata([tuple(map(float, v)) for v in vertices], [], [tuple(map(int, f)) for f in faces])
    if uv is not None:
        corners = np.empty(len(data.loops), np.int32)
        data.loops.foreach_get("vertex_index", corners)
        layer = data.uv_layers.new(name="UVMap")
        layer.uv.foreach_set("vector", np.asarray(uv, np.float32)[corners].ravel())
    if len(data.polygons):
        data.shade_smooth() if smooth else data.shade_flat()
    if mat:
        data.materials.append(mat)
    data.validate()
    obj = link(bpy.data.objects.new(name, data))
    obj.location = at
    return obj


def modifier(obj, kind, **values):
    """Add a modifier and set its properties."""
    mod = obj.modifiers.new(kind.title(), kind)
    for key, value in values.items():
        setattr(mod, key, value)
    return mod


def subdivide(obj, levels):
    """The same Catmull-Clark level in the viewport and in the render."""
    modifier(obj, "SUBSURF", levels=levels, render_levels=levels)
    return obj


def bevel(obj, width, segments=3):
    """Round the sharp edges, and shade the rest flat."""
    modifier(obj, "BEVEL", width=width, segments=segments, limit_method="ANGLE", harden_normals=True)
    obj.data.shade_smooth()
    return obj


def box(name, size, at, mat, rounded=0.0, segments=3):
    """A box of edge lengths `size` around `at`, with UVs in metres on each side."""
    x, y, z = (s / 2 for s in size)
    vertices, faces, uv = [], [], []
    for axis in range(3):
        for sign in (-1, 1):
            a, b = (axis + 1) % 3, (axis + 2) % 3
            half = (x, y, z)
            for da, db in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                p = [0.0, 0.0, 0.0]
                p[axis], p[a], p[b] = sign * half[axis], da * half[a], db * half[b]
                vertices.append(tuple(p))
                up, across = (2, 1 if axis == 0 else 0) if axis != 2 else (1, 0)
                uv.append((p[across], p[up]))
            k = len(vertices) - 4
            faces.append((k, k + 1, k + 2, k + 3) if sign > 0 else (k, k + 3, k + 2, k + 1))
    index = {v: i for i, v in enumerate(dict.fromkeys(vertices))}
    data = bpy.data.meshes.new(name)
    data.from_pydata(list(index), [], [tuple(index[vertices[i]] for i in f) for f in faces])
    layer = data.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", np.array([uv[i] for f in faces for i in f], np.float32).ravel())
    data.materials.append(mat)
    obj = link(bpy.data.objects.new(name, data))
    obj.location = at
    return bevel(obj, rounded, segments) if rounded else obj


def sampled(controls, count, bend=0.15):
    """`count` points on a Catmull-Rom curve through `controls`, closer together where it bends."""
    p = np.asarray(controls, float)
    p = np.vstack([2 * p[0] - p[1], p, 2 * p[-1] - p[-2]])
    step = np.sqrt(np.linalg.norm(np.diff(p, axis=0), axis=1)) + 1e-9  # centripetal
    t = np.concatenate([[0], np.cumsum(step)])
    dense = []
    for k in range(1, len(p) - 2):
        x = np.linspace(t[k], t[k + 1], 200, endpoint=k == len(p) - 3)[:, None]

        def mix(a, b, i, j, x=x):
            return ((t[j] - x) * a + (x - t[i]) * b) / (t[j] - t[i])

        a1, a2, a3 = (mix(p[k + i - 1], p[k + i], k + i - 1, k + i) for i in range(3))
        b1, b2 = mix(a1, a2, k - 1, k + 1), mix(a2, a3, k, k + 2)
        dense.append(mix(b1, b2, k, k + 1))
    dense = np.vstack(dense)
    along = np.diff(dense, axis=0)
    length = np.linalg.norm(along, axis=1)
    unit = along / length[:, None]
    turn = np.arccos(np.clip((unit[1:] * unit[:-1]).sum(1), -1, 1))
    cost = length + bend * np.concatenate([[0], turn]) * length.sum() * 0.1
    total = np.concatenate([[0], np.cumsum(cost)])
    want = np.linspace(0, total[-1], count)
    return np.stack([np.interp(want, total, dense[:, i]) for i in range(dense.shape[1])], axis=1)


def lathe(name, profile, segments, mat, at=(0, 0, 0)):
    """A solid of revolution about Z: the mesh holds the profile (radius, height) alone, Screw does the rest.

    A profile that runs from the axis to the axis gives a closed skin of 2 x segments x (points - 2) triangles.
    """
    points = [(r, 0.0, z) for r, z in profile]
    area = sum((b[0] - a[0]) * (a[1] + b[1]) / 2 for a, b in zip(profile, [*profile[1:], profile[0]], strict=True))
    data = bpy.data.meshes.new(name)
    data.from_pydata(points, [(i, i + 1) for i in range(len(points) - 1)], [])
    data.materials.append(mat)
    obj = link(bpy.data.objects.new(name, data))
    obj.location = at
    modifier(
        obj,
        "SCREW",
        angle=2 * math.pi,
        steps=segments,
        render_steps=segments,
        use_merge_vertices=True,
        merge_threshold=1e-5,
        use_smooth_shade=True,
        use_normal_flip=bool(area < 0),  # outwards: Screw's own choice fails for some
    )
    return obj


def loft(name, rings, mat, closed=True, caps=True, at=(0, 0, 0)):
    """A skin over rings (n, m, 3) of points, counter-clockwise as seen from the last ring; caps are single polygons."""
    rings = np.asarray(rings, float)
    n, m = rings.shape[:2]
    faces = []
    for i in range(n - 1):
        for j in range(m if closed else m - 1):
            k = (j + 1) % m
            faces.append((i * m + j, i * m + k, (i + 1) * m + k, (i + 1) * m + j))
    if caps:
        faces.append(tuple(reversed(range(m))))
        faces.append(tuple(range((n - 1) * m, n * m)))
    u, v = np.meshgrid(np.arange(m) / m, np.arange(n) / max(n - 1, 1))
    uv = np.stack([u.ravel(), v.ravel()], axis=1)
    return mesh(name, rings.reshape(-1, 3), faces, mat, uv=uv, smooth=True, at=at)


def frames(path, up=(0, 0, 1)):
    """Tangent, side and upward vector along a path, without twist."""
    path = np.asarray(path, float)
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    normal = np.empty_like(tangent)
    previous = np.asarray(up, float)
    for i, t in enumerate(tangent):
        previous = previous - t * (previous @ t)
        previous /= np.linalg.norm(previous)
        normal[i] = previous
    return tangent, np.cross(tangent, normal), normal


def sweep(path, radius, sides, up=(0, 0, 1), turn=0.0):
    """Rings of circles along a path; `radius` is one number or one for each point."""
    _, side, normal = frames(path, up)
    angle = np.arange(sides) * 2 * np.pi / sides + turn
    r = np.broadcast_to(np.asarray(radius, float), (len(path),))[:, None, None]
    ring = side[:, None] * np.cos(angle)[None, :, None] - normal[:, None] * np.sin(angle)[None, :, None]
    return np.asarray(path)[:, None] + r * ring


def globe(name, radius, segments, rings, mat, at):
    """A UV sphere with UVs: 2 x segments x (rings - 1) triangles."""
    u, v = np.meshgrid(np.arange(segments + 1) / segments, np.arange(rings + 1) / rings)
    lon, lat = u.ravel() * 2 * np.pi, (v.ravel() - 0.5) * np.pi
    grid = np.stack([np.cos(lon) * np.cos(lat), np.sin(lon) * np.cos(lat), np.sin(lat)], axis=1) * radius
    row = segments + 1
    vertex = [(0, 0, -radius)]
    vertex += [tuple(grid[i * row + j]) for i in range(1, rings) for j in range(segments)]
    vertex.append((0, 0, radius))

    def at_ring(i, j):
        return 0 if i == 0 else len(vertex) - 1 if i == rings else 1 + (i - 1) * segments + j % segments

    faces, uv = [], []
    for i in range(rings):
        for j in range(segments):
            corner = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)]
            if i == 0:
                corner = [corner[0], corner[2], corner[3]]
            elif i == rings - 1:
                corner = [corner[0], corner[1], corner[3]]
            faces.append(tuple(at_ring(*c) for c in corner))
            pole = 0.5 if i in (0, rings - 1) else 0.0
            uv += [((b + (pole if a in (0, rings) else 0.0)) / segments, a / rings) for a, b in corner]
    obj = mesh(name, vertex, faces, mat, smooth=True, at=at)
    layer = obj.data.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", np.array(uv, np.float32).ravel())
    return obj


def quad(name, size, triangles, mat, at=(0, 0, 0), tiles=1.0):
    """A level rectangle of `size` (one number or two) cut into exactly `triangles` triangles (2 or more).

    `tiles` repeats its picture.
    """
    cells = triangles // 2
    columns = max(1, math.isqrt(cells))
    rows = cells // columns
    extra = triangles - 2 * rows * columns

    def line(j, count):
        return [(i / count, j / rows) for i in range(count + 1)]

    lines = [line(j, columns) for j in range(rows)] + [line(rows, columns + extra)]
    start = np.cumsum([0] + [len(points) for points in lines])
    faces = []
    for j in range(rows - 1 if extra else rows):
        a, b = start[j], start[j + 1]
        faces += [(a + i, a + i + 1, b + i + 1, b + i) for i in range(columns)]
    if extra:  # the last row: `columns` edges below, `columns + extra` above
        a, b, i, k = start[rows - 1], start[rows], 0, 0
        while i < columns or k < columns + extra:
            if k * columns <= i * (columns + extra) and k < columns + extra:
                faces.append((a + i, b + k + 1, b + k))
                k += 1
            else:
                faces.append((a + i, a + i + 1, b + k))
                i += 1
    uv = np.array([p for points in lines for p in points])
    flat = (uv - 0.5) * np.asarray(size)
    return mesh(name, np.column_stack([flat, np.zeros(len(flat))]), faces, mat, uv=uv * tiles, at=at)


def backdrop(name, mat, wide=14.0, near=-7.0, far=3.0, high=6.0, bend=1.6):
    """A photographer's sweep: a floor that bends up into a wall."""
    angle = np.linspace(0, np.pi / 2, 25)
    bow = np.column_stack([far - bend + bend * np.sin(angle), bend - bend * np.cos(angle)])
    profile = np.vstack([(near, 0.0), bow, (far, high)])
    rings = [[(x, y, z) for y, z in profile] for x in (-wide / 2, wide / 2)]
    return loft(name, rings, mat, closed=False, caps=False)


def brilliant(name, radius, mat, at=(0, 0, 0), table=0.56, crown=34.5, pavilion=40.75):
    """A round brilliant of 57 facets and a girdle of 64, cut by planes as a cutter does; its point is at `at`.

    table : radius of the table's corners against the girdle's; crown, pavilion : tilt of the main facets in degrees.
    """
    import bmesh  # only importable next to bpy

    half = 0.02  # of the girdle's height
    chord = math.cos(math.pi / 16)
    top = half + (1 - table) * math.tan(math.radians(crown))
    cuts = [(0.0, 0.0, 0.0, top)]  # (tilt from the axis, azimuth, and a point of the plane: distance, height)
    for k in range(8):
        a = k * math.pi / 4
        cuts.append((math.radians(crown), a, 1.0, half))
        cuts.append((math.radians(crown - 13), a + math.pi / 8, table * math.cos(math.pi / 8), top))
        cuts.append((math.pi - math.radians(pavilion), a, 1.0, -half))
        for side in (-1, 1):
            cuts.append((math.radians(crown + 6.5), a + side * math.pi / 16, chord, half))
            cuts.append((math.pi - math.radians(pavilion + 1.3), a + side * math.pi / 16, chord, -half))
    cuts += [(math.pi / 2, (k + 0.5) * math.pi / 32, 1.0, 0.0) for k in range(64)]
    stone = bmesh.new()
    bmesh.ops.create_cube(stone, size=4.0)
    for tilt, azimuth, distance, height in cuts:
        across = (math.cos(azimuth), math.sin(azimuth))
        bmesh.ops.bisect_plane(
            stone,
            geom=[*stone.verts, *stone.edges, *stone.faces],
            dist=1e-6,
            plane_co=(distance * across[0], distance * across[1], height),
            plane_no=(math.sin(tilt) * across[0], math.sin(tilt) * across[1], math.cos(tilt)),
            clear_outer=True,
        )
        bmesh.ops.holes_fill(stone, edges=[edge for edge in stone.edges if edge.is_boundary])
    bmesh.ops.remove_doubles(stone, verts=stone.verts, dist=1e-4)
    bmesh.ops.recalc_face_normals(stone, faces=stone.faces)
    bmesh.ops.scale(stone, vec=(radius,) * 3, verts=stone.verts)
    low = min(vertex.co.z for vertex in stone.verts)
    bmesh.ops.translate(stone, vec=(0, 0, -low), verts=stone.verts)
    data = bpy.data.meshes.new(name)
    stone.to_mesh(data)
    stone.free()
    data.materials.append(mat)
    obj = link(bpy.data.objects.new(name, data))
    obj.location = at
    return obj
