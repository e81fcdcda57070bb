# SPDX-License-Identifier: GPL-3.0-or-later
"""Seven scenes of rooms and things: window pane, pool, wine glass, chrome logo, mirror, spectacles, teapot."""

from __future__ import annotations

import math

import bpy
import numpy as np

from .sets import ball, goblet, kit, monkey, paint, ring, rod, shapes, start, striped, table, tiles


def window_pane() -> None:
    """A window in its frame on a table in the garden; the pane is ray traced."""
    start("Window pane", "forest")
    table()
    white = kit.material("White paint", colour=(0.8, 0.8, 0.78), roughness=0.4)
    for x in (-1.1, 0.0, 1.1):
        shapes.box("Post", (0.09, 0.09, 1.7), (x, 0.0, 0.9), white, rounded=0.01)
    for z in (0.09, 1.71):
        shapes.box("Rail", (2.29, 0.085, 0.09), (0.0, 0.0, z), white, rounded=0.01)
    kit.flag(shapes.box("Pane", (2.16, 0.02, 1.56), (0.0, 0.0, 0.9), kit.glass("Window glass")))
    head = monkey("Monkey", kit.material("Blue", colour=(0.06, 0.18, 0.55), roughness=0.4), (0.55, 1.0, 0.55))
    head.rotation_euler = (math.radians(-15), 0, math.radians(-15))
    cone = [(0.0, 0.0), (0.34, 0.0), (0.30, 0.04), (0.02, 0.95), (0.0, 0.96)]
    shapes.lathe("Cone", cone, 48, kit.material("Orange", colour=(0.8, 0.35, 0.08), roughness=0.5), (-0.5, 0.8, 0.0))
    ball("Ball", kit.material("Coral", colour=(0.75, 0.16, 0.12), roughness=0.35), (-1.35, -0.8, 0.28), 0.28)
    kit.sun("Sun", (-2.5, 3.5, 4.0), (0.0, 0.0, 0.0), 3.0)
    kit.camera((1.6, -4.6, 1.5), (0.0, 0.1, 0.82), 42.0)


def pool() -> None:
    """A tiled pool with a lifebuoy under an open sky; the water is ray traced."""
    start("Pool", "city")
    blue, stone = (
        tiles("Pool tiles", (0.30, 0.58, 0.70), (0.75, 0.75, 0.72)),
        tiles("Rim", (0.5, 0.48, 0.44), (0.3,) * 3),
    )
    shapes.box("Bottom", (4.2, 3.2, 0.1), (0, 0, -1.25), blue)
    for sign in (-1, 1):
        shapes.box("Long wall", (4.4, 0.2, 1.4), (0, sign * 1.6, -0.6), blue)
        shapes.box("Short wall", (0.2, 3.0, 1.4), (sign * 2.1, 0, -0.6), blue)
        shapes.box("Long rim", (8.4, 2.5, 0.1), (0, sign * 2.95, 0.0), stone, rounded=0.02)
        shapes.box("Short rim", (2.0, 3.4, 0.1), (sign * 3.2, 0, 0.0), stone, rounded=0.02)
    kit.flag(_water((4.02, 3.02), -1.21, -0.2))
    buoy = striped("Buoy", ((0.95, 0.93, 0.90), (0.90, 0.22, 0.10)), 8)
    ring("Lifebuoy", buoy, (0.3, 0.1, -0.14), (0.45, 0.14), (0.06, 0.04, 0.2))
    kit.camera((0.5, -4.4, 3.0), (0.05, 0.1, -0.4), 38.0)


def _water(size: tuple[float, float], low: float, high: float, count: int = 96) -> bpy.types.Object:
    """A closed body of water with ripples on top."""
    v, u = np.mgrid[0:count, 0:count] / (count - 1) - 0.5
    x, y = u * size[0], v * size[1]
    ripples = np.sin(9 * x + 4 * y) + 0.8 * np.sin(7 * y - 5 * x + 1) + 0.6 * np.sin(15 * x * 0.8 - 11 * y + 2)
    top = np.stack([x, y, high + 0.008 * ripples], axis=-1).reshape(-1, 3)
    bottom = np.stack([x, y, np.full_like(x, low)], axis=-1).reshape(-1, 3)
    index = np.arange(count * count).reshape(count, count)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)
    rim = np.concatenate([index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]])
    after, deep = np.roll(rim, -1), count * count
    sides = np.stack([rim + deep, after + deep, after, rim], axis=-1)
    faces = [*quads, *(quads[:, ::-1] + deep), *sides]
    return shapes.mesh("Water", np.concatenate([top, bottom]), faces, kit.glass("Water", ior=1.333), smooth=True)


def wine() -> None:
    """A glass of red wine; glass and wine are ray traced."""
    start("Wine glass", "interior")
    table()
    goblet()
    inside = [(0.0, 0.936), (0.105, 0.957), (0.237, 1.022), (0.369, 1.165), (0.436, 1.36), (0.444, 1.50)]
    body = shapes.sampled(inside, 40).tolist()  # it reaches into the glass, so that no air is between
    body[0][0] = 0.0
    red = kit.glass("Red wine", ior=1.34, colour=(0.35, 0.01, 0.03))
    kit.flag(shapes.lathe("Wine", [*body, (0.436, 1.494), (0.0, 1.492)], 96, red, (0.0, 0.0, 0.001)))
    ball("Ball", kit.material("Coral", colour=(0.75, 0.16, 0.12), roughness=0.35), (-0.95, 0.5, 0.2), 0.2)
    kit.softbox("Window", (-3.0, -1.5, 3.0), (0.0, 0.0, 1.0), 120.0, 1.2)
    kit.camera((0.5, -5.2, 1.9), (0.0, 0.0, 1.0), 55.0)


def chrome_logo() -> None:
    """Four letters of chrome on a grey floor; the letters are ray traced."""
    start("Chrome logo", "city")
    shapes.box("Floor", (12, 9, 0.1), (0, 0, -0.05), kit.material("Grey", colour=(0.16, 0.16, 0.17), roughness=0.3))
    text = bpy.data.curves.new("Logo", "FONT")
    text.body, text.align_x = "LOGO", "CENTER"
    text.extrude, text.bevel_depth, text.bevel_resolution = 0.14, 0.025, 3
    text.materials.append(kit.material("Chrome", colour=(0.85, 0.85, 0.86), metallic=1.0, roughness=0.0))
    letters = kit.flag(shapes.link(bpy.data.objects.new("Logo", text)))
    letters.location, letters.rotation_euler = (0.0, 0.0, 0.02), (math.radians(90), 0, math.radians(-14))
    kit.softbox("Softbox", (-2.5, -3.0, 4.0), (0.0, 0.0, 0.3), 150.0, 1.5)
    kit.camera((0.7, -4.6, 1.25), (0.0, 0.0, 0.32), 50.0)


def mirror() -> None:
    """A bathroom with a mirror on the wall, a lamp under the ceiling; the mirror is ray traced."""
    start("Mirror", grey=(0.3, 0.33, 0.4))
    pale = tiles("Tiles", (0.42, 0.58, 0.62), (0.75, 0.76, 0.75))
    orange = kit.material("Terracotta", colour=(0.50, 0.16, 0.09), roughness=0.7)
    grey = tiles("Floor tiles", (0.55, 0.56, 0.57), (0.25, 0.25, 0.25), size=0.35)
    shapes.box("Back wall", (4.0, 0.1, 2.8), (0, 1.05, 1.4), pale)
    shapes.box("Left wall", (0.1, 5.0, 2.8), (-2.0, -1.4, 1.4), pale)
    shapes.box("Front wall", (4.0, 0.1, 2.8), (0, -3.9, 1.4), orange)
    shapes.box("Floor", (4.0, 5.0, 0.1), (0, -1.4, -0.05), grey)
    shapes.box("Ceiling", (4.0, 5.0, 0.1), (0, -1.4, 2.85), kit.material("Plaster", colour=(0.75,) * 3, roughness=0.9))
    chrome = kit.material("Chrome", colour=(0.86, 0.86, 0.88), metallic=1.0, roughness=0.05)
    silver = kit.material("Silver", colour=(0.95, 0.96, 0.96), metallic=1.0, roughness=0.0)
    kit.flag(shapes.box("Mirror", (1.5, 0.02, 1.0), (-0.2, 0.98, 1.65), silver))
    shapes.box(
        "Shelf", (1.6, 0.35, 0.1), (-0.2, 0.84, 0.95), kit.material("Ceramic", colour=(0.8,) * 3, roughness=0.1), 0.02
    )
    rod("Tap", chrome, [(-0.3, 0.9, 1.0), (-0.3, 0.9, 1.16), (-0.3, 0.83, 1.22), (-0.3, 0.74, 1.17)], 0.02)
    cup = [(0.0, 0.0), (0.06, 0.0), (0.07, 0.16), (0.062, 0.16), (0.052, 0.01), (0.0, 0.01)]
    shapes.lathe("Cup", cup, 48, kit.material("Green", colour=(0.05, 0.20, 0.16), roughness=0.3), (0.2, 0.84, 1.0))
    head = monkey("Monkey", kit.material("Skin", colour=(0.7, 0.4, 0.3), roughness=0.5), (0.75, -0.2, 1.35), 0.62)
    head.rotation_euler.z = math.radians(150)
    kit.softbox("Ceiling lamp", (-0.2, -0.6, 2.75), (-0.2, -0.6, 0.0), 60.0, 0.6, (1.0, 0.95, 0.88))
    kit.camera((0.2, -2.3, 1.6), (-0.05, 1.0, 1.42), 27.0)


def spectacles() -> None:
    """A monkey with spectacles; lenses and rims are ray traced."""
    start("Spectacles", "studio")
    monkey("Monkey", kit.material("Brown", colour=(0.35, 0.18, 0.10), roughness=0.6), (0.0, 0.0, 0.0), 2.0)
    gold = kit.material("Gold", colour=(0.9, 0.62, 0.28), metallic=1.0, roughness=0.05)
    lens = [(0.0, -0.035), (0.12, -0.032), (0.24, -0.022), (0.345, -0.008), (0.345, 0.008), (0.24, 0.0), (0.12, -0.006)]
    for sign in (-1, 1):
        at = (sign * 0.41, -1.06, 0.25)
        glass = shapes.lathe("Lens", shapes.sampled([*lens, (0.0, -0.008)], 40), 64, kit.glass("Lens"), at)
        glass.rotation_euler.x = math.radians(-90)
        kit.flag(glass)
        kit.flag(ring("Rim", gold, at, (0.36, 0.024), (math.radians(90), 0, 0)))
        temple = [(sign * 0.77, -1.04, 0.3), (sign * 1.0, -0.4, 0.34), (sign * 1.0, 0.4, 0.3)]
        kit.flag(rod("Temple", gold, temple, 0.022))
    kit.flag(rod("Bridge", gold, [(-0.07, -1.07, 0.3), (0.0, -1.09, 0.36), (0.07, -1.07, 0.3)], 0.022))
    kit.softbox("Softbox", (2.5, -3.5, 2.5), (0.0, -0.5, 0.2), 150.0, 1.2)
    kit.camera((1.1, -5.2, 0.75), (0.0, -0.2, 0.12), 62.0)


def teapot() -> None:
    """A teapot of brushed metal on a chequered table; pot, lid, spout and handle are ray traced."""
    start("Teapot", "interior")
    shapes.quad("Table", 9.0, 2, kit.material("Cloth", image=kit.packed("cloth", paint.chequer()), roughness=0.5))
    steel = kit.material("Brushed steel", colour=(0.72, 0.66, 0.58), metallic=1.0, roughness=0.25)
    pot = [(0.0, 0.0), (0.45, 0.0), (0.50, 0.03), (0.78, 0.25), (0.90, 0.55), (0.82, 0.88), (0.60, 1.06), (0.0, 1.08)]
    kit.flag(shapes.lathe("Pot", shapes.sampled(pot, 60), 96, steel))
    lid = [(0.0, 1.0), (0.60, 1.07), (0.58, 1.12), (0.30, 1.24), (0.08, 1.30), (0.05, 1.35), (0.10, 1.42), (0.0, 1.48)]
    kit.flag(shapes.lathe("Lid", shapes.sampled(lid, 48), 96, steel))
    spout = [(0.75, 0.0, 0.35), (1.05, 0.0, 0.45), (1.22, 0.0, 0.75), (1.42, 0.0, 1.0)]
    kit.flag(rod("Spout", steel, spout, np.linspace(0.22, 0.08, 40), 40, 24))
    handle = [(-0.75, 0.0, 0.9), (-1.15, 0.0, 0.98), (-1.32, 0.0, 0.75), (-1.15, 0.0, 0.45), (-0.8, 0.0, 0.35)]
    kit.flag(rod("Handle", steel, handle, 0.06, 48, 20))
    shapes.box(
        "Box", (0.5, 0.5, 0.5), (1.15, -0.95, 0.25), kit.material("Red", colour=(0.65, 0.05, 0.03)), rounded=0.02
    )
    kit.softbox("Softbox", (-2.5, -2.5, 3.5), (0.0, 0.0, 0.6), 150.0, 1.2)
    kit.camera((0.9, -5.0, 2.1), (0.08, 0.0, 0.62), 50.0)
