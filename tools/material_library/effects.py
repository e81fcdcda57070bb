# SPDX-License-Identifier: GPL-3.0-or-later
"""Tricks of shading: glow, cut-outs, two sides, toon, X-ray, hologram."""

from __future__ import annotations

from .tree import Tree


def rim_lit_toon(tree: Tree) -> None:
    """A cartoon: a Toon BSDF, and a glowing rim by a hard step of Facing."""
    flat = tree.node("BsdfToon", {"Color": (0.08, 0.35, 0.65), "Size": 0.6, "Smooth": 0.05})
    rim = tree.math("GREATER_THAN", tree.facing(0.5), 0.72)
    tree.surface(tree.mix(rim, flat, tree.emission((1.0, 0.55, 0.15), 1.5)))


def x_ray(tree: Tree) -> None:
    """An X-ray: Transparent in the middle, a glow towards the rim."""
    edge = tree.math("POWER", tree.facing(0.5), 2.0)
    tree.surface(tree.mix(edge, tree.transparent(), tree.emission((0.35, 0.75, 1.0), 1.2)))


def hologram(tree: Tree) -> None:
    """A hologram: scan lines of light, added to Transparent, brighter at the rim."""
    lines = tree.node("TexWave", {"Vector": tree.coordinates(), "Scale": 9.0}, bands_direction="Z").outputs[1]
    glow = tree.math("MULTIPLY", tree.math("ADD", lines, 0.3), tree.facing(0.6))
    tree.surface(tree.add(tree.transparent((0.8, 0.9, 0.9)), tree.emission((0.1, 0.9, 0.7), glow)))


def two_sided_card(tree: Tree) -> None:
    """A playing card: red glossy front, blue rough back, by Geometry's Backfacing."""
    back = tree.node("NewGeometry").outputs["Backfacing"]
    front = tree.principled((0.65, 0.03, 0.02), Roughness=0.15)
    tree.surface(tree.mix(back, front, tree.principled((0.03, 0.08, 0.5), Roughness=0.7)))


def alpha_fence(tree: Tree) -> None:
    """A fence cut out of a card: the mask of a Brick Texture into Principled's Alpha."""
    mesh = tree.node(
        "TexBrick", {"Vector": tree.coordinates("UV"), "Scale": 6.0, "Mortar Size": 0.05, "Mortar Smooth": 0.0}
    ).outputs[1]
    tree.surface(tree.principled((0.55, 0.56, 0.58), Metallic=1.0, Roughness=0.35, Alpha=mesh))


def emission_label(tree: Tree) -> None:
    """A lit sign on black plastic: emission by a mask of checks, mixed."""
    at = tree.mapped(tree.coordinates("UV"), Scale=(8.0, 4.0, 1.0))
    squares = tree.node("TexChecker", {"Vector": at, "Scale": 1.0}).outputs[1]
    plastic = tree.principled((0.02, 0.02, 0.022), Roughness=0.25)
    tree.surface(tree.mix(squares, plastic, tree.emission((1.0, 0.5, 0.1), 2.0)))


def lava(tree: Tree) -> None:
    """Lava: a black crust whose cracks glow by their temperature, strength from the same noise."""
    cracks = tree.cells(3.0, feature="DISTANCE_TO_EDGE").outputs["Distance"]
    heat = tree.band(tree.math("ADD", cracks, tree.math("MULTIPLY", tree.noise(6.0, 3.0), 0.2)), 0.28, 0.08)
    kelvin = tree.node("MapRange", {0: heat, 3: 900.0, 4: 2200.0}).outputs[0]
    glow = tree.node("Blackbody", {0: kelvin})
    tree.surface(
        tree.principled(
            (0.02, 0.018, 0.016),
            Roughness=0.9,
            Emission_Color=glow,
            Emission_Strength=tree.math("MULTIPLY", heat, 4.0),
            Normal=tree.bump(cracks, 0.05),
        )
    )


def camera_glow(tree: Tree) -> None:
    """A lamp globe that glows for the camera only: Light Path's camera ray picks Emission or Diffuse."""
    seen = tree.light_path("Is Camera Ray")
    tree.surface(tree.mix(seen, tree.diffuse((0.8, 0.7, 0.5)), tree.emission((1.0, 0.75, 0.4), 1.6)))


def random_per_object(tree: Tree) -> None:
    """Plastic whose hue is the object's own random number."""
    hue = tree.node("ObjectInfo").outputs["Random"]
    color = tree.node("CombineColor", {0: hue, 1: 0.8, 2: 0.6}, mode="HSV")
    tree.surface(tree.principled(color, Roughness=0.3))


MATERIALS = (
    rim_lit_toon,
    x_ray,
    hologram,
    two_sided_card,
    alpha_fence,
    emission_label,
    lava,
    camera_glow,
    random_per_object,
)
