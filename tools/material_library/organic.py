# SPDX-License-Identifier: GPL-3.0-or-later
"""What lived, grew or was woven: velvet, cloth, skin, wax, marble, leaf, shell, pearl."""

from __future__ import annotations

from .tree import Tree


def velvet(tree: Tree) -> None:
    """Velvet: a Sheen BSDF added to a dark Diffuse."""
    pile = tree.node("BsdfSheen", {"Color": (0.75, 0.15, 0.25), "Roughness": 0.35})
    tree.surface(tree.add(tree.diffuse((0.05, 0.003, 0.01)), pile))


def skin(tree: Tree) -> None:
    """Skin: Principled's subsurface, pores in the bump, a second gloss as sebum in its coat."""
    blotches = tree.noise(3.0, 4.0)
    color = tree.ramp(blotches, [(0.3, (0.55, 0.24, 0.17)), (0.7, (0.70, 0.38, 0.28))])
    pores = tree.bump(tree.cells(60.0), 0.003, 0.5)
    tree.surface(
        tree.principled(
            color,
            Roughness=0.45,
            Subsurface_Weight=0.8,
            Subsurface_Radius=(1.0, 0.35, 0.2),
            Subsurface_Scale=0.06,
            Coat_Weight=0.15,
            Coat_Roughness=0.3,
            Normal=pores,
        )
    )


def wax(tree: Tree) -> None:
    """Candle wax: a Subsurface Scattering node under a soft gloss by Fresnel."""
    body = tree.node("SubsurfaceScattering", {"Color": (0.85, 0.72, 0.45), "Scale": 0.12, "Radius": (1.0, 0.6, 0.3)})
    tree.surface(tree.mix(tree.fresnel(1.4), body, tree.glossy((1.0, 1.0, 1.0), 0.25)))


def subsurface_marble(tree: Tree) -> None:
    """Marble: veins of distorted noise in a scattering body, polished."""
    veins = tree.math("ABSOLUTE", tree.math("SUBTRACT", tree.noise(2.2, 8.0, Distortion=1.2), 0.5))
    color = tree.ramp(veins, [(0.0, (0.08, 0.09, 0.11)), (0.04, (0.5, 0.5, 0.5)), (0.12, (0.82, 0.80, 0.76))])
    tree.surface(
        tree.principled(
            color,
            Roughness=0.12,
            Subsurface_Weight=0.4,
            Subsurface_Radius=(1.0, 0.9, 0.8),
            Subsurface_Scale=0.05,
        )
    )


def translucent_leaf(tree: Tree) -> None:
    """A leaf: half diffuse, half translucent, veins, and a waxy gloss by Fresnel."""
    across = tree.node("TexWave", {"Vector": tree.coordinates("UV"), "Scale": 2.5, "Distortion": 1.0}).outputs[1]
    green = tree.ramp(across, [(0.1, (0.20, 0.30, 0.05)), (0.3, (0.05, 0.18, 0.015))])
    body = tree.mix(0.5, tree.diffuse(green), tree.node("BsdfTranslucent", {"Color": green}))
    tree.surface(tree.mix(tree.fresnel(1.4), body, tree.glossy((1.0, 1.0, 1.0), 0.3)))


def iridescent_shell(tree: Tree) -> None:
    """Mother of pearl: thin film on a glossy plastic, its thickness by noise."""
    film = tree.node("MapRange", {0: tree.noise(1.8, 3.0, Distortion=2.0), 3: 250.0, 4: 650.0}).outputs[0]
    shell = tree.principled((0.55, 0.52, 0.50), Roughness=0.15, IOR=2.0)
    tree.optional(shell, "Thin Film Thickness", film)
    tree.optional(shell, "Thin Film IOR", 1.5)
    tree.surface(shell)


def pearl(tree: Tree) -> None:
    """A pearl by layers: diffuse and a pink rim by Facing, sheen, and a sharp gloss by Layer Weight."""
    cream = tree.blend(tree.facing(0.5), (0.72, 0.68, 0.62), (0.85, 0.45, 0.5))
    body = tree.principled(cream, Roughness=0.4, Sheen_Weight=0.3, Sheen_Tint=(0.6, 0.8, 1.0))
    weight = tree.node("LayerWeight", {"Blend": 0.2}).outputs["Fresnel"]
    tree.surface(tree.mix(weight, body, tree.glossy((0.9, 0.95, 1.0), 0.1)))


MATERIALS = (
    velvet,
    skin,
    wax,
    subsurface_marble,
    translucent_leaf,
    iridescent_shell,
    pearl,
)
