# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Lens, Settings
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.camera import generate_rays, points_on_lens, polygon
from hybrid_addon.tracer.core.sampler import Sampler, disk, pixel_keys


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


# ------------------------------------------------------------------------------------------------ depth of field

N = 1024


def lens_points(lens):
    return points_on_lens(lens, Sampler(pixel_keys(np.zeros(1, int), np.zeros(1, int), 0), 0, N), np.arange(N))


def through_lens(camera):
    """Rays of one film position through all of the lens, as functions of the depth: film positions (N, 2)."""
    x, y = np.full(N, 40.0), np.full(N, 70.0)
    origin, direction, _ = generate_rays(camera, x, y, np.zeros(3), np.inf, lens_points(camera.lens))
    origin, direction = origin.astype(float), direction.astype(float)
    axis, eye = camera.matrix_world[:3, 2], camera.matrix_world[:3, 3]

    def at(depth):
        t = (-depth - axis @ (origin - eye[:, None])) / (axis @ direction)
        return project(camera, (origin + t * direction).T)

    return at


@pytest.mark.parametrize("projection", ["PERSP", "ORTHO"])
def test_the_circle_of_confusion_has_the_radius_of_a_thin_lens(build, projection):
    radius, focus = 0.05, 4.0
    cam = build.camera((3, -7, 2), (0.1, 0.2, 0.3), (0, 0, 1), (200, 120), lens=Lens(radius, focus))
    cam = replace(cam, projection=projection)
    at = through_lens(cam)
    np.testing.assert_allclose(at(focus), np.broadcast_to([40, 70], (N, 2)), atol=2e-4)
    pixels = 120 / (cam.view_plane[3] - cam.view_plane[2])
    for depth in (1.0, 3.0, 6.0, 50.0):
        # Similar triangles: at a depth the cone is as wide as its distance from the focus; then seen from there.
        expected = radius * abs(depth - focus) / focus * pixels / (depth if projection == "PERSP" else 1)
        off = np.linalg.norm(at(depth) - [40, 70], axis=1)
        assert off.max() == pytest.approx(expected, rel=0.01)
        assert (off**2).mean() == pytest.approx(expected**2 / 2, rel=0.01)  # of an evenly filled disk


@pytest.mark.parametrize("blades", [3, 5, 8])
def test_blades_make_a_regular_polygon_evenly_filled(blades):
    x, y = lens_points(Lens(2.0, 1.0, blades, rotation=0.4))
    edge = 0.4 + 2 * np.pi / blades * np.arange(blades)[:, None]
    outward = np.cos(edge) * x + np.sin(edge) * y
    np.testing.assert_allclose(outward.max(axis=1), 2 * np.cos(np.pi / blades), rtol=0.02)
    assert (x * x + y * y).mean() == pytest.approx(4 * (2 + np.cos(2 * np.pi / blades)) / 6, rel=0.01)
    assert np.hypot(x.mean(), y.mean()) < 0.02


def test_many_blades_are_a_disk_and_the_ratio_narrows_it():
    u, v = np.random.default_rng(1).random((2, 4096), np.float32)
    for x, y in (disk(u, v), polygon(u, v, 500)):
        assert np.histogram(x * x + y * y, 8, (0, 1))[0].std() < 40
    x, y = lens_points(Lens(1.0, 1.0, ratio=4.0))
    assert np.abs(x).max() == pytest.approx(0.25, rel=0.01)
    assert np.abs(y).max() == pytest.approx(1.0, rel=0.01)


def test_a_glowing_disk_out_of_focus_keeps_its_light_and_blurs(build):
    """Far from edges of the frame a blur takes nothing away; a lens in focus everywhere changes nothing."""
    card = build.quad([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)])
    cam = build.camera((0, 0, 5), size=(32, 32))
    s = build.scene((card, build.emitter(1, 1, 1)), camera=cam)
    settings = Settings(samples=64, camera_sees="ALL", threads=1)
    sharp = trace(s, settings)
    blurred = trace(replace(s, camera=replace(cam, lens=Lens(0.5, 2.5))), settings)
    focused = trace(replace(s, camera=replace(cam, lens=Lens(0.5, 5.0))), settings)
    assert blurred.radiance.sum() == pytest.approx(float(sharp.radiance.sum()), rel=0.02)
    assert np.abs(focused.radiance - sharp.radiance).max() < 0.08
    # 0.5 m at 2.5 m of 5: a circle of 0.1 tangents, 3.2 pixels; along the middle row the card is 6.4 wide.
    row = blurred.radiance[16, :, 0]
    assert row[9] < 0.01 < row[11]
    assert row[16] > 0.8


def test_blur_does_not_depend_on_chunks_or_threads_and_adaptive_sampling_sees_it(build):
    ball = build.icosphere(3, 1, smooth=True)
    cam = build.camera((0, 0, 5), size=(24, 24), lens=Lens(0.4, 3.0, 6))
    s = build.scene((ball, build.emitter(1, 0.5, 0.2)), (build.box((-9, -9, -3), (9, 9, -2)), build.emitter(0, 0, 1)))
    s = replace(s, camera=cam)
    settings = Settings(samples=32, camera_sees="ALL", threads=1)
    film = trace(s, settings)
    other = trace(s, replace(settings, threads=3, chunk=777))
    np.testing.assert_array_equal(film.radiance, other.radiance)
    adaptive = trace(s, replace(settings, adaptive=0.05))
    assert adaptive.rays["camera"] < 0.9 * film.rays["camera"]
    edge = (film.radiance[..., 0] > 0.05) & (film.radiance[..., 0] < 0.95)
    assert edge.mean() > 0.1
    assert np.abs(adaptive.radiance - film.radiance)[edge].mean() < 0.005
