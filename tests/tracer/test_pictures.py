# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures with a known answer: closed forms, mirrored scenes, things that must vanish."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import AreaLight, Plane, PointLight, Settings, Sphere, SunLight, Surface, Visibility, World
from hybrid_addon.tracer import trace

WHITE_WORLD = World((1.0, 1.0, 1.0))


def picture(scene, **settings):
    """One unfiltered ray a pixel through everything."""
    film = trace(scene, Settings(**{"samples": 1, "camera_sees": "ALL", "threads": 1, **settings}))
    assert not {k: v for k, v in film.invariants.items() if v}, film.invariants
    return film


def floor(b, size=4.0, z=0.0):
    return b.quad([(-size, -size, z), (size, -size, z), (size, size, z), (-size, size, z)], "floor")


# ------------------------------------------------------------------------------------------------ local light


def test_a_matte_floor_under_a_point_light(build):
    light = PointLight("p", (0, 0, 2), (3, 3, 3))
    s = build.scene((floor(build), build.matte((0.5, 0.25, 0.75))), lights=(light,))
    got = picture(s).radiance
    x, y = np.meshgrid((np.arange(16) + 0.5) / 16 * 5 - 2.5, (np.arange(16) + 0.5) / 16 * 5 - 2.5)
    d2 = x * x + y * y + 4
    expected = np.array([0.5, 0.25, 0.75]) / np.pi * (3 * 2 / d2**1.5)[..., None]
    np.testing.assert_allclose(got, expected, rtol=3e-6)


def test_ambient_light_of_a_uniform_world(build):
    s = build.scene((floor(build), build.matte((0.5, 0.25, 0.75), ambient=0.5)), world=World((0.4, 0.8, 1.2)))
    np.testing.assert_allclose(picture(s).radiance[8, 8], [0.1, 0.1, 0.45], rtol=1e-6)


def test_both_sides_of_a_sheet_are_lit(build):
    lights = (SunLight("sun", (0, 0, 1), (1, 1, 1)),)
    sheet = build.quad([(-4, 4, 0), (4, 4, 0), (4, -4, 0), (-4, -4, 0)])  # seen from its back
    got = picture(build.scene((sheet, build.matte()), lights=lights)).radiance
    np.testing.assert_allclose(got, 0.8 / np.pi, rtol=1e-6)


def test_emission_is_added_whatever_the_rest(build):
    s = build.scene((floor(build), Surface(base_color=(0, 0, 0), emission=(2, 3, 4), reflectivity=0.5)))
    np.testing.assert_allclose(picture(s).radiance, np.broadcast_to([2, 3, 4], (16, 16, 3)))


def test_highlight_peaks_in_the_mirror_direction(build):
    shiny = Surface(base_color=(0, 0, 0), specular=(0.5, 0.5, 0.5), roughness=0.3)
    s = build.scene(
        (floor(build), shiny), camera=build.camera(size=(65, 65)), lights=(PointLight("p", (2, 0, 5), (9, 9, 9)),)
    )
    got = picture(s).radiance[..., 0]
    row, column = np.unravel_index(got.argmax(), got.shape)
    assert row == 32
    assert (column + 0.5) / 65 * 5 - 2.5 == pytest.approx(1.0, abs=0.1)  # half way between camera and light


# ------------------------------------------------------------------------------------------------ shadows


def shadow_scene(build, surface, light, height=1.0):
    """A floor seen from above and, over its right half, a sheet that camera rays do not see."""
    sheet = build.quad([(0, -9, height), (9, -9, height), (9, 9, height), (0, 9, height)], "sheet")
    return build.scene(
        (floor(build), build.matte((1, 1, 1))),
        (sheet, surface, {"visibility": Visibility(camera=False)}),
        lights=(light,),
    )


SUN = SunLight("sun", (0, 0, 1), (np.pi,) * 3)


@pytest.mark.parametrize(
    ("surface", "expected"),
    [
        (Surface(opacity=1.0), (0, 0, 0)),
        (Surface(opacity=0.25, ior=1.0), (0.75, 0.75, 0.75)),
        (Surface(opacity=0.0, ior=1.0), (1, 1, 1)),
        (Surface(opacity=0.0, ior=1.5), (0.96, 0.96, 0.96)),
        (Surface(opacity=0.0, ior=1.0, transmission_tint=(1, 0.5, 0)), (1, 0.5, 0)),
        (Surface(opacity=0.0, ior=1.0, reflectivity=0.5), (0.5, 0.5, 0.5)),
        (Surface(opacity=0.5, reflectivity=1.0), (0, 0, 0)),
    ],
)
def test_shadow_is_tinted_by_what_casts_it(build, surface, expected):
    got = picture(shadow_scene(build, surface, SUN)).radiance
    np.testing.assert_allclose(got[:, :8], 1, rtol=1e-6)
    np.testing.assert_allclose(got[:, 8:], np.broadcast_to(expected, (16, 8, 3)), rtol=1e-6)


def test_two_tinted_sheets_multiply(build):
    red, half = Surface(opacity=0, ior=1.0, transmission_tint=(1, 0.5, 0.5)), Surface(opacity=0.5, ior=1.0)
    s = shadow_scene(build, red, SUN)
    second = build.quad([(0, -9, 2), (9, -9, 2), (9, 9, 2), (0, 9, 2)], "second")
    s = replace(
        s,
        meshes=(*s.meshes, second),
        surfaces=(*s.surfaces, half),
        instances=(*s.instances, replace(s.instances[1], mesh=2, surfaces=(2,))),
    )
    np.testing.assert_allclose(picture(s).radiance[4, 12], [0.5, 0.25, 0.25], rtol=1e-6)


def test_nothing_behind_a_light_casts_a_shadow(build):
    near = PointLight("p", (2, 0, 0.5), (1, 1, 1))
    free = picture(shadow_scene(build, Surface(opacity=0, ior=1.0), near)).radiance
    np.testing.assert_array_equal(picture(shadow_scene(build, Surface(), near)).radiance, free)


def test_a_light_may_cast_no_shadow(build):
    got = picture(shadow_scene(build, Surface(), replace(SUN, cast_shadow=False))).radiance
    np.testing.assert_allclose(got, 1, rtol=1e-6)


@pytest.mark.parametrize("gap", [0.0, 1e-3])
def test_a_light_set_into_a_ceiling_lights_the_floor(build, gap):
    # The shadow ray must end before the ceiling in which, or right before which, the light sits.
    lamp = PointLight("p", (0.3, 0.2, 2 - gap), (3, 3, 3))
    ceiling = build.quad([(-4, -4, 2), (-4, 4, 2), (4, 4, 2), (4, -4, 2)])
    matte, hidden = build.matte(), {"visibility": Visibility(camera=False)}
    alone = build.scene((floor(build), matte), lights=(lamp,))
    roofed = build.scene((floor(build), matte), (ceiling, matte, hidden), lights=(lamp,))
    np.testing.assert_allclose(picture(roofed).radiance, picture(alone).radiance, rtol=2e-6)


def test_no_light_through_the_back_of_a_sheet_with_slanted_normals(build):
    # The shading normals see the sun, the sheet itself does not; nothing else could cast the shadow.
    corners = [(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)]
    sheet = build.quad(corners, normals=np.float32([(0.8, 0, 0.6)] * 4))
    sun = SunLight("sun", (1, 0, -0.1), (1, 1, 1))
    s = build.scene((sheet, build.matte(), {"visibility": Visibility(shadow=False)}), lights=(sun,))
    np.testing.assert_array_equal(picture(s).radiance, 0)
    lit = replace(s, lights=(replace(sun, direction=(1, 0, 0.1)),))
    assert (picture(lit).radiance > 0).all()


def test_an_area_light_is_shadowed_too(build):
    area = AreaLight("a", (2, 0, 3), (0, 0, -1), (0.5, 0, 0), (0, 0.5, 0), (9, 9, 9))
    got = picture(shadow_scene(build, Surface(), area)).radiance
    assert (got[:, 9:] == 0).all() and (got[:, :4] > 0).all()


# ------------------------------------------------------------------------------------------------ mirrors


def clutter(build):
    """Things in the half space x < 0."""
    things = [
        (build.box((-2.5, -0.9, -0.8), (-1.6, -0.2, 0.3)), build.matte((0.9, 0.3, 0.1))),
        (build.icosphere(3, 0.5), build.matte((0.1, 0.4, 0.9)), {"matrix": build.translation(-1.5, 0.6, 0.4)}),
        (build.quad([(-9, -2, -1), (0, -2, -1), (0, 2, -1), (-9, 2, -1)]), build.emitter(0.2, 0.3, 0.1)),
    ]
    lights = (PointLight("p", (-1, -1.2, 1.5), (6, 5, 4)),)
    return things, lights


def test_a_planar_mirror_shows_the_mirrored_scene(build):
    things, lights = clutter(build)
    glass = build.quad([(0, -9, -9), (0, -9, 9), (0, 9, 9), (0, 9, -9)], "mirror")  # in x = 0, facing -x
    cam = build.camera((-4, 0, 0.2), (0, 0, 0), (0, 0, 1), (48, 48), 0.4)
    # Camera rays see the mirror alone; what it shows is the scene seen by secondary rays.
    hidden = [(m, s, {**(o[0] if o else {}), "visibility": Visibility(camera=False)}) for m, s, *o in things]
    reflected = picture(build.scene((glass, build.mirror()), *hidden, camera=cam, lights=lights), max_depth=1)
    flip = np.diag([-1.0, 1, 1, 1])
    mirrored = [(m, s, {"matrix": flip @ (o[0]["matrix"] if o else np.eye(4))}) for m, s, *o in things]
    mirrored_lights = tuple(replace(p, position=(-p.position[0], *p.position[1:])) for p in lights)
    direct = picture(build.scene(*mirrored, camera=cam, lights=mirrored_lights))
    # The one difference: light and shadow pass through the (hidden) mirror's place in neither scene; x > 0 is empty.
    difference = np.abs(reflected.radiance - direct.radiance).max(2)
    assert (difference > 1e-5).mean() < 0.01  # pixels on an edge may flip
    assert direct.radiance.max() > 0.3


@pytest.mark.parametrize("r", [0.5, 0.9, 0.99])
@pytest.mark.parametrize("depth", [0, 1, 5, 30])
def test_hall_of_mirrors_is_a_geometric_series(build, r, depth):
    surface = Surface(base_color=(0, 0, 0), emission=(0.1, 0.2, 0.3), reflectivity=r)
    s = build.scene((build.box(), surface), camera=build.camera((0.1, 0.2, 0.3), (1, 0.5, 0.4)))
    film = picture(s, max_depth=depth)
    series = (1 - r ** (depth + 1)) / (1 - r)
    np.testing.assert_allclose(
        film.radiance, np.broadcast_to(np.array([0.1, 0.2, 0.3]) * series, (16, 16, 3)), rtol=1e-6
    )
    np.testing.assert_allclose(film.residual, r ** (depth + 1), rtol=3e-6)


def test_a_corner_cube_sends_light_back(build):
    # Three mirrors at right angles; far behind the camera one emitting quad, sized to catch exact returns only.
    mirror = build.mirror()
    sheets = [
        build.quad([(0, 0, 0), (9, 0, 0), (9, 9, 0), (0, 9, 0)]),
        build.quad([(0, 0, 0), (0, 9, 0), (0, 9, 9), (0, 0, 9)]),
        build.quad([(0, 0, 0), (0, 0, 9), (9, 0, 9), (9, 0, 0)]),
    ]
    cam = replace(build.camera((5, 5, 5), (1, 1, 1), (0, 0, 1), half=0.2), projection="ORTHO")
    back = np.array([1, 1, 1]) / np.sqrt(3)
    x, y = cam.matrix_world[:3, 0], cam.matrix_world[:3, 1]
    center = back * 3000
    target = build.quad([center + a * x + b * y for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    s = build.scene(*[(q, mirror) for q in sheets], (target, build.emitter(1, 1, 1)), camera=cam)
    film = picture(s, max_depth=3)
    # A return 1 m off at 3 km would be an error of 3e-4 rad.
    np.testing.assert_array_equal(film.radiance, 1)


# ------------------------------------------------------------------------------------------------ glass


def backdrop(build):
    """A wall of coloured stripes behind the origin, and a floor with a light that casts shadows."""
    stripes = [
        (build.quad([(x, 4, -4), (x + 0.5, 4, -4), (x + 0.5, 4, 4), (x, 4, 4)]), build.emitter(x / 8 + 0.5, 0.5, 0.1))
        for x in np.arange(-4, 4, 0.5)
    ]
    return [*stripes, (floor(build, 4, -1.5), build.matte())]


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("transparent", [False, True])
def test_a_sphere_of_ior_one_vanishes_with_its_shadow(build, smooth, transparent):
    things = backdrop(build)
    others = {
        "camera": build.camera((0, -5, 0.5), (0, 0, 0), (0, 0, 1), (48, 48), 0.6),
        "lights": (PointLight("p", (1, -1, 3), (9, 9, 9)),),
        "world": World((0.1, 0.2, 0.3)),
    }
    with_sphere = build.scene(*things, (build.icosphere(3, 1, smooth), build.glass(1.0)), **others)
    a = picture(with_sphere, max_depth=1, transparent=transparent)
    b = picture(build.scene(*things, **others), max_depth=1, transparent=transparent)
    np.testing.assert_allclose(a.radiance, b.radiance, atol=2e-6)
    np.testing.assert_array_equal(a.coverage, b.coverage)
    np.testing.assert_array_equal(a.residual, 0)
    assert a.rays["straight"] > 100


def test_an_invisible_analytic_sphere_vanishes_too(build):
    s = build.scene(*backdrop(build), camera=build.camera((0, -5, 0.5), (0, 0, 0), (0, 0, 1), (48, 48), 0.6))
    ball = replace(
        s, surfaces=(*s.surfaces, build.glass(1.0)), spheres=(Sphere("ball", (0, 0, 0), 1.0, len(s.surfaces)),)
    )
    np.testing.assert_allclose(picture(ball).radiance, picture(s).radiance, atol=2e-6)


def test_plane_parallel_plate_at_normal_incidence(build):
    cam = replace(build.camera(), projection="ORTHO")
    plate = build.box((-9, -9, -0.1), (9, 9, 0.1))
    lit_from_above = build.quad([(-9, -9, 9), (-9, 9, 9), (9, 9, 9), (9, -9, 9)])
    s = build.scene((plate, build.glass(1.5)), (lit_from_above, build.emitter(1, 1, 1)), camera=cam)
    film = picture(s, max_depth=12)
    # Reflected: R = 2 R1 / (1 + R1) = .0769231 with R1 = .04; the world below is black.
    np.testing.assert_allclose(film.radiance[..., 0], 0.0769231, atol=1e-6)
    transmitted = picture(replace(s, world=WHITE_WORLD, instances=s.instances[:1]), max_depth=12)
    np.testing.assert_allclose(transmitted.radiance[..., 0] + transmitted.residual, 1, atol=1e-6)


def test_a_plate_shifts_a_slanted_ray_sideways(build):
    # Shift t sin(i) (1 - cos i / sqrt(n^2 - sin^2 i)), seen by where an edge appears.
    angle, n, t = np.radians(50), 1.5, 0.8
    shift = t * np.sin(angle) * (1 - np.cos(angle) / np.sqrt(n * n - np.sin(angle) ** 2))
    eye = 6 * np.array([np.sin(angle), 0, np.cos(angle)])
    cam = build.camera(eye, (0, 0, 0), (0, 1, 0), (512, 4), 0.004)
    cam = replace(cam, projection="ORTHO", view_plane=(-1.0, 1.0, -0.004, 0.004))
    half = build.quad([(0, -9, -5), (90, -9, -5), (90, 9, -5), (0, 9, -5)])  # its edge at x = 0, z = -5
    plate = build.box((-20, -20, -0.4), (20, 20, 0.4))

    def edge(*things):
        row = picture(build.scene((half, build.emitter(1, 1, 1)), *things, camera=cam), max_depth=2).radiance[2, :, 0]
        return np.flatnonzero((row[1:] > 0.5) != (row[:-1] > 0.5))[0] / 256

    cam = replace(cam, view_plane=(-1.0 - 5 * np.sin(angle), 1.0 - 5 * np.sin(angle), -0.004, 0.004))
    cam = replace(cam, view_plane=(2.8, 4.8, -0.004, 0.004))
    assert abs(edge((plate, build.glass(n))) - edge()) == pytest.approx(shift, abs=2 / 256)


def test_a_prism_deviates_as_the_formula_says(build):
    # Apex angle 60 degrees, n = 1.5; incidence of minimum deviation: i = asin(n sin 30), deviation 2 i - 60.
    apex, n = np.radians(60), 1.5
    i = np.arcsin(n * np.sin(apex / 2))
    h = np.sqrt(3) / 2
    tri = [(-0.5, 0, -h / 2), (0.5, 0, -h / 2), (0, 0, h / 2)]
    v = [(x, -5, z) for x, _, z in tri] + [(x, 5, z) for x, _, z in tri]
    prism = build.mesh(v, [(0, 1, 2), (5, 4, 3), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (2, 3, 0)])
    # The left face's outer normal is (-sin 60, 0, cos 60) = (-.866, 0, .5); the ray comes in rising symmetrically.
    deviation = 2 * i - apex
    d_in = np.array([np.cos(deviation / 2), 0, np.sin(deviation / 2)])
    cam = replace(build.camera(-3 * d_in, (0, 0, 0), (0, 1, 0), (2, 2), 1e-3), projection="ORTHO")
    d_out = np.array([np.cos(deviation / 2), 0, -np.sin(deviation / 2)])
    far = 1e4 * d_out
    side, width = np.cross(d_out, (0, 1, 0)), 1.0
    target = build.quad(
        [far + width * (a * side + b * np.array([0, 1, 0])) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    )
    film = picture(build.scene((prism, build.glass(n)), (target, build.emitter(1, 1, 1)), camera=cam), max_depth=2)
    assert (film.radiance > 0.8).all()  # within 1 m at 10 km: 1e-4 rad


@pytest.mark.parametrize("ior", [1 / 1.5, 1.0003, 1.5, 2.42])
@pytest.mark.parametrize("shape", ["flat", "smooth", "box", "sphere"])
def test_white_furnace(build, ior, shape):
    surface = build.glass(ior, reflectivity=0.25)
    s = build.scene(world=WHITE_WORLD, camera=build.camera((0.3, -0.4, 3), size=(24, 24)), surfaces=(surface,))
    if shape == "sphere":
        s = replace(s, spheres=(Sphere("ball", (0, 0, 0), 1.0, 0),))
    else:
        mesh = build.box() if shape == "box" else build.icosphere(2, 1, shape == "smooth")
        s = replace(s, meshes=(mesh,), instances=(build.instance(0),))
    film = picture(s, max_depth=6)
    np.testing.assert_allclose(film.radiance + film.residual[..., None], 1, atol=1e-6)
    assert film.residual.max() > 0


# ------------------------------------------------------------------------------------------------ analytic shapes


def test_an_analytic_sphere_is_the_limit_of_meshes(build):
    lights, surface = (PointLight("p", (2, -3, 4), (30, 30, 30)),), build.matte()
    cam = build.camera((0, -4, 0), up=(0, 0, 1), size=(32, 32), half=0.2)
    s = build.scene(camera=cam, lights=lights, surfaces=(surface,))
    exact = picture(replace(s, spheres=(Sphere("ball", (0, 0, 0), 1.0, 0),))).radiance
    errors = []
    for levels in (2, 3, 4):
        mesh = build.icosphere(levels, 1, smooth=True)
        got = picture(replace(s, meshes=(mesh,), instances=(build.instance(0),))).radiance
        lit = exact > 0.1  # away from the terminator, where facets shadow each other
        errors.append(np.sqrt(((got - exact)[lit] ** 2).mean()))
    assert errors[2] < 1e-3 * exact.max()
    assert np.log2(errors[0] / errors[2]) / 2 > 1.8  # at least second order in the edge length


def test_an_analytic_plane_is_a_big_quad(build):
    lights = (PointLight("p", (1, 1, 2), (9, 9, 9)),)
    box = (build.box((-0.5, -0.5, 0), (0.5, 0.5, 0.7)), build.matte((0.2, 0.5, 0.3)))
    quad = build.scene(box, (floor(build, 50), build.matte()), lights=lights)
    plane = build.scene(box, lights=lights)
    plane = replace(plane, surfaces=(*plane.surfaces, build.matte()), planes=(Plane("floor", (3, 1, 0), (0, 0, 7), 1),))
    a, b = picture(quad).radiance, picture(plane).radiance
    assert (np.abs(a - b).max(2) > 2e-6).mean() < 0.01


def test_plane_and_sphere_cast_shadows(build):
    s = build.scene((floor(build), build.matte((1, 1, 1))), lights=(SUN,))
    lit = picture(s).radiance
    under_plane = replace(s, surfaces=(*s.surfaces, Surface()), planes=(Plane("roof", (0, 0, 7), (0, 0, 1), 1),))
    np.testing.assert_array_equal(picture(under_plane).radiance, 0)
    under_ball = replace(s, surfaces=(*s.surfaces, Surface()), spheres=(Sphere("ball", (0, 0, 8), 1.0, 1),))
    shadow = (picture(under_ball).radiance[..., 0] == 0) & (lit[..., 0] > 0)
    assert shadow.sum() * (5 / 16) ** 2 == pytest.approx(np.pi, rel=0.15)


def test_glass_balls_of_mesh_and_formula_agree(build):
    cam = build.camera((0, -5, 0.5), (0, 0, 0), (0, 0, 1), (32, 32), 0.3)
    s = build.scene(*backdrop(build), camera=cam, surfaces=(build.glass(1.5),))
    ball = picture(replace(s, spheres=(Sphere("ball", (0, 0, 0), 1.0, 0),))).radiance
    mesh = build.icosphere(5, 1, smooth=True)
    meshed = replace(s, meshes=(*s.meshes, mesh), instances=(*s.instances, build.instance(len(s.meshes))))
    difference = np.abs(picture(meshed).radiance - ball).max(2)
    assert np.median(difference) < 2e-3 and (difference > 0.05).mean() < 0.2
