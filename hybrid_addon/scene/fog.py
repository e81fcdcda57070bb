# SPDX-License-Identifier: GPL-3.0-or-later
"""Fog: participating media that fill the scene, or closed meshes, and bend no light. Conventions: see the package."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from .geometry import TriangleMesh
from .media import Medium
from .numbers import Float32, Float64


@dataclass(frozen=True, eq=False)
class VoxelGrid:
    """Numbers on a regular grid, linear between the middles of its voxels, and beyond these as at the nearest one.

    values     : (nx, ny, nz, width) float32, width 1, 3 or 4.
    from_local : (3, 4) float64 that takes the body's local positions to 0..1 over the whole grid.
    """

    values: Float32
    from_local: Float64


@dataclass(frozen=True, eq=False)
class FogBody:
    """A closed mesh, placed by matrix_world (4, 4) float64, that is full of a medium and has no surface.

    grids        : what its medium reads by "volume:NAME", by these names.
    to_generated : (3, 4) float64, from local positions to generated coordinates.
    values       : what its medium reads of the object, as `Instance.values`.
    """

    name: str
    mesh: TriangleMesh
    matrix_world: Float64
    medium: Medium
    grids: Mapping[str, VoxelGrid] = field(default_factory=dict)
    to_generated: Float64 = field(default_factory=lambda: np.eye(3, 4))
    values: Mapping[str, tuple[float, ...]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Fog:
    """All fog of a scene. Where bodies overlap, or lie in the world's medium, their media add up.

    world   : fills everything; None: nothing does.
    reach   : metres; a ray goes through no more of the world's medium than this, and a camera ray through none that is
              deeper in the picture.
    start   : metres along the view axis; camera rays meet no fog before.
    sky     : it scatters the light of the world (EEVEE of Blender 5 does, that of 4.5 does not).
    shadows : light is dimmed by fog on its way from lamps into fog (EEVEE's *Volume Shadows*).
    steps   : into so many equal parts is cut what a ray crosses of media that vary; each is what it is in its middle.
    """

    world: Medium | None = None
    bodies: tuple[FogBody, ...] = ()
    reach: float = float("inf")
    start: float = 0.0
    sky: bool = True
    shadows: bool = False
    steps: int = 64

    @property
    def media(self) -> list[Medium]:
        """Of the bodies, then of the world."""
        return [*(body.medium for body in self.bodies), self.world or Medium()]
