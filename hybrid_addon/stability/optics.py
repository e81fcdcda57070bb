"""Closed forms of geometrical optics: mirrors, plates, prisms, retroreflectors, a glass ball."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..scene import (
    Camera,
    Float64,
    Instance,
    Plane,
    PointLight,
    Scene,
    Sphere,
    SunLight,
    Surface,
    TriangleMesh,
    Visibility,
)
from . import build
from .case import Measured, Theme
from .compare import largest, off_edges
from .fresnel import normal_reflectance

THEME = Theme("Closed forms of optics")
TARGETS = (4.0, 12.0)
"""Distances in metres at which a screen catches an outgoing ray; the difference of two places gives its direction."""

SEEN, UNSEEN = Visibility(camera=False, shadow=False), Visibility(camera=False, secondary=False)


def outgoing(scene: Scene, start: Float64, expected: Float64, max_depth: int) -> Float64:
    """Direction of the ray that the 1 x 1 pixel camera of `scene` sends out, as an error (2,) in radians.

    start, expected : a point near which the ray leaves, and its expected unit direction. Two screens with a colour
    ramp, sunlit in a black world, say in floating point where the ray meets them.
    """
    side = np.cross(expected, (0.31, 0.87, 0.38))
    side /= np.sqrt((side * side).sum())
    up = np.cross(side, expected)
    corners = [a * side + b * up for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    screen = build.quad(corners, "screen", uv_maps={"": build.RAMP_UVS})
    paper = Surface(base_color_texture=build.ramp(), ambient=0.0)
    sun = SunLight("sun", tuple(-expected), (np.pi,) * 3, cast_shadow=False)
    base = replace(scene, meshes=(*scene.meshes, screen), surfaces=(*scene.surfaces, paper), lights=(sun,))
    mesh, surface = len(scene.meshes), (len(scene.surfaces),)
    found = []
    for distance in TARGETS:
        # All screens, and one opposite, stand there every time: only then is the scene's centre always the same.
        screens = tuple(
            Instance(
                "screen",
                mesh,
                build.translation(*(start + d * expected)),
                surface,
                visibility=SEEN if d == distance else UNSEEN,
            )
            for d in (*TARGETS, -TARGETS[-1])
        )
        whole = replace(base, instances=(*scene.instances, *screens))
        red, green, blue = build.shoot(whole, allow=("lost_media",), max_depth=max_depth).radiance[0, 0]
        if not blue > 0:
            raise ValueError(f"the ray does not meet the screen at {distance:g} m")
        found.append(2 * np.array([float(red) / float(blue), float(green) / float(blue)]) - 1)
    return np.asarray((found[1] - found[0]) / (TARGETS[1] - TARGETS[0]))


def one_ray(eye: Float64, direction: Float64) -> Camera:
    """A camera of one pixel whose ray goes from `eye` along `direction`."""
    up = (0, 1, 0) if abs(direction[1]) < 0.9 else (1, 0, 0)
    lens = build.camera(eye, eye + direction, up, (1, 1), 1e-6)
    return replace(lens, projection="ORTHO", clip_start=0.0)


def unit(*v: float) -> Float64:
    """The unit vector along v."""
    a = np.array(v, np.float64)
    return np.asarray(a / np.sqrt((a * a).sum()))


# ------------------------------------------------------------------------------------------------ mirrors


@THEME.case(
    15,
    "hall-of-mirrors",
    "inside a glowing mirror box, r = .5, .9, .99, depth 0, 1, 5, 30",
    "E (1 - r^(D+1)) / (1 - r), residual r^(D+1)",
    1e-6,
    "relative",
)
def _() -> Measured:
    worst = 0.0
    for r in (0.5, 0.9, 0.99):
        for depth in (0, 1, 5, 30):
            glow = Surface(base_color=(0, 0, 0), emission=(0.1, 0.2, 0.3), reflectivity=r)
            lens = build.camera((0.1, 0.2, 0.3), (1, 0.5, 0.4), size=(12, 12))
            film = build.shoot(build.make_scene((build.box(), glow), camera=lens), max_depth=depth)
            series = np.array([0.1, 0.2, 0.3]) * (1 - r ** (depth + 1)) / (1 - r)
            worst = max(worst, largest(film.radiance / series, 1))
    return Measured(worst, "12 halls of 144 pixels")


@THEME.case(
    15,
    "hall-of-mirrors-to-the-end",
    "r = .5, .9, .99 as deep as a tail below 1e-3 needs: 11, 88, 1146",
    "radiance + residual L_max = E / (1 - r)",
    1e-5,
    "relative",
)
def _() -> Measured:
    worst, tail = 0.0, 0.0
    for r, depth in ((0.5, 11), (0.9, 88), (0.99, 1146)):
        glow = Surface(base_color=(0, 0, 0), emission=(1, 1, 1), reflectivity=r)
        lens = build.camera((0.1, 0.2, 0.3), (1, 0.5, 0.4), size=(4, 4))
        film = build.shoot(build.make_scene((build.box(), glow), camera=lens), max_depth=depth)
        limit = 1 / (1 - r)
        worst = max(worst, largest(film.radiance[..., 0] / limit + film.residual, 1))
        tail = max(tail, float(film.residual.max()))
    return Measured(worst, f"largest tail {tail:.1e}")


@THEME.case(17, "corner-cube", "three mirrors at right angles, turned at random", "out = -in", 1e-6, "rad")
def _() -> Measured:
    turn = build.rotation(17)
    sheets: list[TriangleMesh] = [
        build.quad([(0, 0, 0), (9, 0, 0), (9, 9, 0), (0, 9, 0)]),
        build.quad([(0, 0, 0), (0, 9, 0), (0, 9, 9), (0, 0, 9)]),
        build.quad([(0, 0, 0), (0, 0, 9), (9, 0, 9), (9, 0, 0)]),
    ]
    silver, worst = build.mirror(), 0.0
    for into in (unit(-1, -1, -1), unit(-1, -0.8, -1.1), unit(-0.9, -1.2, -0.7)):
        hit = np.array([1.0, 1.2, 0.9])
        ray = turn[:3, :3] @ into
        lens = one_ray(turn[:3, :3] @ hit - 5 * ray, ray)
        scene = build.make_scene(*[(q, silver, {"matrix_world": turn}) for q in sheets], camera=lens)
        worst = max(worst, largest(outgoing(scene, -turn[:3, :3] @ hit, -ray, 3), 0))
    return Measured(worst, "three rays")


@THEME.case(17, "periscope", "two parallel mirrors at 45 degrees, turned at random", "out = in", 1e-6, "rad")
def _() -> Measured:
    turn = build.rotation(18)
    tilted = build.translation(0, 0, 0)
    c = np.sqrt(0.5)
    tilted[:3, :3] = np.array([[c, 0, -c], [0, 1, 0], [c, 0, c]])
    raised = tilted.copy()
    raised[2, 3] = 2.0
    silver, plate = build.mirror(), build.floor(0.5)
    ray = turn[:3, :3] @ np.array([1.0, 0.0, 0.0])
    lens = one_ray(turn[:3, :3] @ np.array([-3.0, 0.1, 0.05]), ray)
    parts = [(plate, silver, {"matrix_world": turn @ m}) for m in (tilted, raised)]
    scene = build.make_scene(*parts, camera=lens)
    return Measured(largest(outgoing(scene, turn[:3, :3] @ np.array([0.0, 0.1, 2.0]), ray, 2), 0))


@THEME.case(
    17,
    "mirror-image",
    "a planar mirror with a lit scene in front of it",
    "the scene mirrored, seen directly, off edges",
    2e-6,
)
def _() -> Measured:
    things = [
        (build.box((-2.5, -0.9, -0.8), (-1.6, -0.2, 0.3)), build.matte((0.9, 0.3, 0.1)), np.eye(4)),
        (build.icosphere(3, 0.5), build.matte((0.1, 0.4, 0.9)), build.translation(-1.5, 0.6, 0.4)),
        (build.quad([(-9, -2, -1), (0, -2, -1), (0, 2, -1), (-9, 2, -1)]), build.emitter(0.2, 0.3, 0.1), np.eye(4)),
    ]
    lamp = PointLight("lamp", (-1, -1.2, 1.5), (6, 5, 4))
    lens = build.camera((-4, 0, 0.2), (0, 0, 0), (0, 0, 1), (64, 64), 0.4)
    unseen = Visibility(camera=False)
    silver = build.quad([(0, -9, -9), (0, -9, 9), (0, 9, 9), (0, 9, -9)], "mirror")  # in x = 0, facing -x
    hidden = [(m, s, {"matrix_world": at, "visibility": unseen}) for m, s, at in things]
    shown = build.shoot(build.make_scene((silver, build.mirror()), *hidden, camera=lens, lights=(lamp,)), max_depth=1)
    flip = build.scaling(-1, 1, 1)
    mirrored = [(m, s, {"matrix_world": flip @ at}) for m, s, at in things]
    other = replace(lamp, position=(1, -1.2, 1.5))
    direct = build.shoot(build.make_scene(*mirrored, camera=lens, lights=(other,)))
    found = off_edges(shown.radiance, direct.radiance)
    return Measured(found.value, found.detail, shown.radiance)


# ------------------------------------------------------------------------------------------------ glass


@THEME.case(
    16,
    "plate-at-normal-incidence",
    "a plane-parallel plate, n = 1.5",
    "R = 2 R1 / (1 + R1) = .0769231, T = 1 - R",
    1e-6,
)
def _() -> Measured:
    lens = replace(build.camera(size=(8, 8)), projection="ORTHO")
    plate = (build.box((-9, -9, -0.1), (9, 9, 0.1)), build.glass(1.5))
    lit = build.emitter()
    up = build.shoot(build.make_scene(plate, (build.ceiling(9, 9), lit), camera=lens), max_depth=16).radiance
    down = build.shoot(build.make_scene(plate, (build.floor(9, -9), lit), camera=lens), max_depth=16).radiance
    r1 = normal_reflectance(1.5)
    r = 2 * r1 / (1 + r1)
    return Measured(max(largest(up, r), largest(down, 1 - r)), f"R = {up[0, 0, 0]:.7f}, T = {down[0, 0, 0]:.7f}")


@THEME.case(
    16,
    "plate-cut-short",
    "the plate after 0, 1, 2 internal pairs of bounces",
    "missing: R1^(2(k+1)) (1-R1)^2 / (1-R1^2) = 1.5e-3, 2.4e-6, 3.8e-9",
    2e-7,
)
def _() -> Measured:
    lens = replace(build.camera(size=(4, 4)), projection="ORTHO")
    scene = build.make_scene(
        (build.box((-9, -9, -0.1), (9, 9, 0.1)), build.glass(1.5)), (build.floor(9, -9), build.emitter()), camera=lens
    )
    r1 = normal_reflectance(1.5)
    full, worst, seen = (1 - r1) / (1 + r1), 0.0, []
    for k in (0, 1, 2):
        got = build.shoot(scene, max_depth=2 + 2 * k).radiance[0, 0, 0]
        missing = r1 ** (2 * (k + 1)) * (1 - r1) ** 2 / (1 - r1**2)
        worst = max(worst, abs(full - missing - float(got)))
        seen.append(f"{full - float(got):.1e}")
    return Measured(worst, "missing: " + ", ".join(seen))


@THEME.case(
    16,
    "plate-shifts-sideways",
    "a plate of 0.8 m at 50 degrees, n = 1.5",
    "shift t sin i (1 - cos i / sqrt(n^2 - sin^2 i)), direction unchanged",
    2e-6,
    "m",
)
def _() -> Measured:
    angle, n, thick = np.radians(50), 1.5, 0.8
    shift = thick * np.sin(angle) * (1 - np.cos(angle) / np.sqrt(n * n - np.sin(angle) ** 2))
    ray, across = unit(-np.sin(angle), 0, -np.cos(angle)), unit(-np.cos(angle), 0, np.sin(angle))
    lens = replace(build.camera(-6 * ray, (0, 0, 0), (0, 1, 0), (1, 1), 1e-6), projection="ORTHO")
    center, half = 1.5 * ray, 0.5
    corners = [center + half * (a * across + b * np.array([0, 1, 0])) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    paper = Surface(base_color_texture=build.ramp(), ambient=0.0)
    screen = (build.quad(corners, uv_maps={"": build.RAMP_UVS}), paper)
    sun = SunLight("sun", tuple(-ray), (np.pi,) * 3, cast_shadow=False)
    plate = (build.box((-1, -1, -0.4), (1, 1, 0.4)), build.glass(n))

    def place(*parts: object) -> float:
        r, _, b = build.shoot(build.make_scene(screen, *parts, camera=lens, lights=(sun,)), max_depth=2).radiance[0, 0]
        return half * (2 * float(r) / float(b) - 1)

    got = abs(place(plate) - place())
    return Measured(abs(got - shift), f"{got:.7f} m, expected {shift:.7f} m")


@THEME.case(
    17,
    "prism",
    "a 60 degree prism, n = 1.5, at minimum deviation",
    "deviation 2 asin(n sin 30) - 60 = 37.18 deg",
    1e-6,
    "rad",
)
def _() -> Measured:
    n, h = 1.5, np.sqrt(3) / 2
    deviation = 2 * np.arcsin(n * 0.5) - np.radians(60)
    outline = [(-0.5, -h / 2), (0.5, -h / 2), (0.0, h / 2)]
    corners = [(x, y, z) for y in (-5, 5) for x, z in outline]
    sides = [(0, 1, 2), (5, 4, 3), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (2, 3, 0)]
    turn = build.rotation(19)
    into = turn[:3, :3] @ np.array([np.cos(deviation / 2), 0, np.sin(deviation / 2)])
    out = turn[:3, :3] @ np.array([np.cos(deviation / 2), 0, -np.sin(deviation / 2)])
    entry = turn[:3, :3] @ np.array([-0.25, 0.1, 0.0])
    prism = (build.mesh(corners, sides), build.glass(n), {"matrix_world": turn})
    scene = build.make_scene(prism, camera=one_ray(entry - 3 * into, into))
    return Measured(largest(outgoing(scene, turn[:3, :3] @ np.array([0.25, 0.1, 0.0]), out, 2), 0))


@THEME.case(
    18,
    "glass-ball",
    "rays at .1, .5, .9 of the radius of an analytic glass ball",
    "deviation 2 (asin b - asin(b / n))",
    3e-6,
    "rad",
)
def _() -> Measured:
    worst, n = 0.0, 1.5
    for b in (0.1, 0.5, 0.9):
        i, t = np.arcsin(b), np.arcsin(b / n)
        turned = 2 * (i - t)
        out = np.array([np.cos(turned), 0, -np.sin(turned)])
        scene = build.make_scene(camera=one_ray(np.array([-3.0, 0, b]), unit(1, 0, 0)), surfaces=(build.glass(n),))
        scene = replace(scene, spheres=(Sphere("ball", (0, 0, 0), 1.0, 0),))
        exit_angle = np.pi - i - (np.pi - 2 * t)  # where the ray leaves, seen from the centre
        start = np.array([np.cos(exit_angle), 0, np.sin(exit_angle)])
        worst = max(worst, largest(outgoing(scene, start, out, 2), 0))
    return Measured(worst, "an offset of 5 ulp at the surface turns the ray at .9 by 1.7e-6 rad")


@THEME.case(
    18,
    "mesh-of-a-ball-converges",
    "smooth shaded icospheres against the analytic sphere",
    "error of second order in the edge",
    0.2,
    "|slope - 2|",
)
def _() -> Measured:
    lamp = PointLight("lamp", (2, -3, 4), (30, 30, 30))
    lens = build.camera((0, -4, 0), (0, 0, 0), (0, 0, 1), (64, 64), 0.2)
    scene = build.make_scene(camera=lens, lights=(lamp,), surfaces=(build.matte(),))
    exact = build.shoot(replace(scene, spheres=(Sphere("ball", (0, 0, 0), 1.0, 0),))).radiance
    lit = exact > 0.1 * exact.max()  # away from the terminator, where facets shadow each other
    errors = []
    for levels in (3, 4, 5):
        ball = replace(scene, meshes=(build.icosphere(levels, 1, True),))
        ball = replace(ball, instances=(Instance("ball", 0, np.eye(4), (0,)),))
        errors.append(float(np.sqrt(((build.shoot(ball).radiance - exact)[lit] ** 2).mean())))
    slope = float(np.log2(errors[0] / errors[2]) / 2)
    return Measured(abs(slope - 2), f"slope {slope:.2f}; errors " + ", ".join(f"{e:.1e}" for e in errors))


@THEME.case(18, "analytic-plane-is-a-big-quad", "a lit box on either of them", "the same picture, off edges", 2e-6)
def _() -> Measured:
    lamp = PointLight("lamp", (1, 1, 2), (9, 9, 9))
    thing = (build.box((-0.5, -0.5, 0), (0.5, 0.5, 0.7)), build.matte((0.2, 0.5, 0.3)))
    quads = build.make_scene(thing, (build.floor(50), build.matte()), lights=(lamp,))
    plane = build.make_scene(thing, lights=(lamp,))
    plane = replace(plane, surfaces=(*plane.surfaces, build.matte()), planes=(Plane("floor", (3, 1, 0), (0, 0, 7), 1),))
    return off_edges(build.shoot(quads).radiance, build.shoot(plane).radiance)
