# SPDX-License-Identifier: GPL-3.0-or-later
"""The inside of closed bodies that let light in and scatter it: an integrating sphere."""

import numpy as np
import pytest

from hybrid_addon.scene import Closure, Expression, Scene, Settings, Surface, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.materials.enclosure import wall_shares
from hybrid_addon.tracer.materials.fields import fields_of

CLEAR, GREY, WHITE = Surface(opacity=0.0, ior=1.0), Surface(base_color=(0.5,) * 3), Surface(base_color=(1.0,) * 3)
GLASS, HALF = Surface(opacity=0.0, ior=1.5), Surface(opacity=0.8, ior=1.0, base_color=(0.5,) * 3)


def shares(surface):
    return np.array(wall_shares(fields_of(surface))).mean(axis=(1, 2))


def test_what_walls_let_pass_and_absorb():
    assert shares(CLEAR) == pytest.approx((1, 0))
    assert shares(GREY) == pytest.approx((0, 0.5))
    assert shares(HALF) == pytest.approx((0.2, 0.4))
    assert shares(GLASS) == pytest.approx(((1 - 0.04 - 0.96 / 21) / 1.5**2, 0), abs=1e-6)


def constant(number):
    """An expression that gives it, whatever is hit."""
    return Expression("add", (number, Expression("multiply", (0.0, Expression("attribute", (), "cosine")))))


def sums(number):
    return Surface(closures=(Closure(number(0.2), CLEAR), Closure(number(0.8), GREY)))


@pytest.mark.parametrize(
    "surface", [HALF, sums(float), sums(constant), Surface(**{**vars(HALF), "opacity": constant(0.8)})]
)
def test_the_inside_is_seen_through_the_front(build, surface):
    """Of the front 0.8 x 0.5, through it 0.2 of the back: 0.8 x 0.5 x 1/3, and 0.2 of the world; the same for numbers,
    expressions, Mix Shader and Custom values."""
    scene = Scene(
        camera=build.camera(half=0.05, size=(4, 4)), surfaces=(surface,), meshes=(build.icosphere(2),),
        instances=(build.instance(0),), world=World((1, 1, 1)),
    )  # fmt: skip
    film = trace(scene, Settings(samples=1, threads=1, camera_sees="ALL"))
    np.testing.assert_allclose(film.radiance, 0.4 + 0.2 * (0.4 / 3 + 0.2), rtol=1e-5)


@pytest.mark.parametrize("parts", [((0.5, GLASS), (0.5, WHITE)), ((0.3, CLEAR), (0.7, WHITE)), ((1.0, GLASS),)])
def test_white_bodies_vanish_in_a_white_world(build, parts):
    surface = Surface(closures=tuple(Closure(w, s) for w, s in parts))
    scene = Scene(
        camera=build.camera(half=0.05, size=(2, 2)), surfaces=(surface,), meshes=(build.icosphere(2),),
        instances=(build.instance(0),), world=World((1, 1, 1)),
    )  # fmt: skip
    film = trace(scene, Settings(samples=1, threads=1, camera_sees="ALL", max_depth=24))
    np.testing.assert_allclose(film.radiance, 1, atol=2e-3)
