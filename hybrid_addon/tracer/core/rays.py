# SPDX-License-Identifier: GPL-3.0-or-later
"""What a ray carries through the wave loop, and where new rays start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated
from ...scene import Float32, Float64
from .constants import MISS, ORIGIN_OFFSET
from .vectors import Array, Index, largest_component, take

NO_BRANCH, REFLECTION, REFRACTION, BACKGROUND = np.uint8(0), np.uint8(1), np.uint8(2), np.uint8(3)

WAY, DRAWN = 0, 1
"""Rows of `Rays.branch`."""

CAMERA_RAY, REFLECTED_RAY, TRANSMITTED_RAY, SHADOW_RAY = np.uint8(0), np.uint8(1), np.uint8(2), np.uint8(3)
"""Kinds of rays: by what bent them last. No wave has shadow rays; surfaces are told of them (see `RayState`)."""

DIFFUSE, TRANSMISSIONS, SHARP, TRAVELLED = range(4)
"""Rows of `Rays.history`."""

UNLIMITED = np.float32(np.inf)
"""A ray's t_max where nothing ends it."""


@dataclass(frozen=True, eq=False)
class Rays:
    """A wave of n rays.

    origin, direction : (3, n) float32; these float32 values *are* the ray. direction is unit length; those of camera
                        rays of a very wide lens are float64, and refine what the rounded ray hits.
    throughput        : (3, n) float32, what one unit of radiance found by this ray adds to its sample, per channel.
    sample            : (n,) intp, the sample it adds to, as a number within the tile.
    depth             : (n,) int16, bounces so far.
    straight          : (n,) int16, index-matched surfaces passed unbent so far; they do not count as bounces.
    t_max             : (n,) float32, camera clip end for camera rays, else inf.
    media             : (rows, n) int32, ranks of the solids that the ray is inside of (see `media`).
    path              : (rows, n) uint32, which reflections and refractions led here (see `path_hash`, `sampler`), or no
                        rows.
    kind              : (n,) uint8, what bent it last; CAMERA_RAY: it has at most passed straight through surfaces.
    unlit             : (n,) bool, the light of lamps that comes this way is in the highlight of a surface that it left.
    receiver          : (rows, n) int32, the primitive that bent it last, whose light it brings; or no rows, where all
                        lamps light everything.
    closure           : (rows, n) int32, the closure by which it was refracted into a solid, or MISS; or no rows, where
                        no surface refracts by more than one (see `closures_at`).
    branch            : (rows, n) uint8. Row WAY, how it left the first surface: NO_BRANCH for camera rays, REFLECTION
                        or REFRACTION (straight through included), BACKGROUND once a camera ray has gone straight on to
                        what is not ray traced. Row DRAWN, whether its way was drawn at random: 0 no, 1 by its last
                        bounce for the first time, 2 before. Or the first alone, or no rows: nobody asks.
    history           : (4, n) float32, what Light Path asks besides: diffuse bounces (1 of photons, which light what a
                        diffuse surface shows), transmissions, whether the last bounce was as sharp as a mirror's,
                        metres since then, straight crossings included; or no rows, where no surface asks.
    """

    origin: Float32
    direction: Array
    throughput: Float32
    sample: NDArray[np.intp]
    depth: NDArray[np.int16]
    straight: NDArray[np.int16]
    t_max: Float32
    media: NDArray[np.int32]
    kind: NDArray[np.uint8]
    unlit: NDArray[np.bool_]
    receiver: NDArray[np.int32]
    closure: NDArray[np.int32]
    path: NDArray[np.uint32]
    branch: NDArray[np.uint8]
    history: Float32

    @property
    def camera(self) -> NDArray[np.bool_]:
        """(n,) bool, still a camera ray."""
        result: NDArray[np.bool_] = self.kind == CAMERA_RAY
        return result

    def __len__(self) -> int:
        result: int = self.origin.shape[1]
        return result

    def take(self, index: Index) -> Rays:
        """The rays `index`, in that order."""
        if isinstance(index, slice) and index == slice(None):
            return self
        return Rays(*(take(getattr(self, name), index) for name in FIELDS))


FIELDS = (
    "origin", "direction", "throughput", "sample", "depth", "straight", "t_max", "media", "kind", "unlit", "receiver",
    "closure", "path", "branch", "history",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class RayState:
    """How n rays came to where they are: what surfaces may ask of the ray that sees them.

    kind, depth, straight : (n,) as in `Rays`, or SHADOW_RAY.   history : (4, n) as there.
    """

    kind: NDArray[np.uint8]
    depth: NDArray[np.int16]
    straight: NDArray[np.int16]
    history: Float32

    def take(self, index: Index) -> RayState:
        """Those of the rays `index`."""
        return RayState(*(take(part, index) for part in (self.kind, self.depth, self.straight, self.history)))


def state_of(rays: Rays) -> RayState | None:
    """How rays came; None: no surface asks."""
    return RayState(rays.kind, rays.depth, rays.straight, rays.history) if len(rays.history) else None


def shadow_state(came: RayState | None, index: Index, n: int, crossed: int, travelled: Float64) -> RayState:
    """That of n shadow rays which have crossed so many surfaces, and are `travelled` (n,) metres from their origins.

    came : of the rays that hit the origins, of which these are `index`; None: camera rays.
    """
    if came is None:
        depth, straight, history = np.zeros(n, np.int16), np.zeros(n, np.int16), np.zeros((4, n), np.float32)
    else:
        depth, straight = take(came.depth, index), take(came.straight, index)
        history = take(came.history, index).copy()
    history[SHARP], history[TRAVELLED] = 0, travelled
    return RayState(np.full(n, SHADOW_RAY), depth, straight + np.int16(crossed), history)


def concatenate(waves: list[Rays]) -> Rays:
    """One wave out of several, in order: a sample's rays keep their order whatever else is in the wave."""
    waves = [w for w in waves if len(w)] or waves[:1]
    if len(waves) == 1:
        return waves[0]
    return Rays(*(np.concatenate([getattr(w, name) for w in waves], axis=-1) for name in FIELDS))


def camera_rays(
    origin: Float32,
    direction: Array,
    t_max: Float32,
    sample: NDArray[np.intp],
    media: NDArray[np.int32] | None = None,
    signed: bool = False,
    branched: int = 0,
    linked: bool = False,
    mixed: bool = False,
    asked: bool = False,
) -> Rays:
    """The first wave. signed, linked, mixed, asked: paths, receivers, closures and histories are asked for; branched:
    so many rows of branches."""
    n = origin.shape[1]
    path = np.zeros((int(signed), n), np.uint32)
    media = np.zeros((0, n), np.int32) if media is None else media
    none = np.zeros(n, np.int16)
    branch = np.full((branched, n), NO_BRANCH)
    kind, receiver = np.full(n, CAMERA_RAY), np.full((int(linked), n), MISS)
    return Rays(
        origin, direction, np.ones((3, n), np.float32), sample, none, none, t_max, media, kind, np.zeros(n, bool),
        receiver, np.full((int(mixed), n), MISS), path, branch, np.zeros((4 * int(asked), n), np.float32),
    )  # fmt: skip


def origin_offset(point: Float32, extent: Float32) -> Float32:
    """How far (n,) from its surface a new ray must start.

    extent : (n,) largest |coordinate| of the primitive, the scale of Embree's error in its plane.
    """
    return np.float32(ORIGIN_OFFSET) * np.maximum(extent, largest_component(point))


@accelerated
def offset_origin(point: Float64, normal: Array, offset: Float32) -> Float32:
    """Move points (3, n) by `offset` (n,) along unit normals (3, n) and round to float32 (see ORIGIN_OFFSET)."""
    moved = normal * offset
    moved += point
    return moved.astype(np.float32)


@accelerated
def traceable(origin: Float32, direction: Float32) -> NDArray[np.bool_]:
    """Which rays may be sent: finite origins, finite directions that are not 0.

    The sum of squares is finite and positive exactly for usable directions; 0 * origin is 0 exactly for finite ones.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        probe = (origin[0] + origin[1] + origin[2]) * 0
        probe += direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]
        result: NDArray[np.bool_] = (probe > 0) & (probe < UNLIMITED)
        return result
