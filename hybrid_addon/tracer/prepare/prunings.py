"""Every pruning: what it leaves out, and whether the picture can tell.

Exact ones change no bit of the picture; `Settings.keep` switches them off by name, so that tests can show it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Pruning:
    """Something that can be left out.

    name : for `Settings.keep`.   leaves_out, when : as text.
    kind : "exact" always changes no bit; "exact if": no bit, under the condition that `when` states and the plan
           proves; "bounded": the error is at most the residual; "heuristic": an audit estimates it.
    unit : what is counted of what it saved, "" where nothing is; of what never comes up, surfaces that would need it.
    """

    name: str
    kind: Literal["exact", "exact if", "bounded", "heuristic"]
    leaves_out: str
    when: str
    unit: str = ""


PRUNINGS = (
    Pruning("empty-mask", "exact", "tracing, and making the scene ready for it", "the mask is 0 everywhere", "pixels"),
    Pruning(
        "unmasked", "exact if", "pixels", "the mask is 0 there: it covers all that the pixel filter spreads", "pixels"
    ),
    Pruning(
        "unchanged",
        "exact if",
        "making ready, and search trees",
        "the last frame had the same, byte for byte",
        "triangles",
    ),
    Pruning(
        "reflection",
        "exact if",
        "reflected rays",
        "all that rays reach mirrors nothing, and is opaque or IOR 1",
        "surfaces",
    ),
    Pruning("refraction", "exact if", "refracted rays", "every surface that rays reach is opaque", "surfaces"),
    Pruning(
        "weightless", "exact", "single reflected and refracted rays", "they carry nothing: R or T is 0 there", "rays"
    ),
    Pruning("roughness", "exact if", "random microfacets", "all that rays reach is smooth", "surfaces"),
    Pruning("depth-of-field", "exact if", "random points on the lens", "the camera is a pinhole"),
    Pruning("secondary", "exact if", "the search tree for reflected and refracted rays", "there are no such rays"),
    Pruning(
        "unmet",
        "exact if",
        "objects: making ready, and search trees",
        "no ray can meet them; all rays end at matte surfaces or at flat mirrors",
        "objects",
    ),
    Pruning("emission", "exact if", "emission", "no surface that rays reach emits", "surfaces"),
    Pruning(
        "ambient",
        "exact if",
        "ambient light",
        "the world is black, or no surface that rays reach answers to it",
        "surfaces",
    ),
    Pruning(
        "occlusion",
        "exact if",
        "ambient occlusion",
        "no light of the world is left, or nothing can hide it",
        "surfaces",
    ),
    Pruning("diffuse", "exact if", "diffuse light", "no surface that rays reach answers to it", "surfaces"),
    Pruning("highlights", "exact if", "highlights", "no surface that rays reach has one", "surfaces"),
    Pruning("black-lights", "exact", "lights", "they are black", "lights"),
    Pruning(
        "far-lights",
        "exact if",
        "lights",
        "all that could answer to them is out of their range or behind them",
        "lights",
    ),
    Pruning(
        "lamps",
        "exact",
        "lamps that rays could meet",
        "they have no size, or nothing that mirrors or refracts is in their range",
        "lights",
    ),
    Pruning("light-linking", "exact if", "who receives which light, and who blocks it", "no light is linked"),
    Pruning("shadows", "exact if", "all shadow rays", "no light casts shadows, or nothing can cast one", "lights"),
    Pruning(
        "unlit", "exact", "single shadow rays", "no light would arrive: it is behind, out of range or cone", "rays"
    ),
    Pruning("soft-shadows", "exact if", "random points on lights", "no light that casts shadows has a size", "lights"),
    Pruning("any-hit", "exact if", "the nearest hit along shadow rays", "nothing is hit, or all is opaque", "rays"),
    Pruning("normals", "exact if", "shading normals", "every triangle is flat", "triangles"),
    Pruning("textures", "exact if", "texture look-ups", "no value varies over a surface", "surfaces"),
    Pruning("environment", "exact if", "environment look-ups", "the world is uniform"),
    Pruning("world", "exact if", "light of rays that leave the scene", "the world is black"),
    Pruning("media", "exact if", "the stack of media around each ray", "no closed body transmits"),
    Pruning("absorption", "exact if", "absorption on the way of rays", "no closed body absorbs"),
    Pruning("raster-shadows", "exact if", "shadows on the raster", "no ray traced object can cast one"),
    Pruning(
        "screen_space", "exact if", "look-ups in the raster", "no raster, or rays reach nothing matte that it shows"
    ),
    Pruning("cutoff", "bounded", "rays that bring little", "Cutoff is above 0: no sample loses more than that", "rays"),
    Pruning(
        "faint-light", "bounded", "light that hardly counts", "Cutoff is above 0: light is a small part of it", "rays"
    ),
    Pruning(
        "adaptive",
        "heuristic",
        "samples",
        "Adaptive is above 0: the pixel's first samples and neighbours agree",
        "samples",
    ),
)
"""All prunings, in the order in which a frame meets them. docs/reference/errors-and-plan.md has them."""

BY_NAME = {pruning.name: pruning for pruning in PRUNINGS}
