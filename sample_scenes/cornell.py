# SPDX-License-Identifier: GPL-3.0-or-later
"""The Cornell box of the thesis' figure 2.2: two spheres, red and green walls, and a mirror for the far wall."""

from __future__ import annotations

import kit
import paint
import shapes

WIDE, DEEP, HIGH = 2.9, 2.6, 2.1


def cornell_box():
    """Right sphere: a total mirror. Left sphere: half transparent, half reflective. Far wall: a mirror.

    The box is open behind the camera, so the mirror shows the spheres from behind and, beyond them, the sky.
    """
    kit.new_scene("Cornell box")
    kit.world(kit.packed("lake", paint.lake()), 1.0)
    white = kit.material("White plaster", colour=(0.72, 0.65, 0.55), roughness=0.6)
    red = kit.material("Red plaster", colour=(0.56, 0.06, 0.05), roughness=0.6)
    green = kit.material("Green plaster", colour=(0.10, 0.33, 0.11), roughness=0.6)
    mirror = kit.material("Mirror", colour=(0.95, 0.95, 0.95), metallic=1.0, roughness=0.0)
    steel = kit.material("Grey lacquer", colour=(0.16, 0.165, 0.17), roughness=0.3)
    glow = kit.material("Lamp", colour=(0.9, 0.9, 0.9), emission=(1.0, 0.90, 0.75), strength=4.0)
    thick = 0.08

    def wall(name, size, at, mat):
        return shapes.box(name, size, at, mat, rounded=0.012, segments=2)

    wall("Floor", (WIDE + 2 * thick, DEEP, thick), (0, 0, -thick / 2), white)
    wall("Ceiling", (WIDE + 2 * thick, DEEP, thick), (0, 0, HIGH + thick / 2), white)
    wall("Red wall", (thick, DEEP, HIGH), (-(WIDE + thick) / 2, 0, HIGH / 2), red)
    wall("Green wall", (thick, DEEP, HIGH), ((WIDE + thick) / 2, 0, HIGH / 2), green)
    wall("Back", (WIDE, thick, HIGH), (0, (DEEP + thick) / 2, HIGH / 2), white)
    glass = shapes.box("Mirror wall", (WIDE - 0.16, 0.02, HIGH - 0.16), (0, DEEP / 2 - 0.01, HIGH / 2), mirror)
    kit.flag(glass, reflectivity=1.0, opacity=1.0)
    for name, size, x, z in (
        ("Frame left", (0.08, 0.05, HIGH), -(WIDE - 0.08) / 2, HIGH / 2),
        ("Frame right", (0.08, 0.05, HIGH), (WIDE - 0.08) / 2, HIGH / 2),
        ("Frame below", (WIDE - 0.16, 0.05, 0.08), 0, 0.04),
        ("Frame above", (WIDE - 0.16, 0.05, 0.08), 0, HIGH - 0.04),
    ):
        shapes.box(name, size, (x, DEEP / 2 - 0.025, z), steel, rounded=0.012, segments=2)

    half = shapes.globe("Left sphere", 0.46, 96, 48, kit.glass("Half glass", ior=1.5), (-0.62, 0.12, 0.46))
    kit.flag(half, reflectivity=0.5, opacity=0.5, ior=1.5)
    half.data.materials[0].node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.85, 0.9, 1)
    full = shapes.globe("Right sphere", 0.46, 96, 48, mirror, (0.60, 0.22, 0.46))
    kit.flag(full, reflectivity=1.0, opacity=1.0)

    shapes.box("Lamp panel", (0.8, 0.6, 0.02), (0, -0.1, HIGH - 0.012), glow, rounded=0.005, segments=2)
    shapes.box("Lamp frame", (0.9, 0.7, 0.016), (0, -0.1, HIGH - 0.006), steel, rounded=0.005, segments=2)
    kit.lamp("Ceiling light", (0, -0.1, HIGH - 0.2), 60.0, (1.0, 0.91, 0.78), radius=0.04)
    kit.lamp("Fill light", (0.5, -1.0, 1.5), 14.0, (0.80, 0.90, 1.0), radius=0.04)
    kit.camera((0.0, -3.35, 1.08), (0.0, 0.0, 0.94), 33.0)
