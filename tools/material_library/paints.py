# SPDX-License-Identifier: GPL-3.0-or-later
"""Paints, lacquers and plastics: a rough base under a sharp coat, by Fresnel, Layer Weight and masks."""

from __future__ import annotations

from typing import Any

from .tree import Tree


def flakes(tree: Tree, scale: float, tilt: float) -> Any:
    """A normal of flakes: each Voronoi cell leans its own way, at most by about `tilt` radians."""
    lean = tree.vector("SUBTRACT", tree.cells(scale).outputs["Color"], (0.5, 0.5, 0.5))
    lean = tree.vector("MULTIPLY", lean, (2.0 * tilt,) * 3)
    return tree.vector("NORMALIZE", tree.vector("ADD", lean, tree.node("NewGeometry").outputs["Normal"]))


def car_paint_flakes(tree: Tree) -> None:
    """Red car paint: pigment and metal flakes, which lean each its own way, under a sharp coat by Fresnel."""
    pigment = tree.diffuse((0.30, 0.008, 0.006))
    metal = tree.glossy((0.75, 0.10, 0.06), 0.35, Normal=flakes(tree, 90.0, 0.35))
    coat = tree.glossy((1.0, 1.0, 1.0), 0.0)
    tree.surface(tree.mix(tree.fresnel(1.5), tree.mix(0.55, pigment, metal), coat))


def car_paint_two_tone(tree: Tree) -> None:
    """A flip-flop paint: blue in the middle, violet and green towards the rim, rough metal under Principled's coat."""
    tone = tree.ramp(
        tree.facing(0.4), [(0.0, (0.01, 0.06, 0.45)), (0.45, (0.25, 0.03, 0.40)), (1.0, (0.02, 0.35, 0.18))]
    )
    tree.surface(tree.principled(tone, Metallic=0.9, Roughness=0.38, Coat_Weight=1.0, Coat_Roughness=0.02))


def car_paint_three_layers(tree: Tree) -> None:
    """White pearl: diffuse, then a rough gloss by Facing, then mica flakes, then a sharp coat by Layer Weight."""
    base = tree.mix(tree.facing(0.25), tree.diffuse((0.75, 0.74, 0.70)), tree.glossy((0.9, 0.85, 0.75), 0.45))
    mica = tree.glossy((0.55, 0.62, 0.95), 0.22, Normal=flakes(tree, 130.0, 0.5))
    mask = tree.math("GREATER_THAN", tree.cells(130.0).outputs["Distance"], 0.45)
    coat = tree.glossy((1.0, 1.0, 1.0), 0.03)
    weight = tree.node("LayerWeight", {"Blend": 0.12}).outputs["Fresnel"]
    tree.surface(tree.mix(weight, tree.mix(mask, base, mica), coat))


def candy_paint(tree: Tree) -> None:
    """Candy apple: polished metal seen through a tinted coat."""
    tree.surface(
        tree.principled(
            (0.9, 0.85, 0.8),
            Metallic=1.0,
            Roughness=0.25,
            Coat_Weight=1.0,
            Coat_Roughness=0.0,
            Coat_IOR=1.6,
            Coat_Tint=(0.75, 0.04, 0.03),
        )
    )


def layered_varnish(tree: Tree) -> None:
    """Violin varnish: three thin coats, each a sharper gloss over the one below, tinted amber by Facing."""
    wood = tree.ramp(
        tree.noise(5.0, 4.0, tree.mapped(tree.coordinates(), Scale=(1.0, 1.0, 8.0))),
        [(0.3, (0.10, 0.03, 0.008)), (0.7, (0.34, 0.13, 0.035))],
    )
    amber = tree.blend(tree.facing(0.4), wood, (0.10, 0.025, 0.004))
    shader = tree.diffuse(amber)
    for roughness, ior in ((0.4, 1.25), (0.15, 1.35), (0.02, 1.5)):
        shader = tree.mix(tree.fresnel(ior), shader, tree.glossy((1.0, 0.92, 0.8), roughness))
    tree.surface(shader)


def glazed_brick(tree: Tree) -> None:
    """Bricks under glaze: rough mortar and glossy stones by the Brick Texture's factor."""
    brick = tree.node(
        "TexBrick",
        {
            "Vector": tree.coordinates("UV"),
            "Color1": (0.32, 0.06, 0.03),
            "Color2": (0.22, 0.035, 0.02),
            "Mortar": (0.45, 0.43, 0.40),
            "Scale": 8.0,
        },
    )
    bump = tree.bump(brick.outputs[1], -0.01)
    stone = tree.mix(tree.fresnel(1.5), tree.diffuse(brick), tree.glossy((1.0, 1.0, 1.0), 0.06))
    tree.surface(tree.mix(brick.outputs[1], stone, tree.diffuse(brick, Roughness=1.0, Normal=bump)))


def carbon_fibre(tree: Tree) -> None:
    """Twill of two directions of anisotropic threads, under a coat by Fresnel."""
    at = tree.mapped(tree.coordinates("UV"), Scale=(40.0, 20.0, 1.0))
    squares = tree.node("TexChecker", {"Vector": at, "Scale": 1.0}).outputs[1]
    tangent = tree.node("Tangent", direction_type="UV_MAP")
    warp, weft = (
        tree.glossy((0.09, 0.09, 0.10), 0.4, Anisotropy=0.8, Rotation=turn, Tangent=tangent) for turn in (0.0, 0.25)
    )
    threads = tree.add(tree.diffuse((0.006, 0.006, 0.007)), tree.mix(squares, warp, weft))
    tree.surface(tree.mix(tree.fresnel(1.5), threads, tree.glossy((1.0, 1.0, 1.0), 0.0)))


def dirty_plastic(tree: Tree) -> None:
    """Yellow plastic with dust in large noise spots and scratches in its roughness: two Principled by a mask."""
    scratches = tree.noise(60.0, 3.0, tree.mapped(tree.coordinates(), Scale=(1.0, 0.1, 0.1)))
    rough = tree.node("MapRange", {0: scratches, 1: 0.4, 2: 0.7, 3: 0.08, 4: 0.4}).outputs[0]
    clean = tree.principled((0.75, 0.42, 0.02), Roughness=rough)
    dust = tree.principled((0.16, 0.12, 0.085), Roughness=0.95, Specular_IOR_Level=0.1)
    mask = tree.band(tree.noise(3.0, 5.0), 0.47, 0.58)
    tree.surface(tree.mix(mask, clean, dust))


MATERIALS = (
    car_paint_flakes,
    car_paint_two_tone,
    car_paint_three_layers,
    candy_paint,
    layered_varnish,
    glazed_brick,
    carbon_fibre,
    dirty_plastic,
)
