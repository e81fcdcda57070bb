# SPDX-License-Identifier: GPL-3.0-or-later
"""What the fifteen scenes share: a start as Blender gives it, the sky pictures that come with Blender, and things."""

from __future__ import annotations

from typing import Any

import bpy
import kit
import numpy as np
import paint
import shapes
from still_life import wine_glass

Place = tuple[float, float, float]
Colour = tuple[float, float, float]


def start(name: str, sky: str = "", strength: float = 1.0, grey: Colour = (0.05, 0.05, 0.05)) -> None:
    """A new scene with EEVEE's Raytracing on and all else as Blender has it, under one of Blender's own pictures."""
    scene = kit.new_scene(name)
    scene.eevee.use_raytracing = True
    scene.view_settings.look = "None"
    if sky:
        folder = bpy.utils.system_resource("DATAFILES", path="studiolights/world")
        kit.world(bpy.data.images.load(f"{folder}/{sky}.exr"), strength)
    else:
        kit.grey_world(grey)


def table(at: Place = (0.0, 0.0, 0.0), size: tuple[float, float] = (7.0, 5.0)) -> None:
    """A wooden table, its top at the height of `at`."""
    wood = kit.packed("wood", paint.wood(planks=6, light=(0.52, 0.33, 0.20), dark=(0.32, 0.18, 0.10)))
    top = kit.material("Wood", image=wood, roughness=0.45)
    shapes.box("Table", (*size, 0.12), (at[0], at[1], at[2] - 0.06), top, rounded=0.02)


def dark_studio() -> None:
    """A white table before a dark wall."""
    shapes.box("Table", (9.0, 6.0, 0.1), (0, 0, -0.05), kit.material("White", colour=(0.7, 0.7, 0.7), roughness=0.5))
    shapes.box("Wall", (20.0, 0.1, 12.0), (0, 5, 0), kit.material("Slate", colour=(0.05, 0.06, 0.065), roughness=0.8))


def monkey(name: str, material: Any, at: Place, size: float = 1.0, levels: int = 2) -> Any:
    """Blender's own monkey, smooth."""
    bpy.ops.mesh.primitive_monkey_add(size=size, location=at)
    head = bpy.context.object
    head.name = head.data.name = name
    head.data.materials.append(material)
    shapes.subdivide(head, levels).data.shade_smooth()
    return head


def ring(name: str, material: Any, at: Place, radii: tuple[float, float], turn: Place = (0.0, 0.0, 0.0)) -> Any:
    """A torus."""
    bpy.ops.mesh.primitive_torus_add(
        location=at, rotation=turn, major_radius=radii[0], minor_radius=radii[1], major_segments=64, minor_segments=20
    )
    torus = bpy.context.object
    torus.name = name
    torus.data.materials.append(material)
    torus.data.shade_smooth()
    return torus


def ball(name: str, material: Any, at: Place, radius: float) -> Any:
    """A sphere of 4032 triangles."""
    return shapes.globe(name, radius, 64, 32, material, at)


def rod(name: str, material: Any, points: list[Place], radius: Any, count: int = 32, sides: int = 16) -> Any:
    """A bent rod through `points`; `radius` is one number or one for each of `count` points on the way."""
    path = shapes.sampled(points, count)
    up = (0, 1, 0) if abs(path[1] - path[0])[2] > abs(path[1] - path[0])[1] else (0, 0, 1)
    return shapes.loft(name, shapes.sweep(path, radius, sides, up=up), material)


def goblet(at: Place = (0.0, 0.0, 0.001)) -> Any:
    """The still lifes' wine glass of clear glass, ray traced."""
    return kit.flag(wine_glass(kit.glass("Clear glass"), at))


def tiles(name: str, colour: Colour, grout: Colour, roughness: float = 0.2, size: float = 0.25) -> Any:
    """Square tiles with grout, laid out by UV."""
    material = kit.material(name, roughness=roughness)
    uv = kit.node(material, "ShaderNodeTexCoord").outputs["UV"]
    shades = {"Color1": (*colour, 1.0), "Color2": (*(0.8 * c for c in colour), 1.0), "Mortar": (*grout, 1.0)}
    widths = {"Scale": 1.0, "Brick Width": size, "Row Height": size, "Mortar Size": 0.03 * size}
    brick = kit.node(material, "ShaderNodeTexBrick", {"Vector": uv, **shades, **widths}, offset=0.0)
    kit.plug(material, "Principled", {"Base Color": brick.outputs["Color"]})
    return material


def striped(name: str, colours: tuple[Colour, Colour], stripes: int, image: str = "stripes") -> Any:
    """Stripes across U, from a packed picture."""
    column = (np.arange(512) * stripes // 512) % 2
    picture = np.asarray(colours)[column][None].repeat(8, axis=0)
    return kit.material(name, image=kit.packed(image, picture), roughness=0.4)
