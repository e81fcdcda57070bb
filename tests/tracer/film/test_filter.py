# SPDX-License-Identifier: GPL-3.0-or-later
"""The pixel filter in closed form, who shares samples with whom, and gaps."""

from dataclasses import replace
from math import erf, sqrt

import numpy as np
import pytest

from hybrid_addon.scene import PointLight, Settings
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.film.filter import Grid, PixelFilter, fill_from_neighbours


def response(pixel_filter, samples, inside):
    """Filtered mean in pixel (0, 0) of what `inside` (x, y) tells of places; x and y from that pixel's centre."""
    x, y = pixel_filter.places(0, samples)
    weights = pixel_filter.weights(0, samples).astype(float)
    # What pixel (-dx, -dy) gives over the offset (dx, dy) comes from places that far away.
    values = [inside(x - dx, y - dy) for dx, dy in pixel_filter.offsets]
    return (weights * values).sum() / weights.sum()


@pytest.mark.parametrize(("pixel", "expected"), [(-1, 0.0295), (0, 0.6815), (1, 0.998)])
def test_an_edge_looks_as_eevees_film_shows_it(pixel, expected):
    # EEVEE's Gaussian at three neighbouring pixels across an edge 0.2 px off the middle one's centre: EEVEE.md's row.
    share = response(PixelFilter(1.5, 0), 4096, lambda x, y: x < pixel * 1.0 + 0.2)
    assert share == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("radius", [0.3, 0.8, 1.5, 3.0])
def test_the_filter_has_the_right_width(radius):
    """Variance of the truncated Gaussian in closed form; its corners, cut off in one's own pixel, are left in."""
    pixel_filter = PixelFilter(radius, 3)
    a, sigma2 = 0.5 / 0.284**2, (radius * 0.284) ** 2
    truncated = 2 * sigma2 * (1 - a * np.exp(-a) / (1 - np.exp(-a)))
    assert response(pixel_filter, 4096, lambda x, y: x * x + y * y) == pytest.approx(truncated, rel=2e-2)


def test_the_share_of_each_pixel_around_is_the_gaussians():
    """Over one's own pixel and a neighbour: a product of error functions, but for what the radius cuts off."""
    shares = dict(zip(PixelFilter(1.5, 0).offsets, PixelFilter(1.5, 0).shares(), strict=True))
    sigma = 1.5 * 0.284 * sqrt(2)
    middle, side = erf(0.5 / sigma), (erf(1.5 / sigma) - erf(0.5 / sigma)) / 2
    assert shares[0, 0] == pytest.approx(middle * middle, abs=2e-3)
    assert shares[1, 0] == pytest.approx(middle * side, abs=2e-3)
    assert shares[-1, 1] == pytest.approx(side * side, abs=2e-3)
    assert sum(shares.values()) == pytest.approx(1)


def test_samples_lie_in_their_pixel_and_go_on_where_the_first_ended():
    pixel_filter = PixelFilter(1.5, 0)
    x, y = pixel_filter.places(0, 4096)
    assert max(abs(x).max(), abs(y).max()) <= 0.5
    assert x.mean() == pytest.approx(0, abs=1e-3)
    np.testing.assert_array_equal(pixel_filter.places(8, 4)[0], x[8:12])
    np.testing.assert_array_equal(pixel_filter.weights(8, 4), pixel_filter.weights(0, 12)[:, 8:])
    assert not np.array_equal(PixelFilter(1.5, 1).places(0, 8)[0], x[:8])


@pytest.mark.parametrize("radius", [0.0, 1e-3, 0.5, 0.6])
def test_a_sample_counts_in_its_own_pixel_however_narrow_the_filter(radius):
    pixel_filter = PixelFilter(radius, 0)
    assert (pixel_filter.weights(0, 999)[0] > 0).all()
    assert max(np.abs(pixel_filter.places(0, 999)).max(), 1e-9) <= max(radius, 1e-9) * (1 + 1e-6)


def test_the_error_at_edges_falls_with_slope_three_quarters():
    rng = np.random.default_rng(0)
    angle, shift = rng.uniform(0, 2 * np.pi, 300), rng.uniform(-0.6, 0.6, 300)

    def shares(n, seed):
        pixel_filter = PixelFilter(1.5, seed)
        lines = zip(np.cos(angle), np.sin(angle), shift, strict=True)
        return np.array([response(pixel_filter, n, lambda x, y, c=c, s=s, b=b: x * c + y * s < b) for c, s, b in lines])

    truth = shares(1 << 13, 99)
    counts = np.array([4, 16, 64, 256])
    rmse = [np.sqrt(np.mean([((shares(n, seed) - truth) ** 2).mean() for seed in range(4)])) for n in counts]
    slope = np.polyfit(np.log(counts), np.log(rmse), 1)[0]
    assert -1.1 < slope < -0.7


# ------------------------------------------------------------------------------------------------ who shares


def test_a_grid_holds_what_is_wanted_and_the_ring_around_it():
    wanted = np.zeros((3, 4), bool)
    wanted[0, 0] = wanted[2, 2] = True
    grid = Grid.of((1, 0, 5, 3), (9, 9), wanted, 1)
    x, y = grid.at(np.arange(len(grid)))
    inside = grid.window >= 0
    assert sorted(zip(x[inside], y[inside], strict=True)) == [(1, 0), (3, 2)]
    # Around (1, 0), the frame's lowest row, and above (3, 2).
    outside = sorted(zip(x[~inside], y[~inside], strict=True))
    assert outside == [(0, 0), (0, 1), (2, 3), (3, 3), (4, 3)]
    np.testing.assert_array_equal(grid.window[inside], [0, 2 * 4 + 2])


def test_neighbours_are_those_that_are_traced():
    wanted = np.array([[1, 1, 0], [1, 0, 0], [0, 0, 1]], bool)
    grid = Grid.of((0, 0, 3, 3), (3, 3), wanted, 1)
    everything = np.arange(4)
    np.testing.assert_array_equal(grid.neighbours(everything, (0, 0)), everything)
    np.testing.assert_array_equal(grid.neighbours(everything, (1, 0)), [-1, 0, -1, -1])  # from the left
    np.testing.assert_array_equal(grid.neighbours(everything, (0, 1)), [-1, -1, 0, -1])  # from below
    np.testing.assert_array_equal(grid.neighbours(everything, (-1, 1)), [-1, -1, 1, -1])
    np.testing.assert_array_equal(grid.neighbours(everything, (1, 1)), [-1, -1, -1, -1])


@pytest.fixture(scope="module")
def edges(build):
    """A bright triangle on black: nothing but edges."""
    corners = [(-1.1, -0.9, 0), (1.3, -0.4, 0), (0.1, 1.2, 0)]
    triangle = build.mesh(corners, [(0, 1, 2)])
    return build.scene((triangle, build.emitter(1, 1, 1)), camera=build.camera((0, 0, 4), size=(24, 20)))


@pytest.mark.parametrize("adaptive", [0.0, 0.05])
def test_a_part_of_the_frame_is_the_frame_s_exact(edges, adaptive):
    settings = Settings(samples=16, camera_sees="ALL", adaptive=adaptive)
    whole = trace(edges, settings)
    x0, y0, x1, y1 = window = (5, 3, 17, 20)
    part = trace(replace(edges, camera=replace(edges.camera, window=window)), settings)
    assert whole.radiance[y0:y1, x0:x1].std() > 0.1
    if adaptive == 0:
        np.testing.assert_array_equal(part.radiance, whole.radiance[y0:y1, x0:x1])
    else:  # the audit draws by place, but its share follows from the number of pixels
        np.testing.assert_allclose(part.radiance, whole.radiance[y0:y1, x0:x1], atol=0.02)


def test_few_samples_give_what_many_do_in_a_pixel_alone(edges):
    """The point of sharing: half the samples for the error that each pixel's own would leave."""
    reference = trace(edges, Settings(samples=4096, camera_sees="ALL", seed=7)).radiance.astype(float)
    shared = [trace(edges, Settings(samples=16, camera_sees="ALL", seed=s)).radiance - reference for s in range(6)]
    # Alone: places drawn with the filter's own density, and each counts the same.
    alone = [_alone(edges, 16, s) - reference for s in range(6)]
    assert np.sqrt(np.mean(np.square(shared))) < 0.6 * np.sqrt(np.mean(np.square(alone)))


def _alone(scene, samples, seed):
    """By importance, with random numbers: the mean of one-sample pictures whose pixels' centres are displaced."""
    rng, total = np.random.default_rng(seed), 0.0
    width, height = scene.camera.resolution
    for _ in range(samples):
        r = 1.5 * 0.284 * np.sqrt(-2 * np.log(1 - rng.random() * (1 - np.exp(-0.5 / 0.284**2))))
        angle = rng.random() * 2 * np.pi
        dx, dy = r * np.cos(angle), r * np.sin(angle)
        left, right, bottom, top = scene.camera.view_plane
        right, left = right + (x := dx * (right - left) / width), left + x
        top, bottom = top + (y := dy * (top - bottom) / height), bottom + y
        moved = replace(scene, camera=replace(scene.camera, view_plane=(left, right, bottom, top)))
        total = total + trace(moved, Settings(samples=1, camera_sees="ALL")).radiance.astype(float)
    return total / samples


def test_a_failed_sample_is_pink_in_its_own_pixel_alone(build):
    """A lamp so near to a small spot that its light overflows."""
    spot = [(-0.06, -0.06, 0.99), (0.06, -0.06, 0.99), (0.06, 0.06, 0.99), (-0.06, 0.06, 0.99)]
    s = build.scene(
        (build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]), build.emitter(1, 1, 1)),
        (build.quad(spot), build.matte()),
        lights=(PointLight("p", (0, 0, 1), (3e38, 0, 0)),),
        camera=build.camera((0.25, 0.25, 5), (0.25, 0.25, 0), size=(8, 8)),
    )
    film = trace(s, Settings(samples=64, camera_sees="ALL"))
    pink = (film.radiance == (1, 0, 1)).all(axis=-1)
    assert pink.sum() == film.invariants["nan_pixels"] == 1
    assert np.isfinite(film.radiance).all()


# ------------------------------------------------------------------------------------------------ gaps


def test_gaps_take_the_colour_of_the_nearest_known_pixel():
    radiance = np.zeros((4, 5, 3), np.float32)
    radiance[1, 1], radiance[1, 4] = (1, 0, 0), (0, 1, 0)
    known = np.zeros((4, 5), bool)
    known[1, [1, 4]] = True
    wanted = np.zeros((4, 5), bool)
    wanted[1, :] = wanted[3, 0] = True
    assert fill_from_neighbours((radiance,), known, wanted) == 4
    np.testing.assert_array_equal(radiance[1], [[1, 0, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0]])
    np.testing.assert_array_equal(radiance[3, 0], [1, 0, 0])
    np.testing.assert_array_equal(radiance[0], 0)  # not wanted, not touched


def test_gaps_far_from_all_that_is_known_take_the_nearest_too():
    rng = np.random.default_rng(1)
    number = np.arange(60 * 50, dtype=np.float32).reshape(60, 50)
    known, wanted = rng.random((60, 50)) < 0.002, rng.random((60, 50)) < 0.1
    assert fill_from_neighbours((number,), known, wanted) == np.count_nonzero(wanted & ~known)
    rows, columns = np.nonzero(known)
    for row, column in np.argwhere(wanted):
        away = np.maximum(np.abs(rows - row), np.abs(columns - column))  # a step goes diagonally, too
        source = divmod(int(number[row, column]), 50)
        assert known[source] and max(abs(source[0] - row), abs(source[1] - column)) == away.min()


def test_nothing_to_fill_from_leaves_black():
    radiance = np.zeros((2, 2, 3), np.float32)
    assert fill_from_neighbours((radiance,), np.zeros((2, 2), bool), np.ones((2, 2), bool)) == 0
