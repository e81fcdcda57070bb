# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics by photons: `Film.caustic`, in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import AreaLight, Lens, PointLight, Settings, Sphere, SunLight
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.catcher.caustics import footprint
from hybrid_addon.tracer.shading.scattering import fresnel_dielectric

SETTINGS = Settings(samples=1, raster_shadows=True, caustics="PHOTONS", photons=1 << 17, threads=1, shadow_samples=0)
LAMP = PointLight("lamp", (6, 0, 6), (100, 100, 100))
SIZE = 64


@pytest.fixture(scope="module")
def floor(build):
    return (build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]), build.matte(), {"ray_traced": False})


def places(reach):
    """World x, y of the pixel centres, on z = 0."""
    steps = ((np.arange(SIZE) + 0.5) / SIZE * 2 - 1) * reach
    return np.meshgrid(steps, steps)


def scene_of(build, floor, *parts, reach=6.0, projection="PERSP", **other):
    half = reach / 20 if projection == "PERSP" else reach
    camera = build.camera(eye=(0, 0, 20), size=(SIZE, SIZE), half=half, projection=projection)
    return build.scene(floor, *parts, camera=camera, **other)


@pytest.mark.parametrize("projection", ["PERSP", "ORTHO"])
@pytest.mark.parametrize(
    "light",
    [
        LAMP,
        replace(LAMP, range=14),
        replace(LAMP, radius=0.2),
        AreaLight("area", (6, 0, 6), (-0.7071, 0, -0.7071), (0, 0.2, 0), (0.1414, 0, -0.1414), (900, 900, 900)),
        SunLight("sun", (0.7071, 0, 0.7071), (3, 3, 3), angle=0.02),
    ],
)
def test_a_pane_passes_its_transmittance(build, floor, light, projection):
    """As light that bends: the shadow is black, the photons bring what straight shadow rays would."""
    pane = (build.box((1, -2, 3), (3, 2, 3.01)), build.glass(1.5))
    film = trace(scene_of(build, floor, pane, lights=(light,), projection=projection), SETTINGS)
    bare = scene_of(build, floor, lights=(light,), projection=projection)
    unshadowed = trace(bare, replace(SETTINGS, camera_sees="ALL", raster_shadows=False)).radiance * np.pi / 0.8
    x, y = places(6.0)
    one = np.ones_like(x)
    way = np.array([one, 0 * one, one] if light.name == "sun" else [6 - x, -y, 6 * one])
    cosine = way[2] / np.sqrt((way**2).sum(axis=0))
    through = np.array([x, y]) + way[:2] / way[2] * 3
    inside = (1.5 < through[0]) & (through[0] < 2.5) & (np.abs(through[1]) < 1.5) & (x < 0.8)
    assert np.count_nonzero(inside) > 50
    assert (film.shadow[inside] == 0).all()
    passed = (film.caustic[inside] / unshadowed[inside])[:, 0]
    expected = ((1 - fresnel_dielectric(cosine, np.full_like(x, 1.5))) ** 2)[inside]
    assert (passed / expected).mean() == pytest.approx(1, abs=0.015)
    assert (passed / expected).std() < 0.05


def test_a_mirror_sends_light_as_from_a_light_behind_it(build, floor):
    mirror = (build.quad([(3, -2, 1), (3, 2, 1), (3, 2, 3), (3, -2, 3)]), build.mirror(0.5))
    lamp = PointLight("lamp", (1, 0, 4), (50, 50, 50))
    film = trace(scene_of(build, floor, mirror, lights=(lamp,)), SETTINGS)
    x, y = places(6.0)
    way = np.array([5 - x, -y, np.full_like(x, 4)])  # the lamp's image is at x = 5
    d2 = (way**2).sum(axis=0)
    expected = 0.5 * 50 * 4 / d2**1.5
    height = (3 - x) / way[0] * 4  # at which the light left the mirror
    side = y + (3 - x) / way[0] * way[1]
    inside = (x < 2.8) & (1.4 < height) & (height < 2.6) & (np.abs(side) < 1.5)
    assert np.count_nonzero(inside) > 50
    ratio = film.caustic[inside][:, 0] / expected[inside]
    assert ratio.mean() == pytest.approx(1, abs=0.02)


def test_a_ball_focuses_the_sun_at_its_focal_length(build, floor):
    """f = n r / 2 (n - 1) from its middle, for rays near the axis: there the spot is brightest."""
    sun = SunLight("sun", (0, 0.6, 0.8), (1, 1, 1))
    peaks = {}
    for distance in (1.2, 1.5, 1.9):
        ball = Sphere("ball", (0, 0.6 * distance, 0.8 * distance), 1.0, 1, ray_traced=True)
        scene = scene_of(build, floor, spheres=(ball,), surfaces=(floor[1], build.glass(1.5)), lights=(sun,))
        camera = build.camera(eye=(0, -8, 6), target=(0, 0, 0), up=(0, 0, 1), size=(SIZE, SIZE), half=0.02)
        film = trace(replace(scene, camera=camera), SETTINGS)
        peaks[distance] = film.caustic[..., 0].max()
        if distance == 1.5:
            row, column = np.unravel_index(film.caustic[..., 0].argmax(), film.caustic.shape[:2])
            assert abs(row - SIZE / 2) < 5 and abs(column - SIZE / 2) < 5
    assert peaks[1.5] > 20
    assert peaks[1.5] > 2 * peaks[1.9]
    assert peaks[1.5] > 2 * peaks[1.2]


def test_power_is_kept(build, floor):
    """Light that a ball refracts twice, or mirrors downwards at its rim, reaches the floor, all of it in sight."""
    sun = SunLight("sun", (0, 0, 1), (2, 2, 2))
    ball = Sphere("ball", (0, 0, 1.2), 1.0, 1, ray_traced=True)
    ball = replace(ball, visibility=replace(ball.visibility, camera=False))
    surfaces = (floor[1], build.glass(1.5))
    scene = scene_of(build, floor, spheres=(ball,), surfaces=surfaces, lights=(sun,), reach=3.0, projection="ORTHO")
    landed = trace(scene, SETTINGS).caustic[..., 0].sum() * (6.0 / SIZE) ** 2
    rho = np.sqrt((np.arange(20000) + 0.5) / 20000)  # impact parameters, even over the disk
    f = fresnel_dielectric(np.sqrt(1 - rho * rho), np.full(20000, 1.5))
    downwards = ((1 - f) ** 2 + f * (rho > 0.5**0.5)).mean() * 2 * np.pi
    assert landed == pytest.approx(downwards, rel=0.01)
    below = build.camera(eye=(0, 0, -20), up=(0, 1, 0), size=(SIZE, SIZE), half=3.0, projection="ORTHO")
    assert trace(replace(scene, camera=below), SETTINGS).caustic.max() == 0  # the lit side is not in sight


def test_other_objects_shade_photons(build, floor):
    roof = (build.quad([(-9, -9, 5), (9, -9, 5), (9, 9, 5), (-9, 9, 5)]), build.matte((1, 0, 0)), {"ray_traced": False})
    ball = (build.icosphere(), build.glass(), {"matrix": build.translation(0, 0, 2)})
    camera = build.camera(eye=(0, -12, 2), target=(0, 0, 1), up=(0, 0, 1), size=(32, 32))
    film = trace(replace(scene_of(build, floor, roof, ball, lights=(LAMP,)), camera=camera), SETTINGS)
    assert (film.caustic == 0).all()


def test_straight_ways_bring_no_photons(build, floor):
    """What does not bend light is in the traced shadow, and nowhere else."""
    ball = (
        build.icosphere(),
        build.glass(1.0, transmission_tint=(0.5, 0.5, 0.5)),
        {"matrix": build.translation(2, 0, 2)},
    )
    film = trace(scene_of(build, floor, ball, lights=(LAMP,)), SETTINGS)
    assert (film.caustic == 0).all()
    np.testing.assert_allclose(film.shadow.min(), 0.25, rtol=1e-5)


def test_threads_change_no_bit(build, floor):
    ball = (build.icosphere(3, smooth=True), build.glass(), {"matrix": build.translation(2, 0, 2)})
    scene = scene_of(build, floor, ball, lights=(LAMP, SunLight("sun", (0, 0.6, 0.8), (3, 3, 3))))
    one, other = (trace(scene, replace(SETTINGS, threads=n)).caustic for n in (1, 3))
    np.testing.assert_array_equal(one, other)
    assert one.max() > 1


def test_the_traced_half_is_the_same_with_photons(build, floor):
    ball = (build.icosphere(), build.glass(), {"matrix": build.translation(1, 0, 2)})
    scene = scene_of(build, floor, ball, lights=(LAMP,))
    film, plain = trace(scene, SETTINGS), trace(scene, replace(SETTINGS, raster_shadows=False))
    np.testing.assert_array_equal(film.radiance, plain.radiance)
    assert plain.caustic is None
    mask = np.ones((SIZE, SIZE), np.float32)
    mask[:, :32] = 0
    halves = trace(scene, SETTINGS, mask).caustic
    assert (halves[:, 32:] == 0).all()
    assert halves.max() > 0


@pytest.mark.parametrize("projection", ["PERSP", "ORTHO"])
def test_a_lens_blurs_caustics_as_it_blurs_the_raster(build, floor, projection):
    """A small bright spot becomes a disk of the lens's circle of confusion; the light stays."""
    sun, lens = SunLight("sun", (0, 0, 1), (1, 1, 1)), Lens(radius=0.5, focus_distance=40.0)
    ball = Sphere("ball", (0, 0, 0.3), 0.2, 1, ray_traced=True)
    ball = replace(ball, visibility=replace(ball.visibility, camera=False))
    surfaces = (floor[1], build.glass(1.5))
    scene = scene_of(build, floor, spheres=(ball,), surfaces=surfaces, lights=(sun,), reach=1.0, projection=projection)
    sharp = trace(scene, SETTINGS).caustic[..., 0]
    blurred = trace(replace(scene, camera=replace(scene.camera, lens=lens)), SETTINGS).caustic[..., 0]
    assert blurred.sum() == pytest.approx(sharp.sum(), rel=0.05)
    x, y = places(1.0)
    width = np.sqrt((blurred * (x * x + y * y)).sum() / blurred.sum())
    before = np.sqrt((sharp * (x * x + y * y)).sum() / sharp.sum())
    confusion = 0.5 * (1 - 20 / 40)  # radius on the floor, halfway to the plane of focus
    assert np.sqrt(width**2 - before**2) == pytest.approx(confusion / 2**0.5, rel=0.08)


LEFT, RIGHT, PANE = range(3)


def through_a_pane(build, lamp):
    """What photons bring to both halves of a floor behind a pane, and, of the same size, y."""
    left, right = (
        (build.quad([(-9, y, 0), (9, y, 0), (9, y + 9, 0), (-9, y + 9, 0)]), build.matte(), {"ray_traced": False})
        for y in (-9, 0)
    )
    pane = (build.box((1, -2, 3), (3, 2, 3.01)), build.glass(1.5))
    return trace(scene_of(build, left, right, pane, lights=(lamp,)), SETTINGS).caustic, places(6.0)[1]


def test_photons_light_what_their_light_is_linked_to_and_nothing_else(build):
    everything, y = through_a_pane(build, LAMP)
    linked, _ = through_a_pane(build, replace(LAMP, receivers=frozenset({LEFT})))
    left, right = y < -2, y > 2  # the picture is smooth: a little is spread over the edge
    assert min(everything[left].mean(), everything[right].mean()) > 0.02
    assert linked[right].mean() < 0.01 * everything[right].mean()
    np.testing.assert_allclose(linked[left].mean(), everything[left].mean(), rtol=0.01)


def test_photons_are_bent_by_what_blocks_their_light_and_nothing_else(build):
    everything, _ = through_a_pane(build, LAMP)
    pane, _ = through_a_pane(build, replace(LAMP, blockers=frozenset({PANE})))
    np.testing.assert_array_equal(pane, everything)
    assert not through_a_pane(build, replace(LAMP, blockers=frozenset({LEFT})))[0].any()


@pytest.mark.parametrize("projection", ["PERSP", "ORTHO"])
def test_a_pixels_footprint_is_the_area_between_its_corners(build, projection):
    """On a tilted plane, far off the axis of a wide camera: by the cross product of the corners' places."""
    camera = build.camera((0, 0, 5), size=(200, 200), half=4.0, projection=projection)
    normal, step = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0]), 8.0 / 200
    eye = np.array([0, 0, 5.0])
    for x, y in ((0, 0), (100, 40), (199, 199), (3, 150)):
        corners = np.array([(x + dx, y + dy) for dx, dy in ((0, 0), (1, 0), (0, 1), (0.5, 0.5))]) * step - 4.0
        if projection == "PERSP":
            way = np.column_stack([corners, np.full(4, -1.0)])
            place = eye + way * (-(eye @ normal) / (way @ normal))[:, None]
        else:
            start = np.column_stack([corners, np.full(4, 5.0)])
            place = start - (start @ normal / normal[2])[:, None] * [0, 0, 1]
        area = np.linalg.norm(np.cross(place[1] - place[0], place[2] - place[0]))
        to_eye = eye - place[3] if projection == "PERSP" else np.array([0, 0, 5 - place[3][2]])
        distance = np.linalg.norm(to_eye)
        found = footprint(
            camera, np.array([5 - place[3][2]]), np.array([distance]), np.array([to_eye @ normal / distance])
        )
        assert found[0] == pytest.approx(area, rel=0.04), (x, y)
