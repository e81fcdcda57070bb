# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirror, lens and highlight: reflect, refract, Fresnel, Phong.

All directions point away from the surface; `n` lies on the side of `wo`; eta is transmitted over incident IOR.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated
from ...procedural import elementary
from ...procedural.fresnel import fresnel_dielectric as fresnel_dielectric
from ...scene import Float32, Float64
from ..core.constants import LEAST_COSINE, MIN_OUTER_COSINE, OUTER_COSINE_SHARE, SIMPLE_CAUSTIC_FROM
from ..core.vectors import Array, cross, dot, flatnonzero, normalize, put, take
from ..materials.columns import HitValues
from ..materials.film import film_fresnel


def reflect(wo: Array, n: Array) -> Array:
    """Mirror direction (3, n): 2 (n.wo) n - wo."""
    result = n * (2 * dot(wo, n))
    result -= wo
    found: Array = result
    return found


def mirrored(wo: Float32, n: Float32, roughness: Float32) -> Float32:
    """Main direction (3, n) of a rough reflection, not normalised: nearer to the normal than the mirror's.

    Lagarde and de Rousiers 2014, Moving Frostbite to PBR, 4.9.3.
    """
    smooth = 1 - roughness * roughness
    share = smooth * (np.sqrt(smooth) + roughness * roughness)
    return np.asarray(n + (reflect(wo, n) - n) * share, np.float32)


def passed(fresnel: Array, reflects: NDArray[np.bool_]) -> Array:
    """What interfaces (n,) pass: 1 - F. All of it where they reflect nothing, as Refraction BSDF has it in EEVEE and
    Cycles, but for total reflection.
    """
    return np.where(reflects | (fresnel >= 1), 1 - fresnel, fresnel.dtype.type(1))


@accelerated
def shares(
    throughput: Float32, mirror: Float32, interface_tint: Float32, tint: Float32, interface: Float32,
    fresnel: Float32, reflects: NDArray[np.bool_],
) -> tuple[Float32, Float32]:  # fmt: skip
    """What reflected and transmitted rays carry on, (3, n) each, of throughput (3, n).

    mirror, interface_tint, tint : (3, n)   interface : (n,)   fresnel : (n,) or (3, n)   reflects : see `passed`.
    """
    reflected = throughput * (mirror + interface_tint * (interface * fresnel))
    return reflected, throughput * (tint * (interface * passed(fresnel, reflects)))


def both_faces(fresnel: Array, tint: Array, thin: NDArray[np.bool_] | None) -> tuple[Array, Array]:
    """Reflectance (n,) and tint (3, n) of both faces of thin walls at once; of other hits, and for None, unchanged.

    R + (1 - R)^2 R (1 + R^2 + R^4 + ...) = 2 R / (1 + R); what passes is tinted twice.
    """
    if thin is None:
        return fresnel, tint
    return np.where(thin, 2 * fresnel / (1 + fresnel), fresnel), np.where(thin, tint * tint, tint)


def with_film(
    fresnel: Float32, filmed: NDArray[np.intp], cos_i: Float64, eta: Float64, outside: NDArray[np.bool_], ior: Float64,
    values: HitValues,
) -> Float32:  # fmt: skip
    """Reflectance of n interfaces: (n,), or (3, n) with the colours that thin films give to those `filmed`.

    cos_i, eta, outside, ior: (n,), see `film_fresnel`.
    """
    if len(filmed) == 0:
        return fresnel
    bare, cosine, relative, index = (take(a, filmed) for a in (fresnel, cos_i, eta, ior))
    film = values.value("film", filmed), values.value("film_ior", filmed)
    colored = film_fresnel(bare, cosine, relative, take(outside, filmed), index, *film)
    return put(np.broadcast_to(fresnel, (3, len(fresnel))), filmed, colored)


def simple_caustic(cos_i: Float64, ior: Float64) -> Float64:
    """How much brighter (n,) a straight shadow ray gets at a surface that would bend it: the original system's caustic.

    theta^(2^(9 r)) ior (1 + 4 r) with r = ior - 1 within 0..1 and theta the cosine of incidence (the thesis, 2.2.3). It
    imitates round bodies: at both faces of a ball it passes, in all, k^2 / (e + 1) of the light, with k = ior (1 + 4 r)
    and e = 2^(9 r): 108 % for IOR 1.33, 86 % for 1.5, 19 % for 2. Flat panes it makes k^2 times too bright.
    """
    r = np.clip(ior - 1, 0.0, 1.0)
    brightened = elementary.power(cos_i, elementary.power(2.0, 9 * r)) * ior * (1 + 4 * r)
    return np.where(r > SIMPLE_CAUSTIC_FROM, brightened, 1.0)


def refract(wo: Float64, n: Float64, cos_i: Float64, eta: Float64) -> Float64:
    """Snell: transmitted unit directions (3, n); NaN beyond the critical angle, where F = 1 and nobody asks.

    wt = -wo / eta + (cos_i / eta - cos_t) n, with eta cos_t = sqrt(eta^2 - 1 + cos_i^2) as in `fresnel_dielectric`.
    """
    g = np.sqrt((eta - 1) * (eta + 1) + cos_i * cos_i)
    return (n * (cos_i - g) - wo) / eta


def reflecting_normal(wo: Float32, n: Float32, n_geometric: Float32) -> Float32:
    """Normals (3, n), turned towards the geometric one where the mirror direction of `n` would go into the surface.

    Only as far as takes it out again, with the cosine t of `_least_cosine`: Cycles' ensure_valid_specular_reflection.
    n' = x X + z n_g, X the direction of n along the surface and (wo_x, wo_z) that of wo in this frame, reflects wo to
    2 (n'.wo) n' - wo, whose component along n_g is t where z^2 = (b +- sqrt(b^2 - 4 a c)) / (4 a) with
    a = wo_x^2 + wo_z^2, b = 2 (a + wo_z t), c = (t + wo_z)^2: - where wo_x > 0, the steeper one.
    """
    least = _least_cosine(wo, n_geometric)
    sunk = flatnonzero(dot(reflect(wo, n), n_geometric) < least)
    if len(sunk) == 0:
        return n
    up, eye = take(n_geometric, sunk).astype(np.float64), take(wo, sunk).astype(np.float64)
    along = take(n, sunk).astype(np.float64)
    along -= up * dot(along, up)
    along /= np.maximum(np.sqrt(dot(along, along)), LEAST_COSINE)
    t, x, z = least[sunk].astype(np.float64), dot(eye, along), np.maximum(dot(eye, up), 0)
    a = np.maximum(x * x + z * z, LEAST_COSINE**2)
    b = 2 * (a + z * t)
    root = np.sqrt(np.maximum(b * b - 4 * a * (t + z) ** 2, 0))
    steep2 = np.clip((b + np.where(x < 0, root, -root)) / (4 * a), 0, 1)
    turned = normalize(along * np.sqrt(1 - steep2) + up * np.sqrt(steep2))
    return put(n, sunk, turned.astype(np.float32))


def _least_cosine(wo: Float32, n_geometric: Float32) -> Float32:
    """(n,) of directions that leave a surface, with its geometric normal: at least min(0.9 n_g.wo, 0.01)."""
    return np.minimum(OUTER_COSINE_SHARE * np.abs(dot(wo, n_geometric)), np.float32(MIN_OUTER_COSINE))


@accelerated
def mirror_directions(wo: Float32, n_shading: Float32, n_geometric: Float32, curved: bool) -> Float32:
    """Unit mirror directions (3, n). curved: the normals differ, and `reflecting_normal` is to be asked."""
    return normalize(reflect(wo, reflecting_normal(wo, n_shading, n_geometric) if curved else n_shading))


@accelerated
def refracted_directions(
    wo: Float32, n_shading: Float32, n_geometric: Float32, cos_i: Float64, eta: Float64, curved: bool
) -> Float32:
    """Unit directions (3, n) float32 of `refract`. curved: the normals differ, and `keep_outside` is to be asked."""
    bent = refract(wo.astype(np.float64), n_shading.astype(np.float64), cos_i, eta)
    direction = normalize(bent).astype(np.float32)
    return keep_outside(direction, -n_geometric, wo) if curved else direction


def above(wo: Float32, n: Float32, cos: Float32) -> tuple[Float32, Float32]:
    """Directions to the eye (3, n), lifted to the plane of n where they lie below it, and their cosines > 0 with n.

    cos : (n,) n.wo.
    EEVEE's highlights, fitted by linearly transformed cosines, are those of a surface seen edge on there.
    """
    sunk = flatnonzero(cos < LEAST_COSINE)
    if len(sunk) == 0:
        return wo, cos
    lifted = normalize(take(wo, sunk) + take(n, sunk) * (np.float32(LEAST_COSINE) - cos[sunk]))
    return put(wo, sunk, lifted), np.maximum(cos, np.float32(LEAST_COSINE))


def keep_outside(w: Float32, n_geometric: Float32, wo: Float32) -> Float32:
    """Lift directions (3, n) that a smooth normal sends through the surface back to its outer side."""
    least = _least_cosine(wo, n_geometric)
    lift = least - dot(w, n_geometric)
    sunk = flatnonzero(lift > 0)
    if len(sunk) == 0:
        return w
    lifted = normalize(take(w, sunk) + take(n_geometric, sunk) * lift[sunk])
    return put(w, sunk, lifted)


def half_way(wi: Float32, wo: Float32, n: Float32) -> tuple[Float32, Float32]:
    """What highlights ask of h, the direction half way between wi and wo (3, n): 1 - (n.h)^2 and wo.h, (n,) each.

    From the cross product: near 1, where a sharp highlight is, float32 does not resolve the cosine. At roughness 0.05
    up to 13 % of the peak would be lost.
    """
    both = wi + wo
    length2 = np.maximum(dot(both, both), np.float32(LEAST_COSINE**2))
    across = cross(both, n)
    return np.minimum(dot(across, across) / length2, np.float32(1)), np.sqrt(length2) * np.float32(0.5)


def phong(sin2_h: Float32, cos_i: Float32, cos_o: Float32, wo_h: Float32, exponent: Float32) -> Float32:
    """Normalised Blinn-Phong microfacet lobe times cos_i, without its Fresnel factor: (n,).

    D = (e + 2) / (2 pi) cos_h^e satisfies int D cos_h dh = 1 (Blinn 1977, normalised as in Walter et al. 2007). With
    the V-cavity masking G of Cook & Torrance 1982, f cos_i = D G / (4 cos_o), G = min(1, 2 cos_h cos_o / wo_h,
    2 cos_h cos_i / wo_h), written without a division by a vanishing cos_o. As V-cavities satisfy
    int G1 D (wo.h) dh = cos_o and G <= G1, the directional albedo is at most 1 (times Fresnel's F0 at small angles).

    sin2_h = 1 - cos_h^2, cos_h = n.h, cos_i = n.wi, cos_o = n.wo, wo_h = wo.h: all (n,), the cosines > 0.
    """
    cos2_h = np.maximum(1 - sin2_h, np.float32(LEAST_COSINE))
    # cos_h^e: with large exponents a rounding of the cosine near 1 would count as often.
    power = elementary.exp(
        exponent * np.float32(0.5) * elementary.log1p(np.maximum(-sin2_h, np.float32(LEAST_COSINE - 1)))
    )
    d = (exponent + 2) * np.float32(1 / (2 * np.pi)) * power
    valley = 2 * np.sqrt(cos2_h) / wo_h
    visible = np.minimum(1 / cos_o, valley * np.minimum(np.float32(1), cos_i / cos_o))
    return np.asarray(d * np.float32(0.25) * visible, np.float32)


@accelerated
def phong_light(
    wi: Float32, wo: Float32, n: Float32, cos_i: Float32, cos_o: Float32, exponent: Float32, f0: Float32, light: Float32
) -> Float32:
    """What Phong's highlight sends along wo (3, n) of light (n,) from wi (3, n): (3, n).

    n : (3, n).   cos_i, cos_o : (n,) > 0, of wi and wo with it.   exponent : (n,).   f0 : (3, n).
    """
    sin2_h, wo_h = half_way(wi, wo, n)
    lobe = phong(sin2_h, cos_i, cos_o, wo_h, exponent)
    return np.asarray(schlick(f0, wo_h) * lobe * light, np.float32)


def schlick(f0: Float32, cos: Float32) -> Float32:
    """Schlick's 1994 Fresnel for a coloured reflectance at normal incidence: (3, n)."""
    m = np.clip(1 - cos, 0, 1)
    m2 = m * m
    return np.asarray(f0 + (1 - f0) * (m2 * m2 * m), np.float32)
