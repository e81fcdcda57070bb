# SPDX-License-Identifier: GPL-3.0-or-later
"""Which points are on the front, the presets among them, times at equal error; and who has how much time: made up."""

from __future__ import annotations

import numpy as np
import pytest

from hybrid_addon.measure.error_time import budget, findings
from hybrid_addon.measure.error_time.sweep import Point
from hybrid_addon.presets import Quality


def test_a_point_within_the_noise_is_not_on_the_front_but_may_beat_others():
    points = [made_up(1.0, 1.0), made_up(2.0, 0.5), made_up(3.0, 0.1, clear=False), made_up(2.5, 0.6)]
    assert findings.front(points, [1.0, 2.0, 3.0, 2.5]) == [0, 1]
    assert findings.front([made_up(3.0, 1.0), made_up(1.0, 0.1, clear=False)], [3.0, 1.0]) == []


def test_a_point_is_not_beaten_by_one_whose_smaller_error_may_be_chance():
    """Half the error, everywhere or in one of two blocks of pixels alone."""
    everywhere, one_block = np.full(16, 1.0), np.array([1.0, 0.001] + [0.0] * 14)
    points = [made_up(2.0, 1.0), made_up(1.0, 0.5)]
    for blocks, beaten in ((0.25 * everywhere, True), (4 * one_block, False)):
        points[0].blocks, points[1].blocks = {"rmse_shown": [everywhere]}, {"rmse_shown": [blocks]}
        assert findings.front(points, [2.0, 1.0]) == ([1] if beaten else [1, 0])


def test_two_points_are_compared_by_the_runs_that_both_had():
    """The second run of the first point met a highlight; the other point had no second run."""
    points = [made_up(2.0, 9.0), made_up(1.0, 1.2)]
    points[0].blocks, points[1].blocks = (
        {"rmse_shown": [np.ones(16), 81 * np.ones(16)]},
        {"rmse_shown": [1.4 * np.ones(16)]},
    )
    assert findings.front(points, [2.0, 1.0]) == [1, 0]


def made_up(seconds, shown, clear=True, preset=""):
    return Point(Quality(1, 1, 0.0, 0.0), preset, times=[{"trace": {"wall": seconds, "cpu": seconds}}],
                 error={"all": {"rmse_shown": shown, "rmse_shown_least": 0.3, "flip_ldr": shown / 10}},
                 clear=clear)  # fmt: skip


def test_each_preset_is_told_where_it_is():
    """By RMSE another beats Draft; by FLIP that one is within the noise, and so are all."""
    time = [0.5, 1.0, 9.0]
    points = [made_up(0.5, 1.0), made_up(1.0, 2.0, preset="Draft"), made_up(9.0, 0.01, preset="Final")]
    deep = type("Deep", (), {"floor": {"all": {"rmse_shown": 0.1, "flip_ldr": 0.1}}})
    draft, final, deepest = findings.presets(points, time, deep)
    assert [draft["by"][name]["beaten_by"] for name in ("rmse_shown", "flip_ldr")] == [0, None]
    assert draft["point"] == 1
    assert "0.50 of its time and has 0.50 of its error" in draft["by"]["rmse_shown"]["verdict"]
    assert draft["by"]["flip_ldr"]["verdict"].startswith("not told")
    assert final["by"]["rmse_shown"]["verdict"].startswith("not told")
    assert deepest["point"] is None
    assert deepest["by"]["rmse_shown"]["verdict"].startswith("not measured")
    points[2].error["all"]["rmse_shown_least"] = 0.003
    points[1].error["all"]["flip_ldr"] = None  # without the library
    assert findings.presets(points, time, deep)[0]["by"]["flip_ldr"]["verdict"] == "not told: there is no such error"
    assert findings.presets(points, time, deep)[1]["by"]["rmse_shown"] == {"beaten_by": None, "verdict": "on the front"}


def test_an_equal_error_is_found_or_the_reason_why_not():
    points = [made_up(1.0, 1.0, True), made_up(100.0, 0.01, True), made_up(101.0, 0.001, False)]
    theirs = {"reference": {"floor": {"all": {"rmse_shown": 0.001}}}, "points": [
        {"samples": n, "error": {"all": {"rmse_shown": rmse, "rmse_shown_least": 0.003}}, "time": {"wall": 40.0}}
        for n, rmse in ((1, 0.1), (2, 0.005), (4, 0.002))
    ]}  # fmt: skip
    found, too_exact, noisy = findings.equal_errors(theirs, points, 0.0)
    assert (found["ours"], found["ratio"]) == (pytest.approx(10), pytest.approx(4))
    assert "none of our points" in too_exact["why"]
    assert "within its own" in noisy["why"]
    assert findings.equal_errors({"why": "not asked"}, points, 0.0) == []


def test_what_a_part_leaves_over_goes_on_and_what_it_takes_too_much_does_not(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(budget.time, "perf_counter", lambda: now[0])
    spare = budget.Budget(10, {"a": 0.5, "b": 0.3, "c": 0.2})
    assert spare.begin("a") == 105
    now[0] = 104.0
    assert spare.begin("b") == 104 + 3 + 1
    now[0] = 120.0
    assert spare.begin("c") == 122
    now[0] = 121.0
    spare.end()
    assert spare.spent == {"a": 4, "b": 16, "c": 1}
    stop = budget.Until(121.5)
    assert stop(0.25)
    now[0] = 122.0
    assert not stop(0.5)
    assert stop.done == 0.5
