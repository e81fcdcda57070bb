# SPDX-License-Identifier: GPL-3.0-or-later
"""The rows of the table: inputs of Principled and closure nodes, at three values each, and what is known of them."""

from __future__ import annotations

from typing import Any

RED, BLUE, DARK, WHITE = (0.7, 0.2, 0.1), (0.1, 0.3, 0.8), (0.05, 0.04, 0.03), (1.0, 1.0, 1.0)
METAL = {"Metallic": 1.0, "Base Color": (0.9, 0.6, 0.3), "Roughness": 0.3}
CLEAR = {"Transmission Weight": 1.0, "Roughness": 0.0}
COATED = {"Base Color": BLUE, "Coat Weight": 1.0}
FUZZY = {"Base Color": DARK, "Sheen Weight": 1.0}
SOFT = {"Base Color": RED, "Subsurface Weight": 1.0, "Subsurface Scale": 0.1}
FILM = {**METAL, "Roughness": 0.1, "Thin Film Thickness": 400.0}

PRINCIPLED: dict[str, tuple[Any, ...]] = {
    "Base Color": ({}, RED, BLUE, DARK),
    "Metallic": ({"Base Color": RED}, 0.2, 0.6, 1.0),
    "Roughness": ({"Base Color": RED}, 0.05, 0.4, 1.0),
    "IOR": ({"Base Color": RED, "Roughness": 0.2}, 1.0, 1.3, 2.5),
    "Alpha": ({"Base Color": RED}, 0.0, 0.4, 0.8),
    "Diffuse Roughness": ({"Base Color": RED, "Specular IOR Level": 0.0}, 0.2, 0.6, 1.0),
    "Subsurface Weight": (SOFT, 0.2, 0.6, 1.0),
    "Subsurface Radius": (SOFT, (1.0, 0.2, 0.1), (0.3, 0.3, 0.3), (0.1, 0.2, 1.0)),
    "Subsurface Scale": (SOFT, 0.005, 0.05, 0.5),
    "Subsurface Anisotropy": (SOFT, 0.0, 0.4, 0.8),
    "Specular IOR Level": ({"Base Color": DARK, "Roughness": 0.3}, 0.0, 0.3, 1.0),
    "Specular Tint": ({"Base Color": DARK, "Roughness": 0.3, "Specular IOR Level": 1.0}, RED, BLUE, WHITE),
    "Anisotropic": (METAL, 0.2, 0.6, 1.0),
    "Anisotropic Rotation": ({**METAL, "Anisotropic": 0.8}, 0.1, 0.25, 0.6),
    "Transmission Weight": ({"Roughness": 0.0, "Base Color": RED}, 0.2, 0.6, 1.0),
    "Transmission Weight, rough": ({"Roughness": 0.3, "Base Color": RED}, 0.2, 0.6, 1.0),
    "IOR of glass": (CLEAR, 1.0, 1.3, 2.5),
    "Coat Weight": (COATED, 0.2, 0.6, 1.0),
    "Coat Roughness": (COATED, 0.0, 0.2, 0.6),
    "Coat IOR": (COATED, 1.1, 1.8, 3.0),
    "Coat Tint": ({"Base Color": WHITE, "Coat Weight": 1.0}, RED, BLUE, (0.5, 0.5, 0.5)),
    "Sheen Weight": (FUZZY, 0.2, 0.6, 1.0),
    "Sheen Roughness": (FUZZY, 0.1, 0.5, 1.0),
    "Sheen Tint": (FUZZY, RED, BLUE, WHITE),
    "Emission Color": ({"Base Color": DARK, "Emission Strength": 1.0}, RED, BLUE, WHITE),
    "Emission Strength": ({"Base Color": DARK, "Emission Color": RED}, 0.1, 1.0, 5.0),
    "Thin Film Thickness": (FILM, 200.0, 400.0, 800.0),
    "Thin Film IOR": (FILM, 1.1, 1.5, 2.2),
    "Thin Film on plastic": ({"IOR": 2.0, "Roughness": 0.1, "Base Color": DARK}, 200.0, 400.0, 800.0),
    "Thin Wall": ({**CLEAR, "Base Color": BLUE}, False, True),
}
"""Input: what it counts beside, and its values. What stands after a comma or a preposition tells rows apart."""

NODES: dict[str, tuple[Any, ...]] = {
    "Diffuse, Roughness": ("BsdfDiffuse", {"Color": RED}, "Roughness", 0.0, 0.5, 1.0),
    "Glossy, Roughness": ("BsdfAnisotropic", {"Color": RED}, "Roughness", 0.0, 0.3, 1.0),
    "Glossy, Anisotropy": ("BsdfAnisotropic", {"Color": RED, "Roughness": 0.4}, "Anisotropy", -0.5, 0.5, 0.9),
    "Metallic, F82, Roughness": ("BsdfMetallic", {}, "Roughness", 0.0, 0.3, 1.0),
    "Metallic, Edge Tint": ("BsdfMetallic", {"Roughness": 0.2}, "Edge Tint", RED, BLUE, WHITE),
    "Metallic, Anisotropy": ("BsdfMetallic", {"Roughness": 0.4}, "Anisotropy", 0.2, 0.5, 0.9),
    "Metallic, Thin Film Thickness": ("BsdfMetallic", {"Roughness": 0.1}, "Thin Film Thickness", 200.0, 400.0, 800.0),
    "Glass, Roughness": ("BsdfGlass", {"Color": (0.8, 0.9, 1.0)}, "Roughness", 0.0, 0.2, 0.6),
    "Glass, IOR": ("BsdfGlass", {}, "IOR", 0.8, 1.0, 2.0),
    "Glass, Thin Film Thickness": ("BsdfGlass", {}, "Thin Film Thickness", 200.0, 400.0, 800.0),
    "Refraction, Roughness": ("BsdfRefraction", {"Color": (0.8, 0.9, 1.0)}, "Roughness", 0.0, 0.2, 0.6),
    "Refraction, IOR": ("BsdfRefraction", {}, "IOR", 0.8, 1.0, 2.0),
    "Transparent, Color": ("BsdfTransparent", {}, "Color", RED, BLUE, WHITE),
    "Translucent, Color": ("BsdfTranslucent", {}, "Color", RED, BLUE, WHITE),
    "Sheen, Roughness": ("BsdfSheen", {"Color": RED}, "Roughness", 0.1, 0.5, 1.0),
    "Toon, Size": ("BsdfToon", {"Color": RED}, "Size", 0.2, 0.5, 0.9),
    "Subsurface, Scale": ("SubsurfaceScattering", {"Color": RED}, "Scale", 0.005, 0.05, 0.5),
    "Emission, Strength": ("Emission", {"Color": RED}, "Strength", 0.1, 1.0, 5.0),
    "Holdout": ("Holdout", {}, "", None),
    "Hair, RoughnessU": ("BsdfHair", {"Color": RED}, "RoughnessU", 0.1, 0.4, 1.0),
    "Principled Hair, Roughness": ("BsdfHairPrincipled", {}, "Roughness", 0.1, 0.4, 1.0),
    "Specular (EEVEE), Roughness": ("EeveeSpecular", {"Base Color": RED}, "Roughness", 0.0, 0.3, 1.0),
    "Mix, Glossy over Diffuse": ("MixShader", {1: "diffuse", 2: "glossy"}, 0, 0.0, 0.3, 1.0),
    "Mix, sharp over rough": ("MixShader", {1: "rough", 2: "glossy"}, 0, 0.2, 0.5, 0.8),
    "Mix, Glass and Diffuse": ("MixShader", {1: "diffuse", 2: "glass"}, 0, 0.2, 0.5, 0.8),
    "Mix, Glass and Transparent": ("MixShader", {1: "transparent", 2: "glass"}, 0, 0.2, 0.5, 0.8),
    "Add, Diffuse and": ("AddShader", {0: "diffuse"}, 1, "glossy", "rough", "emission"),
}
"""Label: the node, what it is given, the input that varies (by name or place), and its values."""

PARTS: dict[str, tuple[str, dict[str, Any]]] = {
    "diffuse": ("BsdfDiffuse", {"Color": BLUE}),
    "glossy": ("BsdfAnisotropic", {"Color": (0.8, 0.8, 0.8), "Roughness": 0.0}),
    "rough": ("BsdfAnisotropic", {"Color": RED, "Roughness": 0.5}),
    "glass": ("BsdfGlass", {}),
    "transparent": ("BsdfTransparent", {"Color": (0.6, 0.8, 0.7)}),
    "emission": ("Emission", {"Color": RED}),
}


GGX = ("BsdfRefraction",)
"""Nodes whose distribution is set to GGX: Cycles has Beckmann there at first, EEVEE GGX whatever is set."""

_DARK = "EEVEE keeps reflectances in 6 bits: 2 % of so dark a ball"
_INSIDE = "the sun goes straight through glass to the inside, in Cycles bent, to another place"
_LOST = "Cycles loses up to 5 % of the light in glass so rough, ours none"
WHY: dict[str, str] = {
    "Principled, Transmission Weight": _INSIDE,
    "Principled, Transmission Weight, rough": f"{_INSIDE}; {_LOST}",
    "Mix, Glass and Diffuse": _INSIDE,
    "Glass, Roughness": _LOST,
    "Refraction, Roughness": "what masking takes from a single scattering is not lost",
    "Principled, Subsurface Scale": "a radius as large as the ball: EEVEE's picture knows the visible half alone",
    "Subsurface, Scale": "a radius as large as the ball: EEVEE's picture knows the visible half alone",
    "Principled, Thin Film on plastic": "its colours are those of 4 x 2 of the microfacets",
    "Principled, Specular IOR Level": _DARK,
    "Principled, Metallic": _DARK,
    "Principled Hair, Roughness": _DARK,
    "Glossy, Anisotropy": "at 0.9 its grooves are 100 times as wide as long, and steeper than 45 degrees",
    "Metallic, Anisotropy": "noise of grooves at 0.9",
    "Sheen, Roughness": "fuzz is as bright as Cycles', evenly around; Cycles' is brightest towards lamps",
}
"""Rows that are further off in silence, and why."""
