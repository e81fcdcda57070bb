"""What a scene does to all of its lights alike: EEVEE's *Light Strength > Direct*, and its *Shadows*."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ...scene import Light

LIGHT_OF = ("intensity", "irradiance", "radiance")  # fields, of which each kind of light has one


def scaled(light: Light, strength: float, shadows: bool) -> Light:
    """The light of another strength; it casts shadows only if the scene has any."""
    changes: dict[str, Any] = {} if shadows else {"cast_shadow": False}
    if strength != 1.0:
        name = next(name for name in LIGHT_OF if hasattr(light, name))
        changes[name] = tuple(channel * strength for channel in getattr(light, name))
    return replace(light, **changes) if changes else light
