# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of several moments: covered light adds up, colours do not fade."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Camera, Film, Scene, Settings, Sphere, Surface, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.film.shutter import OpenShutter

H, W = 4, 6


def film(coverage, color, **more):
    zeros = np.zeros((H, W), np.float32)
    covered = np.broadcast_to(np.float32(coverage), (H, W)).copy()
    light = np.broadcast_to(np.float32(color), (H, W, 3)).copy()
    plain = Film(light, covered, zeros, {"camera": 5}, {"trace": {"wall": 1.0}}, {"nan_pixels": 0}, [], {"rmse": 0.1})
    return replace(plain, **more)


def test_an_object_that_is_there_for_a_third_of_the_time_keeps_its_colour():
    shutter = OpenShutter()
    shutter.add(film(0.0, 9.0), 2)
    shutter.add(film(1.0, (0.5, 0.25, 1.0)), 1)
    result = shutter.result(None, True)
    assert result.coverage == pytest.approx(1 / 3)
    assert np.allclose(result.radiance, (0.5, 0.25, 1.0))


def test_two_colours_mix_by_the_time_and_the_share_that_they_cover():
    shutter = OpenShutter()
    shutter.add(film(0.5, 1.0), 3)
    shutter.add(film(1.0, 0.0), 1)
    result = shutter.result(None, True)
    assert np.allclose(result.radiance, 1.5 / 2.5)
    assert np.allclose(result.coverage, 2.5 / 4)


def test_a_wanted_pixel_that_no_moment_knew_has_its_neighbours_colour():
    covered = np.ones((H, W), np.float32)
    covered[:, 3:] = 0
    color = np.where(covered[..., None] > 0, np.float32(0.7), np.float32(0)) * np.ones(3, np.float32)
    shutter, wanted = OpenShutter(), np.ones((H, W), bool)
    wanted[:, 5] = False
    shutter.add(film(covered, color), 1)
    result = shutter.result(wanted, True)
    assert np.allclose(result.radiance[:, 3:5], 0.7)
    assert (result.radiance[:, 5] == 0).all() and (result.coverage[:, 3:] == 0).all()
    assert result.skipped[0]["count"] == 2 * H


def test_what_is_counted_adds_up():
    shutter = OpenShutter()
    for _ in range(4):
        shutter.add(film(1.0, 1.0, skipped=[{"what": "rays", "why": "far", "count": 2}]), 1)
    result = shutter.result(None, True)
    assert result.rays == {"camera": 20}
    assert result.time == {"trace": {"wall": 4.0}}
    assert result.skipped == [{"what": "rays", "why": "far", "count": 8}]
    assert result.sampling["rmse"] == pytest.approx(0.1 / 2)  # of four times the samples


def test_memory_is_that_of_the_largest_moment_and_no_moments_film_is_held():
    import gc
    import weakref

    shutter, held = OpenShutter(), []
    for peak, sky in ((None, 30), (900, 10)):
        moment = film(1.0, 1.0, memory={"peak": peak, "film": 40 - sky, "by_texture": {"sky": sky, str(peak): 20}})
        held.append(weakref.ref(moment.radiance))
        shutter.add(moment, 1)
        del moment
    gc.collect()
    assert [ref() for ref in held] == [None, None]
    found = shutter.result(None, True).memory
    assert found == {"peak": 900, "film": 30, "by_texture": {"sky": 30, "None": 20, "900": 20}}
    assert next(iter(found["by_texture"])) == "sky"


def test_parts_of_the_samples_are_the_whole_picture():
    """Whatever stands still: eight moments of two samples are the picture of sixteen samples."""
    camera = Camera("PERSP", np.eye(4), (-1, 1, -1, 1), (12, 12), (0, 0, 12, 12))
    ball = Sphere("Ball", (0.1, 0.0, -3.0), 1.3, 0, ray_traced=True)
    scene = Scene(camera, spheres=(ball,), surfaces=(Surface(reflectivity=1.0),), world=World((0.3, 0.6, 0.9)))
    settings, mask = Settings(samples=16), np.ones((12, 12), np.float32)
    whole, shutter = trace(scene, settings, mask), OpenShutter()
    for start in range(0, 16, 2):
        shutter.add(trace(scene, replace(settings, samples=2, first=start, fill=False), mask), 2)
    result = shutter.result(mask != 0, True)
    assert np.abs(result.coverage - whole.coverage).max() < 0.08  # each part has weights of its own
    assert np.abs(result.coverage - whole.coverage).mean() < 0.01
    assert np.allclose(result.radiance, whole.radiance, atol=1e-5)
