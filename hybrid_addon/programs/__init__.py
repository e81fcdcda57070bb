# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface programs by their names: what scripts register, and the three that ship.

Files hold names only: what a name stands for is what is registered here, in this Blender, and nothing else is run.
"""

from __future__ import annotations

from ..scene.programs import Answer, Passes, SurfaceAnswer, SurfaceHits, SurfaceProgram
from . import portal, toon_glass, x_ray

__all__ = ["SHIPPED", "SurfaceAnswer", "SurfaceHits", "SurfaceProgram", "find", "forget", "known", "names", "register"]

SHIPPED = {
    program.name: program
    for program in (
        SurfaceProgram("Toon Glass", toon_glass.hit, toon_glass.shadow),
        SurfaceProgram("Portal", portal.hit),
        SurfaceProgram("X-Ray", x_ray.hit, x_ray.shadow),
    )
}
_registered: dict[str, SurfaceProgram] = {}


def register(name: str, hit: Answer, shadow: Passes | None = None) -> SurfaceProgram:
    """Make a function known by a name, instead of the one that had it. Raises ValueError for what is not callable."""
    name = name.strip()
    if not name:
        raise ValueError("a surface program needs a name")
    for function in (hit,) if shadow is None else (hit, shadow):
        if not callable(function):
            raise ValueError(f"surface program '{name}': {function!r} is not a function")
    _registered[name] = SurfaceProgram(name, hit, shadow)
    return _registered[name]


def forget(name: str) -> None:
    """Take back what was registered by a name; one that ships has it again."""
    _registered.pop(name, None)


def find(name: str) -> SurfaceProgram | None:
    """The program of a name; None: there is none."""
    return _registered.get(name) or SHIPPED.get(name)


def known(name: str, shadow: Passes | None = None) -> str:
    """The name, which must be one of `names`. shadow: what somebody gives besides, who may not. Raises ValueError."""
    if find(name) is None:
        raise ValueError(f"no surface program '{name}': registered are {', '.join(names())}")
    if shadow is not None:
        raise ValueError(f"surface program '{name}' is registered already: give shadow with the function")
    return name


def names() -> list[str]:
    """All names, in order."""
    return sorted({*SHIPPED, *_registered})
