# SPDX-License-Identifier: GPL-3.0-or-later
"""Glass, liquids, gems and films: what light passes."""

from __future__ import annotations

from .tree import Tree


def architectural_glass(tree: Tree) -> None:
    """Glass for the camera and in mirrors, but no more than tinted air for shadows and diffuse light."""
    glass = tree.node("BsdfGlass", {"Color": (0.92, 0.98, 0.95), "Roughness": 0.0, "IOR": 1.45})
    passing = tree.math("MAXIMUM", tree.light_path("Is Shadow Ray"), tree.light_path("Is Diffuse Ray"))
    tree.surface(tree.mix(passing, glass, tree.transparent((0.92, 0.98, 0.95))))


def dispersion_glass(tree: Tree) -> None:
    """A prism's glass as libraries have it: one Refraction for each colour, added, under a gloss by Fresnel."""
    red, green, blue = (
        tree.node("BsdfRefraction", {"Color": color, "Roughness": 0.0, "IOR": ior})
        for color, ior in (((1.0, 0.0, 0.0), 1.44), ((0.0, 1.0, 0.0), 1.50), ((0.0, 0.0, 1.0), 1.56))
    )
    bent = tree.add(tree.add(red, green), blue)
    tree.surface(tree.mix(tree.fresnel(1.5), bent, tree.glossy((1.0, 1.0, 1.0), 0.0)))


def frosted_by_noise(tree: Tree) -> None:
    """Glass that is etched in spots: its roughness follows a noise."""
    etched = tree.band(tree.noise(4.0, 3.0), 0.45, 0.55)
    rough = tree.math("MULTIPLY", etched, 0.3)
    tree.surface(tree.node("BsdfGlass", {"Roughness": rough, "IOR": 1.5}))


def wine(tree: Tree) -> None:
    """Red wine: clear refraction over a body that absorbs."""
    tree.surface(tree.principled((1.0, 1.0, 1.0), Roughness=0.0, IOR=1.34, Transmission_Weight=1.0))
    tree.absorption((0.65, 0.02, 0.06), 3.0)


def honey(tree: Tree) -> None:
    """Honey: amber glass, cloudy with a share of translucent and diffuse light."""
    clear = tree.principled((0.95, 0.55, 0.06), Roughness=0.0, IOR=1.5, Transmission_Weight=1.0)
    cloudy = tree.add(tree.node("BsdfTranslucent", {"Color": (0.5, 0.2, 0.01)}), tree.diffuse((0.35, 0.13, 0.008)))
    tree.surface(tree.mix(tree.band(tree.noise(1.5, 2.0), 0.2, 1.2), clear, cloudy))
    tree.absorption((0.9, 0.5, 0.05), 1.5)


def ice(tree: Tree) -> None:
    """Ice: bumped glass, white along the cracks of a Voronoi Texture."""
    cracks = tree.cells(3.5, feature="DISTANCE_TO_EDGE").outputs["Distance"]
    bump = tree.bump(tree.noise(6.0, 3.0), 0.03)
    clear = tree.node("BsdfGlass", {"Color": (0.88, 0.96, 1.0), "Roughness": 0.05, "IOR": 1.31, "Normal": bump})
    white = tree.principled((0.85, 0.92, 0.95), Roughness=0.6)
    tree.surface(tree.mix(tree.band(cracks, 0.06, 0.0), clear, white))


def smoke_glass(tree: Tree) -> None:
    """Smoked glass of cheap scenes: a dark Transparent under a gloss by Fresnel."""
    tree.surface(tree.mix(tree.fresnel(1.45), tree.transparent((0.12, 0.11, 0.10)), tree.glossy((1.0, 1.0, 1.0), 0.0)))


def bottle_glass(tree: Tree) -> None:
    """Green glass whose colour deepens with the way inside it: Light Path's Ray Length as absorption."""
    depth = tree.math("MULTIPLY", tree.light_path("Ray Length"), -1.6)
    inside = tree.node("NewGeometry").outputs["Backfacing"]
    passed = tree.math("POWER", 2.71828, tree.math("MULTIPLY", depth, inside))
    color = tree.blend(passed, (0.05, 0.35, 0.08), (1.0, 1.0, 1.0))
    tree.surface(tree.node("BsdfGlass", {"Color": color, "Roughness": 0.0, "IOR": 1.5}))


def soap_film(tree: Tree) -> None:
    """A bubble: nothing but a reflection in the colours of a film that is thicker below."""
    height = tree.node("SeparateXYZ", {0: tree.coordinates("Generated")}).outputs["Z"]
    swirl = tree.math("ADD", height, tree.math("MULTIPLY", tree.noise(2.0, 2.0), 0.5))
    nanometres = tree.node("MapRange", {0: swirl, 1: 0.0, 2: 1.4, 3: 650.0, 4: 150.0}).outputs[0]
    skin = tree.principled((1.0, 1.0, 1.0), Metallic=0.0, Roughness=0.0, Transmission_Weight=1.0, IOR=1.33)
    tree.optional(skin, "Thin Film Thickness", nanometres)
    tree.optional(skin, "Thin Film IOR", 1.6)
    tree.optional(skin, "Thin Wall", True)
    rim = tree.facing(0.25)
    tree.surface(tree.mix(rim, tree.transparent(), skin))


def ruby(tree: Tree) -> None:
    """A gem for the cheap: red glass of a high index with a little glow, added."""
    glass = tree.node("BsdfGlass", {"Color": (0.85, 0.02, 0.05), "Roughness": 0.0, "IOR": 1.77})
    tree.surface(tree.add(glass, tree.emission((0.6, 0.0, 0.03), 0.06)))


def varying_ior(tree: Tree) -> None:
    """A blend of water and glass: the index follows the height."""
    height = tree.node("SeparateXYZ", {0: tree.coordinates("Generated")}).outputs["Z"]
    ior = tree.node("MapRange", {0: height, 3: 1.05, 4: 1.6}).outputs[0]
    tree.surface(tree.node("BsdfGlass", {"Roughness": 0.0, "IOR": ior}))


MATERIALS = (
    architectural_glass,
    dispersion_glass,
    frosted_by_noise,
    wine,
    honey,
    ice,
    smoke_glass,
    bottle_glass,
    soap_film,
    ruby,
    varying_ior,
)
