# SPDX-License-Identifier: GPL-3.0-or-later
from types import SimpleNamespace

import numpy as np
import pytest

from hybrid_addon import compositor


@pytest.fixture
def rng():
    return np.random.default_rng(1)


def picture(rng, h=5, w=7):
    alpha = rng.random((h, w, 1), np.float32)
    return np.concatenate([rng.random((h, w, 3), np.float32) * alpha, alpha], axis=2)


def test_premultiplied_alpha_is_the_mask(rng):
    radiance, mask = rng.random((5, 7, 3), np.float32), rng.random((5, 7), np.float32)
    traced = compositor.premultiply(radiance, mask)
    assert traced.dtype == np.float32
    np.testing.assert_array_equal(traced[..., 3], mask)
    np.testing.assert_array_equal(traced[..., :3], radiance * mask[..., None])


def test_nothing_bleeds_where_the_mask_is_zero():
    radiance = np.full((2, 2, 3), np.inf, np.float32)
    traced = compositor.premultiply(radiance, np.zeros((2, 2), np.float32))
    np.testing.assert_array_equal(traced, 0)


def test_complementary_layers_of_one_colour_add_up_to_it(rng):
    mask, color = rng.random((5, 7), np.float32), np.float32([0.25, 0.5, 2.0])
    raster = np.concatenate([color * (1 - mask[..., None]), 1 - mask[..., None]], axis=2)
    result = raster + compositor.premultiply(np.broadcast_to(color, (5, 7, 3)), mask)
    np.testing.assert_allclose(result, np.broadcast_to([*color, 1], (5, 7, 4)), atol=3e-7)


def test_what_shows_through_the_holdout_is_taken_away(rng):
    """Where the mask is 1 the sum is the traced layer, whatever EEVEE left there; elsewhere nothing changes."""
    raster, mask = picture(rng), np.float32([[0, 0.5, 1, 1, 1, 0.999, 0]] * 5)
    raster[:, 3, :3] = 0
    traced = compositor.premultiply(rng.random((5, 7, 3), np.float32), mask)
    layer = compositor.black_out(traced, raster, mask)
    np.testing.assert_allclose((raster + layer)[mask == 1][:, :3], traced[mask == 1][:, :3], atol=1e-7)
    np.testing.assert_array_equal(layer[mask != 1], traced[mask != 1])
    np.testing.assert_array_equal(layer[:, 3], traced[:, 3])


def test_mask_of_an_opaque_film_is_one_minus_alpha():
    np.testing.assert_array_equal(compositor.mask_from_alpha(np.float32([[0, 0.25, 1]])), [[1, 0.75, 0]])


def test_mask_of_a_transparent_film_is_what_the_holdout_took_away():
    mask_layer, user_layer = np.float32([[0, 0.25, 0.5, 0]]), np.float32([[1, 1, 0.25, 0]])
    # The third pixel: noise made the holdout's alpha the larger one; the fourth: sky, which is no object.
    np.testing.assert_array_equal(compositor.mask_from_alpha(mask_layer, user_layer), [[1, 0.75, 0, 0]])


def test_a_mask_beyond_one_is_clipped():
    np.testing.assert_array_equal(compositor.mask_from_alpha(np.float32([[-0.01, 1.01]])), [[1, 0]])


def test_pictures_of_different_sizes_are_refused():
    with pytest.raises(ValueError, match="differ in size"):
        compositor.premultiply(np.zeros((2, 3, 3), np.float32), np.zeros((3, 2), np.float32))


# ------------------------------------------------------------------------------------------------ seen straight through


def seen_through(c, through, by_eevee, *, own=(0.4, 0.1, 0.2), behind=(0.2, 0.6, 0.9)):
    """One pixel: coverage c, throughput (3,) of a surface of radiance `own`, of which EEVEE lets `by_eevee` through."""
    through, behind = np.array(through, np.float32), np.array(behind, np.float32)
    mask = np.full((1, 1), c * (1 - by_eevee), np.float32)
    raster = np.append((1 - mask[0, 0]) * behind, 1 - mask[0, 0]).astype(np.float32).reshape(1, 1, 4)
    background = through * behind
    film = SimpleNamespace(
        coverage=np.full((1, 1), c, np.float32),
        radiance=(np.array(own) + background).astype(np.float32).reshape(1, 1, 3),
        passes={"passed": through.reshape(1, 1, 3), "background": background.reshape(1, 1, 3)},
    )
    traced = compositor.premultiply(film.radiance, mask)
    layer, rest, cover = compositor.see_through(traced, raster, mask, film)
    expected = c * np.array(own) + (1 - c) * behind + c * background
    return layer, raster, rest, cover, expected


@pytest.mark.parametrize("c", [1.0, 0.25])
@pytest.mark.parametrize("by_eevee", [0.0, 0.3, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("through", [(0.5, 0.5, 0.5), (1, 1, 1), (0.8, 0.2, 0.0)])
def test_the_background_is_there_once_whatever_eevee_lets_through(c, by_eevee, through):
    layer, raster, _rest, cover, expected = seen_through(c, through, by_eevee)
    assert (layer + raster)[0, 0, :3] == pytest.approx(expected, abs=1e-6)
    assert (layer + raster)[0, 0, 3] == pytest.approx(1)
    assert cover[0, 0] == pytest.approx(c)


def test_where_eevee_lets_through_as_much_its_own_pixels_stay():
    layer, raster, rest, _cover, _expected = seen_through(1.0, (0.5, 0.5, 0.5), 0.5)
    assert rest == pytest.approx(raster)
    assert layer[0, 0, :3] == pytest.approx((0.4, 0.1, 0.2), abs=1e-6)  # no background of the tracer's


def test_what_nothing_is_seen_through_stays_bit_by_bit():
    layer, raster, rest, cover, _expected = seen_through(0.5, (0, 0, 0), 0.0)
    assert rest is raster and cover[0, 0] == 0.5
    assert (layer[0, 0, :3] == np.float32(0.5) * np.array((0.4, 0.1, 0.2), np.float32)).all()
