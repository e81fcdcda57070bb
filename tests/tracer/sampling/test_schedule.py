# SPDX-License-Identifier: GPL-3.0-or-later
"""A deadline: coarse to fine, what is given up first, and that in time nothing is."""

import math
import time
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import PointLight, Settings, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.film.filter import Grid, PixelFilter
from hybrid_addon.tracer.film.pixels import PixelBuffer
from hybrid_addon.tracer.sampling import passes, schedule, tiles

SIZE = (48, 40)
SETTINGS = Settings(samples=13, camera_sees="ALL", threads=1, max_depth=6)


@pytest.fixture(scope="module")
def scene(build):
    return build.scene(
        (build.icosphere(2, 1, smooth=True), build.glass()),
        (build.quad([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)]), build.matte()),
        lights=(PointLight("p", (1, -2, 4), (60, 60, 60)),),
        world=World((0.5, 0.6, 0.7)),
        camera=build.camera((0, -4, 1), (0, 0, 0), (0, 0, 1), SIZE, 0.5),
    )


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands still between passes and goes one second for each camera ray of a pass."""
    now = [0.0]
    stopped = type("Clock", (), {"perf_counter": staticmethod(lambda: now[0])})
    monkeypatch.setattr(schedule, "time", stopped)
    monkeypatch.setattr(passes, "time", stopped)
    run = passes.Passes.run

    def counted(self, pixels, work, *rest):
        done = run(self, pixels, work, *rest)
        now[0] += len(pixels) * work.count
        return done

    monkeypatch.setattr(passes.Passes, "run", counted)
    return now


def skipped(film):
    return {e["what"]: e["count"] for e in film.skipped if "time budget" in str(e["why"])}


@pytest.mark.parametrize("adaptive", [0.0, 0.05])
@pytest.mark.parametrize("samples", [1, 2, 4, 13])
def test_in_time_the_picture_is_the_one_without_a_deadline_exact(scene, samples, adaptive):
    settings = replace(SETTINGS, samples=samples, adaptive=adaptive)
    free, bound = trace(scene, settings), trace(scene, settings, deadline=time.perf_counter() + 1e6)
    for name in ("radiance", "coverage", "residual"):
        np.testing.assert_array_equal(getattr(bound, name), getattr(free, name))
    assert bound.sampling.get("audit") == free.sampling.get("audit")
    assert not skipped(bound)


def test_samples_are_given_up_first_and_passes_are_whole(scene, clock):
    n = SIZE[0] * SIZE[1]
    film = trace(scene, SETTINGS, deadline=6.05 * n)
    assert skipped(film) == {"samples": 7 * n}  # 1 + 1 + 2 + 2 taken of 13
    np.testing.assert_array_equal(film.radiance, trace(scene, replace(SETTINGS, samples=6)).radiance)
    assert film.sampling["rmse"] > 0


def test_the_rest_of_the_time_goes_where_it_shows(scene, clock):
    """Half of another pass: edges get a sample more, and lose a third of the picture's error and more."""
    n, how = SIZE[0] * SIZE[1], replace(SETTINGS, passes=frozenset({"samples"}))
    deep = trace(scene, replace(SETTINGS, samples=256)).radiance
    clock[0] = 0.0
    film = trace(scene, how, deadline=1.5 * n)
    assert n < clock[0] <= 1.5 * n
    assert skipped(film) == {"samples": 12 * n - int(0.4 * n)}
    one = trace(scene, replace(SETTINGS, samples=13), deadline=n * 1.01 + clock[0])
    assert set(np.unique(film.passes["samples"])) == {1, 2}
    error, before = (np.sqrt(((f.radiance.astype(float) - deep) ** 2).mean()) for f in (film, one))
    assert error < 0.67 * before
    assert 0.5 < film.sampling["rmse"] / error < 4


@pytest.mark.parametrize(("deadline", "step"), [(1, 8), (0.06, 4), (0.24, 2)])
def test_then_the_resolution(scene, clock, deadline, step):
    n = SIZE[0] * SIZE[1]
    film = trace(scene, SETTINGS, deadline=deadline if deadline == 1 else deadline * n)
    whole = trace(scene, replace(SETTINGS, samples=2))
    left = n - n // step**2
    assert skipped(film) == {"samples": 12 * n + left, "resolution": left}
    assert film.sampling["samples_max"] == 1
    # Every pixel looks like the nearest that was traced; in the corner of each block that is the pixel itself.
    blocks = film.radiance.reshape(SIZE[1] // step, step, SIZE[0] // step, step, 3)
    np.testing.assert_array_equal(blocks[:, 0, :, 1], blocks[:, 0, :, 0])
    assert (film.coverage == 1).all()
    assert np.abs(film.radiance.astype(float) - whole.radiance).mean() < 0.1


def test_a_masked_sliver_between_the_coarsest_pixels_is_drawn_however_late(scene):
    mask = np.zeros(SIZE[::-1], np.float32)
    mask[19:22, 23] = 0.5  # odd column: on none of the coarse rasters
    film = trace(scene, replace(SETTINGS, camera_sees="RAY_TRACED"), mask, deadline=time.perf_counter() - 1)
    assert (film.radiance[mask > 0] > 0).all()


def test_bounces_are_never_given_up(scene):
    late = trace(scene, SETTINGS, deadline=time.perf_counter() - 1)
    on_time = trace(scene, replace(SETTINGS, samples=2))
    assert late.residual.max() <= on_time.residual.max() * 2
    assert late.rays["refracted"] > 0


def test_a_deadline_is_held(scene):
    """All the work takes minutes: so far below that that no busy machine matters."""
    large = replace(scene, camera=replace(scene.camera, resolution=(480, 400), window=(0, 0, 480, 400)))
    began = time.perf_counter()
    film = trace(large, replace(SETTINGS, samples=4096), deadline=began + 0.6)
    assert time.perf_counter() - began < 30
    assert skipped(film)["samples"] > 0


def test_an_audit_that_came_to_nothing_says_so(scene, clock):
    """All pixels have their first samples, and none has more."""
    thrifty, n = replace(SETTINGS, samples=64, adaptive=0.05), SIZE[0] * SIZE[1]
    late = trace(scene, thrifty, deadline=2.01 * n).sampling["audit"]
    assert (late["pixels"], late["beyond_share_upper_95"]) == (0, 1.0) and late["left_alone"] > 0
    clock[0] = 0.0
    in_time = trace(scene, thrifty, deadline=100 * n).sampling["audit"]
    assert in_time["pixels"] > 0 and in_time["beyond_share_upper_95"] < 1


@pytest.mark.parametrize("deadline", [1e6, math.inf])
def test_a_picture_that_is_even_everywhere_ends_early(build, deadline):
    """So small that nothing of it is audited, either."""
    wall = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])
    scene = build.scene((wall, build.emitter(1, 2, 3)), camera=build.camera(size=(3, 2)))
    film = trace(
        scene, Settings(64, camera_sees="ALL", threads=1, adaptive=0.05), deadline=time.perf_counter() + deadline
    )
    assert film.sampling["samples_max"] == 2 and (film.radiance == [1, 2, 3]).all()
    assert not skipped(film)


def test_two_equal_passes_are_two_halves(scene, clock):
    """As if both had been taken at once."""
    n = SIZE[0] * SIZE[1]
    two = trace(scene, SETTINGS, deadline=2.05 * n).sampling["rmse"]
    at_once = trace(scene, replace(SETTINGS, samples=2)).sampling["rmse"]
    assert two == pytest.approx(at_once, rel=1e-6)


@pytest.mark.parametrize("share", [0.05, 0.3, 1.05])
def test_one_sample_a_pixel_or_less_has_an_error_too(scene, clock, share):
    """Told by how far neighbours differ: at least half of what it is, and of that order."""
    deep = trace(scene, replace(SETTINGS, samples=256)).radiance
    clock[0] = 0.0
    film = trace(scene, SETTINGS, deadline=share * SIZE[0] * SIZE[1])
    error = np.sqrt(((film.radiance.astype(float) - deep) ** 2).mean())
    assert film.sampling["samples_mean"] <= 1
    assert 0.5 < film.sampling["rmse"] / error < 3


def test_totals_know_nothing_at_first():
    grid = Grid.of((0, 0, 3, 1), (3, 1), None, 0)
    assert np.isnan(PixelBuffer.zeros(grid, PixelFilter(1.5, 0), adaptive=False).variance).all()


def test_a_larger_picture_needs_little_more_than_its_pixels(build, monkeypatch):
    """Rays come in tiles: what grows with the picture are its film (20 bytes a pixel) and its sums (40)."""
    monkeypatch.setattr(tiles, "LONGEST_TILE", 1 << 12)
    s = build.scene((build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]), build.emitter(1, 1, 1)))
    peak = {}
    for size in (128, 512):
        window = (0, 0, size, size)
        large = replace(s, camera=replace(s.camera, resolution=window[2:], window=window))
        tracemalloc.start()
        trace(large, Settings(samples=1, camera_sees="ALL", threads=1, chunk=1 << 12))
        peak[size] = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert (peak[512] - peak[128]) / (512**2 - 128**2) < 110


# ------------------------------------------------------------------------------------------------ tiles


@pytest.mark.parametrize(
    ("pixels", "count", "threads", "smallest", "wanted"),
    [
        (1 << 16, 1, 4, tiles.FOR_A_THREAD, 1),  # little work: threads would wait for one another
        (1 << 16, 4, 4, tiles.FOR_A_THREAD, 4),
        (1 << 16, 1, 4, tiles.SMALLEST_TILE, 4),  # processes do not
        (1 << 21, 4, 4, tiles.SMALLEST_TILE, 8),  # none is longer than LONGEST_TILE
        (1 << 20, 4, 16, tiles.SMALLEST_TILE, 32),  # many processes: whoever has time takes another
        (1 << 14, 1, 16, tiles.SMALLEST_TILE, 2),
    ],
)
def test_work_is_dealt_out_whole(pixels, count, threads, smallest, wanted):
    everything = np.arange(pixels)
    dealt = tiles.deal(everything, count, threads, tiles.LONGEST_TILE, smallest)
    assert len(dealt) == wanted
    np.testing.assert_array_equal(np.sort(np.concatenate(dealt)), everything)
    assert max(map(len, dealt)) * count <= tiles.LONGEST_TILE


def test_no_tile_is_a_column_of_the_picture():
    """Where a deal is so many whole rows, tiles would lie one below the other, in the deep part or beside it."""
    width = 1024
    for tile in tiles.deal(np.arange(width * 1024), 8, 16, tiles.LONGEST_TILE, tiles.SMALLEST_TILE):
        assert np.ptp(tile % width) > 0.9 * width


def test_against_a_deadline_tiles_are_as_long_as_may_be_lost(scene, monkeypatch):
    lengths, deal = [], tiles.deal

    def noted(pixels, count, threads, longest, smallest):
        lengths.append(longest)
        return deal(pixels, count, threads, longest, smallest)

    monkeypatch.setattr(tiles, "deal", noted)
    trace(scene, SETTINGS, deadline=time.perf_counter() + 1000)
    assert lengths[-1] == tiles.LONGEST_TILE
    lengths.clear()
    film = trace(scene, replace(SETTINGS, samples=10**6), deadline=time.perf_counter() + 0.4)
    assert film.time["trace"]["wall"] < 30  # of a million samples, hours
    assert lengths[-1] < tiles.LONGEST_TILE / 8
