# SPDX-License-Identifier: GPL-3.0-or-later
"""What camera rays see in a hybrid picture, and how every masked pixel gets a colour."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import PointLight, Settings, SunLight, Surface, Visibility, World
from hybrid_addon.tracer import Cancelled, trace
from hybrid_addon.tracer.core.constants import FAILED_PIXEL
from hybrid_addon.tracer.parallel import pool

HYBRID = Settings(samples=8, threads=1)
FLAGGED, PLAIN = {"ray_traced": True}, {"ray_traced": False}


def left_half(build, z=0.0):
    return build.quad([(-9, -9, z), (0, -9, z), (0, 9, z), (-9, 9, z)], "left")


def everything(build, z=0.0):
    return build.quad([(-9, -9, z), (9, -9, z), (9, 9, z), (-9, 9, z)], "all")


def counted(film, why):
    return sum(entry["count"] for entry in film.skipped if why in entry["why"])


def test_only_flagged_objects_count(build):
    s = build.scene(
        (left_half(build), build.emitter(1, 2, 3), FLAGGED), (everything(build, -1), build.emitter(9, 9, 9), PLAIN)
    )
    film = trace(s, HYBRID)
    np.testing.assert_array_equal(film.coverage[:, :6], 1)
    np.testing.assert_array_equal(film.coverage[:, 10:], 0)
    assert 0 < film.coverage[:, 7].mean() < 1
    # Not multiplied by coverage: the mean over the samples that count, also at the edge.
    np.testing.assert_array_equal(
        film.radiance[film.coverage > 0], np.broadcast_to([1, 2, 3], (int((film.coverage > 0).sum()), 3))
    )
    np.testing.assert_array_equal(film.radiance[film.coverage == 0], 0)


def test_what_is_not_flagged_hides_what_is(build):
    s = build.scene(
        (everything(build), build.emitter(1, 1, 1), FLAGGED), (left_half(build, 1), build.emitter(9, 9, 9), PLAIN)
    )
    film = trace(s, HYBRID)
    assert (film.coverage[:, :6] == 0).all() and (film.coverage[:, 10:] == 1).all()


def test_mirrors_reflect_what_is_not_flagged(build):
    s = build.scene(
        (everything(build), build.mirror(), FLAGGED),
        (build.quad([(-9, -9, 9), (-9, 9, 9), (9, 9, 9), (9, -9, 9)]), build.emitter(0.5, 0.25, 1), PLAIN),
    )
    np.testing.assert_array_equal(trace(s, HYBRID).radiance, np.broadcast_to([0.5, 0.25, 1], (16, 16, 3)))


def test_full_mode_shows_all_and_the_world(build):
    s = build.scene((left_half(build), build.emitter(1, 2, 3), PLAIN), world=World((0.25, 0.5, 0.75)))
    film = trace(s, replace(HYBRID, camera_sees="ALL"))
    np.testing.assert_array_equal(film.coverage, 1)
    np.testing.assert_array_equal(film.radiance[:, 10:], np.broadcast_to([0.25, 0.5, 0.75], (16, 6, 3)))
    transparent = trace(s, replace(HYBRID, camera_sees="ALL", transparent=True))
    np.testing.assert_array_equal(transparent.coverage[:, 10:], 0)
    np.testing.assert_array_equal(transparent.radiance[:, 7], np.broadcast_to([1, 2, 3], (16, 3)))


def test_an_index_matched_surface_before_a_transparent_sky_covers_nothing(build):
    tinted = replace(build.glass(1.0), opacity=0.25, base_color=(0, 0, 0))
    for surface, coverage in ((build.glass(1.0), 0), (tinted, 0.25)):
        s = build.scene((everything(build), surface), world=World((1, 1, 1)))
        film = trace(s, replace(HYBRID, camera_sees="ALL", transparent=True))
        np.testing.assert_array_equal(film.coverage, coverage)
        np.testing.assert_array_equal(film.radiance, 0)


# ------------------------------------------------------------------------------------------------ gaps in the mask


def test_a_thin_object_that_all_samples_miss_is_found_by_more_rays(build):
    wire = build.quad([(0.1, -9, 0), (0.108, -9, 0), (0.108, 9, 0), (0.1, 9, 0)])
    s = build.scene((wire, build.emitter(1, 2, 3)))
    mask = np.zeros((16, 16), np.float32)
    mask[:, 7:9] = 0.01
    film = trace(s, replace(HYBRID, samples=2), mask=mask)
    np.testing.assert_array_equal(film.radiance[mask > 0], np.broadcast_to([1, 2, 3], (32, 3)))
    assert counted(film, "found by more camera rays") > 0


def test_behind_a_pane_that_the_raster_sees_through_the_flagged_object_is_found(build):
    s = build.scene(
        (everything(build), build.emitter(1, 2, 3), FLAGGED), (everything(build, 1), build.emitter(9, 9, 9), PLAIN)
    )
    film = trace(s, HYBRID, mask=np.ones((16, 16), np.float32))
    np.testing.assert_array_equal(film.radiance, np.broadcast_to([1, 2, 3], (16, 16, 3)))
    np.testing.assert_array_equal(film.coverage, 0)
    assert counted(film, "behind what is not ray traced") == 256


def test_pixels_beside_the_object_take_their_neighbours_colour(build):
    s = build.scene((left_half(build), build.emitter(1, 2, 3), FLAGGED))
    mask = np.zeros((16, 16), np.float32)
    mask[4:8, :12] = 1
    film = trace(s, HYBRID, mask=mask)
    np.testing.assert_array_equal(film.radiance[4:8, :12], np.broadcast_to([1, 2, 3], (4, 12, 3)))
    assert (film.radiance[mask == 0] == 0).all()
    assert counted(film, "nearest traced pixel") > 0


def test_a_mask_over_nothing_at_all_is_black_and_finite(build):
    s = build.scene((everything(build), build.emitter(1, 1, 1), PLAIN))
    film = trace(s, HYBRID, mask=np.ones((16, 16), np.float32))
    assert (film.radiance == 0).all() and (film.coverage == 0).all()


def test_an_empty_mask_traces_nothing(build):
    film = trace(build.scene((everything(build), build.mirror())), HYBRID, mask=np.zeros((16, 16), np.float32))
    assert not any(film.rays.values())
    assert (film.radiance == 0).all()


def test_filling_gaps_depends_on_no_thread_or_chunk(build):
    wire = build.quad([(-0.03, -9, 0), (0.03, -9, 0), (0.03, 9, 0), (-0.03, 9, 0)])
    s = build.scene((wire, build.matte()), lights=(PointLight("p", (1, 1, 2), (3, 3, 3)),))
    mask = np.ones((16, 16), np.float32)
    films = [trace(s, replace(HYBRID, threads=t, chunk=c), mask=mask) for t, c in ((1, 1 << 14), (2, 100))]
    np.testing.assert_array_equal(films[0].radiance, films[1].radiance)


# ------------------------------------------------------------------------------------------------ visibility


def hidden(**flags):
    return {"visibility": Visibility(**{"camera": True, "shadow": True, "secondary": True, **flags})}


def test_camera_visibility(build):
    s = build.scene(
        (everything(build, 1), build.emitter(9, 9, 9), hidden(camera=False)),
        (everything(build), build.emitter(1, 1, 1)),
    )
    np.testing.assert_array_equal(trace(s, HYBRID).radiance, 1)


def test_shadow_visibility(build):
    sun = SunLight("sun", (0, 0, 1), (np.pi,) * 3)
    roof = everything(build, 1)
    options = hidden(camera=False, shadow=False)
    s = build.scene((everything(build), build.matte((1, 1, 1))), (roof, Surface(), options), lights=(sun,))
    np.testing.assert_allclose(trace(s, HYBRID).radiance, 1, rtol=1e-6)
    s = build.scene((everything(build), build.matte((1, 1, 1))), (roof, Surface(), hidden(camera=False)), lights=(sun,))
    np.testing.assert_array_equal(trace(s, HYBRID).radiance, 0)


def test_secondary_visibility(build):
    ceiling = build.quad([(-9, -9, 9), (-9, 9, 9), (9, 9, 9), (9, -9, 9)])
    s = build.scene(
        (everything(build), build.mirror()),
        (ceiling, build.emitter(1, 1, 1), hidden(secondary=False)),
        world=World((0.5, 0.5, 0.5)),
    )
    np.testing.assert_array_equal(trace(s, HYBRID).radiance, 0.5)


def test_camera_rays_stay_camera_rays_behind_an_index_matched_surface(build):
    # What only camera rays see is seen through IOR 1, and what they do not see is not.
    back, hider = everything(build, -2), everything(build, -1)
    s = build.scene(
        (everything(build), build.glass(1.0), FLAGGED),
        (hider, build.emitter(9, 9, 9), {"ray_traced": False, "visibility": Visibility(camera=False)}),
        (back, build.emitter(1, 2, 3), {"ray_traced": False, "visibility": Visibility(secondary=False)}),
    )
    np.testing.assert_array_equal(trace(s, HYBRID).radiance, np.broadcast_to([1, 2, 3], (16, 16, 3)))


def test_a_pane_in_front_does_not_hide_what_is_behind_a_flagged_pane(build):
    # Only the first hit of such a pixel is restricted to ray traced geometry; behind it camera rays see all again.
    s = build.scene(
        (everything(build, 1), build.emitter(9, 9, 9), PLAIN),
        (everything(build), build.glass(1.0), FLAGGED),
        (everything(build, -1), build.emitter(1, 2, 3), PLAIN),
    )
    film = trace(s, HYBRID, mask=np.ones((16, 16), np.float32))
    np.testing.assert_array_equal(film.radiance, np.broadcast_to([1, 2, 3], (16, 16, 3)))


def test_clip_planes_limit_camera_rays_only(build):
    s = build.scene(
        (everything(build), build.mirror()),
        (build.quad([(-9, -9, 9), (-9, 9, 9), (9, 9, 9), (9, -9, 9)]), build.emitter(1, 1, 1)),
    )
    near = replace(s, camera=replace(s.camera, clip_end=5.5))
    np.testing.assert_array_equal(trace(near, HYBRID).radiance, 1)  # the ceiling is 14 m along the path
    assert (trace(replace(s, camera=replace(s.camera, clip_end=4.5)), HYBRID).coverage == 0).all()
    assert (trace(replace(s, camera=replace(s.camera, clip_start=5.5)), HYBRID).coverage == 0).all()


@pytest.mark.parametrize("sheets", [1, 3])
def test_a_ray_that_goes_straight_on_has_used_up_its_way_to_the_clip_plane(build, sheets):
    """Index-matched sheets before the clip plane: the wall behind is seen before it, not behind it."""
    wall = (build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]), build.emitter(1, 1, 1))
    panes = [
        (build.quad([(-9, -9, z), (9, -9, z), (9, 9, z), (-9, 9, z)]), build.glass(1.0)) for z in (1, 2, 3)[:sheets]
    ]
    scene = build.scene(wall, *panes, camera=build.camera((0, 0, 5), half=0.01))
    for end, seen in ((5.01, 1), (4.99, 0)):
        film = trace(replace(scene, camera=replace(scene.camera, clip_end=end)), HYBRID)
        np.testing.assert_array_equal(film.radiance, seen)


# ------------------------------------------------------------------------------------------------ the caller


def test_progress_rises_to_one(build, monkeypatch):
    monkeypatch.setattr(pool, "POLL_SECONDS", 1e-4)
    heard = []
    trace(
        build.scene((everything(build), build.matte())),
        replace(HYBRID, samples=64, chunk=64),
        progress=lambda f: heard.append(f) or True,
    )
    assert heard[0] == 0 and heard[-1] == 1
    assert heard == sorted(heard) and len(heard) > 10


def test_cancelling_raises_at_once(build):
    calls = []

    def stop(fraction):
        calls.append(fraction)
        return len(calls) < 3

    with pytest.raises(Cancelled):
        trace(build.scene((everything(build), build.matte())), replace(HYBRID, chunk=64, samples=256), progress=stop)
    assert len(calls) == 3


def test_a_pixel_that_fails_is_pink_and_counted(build):
    light = PointLight("p", (0, 0, 1), (3e38, 0, 0))  # its light overflows float32 near the middle
    s = build.scene(
        (build.quad([(-9, -9, 0.99), (9, -9, 0.99), (9, 9, 0.99), (-9, 9, 0.99)]), build.matte()), lights=(light,)
    )
    film = trace(s, HYBRID)
    assert film.invariants["nan_pixels"] > 0
    pink = (film.radiance == np.float32(FAILED_PIXEL)).all(axis=2)
    assert pink.sum() == film.invariants["nan_pixels"]
    assert np.isfinite(film.radiance).all() and np.isfinite(film.residual).all()


def test_an_empty_scene(build):
    s = build.scene(world=World((0.25, 0.5, 0.75)))
    film = trace(s, HYBRID)
    assert (film.coverage == 0).all() and (film.radiance == 0).all()
    film = trace(s, replace(HYBRID, camera_sees="ALL"))
    np.testing.assert_array_equal(film.radiance, np.broadcast_to([0.25, 0.5, 0.75], (16, 16, 3)))


def test_a_window_of_no_pixels(build):
    s = build.scene((everything(build), build.matte()), camera=build.camera(window=(4, 4, 4, 9)))
    assert trace(s, HYBRID).radiance.shape == (5, 0, 3)
