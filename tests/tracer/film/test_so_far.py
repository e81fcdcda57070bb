# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture is shown while it grows, and in the end is the one that nobody looked at."""

from __future__ import annotations

import numpy as np
import pytest

from hybrid_addon.scene import Settings, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.film.so_far import fill_coarse
from hybrid_addon.tracer.sampling import tiles


@pytest.mark.parametrize("adaptive", [0.0, 0.05])
def test_a_picture_that_is_looked_at_has_the_same_bits(build, monkeypatch, adaptive):
    scene = build.scene(
        (build.box(), build.glass()), camera=build.camera((2, 1, 4), size=(40, 30)), world=World((0.2, 0.4, 0.8))
    )
    settings = Settings(samples=16, adaptive=adaptive, max_depth=6, threads=1, camera_sees="ALL")
    alone = trace(scene, settings)
    monkeypatch.setattr(tiles, "WORTH_GROWING", 0.0)
    shown = []
    film = trace(scene, settings, show=lambda picture: shown.append(picture()))
    for name in ("radiance", "coverage", "residual"):
        np.testing.assert_array_equal(getattr(film, name), getattr(alone, name))
    assert {key: film.sampling[key] for key in ("samples_mean", "samples_max")} == {
        key: alone.sampling[key] for key in ("samples_mean", "samples_max")
    }
    # From a coarse raster to all samples: nearer to the picture each time that there is more.
    far = [float(np.abs(picture - film.radiance).mean()) for picture in shown]
    apart = [distance for distance, last in zip(far, [None, *far], strict=False) if distance != last]
    assert len(apart) >= 3 and apart[0] > 4 * apart[1] > 6 * apart[-1] > 0


def test_what_is_not_known_is_taken_from_the_square_around_it():
    picture, known = np.zeros((5, 7, 3), np.float32), np.zeros((5, 7), bool)
    picture[0, 0], picture[4, 6] = 1, 3
    known[0, 0] = known[4, 6] = True
    filled = fill_coarse(picture, known)
    np.testing.assert_array_equal(filled[:2, :2], 1)
    np.testing.assert_array_equal(filled[4, 6], 3)
    assert set(np.unique(filled)) <= {1, 2, 3}
    np.testing.assert_array_equal(fill_coarse(picture, known & False), picture)
