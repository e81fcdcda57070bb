# SPDX-License-Identifier: GPL-3.0-or-later
"""The inside of closed bodies that let light in and scatter it: an integrating sphere."""

import numpy as np
import pytest

from hybrid_addon.scene import Closure, Expression, Scene, Settings, Surface, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.materials.enclosure import let_in

CLEAR, GREY, WHITE = Surface(opacity=0.0, ior=1.0), Surface(base_color=(0.5,) * 3), Surface(base_color=(1.0,) * 3)
GLASS = Surface(opacity=0.0, ior=1.5)


def test_an_integrating_sphere():
    assert let_in([Closure(0.2, CLEAR), Closure(0.8, GREY)]) == pytest.approx(np.array([[1 / 3] * 3, [1] * 3]))


def test_white_walls_and_nothing_but_glass_keep_all_of_the_light():
    assert let_in([Closure(0.2, CLEAR), Closure(0.8, WHITE)]) == pytest.approx(1)
    assert let_in([Closure(0.5, GLASS), Closure(0.5, WHITE)])[0] == pytest.approx(1)
    assert let_in([Closure(1.0, GLASS)]) == pytest.approx(1)


def test_of_lamps_glass_lets_in_what_they_are_smaller_by():
    assert let_in([Closure(0.5, GLASS), Closure(0.5, GREY)])[1] == pytest.approx(1 / 1.5**2)


def test_what_is_opaque_or_varies_is_lit_as_ever():
    varies = Expression("attribute", (), "cosine")
    assert let_in([Closure(1.0, GREY)]) == pytest.approx(1)
    assert let_in([Closure(varies, CLEAR), Closure(0.5, GREY)]) == pytest.approx(1)


def test_the_inside_is_seen_through_the_front(build):
    """Of the front 0.8 x 0.5, through it 0.2 of the back: 0.8 x 0.5 x 1/3, and 0.2 of the world."""
    surface = Surface(closures=(Closure(0.2, CLEAR), Closure(0.8, GREY)))
    scene = Scene(
        camera=build.camera(half=0.05, size=(4, 4)), surfaces=(surface,), meshes=(build.icosphere(2),),
        instances=(build.instance(0),), world=World((1, 1, 1)),
    )  # fmt: skip
    film = trace(scene, Settings(samples=1, threads=1, camera_sees="ALL"))
    np.testing.assert_allclose(film.radiance, 0.4 + 0.2 * (0.4 / 3 + 0.2), rtol=1e-5)
