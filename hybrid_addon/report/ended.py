# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether light that is missing, because rays ended early, can be seen: one line that says where and what to do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..scene import Settings

OF_THE_PICTURE, OF_THE_OBJECTS = 0.005, 0.05
"""So much of the picture, or of what is ray traced, must be darker: single pixels deep in glass always are."""

VISIBLE = 1 / 255
"""And by so much light: the share that is lost times the mean radiance around, a step of an 8 bit picture."""

NAMED = 3
"""Objects that are named, those first where most light ends."""


def ended_warnings(ended: Mapping[str, Any], settings: Settings, names: Sequence[str], coverage: float) -> list[str]:
    """What to say about `Film.ended`. names: `Scene.names`. coverage: share of the picture that is traced."""
    share, lost = ended.get("share", 0.0), ended.get("lost", 0.0)
    if share < OF_THE_OBJECTS and share * coverage < OF_THE_PICTURE:
        return []
    if lost * ended["around"] < VISIBLE:
        return []
    dark = f"{share * coverage:.1%} of the picture is darker than it should be, by {lost:.0%} of its light"
    at: Mapping[int, float] = ended["objects"]
    cutoff = settings.cutoff
    if cutoff > ended["least"] and ended["cutoff"] > sum(at.values()):
        return [f"{dark}: lower the Min Light of {cutoff:g}"]
    first = sorted(at, key=lambda number: (-at[number], number))
    told = [names[number] for number in first if number < len(names)]
    told = list(dict.fromkeys(told))  # instances of one object have one name
    others = f" and {len(told) - NAMED} more" if len(told) > NAMED else ""
    where = f" in {', '.join(told[:NAMED])}{others}" if told else ""
    return [f"{dark}: rays{where} need more than {settings.max_depth} bounces: raise Max Bounces"]
