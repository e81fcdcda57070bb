# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a render while it grows, without a window. With one: tests/real_blender/escape.py."""

from __future__ import annotations

import numpy as np
import pytest

from hybrid_addon.blender import session
from hybrid_addon.blender.render import growing

pytestmark = pytest.mark.blender


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(growing.time, "perf_counter", lambda: now[0])
    return now


def test_a_picture_grows_from_eevees_half_about_once_a_second(scene, clock):
    own, window = session.of(scene.name), (0, 0, 4, 2)
    own.begin_frame()
    grows = growing.Growing(scene, window)
    assert own.so_far.picture is None and own.so_far.window == window
    raster, mask = np.full((2, 4, 4), 0.25, np.float32), np.zeros((2, 4), np.float32)
    mask[0], raster[0] = 1, 0
    grows.begins_with(raster, mask)
    np.testing.assert_array_equal(own.so_far.picture, raster[..., :3])
    made = []

    def make():
        made.append(clock[0])
        return np.full((2, 4, 3), len(made), np.float32)

    for clock[0] in (100.1, 100.5, 101.0, 101.2, 102.3):
        grows.show(make)
    assert made == [100.1, 101.2, 102.3]
    np.testing.assert_array_equal(own.so_far.picture[0], 3)  # where the mask is, the traced half
    np.testing.assert_array_equal(own.so_far.picture[1], 0.25)


def test_it_says_how_far_it_is_and_how_long_it_takes(scene, clock):
    own = session.of(scene.name)
    grows = growing.Growing(scene, (0, 0, 4, 2))
    assert grows.told("Tracing", 0.1) == ""  # nothing is known of its speed yet
    clock[0] += 10
    assert grows.told("Tracing", 0.25) == ", about 30 s left"
    assert own.so_far.text == "Tracing 25 %, about 30 s left" and own.so_far.fraction == 0.25
    assert [growing.duration(s) for s in (0.2, 89, 240, 9000)] == ["1 s", "89 s", "4 min", "2.5 h"]


def test_esc_keeps_what_there_is_and_a_failure_does_not(scene, clock):
    own = session.of(scene.name)
    grows = growing.Growing(scene, (0, 0, 4, 2))
    grows.begins_with(np.ones((2, 4, 4), np.float32), np.ones((2, 4), np.float32))
    grows.told("Tracing", 0.5)
    growing.stopped(scene)
    assert own.so_far.picture is not None and own.so_far.text == "Stopped: Tracing 50 %"
    assert own.so_far.fraction is None
    own.fail(ValueError("no"))
    assert own.so_far is None and str(own.error) == "no"


def test_large_pictures_are_shown_with_fewer_pixels(scene, clock):
    grows = growing.Growing(scene, (0, 0, 3000, 30))
    grows.begins_with(np.ones((30, 3000, 4), np.float32), np.ones((30, 3000), np.float32))
    assert max(session.of(scene.name).so_far.picture.shape) <= growing.LONGEST_SIDE
