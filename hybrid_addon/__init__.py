# SPDX-License-Identifier: GPL-3.0-or-later
"""Per-object hybrid rendering for Blender: EEVEE draws the world, a ray tracer draws the objects you tick.

    scene/        plain data: what is rendered, and every convention (units, axes, colour, row order)
    tracer/       the Whitted ray tracer over Embree, pure numpy
    compositor.py how the two halves become one picture, pure numpy
    programs/     functions that answer for surfaces: what is registered, and the three that ship
    report/       error against run time, pure numpy
    blender/      the only room that knows Blender

The public names below are loaded on first use, so that importing a pure module never needs Blender.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_PUBLIC = (
    "enable", "disable", "mark", "unmark", "surface", "advise", "render", "retrace", "plan", "explain", "HybridResult",
    "HybridError", "SurfaceAnswer", "SurfaceHits",
)  # fmt: skip


def register() -> None:
    """Add the add-on's classes, properties, handlers and command to Blender."""
    try:
        import_module("numpy")
    except ImportError as error:  # Blender's numpy needs macOS 13.3 or newer
        raise ImportError(f"Hybrid needs numpy, which does not load in this Blender on this system: {error}") from error
    import_module(".blender.registration", __package__).register()


def unregister() -> None:
    """Take them all away again, in reverse order."""
    import_module(".blender.registration", __package__).unregister()


def __getattr__(name: str) -> Any:
    if name == "glTF2ImportUserExtension":  # what Blender's glTF importer asks add-ons for
        return import_module(".blender.gltf", __package__).ImportExtension
    if name == "programs":
        return import_module(".programs", __package__)
    if name in _PUBLIC:
        return getattr(import_module(".blender.api", __package__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_PUBLIC])
