# SPDX-License-Identifier: GPL-3.0-or-later
"""Metals: brushed, flaked, hammered, rusted, gilded, anodised."""

from __future__ import annotations

from .paints import flakes
from .tree import Tree


def brushed_steel(tree: Tree) -> None:
    """A turned pan: anisotropic around Z, fine streaks in its roughness."""
    streaks = tree.noise(40.0, 2.0, tree.mapped(tree.coordinates(), Scale=(0.05, 0.05, 3.0)))
    rough = tree.node("MapRange", {0: streaks, 3: 0.25, 4: 0.45}).outputs[0]
    tangent = tree.node("Tangent", direction_type="RADIAL", axis="Z")
    tree.surface(tree.principled((0.62, 0.60, 0.57), Metallic=1.0, Roughness=rough, Anisotropic=0.85, Tangent=tangent))


def metal_flakes(tree: Tree) -> None:
    """Glitter: large Voronoi flakes of bare metal, each with its own normal and colour."""
    tint = tree.blend(0.35, (0.85, 0.80, 0.75), tree.cells(24.0).outputs["Color"])
    tree.surface(tree.principled(tint, Metallic=1.0, Roughness=0.15, Normal=flakes(tree, 24.0, 0.5)))


def rusted_iron(tree: Tree) -> None:
    """Iron and rust by a mask of noise: metal and diffuse, each with its roughness and bump."""
    mask = tree.band(tree.noise(2.5, 8.0), 0.46, 0.54)
    iron = tree.principled((0.42, 0.41, 0.40), Metallic=1.0, Roughness=0.32)
    grit = tree.noise(30.0, 4.0)
    rust = tree.principled(
        tree.ramp(grit, [(0.35, (0.06, 0.015, 0.006)), (0.65, (0.28, 0.08, 0.02))]),
        Roughness=0.9,
        Normal=tree.bump(grit, 0.01),
    )
    tree.surface(tree.mix(mask, iron, rust))


def gold_leaf(tree: Tree) -> None:
    """Gold leaf, worn down to red clay along the cracks, which are bumped."""
    worn = tree.band(tree.math("ADD", tree.cells(4.0, feature="DISTANCE_TO_EDGE"), tree.noise(9.0, 4.0)), 0.46, 0.5)
    clay = tree.mix(tree.fresnel(1.4), tree.diffuse((0.25, 0.03, 0.015)), tree.glossy((1.0, 1.0, 1.0), 0.4))
    gold = tree.glossy((1.0, 0.71, 0.29), 0.2, Normal=tree.bump(tree.noise(12.0, 2.0), 0.01))
    tree.surface(tree.mix(worn, clay, gold))


def anodised_titanium(tree: Tree) -> None:
    """Titanium burnt blue and gold: a film on a conductor; in 4.5, whose Metallic BSDF has none, on Principled."""
    height = tree.node("SeparateXYZ", {0: tree.coordinates("Generated")}).outputs["Z"]
    film = tree.node("MapRange", {0: height, 3: 60.0, 4: 320.0}).outputs[0]
    metal = tree.node("BsdfMetallic", {"Roughness": 0.25}, fresnel_type="PHYSICAL_CONDUCTOR")
    if "Thin Film Thickness" not in metal.inputs:
        tree.b_tree.nodes.remove(metal)
        metal = tree.principled((0.54, 0.50, 0.45), Metallic=1.0, Roughness=0.25)
    tree.optional(metal, "Thin Film Thickness", film)
    tree.optional(metal, "Thin Film IOR", 2.2)
    tree.surface(metal)


MATERIALS = (
    brushed_steel,
    metal_flakes,
    rusted_iron,
    gold_leaf,
    anodised_titanium,
)
