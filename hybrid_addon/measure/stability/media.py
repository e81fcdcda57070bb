# SPDX-License-Identifier: GPL-3.0-or-later
"""Which medium is on which side: inside, nested, touching, open, inverted and vanishingly thin glass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import Camera, Scene, Sphere, Visibility
from . import build
from .case import Measured, Theme
from .compare import largest, off_edges
from .fresnel import normal_reflectance

THEME = Theme("Media: nested, touching, open and thin glass")
DEEP = 12
"""Bounces at which what is left of a series of internal reflections is far below every tolerance here."""


RING = 0.06
"""Half width, in radii, of the band around the ring of total reflection in which Fresnel's curve is too steep."""


def transmission(*ratios: float) -> float:
    """T of lossless parallel interfaces at normal incidence, all reflections in between: (1 - T) / T = sum R / (1 - R).

    ratios : relative index of each interface, either way round.
    """
    loss = sum(normal_reflectance(q) / (1 - normal_reflectance(q)) for q in ratios)
    return 1 / (1 + loss)


def product(*ratios: float) -> float:
    """T of the direct path alone."""
    return float(np.prod([1 - normal_reflectance(q) for q in ratios]))


def down(half: float = 1e-3) -> Camera:
    """A camera of 2 x 2 parallel rays that looks straight down the z axis."""
    lens = replace(build.camera(size=(2, 2)), projection="ORTHO")
    return replace(lens, view_plane=(-half, half, -half, half))


def spheres(*shells: tuple[float, float], **other: object) -> Scene:
    """Concentric analytic balls of (radius, IOR) over a glowing floor in a black world."""
    surfaces = [build.glass(ior) for _, ior in shells]
    scene = build.make_scene((build.floor(9, -4), build.emitter()), surfaces=surfaces, **{"camera": down(), **other})
    balls = tuple(Sphere(f"ball {k}", (0, 0, 0), radius, k) for k, (radius, _) in enumerate(shells))
    return replace(scene, spheres=balls)


def center_error(scene: Scene, expected: float, depth: int) -> Measured:
    """|radiance - expected| of the rays through the middle, and what was seen."""
    got = build.shoot(scene, max_depth=depth).radiance
    return Measured(largest(got, expected), f"{got[0, 0, 0]:.6f}, expected {expected:.6f}")


# ------------------------------------------------------------------------------------------------ nested


@THEME.case(
    11, "glass-in-water", "a glass ball in a water ball, straight through", "(1 - R(1.33))^2 (1 - R(1.5/1.33))^2", 1e-5
)
def _() -> Measured:
    expected = product(1.33, 1.5 / 1.33, 1.5 / 1.33, 1.33)
    return center_error(spheres((2.0, 1.33), (1.0, 1.5)), expected, 4)


@THEME.case(8, "bubble-in-water", "an air ball (IOR 1) in a water ball, straight through", "(1 - R(1.33))^4", 1e-5)
def _() -> Measured:
    return center_error(spheres((2.0, 1.33), (1.0, 1.0)), product(1.33, 1.33, 1.33, 1.33), 4)


@THEME.case(
    11,
    "glass-water-bubble",
    "a bubble in water in glass, straight through",
    "product of 1 - R over six interfaces",
    1e-5,
)
def _() -> Measured:
    ratios = (1.5, 1.33 / 1.5, 1.33)
    return center_error(spheres((2.0, 1.5), (1.5, 1.33), (1.0, 1.0)), product(*ratios, *ratios), 6)


@THEME.case(
    8,
    "bubble-by-either-description",
    "camera in water looks at an air ball (IOR 1); the same as a ball of IOR 1/1.33 in nothing",
    "the same picture, off edges and off the ring of total reflection",
    1e-5,
)
def _() -> Measured:
    lens = build.camera((0, -2.3, 0), (0, 0, 0), (0, 0, 1), (64, 64), 0.55)
    wall = (build.box((-2.5, -2.5, -2.5), (2.5, 2.5, 2.5)), build.emitter(0.2, 0.3, 0.4))
    lit = (build.box((-0.5, 1.5, -0.2), (1, 2, 0.7)), build.emitter(1, 0.6, 0.2))
    surfaces = (build.glass(1 / 1.33), build.glass(1.0), build.glass(1.33))
    scene = build.make_scene(wall, lit, camera=lens, surfaces=surfaces)
    ball = Sphere("bubble", (0, 0, 0), 1.0, 0)
    sea = Sphere("sea", (0, 0, 0), 4.4, 2)  # its surface lies behind the walls
    dry = replace(sea, visibility=Visibility(camera=False, secondary=False))  # the bounds of the scene are the same
    a = build.shoot(replace(scene, spheres=(ball, dry)), max_depth=3).radiance
    b = build.shoot(replace(scene, spheres=(replace(ball, surface=1), sea)), max_depth=3).radiance
    # On the ring the slope of Fresnel's curve is infinite: not a picture of either would be the same twice.
    x, y = np.meshgrid(*[((np.arange(64) + 0.5) / 64 - 0.5) * 2 * 0.55] * 2)
    off_axis = 2.3 * np.sqrt((x * x + y * y) / (1 + x * x + y * y))
    ring = np.abs(off_axis - 1 / 1.33) < RING
    found = off_edges(np.where(ring[..., None], a, b), a)
    return Measured(found.value, found.detail, np.concatenate([a, b], axis=1))


def slabs(gap: float) -> Scene:
    """Glass on liquid, seen from above; gap > 0 leaves air between, gap < 0 lets the liquid reach into the glass."""
    glass = (build.box((-9, -9, 0), (9, 9, 1)), build.glass(1.5))
    liquid = (build.box((-9, -9, -1), (9, 9, -gap)), build.glass(1.33))
    return build.make_scene(glass, liquid, (build.floor(9, -4), build.emitter()), camera=down())


TOUCHING = (1.5, 1.5 / 1.33, 1.33)


@THEME.case(
    11,
    "liquid-overlaps-glass",
    "liquid that reaches 1e-2, 1e-3, 1e-4 m into the glass that holds it",
    "one interface glass/liquid, whatever the overlap",
    1e-3,
)
def _() -> Measured:
    expected = transmission(*TOUCHING)
    found = [center_error(slabs(-d), expected, DEEP) for d in (1e-2, 1e-3, 1e-4)]
    return max(found, key=lambda m: m.value)


@THEME.case(
    11, "liquid-touches-glass", "liquid whose top coincides with the glass's bottom", "one interface glass/liquid", 1e-3
)
def _() -> Measured:
    return center_error(slabs(0.0), transmission(*TOUCHING), DEEP)


@THEME.case(
    11,
    "liquid-below-glass",
    "an air gap of 1e-2, 1e-3, 1e-4 m between glass and liquid",
    "four interfaces with air, whatever the gap",
    1e-3,
)
def _() -> Measured:
    expected = transmission(1.5, 1.5, 1.33, 1.33)
    found = [center_error(slabs(d), expected, DEEP) for d in (1e-2, 1e-3, 1e-4)]
    return max(found, key=lambda m: m.value)


# ------------------------------------------------------------------------------------------------ camera inside


@THEME.case(
    12,
    "camera-in-glass",
    "camera in the middle of a glass ball, white world",
    "1 - R(1.5) by the direct path; with the residual 1 (no n^2)",
    1e-6,
)
def _() -> Measured:
    lens = build.camera((0, 0, 0), (0, 0, -1), (0, 1, 0), (2, 2), 1e-4)
    scene = build.make_scene(camera=lens, world=build.WHITE_WORLD, surfaces=(build.glass(1.5),))
    film = build.shoot(replace(scene, spheres=(Sphere("ball", (0, 0, 0), 1.0, 0),)), max_depth=1)
    error = max(largest(film.radiance, product(1.5)), largest(film.radiance + film.residual[..., None], 1))
    return Measured(error, "Cycles' convention: radiance is not scaled by n^2 inside")


@THEME.case(
    12,
    "camera-two-deep",
    "camera in a glass ball in a water ball, white world",
    "(1 - R(1.5/1.33)) (1 - R(1.33))",
    1e-6,
)
def _() -> Measured:
    lens = build.camera((0, 0, 0), (0, 0, -1), (0, 1, 0), (2, 2), 1e-4)
    scene = build.make_scene(camera=lens, world=build.WHITE_WORLD, surfaces=(build.glass(1.5), build.glass(1.33)))
    balls = (Sphere("glass", (0, 0, 0), 1.0, 0), Sphere("water", (0, 0, 0), 2.0, 1))
    return center_error(replace(scene, spheres=balls), product(1.5 / 1.33, 1.33), 2)


@THEME.case(
    12,
    "snells-window",
    "camera under water looks up at a white sky",
    "a disk of 48.75 degrees, black outside",
    0.5,
    "pixels of radius",
)
def _() -> Measured:
    size = 96
    lens = build.camera((0, 0, -0.5), (0, 0, 0), (0, 1, 0), (size, size), 1.6)
    scene = build.make_scene(
        (build.box((-50, -50, -9), (50, 50, 0)), build.glass(1.33)), camera=lens, world=build.WHITE_WORLD
    )
    film = build.shoot(scene, max_depth=1)
    got = float(np.sqrt(np.count_nonzero(film.radiance[..., 0] > 0) / np.pi))
    expected = np.tan(np.arcsin(1 / 1.33)) / 1.6 * size / 2
    return Measured(abs(got - expected), f"{got:.2f} px, expected {expected:.2f} px", film.radiance)


# ------------------------------------------------------------------------------------------------ parts, crossings


def many_balls(count: int, joined: bool) -> Scene:
    """Balls of glass in one another over a glowing floor, as parts of one mesh or as so many objects."""
    places = np.random.default_rng(count).uniform(-0.3, 0.3, (count, 3))
    balls = [build.icosphere(2, 0.8 - 0.01 * k) for k in range(count)]
    placed = [replace(b, vertices=(b.vertices + p).astype(np.float32)) for b, p in zip(balls, places, strict=True)]
    if joined:
        triangles = np.concatenate([b.triangles + k * len(b.vertices) for k, b in enumerate(placed)])
        placed = [build.mesh(np.concatenate([b.vertices for b in placed]), triangles)]
    lens = build.camera((0, -5, 1.5), (0, 0, 0), (0, 0, 1), (32, 24), 0.3)
    floor = (build.floor(9, -1.5), build.emitter(0.7, 0.2, 0.1))
    return build.make_scene(*[(b, build.glass(1.45)) for b in placed], floor, camera=lens)


@THEME.case(
    11,
    "glass-through-itself",
    "2, 4, 8, 20 balls of glass in one another, in one mesh and apart",
    "the same picture, and no medium lost",
    0.02,
    "share of pixels",
)
def _() -> Measured:
    worst, rays = 0.0, []
    for count in (2, 4, 8, 20):
        one, apart = (build.shoot(many_balls(count, joined), max_depth=8, cutoff=1 / 255) for joined in (True, False))
        worst = max(worst, float((np.abs(one.radiance - apart.radiance).max(axis=2) > 0.05).mean()))
        rays.append(str(one.rays["refracted"]))
    return Measured(worst, "refracted rays in one mesh: " + ", ".join(rays))


@THEME.case(
    11,
    "solids-cross-at-a-hair",
    "water in glass, their front faces tilted against one another by 0, 1e-7 .. 1e-2",
    "no medium lost; the picture stays",
    1e-3,
    "mean radiance",
)
def _() -> Measured:
    worst, touching = 0.0, None
    lens = build.camera((0, -6, 3), (0, 0, 0), (0, 0, 1), (48, 36), 0.36)
    for tilt in (0.0, 1e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 1e-3, 1e-2):
        water = build.box((-0.8, -1, -0.8), (0.8, 1, 0.8))
        corners = water.vertices.astype(np.float64)
        front = corners[:, 1] < 0
        corners[front, 1] -= tilt * corners[front, 0] / 0.8
        water = replace(water, vertices=corners.astype(np.float32))
        parts = (build.box(), build.glass(1.5)), (water, build.glass(1.33))
        floor = (build.floor(6, -1.5), build.emitter(0.7, 0.2, 0.1))
        film = build.shoot(build.make_scene(*parts, floor, camera=lens), max_depth=12, cutoff=1 / 255)
        touching = film if touching is None else touching
        worst = max(worst, float(np.abs(film.radiance - touching.radiance).mean()))
    return Measured(worst)


@THEME.case(
    11,
    "open-part-and-rounded-seams",
    "a ball that absorbs, each triangle on its own, corners 1e-7 and 1e-6 apart, with an open sheet in its mesh",
    "exp(-2 absorption) through its middle",
    5e-3,
)
def _() -> Measured:
    ball, sheet = build.icosphere(4), build.floor(0.3, -1.5)
    sigma = np.array((0.6, 0.2, 0.4))
    green = replace(build.glass(1.0001), absorption=tuple(sigma.tolist()))
    lens = build.camera((0, 0, 5), (0, 0, 0), (0, 1, 0), (9, 9), 0.05)
    worst = 0.0
    for noise in (0.0, 1e-7, 1e-6):
        points = ball.vertices[ball.triangles].reshape(-1, 3).astype(np.float64)
        points += noise * np.random.default_rng(1).uniform(-1, 1, points.shape)
        triangles = np.concatenate([np.arange(len(points)).reshape(-1, 3), sheet.triangles + len(points)])
        mesh = build.mesh(np.concatenate([points, sheet.vertices]), triangles)
        film = build.shoot(build.make_scene((mesh, green), camera=lens, world=build.WHITE_WORLD), max_depth=4)
        worst = max(worst, largest(film.radiance[4, 4], np.exp(-2 * sigma)))
    return Measured(worst)
