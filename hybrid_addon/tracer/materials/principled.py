# SPDX-License-Identifier: GPL-3.0-or-later
"""Layered surfaces, as EEVEE draws Principled: from the top sheen, coat, metal, transmission, dielectric, diffuse.

A layer's reflection has a colour, its directional albedo, which is taken from all that lies below. A layer is worked
out as one number for each view angle (split sum, Karis 2013), so a hit needs no more than its own cosine. What becomes
of a reflection depends on its roughness: below TRACED_ROUGHNESS a ray follows it; above, it is the world's blurred
image (`CompiledWorld.glossy`), as in EEVEE without ray tracing. A metal's is always followed.

Sources: gpu_shader_material_principled.glsl (order and weights), Fdez-Aguera 2019 (multiple scattering), Kutz et al.
2021, Novel aspects of the Adobe Standard Material (F82).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ...procedural import elementary
from ...scene import Float32, Float64
from ...scene.surfaces import MIN_IOR
from ..core.constants import FAINT, LEAST_COSINE, MIRROR_ROUGHNESS, TRACED_ROUGHNESS
from ..core.vectors import Array
from .columns import pack
from .fields import Fields
from .film import faded_in, film_reflectance, index_of, metal_index

TABLE_SIZE = 32
"""Steps of cosine and roughness in the table of albedos; 48 x 48 directions are summed for each."""
DIRECTIONS = 48
FULL_F90_IOR = 1.33
"""From IOR 1 to this EEVEE lets the reflectance at grazing angles grow from 0 to 1."""
EDGE_COSINE = 1 / 7
"""Of 82 degrees, where the edge tint of a metal holds."""
FILM_DIRECTIONS = 4
"""A film's colours are worked out at 4 x 2 visible normals."""


# ------------------------------------------------------------------------------------------------ albedos


@cache
def albedo_table() -> Float64:
    """(3, roughness, cosine): int of a GGX lobe times 1 - (1 - wo.h)^5, (1 - wo.h)^5 and wo.h (1 - wo.h)^6.

    Visible normals in equal shares (Heitz 2018), each weighing G1(wi); separable masking.
    """
    alpha = (np.arange(TABLE_SIZE) / (TABLE_SIZE - 1)).clip(1e-2) ** 2
    # One roughness after the other: all at once would not stay in a core's cache, and take three times as long.
    return np.stack([_albedo_row(float(a)) for a in alpha], axis=1)


@cache
def correlated_albedo_table() -> Float64:
    """(roughness, cosine): the same of a white lobe whose masking is correlated, as Cycles has it (Heitz 2014)."""
    alpha = (np.arange(TABLE_SIZE) / (TABLE_SIZE - 1)).clip(1e-2) ** 2
    cos = (np.arange(TABLE_SIZE) / (TABLE_SIZE - 1)).clip(1e-4)[:, None, None]

    def row(a: float) -> Float64:
        return np.asarray(correlated(masking(cos, a), _visible_facets(cos, a, DIRECTIONS)[1]).mean((1, 2)))

    return np.stack([row(float(a)) for a in alpha])


def correlated_albedo(cos: Array, roughness: Array) -> Array:
    """(n,) at view cosines and roughnesses (n,), bilinear."""
    return _bilinear(correlated_albedo_table(), cos, roughness)


def correlated(seen: Array, lit: Array) -> Array:
    """Share (n,) of the microfacets that the eye sees which light gets to, too, with heights that go together.

    seen, lit : Smith's G1 towards the eye and the light; G2 = 1 / (1 / G1 + 1 / G1' - 1) (Heitz 2014, eq. 99).
    """
    return np.asarray(np.where(lit > 0, lit / np.maximum(seen + lit - seen * lit, LEAST_COSINE), 0))


def _albedo_row(alpha: float) -> Float64:
    """(3, cosine) for one roughness squared."""
    cos = (np.arange(TABLE_SIZE) / (TABLE_SIZE - 1)).clip(1e-4)[:, None, None]
    wo_h, masked = _visible_facets(cos, alpha, DIRECTIONS)
    missing = 1 - wo_h
    grazing = missing * missing
    grazing *= grazing * missing
    return np.stack([(masked * f).mean((1, 2)) for f in (1 - grazing, grazing, wo_h * grazing * missing)])


def _visible_facets(cos: Array, alpha: Array | float, directions: int) -> tuple[Array, Array]:
    """wo.h and G1(wi), (n, d, d / 2) each, of d * d visible normals: the half of the disk with x > 0, the other being
    its mirror image. cos : (n, 1, 1), above 0.   alpha : the same, or one for all."""
    steps = (np.arange(directions) + 0.5) / directions
    turn = 2 * np.pi * (steps[: directions // 2] - 0.25)
    radius = np.sqrt(steps)[:, None]
    sin = np.sqrt(1 - cos * cos)
    stretched = np.sqrt((alpha * sin) ** 2 + cos * cos)
    x, z = alpha * sin / stretched, cos / stretched
    q, p = (radius * a for a in elementary.sincos(turn))
    q = (1 - (1 + z) / 2) * np.sqrt(1 - p * p) + (1 + z) / 2 * q
    w = np.sqrt(np.maximum(1 - p * p - q * q, 0))
    # The frame around the stretched direction (x, 0, z): (0, 1, 0), (-z, 0, x).
    hx, hy, hz = alpha * (w * x - q * z), alpha * p, np.maximum(w * z + q * x, 0)
    length = np.sqrt(hx * hx + hy * hy + hz * hz)
    wo_h = np.clip((sin * hx + cos * hz) / length, 0, 1)
    cos_i = 2 * wo_h * hz / length - cos
    return wo_h, np.where(cos_i > 0, masking(np.maximum(cos_i, LEAST_COSINE), alpha), 0)


def masking(cos: Array, alpha: Array | float) -> Array:
    """Smith's G1 of GGX."""
    return np.asarray(2 * cos / (cos + np.sqrt(alpha * alpha + (1 - alpha * alpha) * cos * cos)))


def albedos(cos: Array, roughness: Array) -> Float64:
    """The three sums (3, n) at view cosines (n,), bilinear; roughness: (n,), or (1,) for all."""
    return np.stack([_bilinear(sums, cos, roughness) for sums in albedo_table()])


def _bilinear(table: Array, cos: Array, roughness: Array) -> Array:
    """(n,), of the table's dtype."""
    last = table.dtype.type(TABLE_SIZE - 1)
    x, y = np.clip(cos, 0, 1) * last, np.clip(roughness, 0, 1) * last
    i, j = np.minimum(x.astype(np.intp), TABLE_SIZE - 2), np.minimum(y.astype(np.intp), TABLE_SIZE - 2)
    u, v = x - i.astype(x.dtype), y - j.astype(y.dtype)
    if len(j) == 1:  # one row is left; in the order of below, or a chunk with a single hit would differ by a bit
        low = table[j[0]] * (1 - v) + table[j[0] + 1] * v
        only: Array = low.take(i) * (1 - u) + low.take(i + 1) * u
        return only
    flat, i = table.reshape(-1), i + j * TABLE_SIZE
    left = flat.take(i) * (1 - v) + flat.take(i + TABLE_SIZE) * v
    right = flat.take(i + 1) * (1 - v) + flat.take(i + TABLE_SIZE + 1) * v
    result: Array = left * (1 - u) + right * u
    return result


def reflectance(f0: Float64, f90: Float64 | float, sums: Float64, multiscatter: bool = True) -> Float64:
    """Albedo (3, n) of a lobe with Schlick's Fresnel, with the light that the microfacets scatter more than once."""
    single = f0 * sums[0] + f90 * sums[1]
    if not multiscatter:
        return np.asarray(single)
    missing = 1 - (sums[0] + sums[1])
    mean = f0 + (f90 - f0) / 21
    result: Float64 = single + single * mean / (1 - missing * mean) * missing
    return result


def metal_reflectance(f0: Float64, edge: Float64 | None, sums: Float64, multiscatter: bool = True) -> Float64:
    """Albedo (3, n) of a metal: Schlick's, less a (1 - edge tint) of itself at 82 degrees; None: f0 at all angles."""
    if edge is None:
        return reflectance(f0, f0, sums, multiscatter)
    excess = _at_the_edge(f0, 1.0) * (1 - edge) / (EDGE_COSINE * elementary.power(1 - EDGE_COSINE, 6))
    result: Float64 = np.clip(reflectance(f0, 1.0, sums, multiscatter) - excess * sums[2], 0, 1)
    return result


def _at_the_edge(f0: Float64, edge: Float64 | float | None) -> Float64:
    """Reflectance (3, n) of a metal at 82 degrees."""
    return f0 if edge is None else edge * (1 + (f0 - 1) * (1 - elementary.power(1 - EDGE_COSINE, 5)))


def normal_reflectance(ior: Float64) -> Float64:
    """F0 of a dielectric."""
    return ((ior - 1) / (ior + 1)) ** 2


def grazing_reflectance(f0: Float64) -> Float64:
    """F90 of a dielectric, smaller for IORs close to 1: they must vanish."""
    return np.minimum(np.sqrt(f0) * (FULL_F90_IOR + 1) / (FULL_F90_IOR - 1), 1)


def sheen_albedo(cos: Float64, roughness: Float64) -> Float64:
    """EEVEE's fit to the albedo of its sheen."""
    c, r = cos, roughness
    a = 35.6694 * r * r - 24.4269 * r * c - 0.1405 * c * c + 6.1211 * r + 0.28105 * c - 0.1405
    b = 58.5299 * r * r - 85.0941 * r * c + 9.8955 * c * c + 1.9250 * r + 74.2268 * c - 0.2246
    return np.clip(a / np.where(b != 0, b, 1), 0, 1)


def slab_tint(color: Float64, cos: Float64, ior: Float64) -> Float64:
    """What passes obliquely through a slab that passes `color` at right angles (Beer and Lambert)."""
    return elementary.power(np.maximum(color, 0), ior / np.sqrt(ior * ior - (1 - cos * cos)))


# ------------------------------------------------------------------------------------------------ films


class _Film:
    """Of n hits what a thin film makes of the reflectances of their layers.

    A film's colours turn with the angle, so its directional albedo is the mean over the microfacets that the eye sees.
    """

    def __init__(self, f: Fields, cos: Float64, sums: Float64) -> None:
        """cos, sums: (n,) and (3, n), of `albedos`."""
        self.thickness, self.index = f["film"], np.maximum(f["film_ior"], MIN_IOR)
        self.single = (sums[0] + sums[1])[None]
        self.missing = (1 - self.single) * f["multiscatter"]
        self.angles = [(np.asarray(cos)[None], 1.0)]
        if (f["roughness"] > MIRROR_ROUGHNESS).any():
            alpha = f["roughness"].T[:, :, None].clip(1e-2) ** 2
            wo_h, masked = _visible_facets(np.maximum(cos, 1e-4)[:, None, None], alpha, FILM_DIRECTIONS)
            share = masked / np.maximum(masked.sum((1, 2), keepdims=True), LEAST_COSINE)
            wo_h, share = wo_h.reshape(len(cos), -1).T[:, None], share.reshape(len(cos), -1).T[:, None]
            self.angles = list(zip(wo_h, share, strict=True))

    def over(self, bare: Float64, n: Float64, k: Float64 | float = 0.0, scale: Float64 | float = 1.0) -> Float64:
        """Albedo (3, n) of a lobe of albedo `bare` (1 or 3, n) whose base has the index n + i k: with the film.

        scale : of what the film reflects.
        """
        mean = scale * sum(share * film_reflectance(c, self.thickness, self.index, n, k) for c, share in self.angles)
        filmed = mean * self.single * (1 + mean / (1 - self.missing * mean) * self.missing)
        return np.asarray(faded_in(self.thickness, bare, filmed))

    def over_dielectric(self, bare: Float64, f0: Float64) -> Float64:
        """The same over a dielectric of reflectance f0 (3, n): its index is that of the brightest of the three."""
        most = f0.max(axis=0, keepdims=True)
        return self.over(bare, index_of(most), scale=np.where(most > 0, f0 / np.where(most > 0, most, 1), 1.0))


# ------------------------------------------------------------------------------------------------ the stack


def layered_columns(f: Fields, cos: Float64) -> Float32:
    """(HEIGHT, n) columns (see `columns`) of n hits seen at `cos` (n,). Layers that are nowhere are left out."""
    metal, (body, passing) = f["reflectivity"], _split(f)
    bare = (f["ior"] == 1) & (f["pane_ior"] == 1)
    covered = np.where(bare, 1 - passing, 1.0)  # what passes unbent misses all layers: Alpha
    traced, coat_traced = f["roughness"] < TRACED_ROUGHNESS, f["coat_roughness"] < TRACED_ROUGHNESS
    sums = albedos(cos, f["roughness"][0])
    film = _Film(f, cos, sums) if f["film"].any() else None
    multiscatter = bool(f["multiscatter"].all())
    kept = 1.0 if multiscatter else np.sqrt(sums[0] + sums[1])  # refraction turns less: measured, half is lost

    sheen: Array = np.zeros((1, 1))
    if f["sheen"].any():
        sheen = f["sheen"] * f["sheen_tint"] * sheen_albedo(cos, f["sheen_roughness"][0])
    below = np.maximum(1 - sheen.max(0, keepdims=True), 0)
    coat, below, tint = _coat(f, cos, covered, below)
    under = below * tint

    lobe: Array = np.zeros((1, 1))
    if metal.any():
        color, edge = f["reflection_tint"], f.get("edge_tint")
        reflected = metal_reflectance(color, edge, sums, multiscatter)
        if film is not None:
            reflected = film.over(reflected, *metal_index(color, _at_the_edge(color, edge), f.get("metal_ior")))
        lobe = under * metal * reflected
    passed = f["transmission_tint"]
    if (f["pane_ior"] != 1).any():
        pane, passed = _pane(f, cos, sums, film, multiscatter)
        lobe = lobe + under * passing * pane
    f0 = f["specular"]
    dielectric = reflectance(f0, grazing_reflectance(f0), sums, multiscatter) if f0.any() else np.zeros((1, 1))
    if film is not None:
        dielectric = film.over_dielectric(dielectric, f0)
    gloss = under * body * dielectric
    shown = lobe + gloss
    if passing.any():
        f0 = normal_reflectance(f["ior"])
        once = reflectance(f0, grazing_reflectance(f0), sums, multiscatter)
        once = once if film is None else film.over(once, f["ior"])
        interface = under * passing * f["interface_tint"] * once
        shown = shown + np.where(f["ior"] == 1, 0, interface)

    through = np.where(bare, 1.0, tint)
    changed = {
        "interface": np.where(bare, passing, passing * below * kept),
        "tint": passed * through,
        "interface_tint": f["interface_tint"] * through,
        "mirror": lobe + np.where(traced, gloss, 0) + np.where(coat_traced, coat, 0),
        "base_color": under * body * (1 - dielectric.max(0)) * f["base_color"] + covered * sheen,
        "local": np.ones((1, 1)),
        "ambient": f["ambient"],
        "diffuse": f["diffuse"],
        "emission": f["emission"] * under,
        "lobe": shown,
        "coat": coat,
        "lobe_blurred": np.where(traced, 0, gloss),
        "coat_blurred": np.where(coat_traced, 0, coat),
        "lobe_roughness": f["roughness"],
        "coat_roughness": f["coat_roughness"],
        "stretch": f["stretch"],
        "film": f["film"],
        "film_ior": f["film_ior"],
        "scatter": f["scatter"],
        "scatter_radius": f["scatter_radius"],
    }
    return pack(changed, len(cos))


def _coat(f: Fields, cos: Float64, covered: Array, below: Array) -> tuple[Array, Array, Array]:
    """What the coat reflects, what it leaves for what is below, and how it tints that: (1 or 3, 1 or n)."""
    if not f["coat"].any():
        return np.zeros((1, 1)), below, np.ones((1, 1))
    sums, f0 = albedos(cos, f["coat_roughness"][0]), normal_reflectance(f["coat_ior"])
    albedo = f["coat"] * (f0 * sums[0] + grazing_reflectance(f0) * sums[1])
    tint = 1 + (slab_tint(f["coat_tint"], cos, f["coat_ior"]) - 1) * np.minimum(f["coat"], 1)
    return covered * below * albedo * f["coat_shows"], below * np.maximum(1 - albedo, 0), tint


def _pane(f: Fields, cos: Float64, sums: Float64, film: _Film | None, multiscatter: bool) -> tuple[Float64, Float64]:
    """What a thin pane reflects and passes, (3, n), with all that goes to and fro in it; 0 and 1 of none."""
    ior = f["pane_ior"]
    f0 = normal_reflectance(ior)
    once = reflectance(f0, grazing_reflectance(f0), sums, multiscatter)
    once = once if film is None else film.over(once, ior)
    color = slab_tint(f["transmission_tint"], cos, ior)
    passed = color * (1 - once) ** 2 / np.maximum(1 - (once * color) ** 2, FAINT)
    none = ior == 1
    return np.where(none, 0, once * (1 + passed * color)), np.where(none, f["transmission_tint"], passed)


def _split(f: Fields) -> tuple[Float64, Float64]:
    """Shares (1, n) of the dielectric body and of what is transmitted."""
    rest = 1 - f["reflectivity"]
    return rest * f["opacity"], rest * (1 - f["opacity"])
