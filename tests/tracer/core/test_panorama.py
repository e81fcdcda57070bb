# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Lens, Panorama, Settings, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.camera import NOTHING, generate_rays, project
from hybrid_addon.tracer.core.panorama import MAPPINGS, directions, places

STEREOGRAPHIC = (0.0, -5.79e-2, 0.0, 9.48e-5, -7.67e-6)


@pytest.mark.parametrize("kind", MAPPINGS)
def test_places_lead_to_their_directions_and_back(kind):
    panorama = Panorama(kind, longitude=(-2.0, 2.5), latitude=(-1.0, 1.4), field_of_view=4.0, polynomial=STEREOGRAPHIC)
    u, v = np.random.default_rng(5).uniform(0, 1, (2, 500))
    found = directions(panorama, u, v)
    shown = np.isfinite(found[0])
    assert shown.mean() > 0.5
    np.testing.assert_allclose((found[:, shown] ** 2).sum(axis=0), 1, atol=1e-12)
    np.testing.assert_allclose(places(panorama, found[:, shown]), [u[shown], v[shown]], atol=1e-9)


def test_what_a_panorama_does_not_show_has_no_place():
    assert np.isnan(places(Panorama("EQUIANGULAR_CUBEMAP_FACE"), np.array([[0.0], [0.0], [1.0]]))[0]).all()
    behind = np.array([[0.1], [0.0], [0.995]])
    assert np.isnan(places(Panorama("FISHEYE_EQUIDISTANT", field_of_view=3.0), behind)[0]).all()


def test_an_equidistant_fisheye_spaces_angles_evenly():
    panorama = Panorama("FISHEYE_EQUIDISTANT", field_of_view=np.radians(220))
    found = directions(panorama, np.linspace(0.5, 1, 12), np.full(12, 0.5))
    angle = np.degrees(np.arctan2(found[0], -found[2]))
    np.testing.assert_allclose(angle, np.linspace(0, 110, 12), atol=1e-9)


def test_pixels_of_an_equirectangular_panorama_share_the_sphere_by_the_cosine_of_their_latitude():
    """The area that a small square of the frame covers, by differences, against its closed form."""
    panorama, step = Panorama("EQUIRECTANGULAR"), 1e-5
    u, v = np.random.default_rng(6).uniform(0.01, 0.99, (2, 200))
    across = (directions(panorama, u + step, v) - directions(panorama, u - step, v)) / (2 * step)
    upward = (directions(panorama, u, v + step) - directions(panorama, u, v - step)) / (2 * step)
    area = np.linalg.norm(np.cross(across, upward, axis=0), axis=0)
    np.testing.assert_allclose(area, 2 * np.pi * np.pi * np.cos((v - 0.5) * np.pi), rtol=1e-6)


def camera_of(build, kind, size=(16, 16), **other):
    camera = build.camera((0.5, -2.0, 0.25), (0, 0, 0), (0, 0, 1), size)
    return replace(camera, projection="PANO", view_plane=(0.0, 1.0, 0.0, 1.0), panorama=Panorama(kind), **other)


def test_clip_planes_are_spheres_and_the_frame_shifts(build):
    camera = camera_of(build, "EQUIRECTANGULAR", (64, 32), clip_start=0.5, clip_end=3.0)
    x, y = np.random.default_rng(7).uniform(0, 32, (2, 100))
    eye = camera.matrix_world[:3, 3]
    origin, direction, t_max = generate_rays(camera, x, y, np.zeros(3), np.inf)
    start, end = origin - eye[:, None], origin + t_max * direction - eye[:, None]
    np.testing.assert_allclose(np.linalg.norm(start, axis=0), 0.5, rtol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(end, axis=0), 3.0, rtol=1e-5)
    found_x, found_y, distance = project(camera, (origin + direction).astype(float))
    np.testing.assert_allclose([found_x, found_y, distance], [x, y, np.full(100, 1.5)], atol=1e-4)
    shifted = replace(camera, view_plane=(0.25, 1.25, 0.125, 1.125))
    _, other, _ = generate_rays(shifted, x - 16, y - 4, np.zeros(3), np.inf)
    np.testing.assert_allclose(other, direction, atol=1e-6)


def test_rays_from_everywhere_on_the_lens_meet_where_it_is_sharp(build):
    camera = camera_of(build, "EQUIRECTANGULAR", lens=Lens(radius=0.1, focus_distance=2.5))
    n = 50
    x, y = np.full(n, 11.3), np.full(n, 4.7)
    on_lens = tuple(np.random.default_rng(8).uniform(-0.1, 0.1, (2, n)))
    eye = camera.matrix_world[:3, 3]
    _, straight, _ = generate_rays(camera, x, y, np.zeros(3), np.inf)
    sharp = eye[:, None] + 2.5 * straight
    origin, direction, _ = generate_rays(camera, x, y, np.zeros(3), np.inf, on_lens)
    off = np.linalg.norm(np.cross(sharp - origin, direction, axis=0), axis=0)
    assert np.ptp(origin, axis=1).max() > 0.1
    np.testing.assert_allclose(off, 0, atol=1e-6)


@pytest.mark.parametrize("transparent", [False, True])
def test_beside_a_fisheyes_circle_it_is_black_and_see_through_if_the_film_is(build, transparent):
    camera = camera_of(build, "FISHEYE_EQUIDISTANT")
    scene = replace(build.scene(camera=camera), world=World(np.ones(3, np.float32)))
    settings = Settings(samples=4, filter_radius=0.0, camera_sees="ALL", transparent=transparent)
    film = trace(scene, settings)
    np.testing.assert_array_equal(film.coverage[[0, 8], [0, 8]], 0 if transparent else 1)
    if not transparent:
        np.testing.assert_array_equal(film.radiance[[0, 8], [0, 8]], [[0, 0, 0], [1, 1, 1]])
    x, y = np.array([0.5, 8.5]), np.array([0.5, 8.5])
    assert (generate_rays(camera, x, y, np.zeros(3), 1.0)[2] == NOTHING).tolist() == [True, False]
