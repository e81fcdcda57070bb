# SPDX-License-Identifier: GPL-3.0-or-later
"""Mix and Add: weighted sums of surfaces, as lists of closures.

Every sum is exact. What one closure can hold is put into one: two diffuse surfaces, two transparent or two glowing
ones, the same shader on two ways, and light that is added to a surface.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

from ... import expressions as ex
from ...scene import BLACK, Closure, Expression, Surface

Share = Any  # a float or an expression

DEFAULTS = {field.name: field.default for field in fields(Surface)}


def mixed(first: Surface, second: Surface, factor: Share) -> Surface:
    """`first` x (1 - factor) + `second` x factor."""

    def average(one: Any, other: Any) -> Any:
        return one if one is other else ex.as_color(ex.apply("mix", factor, one, other))

    for alike, name in ((is_matte, "base_color"), (is_clear, "transmission_tint"), (is_light, "emission")):
        if alike(first) and alike(second):
            both: Any = {name: average(getattr(first, name), getattr(second, name))}
            return replace(first, **both)
    return weighted((ex.rest(factor), first), (factor, second))


def added(first: Surface, second: Surface) -> Surface:
    """The sum of both."""
    for one, other in ((first, second), (second, first)):
        if is_light(one) and not other.closures:
            return replace(other, emission=ex.as_color(ex.plus(one.emission, other.emission)))
    for alike, name in ((is_matte, "base_color"), (is_clear, "transmission_tint")):
        if alike(first) and alike(second):
            both: Any = {name: ex.as_color(ex.plus(getattr(first, name), getattr(second, name)))}
            return replace(first, **both)
    return weighted((1.0, first), (1.0, second))


def weighted(*parts: tuple[Share, Surface]) -> Surface:
    """The sum of surfaces, each times its weight. A closure that comes in more than once is there once."""
    found: dict[int, Closure] = {}
    for weight, surface in parts:
        for closure in surface.closures or (Closure(1.0, surface),):
            total = ex.times(weight, closure.weight)
            if not may_be(total) or is_black(closure.surface):
                continue
            known = found.get(id(closure.surface))
            found[id(closure.surface)] = Closure(ex.plus(known.weight, total) if known else total, closure.surface)
    closures = tuple(found.values())
    if len(closures) == 1 and not isinstance(closures[0].weight, Expression) and closures[0].weight == 1.0:
        return closures[0].surface
    return Surface(closures=closures) if closures else Surface(base_color=BLACK)


def each(surface: Surface, change: Callable[[Surface], Surface]) -> Surface:
    """The surface with each of its closures changed. Light that Add Shader puts on top of a sum stays as it is."""
    if not surface.closures:
        return change(surface)
    return replace(
        surface,
        closures=tuple(
            closure
            if is_light(closure.surface) and closure.weight == 1.0
            else Closure(closure.weight, change(closure.surface))
            for closure in surface.closures
        ),
    )


def averaged(surface: Surface) -> Surface:
    """One closure for a sum, with the colours that its closures have for what they mirror, show and let through.

    For those who give it shares of their own of that (*Custom*), so that its own are not asked for any more.
    """
    if not surface.closures:
        return surface
    parts = [(c.weight, shares(c.surface), c.surface) for c in surface.closures]

    def mean(name: str, kind: int) -> Any:
        found = [(ex.times(w, share[kind]), getattr(one, name)) for w, share, one in parts if may_be(share[kind])]
        if len(found) < 2:
            return found[0][1] if found else getattr(parts[0][2], name)
        total, light = 0.0, 0.0
        for weight, value in found:
            total, light = ex.plus(total, weight), ex.plus(light, ex.apply("multiply", value, weight))
        return ex.apply("ratio", light, total, found[0][1])

    emission: Any = 0.0
    for weight, _, one in parts:
        emission = ex.plus(emission, ex.apply("multiply", one.emission, weight))
    return replace(
        surface,
        closures=(),
        reflection_tint=mean("reflection_tint", 0),
        base_color=mean("base_color", 1),
        specular=mean("specular", 1),
        roughness=mean("roughness", 1),
        transmission_tint=mean("transmission_tint", 2),
        emission=ex.as_color(emission),
        normal=next((one.normal for _, _, one in parts if one.normal is not None), None),
    )


def shares(surface: Surface) -> tuple[Share, Share, Share]:
    """(mirrored, local, transmitted) of a closure, their sum 1."""
    rest = ex.rest(surface.reflectivity)
    return surface.reflectivity, ex.times(rest, surface.opacity), ex.times(rest, ex.rest(surface.opacity))


def singles(surface: Surface) -> list[Surface]:
    """Its closures, or itself."""
    return [closure.surface for closure in surface.closures] or [surface]


def may_be(share: Share) -> bool:
    """Whether it is more than 0 anywhere."""
    return isinstance(share, Expression) or share > 0.0


def is_matte(surface: Surface) -> bool:
    """Whether it is a Diffuse BSDF without a normal map."""
    return _is_plain(surface, "base_color")


def is_clear(surface: Surface) -> bool:
    """Whether it is a Transparent BSDF."""
    return surface.opacity == 0.0 and surface.ior == 1.0 and _is_plain(surface, "opacity", "ior", "transmission_tint")


def is_light(surface: Surface) -> bool:
    """Whether it only glows."""
    return surface.base_color == BLACK and _is_plain(surface, "base_color", "emission")


def is_black(surface: Surface) -> bool:
    """Whether nothing comes from it."""
    return is_light(surface) and surface.emission == BLACK


def _is_plain(surface: Surface, *but: str) -> bool:
    """Whether all of its fields but some have their defaults."""
    values = {name: getattr(surface, name) for name in DEFAULTS if name not in (*but, "name")}
    return all(value is DEFAULTS[name] or value == DEFAULTS[name] for name, value in values.items())
