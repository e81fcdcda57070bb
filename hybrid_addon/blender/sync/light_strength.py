# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene does to all of its lights alike: EEVEE's *Light Strength > Direct*, and its *Shadows*."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ...scene import Light


def scaled(light: Light, strength: float, shadows: bool) -> Light:
    """The light of another strength; it casts shadows only if the scene has any."""
    changes: dict[str, Any] = {} if shadows else {"cast_shadow": False}
    if strength != 1.0:
        color = getattr(light, light.color_field)
        changes[light.color_field] = tuple(channel * strength for channel in color)
    return replace(light, **changes) if changes else light
