# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface in a few words, as the tracer takes it from the material: "Glass, IOR 2.00" and "Roughness 0.10"."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from ...scene import Expression, Surface
from .translations import iface

RAYS_MATTER = 0.05
"""From this share of mirrored or passing light on a surface is called mirror or glass."""


def described(surface: Surface) -> Iterator[str]:
    """Lines for the panel: what it is and by which numbers; then whether rays change anything."""
    closures = surface.closures or ()
    if closures:
        yield iface("A mix of {} surfaces").format(len(closures))
        return
    if surface.fog is not None:
        yield iface("Volume")
        return
    reflectivity: Any = surface.reflectivity
    opacity: Any = surface.opacity
    varies = isinstance(reflectivity, Expression) or isinstance(opacity, Expression)
    mirrors, passes = _may(reflectivity, lambda r: r >= RAYS_MATTER), _may(opacity, lambda o: o <= 1.0 - RAYS_MATTER)
    kind = iface("Solid")
    if varies:
        kind = iface("Textured")
    elif reflectivity >= 0.5:
        kind = iface("Metal")
    elif passes:
        kind = iface("Glass") if surface.ior != 1.0 else iface("Transparent")
    numbers = [_named("Reflectivity", reflectivity)] if _may(reflectivity, lambda r: 0.0 < r < 1.0) else []
    if passes:
        numbers += [_named("Opacity", opacity)] if _may(opacity, lambda o: o > 0.0) else []
        numbers += [_named("IOR", surface.ior)]
    yield ", ".join([kind, *numbers, _named("Roughness", surface.roughness)])
    if not mirrors and not passes and surface.coat == 0.0:
        yield iface("Neither mirror nor glass: rays change little. Choose a preset, or change the material")


def _named(name: str, value: Any) -> str:
    return iface(name) + " " + (iface("textured") if isinstance(value, Expression) else f"{float(value):.2f}")


def _may(value: Any, holds: Callable[[float], bool]) -> bool:
    """Whether something holds for a number; of what varies over the surface it may, somewhere."""
    return isinstance(value, Expression) or holds(float(value))
