# SPDX-License-Identifier: GPL-3.0-or-later
"""The simple and the intermediate scene of the thesis: a chequered floor, one light that moves and one fixed."""

from __future__ import annotations

import math

import bpy
import kit
import numpy as np
import paint
import shapes

SIMPLE_TRIANGLES = 19_625
INTERMEDIATE_TRIANGLES = 128_232

GLASS_SEGMENTS, GLASS_POINTS = 140, 72  # 2 x 140 x (72 - 2) = 19,600 triangles

# Half of a wine glass in section, (radius, height), one unit = 10 cm: from the middle of the foot's underside, out and
# up along the stem and the bowl to the rim, and down again inside.
WINE_GLASS = [
    (0.0, 0.022), (0.20, 0.014), (0.34, 0.002), (0.385, 0.006), (0.392, 0.018), (0.36, 0.032), (0.24, 0.058),
    (0.12, 0.10), (0.066, 0.17), (0.048, 0.30), (0.042, 0.50), (0.044, 0.70), (0.062, 0.84), (0.12, 0.925),
    (0.25, 1.01), (0.38, 1.16), (0.445, 1.36), (0.452, 1.52), (0.43, 1.74), (0.385, 1.98), (0.358, 2.12),
    (0.350, 2.128), (0.342, 2.12), (0.369, 1.98), (0.414, 1.74), (0.436, 1.52), (0.428, 1.36), (0.362, 1.17),
    (0.23, 1.03), (0.10, 0.965), (0.0, 0.945),
]  # fmt: skip


def _set(floor_triangles):
    """World, floor and the two lights that both scenes share."""
    kit.world(kit.packed("lake", paint.lake()), 1.0)
    stone = kit.material("Chequered stone", image=kit.packed("chequer", paint.chequer()), roughness=0.35)
    floor = shapes.quad("Floor", 12.0, floor_triangles, stone)
    kit.lamp("Fixed light", (-3.4, 2.2, 4.4), 1000.0, (1.0, 0.88, 0.72), radius=0.06)
    moving = kit.lamp("Moving light", (3.0, -2.2, 3.4), 300.0, (0.80, 0.89, 1.0), radius=0.06)
    keys = {}
    for frame, degrees in ((1, -75), (7, -40), (13, -5), (19, 30), (24, 60)):
        a = math.radians(degrees)
        keys[frame] = (4.2 * math.cos(a), 4.2 * math.sin(a), 3.4 + 0.5 * math.sin(2 * a))
    kit.animate(moving, "location", keys)
    return floor


def wine_glass(mat, at):
    """A thin-walled glass with a solid stem: one closed skin."""
    profile = shapes.sampled(WINE_GLASS, GLASS_POINTS)
    profile[[0, -1], 0] = 0.0
    return shapes.lathe("Wine glass", profile, GLASS_SEGMENTS, mat, at)


def simple():
    """An opaque wine glass on a chequered quad; the glass alone is ray traced."""
    kit.new_scene("Simple")
    enamel = kit.material("Enamel", colour=(0.55, 0.045, 0.06), roughness=0.18)
    kit.flag(wine_glass(enamel, (0.0, 0.0, -0.001)), reflectivity=0.0, opacity=1.0)
    _set(kit.fill(SIMPLE_TRIANGLES, 2, 40))
    kit.camera((0.35, -4.6, 1.95), (0.12, 0.0, 1.02), 45.0)


# ------------------------------------------------------------------------------------------------ intermediate


def intermediate():
    """Two spinning spheres, a dragon, a spinning head and a wine glass, all ray traced, on a chequered quad."""
    kit.new_scene("Intermediate")
    sphere = shapes.globe(
        "Reflective sphere",
        0.62,
        128,
        64,
        kit.material("Globe", image=kit.packed("globe", paint.globe()), roughness=0.08),
        (-1.85, 0.05, 0.62),
    )
    sphere.rotation_mode = "ZYX"  # it spins about its own tilted axis
    sphere.rotation_euler = (math.radians(18), 0, math.radians(70))
    kit.flag(sphere, reflectivity=0.5, opacity=1.0)
    kit.spin(sphere)

    stripes = kit.packed("ball", paint.ball())
    skin = kit.material("Ball", image=stripes, roughness=0.0, transmission=0.5, ior=1.3)
    sphere = shapes.globe("Half transparent sphere", 0.55, 128, 64, skin, (0.80, -1.80, 0.55))
    sphere.rotation_mode = "ZYX"
    sphere.rotation_euler = (math.radians(-15), math.radians(12), 0)
    kit.flag(sphere, reflectivity=0.5, opacity=0.5, ior=1.3)
    kit.spin(sphere, -1.0)

    kit.flag(dragon((0.15, 0.75, -0.02)), reflectivity=0.08, opacity=1.0)

    bpy.ops.mesh.primitive_monkey_add(size=1.25, location=(2.05, 0.1, 0.526))
    head = bpy.context.object
    head.name = head.data.name = "Head"
    shapes.subdivide(head, 2).data.shade_smooth()
    head.data.materials.append(kit.material("Copper", colour=(0.62, 0.20, 0.08), roughness=0.25))
    head.rotation_euler = (math.radians(-12), 0, math.radians(-25))
    kit.flag(head, reflectivity=0.15, opacity=1.0)
    kit.spin(head)

    clear = wine_glass(kit.glass("Clear glass", ior=1.5), (-1.12, -1.65, -0.001))
    kit.flag(clear)
    _set(kit.fill(INTERMEDIATE_TRIANGLES, 2, 1200))
    kit.camera((0.1, -7.6, 2.35), (0.1, 0.0, 0.98), 47.0)


def dragon(at):
    """A coiled dragon: one skin swept along a curve, with scales, a crest and a mouth, and horns and eyes."""
    jade = kit.material("Jade", colour=(0.04, 0.27, 0.15), roughness=0.22)
    path = shapes.sampled(DRAGON_PATH, 281, bend=0.3)
    tangent, side, up = _upright_head(path)
    parts = [_dragon_body(path, side, up)]
    for sign in (-1, 1):

        def place(share, right, above, sign=sign):
            """A point beside the spine, `share` of the way along it."""
            i = round(share * (len(path) - 1))
            return path[i] + sign * right * side[i] + above * up[i]

        brow = [place(0.915, 0.08, 0.10), place(0.905, 0.13, 0.24), place(0.892, 0.19, 0.30), place(0.872, 0.26, 0.34)]
        brow.append(place(0.856, 0.30, 0.48))
        parts.append(shapes.sweep(shapes.sampled(brow, 16), np.linspace(0.066, 0.008, 16), 8, up=side[-1]))
        ear = shapes.sampled([place(0.905, 0.14, 0.0), place(0.89, 0.24, 0.02), place(0.872, 0.33, 0.06)], 10)
        parts.append(shapes.sweep(ear, [0.03, 0.06, 0.075, 0.075, 0.07, 0.06, 0.05, 0.035, 0.02, 0.006], 8, up=up[-1]))
        whisker = [
            place(0.985, 0.08, -0.01), place(0.99, 0.20, 0.0), place(0.98, 0.28, -0.12), place(0.965, 0.26, -0.30),
        ]  # fmt: skip
        whisker.append(place(0.955, 0.30, -0.42))
        parts.append(shapes.sweep(shapes.sampled(whisker, 14), np.linspace(0.024, 0.008, 14), 6, up=up[-1]))
        eye = place(0.932, 0.14, 0.10)
        ball = [eye + 0.055 * math.cos(a) * up[-1] for a in np.linspace(math.pi, 0, 8)]
        parts.append(shapes.sweep(ball, 0.055 * np.sin(np.linspace(0.15, math.pi - 0.15, 8)), 10, up=tangent[-1]))
        nostril = place(0.985, 0.045, 0.07)
        ball = [nostril + 0.03 * math.cos(a) * up[-1] for a in np.linspace(math.pi, 0, 8)]
        parts.append(shapes.sweep(ball, 0.03 * np.sin(np.linspace(0.15, math.pi - 0.15, 8)), 8, up=tangent[-1]))
    vertices, faces = [], []
    for rings in parts:
        n, m = rings.shape[:2]
        base = len(vertices)
        vertices += rings.reshape(-1, 3).tolist()
        for i in range(n - 1):
            row, above = base + i * m, base + (i + 1) * m
            faces += [[row + j, row + (j + 1) % m, above + (j + 1) % m, above + j] for j in range(m)]
        faces.append([base + j for j in reversed(range(m))])
        faces.append([base + (n - 1) * m + j for j in range(m)])
    return shapes.subdivide(shapes.mesh("Dragon", vertices, faces, jade, smooth=True, at=at), 1)


def _upright_head(path):
    """The path's frames, rolled along the neck so that the head is level."""
    tangent, side, up = shapes.frames(path)
    share = np.linspace(0, 1, len(path))
    level = np.cross(tangent, (0, 0, 1))
    level = np.arctan2((level * up).sum(1), (level * side).sum(1))
    roll = level[-1] * paint.smoothstep(0.62, 0.88, share)[:, None]
    return tangent, side * np.cos(roll) + up * np.sin(roll), up * np.cos(roll) - side * np.sin(roll)


def _dragon_path():
    """Where the spine runs: tail on the floor, a turn and a half of coil, an S of a neck, and the head."""
    points = []
    for k in range(22):
        t = k / 21
        a = math.radians(-330 + 510 * t)
        r = 1.22 - 0.66 * t**1.2
        points.append((r * math.cos(a), r * math.sin(a), 0.03 + 0.20 * min(1.0, 2.5 * t) + 0.34 * t**2.5))
    neck = [
        (-0.57, -0.28, 0.66), (-0.48, -0.50, 0.90), (-0.40, -0.46, 1.22), (-0.44, -0.28, 1.54), (-0.42, -0.16, 1.86),
    ]  # fmt: skip
    neck += [(-0.24, -0.20, 2.14), (0.06, -0.38, 2.22), (0.36, -0.62, 2.14), (0.62, -0.84, 2.02)]
    return points + neck


DRAGON_PATH = _dragon_path()

# The body along its length: (share of the path, half width, half height).
DRAGON_GIRTH = [
    (0.00, 0.010, 0.010), (0.10, 0.055, 0.055), (0.30, 0.165, 0.165), (0.48, 0.235, 0.235), (0.62, 0.235, 0.235),
    (0.74, 0.195, 0.205), (0.82, 0.145, 0.160), (0.875, 0.125, 0.135), (0.905, 0.195, 0.165), (0.93, 0.180, 0.150),
    (0.952, 0.120, 0.115), (0.975, 0.120, 0.095), (0.992, 0.105, 0.085), (1.00, 0.045, 0.035),
]  # fmt: skip


def _dragon_body(path, side, up, sides=24):
    """Rings around the spine: the outline of DRAGON_GIRTH, with a toothed crest, scales and the line of the mouth."""
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    s = along / along[-1]
    share, width, height = np.array(DRAGON_GIRTH).T
    width, height = np.interp(s, share, width), np.interp(s, share, height)
    angle = np.arange(sides) * 2 * np.pi / sides
    across, above = np.cos(angle), np.sin(angle)
    teeth = (along * 7.0) % 1.0
    crest = (0.25 + 0.75 * teeth) * 0.13 * np.interp(s, [0.04, 0.2, 0.6, 0.88, 0.905], [0, 0.5, 1, 0.8, 0])
    radial = np.ones((len(s), sides))
    ring = np.arange(len(s))[:, None]
    scaly = np.interp(s, [0.05, 0.2, 0.86, 0.9], [0, 1, 1, 0])[:, None] * (above > -0.3)
    radial += 0.045 * scaly * np.where((ring // 2 + np.arange(sides)) % 2, 1.0, -1.0)
    belly = np.interp(s, [0.05, 0.2, 0.86, 0.9], [0, 1, 1, 0])[:, None] * (above < -0.6)
    radial += 0.05 * belly * np.where(ring % 4 < 2, 1.0, -1.0)
    mouth = np.interp(s, [0.915, 0.93, 0.99, 1.0], [0, 1, 1, 0.3])[:, None]
    radial -= 0.34 * mouth * (np.abs(above + 0.2588) < 0.05)
    top = np.exp(-(((angle - np.pi / 2) / 0.16) ** 2))
    x = radial * width[:, None] * across
    y = radial * height[:, None] * above + crest[:, None] * top
    rings = path[:, None] + x[..., None] * side[:, None] + y[..., None] * up[:, None]
    return rings[:, ::-1]  # so that the skin faces outwards
