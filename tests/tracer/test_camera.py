from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.tracer.camera import generate_rays


def project(camera, points):
    """Film positions (n, 2) of world points (n, 3): the inverse of the camera, worked out apart."""
    local = (np.linalg.inv(camera.matrix_world) @ np.c_[points, np.ones(len(points))].T)[:3]
    on_plane = local[:2] / -local[2] if camera.projection == "PERSP" else local[:2]
    left, right, bottom, top = camera.view_plane
    width, height = camera.resolution
    return np.stack(
        [(on_plane[0] - left) / (right - left) * width, (on_plane[1] - bottom) / (top - bottom) * height], 1
    )


@pytest.mark.parametrize("projection", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("view_plane", [(-0.5, 0.5, -0.3, 0.3), (4.5, 5.5, -10.3, -9.7), (-1e-3, 1e-3, -6e-4, 6e-4)])
def test_rays_go_through_their_own_film_position(build, projection, view_plane):
    cam = build.camera((3, -7, 2), (0.1, 0.2, 0.3), (0, 0, 1), (200, 120))
    cam = replace(cam, projection=projection, view_plane=view_plane)
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0, 200, 500), rng.uniform(0, 120, 500)
    center = np.array([0.5, 0.25, 0.125])
    origin, direction, _ = generate_rays(cam, x, y, center, 2.0)
    points = (origin + 3.0 * direction.astype(float)).T + center
    # A float32 direction is good to 2^-24 of a radian; far off the axis a radian is more of the film.
    pixel = (view_plane[1] - view_plane[0]) / 200
    tolerance = max(1e-4, 2**-23 * (1 + np.square(view_plane).max()) / pixel)
    np.testing.assert_allclose(project(cam, points), np.stack([x, y], 1), atol=tolerance)


@pytest.mark.parametrize("projection", ["PERSP", "ORTHO"])
def test_clip_planes_are_planes(build, projection):
    cam = build.camera((0, 0, 5), clip_start=2.0, clip_end=4.0)
    cam = replace(cam, projection=projection)
    x, y = np.array([0.5, 8.0, 15.5]), np.array([0.5, 8.0, 3.5])
    origin, direction, t_max = generate_rays(cam, x, y, np.zeros(3), np.inf)
    np.testing.assert_allclose(origin[2], 3, atol=1e-6)
    np.testing.assert_allclose((origin + t_max * direction)[2], 1, atol=1e-6)


def test_rays_start_at_the_scene_and_not_before_it(build):
    cam = build.camera((0, 0, 1000))
    origin, _, t_max = generate_rays(cam, np.array([8.0]), np.array([8.0]), np.zeros(3), 3.0)
    assert origin[2, 0] == pytest.approx(3)
    assert t_max[0] == pytest.approx(1e6 - 997)


def test_directions_are_unit_vectors(build):
    cam = build.camera((0, 0, 5), half=100.0)
    _, direction, _ = generate_rays(cam, np.linspace(0, 16, 50), np.linspace(0, 16, 50), np.zeros(3), 1.0)
    np.testing.assert_allclose((direction.astype(float) ** 2).sum(0), 1, atol=3e-7)
