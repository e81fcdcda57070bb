# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive supersampling: where it goes on, a prefix of the full pattern, its audit, and the error estimate."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import PointLight, Settings, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.film.filter import Grid
from hybrid_addon.tracer.film.pixels import neighbours_rmse
from hybrid_addon.tracer.sampling import schedule
from hybrid_addon.tracer.sampling.adaptive import looks, upper_limit

FULL = Settings(samples=32, camera_sees="ALL", threads=1, max_depth=6)
THRIFTY = replace(FULL, adaptive=0.05)


@pytest.fixture(scope="module")
def spheres(build):
    """A mirror ball and a glass box on a floor that a lamp lights, before a dark sky."""
    floor = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])
    return build.scene(
        (build.icosphere(3, 1, smooth=True), build.mirror(), {"matrix": build.translation(-1.2, 0, 1)}),
        (build.box((0.4, -0.8, 0), (2, 0.8, 1.6)), build.glass()),
        (floor, build.matte((0.6, 0.5, 0.4))),
        lights=(PointLight("p", (-3, -4, 6), (400, 400, 400)),),
        world=World((0.2, 0.3, 0.5)),
        camera=build.camera((0, -6, 3), (0, 0, 0.7), (0, 0, 1), (64, 48), 0.5),
    )


@pytest.fixture(scope="module")
def full(spheres):
    return trace(spheres, FULL)


@pytest.fixture(scope="module")
def thrifty(spheres):
    return trace(spheres, THRIFTY)


@pytest.fixture(scope="module")
def reference(spheres):
    return trace(spheres, replace(FULL, samples=512, threads=0, seed=1)).radiance.astype(float)


def rmse(film, reference):
    return float(np.sqrt(((film.radiance - reference) ** 2).mean()))


def test_refined_everywhere_it_is_the_full_picture_exact(spheres, full, monkeypatch):
    for look in ("choose", "unsettled"):
        monkeypatch.setattr(schedule, look, lambda pixel_buffer, pixels, *_: np.ones(len(pixels), bool))
    film = trace(spheres, THRIFTY)
    np.testing.assert_array_equal(film.radiance, full.radiance)
    np.testing.assert_array_equal(film.residual, full.residual)
    assert film.sampling["samples_mean"] == 32


def test_it_goes_on_where_there_is_something_to_see(spheres, full, thrifty, reference):
    assert thrifty.rays["camera"] < 0.5 * full.rays["camera"]
    assert rmse(thrifty, reference) < 1.25 * rmse(full, reference)
    four = trace(spheres, replace(FULL, samples=4))
    assert rmse(four, reference) > 2.5 * rmse(thrifty, reference)
    skipped = [e for e in thrifty.skipped if "adaptive" in str(e["why"])]
    assert skipped[0]["count"] == full.rays["camera"] - thrifty.rays["camera"]


def test_a_flat_picture_needs_no_more_than_the_first_samples(build):
    s = build.scene((build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]), build.emitter(1, 1, 1)))
    film = trace(s, THRIFTY)
    audited = film.sampling["audit"]
    assert film.rays["camera"] == 2 * 256 + 30 * audited["pixels"]
    assert audited["left_alone"] == 256
    assert audited["beyond"] == audited["error_max"] == 0
    assert film.sampling["rmse"] == 0


@pytest.mark.parametrize(
    ("what", "needed"), [("an edge of equal colour", True), ("a shadow of a weak lamp", True), ("nothing", False)]
)
def test_what_a_signature_tells_apart(build, what, needed):
    """Contrast alone would see none of these: the threshold is almost 1."""
    camera = build.camera((0, 0, 5), size=(8, 8))
    left = [(-9, -9, 0), (0.01, -9, 0), (0.01, 9, 0), (-9, 9, 0)]
    right = [(0.01, -9, 0), (9, -9, 0), (9, 9, 0), (0.01, 9, 0)]
    parts = [(build.quad([left[0], right[1], right[2], left[3]]), build.matte())]
    lights = (PointLight("p", (0, 0, 50), (1e-3, 1e-3, 1e-3)),)
    if what.startswith("an edge"):
        parts = [(build.quad(left), build.matte()), (build.quad(right), build.matte())]
    if what.startswith("a shadow"):
        blind = build.quad([(-9, -9, 9), (0.01, -9, 9), (0.01, 9, 9), (-9, 9, 9)])  # behind the camera
        parts.append((blind, build.matte()))
    s = build.scene(*parts, lights=lights, world=World((1, 1, 1)), camera=camera)
    film = trace(s, replace(FULL, adaptive=0.2, passes=frozenset({"samples"})))
    more = film.passes["samples"] >= 8
    assert (more.mean(axis=0) == 1).any() == needed
    far = film.passes["samples"][:, [0, 1, 6, 7]]
    assert ((far == 2) | (far == 32)).all()  # two, or all: the audit's
    assert (far == 2).mean() > 0.8


@pytest.mark.parametrize(("threads", "chunk"), [(1, 64), (2, 1000)])
def test_threads_and_chunks_choose_the_same_exact(spheres, thrifty, threads, chunk):
    other = trace(spheres, replace(THRIFTY, threads=threads, chunk=chunk))
    np.testing.assert_array_equal(other.radiance, thrifty.radiance)
    assert other.sampling == thrifty.sampling
    assert other.rays == thrifty.rays


def test_the_audit_finds_what_was_missed(spheres, monkeypatch):
    monkeypatch.setattr(schedule, "choose", lambda pixel_buffer, pixels, *_: np.zeros(len(pixels), bool))
    audited = trace(spheres, THRIFTY).sampling["audit"]
    assert audited["left_alone"] == 64 * 48
    assert audited["beyond"] > 0
    assert audited["error_max"] > 0.02
    assert audited["beyond_share_upper_95"] > audited["beyond"] / audited["pixels"]


def test_the_audit_is_within_its_limits(thrifty):
    audited = thrifty.sampling["audit"]
    assert 0 < audited["pixels"] <= 0.15 * audited["left_alone"]
    assert audited["beyond"] <= 0.1 * audited["pixels"]


@pytest.mark.parametrize(
    ("k", "n", "limit"),
    [(0, 2000, 0.0014967), (0, 10, 0.2588656), (1, 10, 0.3941633), (10, 100, 0.1637224), (10, 10, 1.0), (0, 0, 1.0)],
)
def test_clopper_and_pearsons_limit(k, n, limit):
    """From tables of the binomial distribution; for k = 0 it is 1 - 0.05^(1/n)."""
    assert upper_limit(k, n) == pytest.approx(limit, rel=2e-4)


@pytest.mark.parametrize("settings", [replace(FULL, samples=16), FULL, THRIFTY])
def test_the_estimate_of_the_sampling_error_is_about_right(spheres, reference, settings):
    film = trace(spheres, settings)
    assert 0.5 < film.sampling["rmse"] / rmse(film, reference) < 2


def test_the_error_of_one_sample_is_told_by_its_neighbours(spheres, reference):
    film = trace(spheres, replace(FULL, samples=1))
    assert 0.5 < film.sampling["rmse"] / rmse(film, reference) < 3


def test_so_is_that_of_a_mask_whose_rim_got_more_samples(spheres):
    """Where no sample counts, more are taken: these few pixels say nothing of the others."""
    ray_traced = tuple(replace(i, ray_traced=n < 2) for n, i in enumerate(spheres.instances))
    scene, one = replace(spheres, instances=ray_traced), replace(FULL, camera_sees="RAY_TRACED", samples=1)
    mask = trace(scene, replace(one, samples=256)).coverage
    film, deep = (trace(scene, replace(one, samples=n), mask) for n in (1, 512))
    assert any(entry["what"] == "pixels without a sample" for entry in film.skipped)
    error = ((film.radiance.astype(float) - deep.radiance) * mask[..., None])[mask > 0]
    assert 0.5 < film.sampling["rmse"] / np.sqrt((error**2).mean()) < 3


def test_noise_is_as_far_from_its_mean_as_neighbours_say():
    noise = np.random.default_rng(0).normal(1, 0.1, (3, 900 * 50)).astype(np.float32)
    weight, none = np.full(45000, 0.5, np.float32), np.zeros(45000, bool)
    grid = Grid.of((0, 0, 50, 900), (50, 900), None, 1)
    assert neighbours_rmse(lambda part: noise[:, part], grid, ~none, weight) == pytest.approx(0.05, rel=0.03)
    assert neighbours_rmse(lambda part: np.ones_like(noise[:, part]), grid, ~none, weight) == 0
    assert neighbours_rmse(lambda part: noise[:, part], grid, none, weight) is None


def test_two_samples_leave_nothing_to_decide(spheres):
    few = trace(spheres, replace(FULL, samples=2, adaptive=0.05))
    np.testing.assert_array_equal(few.radiance, trace(spheres, replace(FULL, samples=2)).radiance)
    assert "audit" not in few.sampling


@pytest.mark.parametrize(
    ("samples", "expected"),
    [(1, []), (2, []), (3, [2]), (8, [2]), (9, [2, 8]), (16, [2, 8]), (17, [2, 8, 16]), (100, [2, 8, 16, 32, 64])],
)
def test_it_looks_before_the_last_sample_only(samples, expected):
    assert looks(samples) == expected


@pytest.mark.parametrize("value", [-0.1, 1.0, float("nan")])
def test_a_threshold_out_of_range_is_refused(spheres, value):
    with pytest.raises(ValueError, match="adaptive"):
        trace(spheres, replace(FULL, adaptive=value))
