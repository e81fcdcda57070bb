# SPDX-License-Identifier: GPL-3.0-or-later
"""Metrics, fits and the front against closed forms; a sweep of a small scene; the page."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hybrid_addon.measure.error_time import findings, fits, host, metrics, tables
from hybrid_addon.measure.error_time.reference import pilot, reference
from hybrid_addon.measure.error_time.regions import regions
from hybrid_addon.measure.error_time.renders import CUTOFFS, Axes, Renders
from hybrid_addon.measure.error_time.sweep import Point, combinations, knobs, measure, promising
from hybrid_addon.measure.stability.build import camera, glass, icosphere, make_scene, mirror, quad
from hybrid_addon.presets import QUALITY, Quality
from hybrid_addon.scene import Settings, World

REGION = np.ones((10, 20), bool)


# ------------------------------------------------------------------------------------------------ metrics


def test_errors_of_a_known_difference():
    """A tenth of the values are .3 too bright, the others exact, over a grey of .5."""
    target = np.full((10, 20, 3), 0.5, np.float32)
    picture = target.copy()
    picture[0, :] += 0.3
    e = metrics.error(picture, target, REGION)
    assert e["rmse"] == pytest.approx(0.3 * math.sqrt(0.1))
    assert e["mae"] == e["bias"] == pytest.approx(0.03)
    assert e["max"] == e["p999"] == pytest.approx(0.3)
    assert e["relmse_tev"] == pytest.approx(0.1 * 0.09 / 0.26)
    assert (e["pixels"], e["nonfinite"]) == (200, 0)


def test_what_is_brighter_than_white_shows_as_white():
    target = np.full((10, 20, 3), 0.5)
    target[0] = 1000
    picture = target.copy()
    picture[0] = 900
    regions = {"all": REGION}
    assert metrics.errors(picture, target, regions)["all"]["rmse"] > 10
    assert metrics.errors(picture, target, regions)["all"]["rmse_shown"] == 0
    picture[0] = 0.7
    assert metrics.errors(picture, target, regions)["all"]["rmse_shown"] == pytest.approx(0.3 * math.sqrt(0.1))


def test_only_the_region_counts_and_what_is_not_finite_is_counted():
    target = np.zeros((10, 20, 3))
    picture = target.copy()
    picture[0, 0] = (np.nan, np.inf, 2.0)
    picture[5:] = 9
    region = REGION.copy()
    region[5:] = False
    e = metrics.error(picture, target, region)
    assert (e["nonfinite"], e["max"], e["pixels"]) == (2, 2.0, 100)
    assert metrics.error(picture, target, ~REGION)["rmse"] is None
    assert math.isnan(metrics.rmse(picture, target, ~REGION))


def test_what_is_not_a_number_is_as_wrong_as_can_be():
    target = np.full((10, 20, 3), 0.25)
    picture = target.copy()
    picture[0, 0] = np.nan
    found = metrics.errors(picture, target, {"all": REGION}, (target, target))["all"]
    assert found["rmse_shown"] == pytest.approx(math.sqrt(1 / 200))
    assert found["rmse"] == 0 and found["nonfinite"] == 3
    assert metrics.deciding(picture, target, REGION) == pytest.approx(1)


def test_flip_sees_a_wrong_pixel_and_one_that_is_not_finite():
    pytest.importorskip("flip_evaluator")
    target = np.full((32, 32, 3), 0.2, np.float32)
    picture = target.copy()
    assert metrics.flip(picture, target).max() < 1e-3
    picture[16, 16] = np.nan
    assert metrics.flip(picture, target)[16, 16] > 0.3


def test_how_many_pixels_decide_the_rmse():
    target = np.zeros((10, 20, 3))
    assert metrics.deciding(target, target, REGION) == 0
    assert metrics.deciding(target + 0.1, target, REGION) == pytest.approx(200)
    picture = target + 0.01
    picture[3, 4] = 50  # a highlight: it shows as 1
    decide = (1 + 199e-4) ** 2 / (1 + 199e-8)
    assert metrics.deciding(picture, target, REGION) == pytest.approx(decide)


def test_the_noise_of_the_reference_cancels_where_its_halves_are_given():
    """A picture that is off by 0.01, and a reference whose noise is ten times that: its square would hide it."""
    size, truth = (256, 256, 3), np.full((256, 256, 3), 0.5)
    halves = tuple(truth + rng.normal(0, 0.1, size) for rng in map(np.random.default_rng, (1, 2)))
    everything = np.ones(size[:2], bool)
    for off in (0.01, 0.0):
        (found,) = metrics.errors(truth + off, sum(halves) / 2, {"all": everything}, halves).values()
        assert metrics.tells(found) == (off > 0)
        assert found["rmse_shown"] == pytest.approx(off, abs=0.004)
        assert found["rmse"] > 0.06


def test_three_standard_errors_are_what_the_errors_of_equal_pictures_stay_within():
    """Noise that pixels share with their neighbours, as the pixel filter does: blocks of pixels see through it."""
    rng, errs = np.random.default_rng(3), []
    for _ in range(60):
        noise = rng.normal(0, 0.1, (2, 65, 65, 3))
        noise = (noise[:, 1:, 1:] + noise[:, :-1, 1:] + noise[:, 1:, :-1] + noise[:, :-1, :-1]) / 2
        maps = metrics.maps(np.full((64, 64, 3), 0.5), np.zeros((64, 64, 3)), tuple(0.5 + noise))
        found = metrics.judged(maps, np.ones((64, 64), bool))
        errs.append(float(maps["rmse_shown"].mean()) / (found["rmse_shown_least"] ** 2 / metrics.CLEAR))
    assert 0.75 < np.std(errs) < 1.35  # in standard errors


def test_doubt_is_that_of_the_ratio_of_two_means():
    rng = np.random.default_rng(4)
    ratios, doubts = [], []
    for _ in range(400):
        ours, theirs = rng.exponential(1.0, 200), rng.exponential(3.0, 200)
        ratios.append(math.log(ours.sum() / theirs.sum()))
        doubts.append(metrics.doubt(ours, theirs))
    assert np.mean(doubts) == pytest.approx(np.std(ratios), rel=0.1)
    assert metrics.doubt(ours, 2 * ours) == pytest.approx(0)
    assert metrics.doubt(ours, -ours) == math.inf


def test_errors_by_region_are_those_of_the_region():
    target = np.zeros((10, 20, 3), np.float32)
    picture = target.copy()
    picture[:2] = 0.5
    top = np.zeros((10, 20), bool)
    top[:2] = True
    found = metrics.errors(picture, target, {"top": top, "rest": ~top, "none": top & ~top})
    assert (found["top"]["rmse"], found["rest"]["rmse"], found["none"]["rmse"]) == (0.5, 0.0, None)
    if metrics.flip_library():
        assert found["top"]["flip_ldr"] > 0.5
    assert found["none"]["flip_ldr"] is None


def test_edges_are_where_objects_meet_or_the_mask_is_part():
    ids = np.zeros((6, 8), np.int32)
    ids[:, 4:] = 1
    mask = np.ones((6, 8), np.float32)
    mask[:, 0], mask[0, 7] = 0.0, 0.5
    found = regions(ids, mask)
    assert found["edges"][:, 3:5].all()
    assert found["edges"][0, 7]
    assert np.count_nonzero(found["edges"]) == 2 * 6 + 1
    assert not found["all"][:, 0].any()
    np.testing.assert_array_equal(found["all"], found["edges"] | found["interior"])
    assert not (found["edges"] & found["interior"]).any()


# ------------------------------------------------------------------------------------------------ fits


def test_slopes_of_exact_laws():
    n = [1, 4, 16, 64]
    assert fits.power(n, [3 * x**-0.75 for x in n]).fit == pytest.approx(-0.75)
    assert fits.power(n, [3 * x**-0.75 for x in n]).ci == pytest.approx(0, abs=1e-9)
    assert fits.decay([2, 4, 8], [0.5**d for d in (2, 4, 8)]).fit == pytest.approx(math.log10(0.5))
    assert fits.power([1, 4, 0], [2, 1, 5]).ci is None  # two points that count
    assert fits.slope([1, 1], [2, 3]) is None


def test_the_confidence_interval_holds_the_slope_nineteen_times_of_twenty():
    rng = np.random.default_rng(0)
    x = np.arange(5.0)
    found = [fits.slope(x, 2 * x + rng.normal(size=5)) for _ in range(2000)]
    inside = np.mean([abs(s.fit - 2) <= s.ci for s in found])
    assert 0.935 < inside < 0.965


def test_the_front_is_what_nothing_beats():
    time, error = [1, 2, 3, 4, 5, 1], [9, 5, 6, 5, 1, 10]
    assert fits.pareto(time, error) == [0, 1, 4]


@pytest.mark.parametrize(
    ("other", "beats"),
    [
        ((1.0, 1.0), False),  # the same
        ((0.9998, 1.0), False),  # 0.2 ms of a second are noise
        ((0.95, 0.97), False),  # neither is clear
        ((0.85, 1.005), True),  # clearly faster, as exact
        ((0.85, 1.05), False),  # clearly faster, less exact
        ((0.9999, 0.9), True),  # clearly more exact, no slower
        ((1.05, 0.5), False),  # more exact, but slower
    ],
)
def test_a_point_is_behind_the_front_only_if_another_is_clearly_better(other, beats):
    assert fits.beaten_by(0, [1.0, other[0]], [1.0, other[1]]) == (1 if beats else None)


def test_of_those_that_beat_a_point_the_best_is_told():
    assert fits.beaten_by(0, [1.0, 0.8, 0.1, 0.05], [1.0, 0.9, 0.1, 5.0]) == 2


def test_time_to_an_error_is_straight_on_logarithmic_axes():
    time, error = [1.0, 100.0, 50.0], [1.0, 0.01, 0.9]
    assert fits.time_to(0.1, time[:2], error[:2]) == pytest.approx(10)
    assert fits.time_to(2.0, time, error) == 1.0
    assert fits.time_to(0.001, time, error) is None


# ------------------------------------------------------------------------------------------------ a sweep


@pytest.fixture(scope="module")
def swept():
    """A glass ball between two mirrors."""
    ball = icosphere(2, 0.8, smooth=True)
    left = quad([(-1.5, -2, -2), (-1.5, 2, -2), (-1.5, 2, 2), (-1.5, -2, 2)], "left")
    right = quad([(1.5, -2, -2), (1.5, -2, 2), (1.5, 2, 2), (1.5, 2, -2)], "right")
    view = camera((0.3, -4, 0.2), up=(0, 0, 1), size=(32, 24))
    parts = [(ball, glass()), (left, mirror(0.7)), (right, mirror(0.7))]
    scene = make_scene(*parts, camera=view, world=World((0.5, 0.7, 1.0)))
    axes = Axes((1, 4, 16), (1, 2, 4, 8), (0.0, 1e-5, 1e-3, 1 / 64), (0.0,), reference_samples=128, patient=True,
                repeats=2)  # fmt: skip
    renders = Renders(scene, Settings(camera_sees="ALL", threads=1), None)
    deep = reference(renders, axes, 1.0)
    single = knobs(renders, axes, deep, quiet)
    points = [p for p in combinations(axes, promising(single["entries"])) if p.preset != "Reference"]
    points, late = measure(renders, points, deep, axes.repeats, quiet)
    assert late == []
    return axes, deep, single, points, renders


def quiet(line):
    """Say nothing."""


@pytest.mark.once
def test_what_is_cut_never_exceeds_its_bound(swept):
    """Nor where less is cut than in the picture that it is compared with: that is within its own residual."""
    _, deep, single, points, _ = swept
    assert {e["beyond"] for e in single["entries"]} == {0}
    assert {e["cutoff"] for e in single["entries"] if e["rmse"] > 0} >= {0.0, 1e-5, 1 / 64}
    shallow = single["entries"][0]
    assert shallow["rmse"] > 1e-3
    assert shallow["residual_mean"] > 0
    assert not [text for text in findings.reservations(points, deep, single) if "bound did not hold" in text]


@pytest.mark.once
def test_a_bound_that_does_not_hold_is_said(swept):
    _, deep, single, points, _ = swept
    broken = {**single, "entries": [{**single["entries"][0], "beyond": 7}, *single["entries"][1:]]}
    (text,) = [text for text in findings.reservations(points, deep, broken) if "bound did not hold" in text]
    assert "in 7 pixels" in text


@pytest.mark.once
def test_a_counter_that_must_be_0_and_is_not_is_said(swept):
    _, deep, single, points, _ = swept
    assert not any("must be 0" in text for text in findings.reservations(points, deep, single))
    lossy = [replace(points[0], invariants={**points[0].invariants, "lost_media": 2}), *points[1:]]
    assert findings.invariants(lossy)["lost_media"] == {"value": 2, "tol": 0, "pass": False}
    assert "counters that must be 0 are not: lost media 2" in findings.reservations(lossy, deep, single)


@pytest.mark.once
def test_the_brightest_radiance_is_looked_for_in_the_reference_too(swept):
    axes, deep, single, _, renders = swept
    dazzling = replace(deep.films[1], radiance=deep.films[1].radiance + single["Lmax"])
    found = knobs(renders, axes, replace(deep, films=(deep.films[0], dazzling)), quiet)
    assert found["Lmax"] == pytest.approx(2 * float(dazzling.radiance.max()))


@pytest.mark.once
def test_error_falls_with_samples_bounces_and_cutoff(swept):
    axes, deep, single, points, _ = swept
    found = findings.slopes(points, deep, single, axes)
    assert found["aa_all"].fit < -0.5
    assert found["depth"].fit <= found["depth"].expected * 0.9  # at least nearly as fast as what is cut off
    assert found["cutoff"].fit > 0.5


@pytest.mark.once
def test_points_within_the_noise_make_no_slope_and_no_front_and_the_reason_is_told(swept):
    axes, deep, single, points, _ = swept
    clear = [p.clear for p in points]
    assert clear == [p.shown > p.error["all"]["rmse_shown_least"] for p in points]
    lost = {region: {"rmse_shown": 0.1, "rmse_shown_least": 1e3} for region in deep.floor}
    hidden = [replace(p, clear=False, error=lost) for p in points]
    found = findings.slopes(hidden, deep, single, axes)
    assert found["aa_all"].fit is None
    assert "0 of 3 points stand clear" in found["aa_all"].why
    assert found["depth"].fit is not None  # it has nothing to do with the reference
    assert findings.front(hidden, [1.0] * len(points)) == []
    assert "beaten by one whose error is within" in findings.no_front([], points, deep)
    assert findings.no_front([0], points, deep) == ""
    assert "no error can be told from none" in findings.no_front([], hidden, deep)
    assert f"too noisy for {len(points)} of {len(points)}" in findings.reservations(hidden, deep, single)[0]


@pytest.mark.once
def test_what_there_is_no_time_for_is_left_out(swept):
    axes, deep, single, points, renders = swept
    fresh = [Point(p.quality, p.preset) for p in points]
    assert measure(renders, fresh, deep, 3, quiet, until=0.0) == ([], fresh)
    dear = fresh[0].quality
    measured, late = measure(
        renders, fresh, deep, 1, quiet, time.perf_counter() + 600, lambda p: 1e4 * (p.quality == dear)
    )
    assert [p.quality for p in late] == [dear]
    assert len(measured) == len(fresh) - 1
    endless = Point(Quality(60000, 8, 0.0, 0.0))  # what it costs is not known
    assert measure(renders, [endless], deep, 1, quiet, time.perf_counter() + 0.5) == ([], [endless])
    none = knobs(renders, axes, deep, quiet, until=0.0)
    assert (none["entries"], none["left_out"]) == ([], len(single["entries"]))
    assert findings.slopes(points, deep, none, axes)["depth"].why
    assert promising(none["entries"]) == []


@pytest.mark.once
def test_the_reference_takes_the_samples_that_there_is_time_for(swept, monkeypatch):
    axes, _, _, _, renders = swept
    hurried = replace(axes, patient=False)
    with monkeypatch.context() as patch:
        stopped = SimpleNamespace(perf_counter=lambda: 100.0)
        patch.setattr("hybrid_addon.measure.error_time.reference.time", stopped)
        assert reference(renders, hurried, 1.0, 108.5).quality.samples == 8
        assert reference(renders, hurried, 1.0, 100.0).quality.samples == 2
    assert pilot(renders, replace(hurried, reference_samples=2), time.perf_counter() + 600).cutoff == CUTOFFS[0]
    stopped = pilot(renders, hurried, time.perf_counter())
    assert not stopped.finished
    assert stopped.each > 0


def test_settings_more_exact_than_the_noise_are_not_worth_more_time():
    entries = [{"max_depth": d, "cutoff": 0.0, "seconds": d, "rmse_shown": 10.0**-d} for d in (1, 2, 3, 4, 5)]
    assert promising(entries, at_most=9) == [(d, 0.0) for d in (1, 2, 3, 4, 5)]
    assert promising(entries, noise=2e-2, at_most=9) == [(1, 0.0), (2, 0.0), (3, 0.0)]


@pytest.mark.once
def test_each_setting_is_measured_once_and_timed_as_often_as_asked(swept):
    axes, _, _, points, _ = swept
    assert len({p.quality for p in points}) == len(points)
    assert {len(p.times) for p in points} == {axes.repeats}
    assert {label for label, _, _ in QUALITY.values()} - {p.preset for p in points} == {"Reference"}


@pytest.mark.once
def test_presets_are_measured_before_the_time_is_gone(swept):
    _, _, _, points, _ = swept
    assert [bool(p.preset) for p in points] == sorted((bool(p.preset) for p in points), reverse=True)


@pytest.mark.once
def test_a_picture_is_not_compared_with_itself(swept):
    """The reference has samples of its own: its seeds are not the render's."""
    _, deep, _, points, _ = swept
    assert deep.noise() > 0
    assert min(p.error["all"]["rmse"] for p in points) > deep.noise() / 10


def test_combinations_leave_out_adaptive_sampling_where_it_does_nothing():
    points = combinations(replace(Axes(), samples=(1, 2, 4, 16), adaptive=(0.0, 0.05)), [(8, 0.0)])
    adaptive = {p.quality.samples for p in points if p.quality.adaptive and not p.preset}
    assert adaptive == {4, 16}
    assert Quality(1, 8, 0.0, 0.0) in {p.quality for p in points}


def test_the_cells_of_the_page():
    assert tables.table(("a<",), [(None,), (0.12345,), (1234567,), (True,)]).count("<td>") == 4
    assert "<th>a&lt;</th>" in tables.table(("a<",), [(1,)])
    assert "1,234,567" in tables.table(("a",), [(1234567,)])
    assert '<th class="text">a</th>' in tables.table(("a",), [("b&",)])
    assert '<td class="text">b&amp;</td>' in tables.table(("a",), [("b&",)])
    assert tables.table(("a",), []) == ""


def test_the_commit_is_the_one_that_git_noted(tmp_path, monkeypatch):
    """Loose, packed, without a branch; none where there is no checkout."""
    monkeypatch.setattr(host, "ROOT", tmp_path)
    assert host.commit() is None
    git, long = tmp_path / ".git", "0123456789abcdef0123"
    (git / "refs" / "heads").mkdir(parents=True)
    (git / "HEAD").write_text("ref: refs/heads/main\n")
    (git / "packed-refs").write_text(f"# pack-refs\n{long} refs/heads/main\nffff refs/heads/other\n")
    assert host.commit() == long[:12]
    (git / "refs" / "heads" / "main").write_text("a" * 20 + "\n")
    assert host.commit() == "a" * 12
    (git / "HEAD").write_text(long + "\n")
    assert host.commit() == long[:12]
