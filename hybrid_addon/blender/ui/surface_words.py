# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface in a few words, as the tracer takes it from the material: "Glass, IOR 2.00" and "Roughness 0.10"."""

from __future__ import annotations

from collections.abc import Iterator
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
    reflects, passes = _share(surface.reflectivity), 1.0 - _share(surface.opacity)
    kind = iface("Solid")
    if reflects is None or passes is None:
        kind = iface("Textured")
    elif reflects >= 0.5:
        kind = iface("Metal")
    elif passes >= RAYS_MATTER:
        kind = iface("Glass") if surface.ior != 1.0 else iface("Transparent")
    numbers = [iface("Reflectivity") + f" {reflects:.2f}"] if reflects and reflects < 1.0 else []
    if passes >= RAYS_MATTER:
        numbers += [iface("Opacity") + f" {1.0 - passes:.2f}"] if passes < 1.0 else []
        numbers += [_named("IOR", surface.ior)]
    yield ", ".join([kind, *numbers, _named("Roughness", surface.roughness)])
    if reflects < RAYS_MATTER and passes < RAYS_MATTER and surface.coat == 0.0:
        yield iface("Neither mirror nor glass: rays change little. Choose a preset, or change the material")


def _named(name: str, value: Any) -> str:
    return iface(name) + " " + (iface("textured") if isinstance(value, Expression) else f"{float(value):.2f}")


def _share(value: Any) -> float:
    """A number; of what varies over the surface, one that stands between."""
    return 0.5 if isinstance(value, Expression) else float(value)
