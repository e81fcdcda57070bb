# SPDX-License-Identifier: GPL-3.0-or-later
"""The fields of a surface as arrays: what is the same all over once, what an expression gives for each hit."""

from __future__ import annotations

from collections.abc import Mapping, Set
from typing import TypeVar

import numpy as np

from ...expressions import Evaluation
from ...scene import Expression, Float64, Surface
from ...scene.surfaces import MIN_IOR

T = TypeVar("T")
Fields = Mapping[str, Float64]
"""Name -> (1 or 3, n) float64, or (1 or 3, 1) of what is the same for all."""

VARIABLE = {
    "base_color": 3, "specular": 3, "roughness": 1, "emission": 3, "reflectivity": 1, "reflection_tint": 3,
    "opacity": 1, "transmission_tint": 3, "interface_tint": 3, "edge_tint": 3, "coat": 1, "coat_roughness": 1,
    "coat_tint": 3, "sheen": 1, "sheen_roughness": 1, "sheen_tint": 3, "film": 1, "film_ior": 1, "metal_ior": 3,
    "stretch": 1, "scatter": 1, "scatter_radius": 3,
}  # fmt: skip
"""What an expression may give, and how many numbers it is."""

SHARES = ("reflectivity", "opacity", "roughness", "coat_roughness", "sheen_roughness", "interface_tint", "scatter")
"""Of these, what lies between 0 and 1."""


CONSTANT = ("ambient", "diffuse", "coat_ior", "multiscatter", "coat_shows")
"""What no expression gives."""
TYPICAL_IOR = 1.45
"""Stands for an IOR that varies where one is wanted for all of a surface: of a solid, for what lies in it."""
LEAST = {"stretch": 1e-2}
"""What must not be 0: a stretch divides, and of Blender's none is further from 1 than this or 100."""


def constants(surface: Surface) -> dict[str, float]:
    """What is the same all over; a typical IOR where it varies."""
    found = {name: float(getattr(surface, name)) for name in CONSTANT}
    ior = TYPICAL_IOR if isinstance(surface.ior, Expression) else float(surface.ior)
    return {**found, **iors(surface, ior)}


def iors(surface: Surface, ior: T) -> dict[str, T | float]:
    """What the IOR of a surface does: a thin pane does not bend light, it only reflects by it."""
    return {"ior": 1.0, "pane_ior": ior} if surface.thin else {"ior": ior, "pane_ior": 1.0}


def known_fields(surface: Surface, without: Set[str] = frozenset()) -> Fields:
    """The fields that no expression gives, and 0 for those `without`."""
    values = {name: 0.0 if name in without else getattr(surface, name) for name in VARIABLE}
    known = {name: v for name, v in values.items() if not (v is None or isinstance(v, Expression))}
    fields = {name: np.array(v, np.float64).reshape(-1, 1)[: VARIABLE[name]] for name, v in known.items()}
    return {**fields, **{name: np.full((1, 1), value) for name, value in constants(surface).items()}}


def fields_of(surface: Surface, evaluate: Evaluation | None = None, known: Fields | None = None) -> Fields:
    """All fields of a surface, what expressions give within its limits.

    evaluate : works expressions out; None: the surface has none.   known : its `known_fields`, if they are at hand.
    """
    fields = dict(known_fields(surface) if known is None else known)
    for name, size in VARIABLE.items():
        value = None if name in fields else getattr(surface, name)
        if value is not None:
            assert evaluate is not None
            fields[name] = limited(name, evaluate(value))[:size]
    if isinstance(surface.ior, Expression):
        assert evaluate is not None
        ior = np.maximum(limited("ior", evaluate(surface.ior))[:1], MIN_IOR)
        fields.update({name: np.asarray(value).reshape(1, -1) for name, value in iors(surface, ior).items()})
    return fields


def limited(name: str, values: np.ndarray) -> Float64:
    """What an expression gave for a field, as numbers that the field may have."""
    found = values.astype(np.float64)
    if not np.isfinite(found).all():
        found = np.nan_to_num(found)
    found = np.maximum(found, LEAST.get(name, 0.0))
    return np.minimum(found, 1) if name in SHARES else found
