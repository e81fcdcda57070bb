# SPDX-License-Identifier: GPL-3.0-or-later
"""Large pictures are traced strip by strip: nobody sees where, and their memory does not grow with them."""

import math
import time
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import PointLight, Settings, World
from hybrid_addon.tracer import Cancelled, trace
from hybrid_addon.tracer.sampling import strips, tiles
from hybrid_addon.tracer.sampling.strips import Strip, strips_of, together

SIZE = (48, 40)
SETTINGS = Settings(samples=5, camera_sees="ALL", threads=1, max_depth=4, cutoff=1 / 255)
PASSES = frozenset({"depth", "normal", "samples", "reflection", "refraction"})


@pytest.fixture(scope="module")
def scene(build):
    return build.scene(
        (build.icosphere(2, 1, smooth=True), build.glass()),
        (build.quad([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)]), build.matte(), {"ray_traced": False}),
        lights=(PointLight("p", (1, -2, 4), (60, 60, 60)),),
        world=World((0.5, 0.6, 0.7)),
        camera=build.camera((0, -4, 1), (0, 0, 0), (0, 0, 1), SIZE, 0.5),
    )


@pytest.fixture
def short(monkeypatch):
    """Strips of at most 300 pixels: seven rows of the whole picture."""
    monkeypatch.setattr(strips, "LONGEST_STRIP", 300)


def same(a, b):
    for name in ("radiance", "coverage", "residual", "shadow"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    for name in PASSES & a.passes.keys():
        np.testing.assert_array_equal(a.passes[name], b.passes[name], err_msg=name)


@pytest.fixture(scope="module")
def mask(scene):
    """Where the ball is, as the rasteriser would draw it."""
    return trace(scene, replace(SETTINGS, camera_sees="RAY_TRACED")).coverage


@pytest.mark.parametrize("processes", [False, True])
@pytest.mark.parametrize("masked", [False, True])
def test_strips_change_no_bit(scene, mask, monkeypatch, masked, processes):
    how = replace(
        SETTINGS, camera_sees="RAY_TRACED" if masked else "ALL", passes=PASSES, processes=processes, threads=2
    )
    mask = mask if masked else None
    whole = trace(scene, how, mask)
    counts = set()
    for longest in (300, 150, 1):
        monkeypatch.setattr(strips, "LONGEST_STRIP", longest)
        counts.add(len(strips_of(*SIZE, None if mask is None else mask != 0)))
        film = trace(scene, how, mask)
        same(film, whole)
        assert film.sampling["samples_mean"] == pytest.approx(5) and film.invariants == whole.invariants
        assert film.rays["camera"] >= whole.rays["camera"]  # rows that share samples are traced in both strips
    assert max(counts) > 20


def test_shadows_on_the_raster_are_the_same(scene, mask, short):
    how = replace(SETTINGS, camera_sees="RAY_TRACED", raster_shadows=True)
    film = trace(scene, how, mask)
    assert (film.shadow < 1).any()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strips, "LONGEST_STRIP", 1 << 21)
        same(trace(scene, how, mask), film)


def test_adaptive_sampling_is_as_good_and_audited_as_one(scene, mask, short):
    thrifty = replace(SETTINGS, samples=64, adaptive=0.05, camera_sees="RAY_TRACED")
    film, deep = trace(scene, thrifty, mask), trace(scene, replace(thrifty, adaptive=0.0), mask)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strips, "LONGEST_STRIP", 1 << 21)
        whole = trace(scene, thrifty, mask)
    errors = [((f.radiance - deep.radiance) ** 2 * mask[..., None] ** 2).mean() ** 0.5 for f in (film, whole)]
    assert errors[0] < 1.2 * errors[1]
    assert film.sampling["samples_mean"] < 60
    audit = film.sampling["audit"]
    assert 0 < audit["pixels"] <= audit["left_alone"]
    assert 0 < audit["beyond_share_upper_95"] < 1
    assert sum(row["count"] for row in film.skipped if "adaptive" in str(row["why"])) > 0
    assert len(film.skipped) == len({(row["what"], row["why"]) for row in film.skipped})


def test_the_error_is_that_of_the_whole_picture(scene, short):
    parts = trace(scene, SETTINGS).sampling["rmse"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strips, "LONGEST_STRIP", 1 << 21)
        assert trace(scene, SETTINGS).sampling["rmse"] == pytest.approx(parts, rel=0.05)


def test_a_deadline_is_shared_by_the_strips(monkeypatch):
    """Each may take its share; what one takes too long all later ones bear alike."""
    monkeypatch.setattr(strips, "LONGEST_STRIP", 12000)
    four = strips.strips_of(240, 200, None)
    assert len(four) == 4

    def spent(late):
        now, times = 10.0, []
        for strip in four:
            until = strip.deadline(18.0, now) + late.pop(0)
            times.append(until - now)
            now = until
        return times

    assert spent([0, 0, 0, 0]) == pytest.approx([2, 2, 2, 2])
    assert spent([3, 0, 0, 0]) == pytest.approx([5, 1, 1, 1])


def test_every_strip_is_drawn_though_there_is_no_time(scene, short):
    """Coarsely, and what has no sample is filled."""
    wide = replace(scene, camera=replace(scene.camera, resolution=(240, 200), window=(0, 0, 240, 200)))
    film = trace(wide, replace(SETTINGS, samples=4096, passes=PASSES), deadline=time.perf_counter())
    assert (film.coverage == 1).all() and np.isfinite(film.radiance).all()
    assert (film.passes["samples"].reshape(4, -1).sum(axis=1) > 0).all()


def test_progress_goes_on_through_all_strips(scene, short):
    told = []
    trace(scene, replace(SETTINGS, threads=1), progress=lambda done: told.append(done) or True)
    assert told == sorted(told) and told[0] == 0 and told[-1] == 1 and len({round(t, 1) for t in told}) > 5
    with pytest.raises(Cancelled):
        trace(scene, SETTINGS, progress=lambda done: done < 0.5)


@pytest.mark.once
@pytest.mark.parametrize("masked", [False, True])
def test_memory_is_that_of_the_picture_itself(build, monkeypatch, masked):
    """Of twelve times the pixels, no more than what each has in the film (28 bytes) and in passing, once each."""
    monkeypatch.setattr(strips, "LONGEST_STRIP", 1 << 13)
    monkeypatch.setattr(tiles, "LONGEST_TILE", 1 << 13)
    s = build.scene((build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]), build.emitter(1, 1, 1)))
    peak = {}
    for height in (64, 768):
        window = (0, 0, 256, height)
        large = replace(s, camera=replace(s.camera, resolution=window[2:], window=window))
        mask = np.ones((height, 256), np.float32) if masked else None
        settings = Settings(samples=4, camera_sees="RAY_TRACED" if masked else "ALL", threads=1, chunk=1 << 12)
        tracemalloc.start()
        trace(large, settings, mask)
        peak[height] = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert (peak[768] - peak[64]) / (256 * (768 - 64)) < 60


# ------------------------------------------------------------------------------------------------ the strips


@pytest.mark.parametrize("longest", [1, 7, 100, 1 << 20])
def test_strips_cover_every_row_once(monkeypatch, longest):
    monkeypatch.setattr(strips, "LONGEST_STRIP", longest)
    rng = np.random.default_rng(5)
    for _ in range(20):
        height, width = rng.integers(1, 60, 2)
        wanted = rng.random((height, width)) < rng.choice([0.0, 0.01, 0.5, 1.0])
        found = strips_of(int(width), int(height), wanted)
        rows = np.concatenate([np.arange(height)[s.rows] for s in found])
        np.testing.assert_array_equal(rows, np.arange(height))
        assert all(np.count_nonzero(wanted[s.rows]) <= longest + 2 * width for s in found)
        assert sum(s.share for s in found) == pytest.approx(float(wanted.any()))
        assert [s.before for s in found] == pytest.approx([0, *np.cumsum([s.share for s in found])[:-1]])


def test_time_is_shared_by_what_is_left():
    half, last = (Strip(slice(0, 1), 0.5, before) for before in (0.0, 0.5))
    assert half.deadline(110.0, 100.0) == 105 and last.deadline(110.0, 103.0) == 110
    assert half.deadline(math.inf, 100.0) == math.inf


def test_what_strips_expect_adds_up():
    """Squared errors are means over pixels; one strip that knows nothing leaves the picture's error unknown."""
    one = {"samples_mean": 4.0, "samples_max": 8, "rmse": 0.03, "slope": -0.75}
    other = {"samples_mean": 8.0, "samples_max": 16, "rmse": 0.01, "slope": -0.75}
    both = together([(300, one), (100, other), (0, {**one, "rmse": None})])
    assert both["samples_mean"] == 5 and both["samples_max"] == 16
    assert both["rmse"] == pytest.approx(((3 * 0.03**2 + 0.01**2) / 4) ** 0.5)
    assert together([(300, one), (1, {**other, "rmse": None})])["rmse"] is None
    assert together([(0, other)]) == other
