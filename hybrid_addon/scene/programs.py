# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface programs: functions over arrays of hits that say how a surface answers light. Conventions: see the package.

A program is called with all hits of one object in a wave at once, never with one. It may be called in several threads
and processes at the same time, so it keeps nothing between calls; the same hits must give the same answer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .numbers import Bools, Float32, Float64

PATIENCE = 10.0
"""Seconds that one call of a program may take: a wave of a hundred thousand hits takes numpy some hundredths of one."""


@dataclass(frozen=True, eq=False)
class SurfaceHits:
    """n hits on one object.

    point    : (3, n) float64, world space, metres.
    normal   : (3, n) float32 unit shading normals, of the mesh, on the side that the ray comes from.
    geometric_normal : (3, n) float32 unit normals of the faces, on the same side.
    wo       : (3, n) float32 unit directions back along the rays.
    mirror   : (3, n) float32 unit directions of a mirror's reflection.
    distance : (n,) float64, metres from where the ray, or its last part, began.
    entering : (n,) bool, the ray meets the outer side.
    depth    : (n,) int16, reflections and refractions before; 0 of camera rays. None: of shadow rays.
    object_name   : the object that is hit.
    object_matrix : (4, 4) float64, its world matrix.
    values   : its custom properties: numbers, tuples of numbers, texts; of a pointer to an object, the world matrix of
               that, (4, 4) float64.
    """

    point: Float64
    normal: Float32
    geometric_normal: Float32
    wo: Float32
    mirror: Float32
    distance: Float64
    entering: Bools
    depth: Any
    object_name: str
    object_matrix: Float64
    values: Mapping[str, Any]

    def __len__(self) -> int:
        return len(self.distance)

    @property
    def cosine(self) -> Float32:
        """(n,) float32, of the angle between the shading normal and the ray; 1 where it is met head on."""
        return np.asarray((self.wo * self.normal).sum(axis=0), np.float32)

    def refracted(self, ior: float) -> tuple[Float32, Bools]:
        """Unit directions (3, n) of rays that a surface with air outside and this IOR inside bends (Snell's law), the
        mirror's where all is reflected within; and where that is, (n,)."""
        eta = np.where(self.entering, 1.0 / ior, ior)
        cosine = np.clip(self.cosine, 0.0, 1.0)
        left = 1.0 - eta * eta * (1.0 - cosine * cosine)
        total = left < 0.0
        bent = self.normal * (eta * cosine - np.sqrt(np.maximum(left, 0.0))) - self.wo * eta
        bent /= np.sqrt((bent * bent).sum(axis=0))
        return np.where(total, self.mirror, bent).astype(np.float32), np.asarray(total, np.bool_)


@dataclass(frozen=True, eq=False)
class SurfaceAnswer:
    """What n hits send back along their rays: all of this is added up. Each may be anything that broadcasts to (3, n).

    radiance     : what it sends by itself, linear RGB, W/(sr m²), >= 0.
    reflection   : share of the light that a ray into `reflected` brings, >= 0, per channel; where it is 0 no ray is
                   sent.
    reflected    : its direction, of any length but 0. None: the mirror's.
    transmission : the same of a second ray, which starts on the far side of the surface,
    transmitted  : its direction; None: straight on.
    origin       : where it starts instead, world space; not finite where it starts at the surface. None: everywhere.
    material     : share of what the object's own material answers. 0 costs nothing.

    Each of the two rays is one bounce.
    """

    radiance: Any = 0.0
    reflection: Any = 0.0
    reflected: Any = None
    transmission: Any = 0.0
    transmitted: Any = None
    origin: Any = None
    material: Any = 0.0


Answer = Callable[[SurfaceHits], SurfaceAnswer]
Passes = Callable[[SurfaceHits], Any]


@dataclass(frozen=True, eq=False)
class SurfaceProgram:
    """How hits on a surface are answered.

    name     : it is called by.
    hit      : for rays that are seen: hits in, answer out.
    shadow   : for shadow rays: hits in, the share of the light that passes out, (3, n) or what broadcasts to it, 0..1.
               None: as much as passes the object's material.
    values   : see `SurfaceHits`.
    patience : seconds that a call may take; longer, and the program is not called again.
    """

    name: str
    hit: Answer
    shadow: Passes | None = None
    values: Mapping[str, Any] = field(default_factory=dict)
    patience: float = PATIENCE
