# SPDX-License-Identifier: GPL-3.0-or-later
"""Eight scenes of the studio: skin, car paint, frosted glass, balls, bottle, gems, hair and smoke behind glass."""

from __future__ import annotations

import math

import bpy
import numpy as np
import studio

from .sets import ball, dark_studio, goblet, kit, monkey, ring, shapes, start


def skin_beside_glass() -> None:
    """A head with subsurface scattering, a wine glass and a glass ball; the glass is ray traced."""
    start("Skin beside glass")
    dark_studio()
    skin = kit.material("Skin", colour=(0.75, 0.45, 0.36), roughness=0.45, subsurface=1.0, subsurface_scale=0.06)
    monkey("Monkey", skin, (-0.75, 0.6, 0.78), 1.5).rotation_euler.z = math.radians(10)
    goblet((0.75, 0.1, 0.001))
    kit.flag(ball("Glass ball", kit.glass("Ball glass"), (0.0, -0.75, 0.38), 0.379))
    kit.softbox("Key", (-2.5, -3.0, 3.5), (0.0, 0.0, 0.6), 250.0, 1.5)
    kit.softbox("Fill", (3.0, -2.0, 2.5), (0.0, 0.0, 0.6), 80.0, 1.0)
    kit.camera((0.1, -5.8, 1.7), (0.0, 0.0, 0.85), 50.0)


def car_paint() -> None:
    """A small car in metallic paint with flakes; the body is ray traced."""
    start("Car paint", "city")
    shapes.box("Road", (20, 16, 0.1), (0, 0, -0.05), kit.material("Asphalt", colour=(0.08,) * 3, roughness=0.7))
    paint = kit.material("Car paint", colour=(0.03, 0.10, 0.42), metallic=0.9, roughness=0.35, coat=1.0)
    where = kit.node(paint, "ShaderNodeTexCoord").outputs["Object"]
    cells = kit.node(paint, "ShaderNodeTexVoronoi", {"Vector": where, "Scale": 120.0}).outputs["Color"]
    flakes = kit.node(paint, "ShaderNodeNormalMap", {"Color": cells, "Strength": 0.12}, space="OBJECT")
    normal = kit.node(paint, "ShaderNodeMix", data_type="VECTOR")
    straight = kit.node(paint, "ShaderNodeNewGeometry").outputs["Normal"]
    kit.plug(paint, normal, {0: 0.12, 4: straight, 5: flakes.outputs["Normal"]})
    kit.plug(paint, "Principled", {"Normal": normal.outputs[1]})
    share = np.linspace(-1, 1, 33)
    belly = 0.30 + 0.78 * (1 - np.abs(share) ** 5) ** 0.5 * (0.72 + 0.28 * np.exp(-((share / 0.5) ** 4)))
    _shell("Body", paint, share * 2.1, 0.86 * (1 - np.abs(share) ** 6) ** 0.35, np.full(33, 0.22), belly)
    dome = np.sqrt(np.clip(1 - share**2, 0, None))
    glass = kit.material("Dark glass", colour=(0.01,) * 3, roughness=0.03)
    _shell("Cabin", glass, share * 1.15 - 0.15, 0.70 * dome**0.6, np.full(33, 0.8), 0.82 + 0.66 * dome)
    tyre, hub = (
        kit.material("Rubber", colour=(0.02,) * 3, roughness=0.6),
        kit.material("Hub", metallic=1.0, roughness=0.2),
    )
    for x in (-1.25, 1.25):
        for y in (-0.80, 0.80):
            ring("Tyre", tyre, (x, y, 0.36), (0.25, 0.11), (math.radians(90), 0, 0))
            hubcap = [(0.0, -0.06), (0.22, -0.05), (0.24, 0.0), (0.22, 0.05), (0.0, 0.06)]
            shapes.lathe("Hub", hubcap, 48, hub, (x, y * 1.02, 0.36)).rotation_euler.x = math.radians(90)
    kit.softbox("Softbox", (-1.0, -4.0, 4.5), (0.0, 0.0, 0.5), 500.0, (3.0, 1.2))
    kit.camera((-3.6, -5.6, 2.2), (0.0, 0.0, 0.62), 50.0)


def _shell(name: str, material: object, x: np.ndarray, wide: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """A closed skin over superellipses along X; ray traced if it is the body."""
    angle = np.arange(40) * 2 * np.pi / 40
    across = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** 0.6
    above = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** 0.6
    middle, half = (low + high) / 2, np.maximum((high - low) / 2, 1e-3)
    wide = np.maximum(wide, 1e-3)
    rings = np.stack(
        [np.repeat(x[:, None], 40, 1), wide[:, None] * across, middle[:, None] + half[:, None] * above], -1
    )
    skin = shapes.subdivide(shapes.loft(name, rings, material), 1)
    if name == "Body":
        kit.flag(skin)


def frosted() -> None:
    """A frosted pane before three balls, and a frosted cup; pane and cup are ray traced."""
    start("Frosted pane and cup")
    dark_studio()
    kit.flag(shapes.box("Pane", (2.6, 0.06, 1.5), (-0.35, 0.2, 0.76), kit.glass("Frosted pane", roughness=0.25)))
    for name, colour, x in (
        ("Red", (0.6, 0.05, 0.04), -1.0),
        ("Green", (0.06, 0.4, 0.08), -0.3),
        ("Blue", (0.05, 0.12, 0.6), 0.4),
    ):
        ball(name, kit.material(name, colour=colour, roughness=0.4), (x, 0.75, 0.25), 0.25)
    cup = [(0.0, 0.0), (0.26, 0.0), (0.30, 0.03), (0.33, 0.8), (0.30, 0.81), (0.265, 0.06), (0.0, 0.05)]
    frost = kit.glass("Frosted cup", roughness=0.15)
    kit.flag(shapes.lathe("Cup", shapes.sampled(cup, 50), 64, frost, (1.35, -0.3, 0.001)))
    kit.softbox("Back light", (-1.8, 3.5, 2.6), (-0.2, 0.0, 0.5), 250.0, 1.4, round_=True)
    kit.softbox("Fill", (2.5, -3.0, 3.0), (0.0, 0.0, 0.5), 120.0, 1.2)
    kit.camera((0.4, -5.0, 1.5), (0.1, 0.0, 0.62), 50.0)


def studio_balls() -> None:
    """Chrome, lacquer and glass under a square softbox; all three balls are ray traced."""
    start("Studio balls", grey=(0.02, 0.02, 0.025))
    shapes.backdrop("Sweep", kit.material("Grey", colour=(0.25, 0.25, 0.25), roughness=0.6))
    chrome = kit.material("Chrome", colour=(0.9, 0.9, 0.9), metallic=1.0, roughness=0.0)
    lacquer = kit.material("Lacquer", colour=(0.55, 0.02, 0.015), roughness=0.3, coat=1.0)
    for name, material, x in (
        ("Chrome", chrome, -1.15),
        ("Lacquer", lacquer, 0.0),
        ("Glass", kit.glass("Glass"), 1.15),
    ):
        kit.flag(ball(f"{name} ball", material, (x, 0.0, 0.501), 0.5))
    kit.softbox("Softbox", (-1.5, -3.0, 3.5), (0.0, 0.0, 0.4), 250.0, 1.0)
    kit.camera((0.0, -5.6, 1.35), (0.0, 0.0, 0.55), 55.0)


def bottle() -> None:
    """A bottle of oil between three softboxes; glass, oil and stopper are ray traced."""
    start("Bottle", grey=(0.02, 0.02, 0.02))
    shapes.backdrop("Sweep", kit.material("Grey", colour=(0.30, 0.30, 0.30), roughness=0.6))
    copper = kit.material("Copper", colour=(0.9, 0.5, 0.32), metallic=1.0, roughness=0.1)
    studio.bottle(
        kit.glass("Bottle glass", colour=(0.92, 0.98, 0.94)),
        kit.glass("Oil", ior=1.47, colour=(0.85, 0.75, 0.15)),
        copper,
    )
    kit.softbox("Left", (-3.0, -0.5, 2.2), (0.0, 0.0, 1.2), 120.0, (0.8, 2.4))
    kit.softbox("Right", (3.0, -0.5, 2.2), (0.0, 0.0, 1.2), 120.0, (0.8, 2.4))
    kit.softbox("Top", (0.0, 1.0, 5.0), (0.0, 0.8, 0.0), 200.0, 2.0)
    kit.camera((0.0, -6.5, 1.9), (0.0, 0.0, 1.3), 55.0)


def gems() -> None:
    """A diamond and a ruby under a softbox; both are ray traced."""
    start("Diamond and ruby", grey=(0.03, 0.03, 0.035))
    shapes.backdrop("Velvet", kit.material("Velvet", colour=(0.16, 0.15, 0.32), roughness=0.8))
    for name, ior, colour, x, turn in (
        ("Diamond", 2.42, (1.0, 1.0, 1.0), -0.75, (0.0, 0.0, 0.2)),
        ("Ruby", 1.77, (0.8, 0.02, 0.06), 0.55, (math.radians(40), 0.0, math.radians(-25))),
    ):
        stone = shapes.brilliant(name, 0.6, kit.glass(name, ior=ior, colour=colour), (x, 0.0, 0.01))
        stone.rotation_euler = turn
        kit.flag(stone)
    kit.softbox("Softbox", (1.2, -2.2, 3.2), (0.0, 0.0, 0.4), 150.0, 0.8)
    kit.softbox("Back", (-2.0, 2.5, 2.5), (0.0, 0.0, 0.3), 60.0, 0.5)
    kit.camera((0.0, -4.6, 2.0), (-0.05, 0.0, 0.33), 50.0)


def hair_behind_glass() -> None:
    """A ball of hair behind a wine glass; the glass is ray traced."""
    start("Hair behind glass")
    dark_studio()
    brown = kit.material("Hair", colour=(0.42, 0.18, 0.06), roughness=0.5)
    ball("Ball", brown, (0.0, 1.0, 1.15), 0.75)
    count, steps = 3000, 5
    turn = np.arange(count) * math.pi * (3 - math.sqrt(5))
    up = 1 - 2 * (np.arange(count) + 0.5) / count
    out = np.sqrt(1 - up**2)
    way = np.stack([out * np.cos(turn), out * np.sin(turn), up], axis=-1)
    reach = np.linspace(0.74, 1.05, steps)[:, None]
    points = np.array([0.0, 1.0, 1.15]) + way[:, None] * reach - np.array([0.0, 0.0, 0.4]) * (reach - 0.74) ** 2
    hair = bpy.data.hair_curves.new("Hair")
    hair.add_curves([steps] * count)
    hair.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    radius = hair.attributes.get("radius") or hair.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.tile(np.linspace(0.006, 0.002, steps), count).astype(np.float32))
    hair.materials.append(brown)
    shapes.link(bpy.data.objects.new("Hair", hair))
    _glass_before()


def smoke_behind_glass() -> None:
    """A cube of smoke behind a wine glass; the glass is ray traced."""
    start("Smoke behind glass")
    dark_studio()
    smoke = bpy.data.materials.new("Smoke")
    if not smoke.node_tree:
        smoke.use_nodes = True
    smoke.node_tree.nodes.clear()
    where = kit.node(smoke, "ShaderNodeTexCoord").outputs["Object"]
    clouds = kit.node(smoke, "ShaderNodeTexNoise", {"Vector": where, "Scale": 1.6, "Detail": 3.0}).outputs[0]
    density = {"Value": clouds, "From Min": 0.42, "From Max": 0.75, "To Max": 3.0}
    density = kit.node(smoke, "ShaderNodeMapRange", density).outputs[0]
    volume = kit.node(smoke, "ShaderNodeVolumePrincipled", {"Density": density, "Color": (0.8, 0.8, 0.8, 1.0)})
    kit.node(smoke, "ShaderNodeOutputMaterial", {"Volume": volume.outputs[0]})
    shapes.box("Smoke", (2.2, 1.2, 2.0), (0.0, 1.2, 1.05), smoke)
    _glass_before()


def _glass_before() -> None:
    """The wine glass, lamps and camera of hair and smoke."""
    goblet((0.0, -0.6, 0.001))
    kit.softbox("Key", (-2.5, -3.0, 3.5), (0.0, 0.5, 0.8), 250.0, 1.5)
    kit.softbox("Rim", (2.5, 2.5, 3.0), (0.0, 1.0, 1.0), 120.0, 1.0)
    kit.camera((0.0, -5.8, 1.7), (0.0, 0.0, 1.05), 50.0)
