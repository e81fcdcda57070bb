# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons as they leave a light: which random numbers choose their directions and where they start."""

from __future__ import annotations

import numpy as np

from ..core.sampler import UInt32, hash32, permute, r2
from ..emitters.light import CompiledLight, Photons
from .caster_bounds import BoundingBalls


def emit(light: CompiledLight, group: BoundingBalls, number: UInt32, key: UInt32) -> Photons:
    """Photons `number` (n,) of a light towards a group's ball; key (1,) makes their random numbers.

    Each stands for all light of its light that goes to the ball. A sun lights no unbounded group.
    """
    aim = r2(key, number)
    other = hash32(key ^ np.uint32(0x85EBCA6B))
    spread = r2(other, permute(number, hash32(other)))
    return light.emit_photons(group.center, group.radius, aim, spread)
