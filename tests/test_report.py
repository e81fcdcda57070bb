"""Metrics, fits and the front against closed forms; a sweep of a small scene; the page."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.presets import QUALITY, Quality
from hybrid_addon.report import fits, metrics, page
from hybrid_addon.report.regions import regions
from hybrid_addon.report.sweep import Axes, Studio, combinations, knobs, measure, promising, reference, slopes
from hybrid_addon.scene import Settings, World
from hybrid_addon.stability.build import camera, glass, icosphere, make_scene, mirror, quad

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


def test_flip_sees_a_wrong_pixel_and_one_that_is_not_finite():
    pytest.importorskip("flip_evaluator")
    target = np.full((32, 32, 3), 0.2, np.float32)
    picture = target.copy()
    assert metrics.flip(picture, target).max() < 1e-3
    picture[16, 16] = np.nan
    assert metrics.flip(picture, target)[16, 16] > 0.3


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
    axes = Axes((1, 4, 16), (1, 2, 4, 8), (1e-3, 1 / 64), (0.0,), reference_samples=128, repeats=2)
    studio = Studio(scene, Settings(see="ALL", threads=1), None)
    deep = reference(studio, axes)
    single = knobs(studio, axes, deep, lambda line: None)
    points = [p for p in combinations(axes, promising(single["entries"])) if p.preset != "Reference"]
    measure(studio, points, deep, axes.repeats, lambda line: None)
    return axes, deep, single, points


def test_what_is_cut_never_exceeds_its_bound(swept):
    _, _, single, _ = swept
    assert {e["beyond"] for e in single["entries"]} == {0}
    shallow = single["entries"][0]
    assert shallow["rmse"] > 1e-3
    assert shallow["residual_mean"] > 0


def test_error_falls_with_samples_bounces_and_cutoff(swept):
    axes, deep, single, points = swept
    found = slopes(points, deep, single, axes)
    assert found["aa_all"].fit < -0.5
    assert found["depth"].fit <= found["depth"].expected * 0.9  # at least nearly as fast as what is cut off
    assert found["cutoff"].fit > 0.5


def test_each_setting_is_measured_once_and_timed_as_often_as_asked(swept):
    axes, _, _, points = swept
    assert len({p.quality for p in points}) == len(points)
    assert {len(p.films) for p in points} == {axes.repeats}
    assert {label for label, _, _ in QUALITY.values()} - {p.preset for p in points} == {"Reference"}


def test_a_picture_is_not_compared_with_itself(swept):
    """The reference has samples of its own: its seeds are not the render's."""
    _, deep, _, points = swept
    assert deep.floor["all"] > 0
    assert min(p.rmse for p in points) > deep.floor["all"] / 10


def test_combinations_leave_out_adaptive_sampling_where_it_does_nothing():
    points = combinations(replace(Axes(), samples=(1, 2, 4, 16), adaptive=(0.0, 0.05)), [(8, 0.0)])
    adaptive = {p.quality.samples for p in points if p.quality.adaptive and not p.preset}
    assert adaptive == {4, 16}
    assert Quality(1, 8, 0.0, 0.0) in {p.quality for p in points}


def test_the_cells_of_the_page():
    assert page._table(("a<",), [(None,), (0.12345,), (1234567,), (True,)]).count("<td>") == 4
    assert "<th>a&lt;</th>" in page._table(("a<",), [])
    assert "1,234,567" in page._table(("a",), [(1234567,)])
