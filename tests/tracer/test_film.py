import numpy as np
import pytest

from hybrid_addon.tracer.film import fill_from_neighbours, film_positions, gaussian_disk


def edge_response(samples, position, seed=0, pixels=64):
    """Mean share of the samples of pixels (i, j) left of x = i + 0.5 + position, over many pixels."""
    x = np.arange(pixels * pixels) % pixels
    y = np.arange(pixels * pixels) // pixels
    px, _ = film_positions(x, y, 0, samples, seed, 1.5)
    return (px - np.repeat(x + 0.5, samples) < position).mean()


@pytest.mark.parametrize(("pixel", "expected"), [(-1, 0.0295), (0, 0.6815), (1, 0.998)])
def test_an_edge_looks_as_eevees_film_shows_it(pixel, expected):
    # EEVEE's Gaussian at three neighbouring pixels across an edge 0.2 px off the middle one's centre: EEVEE.md's row.
    assert edge_response(256, pixel * 1.0 + 0.2) == pytest.approx(expected, abs=2e-3)


def test_the_filter_ends_at_its_radius_and_has_the_right_width():
    u, v = (g.ravel() for g in np.meshgrid((np.arange(400) + 0.5) / 400, (np.arange(400) + 0.5) / 400))
    x, y = gaussian_disk(u, v, 1.5)
    r2 = x * x + y * y
    assert r2.max() <= 1.5**2
    a, sigma2 = 0.5 / 0.284**2, (1.5 * 0.284) ** 2
    truncated = 2 * sigma2 * (1 - a * np.exp(-a) / (1 - np.exp(-a)))
    assert r2.mean() == pytest.approx(truncated, rel=1e-3)


def test_positions_depend_on_the_pixel_and_the_seed_alone():
    x, y = np.array([3, 70000, 5]), np.array([4, 9, 6])
    px, py = film_positions(x, y, 0, 8, 7, 1.5)
    qx, qy = film_positions(x[1:2], y[1:2], 0, 8, 7, 1.5)
    np.testing.assert_array_equal(px[8:16], qx)
    np.testing.assert_array_equal(py[8:16], qy)
    assert not np.array_equal(film_positions(x, y, 0, 8, 8, 1.5)[0], px)
    assert not np.allclose(px[:8] - 3, px[16:] - 5)


def test_later_samples_go_on_where_the_first_ones_ended():
    x, y = np.array([3]), np.array([4])
    whole, _ = film_positions(x, y, 0, 12, 0, 1.5)
    later, _ = film_positions(x, y, 8, 4, 0, 1.5)
    np.testing.assert_array_equal(whole[8:], later)


def test_the_error_at_edges_falls_with_slope_three_quarters():
    rng = np.random.default_rng(0)
    x, y = np.arange(2000), np.zeros(2000, int)
    angle, shift = rng.uniform(0, 2 * np.pi, 2000), rng.uniform(-0.6, 0.6, 2000)

    def share(n, seed):
        px, py = film_positions(x, y, 0, n, seed, 1.5)
        dx, dy = (px - np.repeat(x + 0.5, n)).reshape(-1, n), (py - 0.5).reshape(-1, n)
        return (dx * np.cos(angle)[:, None] + dy * np.sin(angle)[:, None] < shift[:, None]).mean(1)

    truth = share(1 << 13, 99)
    counts = np.array([4, 16, 64, 256])
    rmse = [np.sqrt(((share(n, 1) - truth) ** 2).mean()) for n in counts]
    slope = np.polyfit(np.log(counts), np.log(rmse), 1)[0]
    assert -0.9 < slope < -0.65


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


def test_nothing_to_fill_from_leaves_black():
    radiance = np.zeros((2, 2, 3), np.float32)
    assert fill_from_neighbours((radiance,), np.zeros((2, 2), bool), np.ones((2, 2), bool)) == 0
