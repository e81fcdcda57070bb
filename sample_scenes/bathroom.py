# SPDX-License-Identifier: GPL-3.0-or-later
"""The complex scene: the washroom of a private jet, most of it ray traced, with two lights that move."""

from __future__ import annotations

import math
from itertools import pairwise

import kit
import numpy as np
import paint
import shapes

COMPLEX_TRIANGLES = 82_778

LEFT, BACK, FRONT, HIGH = -0.95, 1.0, -1.25, 2.02  # the left wall's x, the y of the walls ahead and behind, the ceiling
COUNTER = 0.84  # height of the counter's top


def complex_scene():
    """Basin, tap, toilet, mirror, tiles, shelves, towels, lamps, windows and a door."""
    kit.new_scene("Complex")
    kit.world(kit.packed("above_the_clouds", paint.above_the_clouds()), 0.4)
    mats = _materials()
    _shell(mats)
    _tiles(mats)
    _vanity(mats)
    _basin_and_tap(mats)
    _mirror_and_sconces(mats)
    _toilet(mats)
    _shelves(mats)
    _towels(mats)
    _door(mats)
    _lights()
    planks = kit.fill(COMPLEX_TRIANGLES, 400, 1600)
    centre = ((LEFT + 1.05) / 2, (FRONT + BACK) / 2, 0.0)
    shapes.quad("Floor", (1.05 - LEFT, BACK - FRONT + 0.04), planks, mats["floor"], at=centre)
    kit.camera((-0.22, -1.16, 1.42), (0.08, 1.0, 1.0), 21.5, near=0.02)


def _materials():
    marble = kit.packed("marble", paint.marble())
    wood = kit.packed("walnut", paint.wood(light=(0.44, 0.27, 0.16), dark=(0.20, 0.105, 0.06)))
    planks = kit.packed("planks", paint.wood(planks=8, light=(0.70, 0.56, 0.42), dark=(0.52, 0.38, 0.27), seed=9))
    return {
        "marble": kit.material("Marble", image=marble, roughness=0.12),
        "walnut": kit.material("Walnut", image=wood, roughness=0.2),
        "floor": kit.material("Oak planks", image=planks, roughness=0.4),
        "towel": kit.material("Terry", image=kit.packed("terry", paint.weave()), roughness=0.9),
        "panel": kit.material("Cream panel", colour=(0.78, 0.71, 0.60), roughness=0.5),
        "tile": kit.material("Glazed tile", colour=(0.12, 0.30, 0.32), roughness=0.08),
        "grout": kit.material("Grout", colour=(0.50, 0.48, 0.44), roughness=0.8),
        "ceramic": kit.material("Ceramic", colour=(0.82, 0.81, 0.79), roughness=0.08),
        "chrome": kit.material("Chrome", colour=(0.86, 0.86, 0.88), metallic=1.0, roughness=0.0),
        "brass": kit.material("Brass", colour=(0.86, 0.60, 0.28), metallic=1.0, roughness=0.0),
        "mirror": kit.material("Silvered mirror", colour=(0.95, 0.96, 0.96), metallic=1.0, roughness=0.0),
        "glass": kit.glass("Clear glass", ior=1.5),
        "amber": kit.glass("Amber glass", ior=1.45, colour=(0.92, 0.55, 0.20)),
        "soap": kit.material("Soap", colour=(0.85, 0.55, 0.48), roughness=0.3),
        "opal": kit.material("Opal lamp", colour=(0.9, 0.88, 0.84), emission=(1.0, 0.86, 0.66), strength=2.6),
        "green": kit.material("Leaf", colour=(0.10, 0.26, 0.07), roughness=0.4),
        "rubber": kit.material("Rubber", colour=(0.03, 0.03, 0.035), roughness=0.5),
        "leather": kit.material("Leather", colour=(0.55, 0.37, 0.24), roughness=0.45),
    }


# ------------------------------------------------------------------------------------------------ the room


def _fuselage(z):
    """x of the curved outer wall at height z."""
    return 0.70 + 0.35 * math.sqrt(max(0.0, 1 - ((z - 0.75) / 1.42) ** 2))


def _oval(t, half_wide, half_high, power=2.6):
    """A point of a superellipse, (across, up)."""
    c, s = math.cos(t), math.sin(t)
    return half_wide * math.copysign(abs(c) ** (2 / power), c), half_high * math.copysign(abs(s) ** (2 / power), s)


def _shell(mats):
    """Walls and ceiling; the right wall is the fuselage with two windows."""
    wide = 1.05 - LEFT
    middle = (LEFT + 1.05) / 2
    deep = BACK - FRONT + 0.1
    shapes.box("Left wall", (0.04, deep, HIGH), (LEFT - 0.02, (BACK + FRONT) / 2, HIGH / 2), mats["panel"])
    shapes.box("Front wall", (wide, 0.04, HIGH), (middle, FRONT - 0.02, HIGH / 2), mats["panel"])
    shapes.box("Back wall", (wide, 0.04, HIGH), (middle, BACK + 0.03, HIGH / 2), mats["grout"])
    shapes.box("Ceiling", (wide, deep, 0.04), (middle, (BACK + FRONT) / 2, HIGH + 0.02), mats["panel"])
    windows = (-0.28, 0.42)
    _fuselage_wall(mats, windows)
    for k, y in enumerate(windows):
        _window(mats, k, y)
    bar = [(_fuselage(0.8) - out, y, 0.8) for out, y in ((0.0, 0.02), (0.05, 0.02), (0.06, 0.06), (0.06, 0.3))]
    bar += [(_fuselage(0.8) - out, y, 0.8) for out, y in ((0.06, 0.54), (0.05, 0.58), (0.0, 0.58))]
    kit.flag(shapes.loft("Grab bar", shapes.sweep(shapes.sampled(bar, 40), 0.011, 16), mats["chrome"]))
    shapes.box("Dado rail", (0.03, deep, 0.03), (LEFT + 0.012, (BACK + FRONT) / 2, 0.92), mats["walnut"], rounded=0.008)
    for k, y in enumerate((-0.72, 0.0, 0.72)):
        shapes.box(f"Wainscot {k}", (0.02, 0.64, 0.70), (LEFT + 0.008, y - 0.12, 0.50), mats["leather"], rounded=0.009)
    for k, x in enumerate((-0.5, 0.15)):
        for j, y in enumerate((-0.6, 0.35)):
            ring = [(0.055, 0.0), (0.075, -0.002), (0.078, 0.006), (0.07, 0.014), (0.055, 0.012)]
            spot = shapes.lathe(f"Downlight ring {k}{j}", ring, 24, mats["chrome"], (x, y, HIGH - 0.012))
            kit.flag(spot)
            disc = [(0.0, -0.004), (0.03, -0.003), (0.056, 0.0), (0.056, 0.01)]
            kit.flag(shapes.lathe(f"Downlight {k}{j}", disc, 24, mats["opal"], (x, y, HIGH - 0.010)))


WINDOW = (1.22, 0.125, 0.185)  # height of the centre, half width, half height


def _fuselage_wall(mats, windows):
    """A curved sheet with an oval hole for each window."""
    z0, wide, high = WINDOW
    margin = 0.22
    vertices, faces, uv = [], [], []

    def point(y, z):
        vertices.append((_fuselage(z), y, z))
        uv.append((y, z))
        return len(vertices) - 1

    heights = np.concatenate(
        [
            np.linspace(0, z0 - margin, 9),
            np.linspace(z0 - margin, z0 + margin, 9)[1:],
            np.linspace(z0 + margin, HIGH, 6)[1:],
        ]
    )
    edges = [FRONT]
    for y in windows:
        edges += [y - margin, y + margin]
    edges.append(BACK + 0.02)
    for j, (low, high_y) in enumerate(pairwise(edges)):
        for a, b in pairwise(heights):
            if j % 2 and z0 - margin - 1e-6 < a and b < z0 + margin + 1e-6:
                continue
            faces.append((point(low, a), point(low, b), point(high_y, b), point(high_y, a)))
    for y in windows:
        count, rings = 48, 4
        grid = np.empty((rings + 1, count), int)
        for i in range(count):
            t = 2 * math.pi * i / count
            inner = _oval(t, wide, high)
            reach = margin / max(abs(math.cos(t)), abs(math.sin(t)))
            outer = (reach * math.cos(t), reach * math.sin(t))
            for r in range(rings + 1):
                f = r / rings
                grid[r, i] = point(y + inner[0] + (outer[0] - inner[0]) * f, z0 + inner[1] + (outer[1] - inner[1]) * f)
        for r in range(rings):
            for i in range(count):
                k = (i + 1) % count
                faces.append((grid[r, i], grid[r, k], grid[r + 1, k], grid[r + 1, i]))
    shapes.mesh("Fuselage wall", vertices, faces, mats["panel"], uv=uv, smooth=False)


def _window(mats, k, y):
    """The reveal with its rounded frame, and the blind half a hand down."""
    z0, wide, high = WINDOW
    section = [(0.10, -0.004), (0.03, -0.004), (0.004, -0.006), (-0.012, 0.006), (-0.016, 0.026), (-0.012, 0.045)]
    section += [(0.0, 0.052), (0.012, 0.045)]  # (outwards through the wall, away from the opening)
    rings = []
    for out, away in section:
        ring = []
        for i in range(48):
            t = 2 * math.pi * i / 48
            a, b = _oval(t, wide + away, high + away)
            ring.append((_fuselage(z0 + b) + out, y + a, z0 + b))
        rings.append(ring)
    frame = shapes.loft(f"Window frame {k}", rings, mats["ceramic"], caps=False)
    kit.flag(shapes.subdivide(frame, 1))
    blind = []
    for z in np.linspace(z0 + high * (0.62 if k else 0.35), z0 + high + 0.004, 8):
        half = wide * max(0.0, 1 - min(1.0, abs((z - z0) / (high + 0.004))) ** 2.6) ** (1 / 2.6)
        blind.append([(_fuselage(z) + 0.035, y + side * (half + 0.004), z) for side in (1, -1)])
    shapes.loft(f"Blind {k}", np.array(blind), mats["panel"], closed=False, caps=False)


def _tiles(mats):
    """Glazed tiles over the back wall: one tile, repeated by two arrays."""
    step_x, step_z = 0.1, 0.1
    tile = shapes.box(
        "Tiles", (step_x - 0.006, 0.012, step_z - 0.006), (LEFT + 0.05, BACK + 0.004, COUNTER + 0.06), mats["tile"]
    )
    shapes.bevel(tile, 0.004, 1)
    shapes.modifier(tile, "ARRAY", count=20, use_relative_offset=False, use_constant_offset=True,
                 constant_offset_displace=(step_x, 0, 0))  # fmt: skip
    shapes.modifier(tile, "ARRAY", count=11, use_relative_offset=False, use_constant_offset=True,
                 constant_offset_displace=(0, 0, step_z))  # fmt: skip
    kit.flag(tile, reflectivity=0.10, opacity=1.0)
    kit.flag(
        shapes.box("Tile trim", (1.05 - LEFT, 0.02, 0.016), (0.05, BACK - 0.003, COUNTER + 0.008), mats["brass"], 0.004)
    )


# ------------------------------------------------------------------------------------------------ vanity


def _vanity(mats):
    """Cabinet with drawers, marble counter, and the things that stand on it."""
    left, right, depth = LEFT, 0.22, 0.50
    middle, wide = (left + right) / 2, right - left
    front = BACK - depth
    cabinet = shapes.box(
        "Cabinet", (wide, depth - 0.03, 0.70), (middle, BACK - (depth - 0.03) / 2, 0.45), mats["walnut"], 0.006
    )
    kit.flag(cabinet, reflectivity=0.06, opacity=1.0)
    shapes.box("Plinth", (wide - 0.04, depth - 0.10, 0.10), (middle, BACK - (depth - 0.1) / 2, 0.05), mats["rubber"])
    counter = shapes.box(
        "Counter", (wide + 0.02, depth + 0.01, 0.04), (middle, BACK - depth / 2, COUNTER - 0.02), mats["marble"]
    )
    shapes.bevel(counter, 0.01, 4)
    kit.flag(counter, reflectivity=0.10, opacity=1.0)
    for i in range(3):
        x = left + wide * (i + 0.5) / 3
        for j, (z, high) in enumerate(((0.68, 0.17), (0.355, 0.44))):
            name = f"Drawer {i}{j}"
            size = (wide / 3 - 0.02, 0.02, high)
            kit.flag(
                shapes.box(name, size, (x, front + 0.024, z), mats["walnut"], 0.007), reflectivity=0.06, opacity=1.0
            )
            knob = [(0, 0.03), (0.010, 0.028), (0.014, 0.022), (0.012, 0.014), (0.006, 0.009), (0.006, 0.0), (0, 0)]
            handle = shapes.lathe(
                f"Knob {i}{j}", shapes.sampled(knob, 12), 16, mats["brass"], (x, front + 0.014, z + high * 0.3)
            )
            handle.rotation_euler.x = math.radians(90)
            kit.flag(handle)
    _dispenser(mats, (-0.20, 0.80, COUNTER + 0.001))
    _tumbler(mats, (-0.80, 0.70, COUNTER + 0.001))
    _plant(mats, (0.08, 0.80, COUNTER))


BASIN_AT = (-0.49, 0.74, COUNTER)


def _basin_and_tap(mats):
    basin = [
        (0.0, 0.0), (0.09, 0.0), (0.115, 0.004), (0.15, 0.03), (0.19, 0.08), (0.21, 0.125), (0.213, 0.132),
        (0.208, 0.136), (0.200, 0.130), (0.18, 0.085), (0.14, 0.042), (0.09, 0.024), (0.03, 0.018), (0.0, 0.017),
    ]  # fmt: skip
    kit.flag(
        shapes.lathe("Basin", shapes.sampled(basin, 42), 80, mats["ceramic"], BASIN_AT), reflectivity=0.06, opacity=1.0
    )
    waste = [(0.0, 0.024), (0.012, 0.024), (0.02, 0.022), (0.022, 0.018), (0.022, 0.012), (0.0, 0.012)]
    kit.flag(shapes.lathe("Waste", shapes.sampled(waste, 14), 32, mats["chrome"], BASIN_AT))
    x, y, z = BASIN_AT[0], 0.93, COUNTER
    foot = [
        (0, 0), (0.030, 0), (0.032, 0.004), (0.028, 0.012), (0.018, 0.016), (0.0165, 0.05), (0.0165, 0.20),
        (0, 0.20),
    ]  # fmt: skip
    kit.flag(shapes.lathe("Tap foot", shapes.sampled(foot, 24), 32, mats["chrome"], (x, y, z)))
    spout = [(x, y, z + 0.17), (x, y, z + 0.245), (x, y - 0.02, z + 0.285), (x, y - 0.07, z + 0.30)]
    spout += [(x, y - 0.125, z + 0.285), (x, y - 0.145, z + 0.245), (x, y - 0.147, z + 0.225)]
    rings = shapes.sweep(shapes.sampled(spout, 36), 0.0125, 20, up=(0, 1, 0))
    kit.flag(shapes.loft("Tap spout", rings, mats["chrome"]))
    for sign in (-1, 1):
        stem = [
            (0, 0), (0.02, 0), (0.021, 0.004), (0.014, 0.012), (0.012, 0.05), (0.016, 0.056), (0.012, 0.066), (0,
            0.068),
        ]  # fmt: skip
        at = (x + 0.10 * sign, y, z)
        kit.flag(shapes.lathe("Tap valve", shapes.sampled(stem, 16), 24, mats["chrome"], at))
        bar = [(at[0] - 0.03, y, z + 0.06), (at[0] + 0.03, y, z + 0.06)]
        arm = shapes.sweep(shapes.sampled(bar, 12), [0.002, 0.006, 0.007] + [0.0055] * 6 + [0.007, 0.006, 0.002], 16)
        kit.flag(shapes.loft("Tap lever", arm, mats["chrome"]))


def _dispenser(mats, at):
    """A bottle of amber glass with a brass pump."""
    x, y, z = at
    bottle = [
        (0, 0), (0.030, 0), (0.034, 0.004), (0.034, 0.10), (0.028, 0.118), (0.014, 0.128), (0.013, 0.142),
        (0.011, 0.142), (0.011, 0.128), (0.025, 0.116), (0.031, 0.098), (0.031, 0.008), (0.026, 0.004), (0, 0.004),
    ]  # fmt: skip
    kit.flag(shapes.lathe("Dispenser", shapes.sampled(bottle, 36), 36, mats["amber"], at))
    pump = [
        (0, 0.138), (0.016, 0.138), (0.016, 0.152), (0.006, 0.156), (0.005, 0.178), (0.012, 0.18), (0.012, 0.19),
        (0, 0.192),
    ]  # fmt: skip
    kit.flag(shapes.lathe("Pump", shapes.sampled(pump, 20), 24, mats["brass"], at))
    nozzle = [(x, y, z + 0.185), (x - 0.03, y - 0.02, z + 0.186), (x - 0.045, y - 0.03, z + 0.178)]
    kit.flag(shapes.loft("Nozzle", shapes.sweep(shapes.sampled(nozzle, 10), 0.004, 12), mats["brass"]))


def _tumbler(mats, at):
    """A drinking glass with two toothbrushes."""
    glass = [
        (0, 0), (0.030, 0), (0.033, 0.004), (0.036, 0.06), (0.039, 0.115), (0.0378, 0.117), (0.0365, 0.115),
        (0.0335, 0.06), (0.0305, 0.016), (0.026, 0.012), (0, 0.011),
    ]  # fmt: skip
    kit.flag(shapes.lathe("Tumbler", shapes.sampled(glass, 30), 48, mats["glass"], at))
    for k, (dx, dy, mat) in enumerate(((0.020, 0.006, "tile"), (-0.016, -0.014, "soap"))):
        x, y, z = at
        path = [
            (x - dx, y - dy, z + 0.014), (x + dx * 0.6, y + dy * 0.6, z + 0.10), (x + dx * 1.9, y + dy * 1.9, z +
            0.19),
        ]  # fmt: skip
        brush = shapes.sweep(
            shapes.sampled(path, 24), np.interp(np.arange(24), [0, 8, 16, 23], [0.004, 0.005, 0.003, 0.005]), 12
        )
        kit.flag(shapes.loft(f"Toothbrush {k}", brush, mats[mat]))


def _plant(mats, at):
    """A pot with leaves, each bent by its own arch."""
    pot = [(0, 0), (0.04, 0), (0.046, 0.004), (0.058, 0.085), (0.060, 0.092), (0.054, 0.092), (0.050, 0.07), (0, 0.07)]
    kit.flag(shapes.lathe("Pot", shapes.sampled(pot, 20), 32, mats["ceramic"], at))
    vertices, faces = [], []
    rows = 9
    for k in range(14):
        a = k * 2.399963
        reach, top, wide = 0.07 + 0.05 * ((k * 7) % 5) / 4, 0.17 + 0.09 * ((k * 3) % 7) / 6, 0.016
        out, across = np.array([math.cos(a), math.sin(a), 0]), np.array([-math.sin(a), math.cos(a), 0])
        base = len(vertices)
        for i in range(rows):
            t = i / (rows - 1)
            spine = out * (0.012 + reach * t**1.6) + [0, 0, 0.06 + top * math.sin(1.9 * t) / math.sin(1.57)]
            half = wide * math.sin(math.pi * (0.08 + 0.92 * t) ** 0.8) + 0.0012
            vertices += [spine - across * half, spine - out * 0.004 - [0, 0, 0.003], spine + across * half]
        for i in range(rows - 1):
            b = base + 3 * i
            faces += [(b, b + 1, b + 4, b + 3), (b + 1, b + 2, b + 5, b + 4)]
    leaves = shapes.mesh("Leaves", vertices, faces, mats["green"], smooth=True, at=at)
    shapes.modifier(leaves, "SOLIDIFY", thickness=0.001)
    kit.flag(leaves)


# ------------------------------------------------------------------------------------------------ mirror, lamps


def _mirror_and_sconces(mats):
    x, z, wide, high = -0.37, 1.41, 0.80, 0.72
    y = BACK - 0.012
    rings = []
    for out, away in ((0.0, 0.03), (0.012, 0.03), (0.02, 0.024), (0.02, 0.006), (0.014, 0.0), (0.004, 0.0)):
        outline = (_oval(2 * math.pi * i / 96, wide / 2 + away, high / 2 + away, 8) for i in range(96))
        rings.append([(x + a, y - out, z + b) for a, b in outline])
    kit.flag(shapes.loft("Mirror frame", rings, mats["brass"], caps=False))
    face = [_oval(2 * math.pi * i / 96, wide / 2 + 0.002, high / 2 + 0.002, 8) for i in range(96)]
    vertices = [(x, y - 0.008, z), *((x + a, y - 0.008, z + b) for a, b in face)]
    triangles = [(0, 1 + i, 1 + (i + 1) % 96) for i in range(96)]
    kit.flag(shapes.mesh("Mirror", vertices, triangles, mats["mirror"]), reflectivity=1.0, opacity=1.0)
    for name, at in (("left", x - 0.50), ("right", x + 0.50)):
        plate = shapes.box(f"Sconce plate {name}", (0.06, 0.02, 0.16), (at, y - 0.004, z + 0.02), mats["brass"], 0.006)
        kit.flag(plate)
        arm = [(at, y, z - 0.02), (at, y - 0.06, z - 0.03), (at, y - 0.085, z), (at, y - 0.085, z + 0.03)]
        kit.flag(
            shapes.loft(
                f"Sconce arm {name}", shapes.sweep(shapes.sampled(arm, 20), 0.007, 16, up=(1, 0, 0)), mats["brass"]
            )
        )
        cup = [(0, 0), (0.012, 0), (0.024, 0.008), (0.036, 0.02), (0.038, 0.026), (0.034, 0.026), (0, 0.012)]
        kit.flag(
            shapes.lathe(f"Sconce cup {name}", shapes.sampled(cup, 14), 32, mats["brass"], (at, y - 0.085, z + 0.03))
        )
        shade = shapes.globe(f"Sconce globe {name}", 0.055, 32, 18, mats["opal"], (at, y - 0.085, z + 0.098))
        kit.flag(shade)


# ------------------------------------------------------------------------------------------------ toilet


def _toilet(mats):
    """Bowl, seat, raised lid and flush plate; sections are ovals that grow and move as they rise."""
    x, y = 0.60, 0.62

    def oval(z, wide, long, shift):
        return [
            (x + wide * math.cos(t), y + shift + (long if math.sin(t) < 0 else long * 0.72) * math.sin(t), z)
            for t in np.arange(20) * 2 * math.pi / 20
        ]

    outside = [
        (0.0, 0.115, 0.17, 0.10), (0.012, 0.12, 0.175, 0.10), (0.06, 0.112, 0.165, 0.10), (0.16, 0.115, 0.18, 0.09),
    ]  # fmt: skip
    outside += [
        (0.27, 0.155, 0.25, 0.05), (0.35, 0.18, 0.30, 0.02), (0.39, 0.186, 0.31, 0.01), (0.40, 0.18, 0.303, 0.01),
    ]  # fmt: skip
    inside = [
        (0.40, 0.145, 0.25, 0.01), (0.385, 0.135, 0.24, 0.01), (0.30, 0.115, 0.20, 0.02), (0.20, 0.07, 0.11, 0.05),
    ]  # fmt: skip
    inside += [(0.17, 0.03, 0.05, 0.06)]
    bowl = shapes.loft("Toilet bowl", [oval(*s) for s in outside + inside], mats["ceramic"])
    kit.flag(shapes.subdivide(bowl, 2), reflectivity=0.06, opacity=1.0)
    seat = [(0.404, 0.125, 0.225, 0.01), (0.404, 0.188, 0.312, 0.01), (0.414, 0.192, 0.318, 0.01)]
    seat += [(0.424, 0.184, 0.308, 0.01), (0.424, 0.13, 0.232, 0.01), (0.416, 0.122, 0.222, 0.01)]
    rings = np.array([oval(*s) for s in [*seat, seat[0]]])
    kit.flag(
        shapes.subdivide(shapes.loft("Toilet seat", rings, mats["walnut"], caps=False), 1),
        reflectivity=0.06,
        opacity=1.0,
    )
    lid = []
    for depth, share in ((0.0, 0.2), (0.0, 0.96), (0.006, 1.0), (0.016, 1.0), (0.022, 0.96), (0.022, 0.2)):
        wide, high, flat = 0.186 * share, 0.225 * share, y + 0.245 + depth
        turns = np.arange(28, 0, -1) * 2 * math.pi / 28
        lid.append([(x + wide * math.cos(t), flat + 0.02 * math.sin(t), 0.645 + high * math.sin(t)) for t in turns])
    kit.flag(shapes.subdivide(shapes.loft("Toilet lid", lid, mats["walnut"]), 1), reflectivity=0.06, opacity=1.0)
    bench = shapes.box("Bench", (0.80, 0.10, 0.90), (0.64, BACK - 0.05, 0.45), mats["panel"], 0.012)
    kit.flag(bench)
    top = shapes.box("Bench top", (0.82, 0.13, 0.03), (0.64, BACK - 0.06, 0.915), mats["marble"], 0.008)
    kit.flag(top, reflectivity=0.10, opacity=1.0)
    kit.flag(shapes.box("Flush plate", (0.2, 0.012, 0.05), (x, BACK - 0.062, 0.955 + 0.03), mats["chrome"], 0.005))
    holder = shapes.sweep(
        shapes.sampled([(0.30, 0.905, 0.62), (0.30, 0.86, 0.62), (0.31, 0.845, 0.62), (0.44, 0.84, 0.62)], 24),
        0.006,
        12,
    )
    kit.flag(shapes.loft("Roll holder", holder, mats["chrome"]))
    paper = [
        (0.02, 0), (0.048, 0), (0.052, 0.003), (0.052, 0.095), (0.048, 0.098), (0.02, 0.098), (0.018, 0.095),
        (0.018, 0.003), (0.02, 0),
    ]  # fmt: skip
    roll = shapes.lathe("Paper roll", paper, 40, mats["panel"], (0.325, 0.842, 0.622 - 0.018))
    roll.rotation_euler.y = math.radians(90)
    kit.flag(roll)


# ------------------------------------------------------------------------------------------------ shelves, towels


def _shelves(mats):
    """Two glass shelves on brass brackets over the bench, with bottles, soap and rolled towels."""
    for k, z in enumerate((1.28, 1.58)):
        shelf = shapes.box(f"Shelf {k}", (0.52, 0.13, 0.010), (0.60, BACK - 0.075, z), mats["glass"], 0.003)
        kit.flag(shelf)
        for sign in (-1, 1):
            at = (0.60 + 0.2 * sign, BACK - 0.075, z - 0.010)
            kit.flag(shapes.box(f"Bracket {k}{sign}", (0.014, 0.13, 0.010), at, mats["brass"], 0.003))
    flask = [
        (0, 0), (0.022, 0), (0.030, 0.006), (0.040, 0.04), (0.036, 0.075), (0.014, 0.105), (0.010, 0.125),
        (0.014, 0.130), (0.012, 0.134), (0.008, 0.126), (0.011, 0.106), (0.033, 0.074), (0.037, 0.04), (0.027, 0.010),
        (0, 0.008),
    ]  # fmt: skip
    for k, (x, mat) in enumerate(((0.44, "glass"), (0.54, "amber"))):
        at = (x, BACK - 0.075, 1.286)
        kit.flag(shapes.lathe(f"Flask {k}", shapes.sampled(flask, 32), 32, mats[mat], at))
        kit.flag(shapes.globe(f"Stopper {k}", 0.016, 24, 12, mats["brass"], (x, BACK - 0.075, 1.285 + 0.148)))
    jar = [
        (0, 0), (0.04, 0), (0.044, 0.004), (0.044, 0.06), (0.038, 0.066), (0.038, 0.072), (0.046, 0.074), (0.046,
        0.084), (0, 0.092),
    ]  # fmt: skip
    kit.flag(
        shapes.lathe("Jar", shapes.sampled(jar, 26), 36, mats["ceramic"], (0.66, BACK - 0.075, 1.285)),
        reflectivity=0.06,
        opacity=1,
    )
    soap = shapes.box("Soap", (0.08, 0.05, 0.025), (0.77, BACK - 0.075, 1.2985), mats["soap"], 0.011, segments=4)
    kit.flag(soap)
    for k in range(3):
        x, z = ((0.46, 1.632), (0.562, 1.632), (0.664, 1.632))[k]
        _rolled_towel(mats, k, (x, BACK - 0.135, z))


def _rolled_towel(mats, k, at):
    """A towel rolled up: a thick spiral, pushed out along y."""
    spiral = []
    for i in range(60):
        a = i / 59 * 2 * math.pi * 2.6 + k
        r = 0.006 + 0.0165 * (i / 59) * 2.6
        spiral.append((r * math.cos(a), r * math.sin(a)))
    rings = [[(px, y, pz) for px, pz in spiral] for y in (0.0, 0.04, 0.08, 0.12)]
    towel = shapes.loft(f"Rolled towel {k}", rings, mats["towel"], closed=False, caps=False, at=at)
    shapes.modifier(towel, "SOLIDIFY", thickness=0.011, offset=0.0)


def _towels(mats):
    """A rail on the left wall with a towel over it, soft folds below."""
    x, z = LEFT + 0.09, 1.28
    rail = [
        (LEFT, -0.02, z), (LEFT + 0.07, -0.02, z), (x, 0.0, z), (x, 0.25, z), (x, 0.48, z), (LEFT + 0.07, 0.5, z),
        (LEFT, 0.5, z),
    ]  # fmt: skip
    kit.flag(shapes.loft("Towel rail", shapes.sweep(shapes.sampled(rail, 48), 0.009, 16), mats["chrome"]))
    rows, columns = 34, 24
    drop_front, drop_back = 0.46, 0.36
    turn = math.pi * 0.016
    lengths = np.linspace(-drop_back - turn / 2, drop_front + turn / 2, rows)
    rings = []
    for s in lengths:
        line = []
        for j in range(columns):
            v = j / (columns - 1)
            if abs(s) <= turn / 2:
                a = s / turn * math.pi
                px, pz, hang = 0.016 * math.sin(a), 0.016 * math.cos(a), 0.0
            else:
                hang = abs(s) - turn / 2
                px, pz = math.copysign(0.016, s), -hang
            fold = 0.012 * math.sin(v * 21 + 0.6 * math.sin(hang * 6)) * min(1.0, hang * 4)
            narrow = 1 - 0.08 * min(1.0, hang * 2.5)
            line.append((x + px + (fold if s > 0 else fold * 0.3), 0.24 + (v - 0.5) * 0.34 * narrow, z + pz))
        rings.append(line)
    towel = shapes.loft("Towel", rings, mats["towel"], closed=False, caps=False)
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(1, 0, rows))
    corners = np.empty(len(towel.data.loops), np.int32)
    towel.data.loops.foreach_get("vertex_index", corners)
    towel.data.uv_layers[0].uv.foreach_set(
        "vector", np.stack([u.ravel(), v.ravel()], 1).astype(np.float32)[corners].ravel()
    )
    shapes.modifier(towel, "SOLIDIFY", thickness=0.006, offset=0.0)


def _door(mats):
    """The door behind the camera: the mirror shows it."""
    x, y = -0.32, FRONT + 0.02
    kit.flag(
        shapes.box("Door", (0.66, 0.04, 1.86), (x, y, 0.93), mats["walnut"], 0.006), reflectivity=0.06, opacity=1.0
    )
    for k, (z, high) in enumerate(((0.46, 0.66), (1.34, 0.86))):
        kit.flag(shapes.box(f"Door panel {k}", (0.48, 0.02, high), (x, y + 0.025, z), mats["leather"], 0.012))
    for k, (dx, size, z) in enumerate(
        ((-0.37, (0.08, 0.06, 1.94), 0.97), (0.37, (0.08, 0.06, 1.94), 0.97), (0, (0.66, 0.06, 0.08), 1.90))
    ):
        shapes.box(f"Door frame {k}", size, (x + dx, y - 0.005, z), mats["panel"], 0.01)
    grip = [
        (x + 0.27, y + 0.02, 0.98), (x + 0.27, y + 0.065, 0.98), (x + 0.255, y + 0.075, 0.98), (x + 0.16, y + 0.075,
        0.975),
    ]  # fmt: skip
    kit.flag(shapes.loft("Door handle", shapes.sweep(shapes.sampled(grip, 24), 0.010, 16), mats["brass"]))
    rose = [(0, 0.012), (0.024, 0.010), (0.027, 0.004), (0.027, 0.0)]
    plate = shapes.lathe("Door rose", shapes.sampled(rose, 10), 32, mats["brass"], (x + 0.27, y + 0.02, 0.98))
    plate.rotation_euler.x = math.radians(-90)
    kit.flag(plate)


def _lights():
    """A warm light that drifts along the ceiling, and a cool one that sweeps past the windows as the aircraft turns."""
    warm = kit.lamp("Cabin light", (-0.45, -0.35, 1.82), 70.0, (1.0, 0.88, 0.72), radius=0.03)
    kit.animate(warm, "location", {1: (-0.55, -0.45, 1.80), 12: (-0.1, 0.25, 1.84), 24: (0.30, -0.35, 1.80)})
    cool = kit.lamp("Window light", (0.70, -0.28, 1.3), 9.0, (0.74, 0.87, 1.0), radius=0.03)
    kit.animate(cool, "location", {1: (0.72, -0.55, 1.25), 24: (0.72, 0.50, 1.42)})
