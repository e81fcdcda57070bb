# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage: ten materials side by side on balls and cards, a floor of checks, a long softbox, a room with windows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import bpy
import kit
import numpy as np
import shapes

from . import effects, glasses, metals, organic, paints
from .tree import Tree

MATERIALS: dict[str, Callable[[Tree], None]] = {
    build.__name__: build for room in (paints, metals, glasses, organic, effects) for build in room.MATERIALS
}

CARDS = {"translucent_leaf", "two_sided_card", "alpha_fence"}
"""Materials of thin things: they hang as a card."""

BESIDE = 10
"""Materials in one picture."""

STEP = 1.3
"""Metres from one ball, of one metre, to the next."""

VERSION = 2
"""Of the stage and of what EEVEE and Cycles are told: raise it to have their pictures drawn anew."""


def groups() -> list[list[str]]:
    """The names of all materials, as many as one picture shows at a time."""
    names = list(MATERIALS)
    return [names[start : start + BESIDE] for start in range(0, len(names), BESIDE)]


def build(names: Sequence[str], size: int) -> tuple[Any, list[Any]]:
    """(scene, the materials' node trees) for a picture of `size` pixels a material; what wears them is ray traced."""
    scene = kit.new_scene("Material library")
    scene.render.resolution_x, scene.render.resolution_y = size * len(names), round(size * 1.15)
    scene.view_settings.look = "None"
    kit.world(_room(), 1.0)
    width = STEP * len(names)
    shapes.quad("Floor", (width + 4.0, 8.0), 2, _checks())
    trees = []
    for place, name in enumerate(names):
        tree = Tree(name)
        MATERIALS[name](tree)
        trees.append(tree.b_tree)
        x = (place + 0.5) * STEP - width / 2
        if name in CARDS:
            thing = shapes.quad(name, (0.9, 0.9), 2, tree.material, (x, 0.0, 0.5))
            thing.rotation_euler = (1.35, 0.0, 0.4)
            green = kit.material("Behind", colour=(0.1, 0.35, 0.1))
            shapes.globe("Behind", 0.2, 32, 16, green, (x + 0.1, 0.4, 0.2))
        else:
            thing = shapes.globe(name, 0.5, 64, 32, tree.material, (x, 0.0, 0.502))
        kit.flag(thing)
    kit.softbox("Softbox", (0.0, -2.6, 3.2), (0.0, 0.0, 0.4), 60.0 * len(names), (width, 0.9))
    camera = kit.camera((0.0, -9.7, 3.2), (0.0, 0.0, 0.56), 50.0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", width
    return scene, trees


def slices(names: Sequence[str], width: int) -> dict[str, slice]:
    """The columns of pixels that each material has in a picture of that width."""
    size = width // len(names)
    return {name: slice(place * size, (place + 1) * size) for place, name in enumerate(names)}


def _room() -> Any:
    """A pale room with two soft windows, of radiance 4 at most: Cycles has little noise of it."""
    height, width = 64, 128
    up = np.sin(((np.arange(height) + 0.5) / height - 0.5) * np.pi)[:, None]
    turn = ((np.arange(width) + 0.5) / width * 2.0 - 1.0)[None]
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = 0.25 + 0.2 * up[..., None] * np.array([0.8, 0.9, 1.0])
    for place, half, color in ((-0.55, 0.10, (3.5, 3.6, 3.8)), (0.62, 0.16, (2.2, 2.0, 1.7))):
        soft = 1 / (1 + np.exp(60 * (np.abs(turn - place) - half))) / (1 + np.exp(14 * (np.abs(up - 0.4) - 0.35)))
        pixels[..., :3] += soft[..., None] * np.array(color)
    b_image = bpy.data.images.new("Room", width, height, float_buffer=True)
    b_image.pixels.foreach_set(pixels.ravel())
    b_image.pack()
    return b_image


def _checks() -> Any:
    """Grey and ochre, a quarter of a metre each."""
    tree = Tree("Checks")
    checks = tree.node(
        "TexChecker",
        {"Vector": tree.coordinates(), "Color1": (0.5, 0.5, 0.5), "Color2": (0.25, 0.14, 0.05), "Scale": 4.0},
    )
    tree.surface(tree.principled(checks, Roughness=0.6))
    return tree.material
