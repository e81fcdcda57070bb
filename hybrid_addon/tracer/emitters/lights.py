# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a scene: which file of this room answers for each, and their keys and links.

Every module here that is called `*_light` is loaded and registers its kind: a new one need not be named anywhere.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from ...scene import Float64, Light
from ..core.sampler import UInt32, hash32
from .light import KINDS, Bools, CompiledLight


def _load_kinds() -> None:
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        if module.name.endswith("_light"):
            import_module(f".{module.name}", __package__)


_load_kinds()


def kind_of(light: Light) -> type[CompiledLight]:
    """The class that answers for a light of the scene; ValueError where none is registered."""
    kind = KINDS.get(type(light))
    if kind is None:
        raise ValueError(f"light {light.name!r}: no light is registered for {type(light).__name__}")
    return kind


def compile_lights(lights: Sequence[Light], center: Float64, objects: NDArray[np.intp]) -> list[CompiledLight]:
    """Place all lights relative to the scene's centre (3,). objects: (np,) number of each primitive's object."""

    def members(numbers: frozenset[int] | None) -> Bools | None:
        return None if numbers is None else np.isin(objects, sorted(numbers))

    return [
        kind_of(light)(light, center, key, members(light.receivers), members(light.blockers))
        for light, key in zip(lights, _keys(lights), strict=True)
    ]


def _keys(lights: Sequence[Light]) -> UInt32:
    """One for each light, by its name: what other lights there are does not move its samples."""
    names = [light.name for light in lights]
    twins = [names[:number].count(name) for number, name in enumerate(names)]
    numbers = [crc32(f"{name}\0{twin}".encode()) for name, twin in zip(names, twins, strict=True)]
    return hash32(np.array(numbers, np.uint32))
