# SPDX-License-Identifier: GPL-3.0-or-later
"""Fresnel and Snell at the ends of their range: grazing, critical, index-matched, tiny and huge IOR."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import Float64, PointLight, Scene, Sphere, Surface, World
from ...tracer.shading.scattering import fresnel_dielectric, refract
from . import build
from .case import Measured, Theme
from .compare import largest, off_edges

THEME = Theme("Fresnel and refraction")
IORS = (1e-3, 0.3, 1 / 1.5, 1 - 1e-6, 1 + 1e-6, 1.0003, 1.33, 1.5, 2.42, 10.0, 1e3)


def normal_reflectance(eta: float) -> float:
    """((n - 1) / (n + 1))^2."""
    return ((eta - 1) / (eta + 1)) ** 2


def textbook(cos: Float64, eta: float) -> Float64:
    """Unpolarised Fresnel reflectance as in any book, in extended precision; 1 beyond the critical angle."""
    c, n = np.asarray(cos, np.longdouble), np.longdouble(eta)
    s2 = (1 - c * c) / (n * n)
    ct = np.sqrt(np.maximum(1 - s2, 0))
    rs, rp = (c - n * ct) / (c + n * ct), (n * c - ct) / (n * c + ct)
    return np.where(s2 >= 1, 1, (rs * rs + rp * rp) / 2).astype(np.float64)


def reflectance(cos: Float64, eta: float) -> Float64:
    """The tracer's own."""
    return fresnel_dielectric(np.asarray(cos, np.float64), np.full(np.shape(cos), eta))


def critical_cosine(eta: float) -> float:
    """Below it everything is reflected, for eta < 1."""
    return float(np.sqrt((1 - eta) * (1 + eta)))


@THEME.case(
    20, "fresnel-against-the-textbook", "100 001 cosines, IOR 1e-3 .. 1e3", "Fresnel's equations", 1e-12, "reflectance"
)
def _() -> Measured:
    cos = np.linspace(0, 1, 100_001)
    worst = 0.0
    for eta in IORS:
        safe = 1 - cos**2 < eta**2 * (1 - 1e-9)  # at the critical angle itself the slope is infinite
        worst = max(worst, largest(reflectance(cos[safe], eta), textbook(cos[safe], eta)))
    return Measured(worst, f"{len(IORS)} indices; right at the critical angle see the next cases")


@THEME.case(
    4,
    "fresnel-at-grazing-angles",
    "cosines 1e-1 .. 1e-7, IOR 1.0003 .. 1e3",
    "Fresnel's equations",
    1e-12,
    "reflectance",
)
def _() -> Measured:
    cos = 10.0 ** -np.linspace(1, 7, 61)
    found = {eta: reflectance(cos, eta) for eta in IORS if eta > 1.0001}
    worst = max(largest(got, textbook(cos, eta)) for eta, got in found.items())
    # At a huge IOR Brewster's angle itself is grazing: there the curve dips first.
    rising = all((np.diff(got) >= 0).all() for eta, got in found.items() if eta < 3)
    return Measured(worst if rising else np.nan, "rises monotonically to 1 for IOR below 3")


@THEME.case(
    5,
    "critical-angle",
    "glass to air at the critical angle and 1 ulp on either side",
    "1 at and beyond it, at most 1 before it, without a jump",
    4e-5,
    "reflectance",
)
def _() -> Measured:
    worst = 0.0
    for eta in (1 / 1.33, 1 / 1.5, 1 / 2.42, 0.1):
        c = critical_cosine(eta)
        around = np.array([np.nextafter(c, 0), c, np.nextafter(c, 1)])
        got = reflectance(around, eta)
        beyond = reflectance(np.linspace(0, 1 - 1e-12, 1001) * c, eta)
        bounds = float(np.max(got) - 1) if np.max(got) > 1 else 0.0
        worst = max(worst, largest(got, 1.0), largest(beyond, 1.0), bounds)
    return Measured(worst, "four indices, down to 0.1; the slope there is infinite in theory, too")


@THEME.case(
    5,
    "critical-angle-leaves-tangentially",
    "refraction 1 ulp before the critical angle",
    "tangent to the surface, unit length",
    1e-7,
    "cosine",
)
def _() -> Measured:
    worst = 0.0
    for eta in (1 / 1.33, 1 / 1.5, 1 / 2.42):
        c = np.nextafter(critical_cosine(eta), 1) * (1 + 2e-16)
        wo, n = np.array([[np.sqrt((1 - c) * (1 + c))], [0.0], [c]]), np.array([[0.0], [0.0], [1.0]])
        wt = refract(wo, n, np.array([c]), np.array([eta]))
        worst = max(worst, abs(float(wt[2, 0])), abs(float((wt * wt).sum() - 1)))
    return Measured(worst, "square root of the unit round-off of float64 is 1.5e-8")


@THEME.case(6, "matched-index-reflects-nothing", "IOR 1 at 100 001 cosines from 0 to 1", "exactly 0", 0, "reflectance")
def _() -> Measured:
    return Measured(largest(reflectance(np.linspace(0, 1, 100_001), 1.0), 0))


def stage(*things: object) -> Scene:
    """Stripes behind and a lit floor under the origin, with more things."""
    stripes = [
        (build.quad([(x, 4, -4), (x + 0.5, 4, -4), (x + 0.5, 4, 4), (x, 4, 4)]), build.emitter(x / 8 + 0.5, 0.5, 0.1))
        for x in np.arange(-4, 4, 0.5)
    ]
    lamp = PointLight("lamp", (1, -1, 3), (9, 9, 9))
    lens = build.camera((0, -5, 0.5), (0, 0, 0), (0, 0, 1), (64, 64), 0.6)
    ground = (build.floor(4, -1.5), build.matte())
    return build.make_scene(*stripes, ground, *things, camera=lens, lights=(lamp,), world=World((0.1, 0.2, 0.3)))


def vanishing(surface: Surface, smooth: bool) -> Measured:
    """How much a ball of this surface changes the picture, shadow and alpha of a scene."""
    without = build.shoot(stage(), max_depth=1, transparent=True)
    with_ball = build.shoot(stage((build.icosphere(3, 1, smooth), surface)), max_depth=1, transparent=True)
    value = max(largest(with_ball.radiance, without.radiance), largest(with_ball.coverage, without.coverage))
    return Measured(
        max(value, largest(with_ball.residual, 0)), f"{with_ball.rays['straight']} rays passed it", with_ball.radiance
    )


@THEME.case(
    6,
    "matched-index-vanishes",
    "a ball of IOR 1 before stripes, flat shaded",
    "the picture without it, shadow and alpha too",
    2e-6,
)
def _() -> Measured:
    return vanishing(build.glass(1.0), False)


@THEME.case(
    6,
    "matched-index-vanishes-smooth",
    "the same with smooth normals",
    "the picture without it, shadow and alpha too",
    2e-6,
)
def _() -> Measured:
    return vanishing(build.glass(1.0), True)


@THEME.case(
    7,
    "nearly-matched-index",
    "IOR 1 +- 1e-6 and 1 +- 1e-3 at normal incidence",
    "((n - 1) / (n + 1))^2",
    1e-5,
    "relative",
)
def _() -> Measured:
    etas = (1 - 1e-6, 1 + 1e-6, 1 - 1e-3, 1 + 1e-3)
    found = [abs(float(reflectance(np.ones(1), e)[0]) / normal_reflectance(e) - 1) for e in etas]
    return Measured(max(found), "the textbook's form loses all digits in float32: 0.36 for 1 - 1e-6")


@THEME.case(
    7, "nearly-matched-index-hardly-bends", "a smooth ball of IOR 1 + 1e-6", "the picture without it, off edges", 1e-5
)
def _() -> Measured:
    without = build.shoot(stage(), max_depth=2)
    with_ball = build.shoot(stage((build.icosphere(4, 1, True), build.glass(1 + 1e-6))), max_depth=2)
    lit = without.radiance  # its shadow is as faint as the ball
    return off_edges(with_ball.radiance, lit)


@THEME.case(
    8,
    "bubble-ring",
    "an air bubble in water (IOR 1 / 1.33), white world, one bounce",
    "total reflection beyond 1/1.33 of its radius: 48.75 deg",
    0.5,
    "pixels of radius",
)
def _() -> Measured:
    size, radius = 96, 40.0
    reach = size / 2 / radius
    lens = replace(build.camera(size=(size, size)), projection="ORTHO", view_plane=(-reach, reach, -reach, reach))
    scene = build.make_scene(camera=lens, world=build.WHITE_WORLD, surfaces=(build.glass(1 / 1.33),))
    film = build.shoot(
        replace(scene, spheres=(Sphere("bubble", (0, 0, 0), 1.0, 0),)), allow=("lost_media",), max_depth=1
    )
    inner = np.count_nonzero(film.radiance[..., 0] < 1)
    got = float(np.sqrt(inner / np.pi))
    return Measured(abs(got - radius / 1.33), f"{got:.2f} px, expected {radius / 1.33:.2f} px", film.radiance)


@THEME.case(
    9,
    "huge-index-at-normal-incidence",
    "IOR 10, 100, 1000",
    "((n - 1) / (n + 1))^2: .669, .961, .996",
    1e-6,
    "reflectance",
)
def _() -> Measured:
    return Measured(max(abs(float(reflectance(np.ones(1), e)[0]) - normal_reflectance(e)) for e in (10.0, 100.0, 1e3)))


@THEME.case(
    9, "huge-index-bends-to-the-normal", "refraction at IOR 1e3, all angles", "sin t = sin i / 1000", 1e-12, "sine"
)
def _() -> Measured:
    s = np.linspace(0, 1, 1001)
    c = np.sqrt((1 - s) * (1 + s))
    wo = np.stack([s, np.zeros_like(s), c])
    n = np.broadcast_to(np.array([[0.0], [0.0], [1.0]]), wo.shape)
    wt = refract(wo, n, c, np.full_like(s, 1e3))
    return Measured(max(largest(-wt[0], s / 1e3), largest(wt[2], -np.sqrt(1 - (s / 1e3) ** 2))))


def refused(ior: float) -> bool:
    """Whether this IOR is refused in one line that names the object and the surface."""
    try:
        build.shoot(build.make_scene((build.box(), build.glass(ior), {})))
    except ValueError as error:
        return "'object 0', surface 'glass': ior" in str(error) and "\n" not in str(error)
    return False


@THEME.case(
    10, "impossible-index", "IOR 0, -1.5, NaN, infinite", "refused by name, nothing is traced", 0, "not refused"
)
def _() -> Measured:
    return Measured(sum(not refused(ior) for ior in (0.0, -1.5, float("nan"), float("inf"))))


@THEME.case(
    20,
    "reflectance-within-bounds",
    "1e6 random cosines and indices, 0, 1 and critical +- 1 ulp among them",
    "0 <= F <= 1",
    0,
    "values outside",
)
def _() -> Measured:
    rng = np.random.default_rng(20)
    eta = 10.0 ** rng.uniform(-3, 3, 1_000_000)
    cos = rng.random(eta.size)
    cos[:1000], cos[1000:2000], eta[2000:3000] = 0.0, 1.0, 1.0
    below = eta < 1
    critical = np.sqrt((1 - eta[below]) * (1 + eta[below]))
    ulps = rng.integers(-1, 2, critical.size) * 2.0**-53
    special = rng.random(critical.size) < 0.2
    cos[below] = np.where(special, critical * (1 + ulps), cos[below])
    f = fresnel_dielectric(cos, eta)
    return Measured(int(np.count_nonzero(~((f >= 0) & (f <= 1)))), "T = 1 - F by construction")


@THEME.case(
    20,
    "snells-law",
    "100 000 random directions, IOR 0.1 .. 10",
    "n1 sin i = n2 sin t, unit length, other side",
    1e-12,
    "sine",
)
def _() -> Measured:
    rng = np.random.default_rng(21)
    count = 100_000
    wo, n = rng.normal(size=(3, count)), rng.normal(size=(3, count))
    wo, n = wo / np.sqrt((wo * wo).sum(0)), n / np.sqrt((n * n).sum(0))
    n *= np.where((wo * n).sum(0) < 0, -1, 1)
    cos, eta = (wo * n).sum(0), 10.0 ** rng.uniform(-1, 1, count)
    passes = 1 - cos**2 < eta**2 * (1 - 1e-6)
    wo, n, cos, eta = wo[:, passes], n[:, passes], cos[passes], eta[passes]
    wt = refract(wo, n, cos, eta)
    snell = largest(np.cross(wt, n, axis=0) * np.minimum(eta, 1), -np.cross(wo, n, axis=0) * np.minimum(1 / eta, 1))
    across = float(np.max(np.maximum((wt * n).sum(0), 0)))
    return Measured(max(snell, largest((wt * wt).sum(0), 1), across), f"{np.count_nonzero(passes)} refracted")
