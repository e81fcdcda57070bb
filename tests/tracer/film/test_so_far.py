# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture is shown while it grows, and in the end is the one that nobody looked at."""

from __future__ import annotations

import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest

from hybrid_addon.scene import Settings, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.film.picture import ResolvedImage
from hybrid_addon.tracer.film.so_far import AT_ONCE, fill_coarse, so_far
from hybrid_addon.tracer.prepare import footprint
from hybrid_addon.tracer.sampling import tiles


@pytest.mark.parametrize("adaptive", [0.0, 0.05])
def test_a_picture_that_is_looked_at_has_the_same_bits(build, monkeypatch, adaptive):
    scene = build.scene(
        (build.box(), build.glass()), camera=build.camera((2, 1, 4), size=(40, 30)), world=World((0.2, 0.4, 0.8))
    )
    settings = Settings(samples=16, adaptive=adaptive, max_depth=6, threads=1, camera_sees="ALL")
    alone = trace(scene, settings)
    monkeypatch.setattr(tiles, "WORTH_GROWING", 0.0)
    shown, small = [], []
    film = trace(scene, settings, show=lambda made: (shown.append(made()), small.append(made(2))))
    for name in ("radiance", "coverage", "residual"):
        np.testing.assert_array_equal(getattr(film, name), getattr(alone, name))
    assert {key: film.sampling[key] for key in ("samples_mean", "samples_max")} == {
        key: alone.sampling[key] for key in ("samples_mean", "samples_max")
    }
    # From a coarse raster to all samples: nearer to the picture each time that there is more.
    far = [float(np.abs(picture - film.radiance).mean()) for picture in shown]
    apart = [distance for distance, last in zip(far, [None, *far], strict=False) if distance != last]
    assert len(apart) >= 3 and apart[0] > 4 * apart[1] > 6 * apart[-1] > 0
    means = shown[-1].reshape(15, 2, 20, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(small[-1], means, rtol=1e-5, atol=1e-6)  # of all pixels in a block


def test_a_large_picture_takes_little_memory_to_look_at():
    image = ResolvedImage.zeros(1600 * 1200, False, (), False, np.zeros)
    grid = SimpleNamespace(window=np.arange(1600 * 400))
    pixel_buffer = SimpleNamespace(grid=grid, given=np.ones((1, 8, 1600 * 400), np.float32))
    for step, most in ((1, 1600 * 1200), (3, 534 * 400)):
        tracemalloc.start()
        so_far(image, pixel_buffer, (1200, 1600), step)
        taken = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert taken < most * footprint.LOOKED_AT[1] + AT_ONCE * 120


def test_what_is_not_known_is_taken_from_the_square_around_it():
    picture, known = np.zeros((5, 7, 3), np.float32), np.zeros((5, 7), bool)
    picture[0, 0], picture[4, 6] = 1, 3
    known[0, 0] = known[4, 6] = True
    filled = fill_coarse(picture, known)
    np.testing.assert_array_equal(filled[:2, :2], 1)
    np.testing.assert_array_equal(filled[4, 6], 3)
    assert set(np.unique(filled)) <= {1, 2, 3}
    np.testing.assert_array_equal(fill_coarse(picture, known & False), picture)
