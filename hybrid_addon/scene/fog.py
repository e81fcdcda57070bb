# SPDX-License-Identifier: GPL-3.0-or-later
"""Fog: participating media that fill the scene, or closed meshes, and bend no light. Conventions: see the package."""

from __future__ import annotations

from dataclasses import dataclass

from .geometry import TriangleMesh
from .media import Medium
from .numbers import Float64


@dataclass(frozen=True, eq=False)
class FogBody:
    """A closed mesh, placed by matrix_world (4, 4) float64, that is full of a medium and has no surface."""

    name: str
    mesh: TriangleMesh
    matrix_world: Float64
    medium: Medium


@dataclass(frozen=True, eq=False)
class Fog:
    """All fog of a scene. Where bodies overlap, or lie in the world's medium, their media add up.

    world   : fills everything; None: nothing does.
    reach   : metres; a ray goes through no more of the world's medium than this, and a camera ray through none that is
              deeper in the picture.
    start   : metres along the view axis; camera rays meet no fog before.
    sky     : it scatters the light of the world (EEVEE of Blender 5 does, that of 4.5 does not).
    shadows : light is dimmed by fog on its way from lamps into fog (EEVEE's *Volume Shadows*).
    """

    world: Medium | None = None
    bodies: tuple[FogBody, ...] = ()
    reach: float = float("inf")
    start: float = 0.0
    sky: bool = True
    shadows: bool = False

    @property
    def media(self) -> list[Medium]:
        """Of the bodies, then of the world."""
        return [*(body.medium for body in self.bodies), self.world or Medium()]
