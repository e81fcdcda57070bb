# SPDX-License-Identifier: GPL-3.0-or-later
"""A product photograph: glass, metal, car paint and a diamond on a sweep, lit by softboxes and a bar."""

from __future__ import annotations

import math

import kit
import shapes

# A bottle's wall in section, (radius, height), one unit = 10 cm: up outside, over the lip, and down again inside.
OUTSIDE = [
    (0.0, 0.02), (0.34, 0.0), (0.45, 0.0), (0.50, 0.02), (0.52, 0.08), (0.52, 0.60), (0.52, 1.10), (0.52, 1.46),
    (0.47, 1.64), (0.30, 1.81), (0.175, 1.93), (0.155, 2.04), (0.155, 2.26), (0.185, 2.28), (0.185, 2.36),
    (0.155, 2.39),
]  # fmt: skip
INSIDE = [
    (0.115, 2.39), (0.11, 2.30), (0.11, 2.06), (0.13, 1.92), (0.26, 1.77), (0.425, 1.61), (0.47, 1.45), (0.47, 1.10),
    (0.47, 0.60), (0.47, 0.18), (0.43, 0.13), (0.30, 0.13), (0.0, 0.15),
]  # fmt: skip
OVERLAP = 0.015  # the liquid reaches into the wall, so that no air is between; there the smaller solid counts
STOPPER = [
    (0.0, 2.10), (0.108, 2.10), (0.109, 2.385), (0.20, 2.40), (0.215, 2.43), (0.215, 2.66), (0.20, 2.70), (0.0, 2.71),
]  # fmt: skip


def bottle(glass, liquid, metal, at=(0, 0, 0), level=1.22, segments=96):
    """A glass bottle, the liquid in it and its stopper, ray traced."""
    wall = shapes.sampled(OUTSIDE + INSIDE, 120)
    wall[[0, -1], 0] = 0.0
    fill = [(r + OVERLAP if r else 0.0, z - OVERLAP) for r, z in reversed(INSIDE) if z < level]
    fill = shapes.sampled([*fill, (0.47 + OVERLAP, level)], 40).tolist()
    fill[0][0] = 0.0
    surface = [(0.462, level - 0.012), (0.44, level - 0.02), (0.0, level - 0.022)]  # the meniscus
    return [
        kit.flag(shapes.lathe("Bottle", wall, segments, glass, at)),
        kit.flag(shapes.lathe("Liquid", fill + surface, segments, liquid, at)),
        kit.flag(shapes.bevel(shapes.lathe("Stopper", STOPPER, segments, metal, at), 0.012)),
    ]


def brushed(name, colour, roughness=(0.16, 0.34)):
    """Metal brushed along its X axis: streaks of more and of less roughness."""
    mat = kit.material(name, colour=colour, metallic=1.0)
    where = kit.node(mat, "ShaderNodeTexCoord").outputs["Object"]
    along = kit.node(mat, "ShaderNodeMapping", {"Vector": where, "Scale": (0.8, 70.0, 70.0)}).outputs["Vector"]
    streaks = kit.node(mat, "ShaderNodeTexNoise", {"Vector": along, "Scale": 1.0, "Detail": 4.0})
    share = {
        "Value": streaks.outputs[0],
        "From Min": 0.3,
        "From Max": 0.7,
        "To Min": roughness[0],
        "To Max": roughness[1],
    }
    kit.plug(mat, "Principled", {"Roughness": kit.node(mat, "ShaderNodeMapRange", share).outputs[0]})
    return mat


def car_paint(name, colour):
    """A metallic base coat under clear lacquer."""
    return kit.material(name, colour=colour, metallic=0.7, roughness=0.4, coat=1.0, coat_roughness=0.02)


def studio():
    """Bottle, diamond, frosted and clear glass, chrome, brushed metal and car paint under four lamps."""
    kit.new_scene("Studio")
    kit.grey_world((0.035, 0.04, 0.045))
    shapes.backdrop(
        "Sweep", kit.material("Paper", colour=(0.075, 0.14, 0.16), roughness=0.7), wide=24.0, far=5.0, high=8.0
    )
    chrome = kit.material("Chrome", colour=(0.88, 0.88, 0.90), metallic=1.0, roughness=0.0)
    copper = kit.material("Copper", colour=(0.90, 0.50, 0.32), metallic=1.0, roughness=0.08)
    clear = kit.glass("Clear glass", ior=1.5)

    plinth = [(0.0, 0.0), (1.03, 0.0), (1.05, 0.02), (1.05, 0.40), (1.03, 0.42), (0.0, 0.42)]
    plate = shapes.lathe("Plinth", plinth, 128, brushed("Brushed steel", (0.62, 0.61, 0.59)), (-0.55, 0.35, 0.0))
    kit.flag(shapes.bevel(plate, 0.008, 2))
    bottle(clear, kit.glass("Cognac", ior=1.36, colour=(0.98, 0.40, 0.06)), copper, (-0.60, 0.35, 0.421))

    frosted = kit.glass("Frosted glass", ior=1.45, colour=(0.93, 0.97, 0.98), roughness=0.32)
    slab = shapes.box("Frosted slab", (1.35, 0.12, 1.95), (1.00, 1.25, 0.976), frosted, rounded=0.05, segments=4)
    slab.rotation_euler.z = math.radians(-14)
    kit.flag(slab)
    kit.flag(shapes.globe("Copper ball", 0.55, 64, 32, copper, (0.98, 2.35, 0.55)))
    kit.flag(
        shapes.globe("Lacquered ball", 0.60, 96, 48, car_paint("Car paint", (0.50, 0.012, 0.02)), (1.68, -0.10, 0.60))
    )
    kit.flag(shapes.globe("Chrome ball", 0.40, 96, 48, chrome, (-1.95, -0.45, 0.40)))
    kit.flag(shapes.globe("Glass ball", 0.27, 96, 48, clear, (0.52, -1.05, 0.2705)))
    gem = shapes.brilliant("Diamond", 0.40, kit.glass("Diamond", ior=2.42), (-0.92, -1.70, 0.003))
    gem.rotation_euler = (0.0, math.radians(41), math.radians(-28))  # it lies on its point and girdle
    kit.flag(gem)

    kit.softbox("Key", (-4.2, -3.4, 4.6), (-0.3, 0.0, 0.9), 330.0, 1.9, (1.0, 0.96, 0.90))
    kit.softbox("Side", (4.6, -0.6, 2.2), (0.3, 0.3, 1.0), 260.0, (0.9, 2.8), (0.92, 0.96, 1.0))
    kit.softbox("Halo", (-0.4, 2.2, 6.0), (-0.5, 4.6, 0.9), 640.0, 2.0, (1.0, 0.88, 0.74), round_=True)
    kit.softbox("Bar", (0.6, -3.6, 4.4), (0.2, 0.0, 0.8), 60.0, (4.4, 0.09))
    kit.camera((0.15, -8.8, 2.75), (0.0, 0.0, 1.30), 57.0)
