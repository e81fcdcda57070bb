# SPDX-License-Identifier: GPL-3.0-or-later
"""Fog along rays: which media lie on the way, what they leave of light, and what they add in closed form.

A ray is cut at the surfaces of the bodies that it crosses, and into steps where media vary (`varying`). Between two
cuts the media are constant, so the equation of radiative transfer has closed forms there (Chandrasekhar 1960; pbrt 4,
11.2): transmittance exp(-sigma_t l), and of a source S per metre S (1 - exp(-sigma_t l)) / sigma_t. Whether a ray
starts within a body its crossings tell: of a closed one it leaves once more than it enters. So nobody tracks fog along
a path, and fog displaces no glass.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...procedural import elementary
from ...scene import Camera, Float32, Float64, Fog, FogBody, Instance, Medium, Scene, Surface, TriangleMesh
from ..core.constants import EMBREE_LIMIT, FOG_FLATNESS, MAX_FOG_CROSSINGS
from ..core.rays import offset_origin, origin_offset, traceable
from ..core.stats import Stats
from ..core.vectors import Array, cross, dot, flatnonzero
from ..geometry.aggregate import PrimitiveSet
from ..geometry.flatten import flatten
from ..geometry.parts import closed_parts
from .varying import EMISSION, EXTINCTION, SCATTERING, TURNED, VaryingMedia, numbers_of

Numbers = NDArray[np.intp]
Crossing = tuple[Float64, Numbers, Float64]
"""Of n rays: how far along (n,), inf: not at all; of which body; 1: out of it, -1: into it, 0: not at all."""


@dataclass(frozen=True, eq=False)
class FogPath:
    """The fog on the way of n rays, in k stretches one after the other.

    start, length : (k, n) float64, metres; a stretch may have no length.
    medium        : (ROWS, k, n) float64, what fills it.
    """

    start: Float64
    length: Float64
    medium: Float64

    def transmittance(self) -> Float64:
        """(3, n), what is left of light at the ray's end."""
        return elementary.exp(-(self.medium[EXTINCTION] * self.length).sum(axis=1))

    @cached_property
    def reaching(self) -> Float64:
        """(3, k, n): what reaches the ray's start of light that comes from the start of each stretch."""
        depth = self.medium[EXTINCTION] * self.length
        return elementary.exp(-(np.cumsum(depth, axis=1) - depth))

    @cached_property
    def within(self) -> Float64:
        """(3, k, n) metres: what each stretch adds, as seen from its start, of a source of 1 per metre."""
        sigma = self.medium[EXTINCTION]
        depth = sigma * self.length
        with np.errstate(divide="ignore", invalid="ignore"):
            thick = -elementary.expm1(-depth) / sigma
        return np.where(sigma > 0, thick, self.length)

    def glow(self, ambient: Array) -> Float64:
        """(3, n) radiance of what glows by itself, and of what scatters a light that is the same everywhere.

        ambient : (3, n) or (3, 1), the mean of that light over all directions, weighted by the phase function.
        """
        source = self.medium[EMISSION] + self.medium[SCATTERING] * ambient[:, None]
        return np.asarray((self.reaching * self.within * source).sum(axis=1))

    def anisotropy(self) -> Float64:
        """(n,), the mean of what scatters on the way, by how much of it is seen."""
        seen = (self.reaching * self.within).mean(axis=0)
        scattering = (seen * self.medium[SCATTERING].mean(axis=0)).sum(axis=0)
        return np.asarray((seen * self.medium[TURNED]).sum(axis=0) / np.where(scattering > 0, scattering, 1.0))

    def at(self, distance: Float64) -> tuple[Float64, Float64, Float64]:
        """At distances (n,): what reaches the start of light from there (3, n), scattering (3, n), anisotropy (n,)."""
        gone = np.clip(distance - self.start, 0.0, self.length)
        left = elementary.exp(-(self.medium[EXTINCTION] * gone).sum(axis=1))
        here = (distance >= self.start) & (distance < self.start + self.length)
        scattering = (self.medium[SCATTERING] * here).sum(axis=1)
        mean = scattering.mean(axis=0)
        turned = (self.medium[TURNED] * here).sum(axis=0) / np.where(mean > 0, mean, 1.0)
        return left, scattering, turned

    @cached_property
    def _weights(self) -> Float64:
        """(3, k, n), what each stretch scatters, as seen from the ray's start, of light that is the same everywhere."""
        return np.asarray(self.reaching * self.within * self.medium[SCATTERING])

    @cached_property
    def _likely(self) -> Float64:
        """(3, n), how likely `drawn` goes by each colour: alike by those that anything scatters."""
        seen = self._weights.sum(axis=1) > 0
        return np.asarray(seen / np.maximum(seen.sum(axis=0), 1))

    @property
    def scatters(self) -> NDArray[np.bool_]:
        """(k, n), whether light that a stretch scatters gets to the ray's start."""
        return np.asarray((self._weights > 0).any(axis=0))

    def drawn(self, chance: Float64, lot: Float64) -> Float64:
        """Distances (n,), with `density`: where most of the light comes from.

        chance, lot : random numbers (n,) in 0 .. 1; the second one chooses the colour to go by.
        """
        n = np.arange(len(chance))
        color = np.minimum((np.cumsum(self._likely, axis=0) <= lot).sum(axis=0), 2)
        # A stretch of that colour, then a place in it.
        weight = self._weights[color, :, n].T
        upto = np.cumsum(weight, axis=0)
        wanted = chance * upto[-1]
        number = np.minimum((upto < wanted).sum(axis=0), len(upto) - 1)
        own = weight[number, n]
        share = np.clip((wanted - upto[number, n] + own) / np.where(own > 0, own, 1.0), 0.0, 1.0)
        length, sigma = self.length[number, n], self.medium[color, number, n]
        with np.errstate(divide="ignore", invalid="ignore"):
            inside = -elementary.log1p(share * elementary.expm1(-sigma * length)) / sigma
        return np.asarray(self.start[number, n] + np.clip(np.where(sigma > 0, inside, share * length), 0.0, length))

    def density(self, distance: Float64) -> Float64:
        """(n,) 1/m, the probability density of `drawn` at distances (n,)."""
        weight, sigma = self._weights, self.medium[EXTINCTION]
        here = (distance >= self.start) & (distance < self.start + self.length)
        total = weight.sum(axis=1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            own = sigma * elementary.exp(-sigma * (distance - self.start)) / -elementary.expm1(-sigma * self.length)
            own = np.where(sigma > 0, own, 1.0 / self.length)
            share = np.where(here & (weight > 0), weight / total * own, 0.0)
        return np.asarray((share.sum(axis=1) * self._likely).sum(axis=0))

    def take(self, index: NDArray[np.intp]) -> FogPath:
        """Those of the rays `index`."""
        return FogPath(self.start[:, index], self.length[:, index], self.medium[:, :, index])


class CompiledFog:
    """The fog of a scene, ready to be asked.

    glows    : some of it sends light into rays.   scatters : that of lamps, too.
    start, reach, sky, shadows : of `scene.Fog`.
    left_out : names of bodies that hold none.
    radius   : of a ball around the scene's centre that holds all of it.
    """

    def __init__(self, fog: Fog, camera: Camera, center: Float64) -> None:
        """center : (3,), what origins of rays are relative to."""
        sound, self.left_out = sorted_out(fog)
        self.sky, self.start = fog.sky, fog.start
        self.shadows, self.reach = fog.shadows, min(fog.reach, EMBREE_LIMIT)
        media = [*(body.medium for body in sound), fog.world or Medium()]
        holders = [(medium, body) for medium, body in zip(media, [*sound, None], strict=True)]
        varying = [i for i, medium in enumerate(media) if medium.varies]
        self._varying = VaryingMedia([holders[i] for i in varying], center, fog.steps)
        present = [[float(i == j) for j in range(len(media))] for i in varying]
        numbers = np.array([numbers_of(medium) for medium in media]).T
        self._numbers = np.concatenate([numbers, np.array(present)]) if varying else numbers
        self._everywhere = fog.world is not None and not fog.world.is_nothing
        self.scatters = any(medium.scatters for medium in media)
        self.glows = any(medium.glows for medium in media)
        reach = [np.abs(corner - center).max() * np.sqrt(3) for body in sound for corner in _bounds(body)]
        self.radius = np.inf if self._everywhere else float(max(reach, default=0.0))
        self._layers = [_Layer(sound, chosen, camera, center) for chosen in _apart(sound)]

    @property
    def stretches(self) -> int:
        """The most that a ray is likely to be cut into: in and out of each body, where the world's fog ends, and into
        steps."""
        crossed = sum(min(2 * len(layer), MAX_FOG_CROSSINGS) for layer in self._layers)
        return (1 + crossed) * (1 + self._everywhere) + (self._varying.steps if len(self._varying) else 0)

    @property
    def is_nothing(self) -> bool:
        """There is no fog anywhere."""
        return not self._layers and not self._everywhere

    def along(self, origin: Float32, direction: Array, distance: Float64, stats: Stats) -> FogPath:
        """The fog on rays (3, n) up to distances (n,), which may be infinite."""
        n = origin.shape[1]
        end = np.minimum(distance, EMBREE_LIMIT)
        rows = len(self._numbers)
        world = np.broadcast_to(self._numbers[:, -1:], (rows, n))
        found = [crossing for layer in self._layers for crossing in layer.crossings(origin, direction, stats)]
        crossings = _in_order(found, n)
        # It starts in what it leaves more often than it enters.
        medium = world + sum((self._numbers[:, body] * sign for _, body, sign in crossings), start=np.zeros((rows, n)))
        start, begins, media = [np.zeros(n)], np.zeros(n), [medium]
        for t, body, sign in crossings:
            begins = np.maximum(np.minimum(t, end), begins)
            medium = medium - self._numbers[:, body] * sign
            start.append(begins)
            media.append(medium)
        starts, filled = np.array(start), np.stack(media, axis=1)
        length = np.diff(starts, axis=0, append=end[None])
        np.maximum(filled[:TURNED], 0.0, out=filled[:TURNED])  # a sum of rounded numbers
        length = np.maximum(length, 0.0)
        if self._everywhere and self.reach < EMBREE_LIMIT:
            starts, length, filled = _ended(starts, length, filled, self._numbers[:, -1], self.reach)
        if len(self._varying):
            starts, length, filled = self._varying.marched(starts, length, filled, origin, direction)
        return FogPath(starts, length, filled)


class _Layer:
    """Bodies that are apart from one another: where surfaces coincide, one search would find only one of them."""

    def __init__(self, bodies: list[FogBody], chosen: Numbers, camera: Camera, center: Float64) -> None:
        """chosen : (b,) which of the bodies are in it."""
        self._bodies = chosen
        members = [bodies[i] for i in chosen]
        self._outward = np.array([np.sign(_volume(body.mesh)) for body in members])
        instances = tuple(Instance(body.name, i, body.matrix_world, (0,)) for i, body in enumerate(members))
        meshes = tuple(body.mesh for body in members)
        own = Scene(camera, meshes=meshes, instances=instances, surfaces=(Surface(),))
        geometry = flatten(own, [{}], use_normals=False)
        self._shift = (center - geometry.center)[:, None]
        self._surfaces = PrimitiveSet(geometry, np.ones(len(geometry.surface), bool))

    def __len__(self) -> int:
        return len(self._bodies)

    def crossings(self, origin: Float32, direction: Array, stats: Stats) -> list[Crossing]:
        """Those of rays (3, n), of each the nearest first."""
        surfaces, n = self._surfaces, origin.shape[1]
        start = origin.astype(np.float64) + self._shift
        at = start.astype(np.float32)
        d: Float32 = direction.astype(np.float32)
        active = flatnonzero(traceable(at, d))
        at, d = at[:, active], d[:, active]
        found = []
        for _ in range(MAX_FOG_CROSSINGS):
            hits = surfaces.nearest(at, d, stats)
            chosen = flatnonzero(hits.prim >= 0)
            if len(chosen) == 0:
                break
            hits, active, at, d = hits.take(chosen), active[chosen], at[:, chosen], d[:, chosen]
            point = at + d * hits.t
            t, body, sign = np.full(n, np.inf), np.zeros(n, np.intp), np.zeros(n)
            member = surfaces.geometry.object.take(hits.prim)
            t[active] = dot(point - start[:, active], d.astype(np.float64))
            body[active] = self._bodies[member]
            sign[active] = np.sign(hits.toward) * self._outward[member]
            found.append((t, body, sign))
            onward = hits.normal * np.sign(hits.toward).astype(np.float32)
            extent = surfaces.geometry.extent.take(hits.prim)
            at = offset_origin(point, onward, origin_offset(point.astype(np.float32), extent))
        return found


def _in_order(crossings: list[Crossing], n: int) -> list[Crossing]:
    """The crossings of n rays, of each the nearest first; no more than the ray with the most of them has."""
    if len(crossings) < 2:
        return crossings
    t, body, sign = (np.array(values) for values in zip(*crossings, strict=True))
    order = np.argsort(t, axis=0, kind="stable")[: int(np.isfinite(t).sum(axis=0).max(initial=0))]
    return list(zip(*(np.take_along_axis(values, order, 0) for values in (t, body, sign)), strict=True))


def _apart(bodies: list[FogBody]) -> list[Numbers]:
    """The numbers of bodies, in groups whose bounds do not meet."""
    groups: list[tuple[list[int], Float64, Float64]] = []
    for number, body in enumerate(bodies):
        low, high = _bounds(body)
        gap = FOG_FLATNESS * np.maximum(np.abs(low), np.abs(high)).max()
        low, high = low - gap, high + gap
        for place, (members, lows, highs) in enumerate(groups):
            if not ((lows <= high) & (highs >= low)).all(axis=1).any():
                groups[place] = [*members, number], np.vstack([lows, low]), np.vstack([highs, high])
                break
        else:
            groups.append(([number], low[None], high[None]))
    return [np.array(members, np.intp) for members, _, _ in groups]


def _bounds(body: FogBody) -> tuple[Float64, Float64]:
    """Lowest and highest corner (3,) in the world."""
    matrix = np.asarray(body.matrix_world, np.float64)
    corners = body.mesh.vertices.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return corners.min(axis=0), corners.max(axis=0)


def compile_fog(fog: Fog, camera: Camera, center: Float64) -> CompiledFog | None:
    """The fog of a scene whose coordinates are relative to `center` (3,); None: there is none."""
    if all(medium.is_nothing for medium in fog.media):
        return None
    return CompiledFog(fog, camera, center)


def _ended(
    start: Float64, length: Float64, medium: Float64, world: Float64, reach: float
) -> tuple[Float64, Float64, Float64]:
    """The stretches, and what fills them, with each cut in two where the world's medium (rows,) ends."""
    near = np.clip(reach - start, 0.0, length)
    beyond = np.maximum(medium - world[:, None, None], 0.0)
    starts, lengths = np.stack([start, start + near], axis=1), np.stack([near, length - near], axis=1)
    k, n = start.shape
    media = np.stack([medium, beyond], axis=2).reshape(len(medium), 2 * k, n)
    return starts.reshape(2 * k, n), np.maximum(lengths.reshape(2 * k, n), 0.0), media


def sorted_out(fog: Fog) -> tuple[list[FogBody], list[str]]:
    """The bodies that hold fog, and the names of those that cannot, open or flat as they are."""
    bodies = [body for body in fog.bodies if not body.medium.is_nothing]
    closed = [_is_closed(body) for body in bodies]
    sound = [body for body, holds in zip(bodies, closed, strict=True) if holds]
    return sound, [body.name for body, holds in zip(bodies, closed, strict=True) if not holds]


def _is_closed(body: FogBody) -> bool:
    """Whether a body has an inside: all of its triangles are of closed parts, and it has some thickness."""
    mesh = body.mesh
    if len(mesh.triangles) == 0 or (closed_parts(mesh).part < 0).any():
        return False
    low, high = _bounds(body)
    return bool(np.min(high - low) > FOG_FLATNESS * np.max(high - low))


def _volume(mesh: TriangleMesh) -> float:
    """Of a closed mesh, in its own space, six times; below 0 where it is turned inside out."""
    vertices = mesh.vertices.astype(np.float64)
    a, b, c = ((vertices - vertices.mean(axis=0))[mesh.triangles[:, i]].T for i in range(3))
    return float(dot(a, cross(b, c)).sum())
