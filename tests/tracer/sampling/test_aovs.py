# SPDX-License-Identifier: GPL-3.0-or-later
"""Data passes: depth and normal in closed form, and what they may not change."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Settings, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.constants import NO_DEPTH

ALL = frozenset({"depth", "normal", "samples"})
SETTINGS = Settings(samples=8, threads=1, passes=ALL)


def half_a_wall(build, z=0.0):
    return build.quad([(-9, -9, z), (0, -9, z), (0, 9, z), (-9, 9, z)], "half")


@pytest.mark.parametrize("projection", ["PERSP", "ORTHO"])
def test_depth_is_measured_along_the_view_axis(build, projection):
    view = replace(build.camera(), projection=projection)
    film = trace(build.scene((half_a_wall(build), build.matte()), camera=view), SETTINGS)
    np.testing.assert_allclose(film.passes["depth"][:, :8], 5, rtol=1e-6)
    np.testing.assert_array_equal(film.passes["depth"][:, 8:], np.float32(NO_DEPTH))
    np.testing.assert_array_equal(film.passes["normal"][:, :8], np.broadcast_to([0, 0, 1], (16, 8, 3)))
    assert not film.passes["normal"][:, 8:].any()
    assert (film.passes["samples"] == 8).all()


def test_normals_of_a_smooth_sphere_point_from_its_centre(build):
    film = trace(build.scene((build.icosphere(3, smooth=True), build.glass())), SETTINGS)
    depth, normal = film.passes["depth"], film.passes["normal"]
    y, x = np.nonzero(depth < 4.5)  # away from the silhouette, where facets show
    assert len(x) > 20
    z = depth[y, x]
    point = np.stack([((x + 0.5) / 16 - 0.5) * z, ((y + 0.5) / 16 - 0.5) * z, 5 - z], 1)
    np.testing.assert_allclose(normal[y, x], point, atol=0.02)


def test_what_hides_a_flagged_object_hides_its_depth(build):
    wall = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], "all")
    s = build.scene(
        (wall, build.matte()), (half_a_wall(build, 1.0), build.matte((0.1, 0.1, 0.1)), {"ray_traced": False})
    )
    depth = trace(s, SETTINGS).passes["depth"]
    np.testing.assert_array_equal(depth[:, :8], np.float32(NO_DEPTH))
    np.testing.assert_allclose(depth[:, 8:], 5, rtol=1e-6)


def test_passes_change_no_bit_of_the_picture_and_none_comes_unasked(build):
    s = build.scene((build.icosphere(), build.glass()))
    with_passes, without = trace(s, SETTINGS), trace(s, replace(SETTINGS, passes=frozenset()))
    assert without.passes == {}
    assert set(with_passes.passes) == ALL
    assert with_passes.rays == without.rays
    for name in ("radiance", "coverage", "residual"):
        np.testing.assert_array_equal(getattr(with_passes, name), getattr(without, name))


def test_a_window_has_its_part_of_the_passes(build):
    s = build.scene((build.icosphere(), build.glass()))
    whole = trace(s, SETTINGS)
    part = trace(replace(s, camera=replace(s.camera, window=(3, 5, 12, 9))), SETTINGS)
    for name in ALL:
        np.testing.assert_array_equal(part.passes[name], whole.passes[name][5:9, 3:12])


def test_an_empty_mask_has_passes_too(build):
    film = trace(build.scene((build.icosphere(), build.glass())), SETTINGS, np.zeros((16, 16), np.float32))
    assert (film.passes["depth"] == np.float32(NO_DEPTH)).all()
    assert not film.passes["samples"].any()


@pytest.mark.parametrize("name", ["background", "passed"])
def test_what_is_seen_through_is_told_by_either_pass_alone(build, name):
    pane = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])
    clear = build.matte(opacity=0.25, ior=1.0)
    scene = build.scene((pane, clear), world=World((0.5, 1.0, 2.0)))
    both = trace(scene, Settings(samples=1, passes=frozenset({"background", "passed"}))).passes
    alone = trace(scene, Settings(samples=1, passes=frozenset({name}))).passes
    assert set(alone) == {name}
    np.testing.assert_array_equal(alone[name], both[name])
    np.testing.assert_allclose(both["passed"], 0.75, rtol=1e-6)
    np.testing.assert_allclose(both["background"], np.broadcast_to([0.375, 0.75, 1.5], (16, 16, 3)), rtol=1e-6)
