# SPDX-License-Identifier: GPL-3.0-or-later
"""The residual bounds the error, in every pixel, whatever cut a path short."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import PointLight, Settings, Sphere, World
from hybrid_addon.tracer import trace

SETTINGS = Settings(samples=2, camera_sees="ALL", threads=1)


@pytest.fixture(scope="module")
def nested(build):
    """Glass with a bubble in it, a coloured cube, a mirror floor: paths of all kinds, of radiance at most 1."""
    s = build.scene(
        (build.icosphere(3, 1, smooth=True), build.glass(1.5)),
        (build.icosphere(2, 0.5), build.glass(1.0)),
        (build.box((1.2, -0.5, -0.9), (2, 0.5, 0.2)), build.glass(1.4, transmission_tint=(0.9, 0.6, 0.3))),
        (
            build.quad([(-5, -5, -1), (5, -5, -1), (5, 5, -1), (-5, 5, -1)]),
            build.mirror(0.9, base_color=(0.5, 0.5, 0.5)),
        ),
        lights=(PointLight("p", (2, -3, 6), (9, 9, 9)),),
        world=World((0.3, 0.6, 1.0)),
        camera=build.camera((0, -6, 1.5), (0.5, 0, -0.2), (0, 0, 1), (32, 24), 0.35),
    )
    return replace(s, spheres=(Sphere("ball", (-1.8, -0.5, -0.6), 0.4, 0),))


@pytest.fixture(scope="module")
def deep(nested):
    film = trace(nested, replace(SETTINGS, max_depth=60, cutoff=1e-5))
    assert film.residual.max() < 2e-2
    return film


@pytest.mark.parametrize("cutoff", [0, 1 / 255, 0.05])
@pytest.mark.parametrize("depth", [0, 1, 2, 4, 7])
def test_error_within_residual(nested, deep, depth, cutoff):
    film = trace(nested, replace(SETTINGS, max_depth=depth, cutoff=cutoff))
    assert not any(film.invariants.values())
    error = np.abs(film.radiance.astype(float) - deep.radiance).max(2)
    assert (error <= film.residual.astype(float) + deep.residual + 1e-6).all()
    assert error.max() > 1e-4  # so that the bound says something


@pytest.mark.parametrize("depth", [1, 3, 6])
def test_a_white_furnace_of_everything(nested, depth):
    white = [replace(s, base_color=(1, 1, 1), transmission_tint=(1, 1, 1)) for s in nested.surfaces]
    s = replace(nested, surfaces=tuple(white), lights=(), world=World((1, 1, 1)))
    film = trace(s, replace(SETTINGS, max_depth=depth, cutoff=1e-3))
    np.testing.assert_allclose(film.radiance + film.residual[..., None], 1, atol=2e-6)
