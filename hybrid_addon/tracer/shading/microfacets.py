# SPDX-License-Identifier: GPL-3.0-or-later
"""Rough reflection and refraction: rays leave by the mirror of a microfacet that is drawn, not of the surface.

Microfacets are those of GGX that the eye sees (Heitz 2018, by spherical caps: Dupuy & Benyoub 2023). What a lobe
reflects in all, its albedo, is in its weight already, so each ray carries all of it: rays that other microfacets would
catch are drawn again instead, by Smith's masking. So no light is lost or won, whatever the roughness. Fresnel's
equations share out light by the microfacet's angle.

A camera ray's first rough hit counts as `Settings.rough_samples` hits, each with its own microfacet and its share of
the weight, and as one more for a smooth coat over a rough base: no noise comes from choosing between the two. Later
hits draw one. With 0 of them no ray follows what is rough: it shows the world's blurred image, in the
direction of the mirror or straight through, and never becomes sharp.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...procedural import elementary
from ...scene import Float32, Float64
from ..core.constants import FAINT, LEAST_COSINE, MICROFACET_TRIES, MIRROR_ROUGHNESS
from ..core.rays import Rays
from ..core.sampler import FACET, LOBE, TRY, Draws, hash32
from ..core.vectors import Array, dot, flatnonzero, largest_component, normalize
from ..materials.principled import correlated, correlated_albedo, masking
from ..prepare.compiled import CompiledScene
from .interaction import Interaction
from .ltc import Brushed, alpha_from, groove_frame
from .scattering import reflect, reflecting_normal

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]
GROOVE_LATTICE = (21, 13)
"""What grooves reflect is the mean over 21 microfacets, a Fibonacci lattice: within 0.015 of that over 4096. A grid of
4 x 4, whose rows lie along the grooves, is 0.05 off.
"""


@dataclass(eq=False)
class SampledMicrofacets:
    """Hits (n,) with the normals of microfacets for shading normals.

    Where two lobes of different roughness share a reflection, one of them is drawn.

    rays, at, t : the hits, and how far along their rays they are.
    coat     : (n,) float32, what the coat reflects, where lobes were drawn.
    is_coat  : (n,) bool, it was the coat.
    is_rough : (n,) bool, a microfacet was drawn: what was not is a mirror.
    chance   : (n,) float32, of what was drawn; 1 where nothing was.
    """

    rays: Rays
    at: Interaction
    t: Float64
    coat: Float32
    is_coat: Bools
    is_rough: Bools
    chance: Float32

    def share(self, reflected: Float32, transmitted: Float32, bends: Bools) -> tuple[Float32, Float32]:
        """What the lobes that were drawn reflect and transmit, of what all do: (3, n) each."""
        if not self.coat.any():
            return reflected, transmitted
        coat = self.rays.throughput * self.coat
        rest = np.maximum(reflected - coat, np.float32(0))
        drawn = np.asarray(np.where(self.is_coat, coat, rest) / self.chance, np.float32)
        bent: Float32 = np.where(self.is_coat, np.float32(0), transmitted / self.chance)
        return drawn, np.where(bends, bent, transmitted)


def roughen(scene: CompiledScene, rays: Rays, at: Interaction, t: Float64) -> SampledMicrofacets | None:
    """Draw microfacets; None: nobody draws."""
    # Which hits are rough, and what of their weight the base and the coat have.
    lobe, coat = at.value("lobe_roughness"), at.value("coat_roughness")
    coated = at.value("coat") - at.value("coat_blurred")
    bent = at.value("interface") * (at.ior != 1)
    rest = largest_component(at.value("mirror")) - coated + bent
    rest = np.where(rest > FAINT, rest, np.float32(0))
    wide: Bools = ((rest > 0) & (lobe > MIRROR_ROUGHNESS)) | ((coated > 0) & (coat > MIRROR_ROUGHNESS))
    if at.draws is None:
        return None
    if not wide.any():
        mirrors, nothing = np.zeros(len(rays), bool), np.zeros(len(rays), np.float32)
        return SampledMicrofacets(rays, at, t, nothing, mirrors, mirrors, nothing + 1)
    # Those that count as several hits.
    both = wide & (coated > 0) & (rest > 0) & (lobe != coat)
    first = wide & (rays.depth == 0) & (rays.straight == 0)
    apart = both & first & (coat <= MIRROR_ROUGHNESS)
    parts = np.full(len(rays), scene.settings.rough_samples)
    if at.share is not None:  # closures share the rays of their hit
        parts = np.maximum(np.rint(parts * at.share).astype(np.intp), 1)
    rays, at, t, index, is_last = _repeated(parts, rays, at, t, first, apart)
    lobe, coat, coated, rest = (a.take(index) for a in (lobe, coat, coated, rest))
    wide, both, apart = wide.take(index), both.take(index), apart.take(index)
    # Where two lobes of different roughness share a reflection, one of them.
    draws = at.draws
    assert draws is not None
    odds = np.where(both, coated / np.where(both, coated + rest, np.float32(1)), (rest <= 0).astype(np.float32))
    place = draws.square(LOBE)[0]
    is_coat = np.where(apart, is_last, place < odds)
    if len(rays.path):  # samples that leave in different directions are not alike, whatever they meet
        path = np.where(wide & ~(apart & is_last), hash32(rays.path ^ place.view(np.uint32)), rays.path)
        rays = replace(rays, path=path)
    chance = np.where(both & ~apart, np.where(is_coat, odds, 1 - odds), np.float32(1))
    # The microfacets.
    roughness = np.where(is_coat, coat, lobe)
    normals = reflecting_normal(at.wo, at.n_shading, at.n_geometric)
    facing = flatnonzero(wide & (roughness > MIRROR_ROUGHNESS) & (dot(at.wo, normals) > 0))
    normals = np.where(wide, normals, at.n_shading)
    redraw = (at.value("interface") == 0).take(facing)
    brushed = at.brushed(facing)
    if brushed is not None:  # coats are round
        brushed = brushed[0], np.where(is_coat[facing], np.float32(1), brushed[1])
    normals[:, facing] = _microfacets(
        at.wo[:, facing], normals[:, facing], roughness[facing] ** 2, redraw, draws.take(facing), brushed
    )
    at = replace(at, n_shading=normals)
    is_rough = wide & (roughness > MIRROR_ROUGHNESS)
    return SampledMicrofacets(rays, at, t, np.where(both, coated, np.float32(0)), is_coat & both, is_rough, chance)


def _repeated(
    parts: Numbers, rays: Rays, at: Interaction, t: Float64, first: Bools, apart: Bools
) -> tuple[Rays, Interaction, Float64, Numbers, Bools]:
    """The hits, `first` ones (n,) as many times as wanted and those `apart` (n,) once more; which of the old ones they
    are; and which of them are the last of theirs."""
    n = len(rays)
    times = np.where(first, parts, 1) + apart
    if np.max(times, initial=1) < 2:
        return rays, at, t, np.arange(n), np.ones(n, bool)
    index = np.repeat(np.arange(n), times)
    part = (np.arange(len(index)) - (np.cumsum(times) - times)[index]).astype(np.uint32)
    is_last = part == times[index] - 1
    shared = np.where(apart[index], np.where(is_last, 1, times[index] - 1), times[index])
    rays, at = rays.take(index), at.take(index)
    assert at.draws is not None
    rays = replace(
        rays,
        throughput=np.where(shared > 1, rays.throughput / shared.astype(np.float32), rays.throughput),
        path=np.where(part > 0, hash32(rays.path + part), rays.path),
    )
    draws = replace(
        at.draws, parts=np.stack([shared.astype(np.uint32), np.where(shared > 1, part, 0)]).astype(np.uint32)
    )
    return rays, replace(at, draws=draws), t[index], index, is_last


def _microfacets(
    wo: Float32, n: Float32, alpha: Float32, redraw: Bools, draws: Draws, brushed: Brushed | None
) -> Float32:
    """Normals (3, m) of microfacets of surfaces of normals n that are seen from wo.

    redraw : (m,) bool, draw again while another microfacet catches what is reflected.   brushed : see `visible_normal`.
    """
    result = np.empty_like(wo)
    left: Numbers = np.arange(wo.shape[1])
    for number in range(MICROFACET_TRIES):
        some, salt = draws.take(left), np.uint32(number)
        ways = None if brushed is None else (brushed[0][:, left], brushed[1][left])
        h = visible_normal(wo[:, left], n[:, left], alpha[left], some.square(FACET + salt), ways)
        result[:, left] = h
        wi = reflect(wo[:, left], h)
        cosine, width = dot(wi, n[:, left]), alpha[left]
        if ways is not None:
            width = alpha_from(wi, groove_frame(n[:, left], width, ways))
        passes = np.where(cosine > 0, masking(np.maximum(cosine, np.float32(LEAST_COSINE)), width), 0)
        left = left[redraw[left] & (some.square(TRY + salt)[0] >= passes)]
        if len(left) == 0:
            break
    return result


def visible_normal(
    wo: Float32, n: Float32, alpha: Float32, square: tuple[Float32, Float32], brushed: Brushed | None = None
) -> Float32:
    """Normals (3, m) of microfacets of GGX that are seen from wo, which lies above n: by points of the unit square.

    brushed : tangents (3, m), unit vectors or 0, and stretches (m,) (scene.Surface); None: all are round.
    """
    tangent, bitangent, along, across = groove_frame(n, alpha, brushed)
    x, y, z = dot(wo, tangent) * along, dot(wo, bitangent) * across, dot(wo, n)
    length = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    phi: Array = np.float32(2 * np.pi) * square[0]
    cap = 1 - square[1] * (1 + z)  # from 1 down to -z
    sin = np.sqrt(np.maximum(1 - cap * cap, 0))
    sin_phi, cos_phi = elementary.sincos(phi)
    hx, hy, hz = sin * cos_phi + x, sin * sin_phi + y, np.maximum(cap + z, np.float32(0))
    return normalize(tangent * (hx * along) + bitangent * (hy * across) + n * hz).astype(np.float32, copy=False)


def brushed_share(wo: Float32, n: Float32, roughness: Float32, brushed: Brushed) -> Float32:
    """What brushed surfaces reflect (m,), of what round ones of the same roughness do.

    Grooves catch more of the light than the same microfacets all around. What these catch is given back (`principled`),
    and so it is here, but no more, as in Cycles: EEVEE has no grooves.
    """
    alpha = roughness**2
    frame = groove_frame(n, alpha, brushed)
    cos = np.clip(dot(wo, n), LEAST_COSINE, 1)
    seen = masking(cos, alpha_from(wo, frame))
    escapes, (number, turns) = np.zeros(len(alpha), np.float32), GROOVE_LATTICE
    for place in range(number):
        lattice = (place * turns % number + 0.5) / number, (place + 0.5) / number
        square = np.full(1, lattice[0], np.float32), np.full(1, lattice[1], np.float32)
        wi = reflect(wo, visible_normal(wo, n, alpha, square, brushed))
        cosine = dot(wi, n)
        lit = np.where(cosine > 0, masking(np.maximum(cosine, LEAST_COSINE), alpha_from(wi, frame)), 0)
        escapes += correlated(seen, lit).astype(np.float32)
    share = escapes / (number * np.maximum(correlated_albedo(cos, roughness), LEAST_COSINE))
    return np.asarray(np.minimum(share, 1), np.float32)


def are_blurred(scene: CompiledScene, at: Interaction) -> Bools | None:
    """(n,) hits whose base is rough and that no ray is to follow; None: there are none."""
    if scene.settings.rough_samples > 0 or not scene.surfaces.rough.any():
        return None
    found = scene.surfaces.rough.take(at.surface) & (at.value("lobe_roughness") > MIRROR_ROUGHNESS)
    return found if found.any() else None
